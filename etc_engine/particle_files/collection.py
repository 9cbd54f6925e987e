"""A collection of packings: files by a pattern and frames in them, each known by its content."""

from __future__ import annotations

import glob
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from etc_engine.errors import InputError
from etc_engine.particle_files.formats import count_frames, read_table
from etc_engine.particle_files.sample import Sample
from etc_engine.particle_files.table import ParticleTable

Frames = Literal["last", "all"] | Sequence[int]
MOST = 100_000
"""Most packings of a collection."""


@dataclass(frozen=True)
class PackingSource:
    """One packing of a collection.

    Parameters
    ----------
    path : Path
    name : str
        The file as the pattern finds it, relative to the study.
    frame : int
        Its frame, from 0.
    digest : str
        SHA-256 of the file's bytes.
    sample : Sample
        Box, periodic axes and crop of all packings.
    """

    path: Path
    name: str
    frame: int
    digest: str
    sample: Sample = field(default_factory=Sample)

    def read(self) -> ParticleTable:
        """The particles.

        Raises
        ------
        InputError, GeometryError
            If the file is gone, is another one than when the collection was made, or is not understood.
        """
        self.check()
        return read_table(self.path, sample=self.chosen())

    def check(self) -> None:
        """Refuse a file that is another one than when the collection was made.

        Raises
        ------
        InputError
        """
        if file_digest(self.path) != self.digest:
            raise InputError(f"{self.path} has changed since the sweep began: keep the files of a sweep as they are")

    def chosen(self) -> Sample:
        """The sample, with the frame where the file has several."""
        return replace(self.sample, frame=self.frame if count_frames(self.path) > 1 else None)


def find_sources(
    folder: Path, pattern: str, frames: Frames = "last", sample: Sample | None = None
) -> list[PackingSource]:
    """Packings of all files that a pattern finds, in the order of names and frames.

    Parameters
    ----------
    folder : Path
        What a relative pattern is relative to.
    pattern : str
        Name of a file, or with ``*``, ``?``, ``[...]`` and ``**``.
    frames : {"last", "all"} or sequence of int
        Frames of each file; negative numbers count from the end.
    sample : Sample, optional
        Box, periodic axes and crop of all packings.

    Returns
    -------
    list of PackingSource

    Raises
    ------
    InputError
        If no file is found, one cannot be read, or it has no such frame.
    """
    names = sorted(glob.glob(pattern, root_dir=folder, recursive=True))  # noqa: PTH207 - absolute patterns too
    names = [name for name in names if (folder / name).is_file()]
    if not names:
        raise InputError(f"no file matches {pattern!r} in {folder}")
    found: list[PackingSource] = []
    for name in names:
        path = folder / name
        count = count_frames(path)
        digest = file_digest(path)
        for frame in _chosen(path, count, frames):
            found.append(PackingSource(path, name, frame, digest, sample or Sample()))
        if len(found) > MOST:
            raise InputError(f"{pattern!r} and its frames are more than {MOST} packings: choose fewer")
    return found


def file_digest(path: Path) -> str:
    """SHA-256 of a file's bytes.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or error}") from None


def _chosen(path: Path, count: int, frames: Frames) -> list[int]:
    """Numbers of the wanted frames, from 0."""
    if isinstance(frames, str):
        return [count - 1] if frames == "last" else list(range(count))
    bad = [frame for frame in frames if not -count <= frame < count]
    if bad:
        raise InputError(f"{path} holds {count} frames, numbered from 0: there is no frame {bad[0]}")
    return [frame % count for frame in frames]
