"""Pictures of how a sweep settles: running statistics, histograms, system size."""

from __future__ import annotations

import itertools
import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from etc_engine.output.figures.canvas import COLOURS, GREY, INK, MARKERS, TEXT, legend, new_panels
from etc_engine.study.quantities import SWEPT, word_of

if TYPE_CHECKING:
    import xarray

MOST_PANELS = 24


def cells(values: xarray.DataArray) -> list[tuple[str, xarray.DataArray]]:
    """A short name and the values of every cell of a sweep, densities outermost."""
    dims = [dim for dim in SWEPT if dim in values.dims]
    found = []
    for index in itertools.product(*(range(values.sizes[dim]) for dim in dims)):
        picked: dict[Any, int] = dict(zip(dims, index, strict=True))
        words = [word_of(dim, values[dim].values[i]) for dim, i in picked.items()]
        found.append((", ".join(words), values.isel(picked)))
    return found


def draw_convergence(running: xarray.Dataset) -> Figure:
    """Running mean over the final one, and relative half-width with the n^(-1/2) it should follow.

    Parameters
    ----------
    running : xarray.Dataset
        From `etc_engine.comparison.convergence.running_statistics`.
    """
    figure, (left, right) = new_panels(1, 2)
    n = running["realization"].values + 1
    last: list[float] = []
    for density, colour in zip(running["density"].values, itertools.cycle(COLOURS), strict=False):
        part = running.sel(density=density)
        label = f"density {density:.4g}"
        for (_, mean), (_, width) in zip(cells(part["mean"]), cells(part["half_width"]), strict=True):
            final = float(mean[-1])
            if not final > 0.0:
                continue
            relative = 100.0 * width.values / final
            last.append(float(relative[-1]))
            left.plot(n, mean.values / final, color=colour, linewidth=0.9, alpha=0.8, label=label)
            right.plot(n, np.where(relative > 0.0, relative, np.nan), color=colour, linewidth=0.9, alpha=0.8)
            label = ""
    left.axhline(1.0, color=INK, linewidth=0.7)
    left.set_ylabel("running mean over the final mean [-]")
    if 0 < running.sizes["density"] <= len(COLOURS):
        legend(left)
    if n.size > 2 and max(last, default=0.0) > 0.0:
        _draw_guide(right, n, max(last))
    right.set_ylabel("relative half-width of the interval [%]")
    for axes in (left, right):
        axes.set_xlabel("realizations n")
    return figure


def _draw_guide(axes: Axes, n: np.ndarray, level: float) -> None:
    """Logarithmic axes, and the slope that independent realizations have, down to a level."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    guide = np.array([float(n[1]), float(n[-1])])
    axes.plot(guide, level * np.sqrt(guide[-1] / guide), "--", color=GREY, linewidth=1.0, label="$n^{-1/2}$")
    legend(axes)
    ticks = [tick for tick in (2, 5, 10, 20, 50, 100, 200, 500, 1000, 10000) if n[0] <= tick <= n[-1]]
    axes.set_xticks(ticks, [str(tick) for tick in ticks])
    axes.set_xticks([], minor=True)


def draw_histograms(values: xarray.DataArray) -> Figure:
    """Histogram of the conductivity over realizations, a panel for every cell, at most `MOST_PANELS`.

    Parameters
    ----------
    values : xarray.DataArray
        From `etc_engine.comparison.convergence.samples`.
    """
    panels = [(name, cell.values[np.isfinite(cell.values)]) for name, cell in cells(values)]
    panels = [(name, data) for name, data in panels if data.size][:MOST_PANELS]
    columns = min(max(len(panels), 1), 3)
    rows = max(-(-len(panels) // columns), 1)
    figure, grid = new_panels(rows, columns, 2.2 if rows > 1 else 3.0)
    for axes, (name, data) in zip(grid, panels, strict=False):
        _draw_histogram(axes, data)
        axes.set_title(textwrap.fill(name, 34 if columns > 1 else 80), fontsize=TEXT)
    for axes in grid[len(panels) :]:
        axes.set_visible(False)
    figure.supxlabel("conductivity [W m$^{-1}$ K$^{-1}$]; line: mean", fontsize=TEXT)
    figure.supylabel("realizations", fontsize=TEXT)
    return figure


def _draw_histogram(axes: Axes, data: np.ndarray) -> None:
    spread = float(np.ptp(data))
    bins = "sturges" if spread > 1e-12 * abs(float(data.max())) else 1
    axes.hist(data, bins=bins, color=COLOURS[5], edgecolor="white", linewidth=0.5)
    axes.axvline(float(data.mean()), color=COLOURS[1], linewidth=1.2)
    axes.locator_params(axis="x", nbins=4)
    axes.locator_params(axis="y", nbins=4, integer=True)


def draw_system_sizes(systems: xarray.Dataset) -> Figure:
    """Mean conductivity and spread of a realization against the number of particles.

    Parameters
    ----------
    systems : xarray.Dataset
        From `etc_engine.comparison.convergence.system_sizes`.
    """
    figure, (left, right) = new_panels(1, 2)
    looks = itertools.cycle(zip(COLOURS, MARKERS, strict=True))
    columns = [cells(systems[name]) for name in ("conductivity_mean", "half_width", "relative_spread")]
    particles = systems["particles"].broadcast_like(systems["conductivity_mean"])
    for i, (name, count) in enumerate(cells(particles)):
        colour, marker = next(looks)
        mean, width, spread = (column[i][1].values for column in columns)
        left.errorbar(
            count, mean, width, color=colour, marker=marker, markersize=4, linewidth=1.0, capsize=2, label=name
        )
        right.plot(count, 100.0 * spread, color=colour, marker=marker, markersize=4, linewidth=1.0)
    for axes in (left, right):
        axes.set_xscale("log")
        axes.set_xlabel("particles")
    right.set_yscale("log")
    left.set_ylabel("conductivity [W m$^{-1}$ K$^{-1}$]")
    right.set_ylabel("standard deviation of a realization [%]")
    if systems.sizes["system"] > 1:
        ends = np.array([float(particles.min()), float(particles.max())])
        level = 100.0 * float(np.nanmedian(systems["relative_spread"].isel(system=0)))
        right.plot(ends, level * np.sqrt(ends[0] / ends), "--", color=GREY, linewidth=1.0, label="$N^{-1/2}$")
        legend(right)
    if len(columns[0]) <= 8:
        legend(left)
    return figure
