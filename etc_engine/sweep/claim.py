"""Claiming an output: is it free, is there something to resume, and is that of the same study."""

from __future__ import annotations

import json
import secrets
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal, Protocol

from etc_engine.durable.files import write_atomically
from etc_engine.durable.lock import Lock
from etc_engine.durable.provenance import Run, engine_commit, engine_version, this_run
from etc_engine.errors import OutputError, StudyError
from etc_engine.study.sweep import Study, read_study
from etc_engine.sweep.parts import Part, part_folders, take_up
from etc_engine.sweep.shards import (
    SUFFIX,
    clear_folder,
    frame,
    read_study_file,
    shard_folder,
    unframe,
    write_study_file,
)

Policy = Literal["fresh", "resume", "overwrite"]
USELESS_STARTS = 5
"""After so many starts in a row that finished no unit a batch job ends; its script would queue it again and again."""


@dataclass(frozen=True)
class Claim:
    """An output that is this run's to compute. ``complete`` if a former run has finished it."""

    study: Study
    text: str
    output: Path
    run: str
    complete: bool = False
    remarks: tuple[str, ...] = ()
    part: Part | None = None

    @property
    def folder(self) -> Path:
        """Where the shards are."""
        return _folder(self.output, self.part)


def claim_output(
    study_path: Path, output: Path, policy: Policy, ranks: int, held: ExitStack, part: Part | None = None
) -> Claim:
    """Check the study, lock the output and prepare its folder of shards.

    Parameters
    ----------
    study_path, output : Path
        The study file and the netCDF file to write.
    policy : {"fresh", "resume", "overwrite"}
        What to do where there is an output, or shards of one.
    ranks : int
        How many compute, for the record.
    held : ExitStack
        Takes the lock; it is released when the stack is closed.
    part : Part, optional
        Compute this part only; the whole takes up the finished units of all parts.

    Raises
    ------
    StudyError
        If the study is not valid, or is another than the one to resume.
    OutputError
        If the output exists, is locked or cannot be written.
    """
    study, text = read_study(study_path)
    folder, run = _make_folder(output, part), new_run()
    held.callback(_remove_if_empty, folder)
    lock = held.enter_context(Lock(folder, run))
    parts = [] if part else part_folders(output)
    started = [place for place in (folder, *parts) if any(place.glob(f"*{SUFFIX}"))]
    if policy == "fresh" and (started or output.exists()):
        what = f"finished units of {output} exist" if started else f"{output} exists"
        raise OutputError(f"{what}: continue with --resume, or start anew with --overwrite")
    if part and policy == "overwrite" and output.exists():
        raise OutputError(f"{output} exists and a part does not replace it: remove it first")
    if policy == "resume" and output.exists() and folder not in started:
        refuse_other_study(study, *_study_of_output(output), str(output))
        return Claim(study, text, output, run, complete=True, part=part)
    if policy == "resume":
        for place in started:
            _refuse_units_of_another(study, place)
        _refuse_useless_starts(folder, lock.holder.job)
    if policy != "resume" or (read_study_file(folder) or ("",))[0] != study.digest():
        clear_folder(folder)
        write_study_file(folder, study.identity(), study.digest())
    for place in parts:
        take_up(place, folder if policy == "resume" else None, run)
    remarks = _other_engines(folder) if policy == "resume" and started else ()
    record = json.dumps(asdict(this_run(run, ranks, lock.holder.job)))
    write_atomically(folder / f"{run}.run", frame(record))
    return Claim(study, text, output, run, remarks=(*remarks, *study.remarks()), part=part)


def new_run() -> str:
    """A name for a run that no other has, in the order of time."""
    return f"{datetime.now(UTC):%Y%m%dT%H%M%S}-{secrets.token_hex(3)}"


def recorded_runs(folder: Path) -> list[Run]:
    """All runs that worked on an output, the first one first.

    Raises
    ------
    OutputError
        If the record of a run is damaged.
    """
    return [_read_run(path) for path in sorted(folder.glob("*.run"))]


def _read_run(path: Path) -> Run:
    """The record of a run: a line with its checksum; earlier versions wrote the text alone."""
    try:
        data = path.read_bytes()
        text = unframe(data) or (data if data.startswith(b"{") else "")
        run = Run(**json.loads(text))
        if all(isinstance(value, int if name == "ranks" else str) for name, value in asdict(run).items()):
            return run
    except (OSError, ValueError, TypeError, RecursionError):
        pass
    raise OutputError(
        f"{path}, the record of a former run, is damaged: remove it and continue with --resume (no number depends on "
        "it), or start anew with --overwrite"
    )


