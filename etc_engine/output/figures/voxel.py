"""Pictures of voxels: a section through a composite and its heat flux."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from etc_engine.engines.voxel.section import Section
from etc_engine.output.figures.canvas import TEXT, new_figure, save

BRIGHTEST = 99.8
"""Percentile of the flux that the colours reach up to; a few voxels at narrow gaps carry far more."""


def save_section(section: Section, path: Path | str, caption: str = "") -> None:
    """Write a picture of a section: the inclusions, and the magnitude of the heat flux.

    Parameters
    ----------
    section : Section
    path : path
        Ending in png, pdf, svg or jpg.
    caption : str, optional

    Raises
    ------
    OutputError
    """
    save(draw_section(section, caption), path)


def draw_section(section: Section, caption: str = "") -> Figure:
    """Figure of a section: volume fraction of the inclusions on the left, heat flux on the right."""
    width, height = section.extent
    size = 3.2 / max(width, height)
    figure = new_figure(2.0 * max(width * size, 2.0) + 1.6, max(height * size, 1.6) + 1.0)
    left, right = figure.subplots(1, 2)
    extent = (0.0, width, 0.0, height)
    left.imshow(section.fractions.T, origin="lower", extent=extent, cmap="Blues", vmin=0.0, vmax=1.3)
    top = float(np.percentile(section.flux, BRIGHTEST))
    image = right.imshow(section.flux.T, origin="lower", extent=extent, cmap="inferno", vmin=0.0, vmax=top)
    bar = figure.colorbar(image, ax=right, shrink=0.8, extend="max")
    bar.set_label("heat flux [W/m$^2$] at a mean gradient\nof 1 K/m along x", fontsize=TEXT)
    bar.ax.tick_params(labelsize=TEXT)
    left.set_title("inclusions", fontsize=TEXT)
    right.set_title("heat flux", fontsize=TEXT)
    for axes in (left, right):
        axes.set_xlabel("x [m]", fontsize=TEXT)
        axes.tick_params(labelsize=TEXT)
    left.set_ylabel("y [m]", fontsize=TEXT)
    if section.height is not None:
        caption = f"section at z = {section.height:.4g} m" + (f", {caption}" if caption else "")
    if caption:
        figure.suptitle(caption, fontsize=TEXT)
    return figure
