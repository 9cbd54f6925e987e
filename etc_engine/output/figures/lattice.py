"""Pictures of particle lattices: calibration, transients, halo flux, single inclusions, composites."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from etc_engine.arrays import Floats
from etc_engine.output.figures.canvas import COLOURS, GREY, INK, MARKERS, legend, new_panels

Series = Mapping[str, tuple[Floats, Floats]]
"""Label -> (abscissae, ordinates)."""


def _plot(axes: Axes, series: Series, lines: str = "-") -> None:
    """One marker and colour for every series; ``lines="none"`` leaves the points alone."""
    fill = "none" if lines == "none" else "full"
    for (label, (x, y)), colour, marker in zip(series.items(), COLOURS, MARKERS, strict=False):
        axes.plot(
            x, y, linestyle=lines, color=colour, marker=marker, markersize=5, linewidth=1.1, fillstyle=fill, label=label
        )


def _finish(axes: Axes, across: str, up: str) -> None:
    axes.set_xlabel(across)
    axes.set_ylabel(up)
    legend(axes)


def draw_calibration(points: Mapping[str, Floats], mean_field: Floats) -> Figure:
    """Transmission coefficient over the number of particles, one series for each way of tying the faces.

    Parameters
    ----------
    points : mapping
        Label -> rows (particles, mean C_t, standard deviation).
    mean_field : ndarray, shape (m, 2)
        Rows (particles, bound).
    """
    figure, (axes,) = new_panels(height=4.0)
    for (label, rows), colour, marker in zip(points.items(), COLOURS, MARKERS, strict=False):
        axes.errorbar(
            rows[:, 0], rows[:, 1], rows[:, 2], color=colour, marker=marker, markersize=4, linewidth=1.1, capsize=2,
            label=label,
        )  # fmt: skip
    axes.plot(
        mean_field[:, 0], mean_field[:, 1], "--", color=GREY, linewidth=1.0, label="mean field, periodic (lower bound)"
    )
    axes.set_xscale("log")
    _finish(axes, "particles N", "transmission coefficient $C_t$ [-]")
    return figure


def draw_slab(profiles: Mapping[float, tuple[Floats, Floats, Floats]], errors: Series) -> Figure:
    """Temperature in a slab at a few times with the exact profiles, and the largest error over time.

    Parameters
    ----------
    profiles : mapping
        Time -> (position y/L, temperature, exact temperature) of every node.
    errors : mapping
        Label -> (times, largest relative error [%]).
    """
    figure, (left, right) = new_panels(1, 2)
    for (time, (y, found, exact)), colour in zip(profiles.items(), COLOURS, strict=False):
        order = np.argsort(y)
        left.plot(y[order][::7], found[order][::7], ".", color=colour, markersize=2, alpha=0.5)
        left.plot(y[order], exact[order], "-", color=INK, linewidth=0.8)
        left.plot([], [], "o", color=colour, markersize=4, label=f"t = {time:g} s")
    left.plot([], [], "-", color=INK, linewidth=0.8, label="exact")
    _finish(left, "y / L [-]", "temperature [°C]")
    _plot(right, errors)
    right.set_yscale("log")
    right.set_ylim(top=6.0 * max(float(y.max()) for _, y in errors.values()))  # room for the legend
    _finish(right, "time [s]", "largest relative error [%]")
    return figure


def draw_ball(time: Floats, exact: Floats, centre: Series, errors: Series) -> Figure:
    """Temperature at the centre of a ball over time, and its error over the number of nodes.

    Parameters
    ----------
    time, exact : ndarray, shape (m,)
        The exact temperature at the centre.
    centre : mapping
        Label -> (times, temperatures).
    errors : mapping
        Label -> (particles, largest error [K]).
    """
    figure, (left, right) = new_panels(1, 2)
    left.plot(time, exact, "-", color=INK, linewidth=1.0, label="exact")
    _plot(left, centre, "none")
    _finish(left, "time [s]", "temperature at the centre [°C]")
    _plot(right, errors)
    right.set_xscale("log")
    right.set_yscale("log")
    _finish(right, "particles N", "largest error at the centre [K]")
    return figure


def draw_halo(spread: Series, fluxes: Mapping[str, Floats]) -> Figure:
    """Coefficient of variation of the heat flux over the halo's radius, and the distribution of the flux.

    Parameters
    ----------
    spread : mapping
        Label -> (halo radius over mean radius, coefficient of variation [%]).
    fluxes : mapping
        Label -> heat flux of every node over the mean.
    """
    figure, (left, right) = new_panels(1, 2)
    _plot(left, spread)
    for level in (5.0, 2.0):
        left.axhline(level, color=GREY, linewidth=0.7, linestyle=":")
    left.set_yscale("log")
    _finish(left, "$R_{halo}$ / mean radius [-]", "coefficient of variation [%]")
    for (label, values), colour in zip(fluxes.items(), COLOURS, strict=False):
        density, edges = np.histogram(values, bins=np.linspace(0.4, 1.6, 121), density=True)
        right.plot(0.5 * (edges[1:] + edges[:-1]), density, color=colour, linewidth=1.1, label=label)
    _finish(right, "heat flux / mean [-]", "probability density [-]")
    return figure


def draw_inclusion(contrasts: Floats, exact: Floats, found: Series, errors: Series) -> Figure:
    """Conductivity of a single inclusion over the contrast, and the errors.

    Parameters
    ----------
    contrasts, exact : ndarray, shape (m,)
    found : mapping
        Label -> (contrasts, conductivity over the matrix').
    errors : mapping
        Label -> (contrasts, error [%], signed).
    """
    figure, (left, right) = new_panels(1, 2)
    left.plot(contrasts, exact, "-", color=INK, linewidth=1.0, label="exact (simple cubic)")
    _plot(left, found, "none")
    _plot(right, {label: (x, np.abs(y)) for label, (x, y) in errors.items()})
    right.axhline(0.65, color=GREY, linewidth=0.8, linestyle="--", label="published, 150 000 particles")
    right.set_yscale("log")
    for axes in (left, right):
        axes.set_xscale("log")
    _finish(left, "conductivity of the inclusion / matrix [-]", "effective / matrix [-]")
    _finish(right, "conductivity of the inclusion / matrix [-]", "error [%]")
    return figure


def draw_fractions(lines: Series, points: Sequence[tuple[str, Floats]]) -> Figure:
    """Conductivity over volume fraction: models as lines, simulations as points with error bars.

    Parameters
    ----------
    lines : mapping
        Label -> (fractions, conductivity).
    points : sequence
        (label, rows of fraction, conductivity, half-width).
    """
    figure, (axes,) = new_panels(height=4.2)
    for (label, (x, y)), colour in zip(lines.items(), COLOURS[2:], strict=False):
        axes.plot(x, y, "-", color=colour, linewidth=1.0, label=label)
    for (label, rows), colour, marker in zip(points, COLOURS, MARKERS, strict=False):
        x, y, width = rows.T
        axes.errorbar(x, y, width, fmt=marker, color=colour, markersize=5, capsize=2, linewidth=1.0, label=label)
    _finish(axes, "volume fraction of inclusions [-]", "conductivity [W m$^{-1}$ K$^{-1}$]")
    return figure
