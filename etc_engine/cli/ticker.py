"""The progress of a sweep, shown by a process apart: a bar on a terminal, a line a minute elsewhere.

A compiled kernel holds the interpreter until it returns, and no thread of that process can write meanwhile. This file
therefore runs as a script. It reads states, one JSON object a line, and ends when nobody can write to it any more.
"""

from __future__ import annotations

import json
import os
import select
import signal
import sys
import time
from typing import Any

LINE_SECONDS = 60.0
BAR_SECONDS = 1.0
"""Between two refreshments on a terminal."""
COMPILE_SECONDS = 30
"""Compilation of the kernels of one study from an empty cache, on an idle machine: 27 s for bonded disks with the
method cell and conducting pores, and less for spheres with the method chord (tests/VALIDATION.md, 23.5)."""
COMPILING = f"compiling kernels (once per machine, about {COMPILE_SECONDS} s)"
FORM = "{percentage:3.0f}%|{bar}| {elapsed} {desc}"


class Tally:
    """Where a sweep stands, and its rate.

    The rate counts from the first unit that this run finishes: no other unit waits for the compilation before it.
    """

    def __init__(self) -> None:
        self.done = self.planned = self.failed = 0
        self.compiling = False
        self._begun: int | None = None
        self._first, self._counted = 0, 0.0

    def take(self, state: dict[str, Any], now: float) -> None:
        """Take in what has changed: ``done``, ``planned``, ``failed`` or ``compiling``."""
        self.compiling = bool(state.get("compiling", self.compiling))
        if "done" not in state:
            return
        self.done, self.planned, self.failed = state["done"], state["planned"], state["failed"]
        if self._begun is None:
            self._begun = self.done
        if not self._counted and self.done > self._begun:
            self._first, self._counted = self.done, now

    def text(self, now: float) -> str:
        """The state in words."""
        computed, seconds = (self.done - self._first, now - self._counted) if self._counted else (0, 0.0)
        if self.compiling:  # no estimate beside it: the line must fit into 80 columns
            return f"{self.done}/{self.planned} units, {COMPILING}"
        return progress_words(self.done, self.planned, self.failed, computed, seconds)


def progress_words(done: int, planned: int, failed: int, computed: int, seconds: float) -> str:
    """Units, rate, time to go and failures.

    Examples
    --------
    >>> progress_words(30, 120, 1, 20, 40.0)
    '30/120 units, 0.5 units/s, 180 s to go, failed cells: 1'
    """
    rate = computed / seconds if seconds > 0.0 else 0.0
    left = f"{(planned - done) / rate:.0f} s to go" if rate else "no estimate yet"
    return f"{done}/{planned} units, {rate:.3g} units/s, {left}, failed cells: {failed}"


class _Bar:
    """A bar that is drawn anew each time."""

    def __init__(self) -> None:
        self._bar: Any = None

    def show(self, tally: Tally, now: float) -> None:
        if self._bar is None:
            import tqdm

            self._bar = tqdm.tqdm(total=tally.planned, bar_format=FORM, dynamic_ncols=True, file=sys.stderr)
        self._bar.total, self._bar.n = tally.planned, tally.done
        self._bar.set_description_str(tally.text(now))

    def close(self, tally: Tally, now: float) -> None:
        self.show(tally, now)
        self._bar.close()


class _Lines:
    """A line for each period of a log."""

    def show(self, tally: Tally, now: float) -> None:
        sys.stderr.write(f"etc-engine: {tally.text(now)}\n")
        sys.stderr.flush()

    def close(self, tally: Tally, now: float) -> None:
        """Nothing: the command prints the end."""


def show_states(source: int, line_seconds: float = LINE_SECONDS) -> None:
    """Show the states that arrive on a descriptor, until its other end is closed."""
    tally, rest = Tally(), b""
    terminal = sys.stderr.isatty()
    shown: _Bar | _Lines = _Bar() if terminal else _Lines()
    period = BAR_SECONDS if terminal else line_seconds
    due = time.monotonic() + (0.0 if terminal else period)
    while True:
        ready, _, _ = select.select([source], [], [], max(0.0, due - time.monotonic()))
        if ready:
            data = os.read(source, 65536)
            if not data:
                break
            *whole, rest = (rest + data).split(b"\n")
            for line in whole:
                tally.take(json.loads(line), time.monotonic())
        if time.monotonic() >= due and tally.planned:
            shown.show(tally, time.monotonic())
            due = time.monotonic() + period
        elif not ready:
            due = time.monotonic() + period
    if tally.planned:
        shown.close(tally, time.monotonic())


def main() -> None:
    """Heed no signal that is meant for the sweep: it stops in its own time, and this process after it."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    try:
        show_states(sys.stdin.fileno(), float(sys.argv[1]))
    except OSError:  # the terminal is gone, or the disk of the log is full
        os._exit(0)


if __name__ == "__main__":
    main()
