"""Finished results, read by a process of its own: a damaged file cannot hold up the service.

``python -m etc_engine.service.reading result.nc`` prints units and failed cells as one line of JSON, and the numbers
of the figure as a second one; a file that is refused is one line on stderr and exit status 2.
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path

from etc_engine.durable.apart import time_limit
from etc_engine.errors import InputError, OutputError
from etc_engine.realization import Status
from etc_engine.service.curve import curve_of
from etc_engine.service.held import ENGINE, REFUSED, EngineError, Held, run_held
from etc_engine.sweep.result_file import open_dataset

SECONDS = 120.0
"""Time for the figure, beyond that of reading the file twice."""


@dataclass(frozen=True)
class Finished:
    """Summary of a finished result.

    Parameters
    ----------
    units, failed_cells : int
        Packings, and cells without a conductivity.
    curve : bytes
        JSON of `curve_of`.
    """

    units: int
    failed_cells: int
    curve: bytes


def read_finished(result: Path, memory_bytes: int) -> Finished:
    """Content of a result file, read by a process of its own within a time limit.

    Raises
    ------
    OutputError
        If the file is damaged, in the words of its reader.
    EngineError
        If the reading failed for another reason: the file may be good.
    """
    seconds = SECONDS + 2.0 * time_limit(result)
    line = [sys.executable, "-m", __name__, str(result)]
    try:
        printed, _ = run_held(line, result.parent, Held(seconds, memory_bytes))
    except InputError as error:
        if str(result) in str(error):
            raise OutputError(str(error)) from None
        raise EngineError(f"{result} could not be read: {error}") from None
    counts, curve = printed.splitlines()
    return Finished(**json.loads(counts), curve=curve.encode())


def encoded(curve: dict[str, object], *, complete: bool) -> bytes:
    """The numbers of the figure as JSON."""
    return json.dumps(curve | {"complete": complete}, allow_nan=False).encode()


def main(result: Path) -> int:
    """Print the content of a result file; returns the exit status."""
    try:
        dataset = open_dataset(result)
    except OutputError as error:
        sys.stderr.write(f"{ENGINE}{error}\n")
        return REFUSED
    status = dataset["status"].values
    failed = int(((status > Status.NOT_PERCOLATING) & (status < Status.NOT_RUN)).sum())
    counts = {"units": int((dataset["worker_rank"].values >= 0).sum()), "failed_cells": failed}
    sys.stdout.write(f"{json.dumps(counts)}\n{encoded(curve_of(dataset), complete=True).decode()}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
