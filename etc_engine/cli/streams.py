"""Standard output and standard error of a command: what becomes of a full disk or a closed pipe behind them."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO, cast

from etc_engine.errors import OutputError


class PipeClosedError(OutputError):
    """Whoever read standard output has read enough, such as ``head``: no mistake."""


class _Guarded:
    """A text stream whose failures raise `OutputError`, or are passed over where nothing depends on its text.

    After its first failure a stream fails for ever: click tries a stream before it writes, and swallows the error.
    """

    def __init__(self, stream: TextIO | None, *, needed: bool) -> None:
        self._stream, self._needed = stream, needed
        self._broken, self._pipe = "" if stream is not None else "it is closed", False

    def write(self, text: str) -> int:
        return self._attempt(lambda stream: stream.write(text)) or len(text)

    def flush(self) -> None:
        self._attempt(lambda stream: stream.flush())

    def _attempt(self, action: Callable[[TextIO], int | None]) -> int | None:
        if self._stream is not None and not self._broken:
            try:
                return action(self._stream)
            except OSError as error:
                self._broken = error.strerror or str(error)
                self._pipe = isinstance(error, BrokenPipeError)
                _let_go(self._stream)
        if self._needed:
            raise (PipeClosedError if self._pipe else OutputError)(
                f"standard output cannot be written ({self._broken}): what this command prints is lost or cut short; "
                "files that it has written are whole"
            )
        return None

    def isatty(self) -> bool:
        return self._stream is not None and self._stream.isatty()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def _let_go(stream: TextIO) -> None:
    """Drop what is still in the buffer, which Python would try to write again when it ends."""
    with suppress(OSError, ValueError):
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, stream.fileno())
        os.close(null)


@contextmanager
def guarded_streams() -> Iterator[None]:
    """Standard output that raises `OutputError` where it cannot be written, and standard error that never fails.

    A result does not depend on its progress and warnings: a full disk behind standard error stops no sweep.
    """
    for number in range(3):  # a file that is opened later must not get the number of a closed stream
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    kept = sys.stdout, sys.stderr
    sys.stdout = cast(TextIO, _Guarded(sys.stdout, needed=True))
    sys.stderr = cast(TextIO, _Guarded(sys.stderr, needed=False))
    try:
        yield
    finally:
        sys.stdout, sys.stderr = kept
