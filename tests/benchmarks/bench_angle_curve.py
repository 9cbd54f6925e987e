"""Contact-angle curves: every half-angle solved in full against the reduced basis.

Run ``python tests/benchmarks/bench_angle_curve.py`` (``--disks 1000 --profile`` for one size and where its time
goes). One walled packing of bonded disks a size, both load axes, 20 half-angles from 1 to 20 degrees; errors are
against full solves at a tolerance of 1e-12. Set OMP_NUM_THREADS=1.
"""

from __future__ import annotations

import argparse
import cProfile
import pstats
import time
from dataclasses import replace

import numpy as np

from etc_engine.box import Box
from etc_engine.packing import PackingSpec, pack, parse_radii
from etc_engine.particle_files.table import ParticleTable
from etc_engine.realization import ENGINES, Conduction, RealizationSpec
from etc_engine.realization.media import make_media

BOND_GAP = 1e-3


def study(disks: int, method: str, angles: int) -> RealizationSpec:
    radius = np.sqrt(0.8 / (np.pi * disks))
    radii = parse_radii(f"uniform:{0.7 * radius}:{1.3 * radius}")
    return RealizationSpec(
        PackingSpec("advancing-front", radii, Box((1.0, 1.0)), radius_growth=False),
        "bonded",
        (Conduction("dtem", method),),
        {"particle_conductivity": 1.0, "bond_gap": BOND_GAP},
        {"contact_angle": tuple(np.radians(np.linspace(1.0, 20.0, angles)))},
    )


def solve(packing, spec: RealizationSpec, curve: str = "reduced", tolerance: float = 1e-10):
    """Seconds and diagonal conductivities, shape (angles, 2), and the cells."""
    start = time.perf_counter()
    conduction = replace(spec.conduction[0], options={"angle_curve": curve}, tolerance=tolerance)
    media = make_media(ParticleTable(packing), spec, np.random.default_rng(0), contacts=True)
    column = ENGINES["dtem"].conduct(media, conduction, 0)
    seconds = time.perf_counter() - start
    return seconds, np.array([np.diag(cell.conductivity) for cell in column]), column


def compare(disks: int, method: str, angles: int, runs: int) -> None:
    spec = study(disks, method, angles)
    packing = pack(spec.packing, np.random.default_rng(331))
    solve(packing, spec)  # compiles
    full = min(solve(packing, spec, "full")[0] for _ in range(runs))
    reduced, k, cells = min((solve(packing, spec) for _ in range(runs)), key=lambda found: found[0])
    _, exact, _ = solve(packing, spec, "full", tolerance=1e-12)
    solves = sum(cell.solved_by == "full" for cell in cells)
    worst = max(cell.relative_energy_error for cell in cells)
    print(
        f"{packing.count:8d} {method:>9s} {angles:7d} {full:10.3f} {reduced:10.3f} {full / reduced:7.2f} {solves:7d}"
        f" {np.abs(k / exact - 1.0).max():10.1e} {worst:10.1e} {(k / exact - 1.0).min():10.1e}",
        flush=True,
    )


def profile(disks: int, method: str, angles: int) -> None:
    """Where the time of the reduced curve goes."""
    spec = study(disks, method, angles)
    packing = pack(spec.packing, np.random.default_rng(331))
    solve(packing, spec)
    with cProfile.Profile() as record:
        solve(packing, spec)
    pstats.Stats(record).sort_stats("tottime").print_stats(18)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--disks", type=int, nargs="+", default=[1000, 10_000, 100_000])
    parser.add_argument("--method", default="chord")
    parser.add_argument("--angles", type=int, default=20)
    parser.add_argument("--runs", type=int, default=1, help="the best of so many")
    parser.add_argument("--profile", action="store_true")
    options = parser.parse_args()
    names = ("disks", "method", "angles", "full s", "reduced s", "ratio", "solves", "error", "estimate", "least")
    widths = (8, 9, 7, 10, 10, 7, 7, 10, 10, 10)
    print(" ".join(f"{name:>{width}s}" for name, width in zip(names, widths, strict=True)))
    for disks in options.disks:
        compare(disks, options.method, options.angles, options.runs)
        if options.profile:
            profile(disks, options.method, options.angles)


if __name__ == "__main__":
    main()
