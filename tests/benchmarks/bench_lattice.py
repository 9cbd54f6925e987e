"""CPU seconds and memory of particle lattices over the number of particles.

``python tests/benchmarks/bench_lattice.py [--largest 1e5] [--laguerre 1e5]``. Periodic packings are tiled from one of
some ten thousand spheres; conductivities are lognormal, so that the solve has work to do. Every line is a process of
its own; kernels are warmed up first.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402 - after the thread counts are set

STAGES = ("lattice", "conductances", "solve", "halo")
TILES = {10**4: 1, 3 * 10**4: 2, 10**5: 2, 3 * 10**5: 3, 10**6: 4}


def peak() -> float:
    """Peak resident memory so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def tiled(count: int, tiles: int):
    """A periodic packing of about `count` spheres, tiles^3 copies of a smaller one."""
    from etc_engine.box import Box
    from etc_engine.engines.lattice.calibration import pack_lattice
    from etc_engine.packing.particles import ParticlePacking

    unit = pack_lattice(count // tiles**3, (1.0, 1.0, 1.0), np.random.default_rng(811), density=0.6)
    steps = np.stack(np.meshgrid(*[np.arange(tiles)] * 3, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    centers = (unit.centers + steps).reshape(-1, 3)
    return ParticlePacking(centers, np.tile(unit.radii, tiles**3), Box((float(tiles),) * 3, (True, True, True)))


def measure(count: int, tiles: int, transmission: str) -> dict:
    """Seconds of every stage, and what memory they add at most."""
    from etc_engine.engines.lattice.flux import halo_flux
    from etc_engine.engines.lattice.network import contact_lattice, laguerre_lattice, link_conductances
    from etc_engine.engines.lattice.steady import solve_with_gradient

    packing = tiled(count, tiles)
    k = np.random.default_rng(7).lognormal(0.0, 0.5, packing.count)
    start, seconds = peak(), {}

    def timed(stage, work):
        begin = time.process_time()
        result = work()
        seconds[stage] = time.process_time() - begin
        return result

    make = laguerre_lattice if transmission == "laguerre" else contact_lattice
    lattice = timed("lattice", lambda: make(packing))
    conductances = timed("conductances", lambda: link_conductances(lattice, k))
    field = timed("solve", lambda: solve_with_gradient(lattice, conductances, 0, tolerance=1e-8))
    timed("halo", lambda: halo_flux(field, 4.0 * packing.radii.mean()))
    return {
        "particles": packing.count,
        "links": lattice.sections.size,
        "seconds": seconds,
        "iterations": field.report.iterations,
        "memory": peak() - start,
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--largest", type=float, default=1e5, help="largest contact lattice")
    parser.add_argument("--laguerre", type=float, default=1e5, help="largest Laguerre lattice")
    parser.add_argument("--child", nargs=3, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.child:
        count, tiles, transmission = int(arguments.child[0]), int(arguments.child[1]), arguments.child[2]
        measure(2000, 1, transmission)
        print(json.dumps(measure(count, tiles, transmission)))
        return
    print(
        "transmission  particles      links"
        + "".join(f"{s + ' [s]':>18s}" for s in STAGES)
        + "  iterations  kB/particle"
    )
    for transmission, largest in (("laguerre", arguments.laguerre), ("contact", arguments.largest)):
        for count, tiles in TILES.items():
            if count > largest:
                continue
            line = [sys.executable, __file__, "--child", str(count), str(tiles), transmission]
            done = subprocess.run(line, capture_output=True, text=True, check=True, env=os.environ)
            row = json.loads(done.stdout)
            print(
                f"{transmission:12s}{row['particles']:11d}{row['links']:11d}"
                + "".join(f"{row['seconds'][stage]:18.3f}" for stage in STAGES)
                + f"{row['iterations']:12d}{1000.0 * row['memory'] / row['particles']:13.2f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
