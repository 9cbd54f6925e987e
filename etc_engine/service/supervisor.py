"""The supervisor: one thread that starts, watches and ends batches, whatever happened to it or to them before.

Everything it knows is in the queue, the folders of the studies and the table of processes, so that it can be killed
and started again at any moment. A study is done when its result file is there: the sweep puts that in place whole.
"""

from __future__ import annotations

import logging
import sqlite3
import threading
import time
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, field

from etc_engine.durable.provenance import now
from etc_engine.errors import EtcError, OutputError
from etc_engine.service.held import REFUSED, EngineError, last_line
from etc_engine.service.launchers import Ended, Launcher, UnreachableError
from etc_engine.service.live import LiveResults, log_tail
from etc_engine.service.queue import Entry, Queue
from etc_engine.service.reading import Finished
from etc_engine.service.settings import Settings
from etc_engine.service.store import DAMAGED, Store

log = logging.getLogger("etc_engine.service")

ATTEMPTS = 3
"""Starts without a single finished unit before a study counts as failed."""
START = "== start"
"""How a batch begins in the log of its study."""
GRACE = 30.0
"""Seconds that a batch may take to end when it is asked to."""
COUNT_SECONDS = 1.0
RETRY_SECONDS = 1.0


@dataclass
class _Watch:
    """The state of a running batch that the queue does not hold."""

    began: float = field(default_factory=time.monotonic)
    looked: float = 0.0
    counted: float = 0.0
    asked: float = 0.0
    reason: str = ""
    batch: str = ""
    ended: Ended | None = None
    reading: Future[Finished] | None = None
    misread: int = 0


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
        self._closed_until = 0.0
        self._stopping, self._wake, self._taken_up = threading.Event(), threading.Event(), False
        self._thread = threading.Thread(target=self._work, name="supervisor", daemon=True)

    def start(self) -> None:
        """Begin, with what an earlier service left running."""
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
            with suppress(sqlite3.Error):  # the next service finds out what the end means
                self._settle(entry, Ended(), self._watches.get(entry.id, _Watch()))

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
        if not self._taken_up:
            self._take_up()
        running = self._queue.entries("running", limit=-1)
        for entry in running:
            self._look_after(entry, self._watches.setdefault(entry.id, _Watch()))
        moment = time.monotonic()
        self._later = {study: until for study, until in self._later.items() if until > moment}
        reading = sum(watch.ended is not None for watch in self._watches.values())
        if len(running) - reading < self._launcher.concurrent and moment >= self._closed_until:
            waiting = self._queue.first_waiting(frozenset(self._later))
            if waiting is not None:
                self._launch(waiting)
                self._wake.set()

    def _take_up(self) -> None:
        """Whatever ended a batch of an earlier service may have been the end of that service."""
        for entry in self._queue.entries("running", limit=-1):
            self._queue.forgive(entry.id)
        self._taken_up = True

    def _launch(self, entry: Entry) -> None:
        """Start a batch; the queue knows before and after, so that a kill in between is noticed."""
        self._queue.begin(entry.id)
        watch = self._watches[entry.id] = _Watch()
        try:
            with self._store.log(entry.id).open("a") as file:
                file.write(f"{START} {now()}\n")
            watch.batch = self._launcher.start(entry.id)
        except UnreachableError as error:  # no fault of the study: it waits as long as that lasts
            log.warning("supervisor: %s", error)
            self._closed_until = time.monotonic() + self._launcher.interval
            self._queue.forgive(entry.id)
            self._queue.put_back(entry.id, str(error))
        except (OSError, EtcError) as error:
            self._try_again(self._queue.require(entry.id), str(error))
        else:
            self._queue.set_batch(entry.id, watch.batch)

    def _look_after(self, entry: Entry, watch: _Watch) -> None:
        if watch.ended is None:
            self._look(entry, watch)
        if watch.ended is not None and self._settle(self._queue.require(entry.id), watch.ended, watch):
            self._watches.pop(entry.id, None)

    def _look(self, entry: Entry, watch: _Watch) -> None:
        """See whether a batch has ended, and end it where it should."""
        moment, batch = time.monotonic(), watch.batch or entry.batch
        if not batch:  # started by a service that could not note it any more, if at all
            try:
                batch = self._launcher.find(entry.id)
            except UnreachableError:
                return
        if not entry.batch and batch:  # or the queue was held by another program when the batch was started
            self._queue.set_batch(entry.id, batch)
        if moment - watch.counted > COUNT_SECONDS:
            watch.counted = moment
            self._count(entry)
        if not watch.asked:
            watch.reason = self._reason_to_stop(entry, watch, moment)
            if watch.reason:
                watch.asked = moment
                self._launcher.stop(entry.id, batch)
        elif moment - watch.asked > GRACE:
            self._launcher.kill(entry.id, batch)
        watch.ended = self._launcher.look(entry.id, batch)
        if watch.ended is not None and not self._launcher.outlives:
            self._launcher.kill(entry.id, batch)  # ranks that have lost their launcher

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

    def _settle(self, entry: Entry, ended: Ended, watch: _Watch) -> bool:
        """Decide what the end of a batch means; returns False as long as its result is being read."""
        if self._store.result(entry.id).is_file():
            return not self._stopping.is_set() and self._finish(entry, watch)
        if entry.cancelling or watch.reason:
            self._count(entry)
            self._queue.settle(entry.id, "cancelled" if entry.cancelling else "failed", watch.reason or "cancelled")
        elif self._stopping.is_set():
            self._queue.put_back(entry.id, "")
        else:
            self._count(entry)
            said = last_line(log_tail(self._store.log(entry.id)).rpartition(START)[2])
            if ended.status == REFUSED and "another run is computing" not in said:
                self._queue.settle(entry.id, "failed", said)
            else:
                code = "" if ended.status is None else f" with status {ended.status}"
                reason = ended.reason or said or f"its batch ended{code}, see the log"
                self._try_again(self._queue.require(entry.id), reason)
        return True

    def _finish(self, entry: Entry, watch: _Watch) -> bool:
        """The result is there: done, unless its file is damaged; returns False as long as that is not known."""
        watch.reading = watch.reading or self._live.finished(entry.id)
        if not watch.reading.done():
            return False
        try:
            found = watch.reading.result()
        except EngineError as error:  # no memory, say: nothing is wrong with the file
            watch.reading, watch.misread = None, watch.misread + 1
            if watch.misread < ATTEMPTS:
                return False
            self._queue.settle(entry.id, "failed", str(error))
        except OutputError as error:
            self._queue.settle(entry.id, "failed", damaged(error))
            self._store.set_aside(entry.id)
        else:
            self._live.forget(entry.id)
            self._queue.finish(entry.id, found.units, found.failed_cells)
        return True

    def _try_again(self, entry: Entry, reason: str) -> None:
        """The study continues at once after progress, a little later without, and fails after three such starts."""
        if entry.attempts >= ATTEMPTS:
            self._queue.settle(entry.id, "failed", reason)
            return
        self._later[entry.id] = time.monotonic() + RETRY_SECONDS * entry.attempts
        self._queue.put_back(entry.id, reason)


def damaged(error: OutputError) -> str:
    """Why a study has failed whose result is damaged, and what can be done."""
    return f"{error}; the file is kept as {DAMAGED}, resume computes the study again"
