"""``etc-engine sweep``: a study on all ranks, into one netCDF file."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from etc_engine.errors import EtcError

if TYPE_CHECKING:
    from etc_engine.batch.claim import Policy
    from etc_engine.batch.scheduler import Communicator
    from etc_engine.batch.sweep import Outcome, Realize

EXIT_FAILED_CELLS = 4
EXIT_RESUMABLE = 75


@click.command("sweep")
@click.argument("study", type=click.Path(path_type=Path))
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="netCDF file to write.")
@click.option("--resume", is_flag=True, help="Go on where an earlier run stopped; starts anew if there is none.")
@click.option("--overwrite", is_flag=True, help="Start anew and replace what is there.")
def sweep_command(study: Path, output: Path, resume: bool, overwrite: bool) -> int:
    """Run all realizations of STUDY (a TOML file) and write one dataset.

    Under mpirun every rank computes; the result has the same bits for any number of ranks. Finished units
    are kept beside the output until it is complete. Exit status: 0 done, 2 refused, 4 done with failed
    realizations, 75 stopped early, to be gone on with by --resume.
    """
    if resume and overwrite:
        raise click.UsageError("--resume and --overwrite exclude each other")
    return launch(study, output, "resume" if resume else "overwrite" if overwrite else "fresh")


def launch(study: Path, output: Path, policy: Policy, realize: Realize | None = None) -> int:
    """Run a sweep on the ranks that were started; answers the exit status. ``realize`` may be a stand-in."""
    from etc_engine.batch.scheduler import connect

    communicator = connect()
    try:
        return _run(study, output, policy, communicator, realize)
    except EtcError:
        if communicator.rank == 0:
            raise
        return 2  # every rank has the same error, one tells it
    except BaseException as error:
        if communicator.size == 1:
            raise
        what = f"unexpected {type(error).__name__} on rank {communicator.rank}: {error}"
        click.echo(f"etc-engine: {what}; finished units are kept, see --resume", err=True)
        communicator.abort(1)


def _run(study: Path, output: Path, policy: Policy, communicator: Communicator, realize: Realize | None) -> int:
    from etc_engine import realization
    from etc_engine.batch.sweep import sweep
    from etc_engine.cli.progress import Progress

    started = time.monotonic()
    with Progress() as progress:
        outcome = sweep(
            study,
            output,
            policy,
            communicator,
            realize or realization.realize,
            report=progress.report,
            notify=progress.notify,
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
            "are kept, go on with --resume",
            err=True,
        )
        return
    cells = ", ".join(f"{n} {status.name.lower()}" for status, n in outcome.cells.items())
    click.echo(
        f"{outcome.output}: {outcome.units} units ({outcome.computed} computed now on {ranks} "
        f"rank{'s' * (ranks > 1)} in {seconds:.1f} s); cells: {cells}"
    )
    if outcome.failed:
        click.echo(f"etc-engine: {outcome.failed} cells have no conductivity, see `message` in the file", err=True)
