"""Pictures of a bed: its packing as one sees it, and its conductivity over the temperature at each pressure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from etc_engine.output.figures.canvas import COLOURS, MARKERS, new_figure, style
from etc_engine.output.figures.packing import draw_packing
from etc_engine.output.figures.spheres import draw_edges, draw_view
from etc_engine.packing.particles import ParticlePacking
from etc_engine.study.quantities import heading_of, word_of

if TYPE_CHECKING:
    import xarray

SIZES = colormaps["cividis"]
EQUAL = 0.62
"""Place in the colours of spheres of one size."""
PIXELS = 900
"""Along the longer side of the view of a bed."""
BED_MODEL = "zehner_bauer_schluender"
"""The model of a bed that takes gas, pressure and radiation."""


def draw_bed(packing: ParticlePacking) -> Figure:
    """Figure of a packing as one sees it: disks in their box; spheres from the side, coloured by their radii."""
    if packing.dimension == 2:
        return draw_packing(packing)
    figure = new_figure(6.4, 5.4)
    axes = figure.add_subplot()
    radii = packing.radii
    scale = Normalize(float(radii.min()), float(radii.max()))
    equal = float(np.ptp(radii)) <= 1e-6 * float(radii.max())
    view, frame = draw_view(packing, SIZES(np.full(radii.size, EQUAL) if equal else scale(radii)), PIXELS)
    axes.imshow(view, extent=frame, interpolation="bilinear", zorder=2)
    draw_edges(axes, packing)
    axes.margins(0.05)
    axes.set_axis_off()
    lengths = " x ".join(f"{length:.3g}" for length in packing.box.lengths)
    axes.set_title(f"{packing.count} spheres, density {packing.density:.4f}, box {lengths} m", fontsize=10, pad=18)
    if not equal:
        bar = figure.colorbar(ScalarMappable(scale, SIZES), ax=axes, shrink=0.6, aspect=25)
        bar.set_label("radius [m]", fontsize=9)
        bar.ax.tick_params(labelsize=8)
    return figure


def draw_over_temperature(comparison: xarray.Dataset) -> Figure | None:
    """Figure of the mean conductivity over the temperature, a line for each pressure, with its confidence interval.

    Parameters
    ----------
    comparison : xarray.Dataset
        From `etc_engine.comparison.evaluate_models`. Of other dimensions the last value is drawn, and named.

    Returns
    -------
    Figure or None
        None for a sweep with fewer than two temperatures.
    """
    if comparison.sizes.get("temperature", 1) < 2:
        return None
    others = [d for d in comparison["conductivity_mean"].dims if d not in ("temperature", "pressure")]
    shown = comparison.isel(dict.fromkeys(others, -1))
    pressures = shown["pressure"].values if "pressure" in shown.dims else [None]
    figure = new_figure(7.2, 4.6)
    axes = figure.add_subplot()
    style(axes)
    t = shown["temperature"].values
    for k, pressure in enumerate(pressures):
        one = shown if pressure is None else shown.sel(pressure=pressure)
        colour = COLOURS[k % len(COLOURS)]
        label = "simulation" if pressure is None else f"{pressure:.4g} Pa"
        axes.fill_between(t, one["conductivity_ci_low"], one["conductivity_ci_high"], color=colour, alpha=0.2, lw=0)
        axes.plot(t, one["conductivity_mean"], color=colour, marker=MARKERS[k % len(MARKERS)], label=label)
        if BED_MODEL in one["model"].values:
            axes.plot(t, one["model_conductivity"].sel(model=BED_MODEL), "--", color=colour, lw=1.0)
    axes.set_xlabel(heading_of("temperature", shown["temperature"].attrs))
    axes.set_ylabel("effective conductivity [W/(m K)]")
    fixed = ", ".join(word_of(str(d), comparison[d].values[-1]) for d in others if comparison.sizes[d] > 1)
    dashed = "dashed: Zehner, Bauer and Schlünder" if BED_MODEL in shown["model"].values else ""
    axes.set_title("; ".join(text for text in (fixed, dashed) if text), fontsize=9)
    axes.legend(frameon=False, fontsize=9, title=None if "pressure" not in shown.dims else "pressure of the gas")
    return figure
