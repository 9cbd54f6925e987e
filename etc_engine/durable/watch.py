"""The watch: a rank that the rest of its run has left ends by itself.

A launcher that is killed can leave ranks behind. They may wait for ever in MPI for ranks that are gone, or go
on computing what a new run computes too. So every rank looks, now and then, whether its run still holds
the lock, whether rank 0 still shows signs of life, and whether the launcher is still its parent.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType

from etc_engine.durable.lock import SILENCE, held_by

LOOK = 30.0
RESUMABLE = 75


class Watch:
    """Looks after a rank from ``with`` to the end of its block.

    Parameters
    ----------
    lock : Path
        The lock that rank 0 of this run holds.
    run : str
        This run.
    launched : bool
        Whether a launcher started this process, so that another parent means that the launcher is gone.
    leave : callable, optional
        What ends the process, given the reason; nothing gentler gets a rank out of MPI.
    """

    def __init__(self, lock: Path, run: str, launched: bool, leave: Callable[[str], None] | None = None) -> None:
        self._lock, self._run = lock, run
        self._parent = os.getppid() if launched else None
        self._leave = leave or _leave
        self._touched, self._since = 0, time.monotonic()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._look, name="watch", daemon=True)

    def reason_to_leave(self) -> str:
        """Why this rank should end, or nothing."""
        if self._parent is not None and os.getppid() != self._parent:
            return "the launcher is gone"
        if not held_by(self._lock, self._run):
            return f"another run has taken over {self._lock}"
        return f"rank 0 has been silent for {self._silence():.0f} s" if self._silence() > SILENCE else ""

    def _silence(self) -> float:
        """Seconds since the lock was last seen to change; no clock but this host's takes part."""
        now, touched = time.monotonic(), self._lock.stat().st_mtime_ns if self._lock.exists() else 0
        if touched != self._touched:
            self._touched, self._since = touched, now
        return now - self._since

    def _look(self) -> None:
        while not self._ended.wait(LOOK):
            reason = self.reason_to_leave()
            if reason and not self._ended.is_set():
                self._leave(reason)
                return

    def __enter__(self) -> Watch:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self._thread.join()


def _leave(reason: str) -> None:
    sys.stderr.write(f"etc-engine: process {os.getpid()} ends: {reason}; finished units are kept\n")
    sys.stderr.flush()
    os._exit(RESUMABLE)
