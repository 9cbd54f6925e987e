"""Poured beds beside packed ones: ``python analyse.py sweep.nc poured.nc gravity.csv figure.png``

The conductivity of the poured beds is that along x and y, which are periodic; along z the cut has walls.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import xarray
from matplotlib.figure import Figure

from etc_engine.comparison import evaluate_models
from etc_engine.models import CATALOGUE
from etc_engine.output.figures.canvas import COLOURS, INK, legend, new_panels, save
from etc_engine.sweep.result_file import open_dataset
from etc_engine.sweep.statistics import Summary, summarize

MODEL = "zehner_bauer_schluender"


def main(sweep: str, poured: str, table: str, picture: str) -> None:
    comparison = evaluate_models(open_dataset(Path(sweep)), [MODEL]).isel(density=0)
    beds = of_beds(poured)
    mean, half = comparison["conductivity_mean"].values, comparison["half_width"].values
    model = comparison["model_conductivity"].sel(model=MODEL).values
    with Path(table).open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["pressure", "temperature", "poured", "poured_low", "poured_high", "sweep", "half_width", "zbs"])
        for i, p in enumerate(comparison["pressure"].values):
            for j, t in enumerate(comparison["temperature"].values):
                values = beds.mean[i, j], beds.ci_low[i, j], beds.ci_high[i, j], mean[i, j], half[i, j], model[i, j]
                out.writerow([p, t, *(f"{value:.5g}" for value in values)])
    save(draw(comparison, beds), picture)


def of_beds(poured: str) -> Summary:
    """Statistics of the poured beds over pressure and temperature."""
    tensors = open_dataset(Path(poured))["conductivity"].isel(density=0)
    plane = [tensors.sel(direction_i=axis, direction_j=axis, drop=True) for axis in "xy"]
    return summarize((0.5 * (plane[0] + plane[1])).transpose("realization", "pressure", "temperature").values, 0.95)


def draw(comparison: xarray.Dataset, beds: Summary) -> Figure:
    """Conductivity over the temperature, a colour for each pressure."""
    temperatures = comparison["temperature"].values
    mean, half = comparison["conductivity_mean"].values, comparison["half_width"].values
    model = comparison["model_conductivity"].sel(model=MODEL).values
    figure, (panel,) = new_panels(height=4.6)
    for i, p in enumerate(comparison["pressure"].values):
        colour, (low, high) = COLOURS[i], (beds.mean[i] - beds.ci_low[i], beds.ci_high[i] - beds.mean[i])
        panel.errorbar(temperatures, mean[i], half[i], color=colour, label=f"helium at {p:g} Pa")
        panel.errorbar(temperatures, beds.mean[i], [low, high], fmt="o", ms=5, color=colour)
        panel.plot(temperatures, model[i], ":", color=colour)
    panel.plot([], [], "-", color=INK, label="sweep of packings, load 0.1 MPa")
    panel.plot([], [], "o", color=INK, ms=5, label="poured beds, own weight")
    panel.plot([], [], ":", color=INK, label=CATALOGUE[MODEL].label)
    panel.set_xlabel("temperature [K]")
    panel.set_ylabel("effective conductivity [W/(m K)]")
    panel.set_ylim(0.0)
    legend(figure, loc="outside upper center", ncols=2)
    return figure


if __name__ == "__main__":
    main(*sys.argv[1:])
