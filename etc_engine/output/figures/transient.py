"""A picture of a transient: particles coloured by temperature at several times, heat flows and the mean over time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from etc_engine.box import Box, parse_periodic
from etc_engine.output.figures.canvas import COLOURS, INK, TEXT, WIDE, legend, new_figure, save, style
from etc_engine.output.figures.spheres import draw_view
from etc_engine.packing.particles import ParticlePacking

if TYPE_CHECKING:
    import xarray

PANELS = 4
"""Particles are drawn at so many times."""
BAND = "#dcdcdc"
LOWEST = 1.6
"""Least height of the packings' row in inches: the label of the colour bar stands upright beside it."""


def save_transient(series: xarray.Dataset, path: Path | str) -> None:
    """Write the panel picture of a transient.

    Parameters
    ----------
    series : xarray.Dataset
        From `etc_engine.output.series.series_dataset`.
    path : path
        Its ending decides the format.

    Raises
    ------
    OutputError
        If the file cannot be written, or its ending is unknown.
    """
    save(draw_transient(series), path)


def draw_transient(series: xarray.Dataset) -> Figure:
    """Figure of a transient: a row of packings, and below it the walls' heat flows and the mean temperature."""
    width, height = view_size(series)
    shown = pick_times(series["mean_temperature"].values, PANELS)
    panel = WIDE / PANELS
    row = min(max(panel * height / width, LOWEST), 6.0)
    figure = new_figure(WIDE, row + 3.6)
    parts: Any = figure.subfigures(2, 1, height_ratios=[row + 0.5, 3.1])
    _draw_packings(parts[0], series, shown)
    flows, means = parts[1].subplots(1, 2)
    time = series["time"].values
    # the flow of the start itself, to a wall that has just changed, would dwarf the others
    for number, wall in enumerate(series["wall"].values):
        flow = series["wall_heat_flow"].values[:, number]
        if np.any(flow != 0.0):
            flows.plot(time[1:], flow[1:], color=COLOURS[number], label=str(wall))
    if np.any(series["source_heat_flow"].values != 0.0):
        flows.plot(time[1:], series["source_heat_flow"].values[1:], color=COLOURS[7], label="sources")
    if flows.lines:
        legend(flows)
    flows.axhline(0.0, color=INK, linewidth=0.6)
    flows.set(xlabel="time [s]", ylabel=f"heat flow into the particles [{'W' if 'z' in series else 'W/m'}]")
    temperature = series["temperature"].values
    means.fill_between(
        time,
        temperature.min(axis=1),
        temperature.max(axis=1),
        facecolor=BAND,
        edgecolor="0.55",
        linewidth=0.8,
        label="all particles",
    )
    means.plot(time, series["mean_temperature"].values, color=COLOURS[0], label="mean, by heat capacity")
    means.plot(time[shown], series["mean_temperature"].values[shown], "o", color=COLOURS[0], markersize=4)
    # above the axes: on the band its swatch and its words would be lost
    legend(means, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2)
    means.set(xlabel="time [s]", ylabel="temperature [K]")
    for axes in (flows, means):
        style(axes)
    return figure


def pick_times(means: np.ndarray, count: int) -> list[int]:
    """Output times to draw: the first, the last, and others that share the way of the mean temperature evenly.

    Examples
    --------
    >>> pick_times(np.array([0.0, 0.5, 0.9, 0.95, 0.99, 1.0]), 3)
    [0, 1, 5]
    """
    if means.size <= count:
        return list(range(means.size))
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(means)))])
    if way[-1] == 0.0:
        way = np.arange(means.size, dtype=np.float64)
    wanted = np.linspace(0.0, way[-1], count)
    picked = [int(np.abs(way - value).argmin()) for value in wanted]
    return sorted({0, *picked[1:-1], means.size - 1})


def view_size(series: xarray.Dataset) -> tuple[float, float]:
    """Width and height of a drawn packing: the box of disks, or a view of spheres."""
    if "z" in series:
        return 1.0, 1.0
    width, height = series.attrs["box"]
    return float(width), float(height)


def _draw_spheres(axes: Any, series: xarray.Dataset, low: float, high: float) -> Any:
    """A view of the bed at one time; returns what a colour bar needs."""
    box = Box(tuple(series.attrs["box"]), parse_periodic(series.attrs["periodic"], 3))
    centers = np.stack([series[axis].values for axis in "xyz"], axis=1)
    scale = ScalarMappable(Normalize(low, high), "inferno")
    colours = scale.to_rgba(series["temperature"].values)
    image, frame = draw_view(ParticlePacking(centers, series["radius"].values, box), np.asarray(colours), 400)
    axes.imshow(image, extent=frame, interpolation="bilinear")
    axes.set_axis_off()
    return scale


def _draw_packings(figure: Any, series: xarray.Dataset, shown: list[int]) -> None:
    """Particles at some times, all in one scale of temperatures."""
    width, height = view_size(series)
    temperature = series["temperature"].values
    low, high = float(temperature.min()), float(temperature.max())
    panels = figure.subplots(1, len(shown), squeeze=False)[0]
    for axes, k in zip(panels, shown, strict=True):
        axes.set_title(f"t = {series['time'].values[k]:.4g} s", fontsize=TEXT)
        if "z" in series:
            disks = _draw_spheres(axes, series.isel(time=k), low, high if high > low else low + 1.0)
            continue
        place = series.isel(time=k)[["x", "y", "radius"]]
        radii, centers = place["radius"].values, np.stack([place["x"].values, place["y"].values], axis=1)
        disks = EllipseCollection(
            2 * radii,
            2 * radii,
            np.zeros(radii.size),
            units="xy",
            offsets=centers,
            offset_transform=axes.transData,
            cmap="inferno",
            edgecolors="0.4" if radii.size <= 3000 else "none",
            linewidths=min(0.4, 8.0 / np.sqrt(radii.size)),
        )
        disks.set_array(temperature[k])
        disks.set_clim(low, high if high > low else low + 1.0)
        axes.add_collection(disks)
        axes.set(xlim=(0, width), ylim=(0, height), aspect="equal", xticks=[], yticks=[])
    bar = figure.colorbar(disks, ax=list(panels), shrink=0.85, aspect=25, pad=0.01)
    bar.set_label("mean temperature [K]", fontsize=TEXT)
