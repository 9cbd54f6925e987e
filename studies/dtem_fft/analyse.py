"""DTEM against FFT on one geometry: ``python studies/dtem_fft/analyse.py [--largest N] [--output DIRECTORY]``

The body is the union of slightly overlapping disks in a periodic box without a matrix. Method ``exact`` bounds its
conductivity from both sides. Finer and finer grids show the error of voxels at necks alone (a square array), and at
necks and narrow gaps (a random packing). Two minutes.
"""

from __future__ import annotations

import argparse
import csv
import time
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from etc_engine import Box, PackingSpec, ParticlePacking, effective_conductivity, overlap_contacts, pack, parse_radii
from etc_engine.engines.dtem.conductivity import conductivity_bounds
from etc_engine.engines.voxel import Scheme, solve_cell, voxelize
from etc_engine.medium.medium import Medium, Pores, medium_of
from etc_engine.medium.network import ContactNetwork
from etc_engine.output.figures.canvas import COLOURS, GREY, INK, TEXT, WIDE, legend, new_figure, save, style

HERE = Path(__file__).parent
SEED = 5107
COUNT, DENSITY, GROWTH = 30, 0.83, 1.03
HALF_ANGLE = np.radians(11.0)
RESOLUTIONS = (48, 64, 96, 128, 192, 256, 384, 512, 768, 1024, 1536, 2048)
KINDS = {
    "binary": (COLOURS[1], "s", "binary voxels"),
    "laminate": (COLOURS[0], "o", "voxels of mean conductivity"),
}


def overlapping_disks() -> ParticlePacking:
    """A jammed packing whose radii grow until the contacts are arcs."""
    radii = parse_radii("bidisperse:1:1.4:0.5")
    spec = PackingSpec("lubachevsky-stillinger", radii, Box((1.0, 1.0), (True, True)), COUNT, DENSITY)
    jammed = pack(spec, np.random.default_rng(SEED))
    return jammed.with_radii(GROWTH * jammed.radii)


def square_array() -> ParticlePacking:
    """Disks on a square lattice, joined by necks of a half-angle; no gaps."""
    return ParticlePacking([[0.5, 0.5]], [0.5 / np.cos(HALF_ANGLE)], Box((1.0, 1.0), (True, True)))


def elements(network: ContactNetwork) -> dict[str, float]:
    """Conductivity along x by the methods of the DTEM, and the bounds of ``exact``."""
    found = {
        name: float(effective_conductivity(medium_of(network), method=name).tensor[0, 0])
        for name in ("standard", "enhanced", "chord")
    }
    exact = effective_conductivity(medium_of(network), method="exact", modes=5)
    low, high = conductivity_bounds(exact)[0]
    return found | {"exact": float(exact.tensor[0, 0]), "lower bound": float(low), "upper bound": float(high)}


def grids(name: str, packing: ParticlePacking, largest: int, exact: float) -> list[dict[str, float | str]]:
    """Conductivity along x on grids, with the width of a contact and the gaps they bridge in voxels."""
    rows = []
    composite = Medium(packing, 1.0, pores=Pores(0.0))
    for kind in KINDS:
        for n in (n for n in RESOLUTIONS if n <= largest):
            start = time.perf_counter()
            image = voxelize(composite, n, kind)
            solved = solve_cell(image.conductivity, (1.0, 1.0), axes=(0,), scheme=Scheme(tolerance=1e-6, limit=20_000))
            rows.append(
                {
                    "geometry": name,
                    "voxels": kind,
                    "resolution": n,
                    "voxels_across_a_disk": 2.0 * n * float(packing.radii.mean()),
                    "fraction": image.volume_fraction,
                    "conductivity": float(solved.tensor[0, 0]),
                    "error": float(solved.tensor[0, 0]) / exact - 1.0,
                    "iterations": solved.iterations,
                    "seconds": time.perf_counter() - start,
                }
            )
            row = rows[-1]
            print(
                f"{name:8s}{kind:9s}{n:6d}{row['conductivity']:11.6f}{100 * row['error']:+9.2f} %{row['seconds']:7.1f}s"
            )
    return rows


