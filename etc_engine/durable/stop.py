"""Stopping early: a warning signal ends the unit at hand, what is finished stays."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Any, TypeVar

T = TypeVar("T")
SIGNALS = (signal.SIGTERM, signal.SIGINT)


@contextmanager
def signals_held_back() -> Iterator[None]:
    """Hold back SIGTERM until a `StopRequest` listens; it then stops the run as a later one does.

    Loading libraries and starting MPI take seconds, in which SIGTERM would end the process with another status.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class Stopped(BaseException):
    """Raised inside a unit by a signal. Not an ``Exception``: a unit records those as its result."""


class StopRequest:
    """Listens to SIGTERM and SIGINT within its ``with`` block; the first one asks to stop.

    Schedulers send SIGTERM some seconds before they kill. A unit can take longer than that, so it is cut
    short; between units, and while other ranks are waited for, the request is only noted.
    """

    def __init__(self) -> None:
        self.reason = ""
        self._in_unit = False
        self._before: dict[int, Any] = {}

    def run(self, unit: Callable[[], T]) -> T:
        """Run a unit; `Stopped` leaves it when a signal comes or has come.

        Compiled code turns `Stopped` into an error of its own, which a unit may record. The result of a unit
        after a signal therefore does not count.
        """
        try:
            self._in_unit = True
            if self.reason:
                raise Stopped
            result = unit()
        except Exception:
            if self.reason:
                raise Stopped from None
            raise
        finally:
            self._in_unit = False
        if self.reason:
            raise Stopped
        return result

    def _note(self, number: int, _frame: FrameType | None) -> None:
        first, self.reason = not self.reason, self.reason or signal.Signals(number).name
        if first and self._in_unit:
            raise Stopped

    def __enter__(self) -> StopRequest:
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.signal(number, self._note) for number in SIGNALS}
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})  # see `signals_held_back`
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
