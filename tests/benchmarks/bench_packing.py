"""Time and memory of the packers, run by hand: python tests/benchmarks/bench_packing.py [largest number]."""

from __future__ import annotations

import resource
import sys
import time

import numpy as np

from etc_engine.box import Box
from etc_engine.packing import neighbor_pairs, parse_radii
from etc_engine.packing.advancing_front import pack_advancing_front


def bench_advancing_front(largest: int) -> None:
    """Table over N with the exponent of the cost, for sizes uniform within a factor of two."""
    radii = parse_radii("uniform:1:2")
    pack_advancing_front(radii, Box((60.0, 60.0)), np.random.default_rng(9))  # compile
    print("advancing front, radii uniform within a factor of 2")
    print(f"{'disks':>9} {'density':>8} {'2Nc/N':>7} {'pack s':>8} {'pairs s':>8} {'us/disk':>8} {'peak MB':>8}")
    counts, seconds = [], []
    for target in (10**k for k in range(3, 8) if 10**k <= largest):
        edge = float(np.sqrt(target * radii.mean_measure(2) / 0.80))
        start = time.perf_counter()
        packing = pack_advancing_front(radii, Box((edge, edge)), np.random.default_rng(2000 + target))
        packed = time.perf_counter()
        contacts = neighbor_pairs(packing, relative_gap=1e-6).count
        searched = time.perf_counter()
        counts.append(packing.count)
        seconds.append(packed - start)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(
            f"{packing.count:9d} {packing.density:8.4f} {2 * contacts / packing.count:7.4f} "
            f"{packed - start:8.3f} "
            f"{searched - packed:8.3f} {1e6 * seconds[-1] / packing.count:8.3f} {peak:8.0f}"
        )
    if len(counts) > 1:
        print(f"fitted cost: seconds ~ N^{np.polyfit(np.log(counts), np.log(seconds), 1)[0]:.3f}")


if __name__ == "__main__":
    bench_advancing_front(int(float(sys.argv[1])) if len(sys.argv) > 1 else 10**6)
