"""Commands of the engine for a request: in a process of their own, held in time and memory, and refused in one line."""

from __future__ import annotations

import json
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from etc_engine.errors import InputError
from etc_engine.service.held import Held, run_held
from etc_engine.service.settings import Settings
from etc_engine.service.store import Store

UPLOAD = "upload"
"""The name every uploaded file gets; what its owner called it is nobody's business."""
REPORT_SECONDS = 600.0


class BusyError(InputError):
    """More requests of a kind wait than the service takes."""


@dataclass
class Runner:
    """Runs commands of the engine, a few at a time."""

    store: Store
    settings: Settings
    _slots: threading.Semaphore = field(init=False)
    _waiting: threading.BoundedSemaphore = field(init=False)
    _reports: threading.Lock = field(default_factory=threading.Lock)

    def __post_init__(self) -> None:
        solves = self.settings.limits.solves
        self._slots = threading.Semaphore(solves)
        self._waiting = threading.BoundedSemaphore(5 * solves)

    @contextmanager
    def upload(self) -> Iterator[Path]:
        """A place for the particles of a single solve, counted before any of them has come.

        Yields
        ------
        Path
            Of the file to write, in a folder of its own that is removed in the end.

        Raises
        ------
        BusyError
            If too many requests upload, wait or are solved.
        """
        if not self._waiting.acquire(blocking=False):
            raise BusyError("too many single solves are waiting: try again in a minute")
        try:
            with tempfile.TemporaryDirectory(dir=self.store.scratch) as folder:
                yield Path(folder) / UPLOAD
        finally:
            self._waiting.release()

    def solve(self, particles: Path, options: Sequence[str]) -> dict[str, Any]:
        """What ``etc-engine solve --json`` says of an uploaded file, with its warnings.

        Raises
        ------
        InputError
            If the particles are refused, or take too long or too much memory.
        """
        with self._slots:
            line = ["solve", UPLOAD, "--json", "--full", *options]
            printed, said = self._run(line, particles.parent, self.settings.limits.solve_seconds)
        warnings = [text.removeprefix("etc-engine: ") for text in said.splitlines() if text.strip()]
        return {**json.loads(printed), "warnings": warnings}

    def report(self, study: str) -> Path:
        """The report of a finished study, made when it is first asked for.

        Raises
        ------
        InputError
            If it cannot be made, for instance because matplotlib is not installed.
        """
        page = self.store.report(study)
        with self._reports:
            if not page.exists():
                line = ["report", str(self.store.result(study)), "-o", str(page)]
                self._run(
                    line, self.store.folder(study), REPORT_SECONDS, good=(0, 3)
                )  # 3: a bound is broken, and shown
        return page

    def bed(self, study: str) -> Path:
        """The picture of the packing of a finished study, drawn when it is first asked for.

        Raises
        ------
        InputError
            If it cannot be drawn, for instance because the packings were read from files.
        """
        picture = self.store.bed(study)
        with self._reports:
            if not picture.exists():
                line = [sys.executable, "-m", "etc_engine.service.bed", str(self.store.result(study)), str(picture)]
                run_held(line, self.store.folder(study), Held(REPORT_SECONDS, self.settings.limits.memory_bytes))
        return picture

    def _run(self, line: Sequence[str], folder: Path, seconds: float, good: Sequence[int] = (0,)) -> tuple[str, str]:
        """Output and errors of a command of the engine: see `run_held`."""
        held = Held(seconds, self.settings.limits.memory_bytes)
        return run_held([*self.settings.engine, *line], folder, held, good)
