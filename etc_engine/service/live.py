"""Results while they grow: units counted, and the figure's numbers from the shards so far.

Finished files are read by processes of their own (:mod:`etc_engine.service.reading`), each study by itself, so that no
study waits for the file of another.
"""

from __future__ import annotations

import json
import math
import queue
import threading
import time
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from etc_engine.errors import OutputError
from etc_engine.service.curve import curve_of
from etc_engine.service.held import EngineError
from etc_engine.service.reading import Finished, encoded, read_finished
from etc_engine.service.settings import Limits
from etc_engine.service.store import Store
from etc_engine.study.sweep import Study, read_study
from etc_engine.sweep.dataset import assemble
from etc_engine.sweep.shards import SUFFIX, ShardReader
from etc_engine.sweep.table import Table, join, tabulate

SHARE = 0.02
"""Growing figures are made anew so seldom that they take at most this share of one core."""
FRESH_SECONDS = 1.0
TAIL_BYTES = 8192
KEPT, KEPT_FINISHED = 8, 64
"""Studies whose units, and finished ones whose figures are kept in memory."""
READERS = 4
"""Finished files that are read at the same time."""
Signature = tuple[int, int, int]


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
    growing: threading.Lock = field(default_factory=threading.Lock)

    @property
    def fresh(self) -> bool:
        """Whether the answer is recent enough for what it costs."""
        return time.monotonic() - self.made < max(FRESH_SECONDS, self.cost / SHARE)


@dataclass
class LiveResults:
    """Results of all studies, finished or not."""

    store: Store
    limits: Limits = field(default_factory=Limits)
    _guard: threading.Lock = field(default_factory=threading.Lock)
    _growing: dict[str, _Growing] = field(default_factory=dict)
    _finished: dict[str, tuple[Signature, Future[Finished]]] = field(default_factory=dict)
    _lines: dict[Path, tuple[int, int]] = field(default_factory=dict)
    _asked: queue.SimpleQueue[tuple[Path, Future[Finished]]] = field(default_factory=queue.SimpleQueue)

    def __post_init__(self) -> None:
        for _ in range(READERS):  # daemons: the service ends without waiting for a file that hangs
            threading.Thread(target=self._read, name="reader", daemon=True).start()

    def _read(self) -> None:
        while True:
            path, reading = self._asked.get()
            reading.set_running_or_notify_cancel()  # so that nobody who waits can cancel it
            try:
                reading.set_result(read_finished(path, self.limits.memory_bytes))
            except Exception as error:
                reading.set_exception(error)

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

    def finished(self, study: str) -> Future[Finished]:
        """Content of the result file of a finished study, as a future; each state of the file is read once.

        The future raises `OutputError` if the file is damaged or gone, and `EngineError` if it could not be read for
        another reason.
        """
        path = self.store.result(study)
        reading: Future[Finished] = Future()
        try:
            found = path.stat()
        except OSError as error:
            reading.set_exception(OutputError(f"cannot read {path}: {error.strerror}"))
            return reading
        signature = (found.st_ino, found.st_size, found.st_mtime_ns)
        with self._guard:
            known = self._finished.get(study)
            if known is not None and known[0] == signature and not _failed_by_chance(known[1]):
                return known[1]
            self._finished[study] = signature, reading
            _drop_oldest(self._finished, KEPT_FINISHED)
        self._asked.put((path, reading))
        return reading

    def forget(self, study: str) -> None:
        """Drop what is kept in memory of a study that grows."""
        with self._guard:
            self._growing.pop(study, None)
        folder = self.store.shards(study)
        self._lines = {path: seen for path, seen in self._lines.items() if path.parent != folder}

    def fresh_curve(self, study: str) -> bytes | None:
        """The answer of `growing_curve` if it can be given at once, without waiting for anybody."""
        growing = self._growing.get(study)
        return growing.answer if growing is not None and growing.fresh else None

    def growing_curve(self, study: str) -> bytes:
        """The numbers of the figure of a study without a result, as JSON, at most some moments old: see `curve_of`."""
        with self._guard:
            growing = self._growing.get(study)
            if growing is None:
                text, _ = read_study(self.store.study_file(study))
                growing = _Growing(text, ShardReader(self.store.shards(study)), tabulate(text, []))
                self._growing[study] = growing
                _drop_oldest(self._growing, KEPT)
        with growing.growing:
            if not growing.fresh:
                started = time.thread_time()
                _grow(growing)
                growing.made, growing.cost = time.monotonic(), time.thread_time() - started
            return growing.answer


def _failed_by_chance(reading: Future[Finished]) -> bool:
    """Whether a file could not be read for a reason that may be gone."""
    error = reading.exception() if reading.done() else None
    return error is not None and (isinstance(error, EngineError) or not isinstance(error, OutputError))


def _grow(growing: _Growing) -> None:
    """Read what is new; make the answer again if there was anything."""
    records = list(growing.reader.read(growing.reader.files()))
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
    growing.answer = encoded(curve_of(assemble(study, growing.table, attributes)), complete=False)


def _drop_oldest(kept: dict[str, Any], most: int) -> None:
    while len(kept) > most:
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
