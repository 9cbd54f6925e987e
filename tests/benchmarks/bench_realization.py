"""Processor time of one realization of about a thousand disks with ten contact angles and both directions.

Run by hand: ``OMP_NUM_THREADS=1 python tests/benchmarks/bench_realization.py [--profile]``. Packing, contacts, elements
and solves of two directions are all in it; kernels are warmed up first. Rows: insulating pores with the reduced basis
and with every angle solved, then pores that conduct, by the method ``cell``. The last column is the ratio to the first.
``--profile`` prints where the time of the last one goes.
"""

from __future__ import annotations

import argparse
import cProfile
import pstats
import time

import numpy as np

from etc_engine import Box, PackingSpec, parse_radii
from etc_engine.realization import Conduction, RealizationSpec, realize

CASES = (("reduced", "chord", 0.0), ("full", "chord", 0.0), ("fluid", "cell", 0.1))


def specification(curve: str, method: str, pores: float) -> RealizationSpec:
    """The realization of a case."""
    packing = PackingSpec(
        "advancing-front", parse_radii("uniform:0.01:0.02"), Box((0.97, 0.97)), density=0.75, radius_growth=False
    )
    angles = {"contact_angle": tuple(np.radians(np.linspace(1.0, 15.0, 10)))}
    options = {"angle_curve": curve} if method == "chord" else {}
    fixed = {"particle_conductivity": 1.0, "pore_conductivity": pores, "bond_gap": 1e-6}
    return RealizationSpec(packing, "bonded", (Conduction("dtem", method, options),), fixed, angles)


def main() -> None:
    """Print the medians over ten realizations."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--profile", action="store_true")
    profile = parser.parse_args().profile
    first = 0.0
    for name, method, pores in CASES:
        spec = specification(name, method, pores)
        realize(spec, np.random.default_rng(5))
        seconds = []
        for seed in range(6, 16):
            begin = time.process_time()
            result = realize(spec, np.random.default_rng(seed))
            seconds.append(time.process_time() - begin)
        median, packed = 1e3 * np.median(seconds), 1e3 * result.pack_seconds
        first = first or median
        times = f"{median:7.1f} ms, of which packing {packed:.1f} ms"
        print(f"{name:8s} {result.particles} disks: {times}; {median / first:.2f}")
    if profile:
        with cProfile.Profile() as found:
            realize(spec, np.random.default_rng(6))
        pstats.Stats(found).sort_stats("tottime").print_stats(25)


if __name__ == "__main__":
    main()
