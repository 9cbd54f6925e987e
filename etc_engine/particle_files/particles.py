"""Particles of a file as a packing, for Python."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from pathlib import Path

from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.formats import read_table
from etc_engine.particle_files.sample import Range, Sample

COLUMNS = ("conductivity", "ids", "types", "temperature")
"""Columns of a file beside positions and radii."""


def read_particles(
    path: Path | str,
    box: tuple[float | Range, ...] | None = None,
    periodic: str | None = None,
    *,
    crop: tuple[Range | None, ...] = (),
    dimension: int | None = None,
    frame: int | None = None,
) -> ParticlePacking:
    """Packing of a particle file of any known format.

    Parameters
    ----------
    path : path
        LAMMPS or LIGGGHTS dump, CSV or another table of text, netCDF or VTK of this engine, VTK of others, extended
        XYZ, YADE text, MercuryDPM data. Text may be compressed by gzip or Zstandard.
    box : tuple of float or of (low, high), optional [m]
        Edge lengths or faces along each axis. It replaces the box of the file. A file without a box needs it.
    periodic : str, optional
        Periodic axes, such as ``"xy"``. It replaces what the file says.
    crop : tuple of (low, high) or None [m]
        Part of each axis to keep; None keeps all of it. Empty keeps everything.
    dimension : int, optional
        2 for disks, 3 for spheres, where the file does not say.
    frame : int, optional
        Number of the frame, from 0. By default the last.

    Returns
    -------
    ParticlePacking
        Its ``columns`` hold what the file has of ``conductivity`` [W/(m K)], ``ids``, ``types`` and ``temperature``
        [K], a row for each particle. Every function that takes a packing takes it.

    Raises
    ------
    InputError, GeometryError
        If the file is missing or not understood, or box, crop or frame do not fit it.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "two.csv"
    ...     _ = path.write_text("x,y,radius,conductivity\\n0.25,0.5,0.25,2\\n0.75,0.5,0.25,3\\n")
    ...     packing = read_particles(path, box=(1.0, 1.0))
    >>> packing
    <ParticlePacking: 2 disks, density 0.3927, box 1 x 1 m, walls, columns conductivity>
    >>> packing.columns["conductivity"]
    array([2., 3.])
    """
    faces = None if box is None else tuple((-inf, edge) if isinstance(edge, (int, float)) else edge for edge in box)
    kept = tuple((-inf, inf) if part is None else part for part in crop)
    table = read_table(path, sample=Sample(faces, periodic, kept, dimension, frame))
    found = {name: getattr(table, name) for name in COLUMNS}
    return replace(table.packing, columns={name: values for name, values in found.items() if values is not None})
