"""Programs in processes of their own, held in time and memory: what a file or an option does there ends there."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from etc_engine.errors import InputError, OutputError
from etc_engine.service.launchers import HELD, batch_environment

ENGINE = "etc-engine: "
"""How a line of the engine itself begins."""
REFUSED = 2


class EngineError(OutputError):
    """A program ended in a way it should not."""


@dataclass(frozen=True)
class Held:
    """How much a program may take."""

    seconds: float
    memory_bytes: int


def run_held(line: Sequence[str], folder: Path, held: Held, good: Sequence[int] = (0,)) -> tuple[str, str]:
    """Output and errors of a program that ends with a good status.

    Parameters
    ----------
    line : sequence of str
        Program and arguments.
    folder : Path
        Where it runs.
    held : Held
    good : sequence of int
        Statuses that are no failure.

    Raises
    ------
    InputError
        With the program's own line if it refuses, or if it takes too long or too much memory.
    EngineError
        If it fails in another way.
    """
    with subprocess.Popen(
        ["/bin/sh", "-c", HELD, "sh", str(held.memory_bytes // 1024), *line],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
        cwd=folder,
        env=batch_environment(),
        encoding="utf-8",
        errors="replace",
    ) as running:
        try:
            printed, said = running.communicate(timeout=held.seconds)
        except subprocess.TimeoutExpired:
            with suppress(ProcessLookupError):
                os.killpg(running.pid, signal.SIGKILL)
            running.communicate()
            raise InputError(f"it took longer than {held.seconds:g} s, which is all this service allows") from None
    if running.returncode in good:
        return printed, said
    reason = last_line(said)
    if running.returncode == REFUSED:
        raise InputError(reason)
    if "MemoryError" in said or "allocat" in said:
        raise InputError(
            f"it takes more than {held.memory_bytes / 1e6:.0f} MB of memory, which is all this service allows"
        )
    raise EngineError(reason or f"{Path(line[0]).name} ended with status {running.returncode}")


def last_line(text: str) -> str:
    """The last thing the engine itself said in a log; empty if it said nothing.

    Examples
    --------
    >>> last_line("etc-engine: cannot write shard: no space\\nPlease see the FAQ page\\n")
    'cannot write shard: no space'
    """
    lines = [line for line in text.splitlines() if line.startswith(ENGINE)]
    return lines[-1].removeprefix(ENGINE) if lines else ""
