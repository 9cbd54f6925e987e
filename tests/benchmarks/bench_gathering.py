"""Memory of rank 0 for the results of a sweep: ``python bench_gathering.py --units 100000``.

Shards with so many finished units of one cell are written, gathered, assembled and written as netCDF. The first, small
sweep takes the memory of the libraries; what the second one adds is divided by its units.
"""

from __future__ import annotations

import argparse
import resource
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from etc_engine.realization import Outcome, Realization, Status
from etc_engine.study.sweep import Study, parse_study
from etc_engine.sweep.dataset import assemble
from etc_engine.sweep.gathering import Gatherer
from etc_engine.sweep.plan import Unit, units_to_run
from etc_engine.sweep.records import Record, encode
from etc_engine.sweep.result_file import write_dataset
from etc_engine.sweep.scheduler import Solo
from etc_engine.sweep.shards import frame
from etc_engine.sweep.table import row_type

STUDY = """
schema = 2
name = "many"
seed = 20261
[packing]
radii = "uniform:0.01:0.02"
box = [1.0, 1.0]
density = 0.7
[contacts]
rule = "bonded"
contact_angle = 2.5
[statistics]
realizations = {units}
"""


def write_shard(path: Path, units: int) -> None:
    """A shard of finished units, alike but for their realization."""
    tensor = np.array([[0.3123456789, np.nan], [np.nan, 0.3234567891]])
    cell = Outcome(Status.OK, "", tensor, 1700, 60, 3.5, 900, 9, 1e-11, 0.01, 0.4, solved_by="full")
    record = Record(Unit(0.7, 0), Realization(977, 0.7, 0.69, 0.25, (cell,)), 3, "node0017", 1.5e9, 1.5e9)
    with path.open("wb") as shard:
        for realization in range(units):
            shard.write(frame(encode(replace(record, unit=Unit(0.7, realization)))))


def peak() -> float:
    """The most memory this process has held [bytes]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1.0 if sys.platform == "darwin" else 1024.0)


def gather(folder: Path, units: int) -> Study:
    """Shards to netCDF, as rank 0 of a sweep does it."""
    study = parse_study(STUDY.format(units=units))
    write_shard(folder / "run-00000.shard", units)
    wanted = units_to_run(study.densities, (units,), np.empty((0, 2), np.int64))
    table = Gatherer(study, folder, Solo()).gather_all(wanted)
    write_dataset(assemble(study, table, {}), folder / "out.nc")
    return study


def main() -> None:
    """Print the bytes a unit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--units", type=int, default=100_000)
    units = parser.parse_args().units
    with tempfile.TemporaryDirectory() as few, tempfile.TemporaryDirectory() as many:
        gather(Path(few), 5_000)
        start, began = peak(), time.perf_counter()
        study = gather(Path(many), units)
        seconds = time.perf_counter() - began
    print(f"{units} units: {(peak() - start) / (units - 5_000):.0f} bytes a unit, {seconds:.0f} s;", end=" ")
    print(f"a row of the table has {row_type(study).itemsize} bytes")


if __name__ == "__main__":
    main()
