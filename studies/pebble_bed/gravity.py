"""Beds poured under gravity beside the sweep: ``python gravity.py beds sweep.nc gravity.csv figure.png``

The beds of ``make_beds.py`` are cut between 2 and 8 mm above the floor; heat flows along x and y, which are periodic.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from etc_engine.comparison import evaluate_models
from etc_engine.materials import find_solid
from etc_engine.medium.conditions import Conditions, pores_at
from etc_engine.medium.conduction import Conduction
from etc_engine.medium.loaded import hertz_contacts
from etc_engine.medium.medium import Medium
from etc_engine.particle_files.formats import read_particles
from etc_engine.particle_files.sample import Sample
from etc_engine.realization import find_engine
from etc_engine.sweep.dataset import open_dataset
from etc_engine.sweep.statistics import summarize

PRESSURES, TEMPERATURES = (100.0, 1e3, 1e4, 1e5, 3e5), (700.0, 800.0, 900.0, 1000.0, 1100.0)
ELASTIC = {"youngs_modulus": 126e9, "poisson_ratio": 0.24, "simulated_modulus": 1e8}
PART = (2e-3, 8e-3)


def conductivities(path: Path) -> np.ndarray:
    """Mean of k_xx and k_yy at every pressure and temperature [W/(m K)]."""
    packing = read_particles(path, sample=Sample(crop=((-np.inf, np.inf), (-np.inf, np.inf), PART))).packing
    network, solid = hertz_contacts(packing, **ELASTIC), find_solid("Li2TiO3").conductivity
    media = [
        Medium(packing, float(solid.at(t)), network, pores_at(Conditions(t, "helium", p, 0.43, None, 0.8), packing))
        for p in PRESSURES
        for t in TEMPERATURES
    ]
    results = find_engine("dtem").results(media, Conduction("dtem", "facets", {}, 1e-8, (0, 1)), 0)
    values = [0.5 * (result.tensor[0, 0] + result.tensor[1, 1]) for result in results]
    print(path.name, f"density {packing.density:.4f}, {2.0 * network.count / packing.count:.2f} contacts a pebble")
    return np.reshape(values, (len(PRESSURES), len(TEMPERATURES)))


def main(folder: str, sweep: str, table: str, picture: str) -> None:
    beds = summarize(np.array([conductivities(path) for path in sorted(Path(folder).glob("bed_*.dump"))]), 0.95)
    comparison = evaluate_models(open_dataset(Path(sweep)), ["zehner_bauer_schluender"]).isel(density=0)
    mean, half = comparison["conductivity_mean"].values, comparison["half_width"].values
    model = comparison["model_conductivity"].sel(model="zehner_bauer_schluender").values
    with Path(table).open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["pressure", "temperature", "poured", "poured_low", "poured_high", "sweep", "half_width", "zbs"])
        for i, p in enumerate(PRESSURES):
            for j, t in enumerate(TEMPERATURES):
                values = beds.mean[i, j], beds.ci_low[i, j], beds.ci_high[i, j], mean[i, j], half[i, j], model[i, j]
                out.writerow([p, t, *(f"{value:.5g}" for value in values)])
    figure = Figure(figsize=(7.5, 4.5), layout="constrained")
    panel = figure.subplots()
    for i, p in enumerate(PRESSURES):
        colour = f"C{i}"
        panel.errorbar(TEMPERATURES, mean[i], half[i], color=colour, label=f"{p:g} Pa")
        panel.errorbar(
            TEMPERATURES,
            beds.mean[i],
            [beds.mean[i] - beds.ci_low[i], beds.ci_high[i] - beds.mean[i]],
            fmt="o",
            ms=4,
            color=colour,
        )
        panel.plot(TEMPERATURES, model[i], ":", color=colour)
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
