"""The progress of a sweep: a bar on a terminal, a line a minute elsewhere; and of a packing: a bar on a terminal."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import Any

import click

LINE_SECONDS = 60.0
BAR_DELAY = 1.0
"""A packing that takes less than this many seconds shows no bar."""


class Progress:
    """Shows units done of units planned, rate, remaining time and failures on stderr.

    The rate counts from the first unit of this run: kernels are compiled before it, which no other unit waits for.
    """

    def __init__(self) -> None:
        self._bar: Any = None
        self._counted = self._told = time.monotonic()
        self._first: int | None = None

    def report(self, done: int, planned: int, failed: int) -> None:
        """Take in the present state; shows it if it is time."""
        if self._first is None:
            self._first, self._counted = done, time.monotonic()
        if sys.stderr.isatty():
            self._show_bar(done, planned, failed)
        elif time.monotonic() - self._told >= LINE_SECONDS:
            self._told = time.monotonic()
            click.echo(progress_line(done, planned, failed, done - self._first, self._told - self._counted), err=True)

    def notify(self, text: str) -> None:
        """A remark of its own line."""
        click.echo(f"etc-engine: {text}", err=True)

    def _show_bar(self, done: int, planned: int, failed: int) -> None:
        if self._bar is None:
            import tqdm

            self._bar = tqdm.tqdm(total=planned, initial=done, unit="unit", dynamic_ncols=True, file=sys.stderr)
        self._bar.total = planned
        if failed:
            self._bar.set_postfix_str(f"failed cells: {failed}", refresh=False)
        self._bar.update(done - self._bar.n)

    def __enter__(self) -> Progress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.close()


class PackingProgress:
    """Shows the fraction of a packing, or of other work, as a bar on a terminal's stderr; nothing elsewhere."""

    def __init__(self, work: str = "packing") -> None:
        self._bar: Any = None
        self._work = work

    def report(self, fraction: float) -> None:
        """Take in the fraction done; what was shown never shrinks."""
        if not sys.stderr.isatty():
            return
        if self._bar is None:
            import tqdm

            form = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}<{remaining}"
            self._bar = tqdm.tqdm(
                desc=self._work, total=1.0, delay=BAR_DELAY, bar_format=form, leave=False, file=sys.stderr
            )
        self._bar.update(max(0.0, fraction - self._bar.n))

    def __enter__(self) -> PackingProgress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.close()


def progress_line(done: int, planned: int, failed: int, computed: int, seconds: float) -> str:
    """One line for a log.

    Examples
    --------
    >>> progress_line(30, 120, 1, 20, 40.0)
    'etc-engine: 30/120 units, 0.5 units/s, 180 s to go, failed cells: 1'
    """
    rate = computed / seconds if seconds > 0.0 else 0.0
    left = f"{(planned - done) / rate:.0f} s to go" if rate else "no estimate yet"
    return f"etc-engine: {done}/{planned} units, {rate:.3g} units/s, {left}, failed cells: {failed}"
