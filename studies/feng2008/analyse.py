"""Rebuild the examples of Feng, Han, Li, Owen 2008: tables 3 and 4 with every method, and both temperature pictures.

``python studies/feng2008/analyse.py [--output DIRECTORY]`` writes table3.csv, table4.csv, example1.png, example2.png,
errors.png. Reads the published values from tests/published/data.
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
from etc_engine.engines.dtem.field import recover_field
from etc_engine.engines.dtem.methods import METHODS
from etc_engine.medium.medium import medium_of
from etc_engine.output.figures import save_field
from etc_engine.output.figures.canvas import MARKERS, legend, new_panels, save

HERE = Path(__file__).parent
PUBLISHED = HERE.parents[1] / "tests" / "published" / "data"
TRUTH = 0.2787774  # corner-graded finite elements between two energy bounds, +- 1e-7
SEED = 2008
PAPER = {"standard": 0.2678, "enhanced": 0.2757}


def tables(output: Path) -> None:
    """Tables 3 and 4 with a column for every method, and the converged truth."""
    network = overlap_contacts(read_csv(HERE / "particles.csv", Box((1.0, 1.0))).packing)
    results = {method: effective_conductivity(medium_of(network), method=method, axes=(0,)) for method in METHODS}
    with (output / "table3.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["method", "kappa_hat", "error_percent", "paper"])
        for method, result in results.items():
            k = result.tensor[0, 0]
            writer.writerow([method, f"{k:.7f}", f"{100 * (k / TRUTH - 1):+.4f}", PAPER.get(method, "")])
        writer.writerow(["converged finite elements", TRUTH, "0", "0.2824 (not converged)"])
    published = np.genfromtxt(PUBLISHED / "feng2008_table4_contact_temperatures.csv", delimiter=",", names=True)
    temperatures = {
        method: recover_field(result.solutions[0]).contact_temperatures for method, result in results.items()
    }
    with (output / "table4.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["zone", "particles", *temperatures, "paper_standard", "paper_enhanced", "converged_truth"])
        for zone, (i, j) in enumerate(network.pairs):
            row = [f"{values[zone]:.6f}" for values in temperatures.values()]
            paper = [
                published[name][zone] for name in ("paper_dtem_standard", "paper_dtem_enhanced", "converged_truth")
            ]
            writer.writerow([zone + 1, f"{i + 1}-{j + 1}", *row, *paper])
    solution = results["chord"].solutions[0]
    caption = f"12 particles, method chord: k = {results['chord'].tensor[0, 0]:.6f} W/(m K)"
    save_field(output / "example1.png", recover_field(solution), caption)
    draw_errors(output / "errors.png", published["converged_truth"], temperatures)


def draw_errors(path: Path, truth: np.ndarray, temperatures: dict[str, np.ndarray]) -> None:
    """Error of the 17 contact temperatures, by method."""
    figure, (axes,) = new_panels()
    zones = np.arange(1, truth.size + 1)
    for marker, (method, values) in zip(MARKERS, temperatures.items(), strict=False):
        axes.semilogy(zones, np.abs(values - truth), marker, markersize=4, label=method)
    axes.set(xlabel="contact", ylabel="temperature, difference to the truth [K]", xticks=zones)
    legend(figure, ncols=5, loc="outside upper center")
    save(figure, path)


def second_example(output: Path) -> str:
    """About 1084 particles by the advancing front, radii uniform in [0.01, 0.02], contacts of 5 degrees."""
    spec = PackingSpec("advancing-front", parse_radii("uniform:0.01:0.02"), Box((1.0, 1.0)))
    packing = pack(spec, np.random.default_rng(SEED))
    network = bonded_contacts(packing, np.radians(5.0))
    result = effective_conductivity(medium_of(network), axes=(0,))
    text = (
        f"{packing.count} particles, {network.count} contacts, coordination {network.coordination:.3f}, "
        f"{result.unknowns} unknowns: k = {result.tensor[0, 0]:.5f} W/(m K)"
    )
    save_field(output / "example2.png", recover_field(result.solutions[0]), text)
    return text


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=HERE)
    output = parser.parse_args().output
    tables(output)
    print((output / "table3.csv").read_text())
    print(second_example(output))


if __name__ == "__main__":
    main()
