"""Text dumps of the DEM codes LAMMPS and LIGGGHTS: frames in, a frame out."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np
from numpy.typing import NDArray

from etc_engine.box import AXES, Box
from etc_engine.errors import InputError
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.csv_files import ParticleTable
from etc_engine.particle_files.trajectory import Trajectory

FLAT = 1e-9
"""Centres whose heights differ by less than this part of the largest radius lie in one plane."""


class _Frame(NamedTuple):
    """One frame as it stands in the file."""

    timestep: int
    box_header: list[str]
    box_lines: list[str]
    columns: list[str]
    atoms: list[str]


def read_dump(path: Path | str, frame: int = -1) -> ParticleTable:
    """Particles of one frame of a text dump.

    Parameters
    ----------
    path : path
    frame : int
        Number of the frame from 0; -1 is the last.

    Returns
    -------
    ParticleTable
        Sorted by ``id`` where the dump has one. The box and its periodic axes are the file's (flag ``p`` is
        periodic, ``f``, ``s`` and ``m`` are walls), moved to the origin. Centres in one plane make a
        two-dimensional packing.

    Raises
    ------
    InputError, GeometryError
        If the file is missing or not such a dump, the box is triclinic, positions or a radius (diameter) are
        missing, or there is no such frame.
    """
    path = Path(path)
    frames = list(_frames(path))
    if not -len(frames) <= frame < len(frames):
        held = "1 frame" if len(frames) == 1 else f"{len(frames)} frames"
        raise InputError(f"{path} holds {held}, numbered from 0: there is no frame {frame}")
    return _particles(path, frames[frame])


def count_frames(path: Path | str) -> int:
    """Number of frames of a text dump."""
    return sum(1 for _ in _frames(Path(path)))


def read_trajectory(path: Path | str, timestep: float = 1.0) -> Trajectory:
    """All frames of a text dump: one set of particles that moves.

    Parameters
    ----------
    path : path
    timestep : float [s]
        Time of one step of the code that wrote the dump; the frames' steps times it are their times.

    Returns
    -------
    Trajectory
        Its times start at 0; the conductivities are those of the first frame.

    Raises
    ------
    InputError, GeometryError
        As `read_dump`; also if the particles have no ``id``, or if they, the box or its walls are not the same in
        every frame.

    Notes
    -----
    A box that moves or deforms is refused: its walls would do work that no heat balance here knows of.
    """
    path = Path(path)
    if not (np.isfinite(timestep) and timestep > 0.0):
        raise InputError(f"the time step of a dump must be positive, found {timestep:g}")
    steps, packings = [], []
    conductivity: NDArray[np.float64] | None = None
    ids: NDArray[np.int64] | None = None
    for number, frame in enumerate(_frames(path)):
        table = _particles(path, frame)
        if table.ids is None:
            raise InputError(f"{path}: frame {number} has no column id, by which particles are followed through frames")
        if ids is not None and not np.array_equal(ids, table.ids):
            odd = np.setxor1d(ids, table.ids)
            what = f"particle {odd[0]} is not in both" if odd.size else "ids repeat"
            raise InputError(f"{path}: frame {number} does not hold the particles of frame 0 ({what}): all must stay")
        if ids is None:
            conductivity = table.conductivity
        ids = table.ids
        steps.append(frame.timestep)
        packings.append(table.packing)
    assert ids is not None
    times = timestep * (np.array(steps, dtype=np.float64) - steps[0])
    return Trajectory(times, tuple(packings), ids, conductivity)


def write_dump(path: Path | str, table: ParticleTable, timestep: int = 0) -> None:
    """Write particles as one frame of a LAMMPS text dump, with as many digits as read back the same numbers.

    Raises
    ------
    InputError
        If spheres lie in one plane: a dump does not tell them from disks.
    """
    with Path(path).open("w", encoding="utf-8", newline="\n") as file:
        _write_frame(file, table, timestep)


def write_trajectory(path: Path | str, trajectory: Trajectory, timestep: float = 1.0) -> None:
    """Write a trajectory as frames of a LAMMPS text dump, one a time; `read_trajectory` reads it back.

    Parameters
    ----------
    path : path
    trajectory : Trajectory
    timestep : float [s]
        Time of one step; every time of the trajectory is rounded to a whole number of them.

    Raises
    ------
    InputError
        If two frames come to lie on one step, or as `write_dump`.
    """
    steps = np.rint(trajectory.times / timestep).astype(np.int64)
    if (np.diff(steps) <= 0).any():
        raise InputError(f"a time step of {timestep:g} s puts two frames on one step: write with a smaller one")
    with Path(path).open("w", encoding="utf-8", newline="\n") as file:
        for step, packing in zip(steps.tolist(), trajectory.packings, strict=True):
            _write_frame(file, ParticleTable(packing, trajectory.conductivity, trajectory.ids), step)


def _write_frame(file: TextIO, table: ParticleTable, timestep: int) -> None:
    packing = table.packing
    if packing.dimension == 3 and _is_flat(packing.centers[:, 2], packing.radii):
        raise InputError("spheres at one height would be read from a dump as disks: write .csv, .nc or .vtp instead")
    flags = [("pp" if flag else "ff") for flag in packing.box.periodic]
    lengths = list(packing.box.lengths)
    if packing.dimension == 2:  # LAMMPS keeps a slab of unit height about a plane, periodic across it
        flags, bounds = [*flags, "pp"], [*((0.0, length) for length in lengths), (-0.5, 0.5)]
    else:
        bounds = [(0.0, length) for length in lengths]
    heights = packing.centers[:, 2] if packing.dimension == 3 else np.zeros(packing.count)
    columns = [*packing.centers.T[:2], heights, packing.radii]
    names = "id type x y z radius"
    if table.conductivity is not None:
        columns.append(table.conductivity)
        names += " conductivity"
    ids = np.arange(1, packing.count + 1) if table.ids is None else table.ids
    file.write(f"ITEM: TIMESTEP\n{timestep}\nITEM: NUMBER OF ATOMS\n{packing.count}\n")
    file.write(f"ITEM: BOX BOUNDS {' '.join(flags)}\n")
    file.writelines(f"{low!r} {high!r}\n" for low, high in bounds)
    file.write(f"ITEM: ATOMS {names}\n")
    rows = zip(ids.tolist(), *(column.tolist() for column in columns), strict=True)
    file.writelines(f"{number} 1 {' '.join(map(repr, row))}\n" for number, *row in rows)


def _frames(path: Path) -> Iterator[_Frame]:
    """Frames of the file, one after the other."""
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"there is no file {path}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path} cannot be read as a text dump: {error}") from None
    lines = iter(text.splitlines(keepends=True))
    number = 0
    for line in lines:
        if not line.strip():
            continue
        if line.strip() != "ITEM: TIMESTEP":
            found = line.rstrip()[:40]
            raise InputError(f"{path} is not a LAMMPS text dump: expected 'ITEM: TIMESTEP', found {found!r}")
        try:
            yield _frame(lines)
        except (StopIteration, ValueError, IndexError):
            raise InputError(f"{path}: frame {number} is cut short or malformed") from None
        number += 1
    if not number:
        raise InputError(f"{path} holds no frames")


def _frame(lines: Iterator[str]) -> _Frame:
    timestep = int(next(lines))
    if next(lines).strip() != "ITEM: NUMBER OF ATOMS":
        raise ValueError
    count = int(next(lines))
    box_header = next(lines).split()
    if box_header[:3] != ["ITEM:", "BOX", "BOUNDS"]:
        raise ValueError
    box_lines = [next(lines) for _ in range(3)]
    columns = next(lines).split()
    if columns[:2] != ["ITEM:", "ATOMS"]:
        raise ValueError
    atoms = [next(lines) for _ in range(count)]
    if atoms and not atoms[-1].endswith("\n"):  # a number may have lost its last digits
        raise ValueError
    return _Frame(timestep, box_header[3:], box_lines, columns[2:], atoms)


def _particles(path: Path, frame: _Frame) -> ParticleTable:
    if not frame.atoms:
        raise InputError(f"{path}: the frame at step {frame.timestep} holds no particles")
    if "xy" in frame.box_header:
        raise InputError(f"{path} has a triclinic box; only boxes with right angles are understood")
    bounds = _bounds(path, frame)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # an empty table is refused below, in our words
            values = np.loadtxt(io.StringIO("".join(frame.atoms)), ndmin=2)
    except ValueError as error:
        raise InputError(f"{path}: the frame at step {frame.timestep} is not a table of numbers: {error}") from None
    if len(values) != len(frame.atoms):
        raise InputError(f"{path}: the frame at step {frame.timestep} has {len(frame.atoms) - len(values)} empty lines")
    if values.shape[1] != len(frame.columns):
        raise InputError(f"{path}: {len(frame.columns)} columns are named, {values.shape[1]} found")
    columns = dict(zip(frame.columns, values.T, strict=True))
    ids = None
    if "id" in columns:
        order = np.argsort(columns["id"], kind="stable")
        columns = {name: column[order] for name, column in columns.items()}
        ids = columns["id"].astype(np.int64)
    radii = _radii(path, columns)
    positions = [
        _positions(path, columns, axis, bounds[axis]) for axis in range(3) if axis < 2 or "z" in _spelled(columns)
    ]
    flat = len(positions) == 2 or _is_flat(positions[2], radii)
    dimension = 2 if flat else 3
    box = Box(
        tuple(float(high - low) for low, high in bounds[:dimension]),
        tuple(flag.startswith("p") for flag in (frame.box_header or ["ff"] * 3)[:dimension]),
    )
    centers = np.stack(positions[:dimension], axis=1) - bounds[:dimension, 0]
    return ParticleTable(ParticlePacking(centers, radii, box), columns.get("conductivity"), ids)


def _bounds(path: Path, frame: _Frame) -> NDArray[np.float64]:
    """Lower and upper bound of the box along each axis, shape (3, 2)."""
    try:
        bounds = np.array([[float(word) for word in line.split()[:2]] for line in frame.box_lines])
        valid = bounds.shape == (3, 2) and bool(np.isfinite(bounds).all()) and len(frame.box_header) in (0, 3)
    except ValueError:
        valid = False
    if not valid:
        found = "; ".join(line.strip() for line in frame.box_lines)
        raise InputError(f"{path}: the box at step {frame.timestep} needs two numbers an axis, found {found[:80]!r}")
    return bounds


def _is_flat(heights: NDArray[np.float64], radii: NDArray[np.float64]) -> bool:
    return bool(np.ptp(heights) <= FLAT * radii.max())


def _spelled(columns: dict[str, NDArray[np.float64]]) -> set[str]:
    """Axes for which there is a position column in any spelling."""
    return {axis for axis in AXES for ending in ("", "u", "s", "su") if axis + ending in columns}


def _positions(
    path: Path, columns: dict[str, NDArray[np.float64]], axis: int, bounds: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Coordinates along an axis: ``x``, unwrapped ``xu``, or scaled to the box ``xs``, ``xsu``."""
    name = AXES[axis]
    for ending in ("", "u"):
        if name + ending in columns:
            return columns[name + ending]
    for ending in ("s", "su"):
        if name + ending in columns:
            return bounds[0] + columns[name + ending] * (bounds[1] - bounds[0])
    raise InputError(f"{path} has no column of {name} positions ({name}, {name}u, {name}s); found {', '.join(columns)}")


def _radii(path: Path, columns: dict[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    if "radius" in columns:
        return columns["radius"]
    if "diameter" in columns:
        return 0.5 * columns["diameter"]
    raise InputError(f"{path} has neither a radius nor a diameter column; found {', '.join(columns)}")
