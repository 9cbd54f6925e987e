"""States of a transient on disk: a run that was killed continues from the last one, with the same bits.

Beside ``out.nc`` stands the folder ``out.nc.states`` with a file for each output time, put in place whole or not at
all, a lock (see `etc_engine.durable.lock`) and the digest of the study and of its particles.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields
from io import BytesIO
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np

from etc_engine.durable.files import write_atomically
from etc_engine.durable.lock import Lock
from etc_engine.errors import OutputError, StudyError
from etc_engine.solvers.marching import MarchState
from etc_engine.sweep.shards import clear_folder
from etc_engine.transient.moving import MovingState

State = MarchState | MovingState


def state_folder(output: Path) -> Path:
    """The folder that holds the states of an output file."""
    return output.with_name(output.name + ".states")


def state_path(folder: Path, index: int) -> Path:
    """The state of an output time."""
    return folder / f"state-{index:06d}.npz"


def write_state(folder: Path, index: int, state: State) -> None:
    """Put a state in place.

    Raises
    ------
    OutputError
    """
    buffer = BytesIO()
    values: dict[str, Any] = {field.name: np.asarray(getattr(state, field.name)) for field in fields(state)}
    np.savez(buffer, **values)
    path = state_path(folder, index)
    try:
        write_atomically(path, buffer.getvalue())
    except OSError as error:
        raise OutputError(
            f"cannot write {path}: {error.strerror or error}; make room and continue with --resume"
        ) from None


def read_states(folder: Path, kind: type[MarchState] | type[MovingState] = MarchState) -> list[State]:
    """The states of the first output times without a gap; a damaged one ends them."""
    states: list[State] = []
    while (path := state_path(folder, len(states))).exists():
        try:
            with np.load(BytesIO(path.read_bytes())) as data:
                values = {field.name: data[field.name] for field in fields(kind)}
        except (OSError, ValueError, KeyError, zipfile.BadZipFile):
            break
        states.append(kind(**{name: value if value.ndim else value.item() for name, value in values.items()}))
    return states


@contextmanager
def claimed_states(
    output: Path, digest: str, kind: type[MarchState] | type[MovingState], *, resume: bool
) -> Iterator[tuple[Path, list[State]]]:
    """The locked folder of states of an output, and the states in it to continue from.

    Parameters
    ----------
    output : Path
    digest : str
        Of the study and its particles.
    kind : type
        Of the states.
    resume : bool
        Whether to continue from former states; otherwise they are removed.

    Raises
    ------
    OutputError
        If another run holds the lock, or the folder cannot be written.
    StudyError
        If the states belong to another study.
    """
    folder = state_folder(output)
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot write {folder}: {error.strerror}") from None
    with Lock(folder, uuid4().hex):
        former = folder / "digest"
        if resume and former.exists():
            if former.read_text() != digest:
                raise StudyError(
                    f"{folder} belongs to another study or other particles: undo the change, or --overwrite"
                )
            yield folder, read_states(folder, kind)
        else:
            clear_folder(folder)
            write_atomically(former, digest.encode())
            yield folder, []


def remove_states(output: Path) -> None:
    """Remove the states of an output that is written."""
    folder = state_folder(output)
    if folder.exists():
        clear_folder(folder)
        folder.rmdir()
