"""What scheduling costs: overhead of a unit, efficiency on two ranks, warm and cold starts.

By hand: ``python tests/benchmarks/bench_scheduler.py [--quick]``. Prints a table; everything is measured in
this run, ranks against one process, with the engine of ``tests/stand_in.py`` in place of the real one.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from etc_engine.sweep.result_file import open_dataset

STAND_IN = Path(__file__).parent.parent / "stand_in.py"
MPIEXEC = Path(sys.executable).with_name("mpiexec")
STUDY = """
schema = 2
name = "bench"
seed = 161803
[packing]
radii = "uniform:0.01:0.02"
box = [1.0, 1.0]
density = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]
[contacts]
rule = "bonded"
contact_angle = [2.5, 5.0, 10.0, 15.0]
[statistics]
realizations = {realizations}
"""
REAL = """
schema = 2
name = "real"
seed = 161803
[packing]
radii = "uniform:0.01:0.02"
box = [1.0, 1.0]
density = [0.6, 0.7]
[contacts]
rule = "bonded"
contact_angle = [5.0]
[statistics]
realizations = 2
"""


def sweep(ranks: int, folder: Path, realizations: int, *options: str) -> tuple[float, float]:
    """Seconds from the first unit's start to the last one's end, and the sum over units."""
    study, output = folder / "study.toml", folder / "out.nc"
    study.write_text(STUDY.format(realizations=realizations))
    launcher = [str(MPIEXEC), "-n", str(ranks)] if ranks else []
    command = [*launcher, sys.executable, str(STAND_IN), str(study), "-o", str(output), *options]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    data = open_dataset(output)
    output.unlink()
    start, end = data["start_time"].values, data["end_time"].values
    return float(end.max() - start.min()), float((end - start).sum())


def overhead(ranks: int, folder: Path, realizations: int) -> float:
    """Seconds of a rank a unit beside the unit itself: the counter, the shard, the progress."""
    wall, work = sweep(ranks, folder, realizations)
    return (wall * max(ranks, 1) - work) / (8 * realizations)


def efficiency(folder: Path, burn: bool, realizations: int, seconds: float) -> float:
    """T(1) / (2 T(2)) on units that differ by a factor of 24."""
    options = ("--seconds", str(seconds), *(("--burn",) if burn else ()))
    one, _ = sweep(1, folder, realizations, *options)
    two, _ = sweep(2, folder, realizations, *options)
    return one / (2.0 * two)


def start(ranks: int, folder: Path, cache: Path) -> float:
    """Seconds of a whole short sweep of the real engine, with compiled kernels in a folder of their own."""
    (folder / "real.toml").write_text(REAL)
    launcher = [str(MPIEXEC), "-n", str(ranks)] if ranks > 1 else []
    output = folder / "real.nc"
    command = [*launcher, sys.executable, "-m", "etc_engine", "sweep", str(folder / "real.toml"), "-o", str(output)]
    began = time.perf_counter()
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=environment)
    seconds = time.perf_counter() - began
    output.unlink()
    return seconds


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="shorter runs, rougher figures")
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    many, few, seconds = (50, 6, 0.1) if options.quick else (250, 12, 0.2)
    print(f"load average {os.getloadavg()[0]:.2f} on {os.cpu_count()} cores")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for ranks in (0, 1, 2, 4):
            values = [1e3 * overhead(ranks, folder, many) for _ in range(options.repeats)]
            print(f"overhead, {ranks or 'no'} ranks: median {statistics.median(values):.3f} ms a unit {spread(values)}")
        for burn in (False, True):
            values = [efficiency(folder, burn, few, seconds) for _ in range(options.repeats)]
            kind = "busy" if burn else "sleeping"
            print(f"efficiency, 2 ranks, {kind} units: median {statistics.median(values):.3f} {spread(values)}")
        for ranks in (1, 2, 4):
            cache = folder / f"cache{ranks}"
            cold, warm = start(ranks, folder, cache), start(ranks, folder, cache)
            print(f"short sweep of the real engine, {ranks} ranks: cold {cold:.1f} s, warm {warm:.1f} s")


def spread(values: list[float]) -> str:
    """All values, sorted."""
    return "(" + ", ".join(f"{value:.3f}" for value in np.sort(values)) + ")"


if __name__ == "__main__":
    main()
