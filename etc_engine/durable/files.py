"""Whole files or none: a file appears under its name only when all of it is on the disk."""

from __future__ import annotations

import os
import re
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from etc_engine.errors import OutputError

MARK = "etc-engine"


@contextmanager
def replacing(path: Path | str, *, keep: bool = True) -> Iterator[Path]:
    """A temporary neighbour of a file that takes its place when the block succeeds, and is removed otherwise.

    A symbolic link stays: the file it leads to is replaced. An existing file keeps its permissions. What earlier
    processes on this host left behind under the same name when they were killed is removed.

    Parameters
    ----------
    path : Path
    keep : bool
        False only tries whether the place can be written.

    Yields
    ------
    Path
        With the ending of ``path``, in the same folder.

    Raises
    ------
    OutputError
        If the place cannot be written, or is not a regular file: replacing a device or a pipe would destroy it.
    """
    path = Path(path)
    place = Path(os.path.realpath(path))
    if place.is_dir():
        raise OutputError(f"cannot write {path}: it is a directory")
    if place.exists() and not place.is_file():
        raise OutputError(f"cannot write {path}: it is a device or a pipe; expected the name of a regular file")
    temporary = place.with_name(
        f".{place.name}.{MARK}-{socket.gethostname()}-{os.getpid()}-{time.monotonic_ns()}{place.suffix}"
    )
    try:
        _remove_leftovers(place)
        os.close(os.open(temporary, os.O_CREAT | os.O_WRONLY | os.O_EXCL, 0o666))
        if place.exists():
            temporary.chmod(place.stat().st_mode & 0o7777)
    except OSError as error:
        raise _refusal(path, error) from None
    try:
        yield temporary
        if not keep:
            return
        _sync(temporary)
        temporary.replace(place)
        sync_folder(place.parent)
    except OSError as error:
        raise _refusal(path, error) from None
    finally:
        temporary.unlink(missing_ok=True)


def write_atomically(path: Path, data: bytes) -> None:
    """Put a file in place whole or not at all: temporary file, sync, rename, sync of the folder.

    Raises
    ------
    OutputError
    """
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def sync_folder(folder: Path) -> None:
    """Make renames and new files in a folder survive a crash of the machine."""
    _sync(folder)


def _refusal(path: Path, error: OSError) -> OutputError:
    """The error in words; its ``errno`` stays, so that a caller can tell a full disk."""
    refusal = OutputError(f"cannot write {path}: {error.strerror or error}")
    refusal.errno = error.errno
    return refusal


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _remove_leftovers(place: Path) -> None:
    """Remove temporary neighbours whose process, on this host, is gone."""
    pattern = re.compile(
        rf"{re.escape(f'.{place.name}.{MARK}-{socket.gethostname()}-')}(\d+)-\d+{re.escape(place.suffix)}"
    )
    for other in place.parent.iterdir():
        match = pattern.fullmatch(other.name)
        if match and not _running(int(match[1])):
            other.unlink(missing_ok=True)


def _running(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        pass
    return True
