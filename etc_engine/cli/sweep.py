"""``etc-engine sweep``: a study on all ranks, into one netCDF file."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from etc_engine.durable.stop import signals_held_back
from etc_engine.errors import EtcError, OutputError

if TYPE_CHECKING:
    from etc_engine.sweep.claim import Policy
    from etc_engine.sweep.parts import Part
    from etc_engine.sweep.scheduler import Communicator
    from etc_engine.sweep.sweep import Outcome, Realize

EXIT_FAILED_CELLS = 4
EXIT_RESUMABLE = 75


class PartType(click.ParamType):
    """K/N as a `Part`."""

    name = "K/N"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Part:
        """The part that two numbers name."""
        from etc_engine.sweep.parts import Part

        number, _, count = str(value).partition("/")
        if not (number.isdecimal() and count.isdecimal() and 1 <= int(number) <= int(count)):
            self.fail(f"found {value!r}, expected K/N with 1 <= K <= N, such as 3/8", param, ctx)
        return Part(int(number), int(count))


@click.command("sweep")
@click.argument("study", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="netCDF file to write. Not needed with --dry-run."
)
@click.option("--resume", is_flag=True, help="Continue an earlier run. Starts anew if there is none.")
@click.option("--overwrite", is_flag=True, help="Start anew and replace what is there.")
@click.option(
    "--dry-run",
    is_flag=True,
    help="Print the number of units, the expected time and memory, and what is finished. Writes nothing.",
)
@click.option("--part", type=PartType(), help="Compute part K of N only. --resume without --part joins all parts.")
def sweep_command(
    study: Path, output: Path | None, resume: bool, overwrite: bool, dry_run: bool, part: Part | None
) -> int:
    """Run all realizations of STUDY (a TOML file) and write one dataset.

    Under mpirun every rank computes. The result has the same bits for any number of ranks. Finished units are kept
    beside the output until it is complete.

    Exit status: 0 done, 2 refused, 4 done with failed realizations, 75 stopped early (continue with --resume).
    """
    if resume and overwrite:
        raise click.UsageError("--resume and --overwrite exclude each other")
    if dry_run and part is not None:
        raise click.UsageError("--dry-run is of the whole study: leave out --part")
    if output is not None and output.exists() and study.exists() and output.samefile(study):
        raise OutputError(f"the output {output} is the study file itself: choose another name")
    from etc_engine.cli.options import check_netcdf, check_place

    if output is not None:
        check_netcdf(output)
    if dry_run:
        if output is not None:
            check_place(output, replaces_result=True)
        return _connected(lambda communicator, engine: _foretell(study, output, communicator, engine), None)
    if output is None:
        raise click.UsageError("Missing option '-o' / '--output'.")
    policy: Policy = "resume" if resume else "overwrite" if overwrite else "fresh"
    return launch(study, output, policy, part=part)


def launch(
    study: Path,
    output: Path,
    policy: Policy,
    realize: Realize | None = None,
    *,
    part: Part | None = None,
) -> int:
    """Run a sweep on the ranks that were started; returns the exit status. ``realize`` may be a stand-in."""
    with signals_held_back():
        return _connected(lambda communicator, engine: _run(study, output, policy, communicator, engine, part), realize)


def _connected(action: Callable[[Communicator, Realize], int], realize: Realize | None) -> int:
    """The exit status of an action on the ranks that were started; an unexpected error ends all of them."""
    from etc_engine import realization
    from etc_engine.sweep.scheduler import connect

    communicator = connect()
    try:
        return action(communicator, realize or realization.realize)
    except EtcError:
        if communicator.rank == 0:
            raise
        return 2  # every rank has the same error, one reports it
    except BaseException as error:
        if communicator.size == 1:
            raise
        what = f"unexpected {type(error).__name__} on rank {communicator.rank}: {error}"
        click.echo(f"etc-engine: {what}; finished units are kept, see --resume", err=True)
        communicator.abort(1)


def _run(
    study: Path, output: Path, policy: Policy, communicator: Communicator, realize: Realize, part: Part | None
) -> int:
    from etc_engine import realization
    from etc_engine.cli.progress import Progress
    from etc_engine.sweep.compilation import share_compilation
    from etc_engine.sweep.sweep import nothing, sweep

    started = time.monotonic()
    with Progress() as progress:
        outcome = sweep(
            study,
            output,
            policy,
            communicator,
            realize,
            report=progress.report,
            notify=progress.notify,
            prepare=share_compilation if realize is realization.realize else nothing,
            part=part,
        )
    communicator.close()
    if communicator.rank == 0:
        _tell(outcome, time.monotonic() - started, communicator.size)
    if outcome.stopped:
        return EXIT_RESUMABLE
    return EXIT_FAILED_CELLS if outcome.failed else 0


def _tell(outcome: Outcome, seconds: float, ranks: int) -> None:
    """The end of a sweep in one or two lines."""
    if outcome.stopped:
        click.echo(
            f"etc-engine: stopped early ({outcome.stopped}): {outcome.computed} units finished by this run "
            "are kept, continue with --resume",
            err=True,
        )
        return
    if outcome.part is not None:
        click.echo(
            f"{outcome.output}: {outcome.units} units of part {outcome.part} are finished ({outcome.computed} computed "
            f"now on {ranks} rank{'s' * (ranks > 1)} in {seconds:.1f} s); --resume without --part joins all parts"
        )
        return
    cells = ", ".join(f"{n} {status.name.lower()}" for status, n in outcome.cells.items())
    click.echo(
        f"{outcome.output}: {outcome.units} units ({outcome.computed} computed now on {ranks} "
        f"rank{'s' * (ranks > 1)} in {seconds:.1f} s); cells: {cells}"
    )
    if outcome.failed:
        reason = _commonest_message(outcome.output, failed=True)
        click.echo(
            f"etc-engine: {outcome.failed} cells have no conductivity, most often: {reason} (`message` in the file)",
            err=True,
        )
    elif {status.name for status, n in outcome.cells.items() if n} == {"NOT_PERCOLATING"}:
        reason = _commonest_message(outcome.output, failed=False)
        click.echo(
            f"etc-engine: warning: no packing conducts ({reason}): see the density, and the rule and gap of [contacts]",
            err=True,
        )
    rarefied = _rarefied(outcome.output)
    if rarefied is not None:
        click.echo(f"etc-engine: warning: {rarefied}", err=True)


def _rarefied(output: Path) -> str | None:
    from etc_engine.comparison.inputs import rarefied_words
    from etc_engine.sweep.result_file import open_dataset

    with open_dataset(output) as dataset:
        return rarefied_words(dataset)


def _commonest_message(output: Path, *, failed: bool) -> str:
    """What most cells of a result say, of those that failed or of those without a path."""
    from collections import Counter

    from etc_engine.realization import Status
    from etc_engine.sweep.result_file import open_dataset

    dataset = open_dataset(output)
    status = dataset["status"].values.ravel()
    wanted = (
        (status > Status.NOT_PERCOLATING) & (status < Status.NOT_RUN) if failed else status == Status.NOT_PERCOLATING
    )
    messages = Counter(str(text) for text, flag in zip(dataset["message"].values.ravel(), wanted, strict=True) if flag)
    return messages.most_common(1)[0][0] if messages else "no reason given"


def _foretell(study: Path, output: Path | None, communicator: Communicator, realize: Realize) -> int:
    """Print the forecast of a sweep; rank 0 probes, the others wait."""
    from functools import partial

    from etc_engine.sweep.forecast import forecast
    from etc_engine.sweep.scheduler import on_rank_zero

    found = on_rank_zero(communicator, partial(forecast, study, output, communicator.size, realize))
    communicator.close()
    if communicator.rank > 0:
        return 0
    costly, cheap = found.unit_seconds
    left = found.units - found.finished
    click.echo(f"units     {found.units} with {found.cells} cells, {found.finished} of them finished")
    if found.most_units > found.units:
        click.echo(f"          adaptive: at most {found.most_units} units")
    click.echo(f"found     {found.state}")
    click.echo(f"unit      {costly:.3g} s (densest), {cheap:.3g} s (thinnest), by a probe of each")
    click.echo(f"warm-up   {found.first_seconds:.3g} s")
    click.echo(f"time      about {found.seconds(left):.3g} s on {found.ranks} rank{'s' * (found.ranks > 1)}")
    if found.most_units > found.units:
        click.echo(f"          at most about {found.seconds(found.most_units - found.finished):.3g} s")
    click.echo(
        f"memory    {found.rank_bytes / 1e6:.0f} MB per rank; rank 0 {found.gathered_bytes / 1e6:.2g} MB more, for the "
        "results of all units"
    )
    click.echo(f"disk      {found.shard_bytes / 1e6:.2g} MB of shards, {found.dataset_bytes / 1e6:.2g} MB of result")
    for packing in found.packings:
        click.echo(f"packing   {packing}")
    for remark in found.remarks:
        click.echo(f"probe     {remark}")
    return 0
