"""A sweep from end to end: claim the output, run the units in rounds, write the dataset.

Rank 0 decides (what to run, whether to go on) and every rank computes. Decisions see the shards alone,
so that a sweep in one go and a sweep in pieces take the same ones.
"""

from __future__ import annotations

import socket
import time
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from etc_engine.arrays import Ints
from etc_engine.durable.stop import Stopped, StopRequest
from etc_engine.durable.watch import Watch
from etc_engine.errors import OutputError
from etc_engine.realization import Realization, RealizationSpec, Status
from etc_engine.study.sweep import Study
from etc_engine.sweep.attributes import global_attributes
from etc_engine.sweep.claim import Claim, Policy, claim_output, recorded_runs
from etc_engine.sweep.dataset import assemble
from etc_engine.sweep.gathering import Gatherer
from etc_engine.sweep.parts import Part
from etc_engine.sweep.plan import Unit, next_targets, unit_rng, units_to_run
from etc_engine.sweep.records import Record, failed_realization
from etc_engine.sweep.result_file import open_dataset, write_dataset
from etc_engine.sweep.scheduler import STOP, Communicator, on_rank_zero
from etc_engine.sweep.shards import ShardWriter, clear_folder, shard_path
from etc_engine.sweep.table import Table

if TYPE_CHECKING:
    import xarray

Realize = Callable[[RealizationSpec, np.random.Generator], Realization]
Report = Callable[[int, int, int], None]
"""Called on rank 0 with units done, units planned and cells failed: before the first unit, and after each."""

Notify = Callable[[str], None]
"""Called on rank 0 with a remark."""

NEXT, DONE, FAILED = 0, 1, 2


@dataclass(frozen=True)
class Outcome:
    """How a sweep ended. ``cells`` counts the statuses; ``stopped`` is the reason of an early end.

    Of a ``part`` there is no output yet: its ``units`` are finished, and the whole takes them up.
    """

    output: Path
    units: int
    computed: int
    cells: Mapping[Status, int] = field(default_factory=dict)
    stopped: str = ""
    part: Part | None = None

    @property
    def failed(self) -> int:
        """Cells that should have a conductivity and have none."""
        return sum(n for status, n in self.cells.items() if Status.NOT_PERCOLATING < status < Status.NOT_RUN)


Prepare = Callable[[Study, Communicator, Callable[[], bool]], None]
"""Called on every rank before the first unit, with a function that says whether to leave it."""


def nothing(*_: object) -> None:
    """Do nothing: report to nobody, prepare nothing."""


def sweep(
    study_path: Path,
    output: Path,
    policy: Policy,
    communicator: Communicator,
    realize: Realize,
    *,
    report: Report = nothing,
    notify: Notify = nothing,
    prepare: Prepare = nothing,
    part: Part | None = None,
) -> Outcome:
    """Run a study on all ranks of a communicator and write its dataset.

    Parameters
    ----------
    study_path, output : Path
        The study file and the netCDF file to write.
    policy : {"fresh", "resume", "overwrite"}
        What to do where there is an output, or shards of one.
    communicator : Communicator
        See :func:`etc_engine.sweep.scheduler.connect`; every rank calls this function.
    realize : callable
        (spec, rng) -> Realization, :func:`etc_engine.realization.realize` or a stand-in.
    report, notify : callable
        Progress and remarks, called on rank 0 only.
    prepare : callable
        What the ranks do together before the first unit, such as
        :func:`etc_engine.sweep.compilation.share_compilation`.
    part : Part, optional
        Compute this part of the units only, and leave them for a sweep of the whole study.

    Returns
    -------
    Outcome
        The same on every rank.

    Raises
    ------
    StudyError
        If the study is not valid, or is another than the one to resume.
    OutputError
        If the output exists, is locked or cannot be written. Every rank raises the same error.
    """
    with StopRequest() as stop, ExitStack() as held:
        claim = on_rank_zero(
            communicator, partial(claim_output, study_path, output, policy, communicator.size, held, part)
        )
        if claim.complete:
            return on_rank_zero(communicator, partial(_outcome_of_file, claim))
        with Watch(claim.folder / "lock", claim.run, launched=communicator.size > 1):
            begin = partial(prepare, claim.study, communicator, lambda: bool(stop.reason))
            table, computed, stopped = _run_rounds(claim, communicator, realize, stop, report, notify, begin)
        communicator.wait_for_all(nothing)  # nobody watches the lock any more, rank 0 may give it back
        if stopped:
            return Outcome(output, 0, computed, stopped=stopped)
        if part is not None:
            return Outcome(output, communicator.broadcast(len(table.rows)), computed, part=part)
        return on_rank_zero(communicator, partial(_finish, claim, table, computed))


