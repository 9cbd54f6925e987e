"""Shards: the finished units of a sweep on disk, safe from kills, full disks and restarts.

Beside ``out.nc`` stands the folder ``out.nc.shards``::

    study.json               the study that the units belong to
    lock                     who is computing now (see lock.py)
    <run>-<rank>.shard       one line a finished unit: checksum, blank, record

Each rank of each run appends to a file of its own, one ``write`` a unit, so that nothing finished is lost
when the process is killed, and old ranks that live on never write into the file of another. Rewriting the
whole shard for every unit (temporary file, sync, rename) would give no more, at a cost that grows with the
square of the units; a line that was cut short is recognised by its checksum and the unit is run again. Syncing
to the disk guards against a crash of the machine; it is done as often as it takes at most `SYNC_SHARE` of
the time.
"""

from __future__ import annotations

import json
import os
import time
import zlib
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any

from etc_engine.durable.files import write_atomically
from etc_engine.errors import OutputError
from etc_engine.sweep.records import Record, decode, encode

SYNC_SHARE = 0.05
SUFFIX = ".shard"


def shard_folder(output: Path) -> Path:
    """The folder that holds the shards of an output file."""
    return output.with_name(output.name + ".shards")


def shard_path(folder: Path, run: str, rank: int) -> Path:
    """The shard of one rank in one run."""
    return folder / f"{run}-{rank:05d}{SUFFIX}"


class ShardWriter:
    """The shard of one rank in one run. Use as a context manager.

    Parameters
    ----------
    folder : Path
        The folder of the shards.
    run : str
        The identity of this run, no other run's.
    rank : int
        The rank that writes.

    Raises
    ------
    OutputError
        If a record cannot be written whole; the shard then ends with the record before it.
    """

    def __init__(self, folder: Path, run: str, rank: int) -> None:
        self.path = shard_path(folder, run, rank)
        self._length = 0
        self._synced = time.monotonic()
        self._sync_seconds = 0.0
        self._file = -1  # opened by the first record: a rank without units leaves no file

    def append(self, record: Record) -> None:
        """Put a record at the end of the shard."""
        line = frame(encode(record))
        try:
            if self._file < 0:
                self._file = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)
            written = os.write(self._file, line)
            if written < len(line):  # a full disk takes what fits; the next write says why
                os.write(self._file, line[written:])
            self._length += len(line)
            if time.monotonic() - self._synced >= self._sync_seconds / SYNC_SHARE:
                self._sync()
        except OSError as error:
            self._take_back()
            raise OutputError(
                f"cannot write shard {self.path}: {error.strerror}; what is in it stays, "
                "make room and continue with --resume"
            ) from None

    def _take_back(self) -> None:
        """Cut off a record that was written in part; where that fails too, its checksum shows the damage."""
        if self._file >= 0:
            with suppress(OSError):
                os.ftruncate(self._file, self._length)

    def _sync(self) -> None:
        started = time.monotonic()
        os.fsync(self._file)
        self._synced = time.monotonic()
        self._sync_seconds = self._synced - started

    def __enter__(self) -> ShardWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._file < 0:
            return
        try:
            os.fsync(self._file)
        except OSError as failure:
            if error is None:
                raise OutputError(f"cannot write shard {self.path}: {failure.strerror}") from None
        finally:
            os.close(self._file)
            self._file = -1


def frame(text: str) -> bytes:
    """A line with its checksum in front.

    Examples
    --------
    >>> frame("{}")
    b'a3a6bf43 {}\\n'
    """
    data = text.encode()
    return b"%08x %s\n" % (zlib.crc32(data), data)


def unframe(line: bytes) -> str | None:
    """The text of a line, or None if it is not what was written."""
    checksum, blank, data = line[:8], line[8:9], line[9:-1]
    if not line.endswith(b"\n") or blank != b" " or checksum != b"%08x" % zlib.crc32(data):
        return None
    return data.decode()


@dataclass
class ShardReader:
    """Reads what is new in the shards of a folder each time it is asked."""

    folder: Path
    damaged: int = 0
    _known: list[Path] = field(default_factory=list)
    _read: dict[Path, int] = field(default_factory=dict)

    def files(self, more: Iterable[Path] = ()) -> list[Path]:
        """All shards, in an order that only grows; ``more`` are some that the folder may not show yet."""
        found = {*self.folder.glob(f"*{SUFFIX}"), *more} - {*self._known}
        self._known += sorted(found)
        return self._known

    def read(self, files: Iterable[Path]) -> Iterator[Record]:
        """The records of some shards that were not read before, one after the other."""
        return (decode(text) for path in files for text in self._new_lines(path))

    def _new_lines(self, path: Path) -> Iterator[str]:
        if not path.exists():
            return  # written on another host, and not to be seen here yet
        with path.open("rb") as stream:
            stream.seek(self._read.get(path, 0))
            for line in stream:
                if not line.endswith(b"\n"):
                    break  # cut short, or being written just now
                self._read[path] = self._read.get(path, 0) + len(line)
                text = unframe(line)
                if text is None:
                    self.damaged += 1
                else:
                    yield text


def write_study_file(folder: Path, identity: dict[str, Any], digest: str) -> None:
    """Say in the folder which study its units belong to."""
    content = json.dumps({"digest": digest, "study": identity}, indent=1)
    write_atomically(folder / "study.json", content.encode())


def read_study_file(folder: Path) -> tuple[str, dict[str, Any]] | None:
    """Digest and identity of the study a folder belongs to; None if it does not say."""
    try:
        values = json.loads((folder / "study.json").read_text())
        digest, identity = values["digest"], values["study"]
    except (FileNotFoundError, ValueError, TypeError, KeyError, RecursionError):
        return None
    return (digest, identity) if isinstance(digest, str) and isinstance(identity, dict) else None


def clear_folder(folder: Path) -> None:
    """Remove everything but the lock, which its holder gives back last: a new run waits for that."""
    for path in folder.iterdir():
        if path.name != "lock":
            path.unlink(missing_ok=True)
