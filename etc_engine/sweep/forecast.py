"""What a sweep would do: units, time and memory from a timed probe, and what --resume would find."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from etc_engine.durable.lock import Holder, alive, read_holder
from etc_engine.durable.provenance import peak_bytes
from etc_engine.errors import EtcError, OutputError, PackingError, StudyError
from etc_engine.realization import Status
from etc_engine.study.sweep import Study, read_study
from etc_engine.sweep.claim import difference, recorded_runs
from etc_engine.sweep.dataset import assemble
from etc_engine.sweep.plan import Unit, units_to_run
from etc_engine.sweep.records import Record, encode
from etc_engine.sweep.result_file import open_dataset
from etc_engine.sweep.shards import SUFFIX, ShardReader, read_study_file, shard_folder
from etc_engine.sweep.sweep import Realize, run_unit
from etc_engine.sweep.table import row_type, tabulate

PROBE_SECONDS = 20.0
"""A probe that took longer than this is not repeated: what it lost to compilation is a small part of it."""


JOINING = 2
"""The table of all units is held twice while rank 0 joins its parts."""


@dataclass(frozen=True)
class Forecast:
    """What a sweep would do.

    ``units`` are planned at first, ``most_units`` at most (adaptive sweeps); ``unit_seconds`` are those of the
    costliest and the cheapest unit, ``first_seconds`` of the very first one, with compilation. ``gathered_bytes`` is
    what rank 0 needs beside ``rank_bytes`` for the results of ``most_units`` units.
    """

    units: int
    most_units: int
    cells: int
    finished: int
    state: str
    ranks: int
    first_seconds: float
    unit_seconds: tuple[float, float]
    rank_bytes: int
    gathered_bytes: int
    shard_bytes: int
    dataset_bytes: int
    remarks: tuple[str, ...]
    packings: tuple[str, ...] = ()

    def seconds(self, units: int) -> float:
        """Time for so many units on all ranks: an even mixture of the costliest and the cheapest."""
        if units == 0:
            return 0.0
        even = 0.5 * sum(self.unit_seconds) * units / self.ranks
        return self.first_seconds + max(even, *self.unit_seconds)


def forecast(study_path: Path, output: Path | None, ranks: int, realize: Realize) -> Forecast:
    """Probe a study without writing anything; without an output nothing of it is finished.

    Raises
    ------
    StudyError
        If the study is not valid.
    PackingError
        If the packing of a probe does not reach its density.
    """
    study, _ = read_study(study_path)
    if study.conduction.distributed:
        raise StudyError(
            f"{study_path}: conduction.distributed: --dry-run solves on one rank, where it may not fit: leave it out"
        )
    state, done = ("no output is named", set()) if output is None else what_is_there(study, output)
    targets = (study.statistics.realizations,) * len(study.densities)
    units = units_to_run(study.densities, targets, np.empty((0, 2), np.int64))
    first, record = _probe(study, units[0], realize)
    costly = first if first > PROBE_SECONDS else _probe(study, units[0], realize)[0]
    same = units[-1, 0] == units[0, 0] or first > PROBE_SECONDS
    cheap, thin = (costly, record) if same else _probe(study, units[-1], realize)
    for probed in (record, thin):
        _refuse_density(probed)
    dataset_bytes = assemble(study, tabulate(study, []), {}).nbytes
    most = len(study.densities) * study.statistics.cap
    messages = dict.fromkeys(cell.message for cell in record.result.cells if cell.message)
    return Forecast(
        units=len(units),
        most_units=most,
        cells=len(units) * len(record.result.cells),
        finished=sum(tuple(unit) in done for unit in units.tolist()),
        state=state,
        ranks=ranks,
        first_seconds=max(0.0, first - costly),
        unit_seconds=(costly, cheap),
        rank_bytes=peak_bytes(),
        gathered_bytes=JOINING * row_type(study).itemsize * most + dataset_bytes,
        shard_bytes=len(encode(record)) * len(units),
        dataset_bytes=dataset_bytes,
        remarks=tuple(messages),
        packings=_packings(study),
    )


def _refuse_density(probed: Record) -> None:
    """Refuse a density that the packing of a probe does not reach."""
    failed = [cell.message for cell in probed.result.cells if cell.status == Status.PACKING_FAILED]
    if failed:
        own = "the packer's own density" if probed.unit.density is None else f"density {probed.unit.density:g}"
        raise PackingError(
            f"{own} is out of reach, as a probe of realization {probed.unit.realization} shows: {failed[0]}"
        )


def _packings(study: Study) -> tuple[str, ...]:
    """The packings of a study over files, a line for each."""
    columns = study.realization_coordinates()
    if not columns:
        return ()
    return tuple(f"{file}, frame {frame}" for file, frame in zip(columns["file"][0], columns["frame"][0], strict=True))


def what_is_there(study: Study, output: Path) -> tuple[str, set[tuple[int, int]]]:
    """What --resume would find, in words, and the finished units."""
    folder = shard_folder(output)
    holder = read_holder(folder / "lock")
    busy = alive(folder / "lock", holder, Holder.this_process("forecast")) if holder else ""
    if busy:
        return f"another run is computing this output now: {busy}", set()
    if folder.is_dir() and any(folder.glob(f"*{SUFFIX}")):
        return _in_shards(study, folder)
    if output.exists():
        return _in_output(study, output)
    return "no output and no shards: the sweep starts fresh", set()


def _in_shards(study: Study, folder: Path) -> tuple[str, set[tuple[int, int]]]:
    found = read_study_file(folder)
    if found is None or found[0] != study.digest():
        what = f" ({difference(found[1], study.identity())})" if found else ""
        return f"shards of another study{what}: --resume is refused, --overwrite starts anew", set()
    try:
        recorded_runs(folder)
    except OutputError as error:
        return f"shards whose --resume is refused: {error}", set()
    reader = ShardReader(folder)
    records = reader.read(reader.files())
    done = {(study.densities.index(record.unit.density), record.unit.realization) for record in records}
    return f"{len(done)} finished units in shards ({reader.damaged} damaged): --resume continues", done


def _in_output(study: Study, output: Path) -> tuple[str, set[tuple[int, int]]]:
    try:
        digest = open_dataset(output).attrs["study_digest"]
    except EtcError as error:
        return f"{error}: only --overwrite would continue", set()
    if digest != study.digest():
        return "the output of another study: --resume is refused, --overwrite starts anew", set()
    every = {(i, r) for i in range(len(study.densities)) for r in range(study.statistics.cap)}
    return "the output is complete: --resume does nothing, --overwrite starts anew", every


def _probe(study: Study, place: NDArray[np.int64], realize: Realize) -> tuple[float, Record]:
    """Time of a unit, and its record."""
    unit = Unit(study.densities[place[0]], int(place[1]))
    started = time.perf_counter()
    record = run_unit(study, study.realization_spec(unit.density), unit, 0, realize)
    return time.perf_counter() - started, record
