"""Error of every method against ``exact``, the estimate of it for ``chord``, and how the bounds of ``exact`` close.

``python studies/accuracy/analyse.py [--output DIRECTORY]`` writes map.csv and map.png (errors over the contact
half-angle), calibration.csv and estimate.png (the estimate for ``chord``), bounds.csv and bounds.png. 90 seconds.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from etc_engine import (
    Box,
    PackingSpec,
    ParticlePacking,
    bonded_contacts,
    effective_conductivity,
    overlap_contacts,
    pack,
    parse_radii,
    read_csv,
)
from etc_engine.engines.dtem.conductivity import conductivity_bounds
from etc_engine.engines.dtem.model_error import chord_error_estimate, chord_error_terms
from etc_engine.errors import GeometryError
from etc_engine.medium.medium import medium_of
from etc_engine.medium.network import ContactNetwork
from etc_engine.output.figures.canvas import COLOURS, GREY, INK, MARKERS, TEXT, legend, mark_outside, new_panels, save

HERE = Path(__file__).parent
SEED = 4201
METHODS = ("standard", "enhanced", "arc", "chord")
SHADES = dict(zip(METHODS, COLOURS, strict=False)) | {"estimate": INK}
MODES = 5
HEIGHT = np.sqrt(3.0)


@dataclass(frozen=True)
class Case:
    """One packing and its contacts.

    ``panel`` is where it is drawn, ``fitted`` whether the estimate for ``chord`` learns from it.
    """

    panel: str
    name: str
    degrees: float
    network: ContactNetwork
    fitted: bool = True


def lattices() -> dict[str, ParticlePacking]:
    """Touching disks of unit diameter in periodic boxes."""
    both = (True, True)
    return {
        "square": ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0), both)),
        "hexagonal": ParticlePacking([[0, 0], [0.5, HEIGHT / 2]], [0.5] * 2, Box((1.0, HEIGHT), both)),
        "honeycomb": ParticlePacking(
            [[0, 0], [1, 0], [1.5, HEIGHT / 2], [2.5, HEIGHT / 2]], [0.5] * 4, Box((3.0, HEIGHT), both)
        ),
    }


def pairs() -> dict[str, ParticlePacking]:
    """Two disks in a row between walls."""
    return {
        "equal pair": ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25] * 2, Box((1.0, 1.0))),
        "pair 3:1": ParticlePacking([[0.375, 0.5], [0.875, 0.5]], [0.375, 0.125], Box((1.0, 1.0))),
    }


def cases() -> Iterator[Case]:
    for name, packing in pairs().items():
        for degrees in (1, 2, 5, 10, 15, 20, 30, 40, 50, 60):
            yield Case("isolated pairs", name, degrees, bonded_contacts(packing, np.radians(degrees)))
    for name, packing in lattices().items():
        for degrees in (1, 2, 3, 5, 7, 10, 12, 15, 18, 20, 22, 25, 27, 30, 35, 40, 50):
            yield Case("lattices", name, degrees, bonded_contacts(packing, np.radians(degrees)))
    box = Box((1.0, 1.0))
    for number, radii in enumerate(("uniform:0.03:0.06", "equal:0.04", "uniform:0.02:0.08") * 2):
        packing = pack(PackingSpec("advancing-front", parse_radii(radii), box), np.random.default_rng(SEED + number))
        network = bonded_contacts(packing, 0.01)
        for degrees in (1, 2, 5, 8, 10, 12, 15, 18, 20, 22, 25):
            bonded = network.with_half_angle(np.radians(degrees))
            name = f"{radii} ({packing.count} disks)"
            yield Case("random packings", name, degrees, bonded, fitted=number < 3)
    rng = np.random.default_rng(SEED + 50)
    for number, (shift, low, high) in enumerate(
        ((0.02, 0.51, 0.52), (0.08, 0.53, 0.58), (0.02, 0.55, 0.62), (0.05, 0.52, 0.60)) * 2
    ):
        grid = np.stack(np.meshgrid(np.arange(8), np.arange(8), indexing="ij"), axis=-1).reshape(-1, 2) + 0.5
        centers = (grid + shift * rng.uniform(-1, 1, grid.shape)) / 8
        packing = ParticlePacking(centers, rng.uniform(low, high, 64) / 8, Box((1.0, 1.0), (True, True)))
        network = overlap_contacts(packing)
        mean = float(np.degrees(network.angles.mean()))
        yield Case("random packings", f"overlapping {low}-{high}", mean, network, fitted=number < 4)


def evaluate(case: Case) -> dict[str, object] | None:
    """Errors of all methods, the terms and the estimate for ``chord``; None where contacts leave no free arc."""
    try:
        exact = effective_conductivity(medium_of(case.network), method="exact", modes=MODES, axes=(0,))
        others = {m: effective_conductivity(medium_of(case.network), method=m, axes=(0,)) for m in METHODS}
    except GeometryError:
        return None
    value, (low, high) = exact.tensor[0, 0], conductivity_bounds(exact)[0]
    chord = others["chord"].solutions[0]
    return {
        "panel": case.panel,
        "name": case.name,
        "coordination": case.network.coordination,
        "degrees": case.degrees,
        "exact": value,
        "bound_width": high / low - 1.0,
        **{m: result.tensor[0, 0] / value - 1.0 for m, result in others.items()},
        "estimate": chord_error_estimate(chord),
        "fitted": int(case.fitted),
        "terms": chord_error_terms(chord),
    }


def fit(rows: list[dict]) -> np.ndarray:
    """Least squares of the relative misfit over the fitted cases: c_S, c_M, c_J."""
    rows = [row for row in rows if row["fitted"]]
    errors, terms = np.array([row["chord"] for row in rows]), np.array([row["terms"] for row in rows])
    weights = 1.0 / (np.abs(errors) + 2e-5 + 0.02 * terms[:, 0])  # not the last digits where terms cancel
    return np.linalg.lstsq(terms * [1, 1, -1] * weights[:, None], errors * weights, rcond=None)[0]


def write(path: Path, header: list[str], rows: list[list[object]]) -> None:
    with path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows([f"{v:.6g}" if isinstance(v, float) else v for v in row] for row in rows)


def draw_map(rows: list[dict], path: Path) -> None:
    panels = list(dict.fromkeys(row["panel"] for row in rows))
    figure, places = new_panels(1, len(panels), 4.6, sharey=True)
    for axes, panel in zip(places, panels, strict=True):
        axes.set(xscale="log", yscale="log", xlim=(0.8, 70.0), ylim=(1e-7, 1.0))
        chosen = [row for row in rows if row["panel"] == panel]
        for name, marker in zip(dict.fromkeys(row["name"] for row in chosen), (*MARKERS, "<", ">"), strict=False):
            mine = sorted((row for row in chosen if row["name"] == name), key=lambda row: row["degrees"])
            for method in (*METHODS, "estimate"):
                degrees, errors = [row["degrees"] for row in mine], [abs(row[method]) for row in mine]
                axes.plot(
                    degrees,
                    errors,
                    marker=marker if method != "estimate" else "none",
                    ms=3.5,
                    lw=0.9,
                    ls=(":" if method == "estimate" else "-") if len({row["degrees"] for row in mine}) > 4 else "none",
                    color=SHADES[method],
                )
                mark_outside(axes, degrees, errors, SHADES[method])
        axes.set_title(panel, fontsize=TEXT)
        axes.set_xlabel("contact half-angle [degrees]")
    axes = places[0]
    axes.set_ylabel("error of the conductivity against exact [-]")
    names = [axes.plot([], [], color=SHADES[m], ls=":" if m == "estimate" else "-")[0] for m in SHADES]
    labels = [*METHODS, "estimate for chord"]
    legend(figure, names, labels, loc="outside upper center", ncols=5)
    save(figure, path)


def draw_estimate(rows: list[dict], path: Path) -> None:
    figure, (axes,) = new_panels(height=5.0)
    for k, (panel, marker) in enumerate((("isolated pairs", "^"), ("lattices", "s"), ("random packings", "o"))):
        for fitted in (1, 0):
            mine = [row for row in rows if row["panel"] == panel and row["fitted"] == fitted]
            axes.loglog(
                [abs(row["chord"]) for row in mine],
                [row["estimate"] for row in mine],
                marker,
                ms=4,
                mfc="none" if fitted else None,
                color=COLOURS[k],
                label=panel + (" (fitted)" if fitted else " (not fitted)") if mine else None,
            )
    line = np.array([1e-7, 0.3])
    axes.loglog(line, line, "-", color=INK, lw=0.8, label="estimate = error")
    axes.loglog(line, 3 * line, ":", color=INK, lw=0.8, label="estimate = 3 x error")
    axes.set(xlabel="error of chord against exact [-]", ylabel="estimate [-]", xlim=line, ylim=line)
    mark_outside(axes, [abs(row["chord"]) for row in rows], [row["estimate"] for row in rows], GREY)
    legend(axes)
    save(figure, path)


def bounds(output: Path) -> None:
    """Relative distance of the two bounds over the number of flux modes."""
    twelve = read_csv(HERE.parent / "feng2008" / "particles.csv", Box((1.0, 1.0))).packing
    front = pack(
        PackingSpec("advancing-front", parse_radii("uniform:0.03:0.06"), Box((1.0, 1.0))), np.random.default_rng(SEED)
    )
    hexagonal = lattices()["hexagonal"]
    networks = {
        "12 particles of Feng et al. 2008": overlap_contacts(twelve),
        "random packing, 10 degrees": bonded_contacts(front, np.radians(10.0)),
        "hexagonal, 10 degrees": bonded_contacts(hexagonal, np.radians(10.0)),
        "hexagonal, 25 degrees": bonded_contacts(hexagonal, np.radians(25.0)),
        "hexagonal, 29 degrees": bonded_contacts(hexagonal, np.radians(29.0)),
    }
    modes = range(1, 9)
    rows = []
    figure, (axes,) = new_panels(height=4.4)
    for (name, network), marker in zip(networks.items(), MARKERS, strict=False):
        pairs = []
        for m in modes:
            result = effective_conductivity(medium_of(network), method="exact", modes=m, axes=(0,))
            low, high = conductivity_bounds(result)[0]
            pairs.append((low, high))
            rows.append([name, m, f"{low:.10f}", f"{high:.10f}", high / low - 1.0])
        axes.semilogy(modes, [high / low - 1.0 for low, high in pairs], marker=marker, ms=4, label=name)
    axes.set(xlabel="flux modes per contact", ylabel="upper bound over lower bound - 1 [-]")
    legend(axes)
    save(figure, output / "bounds.png")
    write(output / "bounds.csv", ["name", "modes", "lower", "upper", "relative_distance"], rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=HERE)
    output = parser.parse_args().output
    output.mkdir(parents=True, exist_ok=True)
    rows = [row for row in map(evaluate, cases()) if row is not None]
    header = [key for key in rows[0] if key != "terms"]
    write(output / "map.csv", header, [[row[key] for key in header] for row in rows])
    coefficients = fit(rows)
    ratios = np.array([row["estimate"] / (abs(row["chord"]) + 2e-5) for row in rows])
    covered = np.array([row["estimate"] >= abs(row["chord"]) - 2e-5 for row in rows])
    left = np.array([not row["fitted"] for row in rows])
    summary = [[name, f"{value:.3f}"] for name, value in zip(("c_S", "c_M", "c_J"), coefficients, strict=True)] + [
        ["cases", len(rows)],
        ["cases not fitted", int(left.sum())],
        ["estimate covers the error", f"{covered.mean():.3f}"],
        ["estimate covers the error, not fitted", f"{covered[left].mean():.3f}"],
        ["median of estimate over error", f"{np.median(ratios):.2f}"],
        ["largest bound width of exact", f"{max(row['bound_width'] for row in rows):.2e}"],
    ]
    write(output / "calibration.csv", ["quantity", "value"], summary)
    for name, value in summary:
        print(f"{name:40s}{value}")
    draw_map(rows, output / "map.png")
    draw_estimate(rows, output / "estimate.png")
    bounds(output)


if __name__ == "__main__":
    main()
