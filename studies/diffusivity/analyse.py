"""Does a packing warm up like a slab, and is its diffusivity k_eff/(rho c)_eff?

``python studies/diffusivity/analyse.py [--largest 4096] [--disks 40000] [--output DIRECTORY]`` heats packings
of growing size from either wall, fits the exact series of the slab to their mean temperatures, compares the diffusivity
with that of the steady state of the same pipe network, and writes table.csv and figure.png.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import numpy as np

from etc_engine import Box, PackingSpec, pack, parse_radii
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import coordination_contacts
from etc_engine.output.figures.canvas import COLOURS, INK, MARKERS, legend, new_panels, save
from etc_engine.transient.diffusivity import WINDOW, Diffusivity, effective_diffusivity, slab_mean

HERE = Path(__file__).parent
SEED = 20264
SIZES = (16, 64, 256, 1024, 4096)
DENSITY, COORDINATION, HALF_ANGLE = 0.75, 4.8, 5.0


Pair = tuple[Diffusivity, Diffusivity]


def measure(count: int, number: int) -> Pair:
    """One packing, walled along x and periodic along y, heated from the left and from the right."""
    rng = np.random.default_rng([SEED, count, number])
    box = Box((1.0, 1.0), (False, True))
    spec = PackingSpec("lubachevsky-stillinger", parse_radii("uniform:1:2"), box, count=count, density=DENSITY)
    network = coordination_contacts(pack(spec, rng), np.radians(HALF_ANGLE), COORDINATION)
    return effective_diffusivity(medium_of(network, heat_capacity=1.0), heated="left"), effective_diffusivity(
        medium_of(network, heat_capacity=1.0), heated="right"
    )


def run(largest: int, disks: int) -> dict[int, list[Pair]]:
    """All realizations of every size."""
    found: dict[int, list[Pair]] = {}
    for count in (n for n in SIZES if n <= largest):
        realizations = int(np.clip(disks // count, 4, 60))
        found[count] = [measure(count, number) for number in range(realizations)]
        row = summary(count, found[count])
        print(
            f"{count:6d} disks, {realizations:3d} realizations: transient {row['transient_mean']:.5f}, steady "
            f"{row['steady_mean']:.5f} m2/s, difference {row['difference_percent']:+.2f} % (spread "
            f"{row['difference_spread_percent']:.2f} %), right over left {row['right_over_left_percent']:+.1f} %, "
            f"misfit {row['misfit']:.4f}"
        )
    return found


def summary(count: int, sample: list[Pair]) -> dict[str, float]:
    """Means over the realizations of one size; the difference is that of each packing's mean with its steady value."""
    both, steady = np.array([(a.transient, b.transient) for a, b in sample]), np.array([a.steady for a, _ in sample])
    transient = both.mean(axis=1)
    difference = 100.0 * (transient / steady - 1.0)
    return {
        "particles": count,
        "realizations": len(sample),
        "transient_mean": transient.mean(),
        "steady_mean": steady.mean(),
        "difference_percent": difference.mean(),
        "difference_sem_percent": difference.std(ddof=1) / np.sqrt(len(sample)),
        "difference_spread_percent": difference.std(ddof=1),
        "right_over_left_percent": 100.0 * float((both[:, 1] / both[:, 0]).mean() - 1.0),
        "misfit": float(np.mean([d.misfit for pair in sample for d in pair])),
    }


def draw(found: dict[int, list[Pair]], path: Path) -> None:
    """Warming curves on the slab's, and the difference over size."""
    figure, (left, right) = new_panels(1, 2)
    fine = np.geomspace(2e-3, 2.0, 200)
    for (count, sample), colour, marker in zip(found.items(), COLOURS, MARKERS, strict=False):
        curve = sample[0][0]
        fourier = curve.transient * curve.times
        seen = (fourier >= fine[0]) & (fourier <= fine[-1])
        look = {"color": colour, "marker": marker, "markersize": 3, "linestyle": "none"}
        left.plot(fourier[seen], curve.means[seen], label=f"{count} disks", **look)
    left.plot(fine, slab_mean(fine), "-", color=INK, linewidth=0.8, label="slab, exact")
    left.axhspan(*WINDOW, color="0.95", zorder=0, label="fitted")
    left.set(xscale="log", xlabel="Fourier number with the fitted diffusivity [-]", ylabel="mean temperature [-]")
    legend(left)
    rows = [summary(count, sample) for count, sample in found.items()]
    size = np.array([row["particles"] for row in rows])
    mean = np.array([row["difference_percent"] for row in rows])
    spread = np.array([row["difference_spread_percent"] for row in rows])
    right.errorbar(size, mean, 2.0 * np.array([row["difference_sem_percent"] for row in rows]), fmt="o", markersize=4)
    right.fill_between(size, mean - spread, mean + spread, color=COLOURS[0], alpha=0.15)
    right.axhline(0.0, color=INK, linewidth=0.6)
    right.set(xscale="log", xlabel="disks", ylabel="transient over steady diffusivity - 1 [%]")
    save(figure, path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--largest", type=int, default=4096)
    parser.add_argument("--disks", type=int, default=40_000, help="of a size, in 4 to 60 realizations")
    parser.add_argument("--output", type=Path, default=HERE)
    arguments = parser.parse_args()
    found = run(arguments.largest, arguments.disks)
    with (arguments.output / "table.csv").open("w", newline="") as file:
        rows = [summary(count, sample) for count, sample in found.items()]
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(rows[0])
        writer.writerows([[f"{value:.6g}" for value in row.values()] for row in rows])
    draw(found, arguments.output / "figure.png")


if __name__ == "__main__":
    main()
