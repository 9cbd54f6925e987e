"""Frames that begin with the number of their rows: extended XYZ, MercuryDPM."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from etc_engine.errors import InputError
from etc_engine.particle_files.columns import ColumnReader, batches, find_layout
from etc_engine.particle_files.items import Block, table_lines
from etc_engine.particle_files.streams import open_stream

LONGEST = 1 << 16
"""No header has more bytes than this."""


@dataclass(frozen=True)
class CountedFrame:
    """A frame: its header lines, the number of its rows and where they stand."""

    number: int
    header: tuple[str, ...]
    count: int
    start: int
    end: int
    complete: bool


def pick_frame(path: Path, kind: str, header_lines: int, frame: int) -> CountedFrame:
    """One frame of a file, by its number from 0 or from the end.

    Raises
    ------
    InputError
        If a header does not begin with a number of rows, or there is no such frame or it is cut short.
    """
    frames: list[CountedFrame] = []
    for found in _frames(path, kind, header_lines):
        frames.append(found)
        if found.number == frame:
            break
    if not -len(frames) <= frame < len(frames):
        held = "1 frame" if len(frames) == 1 else f"{len(frames)} frames"
        raise InputError(f"{path} holds {held}, numbered from 0: there is no frame {frame}")
    if not frames[frame].complete:
        raise InputError(
            f"{path}: frame {frames[frame].number} is cut short or malformed: {frames[frame].count} rows are announced"
        )
    return frames[frame]


def count_counted(path: Path, kind: str, header_lines: int) -> int:
    """Number of frames of a file."""
    return sum(1 for _ in _frames(path, kind, header_lines))


def read_rows(path: Path, frame: CountedFrame, names: Sequence[str], radius_column: str | None) -> ColumnReader:
    """The wanted columns of one frame.

    Raises
    ------
    InputError
    """
    place = f"{path}" if frame.number == 0 else f"{path}, frame {frame.number}"
    if frame.count == 0:
        raise InputError(f"{place} holds no particles")
    reader = ColumnReader(place, find_layout(place, names, radius_column))
    with _lines(path, frame) as lines:
        for batch in batches(lines):
            reader.feed(batch)
    return reader


@contextmanager
def _lines(path: Path, frame: CountedFrame) -> Iterator[Iterator[str]]:
    with open_stream(path) as stream:
        yield table_lines(stream, Block("", (), frame.start, frame.end))


def _frames(path: Path, kind: str, header_lines: int) -> Iterator[CountedFrame]:
    number = position = 0
    with open_stream(path) as stream:
        while True:
            header: list[str] = []
            while len(header) < header_lines:
                line = stream.readline(LONGEST)
                if not line:
                    break
                position += len(line)
                if header or line.strip():
                    header.append(line.decode("utf-8", errors="replace").strip())
            if not header:
                break
            try:
                count = int(float(header[0].split()[0]))
            except (ValueError, OverflowError):
                count = -1
            if count < 0 or len(header) < header_lines:
                raise InputError(
                    f"{path}: frame {number} of this {kind} file must begin with the number of its rows, found "
                    f"{header[0][:40]!r}"
                )
            start, rows, ended = position, 0, True
            for line in islice(stream, min(count, sys.maxsize)):
                position += len(line)
                rows, ended = rows + 1, line.endswith(b"\n")
            yield CountedFrame(number, tuple(header), count, start, position, rows == count and ended)
            number += 1
    if not number:
        raise InputError(f"{path} holds no particles")
