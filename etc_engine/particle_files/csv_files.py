"""Particle files: CSV in and out."""

from __future__ import annotations

import csv
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from etc_engine.box import AXES, Box
from etc_engine.errors import InputError
from etc_engine.packing.particles import ParticlePacking


@dataclass(frozen=True, eq=False)
class ParticleTable:
    """What a particle file holds.

    Parameters
    ----------
    packing : ParticlePacking
    conductivity : ndarray, shape (n,) [W/(m K)], or None
        Conductivity of each particle, where the file gives it.
    ids : ndarray of int64, shape (n,), or None
        Number by which the file names each particle, where it does.
    wrapped : int
        Centres that lay outside the box along a periodic axis and were wrapped into it; only counted for CSV.
    """

    packing: ParticlePacking
    conductivity: NDArray[np.float64] | None = None
    ids: NDArray[np.int64] | None = None
    wrapped: int = 0


def read_csv(path: Path | str, box: Box) -> ParticleTable:
    """Particles from a CSV file with the header ``x,y[,z],radius[,conductivity]`` in any order.

    Parameters
    ----------
    path : path
    box : Box
        Its dimension decides whether a ``z`` column is wanted.

    Returns
    -------
    ParticleTable

    Raises
    ------
    InputError, GeometryError
        If the file is missing, its header or a value is not understood, or a particle is not valid.
    """
    path = Path(path)
    names = _header(path, box.dimension)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # an empty table is refused below, in our words
            values = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2, encoding="utf-8-sig")
    except ValueError:
        values = None
    if values is None or (values.size and values.shape[1] != len(names)):
        raise InputError(_first_bad_row(path, names))
    if values.size == 0:
        raise InputError(f"{path} holds no particles, only a header")
    columns = dict(zip(names, values.T, strict=True))
    centers = np.stack([columns[axis] for axis in AXES[: box.dimension]], axis=1)
    packing = ParticlePacking(centers, columns["radius"], box)
    wrapped = int(((centers < 0.0) | (centers > np.asarray(box.lengths))).any(axis=1).sum())
    return ParticleTable(packing, columns.get("conductivity"), wrapped=wrapped)


def write_csv(path: Path | str, table: ParticleTable) -> None:
    """Write particles as CSV, with as many digits as it takes to read back the same numbers."""
    packing = table.packing
    names = [*AXES[: packing.dimension], "radius"]
    columns = [*packing.centers.T, packing.radii]
    if table.conductivity is not None:
        names.append("conductivity")
        columns.append(table.conductivity)
    with Path(path).open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        writer.writerows(zip(*(column.tolist() for column in columns), strict=True))


def _header(path: Path, dimension: int) -> list[str]:
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            names = [name.strip() for name in next(csv.reader(file), [])]
    except FileNotFoundError:
        raise InputError(f"there is no file {path}") from None
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path} cannot be read as a CSV file: {error}") from None
    wanted = [*AXES[:dimension], "radius"]
    allowed = [*wanted, "conductivity"]
    if sorted(set(names)) != sorted(names) or not set(wanted) <= set(names) <= set(allowed):
        raise InputError(
            f"{path} has the header {','.join(names)!r}: a {dimension}D box needs {','.join(wanted)!r}, "
            f"optionally with 'conductivity'"
        )
    return names


def _first_bad_row(path: Path, names: list[str]) -> str:
    """What is wrong with a table that could not be read, as one line."""
    try:
        return _find_bad_row(path, names) or f"{path} cannot be read as a table of numbers"
    except (UnicodeDecodeError, csv.Error) as error:
        return f"{path} cannot be read as a CSV file: {error}"


def _find_bad_row(path: Path, names: list[str]) -> str:
    """What is wrong with the first bad row; empty if there is none."""
    with path.open(encoding="utf-8-sig", newline="") as file:
        rows = csv.reader(file)
        next(rows)
        for row in rows:
            where = f"{path}, line {rows.line_num}"
            if row and len(row) != len(names):
                return f"{where}: expected {len(names)} values ({','.join(names)}), found {len(row)}"
            for name, word in zip(names, row, strict=False):
                try:
                    float(word)
                except ValueError:
                    return f"{where}: {name} is not a number: {word!r}"
    return ""