def _run_rounds(
    claim: Claim,
    communicator: Communicator,
    realize: Realize,
    stop: StopRequest,
    report: Report,
    notify: Notify,
    begin: Callable[[], None],
) -> tuple[Table, int, str]:
    """Compute round after round until every cell is settled.

    Returns the table (on rank 0), how many units all ranks have computed, and why they stopped if they did.
    """
    gatherer, computed = Gatherer(claim.study, claim.folder, communicator), 0
    targets = (claim.study.statistics.realizations,) * len(claim.study.densities)
    table = gatherer.gather()
    for number in count():
        plan = on_rank_zero(communicator, partial(_plan_round, claim, table, targets, computed))
        if number == 0 and communicator.rank == 0:
            _notify_start(claim, plan, gatherer.damaged, notify)
        if not plan.units.size:
            break
        base = computed + number * communicator.size
        round_ = _Round(claim, plan, base, f"{claim.run}-{number}", report)
        if number == 0:
            round_.tell(communicator)
            begin()
        stopped = _run_round(round_, communicator, realize, stop)
        if stopped:
            return table, communicator.add(DONE, 0), stopped
        written = shard_path(claim.folder, round_.shard, communicator.rank)
        try:
            table = gatherer.gather_all(plan.units, written if written.exists() else None)
        except OutputError as error:
            return table, communicator.add(DONE, 0), str(error)
        targets, computed = plan.targets, computed + len(plan.units)
    return table, computed, ""


@dataclass(frozen=True)
class _Plan:
    """What a round computes, and where it stands in the whole: ``known`` units were there before this run."""

    targets: tuple[int, ...]
    units: NDArray[np.int64]
    known: int
    planned: int


@dataclass(frozen=True)
class _Round:
    """Units between two decisions; ``base`` is where the shared counter stood when they began."""

    claim: Claim
    plan: _Plan
    base: int
    shard: str
    report: Report

    def tell(self, communicator: Communicator) -> None:
        """Report the progress, from rank 0."""
        if communicator.rank == 0:
            done = self.plan.known + communicator.add(DONE, 0)
            self.report(done, self.plan.planned, communicator.add(FAILED, 0))


def _plan_round(claim: Claim, table: Table, targets: tuple[int, ...], computed: int) -> _Plan:
    """The next round that has something to compute, or an empty one when every cell is settled.

    Rounds that the shards hold already are decided again from the same units, as if they ran now.
    """
    study = claim.study
    units = _units_to_run(claim, targets, table.units)
    while not units.size:
        grown = next_targets(study, targets, table)
        if grown == targets:
            break
        targets = grown
        units = _units_to_run(claim, targets, table.units)
    planned = len(_units_to_run(claim, targets, np.empty((0, 2), np.int64)))
    return _Plan(targets, units, planned - len(units) - computed, planned)


def _units_to_run(claim: Claim, targets: tuple[int, ...], finished: Ints) -> Ints:
    """The units of the whole study, or of the claimed part, that are not finished."""
    units = units_to_run(claim.study.densities, targets, finished)
    return claim.part.select(claim.study, units) if claim.part else units


def _run_round(round_: _Round, communicator: Communicator, realize: Realize, stop: StopRequest) -> str:
    """Compute the units of a round on all ranks; returns the reason if any of them stopped early."""
    round_.tell(communicator)
    reason = _compute(round_, communicator, realize, stop)
    communicator.wait_for_all(lambda: round_.tell(communicator))
    reasons = communicator.gather(reason)
    return str(communicator.broadcast(next(filter(None, reasons), "") if reasons else ""))


