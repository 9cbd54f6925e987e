"""The data directory: one service at a time, a format that says its number, a folder a study, all for its owner alone.

::

    format.json              {"format": 1}
    lock                     held by the running service (flock: gone with its process, however that ends)
    queue.sqlite             the queue
    scratch/                 uploads, emptied at every start
    studies/<id>/            study.toml, log, result.nc (and its shards), report.html, bed.png;
                             a damaged result.damaged.nc
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from etc_engine.durable.files import write_atomically
from etc_engine.errors import OutputError
from etc_engine.sweep.shards import shard_folder

FORMAT = 1
FIRST = {"lock", "scratch", "studies"}
"""What a service that found no room for its format file has left."""
PRIVATE = 0o077
"""Rights that nobody but the owner gets."""
DAMAGED = "result.damaged.nc"
ROOM = 1 << 20
"""Bytes that have to fit on the disk for the service to start."""


@dataclass(frozen=True)
class Store:
    """Places in a data directory. An id is made of hexadecimal digits, never of a user's words."""

    root: Path

    @property
    def database(self) -> Path:
        """The queue."""
        return self.root / "queue.sqlite"

    @property
    def scratch(self) -> Path:
        """Where uploads are kept while they are needed."""
        return self.root / "scratch"

    def folder(self, study: str) -> Path:
        """All that belongs to a study."""
        return self.root / "studies" / study

    def study_file(self, study: str) -> Path:
        """The text of a study."""
        return self.folder(study) / "study.toml"

    def result(self, study: str) -> Path:
        """The result; it is there once it is complete."""
        return self.folder(study) / "result.nc"

    def shards(self, study: str) -> Path:
        """The finished units of a study that is not complete."""
        return shard_folder(self.result(study))

    def log(self, study: str) -> Path:
        """What the batches of a study have printed."""
        return self.folder(study) / "log"

    def report(self, study: str) -> Path:
        """The report, once somebody has asked for it."""
        return self.folder(study) / "report.html"

    def bed(self, study: str) -> Path:
        """The picture of the packing, once somebody has asked for it."""
        return self.folder(study) / "bed.png"

    def set_aside(self, study: str) -> None:
        """Keep a damaged result under another name, so that the study can be computed again."""
        with suppress(FileNotFoundError):
            self.result(study).replace(self.folder(study) / DAMAGED)

    def save_study(self, study: str, text: str) -> None:
        """Make the folder of a study, with its text."""
        self.folder(study).mkdir(parents=True, exist_ok=True)
        write_atomically(self.study_file(study), text.encode())

    def remove(self, study: str) -> None:
        """Remove all that belongs to a study."""
        shutil.rmtree(self.folder(study), ignore_errors=True)


@contextmanager
def open_store(root: Path) -> Iterator[Store]:
    """The data directory, made if it is not there, and held against a second service until the block ends.

    Others than its owner are shut out, whatever rights it had; files that this process and its children make until the
    block ends are for their owner alone.

    Raises
    ------
    OutputError
        If it is in use, of a newer format, something else, or cannot be written.
    """
    root = root.absolute()
    mask = os.umask(PRIVATE)
    try:
        with _held(root) as store:
            yield store
    finally:
        os.umask(mask)


@contextmanager
def _held(root: Path) -> Iterator[Store]:
    try:
        _check_kind(root)
        root.mkdir(parents=True, exist_ok=True)
        root.chmod(0o777 & ~PRIVATE)
        handle = os.open(root / "lock", os.O_RDWR | os.O_CREAT, 0o600)
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(f"data directory {root}: cannot be written ({error.strerror})") from None
    try:
        _hold(root, handle)
        store = Store(root)
        try:
            _prepare(store)
        except OutputError:
            raise
        except OSError as error:
            raise OutputError(f"data directory {root}: cannot be written ({error.strerror or error})") from None
        yield store
    finally:
        os.close(handle)


def _check_kind(root: Path) -> None:
    """Refuse what this version does not understand, before anything in it is touched."""
    if not root.exists():
        return
    if not root.is_dir():
        raise OutputError(f"data directory {root}: is a file, expected a folder")
    mark = root / "format.json"
    if not mark.exists():
        strange = sorted({path.name for path in root.iterdir()} - FIRST)
        if strange:
            raise OutputError(
                f"data directory {root}: holds other things ({strange[0]}, ...), expected a new or an empty folder"
            )
        return
    try:
        number = int(json.loads(mark.read_text())["format"])
    except (ValueError, KeyError, TypeError):
        raise OutputError(f"data directory {root}: {mark.name} is damaged, expected {{'format': {FORMAT}}}") from None
    if number > FORMAT:
        raise OutputError(
            f"data directory {root}: is of format {number}, this version of etc-engine knows formats up to {FORMAT}: "
            "use the newer version that made it"
        )


def _hold(root: Path, handle: int) -> None:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno not in (errno.EAGAIN, errno.EACCES):
            raise OutputError(f"data directory {root}: cannot be locked ({error.strerror})") from None
        holder = os.pread(handle, 32, 0).decode(errors="replace").strip()
        raise OutputError(
            f"data directory {root}: another service is using it (process {holder}): stop that one, "
            "or give this one another directory"
        ) from None
    os.ftruncate(handle, 0)
    os.pwrite(handle, f"{os.getpid()}\n".encode(), 0)


def _prepare(store: Store) -> None:
    shutil.rmtree(store.scratch, ignore_errors=True)
    store.scratch.mkdir()
    (store.root / "studies").mkdir(exist_ok=True)
    probe = store.scratch / "room"
    try:
        with probe.open("wb") as stream:
            stream.write(b"\0" * ROOM)
            stream.flush()
            os.fsync(stream.fileno())
    finally:
        probe.unlink(missing_ok=True)
    known = [path.name for path in (store.root / "studies").iterdir()]
    if known and not store.database.exists():
        raise OutputError(
            f"data directory {store.root}: {store.database.name} is missing, but there are {len(known)} studies: "
            "put a copy of it back, or move the folder studies away and hand the studies in again"
        )
    if not (store.root / "format.json").exists():
        write_atomically(store.root / "format.json", json.dumps({"format": FORMAT}).encode())
