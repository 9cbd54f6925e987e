"""The supervisor: one thread that starts, watches and ends batches, whatever happened to it or to them before.

Everything it knows is in the queue, the folders of the studies and the table of processes, so that it can be killed
and started again at any moment. A study is done when its result file is there: the sweep puts that in place whole.
"""

from __future__ import annotations

import logging
import sqlite3
import threading
import time
from dataclasses import dataclass, field

from etc_engine.durable.provenance import now
from etc_engine.errors import EtcError
from etc_engine.service.launchers import Ended, Launcher
from etc_engine.service.live import LiveResults, log_tail
from etc_engine.service.queue import Entry, Queue
from etc_engine.service.settings import Settings
from etc_engine.service.store import Store

log = logging.getLogger("etc_engine.service")

ATTEMPTS = 3
"""Starts without a single finished unit before a study counts as failed."""
START, ENGINE = "== start", "etc-engine: "
"""How a batch begins in the log of its study, and a line of the engine itself."""
GRACE = 30.0
"""Seconds that a batch may take to end when it is asked to."""
REFUSED = 2
COUNT_SECONDS = 1.0
RETRY_SECONDS = 1.0


@dataclass
class _Watch:
    """What is known of a running batch beside the queue."""

    began: float = field(default_factory=time.monotonic)
    looked: float = 0.0
    counted: float = 0.0
    asked: float = 0.0
    reason: str = ""


