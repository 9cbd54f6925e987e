"""Processes of batches: distinguished from later processes with the same number, and from foreign ones."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from etc_engine.durable.lock import boot_identity, process_start_of

PATIENCE = 10.0
"""Seconds that killed processes are given to vanish."""


@dataclass(frozen=True)
class ProcessIdentity:
    """A process, by its number, its start and the boot of the machine: together they never come again."""

    number: int
    start: str
    boot: str

    @classmethod
    def of(cls, number: int) -> ProcessIdentity:
        """The identity of a process that runs now."""
        return cls(number, process_start_of(number), boot_identity())

    @property
    def alive(self) -> bool:
        """Whether this very process still runs."""
        return bool(self.start) and self.boot == boot_identity() and process_start_of(self.number) == self.start

    def signal(self, number: int) -> None:
        """Send a signal, if the process is still this one."""
        if self.alive:
            with suppress(ProcessLookupError):
                os.kill(self.number, number)


def batch_processes(result: Path) -> Iterator[int]:
    """All processes of this machine that compute a result, launchers included: it stands in their command line."""
    words = {b"sweep", os.fsencode(result)}
    for place in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            if words <= set(place.read_bytes().split(b"\0")):
                yield int(place.parent.name)
        except OSError:
            continue


def kill_batch(result: Path) -> int:
    """Kill what still computes a result, and wait until it is gone; returns how many there were."""
    found = {ProcessIdentity.of(number) for number in batch_processes(result)}
    for process in found:
        process.signal(signal.SIGKILL)
    deadline = time.monotonic() + PATIENCE
    while any(process.alive for process in found) and time.monotonic() < deadline:
        time.sleep(0.01)
    return len(found)
