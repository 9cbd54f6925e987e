"""Text dumps of the DEM codes LAMMPS and LIGGGHTS: frames in, a frame out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from etc_engine.arrays import Floats, Ints
from etc_engine.box import AXES
from etc_engine.errors import InputError
from etc_engine.particle_files.columns import BATCH, ColumnReader, batches, find_layout
from etc_engine.particle_files.digits import PrintedColumn, PrintedColumns
from etc_engine.particle_files.items import Block, Frame, find_frames, table_lines
from etc_engine.particle_files.sample import Rows, Sample, make_table
from etc_engine.particle_files.streams import open_stream
from etc_engine.particle_files.table import ParticleTable
from etc_engine.particle_files.trajectory import Trajectory

REMEDY = "write the dump with 'dump_modify ID format float %.17g'"
UNITS = {
    "si": 1.0,
    "cgs": 1e-2,
    "micro": 1e-6,
    "nano": 1e-9,
    "real": 1e-10,
    "metal": 1e-10,
    "electron": 5.29177210544e-11,
    "lj": 1.0,
}
"""Metres per unit of length of the unit styles of LAMMPS (manual page ``units``; Bohr radius of CODATA 2022)."""


def read_dump(path: Path | str, frame: int = -1, sample: Sample | None = None) -> ParticleTable:
    """Particles of one frame of a text dump.

    Parameters
    ----------
    path : path
        Plain, gzip or Zstandard.
    frame : int
        Number of the frame from 0; -1 is the last.
    sample : Sample, optional
        Box, periodic axes, crop, dimension and column of radii, where they are not the file's.

    Returns
    -------
    ParticleTable
        Sorted by ``id`` where the dump has one. The box and its periodic axes are the file's (flag ``p`` is
        periodic, ``f``, ``s`` and ``m`` are walls), moved to the origin.

    Raises
    ------
    InputError, GeometryError
        If the file is missing or not such a dump, the box is tilted, positions or a radius (diameter) are missing, the
        particles are no spheres, or there is no such frame.

    Notes
    -----
    The box decides on the dimension. A box that is periodic along z and holds z = 0 is that of a two-dimensional run
    if all heights are 0; every other box with heights holds spheres. Only the wanted frame and columns are kept in
    memory.
    """
    chosen = replace(sample or Sample(), frame=frame)
    return make_table(dump_rows(Path(path), chosen), chosen)


def dump_rows(path: Path, sample: Sample) -> Rows:
    """Rows of one frame of a text dump.

    Raises
    ------
    InputError
    """
    frame = -1 if sample.frame is None else sample.frame
    chosen, scale = choose_frame(path, find_frames(path, frame if frame >= 0 else None), frame)
    return frame_rows(path, chosen, scale, sample.radius_column)


def choose_frame(path: Path, frames: list[Frame], number: int) -> tuple[Frame, float]:
    """The frame of a number, and metres per unit of length of the dump.

    Raises
    ------
    InputError
        If there is no such frame, or the units are unknown.
    """
    if not -len(frames) <= number < len(frames):
        held = "1 frame" if len(frames) == 1 else f"{len(frames)} frames"
        raise InputError(f"{path} holds {held}, numbered from 0: there is no frame {number}")
    return frames[number], _scale(path, frames)


def count_frames(path: Path | str) -> int:
    """Number of frames of a text dump."""
    return len(find_frames(Path(path)))


def read_trajectory(path: Path | str, timestep: float = 1.0, sample: Sample | None = None) -> Trajectory:
    """All frames of a text dump: one set of particles that moves.

    Parameters
    ----------
    path : path
    timestep : float [s]
        Time of one step of the code that wrote the dump; the frames' steps times it are their times.
    sample : Sample, optional
        As of `read_dump`; no crop.

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
    A box that moves or deforms is refused: the heat balance does not include the work of its walls.
    """
    path = Path(path)
    if not (np.isfinite(timestep) and timestep > 0.0):
        raise InputError(f"the time step of a dump must be positive, found {timestep:g}")
    chosen = sample or Sample()
    steps: list[int] = []
    tables: list[ParticleTable] = []
    frames = find_frames(path)
    for frame in frames:
        rows = frame_rows(path, frame, _scale(path, frames), chosen.radius_column)
        table = make_table(rows, chosen)
        ids = table.ids
        if ids is None:
            raise InputError(
                f"{path}: frame {frame.number} has no column id, by which particles are followed through frames"
            )
        if tables:
            _refuse_others(path, frame.number, ids, tables[0].ids)
        steps.append(_step(path, frame))
        tables.append(table)
    first = tables[0]
    times = timestep * (np.array(steps, dtype=np.float64) - steps[0])
    return Trajectory(times, tuple(table.packing for table in tables), first.ids, first.conductivity, tuple(tables))


def _refuse_others(path: Path, number: int, ids: Ints, first: Ints | None) -> None:
    """Refuse a frame that does not hold the particles of the first one."""
    assert first is not None
    if np.array_equal(ids, first):
        return
    odd = np.setxor1d(ids, first)
    what = f"particle {odd[0]} is not in both" if odd.size else "ids repeat"
    if ids.size != first.size:
        what += f"; {ids.size} particles instead of {first.size}"
    raise InputError(
        f"{path}: frame {number} does not hold the particles of frame 0 ({what}): all must stay; "
        "write the frames of a part of the run, or of a group of particles that stay"
    )


def write_dump(path: Path | str, table: ParticleTable, timestep: int = 0) -> None:
    """Write particles as one frame of a LAMMPS text dump, with as many digits as read back the same numbers.

    Notes
    -----
    Disks are written as LAMMPS does in two dimensions: heights 0 in a slab of unit height about z = 0.
    """
    with Path(path).open("w", encoding="utf-8", newline="\n") as file:
        _write_frame(file, table, timestep)


def write_trajectory(path: Path | str, trajectory: Trajectory, timestep: float = 1.0) -> None:
    """Write a trajectory as frames of a LAMMPS text dump, one per time; `read_trajectory` reads it back.

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
    types = ["1"] * packing.count if table.types is None else table.types.tolist()
    rows = zip(ids.tolist(), types, *(column.tolist() for column in columns), strict=True)
    file.writelines(f"{number} {kind} {' '.join(map(repr, row))}\n" for number, kind, *row in rows)