class Supervisor:
    """Works through the queue between `start` and `stop`.

    Parameters
    ----------
    store : Store
    queue : Queue
    launcher : Launcher
    live : LiveResults
    settings : Settings
    """

    def __init__(self, store: Store, queue: Queue, launcher: Launcher, live: LiveResults, settings: Settings) -> None:
        self._store, self._queue, self._launcher = store, queue, launcher
        self._live, self._limits = live, settings.limits
        self._watches: dict[str, _Watch] = {}
        self._later: dict[str, float] = {}
        self._stopping, self._wake = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._work, name="supervisor", daemon=True)

    def start(self) -> None:
        """Take up what an earlier service left running, and begin."""
        for entry in self._queue.entries("running", limit=-1):
            self._queue.forgive(entry.id)  # whatever ended it may have been the end of the service
            if not entry.batch:
                self._queue.set_batch(entry.id, self._launcher.find(entry.id))
        self._thread.start()

    def stop(self) -> None:
        """End in order: batches on this machine are asked to end and continue with the next service."""
        self._stopping.set()
        self._wake.set()
        self._thread.join()
        if self._launcher.outlives:
            return
        for entry in self._queue.entries("running", limit=-1):
            self._launcher.stop(entry.id, entry.batch)
        deadline = time.monotonic() + GRACE
        for entry in self._queue.entries("running", limit=-1):
            while self._launcher.look(entry.id, entry.batch) is None and time.monotonic() < deadline:
                time.sleep(0.05)
            self._launcher.kill(entry.id, entry.batch)
            self._settle(entry, Ended())

    def wake(self) -> None:
        """There is something new in the queue."""
        self._wake.set()

    def _work(self) -> None:
        while not self._stopping.is_set():
            try:
                self._step()
            except (OSError, sqlite3.Error, EtcError) as error:  # a full disk, say: it may have room later
                log.warning("supervisor: %s; trying again", error)
                self._stopping.wait(RETRY_SECONDS)
            except Exception:
                log.exception("supervisor: unexpected; trying again")
                self._stopping.wait(RETRY_SECONDS)
            self._wake.wait(self._launcher.interval)
            self._wake.clear()

    def _step(self) -> None:
        """Look once at every batch, and start the next ones if there is room."""
        running = self._queue.entries("running", limit=-1)
        for entry in running:
            self._look_after(entry, self._watches.setdefault(entry.id, _Watch()))
        moment = time.monotonic()
        self._later = {study: until for study, until in self._later.items() if until > moment}
        if len(running) < self._launcher.concurrent:
            waiting = self._queue.first_waiting(frozenset(self._later))
            if waiting is not None:
                self._launch(waiting)
                self._wake.set()

    def _launch(self, entry: Entry) -> None:
        """Start a batch; the queue knows before and after, so that a kill in between is noticed."""
        self._queue.begin(entry.id)
        self._watches[entry.id] = _Watch()
        try:
            with self._store.log(entry.id).open("a") as file:
                file.write(f"{START} {now()}\n")
            self._queue.set_batch(entry.id, self._launcher.start(entry.id))
        except (OSError, EtcError) as error:
            self._try_again(self._queue.require(entry.id), str(error))

    def _look_after(self, entry: Entry, watch: _Watch) -> None:
        moment = time.monotonic()
        if moment - watch.counted > COUNT_SECONDS:
            watch.counted = moment
            self._count(entry)
        if not watch.asked:
            watch.reason = self._reason_to_stop(entry, watch, moment)
            if watch.reason:
                watch.asked = moment
                self._launcher.stop(entry.id, entry.batch)
        elif moment - watch.asked > GRACE:
            self._launcher.kill(entry.id, entry.batch)
        ended = self._launcher.look(entry.id, entry.batch)
        if ended is not None:
            self._settle(self._queue.require(entry.id), ended, watch.reason)
            self._watches.pop(entry.id, None)

    def _reason_to_stop(self, entry: Entry, watch: _Watch, moment: float) -> str:
        if entry.cancelling:
            return "cancelled"
        if not self._launcher.outlives and moment - watch.began > self._limits.study_seconds:
            return f"stopped at the time limit of this service, {self._limits.study_seconds:.6g} s; resume continues"
        return ""

    def _count(self, entry: Entry) -> None:
        done = min(self._live.units(entry.id), entry.most)
        if done > entry.done:
            self._queue.set_done(entry.id, done)

    def _settle(self, entry: Entry, ended: Ended, reason: str = "") -> None:
        """Decide what the end of a batch means."""
        if not self._launcher.outlives:
            self._launcher.kill(entry.id, entry.batch)  # ranks that have lost their launcher
        if self._store.result(entry.id).is_file():
            self._finish(entry)
        elif entry.cancelling or reason:
            self._count(entry)
            self._queue.settle(entry.id, "cancelled" if entry.cancelling else "failed", reason or "cancelled")
        elif self._stopping.is_set():
            self._queue.put_back(entry.id, "")
        else:
            self._count(entry)
            said = last_line(log_tail(self._store.log(entry.id)).rpartition(START)[2])
            if ended.status == REFUSED and "another run is computing" not in said:
                self._queue.settle(entry.id, "failed", said)
            else:
                code = "" if ended.status is None else f" with status {ended.status}"
                self._try_again(self._queue.require(entry.id), said or f"its batch ended{code}, see the log")

    def _finish(self, entry: Entry) -> None:
        """The result is there: complete, unless somebody has meddled with it."""
        try:
            units, failed_cells = self._live.outcome(entry.id)
        except EtcError as error:
            self._queue.settle(entry.id, "failed", str(error))
        else:
            self._queue.finish(entry.id, units, failed_cells)

    def _try_again(self, entry: Entry, reason: str) -> None:
        """The study continues at once after progress, a little later without, and fails after three such starts."""
        if entry.attempts >= ATTEMPTS:
            self._queue.settle(entry.id, "failed", reason)
            return
        self._later[entry.id] = time.monotonic() + RETRY_SECONDS * entry.attempts
        self._queue.put_back(entry.id, reason)


def last_line(text: str) -> str:
    """The last thing the engine itself said in a log; empty if it said nothing.

    Examples
    --------
    >>> last_line("etc-engine: cannot write shard: no space\\nPlease see the FAQ page\\n")
    'cannot write shard: no space'
    """
    lines = [line for line in text.splitlines() if line.startswith(ENGINE)]
    return lines[-1].removeprefix(ENGINE) if lines else ""
