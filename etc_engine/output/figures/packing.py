"""A picture of a packing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure

from etc_engine.arrays import Floats
from etc_engine.output.figures.canvas import INK, TEXT, new_figure, save
from etc_engine.packing.particles import ParticlePacking


def save_packing(packing: ParticlePacking, path: Path | str) -> None:
    """Write a picture of a packing: its disks to scale, in its box.

    Parameters
    ----------
    packing : ParticlePacking
        Disks, or spheres, which are seen along z with the highest in front.
    path : path
        File ending in png, pdf or svg.

    Raises
    ------
    OutputError
        If the file cannot be written, or its ending is none of these.
    """
    save(draw_packing(packing), path)


def draw_packing(packing: ParticlePacking) -> Figure:
    """Figure of a packing; walls are drawn solid, periodic sides dashed with the disks' images cut there."""
    width, height = packing.box.lengths[:2]
    size = 6.0 / max(width, height)
    figure = new_figure(max(width * size, 2.0) + 1.4, max(height * size, 1.5) + 0.8)
    draw_particles(figure.add_subplot(), packing)
    return figure


def draw_particles(axes: Axes, packing: ParticlePacking) -> None:
    """Draw the particles of a packing to scale, in its box."""
    centers, radii, depth = _seen(packing)
    spheres = packing.dimension == 3
    shade = depth if spheres else radii
    discs = EllipseCollection(
        2.0 * radii,
        2.0 * radii,
        np.zeros(radii.size),
        units="xy",
        offsets=centers,
        offset_transform=axes.transData,
        array=shade,
        cmap="viridis" if spheres else "Blues",
        edgecolors=INK,
        linewidths=min(0.6, 20.0 / np.sqrt(radii.size)),
    )
    low, high = float(shade.min()), float(shade.max())
    discs.set_clim(low if spheres else 2.0 * low - 1.2 * high, high if spheres else 1.8 * high - 0.4 * low)
    axes.add_collection(discs)
    if high - low > 1e-9 * high:
        bar = axes.figure.colorbar(discs, ax=axes, shrink=0.5, aspect=25, pad=0.02)
        bar.set_label("height z [m]" if spheres else "radius [m]", fontsize=TEXT)
        bar.ax.set_ylim(low, high)
        bar.ax.tick_params(labelsize=TEXT)
    _draw_box(axes, packing)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]", fontsize=TEXT)
    axes.set_ylabel("y [m]", fontsize=TEXT)
    axes.tick_params(labelsize=TEXT)
    kind = "spheres" if spheres else "disks"
    seen = ", seen along z" if spheres else ""
    axes.set_title(f"{packing.count} {kind}, density {packing.density:.4f}{seen}", fontsize=TEXT)
    axes.spines[:].set_visible(False)


def _seen(packing: ParticlePacking) -> tuple[Floats, Floats, Floats]:
    """Centres in the plane, radii and heights of what is drawn, with the images across periodic sides."""
    centers, radii = packing.centers, packing.radii
    for axis in range(2):
        if packing.box.periodic[axis]:
            length = packing.box.lengths[axis]
            step = np.zeros(packing.dimension)
            step[axis] = length
            over_low, over_high = centers[:, axis] < radii, centers[:, axis] > length - radii
            centers = np.concatenate([centers, centers[over_low] + step, centers[over_high] - step])
            radii = np.concatenate([radii, radii[over_low], radii[over_high]])
    depth = centers[:, 2] if packing.dimension == 3 else np.zeros(radii.size)
    order = np.argsort(depth, kind="stable")
    return centers[order, :2], radii[order], depth[order]


def _draw_box(axes: Axes, packing: ParticlePacking) -> None:
    width, height = packing.box.lengths[:2]
    styles = ["--" if flag else "-" for flag in packing.box.periodic]
    for x in (0.0, width):
        axes.plot([x, x], [0.0, height], styles[0], color=INK, linewidth=1.4, clip_on=False)
    for y in (0.0, height):
        axes.plot([0.0, width], [y, y], styles[1], color=INK, linewidth=1.4, clip_on=False)
    margins = [0.0 if flag else 0.02 * max(width, height) for flag in packing.box.periodic[:2]]
    axes.set_xlim(-margins[0], width + margins[0])
    axes.set_ylim(-margins[1], height + margins[1])
