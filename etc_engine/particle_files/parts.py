"""Particle files read by many ranks: each rank reads and keeps its part of the rows, no rank the whole file.

A text file is cut at bytes: a rank takes the lines that begin between its two cuts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from etc_engine.errors import InputError
from etc_engine.particle_files.columns import ColumnReader, Layout, batches, find_layout
from etc_engine.particle_files.csv_files import content_lines, part_of_table, table_header, table_layout
from etc_engine.particle_files.dumps import choose_frame, frame_table, sorted_rows
from etc_engine.particle_files.formats import CSV, DUMP, NETCDF, format_to_read
from etc_engine.particle_files.items import Frame, blocks_at, frames_of
from etc_engine.particle_files.netcdf import check_netcdf, netcdf_part
from etc_engine.particle_files.sample import Rows, Sample
from etc_engine.particle_files.streams import GZIP, ZSTANDARD
from etc_engine.ranks import Ranks, together

PIECE = 1 << 24
"""Bytes that are searched for frames at once."""
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

    def reader() -> Callable[[Path, Sample, Ranks], Rows]:
        if not path.is_file():
            raise InputError(f"there is no file {path} that many ranks can read")
        with path.open("rb") as stream:
            opening = stream.read(4)
        if opening.startswith((GZIP, ZSTANDARD)):
            raise InputError(f"{path} is compressed, and cannot be read in parts by many ranks: decompress it first")
        kind = format_to_read(path)
        if kind.name not in READERS:
            raise InputError(
                f"{path} is a {kind.name}, which is read whole: --distributed takes {', '.join(READERS)}; rewrite it"
            )
        if sample.frame is not None and not kind.has_frames:
            raise InputError(f"{path} is a {kind.name}, which holds one packing: leave the frame out")
        return READERS[kind.name]

    return together(ranks, reader)(path, sample, ranks)


def _dump_part(path: Path, sample: Sample, ranks: Ranks) -> Rows:
    """Part of one frame of a text dump."""
    number = -1 if sample.frame is None else sample.frame
    size = path.stat().st_size
    found = together(ranks, lambda: _item_starts(path, *_cuts(0, size, ranks)))
    starts = [start for each in ranks.share(found) for start in each]

    def read() -> tuple[Frame, Rows, int, int]:
        frames = frames_of(path, blocks_at(path, starts, size))
        frame, scale = choose_frame(path, frames, number)
        place, block, count = frame_table(path, frame)
        reader = ColumnReader(place, _slim(find_layout(place, block.words, sample.radius_column)))
        lines = (line.decode("utf-8", errors="replace") for line in _lines(path, *_cuts(block.start, block.end, ranks)))
        last = ""
        for batch in batches(line for line in lines if line.strip()):
            reader.feed(batch)
            last = batch[-1]
        if ranks.rank == ranks.size - 1 and last and not last.endswith("\n"):
            raise InputError(
                f"{path}: frame {frame.number} is cut short or malformed: its last line has no end, "
                "so a number may have lost digits"
            )
        return frame, sorted_rows(place, frame, reader, scale), count, reader.rows

    frame, rows, announced, own = together(ranks, read)
    total = sum(ranks.share(own))
    if total != announced:
        raise InputError(
            f"{path}: frame {frame.number} is cut short or malformed: {announced} particles are announced, "
            f"{total} found"
        )
    return rows


def _csv_part(path: Path, sample: Sample, ranks: Ranks) -> Rows:
    """Part of a table of text with a header."""

    def read() -> Rows:
        with path.open("rb") as stream:
            raw: list[bytes] = []

            def kept() -> Iterator[bytes]:
                for line in stream:
                    raw.append(line)
                    yield line

            line, header = next(content_lines(path, kept()), (0, ""))
            if not header:
                raise InputError(f"{path} is empty: expected a header such as 'x,y,radius'")
        names, separator = table_header(path, line, header)
        layout = _slim(table_layout(path, names, sample.radius_column))
        cuts = _cuts(sum(map(len, raw)), path.stat().st_size, ranks)
        return part_of_table(path, layout, separator, content_lines(path, _lines(path, *cuts)))

    rows = together(ranks, read)
    if not sum(ranks.share(rows.radii.size)):
        raise InputError(f"{path} holds no particles, only a header")
    return rows


def _netcdf_part(path: Path, _: Sample, ranks: Ranks) -> Rows:
    """Part of a netCDF file."""
    together(ranks, lambda: check_netcdf(path) if ranks.rank == 0 else None)
    rows = together(ranks, lambda: netcdf_part(path, ranks.rank, ranks.size))
    return replace(rows, ids=None, types=None)


READERS: Mapping[str, Callable[[Path, Sample, Ranks], Rows]] = {
    DUMP.name: _dump_part,
    CSV.name: _csv_part,
    NETCDF.name: _netcdf_part,
}
"""How each format is read in parts; the others are read whole."""


def _slim(layout: Layout) -> Layout:
    """A layout without the columns that are not kept."""
    return replace(layout, others={name: column for name, column in layout.others.items() if name in WANTED})


def _cuts(start: int, end: int, ranks: Ranks) -> tuple[int, int]:
    """The bytes between ``start`` and ``end`` that belong to this rank."""
    return tuple(start + (end - start) * (ranks.rank + k) // ranks.size for k in (0, 1))  # type: ignore[return-value]


def _lines(path: Path, start: int, end: int) -> Iterator[bytes]:
    """Lines of a file that begin at the bytes from ``start`` to ``end``."""
    with path.open("rb") as stream:
        stream.seek(max(start - 1, 0))
        position = stream.tell()
        if start > 0:
            position += len(stream.readline())  # the end of the line before, alone if one begins at ``start``
        while position < end:
            line = stream.readline()
            if not line:
                return
            position += len(line)
            yield line


def _item_starts(path: Path, start: int, end: int) -> list[int]:
    """Bytes from ``start`` to ``end`` at which a line begins with ``ITEM:``."""
    mark, found = b"ITEM:", []
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
