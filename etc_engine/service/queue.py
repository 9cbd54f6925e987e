"""The queue: studies and their states in an SQLite file, safe from kills at any moment (write-ahead log).

Reads have a connection of their own: while another program holds the file, only changes wait, and give up soon.
"""

from __future__ import annotations

import re
import sqlite3
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal, get_args

from etc_engine.durable.files import sync_folder
from etc_engine.durable.provenance import now
from etc_engine.errors import InputError, OutputError

State = Literal["queued", "running", "done", "failed", "cancelled"]
STATES: tuple[State, ...] = get_args(State)
LOCKED_SECONDS = 3.0
"""Seconds that a change waits for another program that holds the file."""
REPAIR = "put a copy of it back, or move it and the folder studies away and hand the studies in again"
SCHEMA = """
CREATE TABLE studies (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    name TEXT NOT NULL,
    state TEXT NOT NULL,
    reason TEXT NOT NULL DEFAULT '',
    cancelling INTEGER NOT NULL DEFAULT 0,
    done INTEGER NOT NULL DEFAULT 0,
    planned INTEGER NOT NULL,
    most INTEGER NOT NULL,
    failed_cells INTEGER NOT NULL DEFAULT 0,
    attempts INTEGER NOT NULL DEFAULT 0,
    submitted TEXT NOT NULL,
    started TEXT NOT NULL DEFAULT '',
    ended TEXT NOT NULL DEFAULT '',
    batch TEXT NOT NULL DEFAULT '',
    place REAL NOT NULL
);
CREATE INDEX by_state ON studies (state, place);
"""


@dataclass(frozen=True)
class Entry:
    """A study in the queue.

    ``done`` of ``planned`` units are finished; an adaptive study grows to ``most`` at most. ``attempts`` counts starts
    of its batch without a finished unit since the last one; ``batch`` names the running batch to its launcher.
    """

    number: int
    id: str
    name: str
    state: State
    reason: str
    cancelling: bool
    done: int
    planned: int
    most: int
    failed_cells: int
    attempts: int
    submitted: str
    started: str
    ended: str
    batch: str


NAMES = tuple(field.name for field in fields(Entry))
COLUMNS = ", ".join(NAMES)


