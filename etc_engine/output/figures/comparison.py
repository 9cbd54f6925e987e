"""The main figure: simulated conductivity against density or another dimension, with models as thin lines."""

from __future__ import annotations

import itertools
import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from etc_engine.models import CATALOGUE
from etc_engine.output.figures.canvas import (
    COLOURS,
    DOWN_MARK,
    GREY,
    INK,
    MARKERS,
    SMALL,
    TEXT,
    label_ends,
    legend,
    new_figure,
    save,
    style,
)
from etc_engine.study.quantities import QUANTITIES, SWEPT, heading_of, word_of
from etc_engine.sweep.table import MEASURES

if TYPE_CHECKING:
    import xarray

MEAN_FIELD = "contact_mean_field"

MARGIN = 0.25
"""Room above and below the simulated values of cells with pores that conduct, over their range, for model lines."""

DENSITY = "density (particle {measure} over box {measure}) [-]"

DECADES = 1.3
"""A logarithmic axis is used when the simulated values span more than this many decades."""

MOST_PANELS = 12

WIDTH = 6.8
"""Of the figure in inches: `SMALL` letters have 9 pixels where it is shown on 600."""

BOUNDS_NOTE = "Hashin-Shtrikman bounds hold for overlapping particles"


@dataclass(frozen=True)
class _Axis:
    """The dimensions of a sweep that are the horizontal axis, the curves and the panels."""

    dim: str
    label: str
    curves: str | None
    panels: tuple[str, ...]


def save_comparison(comparison: xarray.Dataset, lines: xarray.Dataset, path: Path | str) -> None:
    """Write the figure of a comparison as png, pdf or svg; see `draw_comparison`."""
    save(draw_comparison(comparison, lines), path)


