"""Transient DTEM and pipe network against fine finite elements, on two and on twelve disks.

``python studies/feng2009/transient.py [--output DIRECTORY]`` writes transient.csv and transient.png from the references
that finite_elements.py made.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from etc_engine.medium.medium import medium_of
from etc_engine.output.figures.canvas import COLOURS, INK, MARKERS, TEXT, legend, mark_outside, new_panels, save
from etc_engine.realization import transient_system
from etc_engine.solvers.marching import march

sys.path.insert(0, str(Path(__file__).parent))
from cases import CASES, HERE, Case

MODELS: dict[str, Callable[[Case], object]] = {
    "chord with dipoles": lambda c: transient_system(
        medium_of(c.network(), heat_capacity=1.0), c.conditions, method="chord", dipoles=True
    ),
    "chord": lambda c: transient_system(medium_of(c.network(), heat_capacity=1.0), c.conditions, method="chord"),
    "standard": lambda c: transient_system(medium_of(c.network(), heat_capacity=1.0), c.conditions, method="standard"),
    "pipe, chord": lambda c: transient_system(
        medium_of(c.network(), heat_capacity=1.0), c.conditions, engine="pipe", method="chord"
    ),
    "pipe, uniform": lambda c: transient_system(
        medium_of(c.network(), heat_capacity=1.0), c.conditions, engine="pipe", method="uniform"
    ),
}
ROWS = (0.0178, 0.1, 0.316, 1.0, 3.16, 10.0, 31.6, 100.0)


def reference(case: Case) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fourier numbers (t,), heat flows at the driven walls (t, w), mean temperatures (t, n)."""
    rows = np.loadtxt(HERE / f"reference_{case.name}.csv", delimiter=",", skiprows=1)
    walls = len(case.walls)
    return rows[:, 0], rows[:, 1 : 1 + walls], rows[:, 1 + walls :]


def run(case: Case, model: str, fourier: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Heat flows at the driven walls (t, w) and mean temperatures (t, n) by a model."""
    system = MODELS[model](case)
    times = np.concatenate([[0.0], fourier * case.radius**2])
    states = list(march(system.heat, system.initial(0.0), times, scheme="adaptive", tolerance=1e-7))[1:]
    flows = [system.heat.rates(s.time, s.temperatures)[: len(case.walls)] for s in states]
    return np.array(flows), np.array([system.particle_temperatures(s.temperatures) for s in states])


def errors(case: Case, model: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fourier numbers, largest error of a mean temperature [K], relative error of the heat into the left wall."""
    fourier, flows, means = reference(case)
    found, temperatures = run(case, model, fourier)
    left = np.abs(found[:, 0] / flows[:, 0] - 1.0)
    left[np.abs(flows[:, 0]) < 0.01] = np.nan  # in the end no heat flows into the two disks
    return fourier, np.abs(temperatures - means).max(axis=1), left


def draw(path: Path, results: dict[tuple[str, str], tuple[np.ndarray, np.ndarray, np.ndarray]]) -> None:
    """Mean temperatures, their errors, and the errors of the wall heat flow, a row for each case."""
    figure, panels = new_panels(2, 3, 3.6)
    grid = panels.reshape(2, 3)
    for row, case in zip(grid, CASES, strict=True):
        fourier, _, means = reference(case)
        shown = (0, 1) if means.shape[1] == 2 else (0, 4, 2)
        dense = {m: run(case, m, fourier)[1] for m in ("chord with dipoles", "chord", "pipe, chord")}
        for k, p in enumerate(shown):
            row[0].plot(fourier, means[:, p], color=INK, linewidth=2.4, alpha=0.3, label="finite elements" * (k == 0))
            for name, values in dense.items():
                look = COLOURS[list(MODELS).index(name)]
                row[0].plot(fourier, values[:, p], color=look, linewidth=1.0, label=name if k == 0 else "")
        row[0].set_ylabel(f"mean temperature of disks {', '.join(str(p + 1) for p in shown)} [K]")
        for axes, low, high in ((row[1], 1e-6, 0.3), (row[2], 1e-5, 2.0)):
            axes.set(xscale="log", yscale="log", ylim=(low, high), xlim=(0.5 * fourier[0], 2.0 * fourier[-1]))
        for k, name in enumerate(MODELS):
            _, temperature, flow = results[case.name, name]
            for axes, values in ((row[1], temperature), (row[2], flow)):
                axes.plot(fourier, values, color=COLOURS[k], marker=MARKERS[k], markersize=3, linewidth=1, label=name)
                mark_outside(axes, fourier, values, COLOURS[k])
        row[1].set_ylabel("largest error of a mean temperature [K]")
        row[2].set_ylabel("relative error of the heat into the wall [-]")
        row[0].set_title(f"{case.name} disks", fontsize=TEXT)
        for axes in row:
            axes.set_xscale("log")
            axes.set_xlabel("Fourier number  $\\kappa t/(\\rho c R^2)$ [-]")
    names: dict[str, object] = {}
    for axes in grid[0, :2]:
        names |= dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    legend(figure, list(names.values()), list(names), loc="outside upper center", ncols=4)
    save(figure, path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=HERE)
    output = parser.parse_args().output
    results = {(case.name, model): errors(case, model) for case in CASES for model in MODELS}
    lines = ["case,fourier,quantity," + ",".join(name.replace(", ", " ") for name in MODELS)]
    for case in CASES:
        fourier = reference(case)[0]
        for row in (int(np.argmin(np.abs(np.log(fourier / wanted)))) for wanted in ROWS):
            for k, quantity in enumerate(("mean temperature [K]", "wall heat flow [1]"), start=1):
                values = ",".join(f"{results[case.name, model][k][row]:.2e}" for model in MODELS)
                lines.append(f"{case.name},{fourier[row]:.4g},{quantity},{values}")
    (output / "transient.csv").write_text("\n".join(lines) + "\n")
    draw(output / "transient.png", results)


if __name__ == "__main__":
    main()
