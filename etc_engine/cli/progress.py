"""The progress of a sweep, shown by a process apart; and of a packing: a bar on a terminal."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack, suppress
from pathlib import Path
from types import TracebackType
from typing import Any

import click

from etc_engine.cli.ticker import LINE_SECONDS

END_SECONDS = 2.0
"""What the last refreshment may take: a terminal that is stopped (Ctrl-S) holds up no result."""
BAR_DELAY = 1.0
"""A packing that takes less than this many seconds shows no bar."""


class Progress:
    """Shows units done of units planned, rate, remaining time and failures on stderr, also during a unit.

    A process apart shows them, see ``ticker.py``: a compiled kernel holds the interpreter of this one. It starts with
    the first report, which rank 0 alone makes, before its first unit. It ends with this process, however that ends.
    """

    def __init__(self, line_seconds: float = LINE_SECONDS) -> None:
        self._line_seconds = line_seconds
        self._ticker: subprocess.Popen[bytes] | None = None
        self._held = ExitStack()

    def report(self, done: int, planned: int, failed: int) -> None:
        """Take in the present state."""
        if self._ticker is None:
            self._start()
        self._send({"done": done, "planned": planned, "failed": failed})

    def notify(self, text: str) -> None:
        """A remark of its own line."""
        click.echo(f"etc-engine: {text}", err=True)

    def _start(self) -> None:
        script = Path(__file__).with_name("ticker.py")
        line = [sys.executable, "-P", str(script), str(self._line_seconds)]
        self._ticker = subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL)
        assert self._ticker.stdin is not None
        os.set_blocking(self._ticker.stdin.fileno(), False)
        self._held.callback(self._end, self._ticker)
        self._held.enter_context(_compilation(lambda now: self._send({"compiling": now})))

    def _send(self, state: dict[str, int | bool]) -> None:
        """Write one state, or drop it: nothing waits for a reader that is stopped or gone."""
        if self._ticker is not None and self._ticker.stdin is not None:
            with suppress(OSError):  # shorter than PIPE_BUF: written whole or not at all
                os.write(self._ticker.stdin.fileno(), json.dumps(state).encode() + b"\n")

    @staticmethod
    def _end(ticker: subprocess.Popen[bytes]) -> None:
        if ticker.stdin is not None:
            ticker.stdin.close()
        try:
            ticker.wait(END_SECONDS)
        except subprocess.TimeoutExpired:
            ticker.kill()
            ticker.wait()

    def __enter__(self) -> Progress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._held.close()


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


def _compilation(tell: Callable[[bool], None]) -> AbstractContextManager[None]:
    """Calls ``tell`` when compilation begins and ends; a kernel that the cache holds is not compiled."""
    from numba.core import event  # takes long to import: --help does without

    class Compilation(event.Listener):
        depth = 0  # a kernel within a kernel is the same compilation

        def on_start(self, event: Any) -> None:  # noqa: ARG002 - the signature of numba
            self.depth += 1
            if self.depth == 1:
                tell(True)

        def on_end(self, event: Any) -> None:  # noqa: ARG002 - the signature of numba
            self.depth -= 1
            if self.depth == 0:
                tell(False)

    installed: AbstractContextManager[None] = event.install_listener("numba:compile", Compilation())
    return installed
