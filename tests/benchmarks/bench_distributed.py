"""One packing on 1, 2, 4 ranks: time of each stage and memory of the largest rank.

    python tests/benchmarks/bench_distributed.py [--disks 700] [--spheres 60] [--ranks 1,2,4]

It needs the environment `.venv-petsc` that `.ci/run` makes. Memory is above that of the libraries: a packing of a few
particles is run first. More ranks than cores show the memory, not the time.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from etc_engine.box import Box
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.formats import write_particles
from etc_engine.particle_files.table import ParticleTable

ROOT = Path(__file__).parents[2]
PYTHON = Path(os.environ.get("ETC_ENGINE_PETSC_PYTHON", ROOT / ".venv-petsc/bin/python"))
STAGES = ("read", "contacts", "set-up", "solve", "all")


def lattice(dimension: int, edge: int) -> ParticlePacking:
    """A shaken square or cubic lattice of overlapping particles, a tenth of whose places are empty."""
    rng = np.random.default_rng(2024)
    places = np.stack(np.meshgrid(*[np.arange(edge)] * dimension, indexing="ij"), axis=-1).reshape(-1, dimension)
    places = places[rng.random(len(places)) > 0.1]
    centers = (places + 0.5 + 0.04 * (rng.random(places.shape) - 0.5)) / edge
    return ParticlePacking(
        centers, 0.51 / edge * (1.0 + 0.02 * (rng.random(len(centers)) - 0.5)), Box((1.0,) * dimension)
    )


def work(path: Path) -> None:
    """What every rank does; rank 0 prints the largest time and memory of all."""
    from etc_engine.durable.provenance import peak_bytes
    from etc_engine.medium.conduction import Conduction
    from etc_engine.medium.rules import overlap_contacts
    from etc_engine.particle_files.sample import Sample
    from etc_engine.realization.distributed import read_scattered, solve_scattered
    from etc_engine.sweep.scheduler import connect

    ranks = connect()
    conduction = Conduction("dtem", "chord", {"distributed": True}, axes=(0,))
    start = time.perf_counter()
    file = read_scattered(path, Sample(), ranks)
    read = time.perf_counter() - start
    result, census = solve_scattered(file, 1.0, overlap_contacts, conduction, ranks)
    whole = time.perf_counter() - start
    report = result.solutions[0].reports[0]
    stages = (
        read,
        whole - read - report.setup_seconds - report.solve_seconds,
        report.setup_seconds,
        report.solve_seconds,
    )
    every = ranks.share(([*stages, whole], peak_bytes()))
    if ranks.rank == 0:
        seconds = np.max([each for each, _ in every], axis=0).tolist()
        found = {"seconds": dict(zip(STAGES, seconds, strict=True)), "bytes": max(peak for _, peak in every)}
        found |= {"particles": census.particles, "unknowns": result.unknowns, "iterations": result.iterations}
        json.dump(found | {"conductivity": float(result.tensor[0, 0])}, sys.stdout)
    ranks.close()


def run(path: Path, count: int) -> dict:
    debian = sorted(Path("/usr/lib/petscdir").glob("petsc3.*/*-real/lib/python3/dist-packages"))
    flags = ("OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "ETC_ENGINE_MPI", "OMP_NUM_THREADS")
    environment = {name: value for name, value in os.environ.items() if not name.startswith("MPI4PY")}
    environment |= dict.fromkeys((*flags, "OPENBLAS_NUM_THREADS"), "1")
    environment["PYTHONPATH"] = os.pathsep.join(map(str, [ROOT, *debian[-1:]]))
    command = ["mpiexec.openmpi", "--oversubscribe", "-n", str(count), PYTHON, __file__, "--worker", path]
    done = subprocess.run(
        list(map(str, command)), env=environment, cwd=ROOT, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise SystemExit(done.stderr)
    return json.loads(done.stdout)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--disks", type=int, default=700, help="edge of the lattice of disks")
    parser.add_argument("--spheres", type=int, default=60, help="edge of the lattice of spheres")
    parser.add_argument("--ranks", default="1,2,4")
    parser.add_argument("--worker", type=Path, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.worker:
        work(asked.worker)
        return
    with tempfile.TemporaryDirectory() as folder:
        for dimension, edge in ((2, asked.disks), (3, asked.spheres)):
            path = Path(folder) / "packing.dump"
            write_particles(path, ParticleTable(lattice(dimension, 6)))
            counts = [int(word) for word in asked.ranks.split(",")]
            bare = {count: run(path, count)["bytes"] for count in counts}
            write_particles(path, ParticleTable(lattice(dimension, edge)))
            print(
                f"\n{dimension}D     " + "".join(f"{stage:>10s}" for stage in STAGES) + "   MB/rank  kB/particle  its"
            )
            for count in counts:
                found = run(path, count)
                mine = found["bytes"] - bare[count]
                print(
                    f"{count} ranks"
                    + "".join(f"{found['seconds'][stage]:9.2f}s" for stage in STAGES)
                    + f"{mine / 1e6:10.0f}{mine * count / found['particles'] / 1e3:13.2f}{found['iterations']:5d}"
                )
            print(f"{found['particles']} particles, {found['unknowns']} unknowns, k = {found['conductivity']:.10g}")


if __name__ == "__main__":
    main()
