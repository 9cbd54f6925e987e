"""Every stage of a solve from file to tensor, disks beside spheres at equal numbers, in vacuum and with a fluid.

Run by hand: ``python tests/benchmarks/bench_dimensions.py [--particles 1e4 1e5] [--fluid 1e5]``. One line per case:
seconds of the processor of each stage of ``etc-engine solve FILE --periodic ... --axis all``, and the peak memory; then
the ratios of spheres to disks. The bed repeats a random packing of 1000 particles that overlap a little; a case runs in
a process with one thread, after a warm-up on that packing. ``other`` is what no stage holds: checks, estimates, output.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from importlib import import_module
from pathlib import Path
from types import FrameType

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402 - after the thread counts are set

from etc_engine import cli  # noqa: E402
from etc_engine.box import AXES, Box, ball_measure  # noqa: E402
from etc_engine.packing.lubachevsky_stillinger import compress  # noqa: E402
from etc_engine.packing.particles import ParticlePacking  # noqa: E402

DENSITY = {2: 0.82, 3: 0.60}
BLOCK, GROWN, SPREAD = 1000, {2: 1.03, 3: 1.04}, 1e-3
"""Particles of the block, factor of their radii, and random part of it: without that the beds repeat themselves."""
STAGES = {
    "reading": ["particle_files.formats.read_table"],
    "contacts": [
        "medium.rules.overlap_contacts",
        "medium.rules.bonded_contacts",
        "medium.facets.facet_links",
        "engines.dtem.cell.geometry.cell_geometry",
    ],
    "clusters": ["medium.backbone.find_backbone"],
    "elements": [
        "engines.dtem.methods._elements_of",
        "engines.dtem.closed_form.closed_form_resistances",
        "engines.dtem.facet_elements.facet_resistances",
        "engines.dtem.facet_elements.facet_elements",
        "engines.dtem.cell.steady.build_model",
    ],
    "matrix": ["engines.dtem.assembly.assemble"],
    "set-up": ["solvers.amg_cg.build_preconditioner"],
    "solve": ["solvers.amg_cg.solve_loads"],
}
"""Functions whose time is a stage; a function within another's counts for itself alone."""


def bed(dimension: int, count: int) -> ParticlePacking:
    """About that many particles in a periodic box, repeated from one random block."""
    rng = np.random.default_rng(20261126)
    radii = rng.uniform(0.9, 1.1, BLOCK)
    radii *= (DENSITY[dimension] / ball_measure(radii, dimension).sum()) ** (1.0 / dimension)
    unit = Box((1.0,) * dimension, (True,) * dimension)
    block = compress(radii, unit, rng, density=DENSITY[dimension]).packing
    side = max(round((count / BLOCK) ** (1.0 / dimension)), 1)
    shape = (*(side,) * (dimension - 1), max(round(count / BLOCK / side ** (dimension - 1)), 1))
    cells = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1).reshape(-1, 1, dimension)
    centers = (cells + block.centers).reshape(-1, dimension)
    box = Box(tuple(float(s) for s in shape), unit.periodic)
    grown = GROWN[dimension] * rng.uniform(1.0 - SPREAD, 1.0 + SPREAD, len(centers))
    return ParticlePacking(centers, np.tile(block.radii, cells.shape[0]) * grown, box)


def words(packing: ParticlePacking, path: Path, fluid: bool) -> list[str]:
    """Write a bed, and return the command that solves it."""
    names = ",".join([*AXES[: packing.dimension], "radius"])
    table = np.c_[packing.centers, packing.radii]
    np.savetxt(path, table, delimiter=",", header=names, comments="", fmt="%.17g")
    box = ",".join(f"{length:g}" for length in packing.box.lengths)
    command = ["solve", str(path), "--box", box, "--periodic", "xyz"[: packing.dimension], "--axis", "all", "--json"]
    return command + ["--conductivity", "100", "--pore-conductivity", "1"] * fluid


class Stages:
    """Processor time of the functions of each stage, less that of stages within; a context."""

    def __init__(self) -> None:
        self.seconds = dict.fromkeys(STAGES, 0.0)
        self._of_code = {}
        for stage, names in STAGES.items():
            for name in names:
                module, _, function = f"etc_engine.{name}".rpartition(".")
                self._of_code[getattr(import_module(module), function).__code__] = stage
        self._open: list[list[float]] = []

    def __enter__(self) -> Stages:
        sys.setprofile(self._note)
        return self

    def __exit__(self, *_: object) -> None:
        sys.setprofile(None)

    def _note(self, frame: FrameType, event: str, _: object) -> None:
        """Called by the interpreter at every call and return: tables hold functions that names do not reach."""
        if event not in ("call", "return") or frame.f_code not in self._of_code:
            return
        now = time.process_time()
        if event == "call":
            self._open.append([now, 0.0])
            return
        start, within = self._open.pop()
        self.seconds[self._of_code[frame.f_code]] += now - start - within
        if self._open:
            self._open[-1][1] += now - start


def run(command: list[str]) -> tuple[float, dict]:
    """Processor seconds of a command, and its result."""
    start, out = time.process_time(), io.StringIO()
    with contextlib.redirect_stdout(out):
        status = cli.run(command)
    if status:
        raise SystemExit(f"status {status} of {command}")
    return time.process_time() - start, json.loads(out.getvalue())


def measure(dimension: int, count: int, fluid: bool) -> dict:
    """Time of the stages of one case, and its peak memory."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bed.csv"
        run(words(bed(dimension, BLOCK), path, fluid))
        packing = bed(dimension, count)
        command = words(packing, path, fluid)
        with Stages() as stages:
            total, result = run(command)
    return {
        "particles": packing.count,
        "links": result.get("links", result["contacts"]),
        "iterations": result["iterations"],
        "seconds": stages.seconds | {"other": total - sum(stages.seconds.values()), "all": total},
        "MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--particles", type=float, nargs="*", default=[1e4, 1e5], help="of beds in vacuum")
    parser.add_argument("--fluid", type=float, nargs="*", default=[1e4, 1e5], help="of beds with a fluid, contrast 100")
    parser.add_argument("--child", nargs=3, type=int, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.child:
        dimension, count, fluid = arguments.child
        print(json.dumps(measure(dimension, count, bool(fluid))))
        return
    names = (*STAGES, "other", "all")
    print(f"{'seconds of the processor':28s}" + "".join(f"{n:>9s}" for n in names) + "   iter     MB  links/particle")
    for fluid, counts in ((0, arguments.particles), (1, arguments.fluid)):
        for count in map(int, counts):
            rows = []
            for dimension, what in ((2, "disks"), (3, "spheres")):
                child = [sys.executable, __file__, "--child", str(dimension), str(count), str(fluid)]
                done = subprocess.run(child, stdout=subprocess.PIPE, text=True, check=True)
                rows.append(row := json.loads(done.stdout))
                title = f"{row['particles']} {what}, {'fluid' if fluid else 'vacuum'}"
                values = "".join(f"{row['seconds'][name]:9.2f}" for name in names)
                tail = f"{row['iterations']:7d}{row['MB']:7.0f}{row['links'] / row['particles']:10.2f}"
                print(f"{title:28s}{values}{tail}", flush=True)
            ratios = [rows[1]["seconds"][n] / max(rows[0]["seconds"][n], 1e-9) for n in names]
            ratios = ["-" if value > 1e3 else f"{value:.2f}" for value in ratios]
            print(f"{'spheres / disks':28s}" + "".join(f"{value:>9s}" for value in ratios), flush=True)


if __name__ == "__main__":
    main()
