"""Files tried by a process of its own: a damaged file can keep a library busy for ever, or end the process."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

SECONDS, BYTES_PER_SECOND = 30.0, 5e6
"""Time that a file may take to be read: so long, and the time of its bytes at this rate."""

NETCDF = """
import sys, netCDF4
with netCDF4.Dataset(sys.argv[1]) as file:
    for variable in file.variables.values():
        variable[...]
"""
TIFF = """
import logging, sys, tifffile
logging.getLogger("tifffile").disabled = True
tifffile.imread(sys.argv[1])
"""


def time_limit(path: Path) -> float:
    """Seconds that the reading of a file may take."""
    return SECONDS + path.stat().st_size / BYTES_PER_SECOND


def why_unreadable(path: Path, program: str) -> str:
    """Why a library cannot read a file to its end within the time limit; empty if it can.

    Parameters
    ----------
    path : Path
    program : str
        Python that reads the file ``sys.argv[1]``, such as `NETCDF` or `TIFF`.

    Returns
    -------
    str

    Examples
    --------
    >>> why_unreadable(Path(__file__), "import sys; open(sys.argv[1]).read()")
    ''
    >>> why_unreadable(Path(__file__), "raise ValueError('no such chunk')")
    'it is damaged (ValueError: no such chunk)'
    """
    try:
        limit = time_limit(path)
    except OSError as error:
        return error.strerror or str(error)
    line = [sys.executable, "-c", program, str(path)]
    try:
        done = subprocess.run(
            line, stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace", timeout=limit, check=False
        )
    except subprocess.TimeoutExpired:
        return f"the reading library did not finish within {limit:.0f} s, the file is damaged"
    if done.returncode == 0:
        return ""
    said = (done.stderr.strip().splitlines() or [f"the reading process ended with {done.returncode}"])[-1]
    return f"it is damaged ({said})"
