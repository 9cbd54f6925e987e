"""Time and memory of FFT homogenization, run by hand: python tests/benchmarks/bench_voxel.py [--porespy PYTHON].

Every size runs in a process of its own, so that its peak memory is its own; times are processor times, on one thread.
With ``--porespy`` (the interpreter of an environment that has it) the same binary images are solved by porespy's
``tortuosity_fd`` too: pores that conduct between two walls, the solid insulating, the other sides adiabatic.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from etc_engine.engines.voxel import Scheme
from etc_engine.medium.medium import Medium, Pores

PORESPY = """
import json, sys, time, warnings
warnings.simplefilter("ignore")
import numpy as np
import porespy
porespy.settings.tqdm["disable"] = True
image = np.load(sys.argv[1])
start = time.process_time()
found = porespy.simulations.tortuosity_fd(image, axis=0)
print(json.dumps({"conductivity": float(found.effective_porosity / found.tortuosity),
                  "seconds": time.process_time() - start}))
"""


def composite(d: int, count: int, fraction: float, contrast: float):
    from etc_engine import Box, PackingSpec, pack, parse_radii

    pass

    box = Box((1.0,) * d, (True,) * d)
    spec = PackingSpec("lubachevsky-stillinger", parse_radii("equal"), box, count, fraction)
    return Medium(pack(spec, np.random.default_rng(811)), np.array(contrast), pores=Pores(1.0))


def one(d: int, resolution: int, contrast: float, solver: str) -> dict[str, float]:
    """One load along x on an image of 50 inclusions, 40 % of them."""
    from etc_engine.engines.voxel import solve_cell, voxelize

    made = composite(d, 50, 0.4, contrast)
    voxelize(made, 32)  # compile
    solve_cell(voxelize(made, 16).conductivity, (1.0,) * d, axes=(0,), scheme=Scheme(solver=solver))
    base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start = time.process_time()
    image = voxelize(made, resolution)
    voxelized = time.process_time()
    solved = solve_cell(image.conductivity, (1.0,) * d, axes=(0,), scheme=Scheme(solver=solver))
    stop = time.process_time()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - base
    return {
        "conductivity": float(solved.tensor[0, 0]),
        "iterations": solved.iterations,
        "voxelize": voxelized - start,
        "solve": stop - voxelized,
        "bytes": 1024.0 * peak / resolution**d,
    }


def in_a_process(*arguments: object) -> dict[str, float]:
    line = [sys.executable, __file__, "--one", *map(str, arguments)]
    return json.loads(subprocess.run(line, capture_output=True, text=True, check=True).stdout.splitlines()[-1])


def table(largest: int) -> None:
    print(
        f"{'voxels':>10}{'contrast':>9} {'solver':12}{'voxelize s':>11}"
        f"{'steps':>6}{'solve s':>9}{'s/step':>8}{'B/voxel':>9}"
    )
    sizes = [(3, n) for n in (64, 128, 256) if n**3 <= largest] + [
        (2, n) for n in (512, 1024, 2048, 4096) if n**2 <= largest
    ]
    for d, n in sizes:
        for contrast in (7.7, 100.0):
            for solver in ("cg", "eyre-milton"):
                if contrast > 10.0 and n**d > 3e6:
                    continue
                row = in_a_process(d, n, contrast, solver)
                step = row["solve"] / row["iterations"]
                print(
                    f"{f'{n}^{d}':>10}{contrast:9g} {solver:12}{row['voxelize']:11.2f}"
                    f"{row['iterations']:6d}{row['solve']:9.2f}{step:8.3f}{row['bytes']:9.0f}",
                    flush=True,
                )


def against_porespy(python: str) -> None:
    """The same image of pores between walls, spheres insulating; ratios of one run."""
    from etc_engine.engines.voxel import solve_cell, voxelize

    print(f"{'voxels':>10}{'k/k0 porespy':>14}{'k/k0 FFT':>10}{'porespy s':>11}{'FFT s':>8}{'ratio':>7}")
    for d, n in ((2, 256), (2, 512), (3, 48), (3, 64), (3, 96)):
        image = voxelize(composite(d, 30, 0.35, 0.0), n, "binary").conductivity.scalars
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "image.npy"
            np.save(path, image > 0.0)
            line = [python, "-c", PORESPY, str(path)]
            theirs = json.loads(
                subprocess.run(line, capture_output=True, text=True, check=True).stdout.splitlines()[-1]
            )
        start = time.process_time()
        ours = solve_cell(image, (1.0,) * d, boundary="walls", axes=(0,), scheme=Scheme(tolerance=1e-6)).tensor[0, 0]
        seconds = time.process_time() - start
        print(
            f"{f'{n}^{d}':>10}{theirs['conductivity']:14.5f}{ours:10.5f}{theirs['seconds']:11.2f}{seconds:8.2f}"
            f"{theirs['seconds'] / seconds:7.1f}",
            flush=True,
        )


def touching() -> None:
    """Spheres of a cubic array that overlap by a thousandth of their radius, 5 voxels across: time of voxelization."""
    from etc_engine.box import Box
    from etc_engine.engines.voxel import voxelize
    from etc_engine.medium.medium import Medium, Pores
    from etc_engine.packing.particles import ParticlePacking

    print(f"{'spheres':>10}{'voxels':>10}{'voxelize s':>12}{'ms a sphere':>13}")
    for n in (2, 8, 20):  # the first compiles
        centers = (np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3) + 0.5) / n
        array = ParticlePacking(centers, np.full(n**3, 0.5005 / n), Box((1.0, 1.0, 1.0), (True,) * 3))
        start = time.process_time()
        voxelize(Medium(array, 40.0, pores=Pores(1.0)), 5 * n)
        seconds = time.process_time() - start
        print(f"{n**3:>10}{f'{5 * n}^3':>10}{seconds:12.3f}{1e3 * seconds / n**3:13.3f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--largest", type=float, default=2e7, help="voxels")
    parser.add_argument("--porespy", help="interpreter that has porespy")
    parser.add_argument("--one", nargs=4, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        d, n, contrast, solver = options.one
        print(json.dumps(one(int(d), int(n), float(contrast), solver)))
        return
    touching()
    table(int(options.largest))
    if options.porespy:
        against_porespy(options.porespy)


if __name__ == "__main__":
    main()
