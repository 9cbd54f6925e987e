"""Particle files read by many ranks: each rank reads and keeps its part of the rows, no rank the whole file.

A text file is cut at bytes: a rank takes the lines that begin between its two cuts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from io import BytesIO
from itertools import chain
from pathlib import Path
from typing import BinaryIO

import numpy as np

from etc_engine.errors import InputError
from etc_engine.particle_files.columns import ColumnReader, Layout, batches, find_layout
from etc_engine.particle_files.csv_files import numbered_lines, part_of_table, table_layout, table_opening
from etc_engine.particle_files.dumps import choose_frame, frame_table, sorted_rows
from etc_engine.particle_files.formats import CSV, DUMP, NETCDF, format_to_read
from etc_engine.particle_files.items import blocks_at, frames_of
from etc_engine.particle_files.netcdf import check_netcdf, netcdf_part
from etc_engine.particle_files.sample import Rows, Sample
from etc_engine.particle_files.streams import GZIP, ZSTANDARD, line_blocks
from etc_engine.ranks import Alone, Ranks, together

PIECE = 1 << 24
"""Bytes that are searched, or read, at once."""
WANTED = ("conductivity",)
"""Columns beside positions and radii that are kept."""


def read_part(path: Path, sample: Sample, ranks: Ranks) -> Rows:
    """The rows of a particle file that this rank reads: about one of ``ranks.size`` equal parts of them.

    Parameters
    ----------
    path : Path
        A dump of LAMMPS or LIGGGHTS, a table of text (CSV), or a netCDF file of this engine; not compressed.
    sample : Sample
        Frame and column of radii; box and crop are not applied here.
    ranks : Ranks
        Every rank makes this call.

    Returns
    -------
    Rows
        Without ids and types.

    Raises
    ------
    InputError
        On every rank, if the file is missing, not understood on one of them, or of a format that is read whole.
    """

    reader = together(ranks, lambda: _find_reader(path, sample, check=ranks.rank == 0))
    found = together(ranks, lambda: _frame_marks(path, reader, ranks.rank, ranks.size))
    starts = [start for each in ranks.share(found) for start in each]

    def read() -> tuple[Rows, int | None]:
        table = reader(path, sample, starts)
        return table.read(ranks.rank, ranks.size), table.announced

    rows, announced = together(ranks, read)
    total = sum(ranks.share(rows.radii.size))
    _check_total(rows.place, announced, total)
    return rows


def read_extremes(path: Path, sample: Sample) -> Rows:
    """Two rows that stand for all rows of a file, as `extremes` makes them, read piece by piece by one process.

    Parameters
    ----------
    path, sample
        As of `read_part`.

    Returns
    -------
    Rows
        Its ``conductivity`` is not None where the file has such a column.

    Raises
    ------
    InputError
    """
    reader = _find_reader(path, sample, check=True)
    table = reader(path, sample, _frame_marks(path, reader, 0, 1))
    pieces = 1 + path.stat().st_size // PIECE
    rows, total = None, 0
    for number in range(pieces):
        piece = table.read(number, pieces)
        total += piece.radii.size
        if piece.radii.size:
            rows = extremes(piece if rows is None else _joined(rows, piece), Alone())
            rows = replace(rows, conductivity=None if piece.conductivity is None else np.zeros(2))
    _check_total(str(path), table.announced, total)
    assert rows is not None
    return rows


def _joined(rows: Rows, piece: Rows) -> Rows:
    return replace(
        piece,
        positions=np.concatenate([rows.positions, piece.positions]),
        radii=np.concatenate([rows.radii, piece.radii]),
    )


@dataclass(frozen=True)
class _Table:
    """A table that is read in parts.

    Parameters
    ----------
    read : callable
        (number of the part, of how many) -> its rows.
    announced : int or None
        Rows that the file says it has.
    """

    read: Callable[[int, int], Rows]
    announced: int | None = None


Reader = Callable[[Path, Sample, Sequence[int]], _Table]
"""(path, sample, bytes at which lines begin with ``ITEM:``) -> table."""


def _find_reader(path: Path, sample: Sample, *, check: bool) -> Reader:
    """How a file is read in parts; one that is read whole is refused, and where ``check`` a damaged netCDF file."""
    if not path.is_file():
        raise InputError(f"there is no file {path} that many ranks can read")
    with path.open("rb") as stream:
        opening = stream.read(4)
    if opening.startswith((GZIP, ZSTANDARD)):
        raise InputError(f"{path} is compressed, and cannot be read in parts by many ranks: decompress it first")
    kind = format_to_read(path)
    if kind.name not in READERS:
        raise InputError(f"{path} is a {kind.name}, which is read whole: many ranks read {', '.join(READERS)}")
    if sample.frame is not None and not kind.has_frames:
        raise InputError(f"{path} is a {kind.name}, which holds one packing: leave the frame out")
    if check and kind is NETCDF:
        check_netcdf(path)
    return READERS[kind.name]


def _check_total(place: str, announced: int | None, found: int) -> None:
    if announced is not None and found != announced:
        raise InputError(f"{place} is cut short or malformed: {announced} particles are announced, {found} found")
    if found == 0:
        raise InputError(f"{place} holds no particles, only a header")


def _dump_table(path: Path, sample: Sample, starts: Sequence[int]) -> _Table:
    """One frame of a text dump."""
    frames = frames_of(path, blocks_at(path, starts, path.stat().st_size))
    frame, scale = choose_frame(path, frames, -1 if sample.frame is None else sample.frame)
    place, block, count = frame_table(path, frame)
    layout = _slim(find_layout(place, block.words, sample.radius_column))

    def read(part: int, parts: int) -> Rows:
        reader, last = ColumnReader(place, layout), ""
        blocks = _blocks(path, *_cuts(block.start, block.end, part, parts))
        raw = chain.from_iterable(map(BytesIO, blocks))
        lines = (line.decode("utf-8", errors="replace") for line in raw)
        for batch in batches(line for line in lines if line.strip()):
            reader.feed(batch)
            last = batch[-1]
        if last and not last.endswith("\n"):
            raise InputError(
                f"{path}: frame {frame.number} is cut short or malformed: its last line has no end, "
                "so a number may have lost digits"
            )
        return sorted_rows(place, frame, reader, scale)

    return _Table(read, count)


def _csv_table(path: Path, sample: Sample, __: Sequence[int]) -> _Table:
    """A table of text with a header."""
    raw: list[bytes] = []

    def kept(stream: BinaryIO) -> Iterator[bytes]:
        for line in stream:
            raw.append(line)
            yield line

    with path.open("rb") as stream:
        names, separator, _ = table_opening(path, kept(stream))
    layout = _slim(table_layout(path, names, sample.radius_column))
    start, end = sum(map(len, raw)), path.stat().st_size

    def read(part: int, parts: int) -> Rows:
        blocks = _blocks(path, *_cuts(start, end, part, parts))
        return part_of_table(path, layout, separator, numbered_lines(path, blocks))

    return _Table(read)


def _netcdf_table(path: Path, _: Sample, __: Sequence[int]) -> _Table:
    """A netCDF file."""

    def read(part: int, parts: int) -> Rows:
        return replace(netcdf_part(path, part, parts), ids=None, types=None)

    return _Table(read)


READERS: Mapping[str, Reader] = {DUMP.name: _dump_table, CSV.name: _csv_table, NETCDF.name: _netcdf_table}
"""How each format is read in parts; the others are read whole."""


def _slim(layout: Layout) -> Layout:
    """A layout without the columns that are not kept."""
    return replace(layout, others={name: column for name, column in layout.others.items() if name in WANTED})


def _cuts(start: int, end: int, part: int, parts: int) -> tuple[int, int]:
    """The bytes between ``start`` and ``end`` that belong to one of several parts."""
    return start + (end - start) * part // parts, start + (end - start) * (part + 1) // parts


def _blocks(path: Path, start: int, end: int) -> Iterator[bytes]:
    """The lines of a file that begin at the bytes from ``start`` to ``end``, in blocks."""
    with path.open("rb") as stream:
        stream.seek(max(start - 1, 0))
        if start > 0:
            stream.readline()  # the end of the line before, alone if one begins at ``start``
        yield from line_blocks(stream, end - stream.tell())


def _frame_marks(path: Path, reader: Reader, part: int, parts: int) -> list[int]:
    """Bytes of one part of a dump at which a line begins with ``ITEM:``; none in files without frames."""
    mark, found = b"ITEM:", list[int]()
    if reader is not _dump_table:
        return found
    start, end = _cuts(0, path.stat().st_size, part, parts)
    with path.open("rb") as stream:
        for first in range(start, end, PIECE):
            stream.seek(max(first - 1, 0))
            lead = first - max(first - 1, 0)  # the byte before, which says whether a line begins
            piece = stream.read(lead + min(PIECE, end - first) + len(mark) - 1)
            place = piece.find(mark, lead)
            while place >= 0:
                if first - lead + place == 0 or piece[place - 1 : place] == b"\n":
                    found.append(first - lead + place)
                place = piece.find(mark, place + 1)
    return found


def extremes(rows: Rows, ranks: Ranks) -> Rows:
    """Two rows that stand for all rows of all ranks: lowest and highest position, smallest and largest radius.

    What decides on the dimension and the box of a file depends on these alone.

    Raises
    ------
    InputError
        On every rank, if a position is not finite.
    """
    columns = np.column_stack([rows.positions, rows.radii])

    def own() -> np.ndarray:
        bad = ~np.isfinite(columns).all(axis=1)
        if bad.any():
            found = columns[np.flatnonzero(bad)[0]].tolist()
            raise InputError(f"{rows.place}: a particle has a centre or a radius that is not finite: found {found}")
        return np.stack([columns.min(axis=0, initial=np.inf), columns.max(axis=0, initial=-np.inf)])

    every = np.stack(ranks.share(together(ranks, own)))
    ends = np.stack([every[:, 0].min(axis=0), every[:, 1].max(axis=0)])
    return replace(rows, positions=ends[:, :-1], radii=ends[:, -1], conductivity=None, ids=None, types=None)
