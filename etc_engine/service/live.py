"""Results while they grow: units counted, and the figure's numbers from the shards so far or the finished file."""

from __future__ import annotations

import json
import math
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from etc_engine.realization import Status
from etc_engine.service.curve import curve_of
from etc_engine.service.store import Store
from etc_engine.study.sweep import Study, read_study
from etc_engine.sweep.dataset import assemble
from etc_engine.sweep.result_file import open_dataset
from etc_engine.sweep.shards import SUFFIX, ShardReader
from etc_engine.sweep.table import Table, join, tabulate

if TYPE_CHECKING:
    import xarray

SHARE = 0.02
"""Growing figures are made anew so seldom that they take at most this share of one core."""
FRESH_SECONDS = 1.0
TAIL_BYTES = 8192
KEPT = 8
"""Studies whose units are kept in memory."""


@dataclass
class _Growing:
    """What has been read of a study's shards."""

    study: Study
    reader: ShardReader
    table: Table
    made: float = -math.inf
    cost: float = 0.0
    answer: bytes = b""
    units: int = -1

    @property
    def fresh(self) -> bool:
        """Whether the answer is recent enough for what it costs."""
        return time.monotonic() - self.made < max(FRESH_SECONDS, self.cost / SHARE)


@dataclass
class LiveResults:
    """Results of all studies, finished or not. All reading of netCDF files goes through one lock: HDF5 needs it."""

    store: Store
    _guard: threading.Lock = field(default_factory=threading.Lock)
    _growing: dict[str, _Growing] = field(default_factory=dict)
    _finished: dict[str, bytes] = field(default_factory=dict)
    _lines: dict[Path, tuple[int, int]] = field(default_factory=dict)

    def units(self, study: str) -> int:
        """Finished units in the shards of a study, by counting lines: one that was run twice counts twice."""
        total = 0
        for path in self.store.shards(study).glob(f"*{SUFFIX}"):
            read, lines = self._lines.get(path, (0, 0))
            try:
                with path.open("rb") as stream:
                    stream.seek(read)
                    new = stream.read()
            except FileNotFoundError:  # the sweep has just finished and taken it away
                continue
            self._lines[path] = (read + len(new), lines + new.count(b"\n"))
            total += self._lines[path][1]
        return total

    def outcome(self, study: str) -> tuple[int, int]:
        """Units of a finished study, and cells without a conductivity."""
        dataset = self.dataset(study)
        self.forget(study)
        status = dataset["status"].values
        failed = (status > Status.NOT_PERCOLATING) & (status < Status.NOT_RUN)
        return int((dataset["worker_rank"].values >= 0).sum()), int(failed.sum())

    def dataset(self, study: str) -> xarray.Dataset:
        """The finished result."""
        with self._guard:
            return open_dataset(self.store.result(study))

    def forget(self, study: str) -> None:
        """Drop what is kept in memory of a study."""
        with self._guard:
            self._growing.pop(study, None)
            self._finished.pop(study, None)
        folder = self.store.shards(study)
        self._lines = {path: seen for path, seen in self._lines.items() if path.parent != folder}

    def fresh_curve(self, study: str) -> bytes | None:
        """The answer of `curve` if it can be given at once, without waiting for anybody."""
        if (finished := self._finished.get(study)) is not None:
            return finished
        growing = self._growing.get(study)
        return growing.answer if growing is not None and growing.fresh else None

    def curve(self, study: str) -> bytes:
        """Conductivity over density with confidence intervals and models, as JSON: see `curve_of`.

        As of now for a finished study; of a growing one, at most some moments old.
        """
        if self.store.result(study).exists():
            with self._guard:
                if study not in self._finished:
                    answer = _encoded(curve_of(open_dataset(self.store.result(study))) | {"complete": True})
                    self._finished[study] = answer
                    _drop_oldest(self._finished)
                return self._finished[study]
        with self._guard:
            growing = self._growing.get(study)
            if growing is None:
                text, _ = read_study(self.store.study_file(study))
                growing = _Growing(text, ShardReader(self.store.shards(study)), tabulate(text, []))
                self._growing[study] = growing
                _drop_oldest(self._growing)
            if not growing.fresh:
                started = time.thread_time()
                _grow(growing)
                growing.made, growing.cost = time.monotonic(), time.thread_time() - started
            return growing.answer


def _grow(growing: _Growing) -> None:
    """Read what is new; make the answer again if there was anything."""
    records = growing.reader.read(growing.reader.files())
    if records:
        growing.table = join([growing.table, tabulate(growing.study, records)])
    units = len(growing.table.rows)
    if units == growing.units:
        return
    growing.units = units
    study = growing.study
    attributes = {
        "study_resolved": json.dumps(study.resolved()),
        "study_digest": study.digest(),
        "confidence_level": study.statistics.confidence,
    }
    growing.answer = _encoded(curve_of(assemble(study, growing.table, attributes)) | {"complete": False})


def _encoded(values: dict[str, Any]) -> bytes:
    return json.dumps(values, allow_nan=False).encode()


def _drop_oldest(kept: dict[str, Any]) -> None:
    while len(kept) > KEPT:
        kept.pop(next(iter(kept)))


def log_tail(path: Path, size: int = TAIL_BYTES) -> str:
    """The end of a log, in whole lines."""
    try:
        with path.open("rb") as stream:
            length = stream.seek(0, 2)
            stream.seek(max(0, length - size))
            text = stream.read(size).decode(errors="replace")
    except OSError:
        return ""
    return text if length <= size else text.partition("\n")[2]
