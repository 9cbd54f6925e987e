"""Time of a command without the compilation of its kernels, which only the first run after an installation has."""

from __future__ import annotations

import time

import click

WORTH_SHOWING = 0.1
"""Compilation below this many seconds is left out of the record."""


class Clock:
    """Wall time since it was made. Compilation is measured apart, a kernel within another one counted once."""

    def __init__(self) -> None:
        self._start = time.perf_counter()

        from numba.core import event  # takes long to import: --help does without

        self._compiling = event.TimingListener()  # type: ignore[no-untyped-call]
        click.get_current_context().with_resource(event.install_listener("numba:compile", self._compiling))

    def record(self) -> dict[str, float]:
        """``seconds`` without compilation, and ``compile_seconds`` where they are above `WORTH_SHOWING`."""
        elapsed = time.perf_counter() - self._start
        compiling = self._compiling.duration if self._compiling.done else 0.0
        shown = {"compile_seconds": compiling} if compiling > WORTH_SHOWING else {}
        return {"seconds": elapsed - compiling, **shown}
