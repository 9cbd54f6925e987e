"""Data files of MercuryDPM (``.data``, the layout of XBalls): a header with the box, then a row for each particle."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from etc_engine.box import AXES
from etc_engine.errors import InputError
from etc_engine.particle_files.counted import count_counted, pick_frame, read_rows
from etc_engine.particle_files.digits import PrintedColumn, PrintedColumns
from etc_engine.particle_files.sample import Rows, Sample
from etc_engine.particle_files.streams import open_stream, skip

KIND = "MercuryDPM"
COLUMNS = {
    2: ("x", "y", "vx", "vy", "radius", "angle", "omega", "info"),
    3: ("x", "y", "z", "vx", "vy", "vz", "radius", "ax", "ay", "az", "omegax", "omegay", "omegaz", "info"),
}
"""Columns of a row, by dimension; more may follow."""


def is_mercury(opening: bytes) -> bool:
    """Whether a file begins like MercuryDPM's: number of particles, time, low and high corner of the box, then rows.

    Examples
    --------
    >>> is_mercury(b"1 0 0 0 0 1 1 1\\n0.5 0.5 0.5 0 0 0 0.1 0 0 0 0 0 0 0\\n")
    True
    """
    lines = opening.split(b"\n", 2)
    if len(lines) < 2:
        return False
    try:
        header, row = ([float(word) for word in line.split()] for line in lines[:2])
    except ValueError:
        return False
    return {6: 8, 8: 14}.get(len(header), 99) <= len(row) and header[0] == round(header[0]) and header[0] > 0


def mercury_rows(path: Path, sample: Sample) -> Rows:
    """Rows of one frame of a MercuryDPM data file.

    Raises
    ------
    InputError

    Notes
    -----
    The file does not say which faces of the box are periodic: walls, unless ``--periodic`` names axes.

    References
    ----------
    MercuryDPM, ``DPMBase::outputXBallsData`` and ``outputXBallsDataParticle`` (formats 8 and 14).
    """
    frame = pick_frame(path, KIND, 1, -1 if sample.frame is None else sample.frame)
    try:
        numbers = np.array([float(word) for word in frame.header[0].split()[2:]]).reshape(2, -1)
    except ValueError:
        numbers = np.zeros((2, 0))
    d = numbers.shape[1]
    if d not in COLUMNS or not np.isfinite(numbers).all():
        raise InputError(f"{path}: the header needs the number of rows, time and box, found {frame.header[0][:60]!r}")
    width = _width(path, frame.start)
    names = [*COLUMNS[d], *(f"column{k}" for k in range(len(COLUMNS[d]), width))]
    reader = read_rows(path, frame, names, sample.radius_column)
    radii, digits = reader.column("radius"), reader.digits()
    assert radii is not None
    printed = None
    if digits is not None:
        positions = tuple(PrintedColumn(digits[axis]) for axis in AXES[:d])
        printed = PrintedColumns(positions, PrintedColumn(digits["radius"]), "raise the precision of the data file")
    return Rows(
        place=reader.place,
        positions=reader.positions(),
        radii=radii,
        bounds=numbers.T,
        periodic=(False,) * d,
        planar=d == 2,
        printed=printed,
        notes=() if sample.periodic is not None else ("a MercuryDPM file does not say which axes are periodic: walls",),
    )


def count_mercury(path: Path) -> int:
    """Number of frames of a MercuryDPM data file."""
    return count_counted(path, KIND, 1)


def _width(path: Path, start: int) -> int:
    with open_stream(path) as stream:
        skip(stream, start)
        return len(stream.readline(1 << 16).split())
