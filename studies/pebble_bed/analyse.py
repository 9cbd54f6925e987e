"""Poured beds beside packed ones: ``python analyse.py sweep.nc poured.nc gravity.csv figure.png``

Of the poured beds heat along x and y, which are periodic; along z the cut has walls.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

from matplotlib.figure import Figure

from etc_engine.comparison import evaluate_models
from etc_engine.sweep.result_file import open_dataset
from etc_engine.sweep.statistics import summarize


def main(sweep: str, poured: str, table: str, picture: str) -> None:
    tensors = open_dataset(Path(poured))["conductivity"].isel(density=0)
    plane = [tensors.sel(direction_i=axis, direction_j=axis, drop=True) for axis in "xy"]
    beds = summarize((0.5 * (plane[0] + plane[1])).transpose("realization", "pressure", "temperature").values, 0.95)
    comparison = evaluate_models(open_dataset(Path(sweep)), ["zehner_bauer_schluender"]).isel(density=0)
    pressures, temperatures = (comparison[name].values for name in ("pressure", "temperature"))
    mean, half = comparison["conductivity_mean"].values, comparison["half_width"].values
    model = comparison["model_conductivity"].sel(model="zehner_bauer_schluender").values
    with Path(table).open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["pressure", "temperature", "poured", "poured_low", "poured_high", "sweep", "half_width", "zbs"])
        for i, p in enumerate(pressures):
            for j, t in enumerate(temperatures):
                values = beds.mean[i, j], beds.ci_low[i, j], beds.ci_high[i, j], mean[i, j], half[i, j], model[i, j]
                out.writerow([p, t, *(f"{value:.5g}" for value in values)])
    figure = Figure(figsize=(7.5, 4.5), layout="constrained")
    panel = figure.subplots()
    for i, p in enumerate(pressures):
        colour = f"C{i}"
        panel.errorbar(temperatures, mean[i], half[i], color=colour, label=f"{p:g} Pa")
        panel.errorbar(
            temperatures,
            beds.mean[i],
            [beds.mean[i] - beds.ci_low[i], beds.ci_high[i] - beds.mean[i]],
            fmt="o",
            ms=4,
            color=colour,
        )
        panel.plot(temperatures, model[i], ":", color=colour)
    panel.plot([], [], "k-", label="sweep, 0.61, 0.1 MPa load")
    panel.plot([], [], "ko", ms=4, label="poured beds, own weight")
    panel.plot([], [], "k:", label="Zehner-Bauer-Schlünder")
    panel.set_xlabel("T [K]")
    panel.set_ylabel("k [W/(m K)]")
    panel.set_ylim(0.0)
    panel.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    main(*sys.argv[1:])