def frame_rows(path: Path, frame: Frame, scale: float = 1.0, radius_column: str | None = None) -> Rows:
    """Rows of one frame, sorted by id, in metres.

    Raises
    ------
    InputError
        If the frame is cut short, or its box or table is not understood.
    """
    place, block, count = frame_table(path, frame)
    reader = ColumnReader(place, find_layout(place, block.words, radius_column))
    with open_stream(path) as stream:
        found = 0
        for lines in batches(table_lines(stream, block)):
            if reader.rows + len(lines) > count:
                lines = _without_blank_end(lines, count - reader.rows)  # noqa: PLW2901
            if reader.rows + len(lines) == count and not lines[-1].endswith("\n"):
                raise InputError(
                    f"{path}: frame {frame.number} is cut short or malformed: its last line has no end, "
                    "so a number may have lost digits"
                )
            found = reader.rows + len(lines)
            if found > count or (found < count and len(lines) < BATCH):
                break
            reader.feed(lines)
    if reader.rows != count:
        raise InputError(
            f"{path}: frame {frame.number} is cut short or malformed: {count} particles are announced, {found} found"
        )
    return sorted_rows(place, frame, reader, scale)


def frame_table(path: Path, frame: Frame) -> tuple[str, Block, int]:
    """Name of a frame for messages, its block of atoms, and how many it announces.

    Raises
    ------
    InputError
        If something is missing, or there are none.
    """
    place = f"{path}" if frame.number == 0 else f"{path}, frame {frame.number}"
    block = frame.blocks.get("ATOMS")
    _step(path, frame)
    if block is None or "BOX BOUNDS" not in frame.blocks:
        _refuse_incomplete(path, frame)
        raise AssertionError  # the call above raises
    try:
        count = frame.number_of("NUMBER OF ATOMS")
    except ValueError:
        raise InputError(f"{path}: frame {frame.number} is cut short or malformed") from None
    if count == 0:
        raise InputError(f"{place} holds no particles")
    return place, block, count


def _without_blank_end(lines: list[str], most: int) -> list[str]:
    """The lines without blank ones after the last row."""
    return lines[: max(most, 0)] if not "".join(lines[max(most, 0) :]).strip() else lines


