"""Time and memory of the packers, run by hand: python tests/benchmarks/bench_packing.py [largest number].

Times are processor times of this one-thread program: others on the machine disturb them less.
"""

from __future__ import annotations

import resource
import sys
import time

import numpy as np

from etc_engine.box import Box
from etc_engine.packing import neighbor_pairs, parse_radii
from etc_engine.packing.advancing_front import pack_advancing_front
from etc_engine.packing.hard_spheres import make_gas, run, start_lists
from etc_engine.packing.lubachevsky_stillinger import compress
from etc_engine.packing.overlap import largest_overlap
from etc_engine.packing.random_sequential import insert_randomly


def bench_advancing_front(largest: int) -> None:
    """Table over N with the exponent of the cost, for sizes uniform within a factor of two."""
    radii = parse_radii("uniform:1:2")
    pack_advancing_front(radii, Box((60.0, 60.0)), np.random.default_rng(9))  # compile
    print("advancing front, radii uniform within a factor of 2")
    print(f"{'disks':>9} {'density':>8} {'2Nc/N':>7} {'pack s':>8} {'pairs s':>8} {'us/disk':>8} {'peak MB':>8}")
    counts, seconds = [], []
    for target in (10**k for k in range(3, 8) if 10**k <= largest):
        edge = float(np.sqrt(target * radii.mean_measure(2) / 0.80))
        start = time.process_time()
        packing = pack_advancing_front(radii, Box((edge, edge)), np.random.default_rng(2000 + target))
        packed = time.process_time()
        contacts = neighbor_pairs(packing, relative_gap=1e-6).count
        searched = time.process_time()
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


def bench_compression(largest: int) -> None:
    """Lubachevsky-Stillinger to requested densities: time, collisions and renewals of neighbour lists."""
    print("\nLubachevsky-Stillinger, periodic box, default growth rate where none is given")
    print(
        f"{'particles':>9} {'d':>2} {'radii':>12} {'rate':>5} {'density':>12} {'cpu s':>7} {'collisions':>11} "
        f"{'renewals':>9} {'coll./s':>9} {'pressure':>9} {'overlap':>8}"
    )
    cases = [
        (n, d, word, rate, density)
        for n in (10**k for k in range(3, 6) if 10**k <= largest)
        for d, word, rate, density in (
            (2, "equal", None, 0.80),
            (2, "equal", 0.1, 0.80),
            (2, "equal", None, 0.84),
            (2, "uniform:1:3", None, 0.80),
            (3, "equal", None, 0.60),
            (3, "uniform:1:3", None, 0.60),
        )
    ]
    for d in (2, 3):  # compile
        compress(np.ones(60), Box((1.0,) * d, (True,) * d), np.random.default_rng(9), density=0.4)
    for count, d, word, rate, density in cases:
        rng = np.random.default_rng(3000 + count)
        radii = parse_radii(word).sample(count, rng)
        start = time.process_time()
        made = compress(radii, Box((1.0,) * d, (True,) * d), rng, density=density, growth_rate=rate)
        seconds = time.process_time() - start
        print(
            f"{count:9d} {d:2d} {word:>12} {rate or '-':>5} {made.packing.density:12.9f} {seconds:7.2f} "
            f"{made.collisions:11d} {made.renewals:9d} {made.collisions / seconds:9.3g} {made.pressure:9.3g} "
            f"{largest_overlap(made.packing):8.1g}"
        )


def bench_collisions(count: int = 10_000) -> None:
    """Collisions per second of the dynamics alone, without growth."""
    print(f"\nevent-driven dynamics of {count} equal particles, no growth")
    print(f"{'d':>2} {'density':>8} {'coll./s':>9} {'renewals/s':>11}")
    for d, density in ((2, 0.6), (2, 0.7), (2, 0.8), (3, 0.4), (3, 0.5), (3, 0.58)):
        box, rng = Box((1.0,) * d, (True,) * d), np.random.default_rng(4001)
        packing = compress(np.ones(count), box, rng, density=density, growth_rate=0.1).packing
        packing = packing.select(np.lexsort(np.floor(packing.centers * count ** (1 / d) / 3).T))
        radius = float(packing.radii[0])
        gas = make_gas(packing.centers, rng.standard_normal((count, d)), np.ones(count), box, radius, 0.5, 60)
        rates = []
        for _ in range(4):
            gas.state[:, 6] = 0.0
            start_lists(gas, radius, 0.0, 0.5)
            start = time.process_time()
            _, _, done, renewals, _ = run(gas, radius, 0.0, 0.5, np.inf, 30 * count)
            seconds = time.process_time() - start
            rates.append((done / seconds, renewals / seconds))
        best = max(rates)
        print(f"{d:2d} {density:8.2f} {best[0]:9.3g} {best[1]:11.3g}")


def bench_insertion(largest: int) -> None:
    """Random sequential insertion to proven saturation."""
    print("\nrandom sequential insertion of equal particles to saturation, periodic box")
    print(f"{'particles':>9} {'d':>2} {'density':>9} {'s':>7}")
    for d, phi in ((2, 0.547), (3, 0.384)):
        for count in (10**k for k in range(3, 6) if 10**k <= largest):
            measure = phi / count
            radius = (measure / np.pi) ** 0.5 if d == 2 else (0.75 * measure / np.pi) ** (1 / 3)
            start = time.process_time()
            box = Box((1.0,) * d, (True,) * d)
            made = insert_randomly(np.full(2 * count, radius), box, np.random.default_rng(5000 + count))
            seconds = time.process_time() - start
            print(f"{made.packing.count:9d} {d:2d} {made.packing.density:9.5f} {seconds:7.2f}")


if __name__ == "__main__":
    most = int(float(sys.argv[1])) if len(sys.argv) > 1 else 10**6
    bench_advancing_front(most)
    bench_collisions()
    bench_compression(most)
    bench_insertion(min(most, 10**5))
