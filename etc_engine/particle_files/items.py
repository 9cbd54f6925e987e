"""ITEM blocks of the text dumps of LAMMPS and LIGGGHTS: where the frames of a file stand, and their lines.

A first pass notes where each block begins, a second one reads the lines of the frame that is wanted. So a file of
many frames takes the memory of one.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from etc_engine.errors import InputError
from etc_engine.particle_files.streams import BOM, open_stream, skip

LONGEST, HEADER = 8, 4096
"""Lines of a short block, and bytes of one of its lines, that are kept."""
TABLES = ("ATOMS", "ENTRIES")
FIRST = ("UNITS", "TIME", "TIMESTEP")
"""Blocks that may begin a frame."""
SHORT = ("UNITS", "TIME", "TIMESTEP", "NUMBER OF ATOMS", "NUMBER OF ENTRIES", "BOX BOUNDS")
"""Blocks of a few lines, kept when the frames are found."""


@dataclass(frozen=True)
class Block:
    """One ITEM block: its name, the words after it, and where its lines stand.

    Parameters
    ----------
    name : str
    words : tuple of str
        What follows the name on its line, such as the flags of the box or the names of columns.
    start, end : int
        First byte of its lines, and the byte after them, in the uncompressed file.
    lines : tuple of str
        Its lines, where it is short.
    """

    name: str
    words: tuple[str, ...]
    start: int
    end: int
    lines: tuple[str, ...] = ()


@dataclass(frozen=True)
class Frame:
    """Blocks of one frame, by name."""

    number: int
    blocks: dict[str, Block] = field(default_factory=dict)

    @property
    def table(self) -> Block | None:
        """The block of atoms or entries, where there is one."""
        return next((self.blocks[name] for name in TABLES if name in self.blocks), None)

    def number_of(self, name: str) -> int:
        """The whole number in a short block.

        Raises
        ------
        ValueError
            If the block is missing or holds something else.
        """
        block = self.blocks.get(name)
        if block is None or not block.lines:
            raise ValueError(name)
        return int(block.lines[0])


def find_frames(path: Path, wanted: int | None = None) -> list[Frame]:
    """Frames of a dump, without the lines of their tables.

    Parameters
    ----------
    path : Path
    wanted : int, optional
        Number of the last frame that matters, from 0; what comes after it is not looked at.

    Raises
    ------
    InputError
        If the file is no such dump.
    """
    with open_stream(path) as stream:
        return frames_of(path, _blocks(path, stream), wanted)


def frames_of(path: Path, blocks: Iterable[Block], wanted: int | None = None) -> list[Frame]:
    """Blocks of a dump, in their order, as frames; arguments and errors as of `find_frames`."""
    frames: list[Frame] = []
    for block in blocks:
        units = block.name in FIRST and bool(frames) and frames[-1].table is not None
        if not frames or block.name in frames[-1].blocks or units:
            if wanted is not None and len(frames) > wanted:
                return frames
            frames.append(Frame(len(frames)))
        frames[-1].blocks[block.name] = block
    if not frames:
        raise InputError(f"{path} holds no frames")
    if frames[-1].table is None and set(frames[-1].blocks) <= set(FIRST) - {"TIMESTEP"}:
        frames.pop()
    return frames


def table_lines(stream: BinaryIO, block: Block) -> Iterator[str]:
    """Lines of a table, from a stream that has just been opened."""
    skip(stream, block.start)
    left = block.end - block.start
    while left > 0:
        line = stream.readline(left)
        if not line:
            return
        left -= len(line)
        yield line.decode("utf-8", errors="replace")


def blocks_at(path: Path, starts: Iterable[int], end: int) -> Iterator[Block]:
    """Blocks of an uncompressed dump whose ITEM lines begin at known bytes.

    Parameters
    ----------
    path : Path
    starts : iterable of int
        In ascending order.
    end : int
        Bytes of the file.
    """
    begins = list(starts)
    with open_stream(path) as stream:
        for begin, after in zip(begins, [*begins[1:], end], strict=True):
            stream.seek(begin)
            header = stream.readline()
            lines = [stream.readline(HEADER) for _ in range(LONGEST)] if b" ATOMS" not in header[:12] else []
            held: list[bytes] = []
            first = begin + len(header)
            for line in lines:
                if first + sum(map(len, held)) + len(line) > after:
                    break
                held.append(line)
            text = [line.decode("utf-8", errors="replace") for line in held]
            yield _block(header.decode("utf-8", errors="replace").split(), text, first, after)


def _blocks(path: Path, stream: BinaryIO) -> Iterator[Block]:
    """All blocks of the file, one after the other."""
    position = start = 0
    header: list[str] = []
    lines: list[str] = []
    for line in stream:
        if position == 0 and not header:
            text = line.removeprefix(BOM)
            if text.strip() and not text.startswith(b"ITEM:"):
                found = text[:40].decode("utf-8", errors="replace").strip()
                raise InputError(f"{path} is not a LAMMPS text dump: expected 'ITEM: TIMESTEP', found {found!r}")
        else:
            text = line
        position += len(line)
        if text.startswith(b"ITEM:"):
            if header:
                yield _block(header, lines, start, position - len(line))
            header, lines, start = text.decode("utf-8", errors="replace").split(), [], position
        elif header[1:2] != ["ATOMS"] and len(lines) < LONGEST:
            lines.append(text[:HEADER].decode("utf-8", errors="replace"))
    if header:
        yield _block(header, lines, start, position)


def _block(header: list[str], lines: list[str], start: int, end: int) -> Block:
    words = header[1:]
    name = next((known for known in (*SHORT, *TABLES) if words[: known.count(" ") + 1] == known.split()), "")
    name = name or " ".join(words[:2])
    kept = tuple(lines) if name in SHORT else ()
    return Block(name, tuple(words[name.count(" ") + 1 :]), start, end, kept)