def draw_comparison(comparison: xarray.Dataset, lines: xarray.Dataset) -> Figure:
    """Mean conductivity with its confidence band, a curve per value of one dimension, and the models.

    Parameters
    ----------
    comparison : xarray.Dataset
        From `etc_engine.comparison.evaluate_models`.
    lines : xarray.Dataset
        From `etc_engine.comparison.model_lines`.

    Returns
    -------
    matplotlib.figure.Figure
        Against the density, or with one density against the first dimension of several values. One panel per method
        and per conductivity of pores or particles, whose models differ; at most `MOST_PANELS`.
    """
    axis = _axis(comparison)
    every = _panels(comparison, axis)
    panels = every[:MOST_PANELS]
    # One set of models for all panels is labelled once a row; otherwise every panel has labels beside it.
    own = any(dim in _model_dims(comparison) for dim in axis.panels)
    columns = 1 if own else min(len(panels), 2)
    rows = -(-len(panels) // columns)
    figure = new_figure(WIDTH, 0.8 + (4.0 if rows == 1 else 3.0) * rows)
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    logarithmic = _is_wide(comparison["conductivity_mean"].values)
    for axes, (title, part) in zip(grid.flat, panels, strict=False):
        style(axes)
        if logarithmic:
            axes.set_yscale("log")
        if axis.dim != "density" and _is_wide(part[axis.dim].values) and float(part[axis.dim].min()) > 0.0:
            axes.set_xscale("log")
        _draw_simulation(axes, part, axis)
        _draw_models(axes, part, lines, axis)
        axes.set_title(title, fontsize=TEXT)
        axes.set_xlabel(axis.label if columns == 1 else textwrap.fill(axis.label, 28), fontsize=TEXT)
    if not logarithmic:
        grid[0, 0].set_ylim(*_heights(comparison))
    for i, axes in enumerate(grid.flat):
        axes.set_visible(i < len(panels))
        axes.tick_params(labelbottom=i + columns >= len(panels))
        if i + columns < len(panels):
            axes.set_xlabel("")
    for axes in grid[:, 0]:
        axes.set_ylabel("effective conductivity [W m$^{-1}$ K$^{-1}$]", fontsize=TEXT)
    for i, (axes, (_, part)) in enumerate(zip(grid.flat, panels, strict=False)):
        if own or i == min(len(panels), (i // columns + 1) * columns) - 1:
            _label_models(axes, part, lines, axis)
    _legend(figure, panels[0][1], axis)
    hidden = f"\nThe first {len(panels)} of {len(every)} panels." if len(every) > len(panels) else ""
    figure.supxlabel(_notes(comparison) + hidden, fontsize=SMALL, color="#555555")
    return figure


def _heights(comparison: xarray.Dataset) -> tuple[float | None, float | None]:
    """Limits of the conductivity: from 0 or a lower interval, or about the simulated values with pores that conduct."""
    names = ("conductivity_mean", "conductivity_ci_low", "conductivity_ci_high", "band_low", "band_high")
    values = np.concatenate([comparison[name].values.ravel() for name in names])
    values = values[np.isfinite(values)]
    if values.size == 0 or not comparison.attrs["pores_conduct"]:
        return float(min(values.min(initial=0.0), 0.0)), None
    low, high = float(values.min()), float(values.max())
    margin = MARGIN * (high - low if high > low else abs(high) or 1.0)
    return (max(low - margin, 0.0) if low >= 0.0 else low - margin), high + margin


def _model_dims(comparison: xarray.Dataset) -> tuple[str, ...]:
    """Dimensions, besides the density, on which the models depend."""
    pores, particles = comparison["pore_conductivity"], comparison["particle_conductivity"]
    return tuple(dict.fromkeys(str(dim) for dim in (*pores.dims, *particles.dims)))


def _axis(comparison: xarray.Dataset) -> _Axis:
    """What stands where: the density across, or with one density the first dimension of several values."""
    dims = [dim for dim in SWEPT if dim in comparison["conductivity_mean"].dims]
    of_models = _model_dims(comparison)
    several = [dim for dim in dims if dim not in ("density", "method") and comparison.sizes[dim] > 1]
    across = several[0] if comparison.sizes["density"] == 1 and several else "density"
    same = [dim for dim in dims if dim not in ("density", across, *of_models)]
    if across == "density":
        measure = MEASURES[comparison.attrs["dimension"]]
        conducting = comparison.attrs["pores_conduct"]
        label = f"{measure} fraction of the particles [-]" if conducting else DENSITY.format(measure=measure)
        curves = next((dim for dim in same if dim != "method"), None)
    else:
        label = heading_of(across, comparison[across].attrs)
        curves = "method" if "method" in same else next(iter(same), None)
    return _Axis(across, label, curves, tuple(dim for dim in dims if dim not in ("density", across, curves)))


def _panels(comparison: xarray.Dataset, axis: _Axis) -> list[tuple[str, xarray.Dataset]]:
    """A title and a part of the comparison for each panel; no dimension is left but the axis and the curves."""
    if axis.dim != "density":
        comparison = comparison.isel(density=0)
    found = []
    for values in itertools.product(*(comparison[dim].values for dim in axis.panels)):
        chosen = dict(zip(axis.panels, values, strict=True))
        words = (f"method {value}" if dim == "method" else word_of(dim, value) for dim, value in chosen.items())
        found.append((", ".join(words), comparison.sel(chosen)))
    return found


def _is_wide(values: NDArray[np.float64]) -> bool:
    positive = values[np.nan_to_num(values) > 0.0]
    return bool(positive.size and np.log10(positive.max() / positive.min()) > DECADES)


def _curves(part: xarray.Dataset, axis: _Axis) -> list[tuple[str, xarray.Dataset]]:
    if axis.curves is None:
        return [("simulation", part)]
    values = part[axis.curves].values
    return [(word_of(axis.curves, value), part.sel({axis.curves: value})) for value in values]


def _draw_simulation(axes: Axes, part: xarray.Dataset, axis: _Axis) -> None:
    looks = itertools.cycle(zip(COLOURS, MARKERS, strict=True))
    for (_, curve), (colour, marker) in zip(_curves(part, axis), looks, strict=False):
        x = curve[axis.dim].values
        mean = curve["conductivity_mean"].values
        if axes.get_yscale() == "log":
            mean = np.where(mean > 0.0, mean, np.nan)
        _draw_band(axes, curve, (x, mean), "conductivity_ci", colour, 0.22)
        axes.plot(x, mean, marker=marker, color=colour, markersize=4.5, linewidth=1.6, zorder=3)
        blocked = curve["percolating_fraction"].values < 1.0  # hollow: the mean holds realizations without a path
        if blocked.any():
            axes.plot(x[blocked], mean[blocked], marker, color=colour, mfc="white", markersize=4.5, zorder=3.5)
        if MEAN_FIELD in curve["model"].values:
            field = curve["model_conductivity"].sel({"model": MEAN_FIELD}).values
            shade = GREY if axis.curves == "method" else colour  # it is the same for all methods
            axes.plot(x, field, linestyle=(0, (4, 2)), color=shade, linewidth=0.9, zorder=2)
        if bool(curve["method_error"].notnull().any()):
            _draw_band(axes, curve, (x, mean), "band", colour, 0.12)


def _draw_band(
    axes: Axes, curve: xarray.Dataset, line: tuple[NDArray[Any], NDArray[Any]], name: str, colour: str, alpha: float
) -> None:
    """A band about a curve, between the variables of that name with _low and _high; a bar at a single point."""
    x, mean = line
    low, high = curve[f"{name}_low"].values, curve[f"{name}_high"].values
    if axes.get_yscale() == "log":
        cut = (low <= 0.0) & (mean > 0.0)
        low = np.where(low > 0.0, low, 1e-2 * mean)
        axes.plot(x[cut], low[cut], linestyle="none", marker=DOWN_MARK, color=colour, markersize=6, zorder=3)
    axes.fill_between(x, low, high, color=colour, alpha=alpha, linewidth=0.0)
    if x.size == 1:
        axes.errorbar(x, mean, [mean - low, high - mean], fmt="none", ecolor=colour, elinewidth=0.9, capsize=3)


def _drawn(part: xarray.Dataset) -> list[str]:
    """The models that get a line: formulas with a value other than 0 somewhere."""
    names = [str(name) for name in part["model"].values if name != MEAN_FIELD]
    values = part["model_conductivity"]
    return [n for n in names if bool((values.sel({"model": n}) > 0.0).any())]


def _lines(
    part: xarray.Dataset, lines: xarray.Dataset, axis: _Axis
) -> list[tuple[str, NDArray[np.float64], NDArray[np.float64]]]:
    """Name, abscissas and ordinates of every model line."""
    source = lines if axis.dim == "density" else part
    x, values = source[axis.dim].values, source["model_conductivity"]
    own = [dim for dim in axis.panels if dim in values.dims]
    values = values.sel({dim: part[dim].item() for dim in own})
    values = values.isel({dim: 0 for dim in values.dims if dim not in ("model", axis.dim)})  # a formula of the density
    return [(name, x, np.broadcast_to(values.sel({"model": name}).values, x.shape)) for name in _drawn(part)]


def _draw_models(axes: Axes, part: xarray.Dataset, lines: xarray.Dataset, axis: _Axis) -> None:
    bound = {"hashin_shtrikman_lower", "hashin_shtrikman_upper", "series", "parallel"}
    for name, x, y in _lines(part, lines, axis):
        axes.plot(x, y, color=INK if name in bound else GREY, linewidth=0.8, linestyle="-" if name in bound else "-.")
        if x.size == 1:
            axes.plot(x, y, marker="_", color=GREY, markersize=14)


def _label_models(axes: Axes, part: xarray.Dataset, lines: xarray.Dataset, axis: _Axis) -> None:
    label_ends(axes, [(CATALOGUE[name].label, x, y) for name, x, y in _lines(part, lines, axis)])


def _legend(figure: Figure, part: xarray.Dataset, axis: _Axis) -> None:
    looks = itertools.cycle(zip(COLOURS, MARKERS, strict=True))
    handles: list[Any] = []
    for (label, _), (colour, marker) in zip(_curves(part, axis), looks, strict=False):
        handles.append(Line2D([], [], color=colour, marker=marker, markersize=4.5, linewidth=1.6, label=label))
    if MEAN_FIELD in part["model"].values:
        handles.append(Line2D([], [], color=GREY, linestyle=(0, (4, 2)), linewidth=0.9, label="contact mean field"))
    title = QUANTITIES[axis.curves].long_name if axis.curves is not None and axis.curves in QUANTITIES else None
    legend(
        figure, handles=handles, title=title, fontsize=SMALL, title_fontsize=SMALL, loc="outside upper center", ncols=4
    )


def _notes(comparison: xarray.Dataset) -> str:
    level = comparison["half_width"].attrs["confidence_level"]
    counts = comparison["count"].values[comparison["count"].values > 0]
    few, many = (int(counts.min()), int(counts.max())) if counts.size else (0, 0)
    number = f"{many}" if few == many else f"{few} to {many}"
    diagonal = "$k_{xx}$ and $k_{yy}$" if comparison.attrs["dimension"] == 2 else "$k_{xx}$, $k_{yy}$ and $k_{zz}$"
    mean = f"the mean of {diagonal}"
    notes = [f"Bands: {100 * level:g} % Student-t interval of {mean}, {number} realizations."]
    if bool(comparison["method_error"].notnull().any()):
        notes.append("Wide pale bands add the estimated error of method and discretization.")
    undrawn = [str(n) for n in comparison["model"].values if str(n) not in [*_drawn(comparison), MEAN_FIELD]]
    zero = [CATALOGUE[name].label for name in undrawn]
    if zero and not comparison.attrs["pores_conduct"]:
        notes.append(f"0 with insulating pores, not drawn: {', '.join(zero)}.")
    if comparison.attrs["bounds_unbound"]:
        notes.append(f"Hashin-Shtrikman bounds do not apply:\n{comparison.attrs['bounds_unbound']}.")
    elif not comparison.attrs["pores_conduct"]:
        notes.append(f"{BOUNDS_NOTE}.")
    return "\n".join(notes)
