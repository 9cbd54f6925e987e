"""Particle files of every format: written by their ending, read by their first bytes. A format is one row."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from etc_engine.box import Box
from etc_engine.errors import EtcError, InputError
from etc_engine.particle_files.csv_files import csv_rows, write_csv
from etc_engine.particle_files.dumps import count_frames as count_dump
from etc_engine.particle_files.dumps import dump_rows, write_dump
from etc_engine.particle_files.mercury import count_mercury, is_mercury, mercury_rows
from etc_engine.particle_files.netcdf import netcdf_rows, write_netcdf
from etc_engine.particle_files.sample import Rows, Sample, make_table
from etc_engine.particle_files.streams import read_opening, seekable_copy
from etc_engine.particle_files.table import ParticleTable
from etc_engine.particle_files.vtp import LEGACY, XML, vtk_rows, write_vtp
from etc_engine.particle_files.xyz import count_xyz, is_xyz, xyz_rows
from etc_engine.particle_files.yade import is_yade, yade_rows

Attributes = Mapping[str, Any]
"""Where a packing comes from: seed, command, ..."""


@dataclass(frozen=True, eq=False)
class FileFormat:
    """A format of particle files.

    Parameters
    ----------
    name : str
    recognises : callable
        First bytes of a file, without white space before them -> whether it is of this format.
    rows : callable
        (path, sample) -> rows of one frame.
    brings_box : bool
        Whether the file holds the box.
    count : callable, optional
        path -> number of frames, where a file may hold several.
    endings : tuple of str
        Of the names of files to write; none where the format is only read.
    write : callable, optional
        (path, table, attributes) -> None.
    """

    name: str
    recognises: Callable[[bytes], bool]
    rows: Callable[[Path, Sample], Rows]
    brings_box: bool = True
    count: Callable[[Path], int] | None = None
    endings: tuple[str, ...] = ()
    write: Callable[[Path, ParticleTable, Attributes], None] | None = None

    @property
    def has_frames(self) -> bool:
        """Whether a file may hold several packings."""
        return self.count is not None


DUMP = FileFormat(
    "dump",
    lambda opening: opening.startswith(b"ITEM:"),
    dump_rows,
    count=count_dump,
    endings=(".dump", ".lammpstrj"),
    write=lambda path, table, _: write_dump(path, table),
)
NETCDF = FileFormat(
    "netCDF file",
    lambda opening: opening.startswith((b"\x89HDF", b"CDF")),
    lambda path, _: netcdf_rows(path),
    endings=(".nc",),
    write=write_netcdf,
)
VTP = FileFormat(
    "VTK file",
    lambda opening: opening.startswith(XML),
    vtk_rows,
    endings=(".vtp",),
    write=lambda path, table, _: write_vtp(path, table),
)
LEGACY_VTK = FileFormat("VTK file (legacy)", lambda opening: opening.startswith(LEGACY), vtk_rows, brings_box=False)
YADE = FileFormat("YADE text file", is_yade, yade_rows, brings_box=False)
XYZ = FileFormat("XYZ file", is_xyz, xyz_rows, count=count_xyz)
MERCURY = FileFormat("MercuryDPM data file", is_mercury, mercury_rows, count=count_mercury)
CSV = FileFormat(
    "CSV file",
    lambda _: True,  # whatever nothing else recognises; its reader refuses what is no table
    lambda path, sample: csv_rows(path, sample.radius_column),
    brings_box=False,
    endings=(".csv",),
    write=lambda path, table, _: write_csv(path, table),
)
FORMATS = (DUMP, NETCDF, VTP, LEGACY_VTK, YADE, XYZ, MERCURY, CSV)


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
    known = ", ".join(sorted(ending for candidate in FORMATS for ending in candidate.endings))
    raise InputError(f"packings are written as {known}: found {str(path)!r}")


def format_to_read(path: Path | str) -> FileFormat:
    """Format of a file to read, by its first bytes; CSV where they say nothing else, or there is no such file."""
    opening = read_opening(path).lstrip()
    return next(candidate for candidate in FORMATS if candidate.recognises(opening))


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
    write = format_to_write(path).write
    assert write is not None  # only formats that are written have endings
    write(Path(path), table, attributes or {})


def read_table(
    path: Path | str, box: Box | None = None, frame: int | None = None, sample: Sample | None = None
) -> ParticleTable:
    """Particles of a file in any known format; the content of the file decides the format.

    Parameters
    ----------
    path : path
        LAMMPS or LIGGGHTS dump, CSV or another table of text, netCDF or VTK of this engine, VTK of others, extended
        XYZ, YADE text, MercuryDPM data; text may be compressed by gzip or Zstandard; ``-`` is standard input.
    box : Box, optional
        Needed by a file without a box; replaces the file's.
    frame : int, optional
        Frame of a file with several, from 0; the last one by default.
    sample : Sample, optional
        All that may be said of the wanted part: box, periodic axes, crop, dimension, frame, column of radii.

    Returns
    -------
    ParticleTable

    Raises
    ------
    InputError, GeometryError
        If the file is missing or not understood, or box, crop or frame do not fit it.
    """
    chosen = sample or Sample()
    if box is not None:
        chosen = replace(chosen, box=tuple((0.0, length) for length in box.lengths), periodic=box.periodic_axes)
    if frame is not None:
        chosen = replace(chosen, frame=frame)
    with _named(path) as place:
        kind = format_to_read(place)
        if chosen.frame is not None and not kind.has_frames:
            raise InputError(f"{path} is a {kind.name}, which holds one packing: leave the frame out")
        return make_table(kind.rows(place, chosen), chosen)


def read_rows(path: Path | str, sample: Sample | None = None) -> Rows:
    """Rows of one frame of a file of any known format, without asking for a box.

    Raises
    ------
    InputError
    """
    with _named(path) as place:
        return format_to_read(place).rows(place, sample or Sample())


@contextmanager
def _named(path: Path | str) -> Iterator[Path]:
    """A place to read a file from, any number of times; errors call it by its own name."""
    with seekable_copy(path) as place:
        try:
            yield place
        except EtcError as error:
            if str(place) != str(path):
                name = "standard input" if str(path) == "-" else str(path)
                error.args = (str(error).replace(str(place), name), *error.args[1:])
            raise


def count_frames(path: Path | str) -> int:
    """Number of packings in a file.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    count = format_to_read(path).count
    return 1 if count is None else count(Path(path))
