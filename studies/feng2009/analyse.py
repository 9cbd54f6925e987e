"""Error of the pipe network against discrete thermal elements and the truth.

``python studies/feng2009/analyse.py [--realizations 6] [--output DIRECTORY]`` solves the 12-particle assembly of
Feng et al. 2008 and random assemblies over density and contact half-angle by the pipe network with both of its
resistances, by ``chord`` and by ``exact``; writes assembly.csv, random.csv and errors.png.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import numpy as np

from etc_engine import (
    Box,
    PackingSpec,
    bonded_contacts,
    effective_conductivity,
    overlap_contacts,
    pack,
    parse_radii,
    read_csv,
)
from etc_engine.engines.dtem.conductivity import element_conductivity
from etc_engine.engines.pipe.steady import pipe_conductivity
from etc_engine.medium.medium import medium_of
from etc_engine.medium.network import ContactNetwork
from etc_engine.output.figures.canvas import COLOURS, INK, MARKERS, TEXT, legend, new_panels, save

HERE = Path(__file__).parent
TRUTH = 0.2787774  # corner-graded finite elements between two energy bounds, +- 1e-7
SEED = 20092
DENSITIES = (0.65, 0.70, 0.75)
DEGREES = (1.0, 2.5, 5.0, 10.0, 15.0)
METHODS = ("pipe, uniform", "pipe, chord", "chord")
LABELS = {
    "pipe, uniform": "pipe network, uniform flux",
    "pipe, chord": "pipe network, chord",
    "chord": "thermal elements, chord",
}
MODES = 3


def conductivity(network: ContactNetwork, method: str) -> float:
    """Mean of the conductivities along both axes."""
    if method.startswith("pipe"):
        tensor = pipe_conductivity(medium_of(network), method=method.split(", ")[1]).tensor
    else:
        modes = {"modes": MODES} if method == "exact" else {}
        tensor = element_conductivity(medium_of(network), method=method, **modes).tensor
    return float(np.mean(np.diag(tensor)))


def assembly(output: Path) -> None:
    """The 12-particle assembly along x, walls left and right."""
    network = overlap_contacts(read_csv(HERE.parent / "feng2008" / "particles.csv", Box((1.0, 1.0))).packing)
    values = {f"pipe, {r}": pipe_conductivity(medium_of(network), method=r, axes=(0,)) for r in ("uniform", "chord")}
    values |= {
        method: effective_conductivity(medium_of(network), method=method, axes=(0,))
        for method in ("standard", "chord", "exact")
    }
    with (output / "assembly.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["method", "unknowns", "conductivity", "error_percent"])
        for method, result in values.items():
            k = float(result.tensor[0, 0])
            writer.writerow([method, result.unknowns, f"{k:.6f}", f"{100 * (k / TRUTH - 1):+.3f}"])
            print(f"{method:14s} {result.unknowns:3d} unknowns  k = {k:.6f}  {100 * (k / TRUTH - 1):+.3f} %")


def random_assemblies(realizations: int) -> dict[tuple[float, float, str], np.ndarray]:
    """Signed errors against ``exact`` in per cent, by density, half-angle in degrees and method."""
    radii, box = parse_radii("uniform:0.02:0.04"), Box((1.0, 1.0))
    errors: dict[tuple[float, float, str], list[float]] = {}
    for number, density in enumerate(DENSITIES):
        for realization in range(realizations):
            spec = PackingSpec("advancing-front", radii, box, density=density)
            packing = pack(spec, np.random.default_rng([SEED, number, realization]))
            for degrees in DEGREES:
                network = bonded_contacts(packing, np.radians(degrees))
                truth = conductivity(network, "exact")
                if truth == 0.0:
                    continue  # no path of contacts along either axis
                for method in METHODS:
                    error = 100.0 * (conductivity(network, method) / truth - 1.0)
                    errors.setdefault((density, degrees, method), []).append(error)
    return {key: np.array(values) for key, values in errors.items()}


def write(errors: dict[tuple[float, float, str], np.ndarray], path: Path) -> None:
    """Mean and extremes of the errors."""
    with path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["density", "half_angle_degree", "method", "error_mean_percent", "error_min", "error_max"])
        for (density, degrees, method), values in errors.items():
            row = [f"{value:+.4f}" for value in (values.mean(), values.min(), values.max())]
            writer.writerow([density, degrees, method, *row])


def draw(errors: dict[tuple[float, float, str], np.ndarray], path: Path) -> None:
    """Signed errors over the half-angle, a panel for each density."""
    figure, panels = new_panels(1, len(DENSITIES), sharey=True)
    for axes, density in zip(panels, DENSITIES, strict=True):
        for method, colour, marker in zip(METHODS, COLOURS, MARKERS, strict=False):
            rows = [errors[density, degrees, method] for degrees in DEGREES]
            mean = [values.mean() for values in rows]
            axes.fill_between(
                DEGREES,
                [values.min() for values in rows],
                [values.max() for values in rows],
                color=colour,
                alpha=0.2,
                linewidth=0,
            )
            axes.plot(DEGREES, mean, color=colour, marker=marker, markersize=4, linewidth=1.0, label=LABELS[method])
        axes.axhline(0.0, color=INK, linewidth=0.6)
        axes.set_title(f"density {density:.2f}", fontsize=TEXT)
        axes.set_xlabel("contact half-angle [degree]")
    panels[0].set_ylabel("error against exact [%]")
    legend(figure, *panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    save(figure, path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--realizations", type=int, default=6)
    parser.add_argument("--output", type=Path, default=HERE)
    arguments = parser.parse_args()
    assembly(arguments.output)
    errors = random_assemblies(arguments.realizations)
    write(errors, arguments.output / "random.csv")
    draw(errors, arguments.output / "errors.png")
    for method in METHODS:
        every = np.concatenate([values for (_, _, m), values in errors.items() if m == method])
        print(f"{method:14s} random assemblies: {every.min():+.3f} .. {every.max():+.3f} % of exact")


if __name__ == "__main__":
    main()