def difference(found: Mapping[str, Any], wanted: Mapping[str, Any], prefix: str = "") -> str:
    """The first key in which two studies differ, in words; empty if they do not.

    Examples
    --------
    >>> difference({"seed": 7, "packing": {"count": 3}}, {"seed": 7, "packing": {"count": 4}})
    'packing.count is 3 there and 4 here'
    """
    for key in sorted({*found, *wanted}, key=lambda key: (key != "schema", key)):
        there, here = found.get(key), wanted.get(key)
        if (
            there is not None and here is not None and _alike(there, here)
        ):  # lists of tables, such as the files of a study
            there, here = ({f"{k}": item for k, item in enumerate(items)} for items in (there, here))
        if isinstance(there, Mapping) and isinstance(here, Mapping):
            inner = difference(there, here, f"{prefix}{key}.")
            if inner:
                return inner
        elif there != here:
            return f"{prefix}{key} is {there!r} there and {here!r} here"
    return ""


def _alike(there: Any, here: Any) -> bool:
    """Whether both are lists of tables of one length."""
    lists = isinstance(there, (list, tuple)) and isinstance(here, (list, tuple)) and len(there) == len(here)
    return lists and all(isinstance(item, Mapping) for item in (*there, *here))


def _refuse_units_of_another(study: Study, folder: Path) -> None:
    """Refuse finished units that are of another study than this one, or do not say of which."""
    found = read_study_file(folder)
    if found is None:
        raise StudyError(f"{folder} does not say which study its units belong to: start anew with --overwrite")
    refuse_other_study(study, *found, str(folder))


def _refuse_useless_starts(folder: Path, job: str) -> None:
    """End the starts of a batch job that finish nothing: a full disk, or units that take longer than the time limit."""
    useless = 0
    for run in reversed([one.run for one in recorded_runs(folder) if job and one.job == job]):
        if any(path.stat().st_size for path in folder.glob(f"{run}-*{SUFFIX}")):
            break
        useless += 1
    if useless >= USELESS_STARTS:
        raise OutputError(
            f"the last {useless} starts of this job ({job}) finished no unit: find out why (full disk, time limit "
            "shorter than a unit), then hand the study in again to continue"
        )


def _folder(output: Path, part: Part | None) -> Path:
    return part.folder(output) if part else shard_folder(output)


def _make_folder(output: Path, part: Part | None) -> Path:
    """The folder of the shards, made if it is not there."""
    if output.is_dir():
        raise OutputError(f"output {output} is a folder: expected the name of a netCDF file to write")
    if output.exists() and not output.is_file():
        raise OutputError(
            f"output {output} is a device or a pipe: expected the name of a netCDF file to write; --dry-run writes none"
        )
    if not output.parent.is_dir():
        raise OutputError(f"output {output}: there is no folder {output.parent}, make it first")
    folder = _folder(output, part)
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"output {output}: cannot write in {output.parent} ({error.strerror})") from None
    return folder


def _remove_if_empty(folder: Path) -> None:
    """Neither a refused nor a completed run leaves a folder behind."""
    with suppress(OSError):
        folder.rmdir()


def _study_of_output(output: Path) -> tuple[str, dict[str, Any]]:
    from etc_engine.sweep.result_file import open_dataset

    attributes = open_dataset(output).attrs
    return attributes["study_digest"], json.loads(attributes["study_resolved"])


class Identified(Protocol):
    """A study that says what decides its numbers."""

    def identity(self) -> dict[str, Any]:
        """What decides the numbers, as plain values."""

    def digest(self) -> str:
        """SHA-256 of the identity."""


def refuse_other_study(study: Identified, digest: str, identity: Mapping[str, Any], place: str) -> None:
    """Refuse a place that holds the numbers of another study than this one.

    Parameters
    ----------
    study : Study, or a study of another command
    digest : str
    identity : mapping
        Of the study that ``place`` belongs to.
    place : str
        For the message.

    Raises
    ------
    StudyError
        It names the first key that differs.
    """
    if digest == study.digest():
        return
    wanted = study.identity()
    found = {key: value for key, value in identity.items() if key in wanted}
    if isinstance(found.get("packing"), Mapping):  # where files are is no part of what they hold
        found["packing"] = {key: value for key, value in found["packing"].items() if key != "folder"}
    what = difference(found, wanted) or "all keys are equal, its digest is not: it is damaged or of another version"
    raise StudyError(
        f"{place} belongs to another study ({what}): resume with that study, or start anew with --overwrite"
    )


def _other_engines(folder: Path) -> tuple[str, ...]:
    """A remark if earlier units come from another version of the engine."""
    here = f"{engine_version()} ({engine_commit()})"
    others = {f"{run.engine} ({run.commit})" for run in recorded_runs(folder)} - {here}
    if not others:
        return ()
    return (f"finished units come from etc_engine {', '.join(sorted(others))}, this is {here}",)
