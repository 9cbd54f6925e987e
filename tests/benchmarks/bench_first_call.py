"""What the first call of a command costs: kernels compiled against kernels read from numba's cache.

Run by hand: ``python tests/benchmarks/bench_first_call.py [--only pack,solve] [--kernels 20]``. Each command runs
twice, first with an empty ``NUMBA_CACHE_DIR`` (cold), then again (warm). Columns: wall and processor seconds of all
processes, the ratio of the walls, and the compilations: how many, a kernel counted once for each signature and
each rank, how many of them are functions of numba itself, and their seconds. ``--kernels`` lists the slowest kernels.
"""

from __future__ import annotations

import argparse
import atexit
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).parents[2]
MPIEXEC = str(Path(sys.executable).with_name("mpiexec"))
RECORDS = "ETC_ENGINE_BENCH_RECORDS"
"""Environment variable with the folder where the processes write what they compiled."""

PACK = "pack --radii uniform:0.015:0.03 --box 1,1 --seed 20261 -o {folder}/disks.csv"
PACK_SPHERES = "pack --method random-sequential --radii equal:0.08 --box 1,1,1 --count 150 --seed 20261"
MAIN = "sweep {root}/studies/density_angle/study.toml -o {folder}/out.nc --overwrite"
COMMANDS = {
    "pack": (0, PACK),
    "solve": (0, "solve {folder}/disks.csv --box 1,1 --contact-angle 5 --json"),
    "fluid": (0, "solve {folder}/disks.csv --box 1,1 --contact-angle 5 --pore-conductivity 0.1 --json"),
    "facets": (0, "solve {folder}/spheres.csv --box 1,1,1 --contact-angle 5 --pore-conductivity 0.1 --json"),
    "exact": (0, "solve {folder}/disks.csv --box 1,1 --contact-angle 5 --method exact --json"),
    "main job": (2, MAIN),
}
"""Ranks (0: without a launcher) and words of each command. ``main job`` is that of the README."""


class Compiled(NamedTuple):
    """One compilation in one process, its seconds of processor time without those of the kernels it calls."""

    kernel: str
    signature: str
    seconds: float


class Run(NamedTuple):
    """One run of a command."""

    wall: float
    processor: float
    compiled: list[Compiled]


def child(words: list[str]) -> None:
    """Run the command line in this process and write down what it compiles."""
    from numba.core import event

    class Listener(event.Listener):
        def __init__(self) -> None:
            self.started: list[list[float]] = []
            self.rows: list[Compiled] = []

        def on_start(self, event: Any) -> None:  # noqa: ARG002 - numba's signature
            self.started.append([time.process_time(), 0.0])

        def on_end(self, event: Any) -> None:
            begin, within = self.started.pop()
            seconds = time.process_time() - begin
            if self.started:
                self.started[-1][1] += seconds
            function = event.data["dispatcher"].py_func
            signature = ", ".join(str(kind) for kind in event.data["args"])
            self.rows.append(Compiled(f"{function.__module__}.{function.__name__}", signature, seconds - within))

    listener = Listener()
    event.register("numba:compile", listener)
    record = Path(os.environ[RECORDS]) / f"{os.getpid()}.json"
    atexit.register(lambda: record.write_text(json.dumps(listener.rows)))
    sys.argv = ["etc-engine", *words]
    from etc_engine.cli import main as command_line

    command_line()


def run(ranks: int, words: str, folder: Path) -> Run:
    """One run of a command in processes of its own."""
    launcher = [MPIEXEC, "-n", str(ranks)] if ranks else []
    arguments = words.format(folder=folder, root=ROOT).split()
    with tempfile.TemporaryDirectory() as records:
        environment = os.environ | {"NUMBA_CACHE_DIR": str(folder / "cache"), RECORDS: records}
        before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        subprocess.run(
            [*launcher, sys.executable, __file__, "--child", *arguments],
            check=True,
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        wall, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
        rows = [Compiled(*row) for file in sorted(Path(records).glob("*.json")) for row in json.loads(file.read_text())]
    return Run(wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, rows)


def print_kernels(compiled: list[Compiled], most: int) -> None:
    """The kernels that took longest, all signatures of one together."""
    times = defaultdict(list)
    for row in compiled:
        times[row.kernel].append(row.seconds)
    for kernel, seconds in sorted(times.items(), key=lambda item: -sum(item[1]))[:most]:
        print(f"    {sum(seconds):6.2f} s, {len(seconds):3d} times  {kernel}")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default=",".join(COMMANDS), help="commands, separated by commas")
    parser.add_argument("--kernels", type=int, default=0, help="how many kernels to list for each command")
    arguments = parser.parse_args()
    print(f"{'':10s}{'wall s':>16s}{'processor s':>18s}{'wall':>8s}{'compilations':>22s}")
    print(f"{'command':10s}" + 2 * f"{'cold':>8s}{'warm':>9s}" + f"{'ratio':>8s}{'all':>8s}{'numba':>7s}{'s':>7s}")
    with tempfile.TemporaryDirectory() as path:
        inputs = Path(path)
        run(0, PACK, inputs)
        run(0, f"{PACK_SPHERES} -o {inputs}/spheres.csv", inputs)
        for name in arguments.only.split(","):
            ranks, words = COMMANDS[name]
            folder = inputs / name.replace(" ", "_")
            folder.mkdir()
            for file in ("disks.csv", "spheres.csv"):
                (folder / file).symlink_to(inputs / file) if name != "pack" else None
            cold, warm = run(ranks, words, folder), run(ranks, words, folder)
            foreign = [row for row in cold.compiled if not row.kernel.startswith("etc_engine")]
            print(
                f"{name:10s}{cold.wall:8.1f}{warm.wall:9.1f}{cold.processor:8.1f}{warm.processor:9.1f}"
                f"{cold.wall / warm.wall:8.2f}{len(cold.compiled):8d}{len(foreign):7d}"
                f"{sum(row.seconds for row in cold.compiled):7.1f}",
                flush=True,
            )
            print_kernels(cold.compiled, arguments.kernels)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--child"]:
        child(sys.argv[2:])
    else:
        main()