class Queue:
    """The queue in a file.

    Parameters
    ----------
    path : Path
        The SQLite file, made whole if it is not there.
    limit : int
        Most studies that may wait.

    Raises
    ------
    OutputError
        If the file is empty or damaged, or cannot be written.

    Notes
    -----
    Changes raise ``sqlite3.OperationalError`` ("database is locked") if another program holds the file for longer than
    `LOCKED_SECONDS`. Reads never wait for it.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     queue = Queue(Path(folder) / "queue.sqlite")
    ...     entry, new = queue.submit("a1", "first", 10, 10)
    ...     print(entry.state, new, queue.submit("a1", "first", 10, 10)[1])
    ...     queue.close()
    queued True False
    """

    def __init__(self, path: Path, limit: int = 10_000) -> None:
        self._limit, self._guard, self._looking = limit, threading.RLock(), threading.Lock()
        try:
            if not path.exists():
                _create(path)
            elif path.stat().st_size == 0:
                raise OutputError(f"queue {path}: is empty (0 bytes), expected the studies of this service: {REPAIR}")
            self._base = _connect(path, LOCKED_SECONDS)
            self._reader = _connect(path, 0.0)
            self._check(path)
            self._base.execute("PRAGMA journal_mode=WAL")
            self._base.execute("PRAGMA synchronous=FULL")
        except sqlite3.Error as error:
            raise OutputError(f"queue {path}: {error}: {REPAIR}") from None
        except OSError as error:
            raise error if isinstance(error, OutputError) else OutputError(f"queue {path}: {error.strerror}") from None

    def _check(self, path: Path) -> None:
        """Refuse a file with a damaged page, or with an entry that this module never wrote."""
        problem = str(self._reader.execute("PRAGMA integrity_check(1)").fetchone()[0])
        if problem != "ok":
            raise OutputError(f"queue {path}: is damaged ({' '.join(problem.split())}): {REPAIR}")
        for entry in self.entries(limit=-1):
            if entry.state not in STATES or not re.fullmatch("[0-9a-z]+", str(entry.id)):
                raise OutputError(f"queue {path}: is damaged (study {entry.number}): {REPAIR}")

    def close(self) -> None:
        """Close the file."""
        with self._guard, self._looking:
            self._reader.close()
            self._base.close()

    def submit(self, study: str, name: str, planned: int, most: int) -> tuple[Entry, bool]:
        """Put a study in the queue, unless it is there; returns its entry and whether it is new.

        Raises
        ------
        InputError
            If the queue is full.
        """
        with self._changing():
            known = self.get(study)
            if known is not None:
                return known, False
            if self.count("queued") >= self._limit:
                raise InputError(f"{self._limit} studies are waiting, no more are taken: come back later")
            self._do(
                "INSERT INTO studies (id, name, state, planned, most, submitted, place) VALUES (?, ?, ?, ?, ?, ?, ?)",
                (study, name, "queued", planned, most, now(), time.time()),
            )
            return self.require(study), True

    def get(self, study: str) -> Entry | None:
        """The entry of a study, if there is one."""
        found = self._ask("WHERE id = ?", (study,))
        return found[0] if found else None

    def require(self, study: str) -> Entry:
        """The entry of a study that has one."""
        entry = self.get(study)
        if entry is None:
            raise KeyError(study)
        return entry

    def entries(self, state: State | None = None, limit: int = 1000, offset: int = 0) -> list[Entry]:
        """Entries, the newest first."""
        where, values = ("WHERE state = ? ", (state,)) if state else ("", ())
        return self._ask(f"{where}ORDER BY number DESC LIMIT ? OFFSET ?", (*values, limit, offset))

    def count(self, state: State | None = None) -> int:
        """Number of studies, or of those in a state."""
        where, values = (" WHERE state = ?", (state,)) if state else ("", ())
        with self._looking:
            return int(self._reader.execute(f"SELECT COUNT(*) FROM studies{where}", values).fetchone()[0])

    def first_waiting(self, later: frozenset[str] = frozenset()) -> Entry | None:
        """The study that waits longest, but for those that are to be tried later."""
        for entry in self._ask("WHERE state = 'queued' ORDER BY place LIMIT ?", (len(later) + 1,)):
            if entry.id not in later:
                return entry
        return None

    def begin(self, study: str) -> None:
        """A batch of the study is about to be started."""
        self._do(
            "UPDATE studies SET state = 'running', batch = '', reason = '', ended = '', attempts = attempts + 1, "
            "started = CASE started WHEN '' THEN ? ELSE started END WHERE id = ?",
            (now(), study),
        )

    def forgive(self, study: str) -> None:
        """Forget attempts: it was not the batch's fault."""
        self._do("UPDATE studies SET attempts = 0 WHERE id = ?", (study,))

    def set_batch(self, study: str, batch: str) -> None:
        """Note how the running batch is found again."""
        self._do("UPDATE studies SET batch = ? WHERE id = ?", (batch, study))

    def set_done(self, study: str, done: int) -> None:
        """Note finished units; new ones show that a restart is worth its while."""
        self._do(
            "UPDATE studies SET attempts = CASE WHEN done < ? THEN 0 ELSE attempts END, done = ? WHERE id = ?",
            (done, done, study),
        )

    def finish(self, study: str, units: int, failed_cells: int) -> None:
        """The result is complete."""
        self._do(
            "UPDATE studies SET state = 'done', reason = '', cancelling = 0, batch = '', done = ?, planned = ?, "
            "failed_cells = ?, ended = ? WHERE id = ?",
            (units, units, failed_cells, now(), study),
        )

    def settle(self, study: str, state: Literal["failed", "cancelled"], reason: str) -> None:
        """The study ends without a result; what is finished is kept."""
        self._do(
            "UPDATE studies SET state = ?, reason = ?, cancelling = 0, batch = '', ended = ? WHERE id = ?",
            (state, reason, now(), study),
        )

    def put_back(self, study: str, reason: str) -> None:
        """The batch ended before its time: the study continues in its old place."""
        self._do("UPDATE studies SET state = 'queued', reason = ?, batch = '' WHERE id = ?", (reason, study))

    def cancel(self, study: str) -> bool:
        """Ask for the end of a study; returns False if it is neither waiting nor running."""
        with self._changing():
            waiting = self._do(
                "UPDATE studies SET state = 'cancelled', reason = 'cancelled', ended = ? "
                "WHERE id = ? AND state = 'queued'",
                (now(), study),
            )
            return bool(
                waiting or self._do("UPDATE studies SET cancelling = 1 WHERE id = ? AND state = 'running'", (study,))
            )

    def resume(self, study: str) -> bool:
        """Put a cancelled or failed study at the end of the queue; returns False if it is neither."""
        return bool(
            self._do(
                "UPDATE studies SET state = 'queued', reason = '', ended = '', attempts = 0, place = ? "
                "WHERE id = ? AND state IN ('cancelled', 'failed')",
                (time.time(), study),
            )
        )

    def remove(self, study: str) -> bool:
        """Forget a study that is not running; returns False if it is."""
        return bool(self._do("DELETE FROM studies WHERE id = ? AND state != 'running'", (study,)))

    def _ask(self, rest: str, values: tuple[Any, ...]) -> list[Entry]:
        with self._looking:
            rows = self._reader.execute(f"SELECT {COLUMNS} FROM studies {rest}", values).fetchall()
        named = [dict(zip(NAMES, row, strict=True)) for row in rows]
        return [Entry(**{**values, "cancelling": bool(values["cancelling"])}) for values in named]

    def _do(self, statement: str, values: tuple[Any, ...]) -> int:
        """Change something; returns how many studies it concerned."""
        with self._changing():
            return self._base.execute(statement, values).rowcount

    @contextmanager
    def _changing(self) -> Iterator[None]:
        """One change at a time; none waits for long behind others that wait for another program."""
        if not self._guard.acquire(timeout=LOCKED_SECONDS):
            raise sqlite3.OperationalError("database is locked")
        try:
            yield
        finally:
            self._guard.release()


def _connect(path: Path, patience: float) -> sqlite3.Connection:
    return sqlite3.connect(path, timeout=patience, isolation_level=None, check_same_thread=False)


def _create(path: Path) -> None:
    """Make an empty queue under another name first: a file without a table is never taken for one."""
    draft = path.with_name(f"{path.name}.new")
    draft.unlink(missing_ok=True)
    with closing(_connect(draft, LOCKED_SECONDS)) as base:
        base.executescript(SCHEMA)
    draft.replace(path)
    sync_folder(path.parent)
