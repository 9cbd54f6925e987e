"""Extended XYZ, as OVITO and ASE write it: particles of one frame, with the box of its comment line."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.box import AXES
from etc_engine.errors import InputError
from etc_engine.particle_files.counted import count_counted, pick_frame, read_rows
from etc_engine.particle_files.digits import PrintedColumn, PrintedColumns
from etc_engine.particle_files.sample import Rows, Sample

KIND = "XYZ"
HEADER_LINES = 2


def is_xyz(opening: bytes) -> bool:
    """Whether a file begins like XYZ: a whole number alone, then a comment of ``key=value`` words.

    Examples
    --------
    >>> is_xyz(b'2\\nLattice="1 0 0 0 1 0 0 0 1" Properties=pos:R:3:radius:R:1\\n0.2 0.5 0.5 0.1\\n')
    True
    """
    lines = opening.split(b"\n", 2)
    return len(lines) > 1 and lines[0].strip().isdigit() and b"Properties=" in lines[1]


def xyz_rows(path: Path, sample: Sample) -> Rows:
    """Rows of one frame of an extended XYZ file.

    Raises
    ------
    InputError
        If the box is tilted, or positions or radii are missing.

    Notes
    -----
    Read are ``Lattice`` (three edge vectors), ``Origin`` (low corner), ``pbc`` and ``Properties``. Without ``pbc`` a
    file with a lattice is periodic along all axes, as the format says.

    References
    ----------
    Extended XYZ: https://github.com/libAtoms/extxyz; OVITO manual, "XYZ file reader".
    """
    frame = pick_frame(path, KIND, HEADER_LINES, -1 if sample.frame is None else sample.frame)
    entries = _entries(path, frame.header[1])
    names = _columns(path, entries.get("properties", ""))
    reader = read_rows(path, frame, names, sample.radius_column)
    bounds = _bounds(reader.place, entries)
    digits, layout = reader.digits(), reader.layout
    half = 0.5 if layout.halved else 1.0
    radii = reader.column("radius")
    assert radii is not None
    printed = None
    if digits is not None:
        positions = tuple(PrintedColumn(digits[axis]) for axis in AXES[: len(layout.positions)])
        printed = PrintedColumns(positions, PrintedColumn(digits["radius"], half))
    return Rows(
        place=reader.place,
        positions=reader.positions(),
        radii=half * radii,
        bounds=bounds,
        periodic=_periodic(reader.place, entries) if bounds is not None else None,
        conductivity=reader.column("conductivity"),
        ids=reader.ids(),
        types=reader.types(),
        temperature=reader.column("temperature"),
        printed=printed,
    )


def count_xyz(path: Path) -> int:
    """Number of frames of an XYZ file."""
    return count_counted(path, KIND, HEADER_LINES)


def _entries(path: Path, comment: str) -> dict[str, str]:
    """The ``key=value`` words of a comment line; values may stand in quotes."""
    try:
        words = shlex.split(comment, posix=True)
    except ValueError as error:
        raise InputError(f"{path}: the comment line {comment[:60]!r} is not understood: {error}") from None
    pairs = (word.partition("=") for word in words)
    return {key.lower(): value for key, mark, value in pairs if mark}


def _columns(path: Path, properties: str) -> list[str]:
    """Names of the columns of ``Properties=name:type:count:...``."""
    words = properties.split(":")
    if len(words) < 3 or len(words) % 3 or not all(word.isdigit() and int(word) < 1000 for word in words[2::3]):
        raise InputError(f"{path}: Properties needs name:type:count words, found {properties[:60]!r}")
    names: list[str] = []
    for name, count in zip(words[::3], map(int, words[2::3]), strict=True):
        if name.lower() == "pos":
            names += list(AXES[:count])
        else:
            names += [name] if count == 1 else [f"{name}[{k + 1}]" for k in range(count)]
    return names


def _bounds(place: str, entries: dict[str, str]) -> Floats | None:
    if "lattice" not in entries:
        return None
    try:
        edges = np.array([float(word) for word in re.split(r"[\s,]+", entries["lattice"].strip())]).reshape(3, 3)
        corner = np.array([float(word) for word in re.split(r"[\s,]+", entries.get("origin", "0 0 0").strip())])
    except ValueError:
        raise InputError(f"{place}: Lattice needs nine numbers, found {entries['lattice'][:60]!r}") from None
    if corner.shape != (3,) or not np.isfinite(edges).all() or not np.isfinite(corner).all():
        raise InputError(f"{place}: Origin needs three numbers, found {entries.get('origin', '')[:60]!r}")
    if (edges != np.diag(np.diag(edges))).any():
        raise InputError(
            f"{place} has a tilted box (Lattice); only boxes with right angles along x, y, z are understood"
        )
    return np.stack([corner, corner + np.diag(edges)], axis=1)


def _periodic(place: str, entries: dict[str, str]) -> tuple[bool, ...]:
    flags = entries.get("pbc", "T T T").split()
    if len(flags) != 3 or any(flag.upper() not in ("T", "F", "TRUE", "FALSE", "1", "0") for flag in flags):
        raise InputError(f"{place}: pbc needs three flags T or F, found {entries.get('pbc', '')[:40]!r}")
    return tuple(flag.upper() in ("T", "TRUE", "1") for flag in flags)