def draw_contact(axes, packing: ParticlePacking, network: ContactNetwork, n: int) -> None:
    """The widest contact and what a grid makes of it."""
    at = int(np.argmax(network.angles.mean(axis=1)))
    i = network.pairs[at, 0]
    radius = packing.radii[i]
    branch = network.branches[at]
    middle = packing.centers[i] + branch / np.hypot(*branch) * radius * np.cos(network.angles[at, 0])
    image = voxelize(Medium(packing, 1.0, pores=Pores(0.0)), n, "binary").conductivity.scalars
    tiled = np.tile(image, (3, 3))
    reach = 0.55 * radius
    axes.imshow(tiled.T, origin="lower", extent=(-1, 2, -1, 2), cmap="Blues", vmin=0.0, vmax=2.2, interpolation="none")
    angle = np.linspace(0.0, 2.0 * np.pi, 721)
    for shift in np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1]), axis=-1).reshape(-1, 2):
        for center, size in zip(packing.centers + shift, packing.radii, strict=True):
            axes.plot(center[0] + size * np.cos(angle), center[1] + size * np.sin(angle), color=INK, linewidth=0.8)
    axes.set_xlim(middle[0] - reach, middle[0] + reach)
    axes.set_ylim(middle[1] - reach, middle[1] + reach)
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_title(f"{n} × {n} voxels", fontsize=TEXT)


def draw(packing: ParticlePacking, network: ContactNetwork, found: dict[str, float], rows: list) -> Figure:
    figure = new_figure(WIDE, 5.2)
    left, right = figure.subfigures(1, 2, width_ratios=(1, 2.4))
    for axes, n in zip(left.subplots(2, 1), (96, 384), strict=True):
        draw_contact(axes, packing, network, n)
    axes = right.subplots()
    style(axes)
    for name, fill in (("packing", "full"), ("square", "none")):
        for kind, (colour, marker, label) in KINDS.items():
            chosen = [row for row in rows if row["voxels"] == kind and row["geometry"] == name]
            x = [row["voxels_across_a_disk"] for row in chosen]
            error = [100.0 * row["error"] for row in chosen]
            what = "random packing" if name == "packing" else "square array"
            line = "-" if name == "packing" else "--"
            axes.plot(
                x,
                error,
                color=colour,
                marker=marker,
                fillstyle=fill,
                linestyle=line,
                markersize=5,
                label=f"{what}, {label}",
            )
    for name, line in (("standard", ":"), ("enhanced", "-."), ("chord", (0, (8, 2)))):
        error = 100.0 * (found[name] / found["exact"] - 1.0)
        axes.axhline(error, color=GREY, linestyle=line, linewidth=1.0, label=f"elements, {name}: {error:+.2f} %")
    axes.axhline(0.0, color=INK, linewidth=1.0, label="elements, exact")
    axes.set_xscale("log")
    axes.set_yscale("symlog", linthresh=1.0)
    axes.set_yticks([-5, -1, 0, 1, 5, 10, 50], ["-5", "-1", "0", "1", "5", "10", "50"])
    axes.set_ylim(-12, 110)
    axes.set_xlabel("voxels across a disk [-]")
    axes.set_ylabel("error of the conductivity [%]")
    legend(figure, *axes.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--largest", type=int, default=RESOLUTIONS[-1])
    parser.add_argument("--output", type=Path, default=HERE)
    options = parser.parse_args()
    rows, kept = [], {}
    for name, packing, largest in (
        ("packing", overlapping_disks(), options.largest),
        ("square", square_array(), min(options.largest, 512)),
    ):
        network = overlap_contacts(packing)
        widths = packing.radii[network.pairs[:, 0]] * np.sin(network.angles[:, 0]) / packing.radii.mean()
        print(
            f"{name}: {packing.count} disks, {network.count} contacts, half-angle "
            f"{np.degrees(network.angles.mean()):.2f} degrees; contacts {widths.mean():.3f} diameters wide"
        )
        kept[name] = packing, network, elements(network)
        for method, value in kept[name][2].items():
            print(f"{method:16s}{value:12.8f}")
        rows += grids(name, packing, largest, kept[name][2]["exact"])
    with (options.output / "table.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    save(draw(*kept["packing"], rows), options.output / "figure.png")
    for name in kept:
        last = {kind: [r for r in rows if r["voxels"] == kind and r["geometry"] == name][-1] for kind in KINDS}
        found = ", ".join(f"{kind} {100 * row['error']:+.2f} %" for kind, row in last.items())
        print(f"{name}, finest grid against exact: {found}")


if __name__ == "__main__":
    main()