def _compute(round_: _Round, communicator: Communicator, realize: Realize, stop: StopRequest) -> str:
    """Take units until there are none; returns why this rank stopped early, or nothing.

    Every rank takes one number beyond the last unit: the next round's base allows for it.
    """
    if round_.claim.study.conduction.distributed:
        return _compute_together(round_, communicator, stop)
    claim, units = round_.claim, round_.plan.units
    densities = claim.study.densities
    specs = [claim.study.realization_spec(density) for density in densities]
    try:
        with ShardWriter(claim.folder, round_.shard, communicator.rank) as shard:
            while (index := communicator.add(NEXT, 1) - round_.base) < len(units):
                i, realization = units[index].tolist()
                unit = Unit(densities[i], realization)
                record = stop.run(partial(run_unit, claim.study, specs[i], unit, communicator.rank, realize))
                shard.append(record)
                communicator.add(DONE, 1)
                if record.failed:
                    communicator.add(FAILED, record.failed)
                round_.tell(communicator)
    except Stopped:
        communicator.add(NEXT, STOP)
    except OutputError as error:
        communicator.add(NEXT, STOP)
        return str(error)
    return stop.reason


def _compute_together(round_: _Round, communicator: Communicator, stop: StopRequest) -> str:
    """Units one after the other, each by all ranks, of which rank 0 keeps the records; returns as `_compute`.

    A signal is heeded between units: within one, ranks wait for each other.
    """
    from etc_engine.realization.distributed import realize_together

    study, folder = round_.claim.study, round_.claim.folder
    with ExitStack() as held:
        shard = held.enter_context(ShardWriter(folder, round_.shard, 0)) if communicator.rank == 0 else None
        for i, realization in round_.plan.units.tolist():
            reason = next(filter(None, communicator.share(stop.reason)), "")
            if reason:
                return reason
            unit, started = Unit(study.densities[i], realization), time.time()
            spec = study.for_realization(study.realization_spec(unit.density), realization)
            result = realize_together(spec, communicator)
            trouble = None
            if shard is not None:
                record = Record(unit, result, 0, socket.gethostname(), started, time.time())
                try:
                    shard.append(record)
                except OutputError as error:
                    trouble = str(error)
                communicator.add(DONE, 1)
                communicator.add(FAILED, record.failed)
            trouble = communicator.broadcast(trouble)
            if trouble:
                return str(trouble)
            round_.tell(communicator)
    return ""


def run_unit(study: Study, spec: RealizationSpec, unit: Unit, rank: int, realize: Realize) -> Record:
    """One realization; an error that it raises becomes its result.

    Raises
    ------
    OutputError
        If the machine, not the unit, failed: no memory or no disk. That is no result; the unit runs again later.
    """
    started = time.time()
    try:
        result = realize(study.for_realization(spec, unit.realization), unit_rng(study.seed, unit))
    except (MemoryError, OSError) as error:
        place = "the packer's own density" if unit.density is None else f"density {unit.density:g}"
        raise OutputError(
            f"realization {unit.realization} at {place} failed because of the machine "
            f"({type(error).__name__}: {error}): make room and continue with --resume"
        ) from None
    except Exception as error:
        result = failed_realization(error, spec)
    return Record(unit, result, rank, socket.gethostname(), started, time.time())


def _finish(claim: Claim, table: Table, computed: int) -> Outcome:
    """Assemble the dataset, put it in place, take the shards away."""
    hosts = sorted(set(table.spelled("worker_host")))
    attributes = global_attributes(claim.study, claim.text, recorded_runs(claim.folder), hosts)
    dataset = assemble(claim.study, table, attributes)
    outcome = Outcome(claim.output, len(table.rows), computed, _count_cells(dataset))
    try:
        write_dataset(dataset, claim.output)
    except OutputError as error:
        return replace(outcome, stopped=str(error))
    clear_folder(claim.folder)
    return outcome


def _outcome_of_file(claim: Claim) -> Outcome:
    """The outcome of a sweep that had finished before."""
    dataset = open_dataset(claim.output)
    units = int((dataset["worker_rank"] >= 0).sum())
    return Outcome(claim.output, units, 0, _count_cells(dataset))


def _count_cells(dataset: xarray.Dataset) -> dict[Status, int]:
    found = Counter(dataset["status"].values.ravel().tolist())
    return {status: found[int(status)] for status in Status if found[int(status)]}


def _notify_start(claim: Claim, plan: _Plan, damaged: int, notify: Notify) -> None:
    """Say what was found before the first round."""
    for remark in claim.remarks:
        notify(remark)
    if damaged:
        notify(f"{damaged} damaged lines in the shards are left out, their units run again")
    if plan.known:
        notify(f"{plan.known} of {plan.planned} units are finished already")
