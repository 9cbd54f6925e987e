"""Bytes of a file: plain, gzip or Zstandard, or standard input; always from the start, as often as needed."""

from __future__ import annotations

import gzip
import io
import shutil
import stat
import sys
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import BinaryIO, cast

from etc_engine.errors import InputError

BOM = b"\xef\xbb\xbf"
GZIP, ZSTANDARD = b"\x1f\x8b", b"\x28\xb5\x2f\xfd"
BLOCK = 1 << 22
"""Bytes that are read at a time."""
LONGEST = 1 << 20
"""No line of a table of particles has as many bytes as this."""


@contextmanager
def open_stream(path: Path | str) -> Iterator[BinaryIO]:
    """The uncompressed bytes of a file; ``-`` and what cannot be read twice (a pipe) is kept on disk first.

    Raises
    ------
    InputError
        If there is no such file, it cannot be read, or Zstandard is not installed.
    """
    path = Path(path)
    try:
        with _raw(path) as raw:
            opening = raw.read(4)
            raw.seek(0)
            if opening.startswith(GZIP):
                with gzip.open(raw) as stream:
                    yield cast("BinaryIO", io.BufferedReader(stream))
            elif opening == ZSTANDARD:
                with _zstandard(raw) as stream:
                    yield stream
            else:
                yield raw
    except FileNotFoundError:
        raise InputError(f"there is no file {path}") from None
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}") from None


def read_opening(path: Path | str, size: int = 4096) -> bytes:
    """First bytes of a file, uncompressed and without a byte order mark; empty where it cannot be read."""
    try:
        with open_stream(path) as stream:
            return stream.read(size).removeprefix(BOM)
    except InputError:
        return b""


def skip(stream: BinaryIO, start: int) -> None:
    """Go forward to a byte of a stream that has just been opened."""
    if stream.seekable():
        stream.seek(start)
        return
    while start > 0:
        start -= len(stream.read(min(start, 1 << 20))) or start


@contextmanager
def seekable_copy(path: Path | str) -> Iterator[Path]:
    """A path that can be opened several times: the file itself, or a temporary copy of a pipe or of standard input."""
    path = Path(path)
    if str(path) != "-" and not _is_pipe(path):
        yield path
        return
    with tempfile.NamedTemporaryFile(prefix="etc-engine-") as copy:
        if str(path) == "-":
            shutil.copyfileobj(sys.stdin.buffer, copy)
        else:
            with path.open("rb") as source:
                shutil.copyfileobj(source, copy)
        copy.flush()
        yield Path(copy.name)


def _is_pipe(path: Path) -> bool:
    try:
        mode = path.stat().st_mode
    except OSError:
        return False
    return stat.S_ISFIFO(mode) or stat.S_ISCHR(mode) or stat.S_ISSOCK(mode)


@contextmanager
def _raw(path: Path) -> Iterator[BinaryIO]:
    with path.open("rb") as file:
        yield file


@contextmanager
def _zstandard(raw: BinaryIO) -> Iterator[BinaryIO]:
    if find_spec("zstandard") is None:
        raise InputError(
            "files in Zstandard (.zst) need the library zstandard: install it with pip install '.[zst]' in the folder "
            "of etc_engine"
        )
    zstandard = import_module("zstandard")
    try:
        with zstandard.ZstdDecompressor().stream_reader(raw, read_across_frames=True) as stream:
            yield cast("BinaryIO", io.BufferedReader(stream))
    except zstandard.ZstdError as error:
        raise InputError(f"cannot decompress Zstandard: {error}") from None


def line_blocks(stream: BinaryIO, size: int = sys.maxsize) -> Iterator[bytes]:
    """The lines of a stream that begin within its next ``size`` bytes, in blocks of whole lines.

    A block ends within a line only where that line is longer than ``LONGEST``.
    """
    while size > 0 and (block := stream.read(min(BLOCK, size))):
        if not block.endswith(b"\n"):
            block += stream.readline(LONGEST)
        size -= len(block)
        yield block
