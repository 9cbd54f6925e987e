"""Error of every method for spheres in contact in vacuum, over the contact half-angle.

``python studies/spheres_accuracy/analyse.py [--output DIRECTORY]`` writes errors.csv and errors.png: sc, bcc and fcc
lattices of overlapping spheres and random packings, by the methods of thermal elements and pipe networks, against
method ``exact`` with flux modes up to degree 3; markers are finite elements with their uncertainty. Ten seconds.
"""

from __future__ import annotations

import argparse
import csv
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from etc_engine import (
    Box,
    Medium,
    PackingSpec,
    ParticlePacking,
    effective_conductivity,
    overlap_contacts,
    pack,
    parse_radii,
)
from etc_engine.errors import GeometryError
from etc_engine.output.figures.canvas import COLOURS, INK, TEXT, legend, mark_outside, new_panels, save

HERE = Path(__file__).parent
TRUTH = HERE.parents[1] / "tests" / "published" / "data" / "spheres_vacuum.json"
SEED = 7301
CELLS = {
    "sc": (1.0, [[0, 0, 0]]),
    "bcc": (2.0 / np.sqrt(3.0), [[0, 0, 0], [0.5, 0.5, 0.5]]),
    "fcc": (np.sqrt(2.0), [[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]]),
}
WIDEST = {"sc": 30, "bcc": 30, "fcc": 26}
METHODS = {
    "thermal element, chord": ("dtem", "chord", COLOURS[0], "-"),
    "thermal element, standard": ("dtem", "standard", COLOURS[1], "-"),
    "pipes, chord": ("pipe", "chord", COLOURS[0], "--"),
    "pipes, uniform": ("pipe", "uniform", COLOURS[1], "--"),
    "pipes, 2 kappa c": ("pipe", "holm", COLOURS[2], "--"),
    "pipes, root of the area": ("pipe", "root-area", COLOURS[3], "--"),
}


def lattice(name: str, degrees: float) -> ParticlePacking:
    """Unit spheres whose neighbours overlap to contacts of the half-angle."""
    edge, basis = CELLS[name]
    edge = edge * 2.0 * np.cos(np.radians(degrees))
    return ParticlePacking(np.array(basis) * edge + 0.1, np.ones(len(basis)), Box((edge,) * 3, (True,) * 3))


def random_packing(growth: float) -> ParticlePacking:
    """Spheres of several sizes, packed to a density of .58 and grown into each other."""
    box = Box((1.0, 1.0, 1.0), (True, True, True))
    spec = PackingSpec("lubachevsky-stillinger", parse_radii("uniform:0.8:1.2"), box, count=120, density=0.58)
    packing = pack(spec, np.random.default_rng(SEED))
    return ParticlePacking(packing.centers, packing.radii * growth, box)


def cases() -> Iterator[tuple[str, float, ParticlePacking]]:
    """Panel, half-angle in degrees (of random packings the mean one), packing."""
    for name, widest in WIDEST.items():
        for degrees in [1, 2, 3, 5, 7, 10, 12, 15, 18, 20, 22, 25, 28, 30]:
            if degrees <= widest:
                yield name, degrees, lattice(name, degrees)
    for growth in (1.005, 1.01, 1.02, 1.03, 1.04, 1.06, 1.08, 1.1):
        packing = random_packing(growth)
        yield "random", float(np.degrees(overlap_contacts(packing).angles.mean())), packing


def conductivity(packing: ParticlePacking, engine: str, method: str, **options: int) -> float:
    """A third of the trace of the conductivity tensor."""
    medium = Medium(packing, 1.0, overlap_contacts(packing))
    result = effective_conductivity(medium, engine=engine, method=method, **options)
    return float(np.trace(result.tensor) / 3.0)


def rows() -> list[dict[str, object]]:
    """Exact conductivity and error of every method, case by case."""
    found = []
    for panel, degrees, packing in cases():
        try:
            exact = conductivity(packing, "dtem", "exact", modes=4)
        except GeometryError as error:
            print(f"{panel} {degrees:.3g}: {error}")
            continue
        if exact == 0.0:
            continue
        errors = {
            label: conductivity(packing, engine, method) / exact - 1.0
            for label, (engine, method, *_) in METHODS.items()
        }
        found.append({"panel": panel, "degrees": degrees, "exact": exact, **errors})
    return found


def draw(table: list[dict[str, object]], truth: list[dict[str, object]]) -> Figure:
    """Absolute errors over the half-angle, a panel for each kind of packing."""
    figure, panels = new_panels(2, 2, 3.4, sharey=True, sharex=True)
    for axes, panel in zip(panels, [*CELLS, "random"], strict=True):
        axes.set(yscale="log", ylim=(1e-7, 3.0), xlim=(0.0, 32.0))
        own = [row for row in table if row["panel"] == panel]
        angles = [row["degrees"] for row in own]
        for label, (_, _, colour, style) in METHODS.items():
            errors = [abs(row[label]) for row in own]
            axes.plot(angles, errors, style, color=colour, label=label, marker=".")
            mark_outside(axes, angles, errors, colour)
        for case in truth:
            if case["kind"] == "vacuum_lattice" and case["lattice"] == panel:
                mine = [row["exact"] for row in own if row["degrees"] == case["angle_deg"]]
                if mine:
                    axes.plot(case["angle_deg"], abs(mine[0] / case["value"] - 1.0), "*", color=INK, markersize=9)
                    axes.plot(case["angle_deg"], case["error"] / case["value"], "_", color=INK, markersize=12)
        axes.set_title(f"{panel} lattice" if panel in CELLS else "random packing, mean angle", fontsize=TEXT)
    panels[0].plot([], [], "*", color=INK, label="exact against finite elements")
    panels[0].plot([], [], "_", color=INK, label="uncertainty of the finite elements")
    figure.supxlabel("contact half-angle [degrees]", fontsize=TEXT)
    figure.supylabel("relative error of the conductivity [-]", fontsize=TEXT)
    legend(figure, *panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def main() -> None:
    """Solve, write the table, draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=HERE)
    output = parser.parse_args().output
    table = rows()
    with (output / "errors.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(table[0]))
        writer.writeheader()
        writer.writerows({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()} for row in table)
    save(draw(table, json.loads(TRUTH.read_text())), output / "errors.png")


if __name__ == "__main__":
    main()