def sorted_rows(place: str, frame: Frame, reader: ColumnReader, scale: float) -> Rows:
    """What a reader found in a frame, sorted by id, in metres; arguments and errors as of `frame_rows`."""
    bounds, periodic = _box(place, frame)
    layout = reader.layout
    radii = reader.column("radius")
    assert radii is not None
    positions = reader.positions()
    for axis in np.flatnonzero(layout.scaled):
        low, high = bounds[axis]
        positions[:, axis] = low + positions[:, axis] * (high - low)
    columns: dict[str, Any] = {
        "ids": reader.ids(),
        "types": reader.types(),
        "conductivity": reader.column("conductivity"),
        "temperature": reader.column("temperature"),
    }
    order = slice(None) if columns["ids"] is None else np.argsort(columns["ids"], kind="stable")
    notes: tuple[str, ...] = ()
    if scale != 1.0:
        notes = (f"lengths are converted to metres from the units of the dump (1 = {scale:g} m)",)
    return Rows(
        place=place,
        positions=scale * positions[order],
        radii=(0.5 * scale if layout.halved else scale) * radii[order],
        bounds=scale * bounds,
        periodic=periodic,
        printed=_printed(reader, bounds, scale),
        scale=scale,
        notes=notes,
        **{name: None if values is None else values[order] for name, values in columns.items()},
    )


def _printed(reader: ColumnReader, bounds: Floats, scale: float) -> PrintedColumns | None:
    """How finely positions and radii are printed, scaled positions in parts of the box."""
    digits = reader.digits()
    if digits is None:
        return None
    positions = []
    for axis, scaled in enumerate(reader.layout.scaled):
        low, high = bounds[axis]
        factor, offset = ((high - low) * scale, low * scale) if scaled else (scale, 0.0)
        positions.append(PrintedColumn(digits[AXES[axis]], factor, offset))
    radius = PrintedColumn(digits["radius"], (0.5 if reader.layout.halved else 1.0) * scale)
    return PrintedColumns(tuple(positions), radius, REMEDY)


def _refuse_incomplete(path: Path, frame: Frame) -> None:
    if "ENTRIES" in frame.blocks:
        raise InputError(
            f"{path} is a dump of contacts (ITEM: ENTRIES), not of particles: give the dump of the particles, "
            "and this one with --contacts"
        )
    raise InputError(f"{path}: frame {frame.number} is cut short or malformed")


def _step(path: Path, frame: Frame) -> int:
    if "TIMESTEP" not in frame.blocks:
        found = next(iter(frame.blocks), "")
        raise InputError(f"{path} is not a LAMMPS text dump: expected 'ITEM: TIMESTEP', found 'ITEM: {found}'")
    try:
        return frame.number_of("TIMESTEP")
    except ValueError:
        raise InputError(f"{path}: frame {frame.number} is cut short or malformed") from None


def _scale(path: Path, frames: list[Frame]) -> float:
    """Metres per unit of length; LAMMPS names its units in the first frame only."""
    block = next((frame.blocks["UNITS"] for frame in frames if "UNITS" in frame.blocks), None)
    if block is None:
        return 1.0
    style = block.lines[0].strip() if block.lines else ""
    if style not in UNITS:
        raise InputError(f"{path}: the units {style!r} are unknown, expected one of {', '.join(UNITS)}")
    return UNITS[style]


def _box(place: str, frame: Frame) -> tuple[Floats, tuple[bool, ...]]:
    """Faces of the box, shape (3, 2), and its periodic axes; a tilted box is refused."""
    block = frame.blocks["BOX BOUNDS"]
    words = list(block.words)
    if words[:2] == ["abc", "origin"]:
        raise InputError(
            f"{place} has a general triclinic box; only boxes with right angles along x, y, z are understood"
        )
    tilted = words[:3] == ["xy", "xz", "yz"]
    flags = (words[3:] if tilted else words) or ["ff"] * 3
    width = 3 if tilted else 2
    try:
        numbers = np.array([[float(word) for word in line.split()[:width]] for line in block.lines[:3]])
        valid = numbers.shape == (3, width) and bool(np.isfinite(numbers).all()) and len(flags) == 3
    except ValueError:
        valid = False
    if not valid:
        found = "; ".join(line.strip() for line in block.lines[:3])
        raise InputError(f"{place}: the box needs {width} numbers per axis, found {found[:80]!r}")
    bounds = numbers[:, :2]
    if tilted and numbers[:, 2].any():
        tilts = ", ".join(f"{name} = {value:g}" for name, value in zip(words, numbers[:, 2].tolist(), strict=False))
        raise InputError(f"{place} has a tilted (triclinic) box ({tilts}); only boxes with right angles are understood")
    return bounds, tuple(flag.startswith("p") for flag in flags)
