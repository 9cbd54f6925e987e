"""Particle files of every format: written by their ending, read by their first bytes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from etc_engine.box import Box
from etc_engine.errors import InputError
from etc_engine.particle_files.csv_files import ParticleTable, read_csv, write_csv
from etc_engine.particle_files.dumps import read_dump, write_dump
from etc_engine.particle_files.netcdf import read_netcdf, write_netcdf
from etc_engine.particle_files.vtp import read_vtp, write_vtp

Attributes = Mapping[str, Any]
"""Where a packing comes from: seed, command, ..."""


@dataclass(frozen=True)
class FileFormat:
    """A format of particle files.

    Parameters
    ----------
    name : str
    endings : tuple of str
        Of the names of files to write.
    openings : tuple of bytes
        First bytes of files to read, after white space; none for CSV, which is what has no others' opening.
    brings_box : bool
        Whether the file holds the box.
    has_frames : bool
        Whether a file may hold several packings.
    """

    name: str
    endings: tuple[str, ...]
    openings: tuple[bytes, ...]
    brings_box: bool = True
    has_frames: bool = False


CSV = FileFormat("CSV file", (".csv",), (), brings_box=False)
DUMP = FileFormat("dump", (".dump", ".lammpstrj"), (b"ITEM:",), has_frames=True)
NETCDF = FileFormat("netCDF file", (".nc",), (b"\x89HDF", b"CDF"))
VTP = FileFormat("VTK file", (".vtp",), (b"<?xml", b"<VTKFile"))
FORMATS = (CSV, DUMP, NETCDF, VTP)

_WRITERS: dict[FileFormat, Callable[[Path, ParticleTable, Attributes], None]] = {
    CSV: lambda path, table, _: write_csv(path, table),
    DUMP: lambda path, table, _: write_dump(path, table),
    NETCDF: write_netcdf,
    VTP: lambda path, table, _: write_vtp(path, table),
}


def format_to_write(path: Path | str) -> FileFormat:
    """Format of a file to write, by its ending.

    Raises
    ------
    InputError
        If the ending is none of the formats'.

    Examples
    --------
    >>> format_to_write("packing.lammpstrj").name
    'dump'
    """
    ending = Path(path).suffix.lower()
    for candidate in FORMATS:
        if ending in candidate.endings:
            return candidate
    known = ", ".join(ending for candidate in FORMATS for ending in candidate.endings)
    raise InputError(f"packings are written as {known}: found {str(path)!r}")


def format_to_read(path: Path | str) -> FileFormat:
    """Format of a file to read, by its first bytes; CSV where they say nothing else, or there is no such file."""
    try:
        with Path(path).open("rb") as file:
            opening = file.read(64).removeprefix(b"\xef\xbb\xbf").lstrip()
    except OSError:
        opening = b""  # the reader says what is wrong
    for candidate in FORMATS:
        if opening.startswith(candidate.openings):
            return candidate
    return CSV


def write_particles(path: Path | str, table: ParticleTable, attributes: Attributes | None = None) -> None:
    """Write particles in the format of the file's ending; every number reads back to the last bit.

    Parameters
    ----------
    path : path
        Ending in .csv (without the box), .dump or .lammpstrj, .nc, or .vtp.
    table : ParticleTable
    attributes : mapping, optional
        Where the packing comes from; kept by netCDF alone.

    Raises
    ------
    InputError, OutputError
    """
    _WRITERS[format_to_write(path)](Path(path), table, attributes or {})


def read_particles(path: Path | str, box: Box | None = None, frame: int | None = None) -> ParticleTable:
    """Read particles from a CSV file, a LAMMPS/LIGGGHTS dump, netCDF or VTK PolyData, told apart by their content.

    Parameters
    ----------
    path : path
    box : Box, optional
        Needed by a CSV file; the others bring their own.
    frame : int, optional
        Frame of a dump, from 0; the last one by default.

    Returns
    -------
    ParticleTable

    Raises
    ------
    InputError, GeometryError
        If the file is missing or not understood, or the box or the frame does not go with its format.
    """
    kind = format_to_read(path)
    if box is not None and kind.brings_box:
        raise InputError(f"{path} is a {kind.name} that brings its own box: leave the box out")
    if frame is not None and not kind.has_frames:
        raise InputError(f"a frame goes with a dump; {path} is none")
    if kind is DUMP:
        return read_dump(path, -1 if frame is None else frame)
    if kind is NETCDF:
        return read_netcdf(path)
    if kind is VTP:
        return read_vtp(path)
    if box is None:
        raise InputError(f"{path} is a CSV file, which has no box: give one")
    return read_csv(path, box)
