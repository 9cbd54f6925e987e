"""``etc-engine serve``: studies and single solves over HTTP."""

from __future__ import annotations

import math
import shlex
from pathlib import Path

import click

from etc_engine.errors import InputError

MOST_RANKS = 65_536


def _place(_context: click.Context, _option: click.Parameter, text: str) -> Path:
    """The data directory: no words at all would be the folder one happens to be in."""
    if not text.strip():
        raise click.BadParameter("found no name, expected a folder such as ~/etc-data")
    return Path(text)


def _number(_context: click.Context, _option: click.Parameter, value: float) -> float:
    """What a range does not refuse by itself: nan."""
    if math.isnan(value):
        raise click.BadParameter("found nan, expected a number of hours")
    return value


@click.command("serve")
@click.option("--data", required=True, callback=_place, help="Data directory: queue and results.")
@click.option(
    "--host",
    default="127.0.0.1",
    show_default=True,
    help="Address to listen on. Any address but the default needs a token.",
)
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=8765,
    show_default=True,
    help="Port to listen on. 0 takes a free one.",
)
@click.option("--ranks", type=click.IntRange(1, MOST_RANKS), default=1, show_default=True, help="MPI ranks of a study.")
@click.option("--launcher", type=click.Choice(["local", "slurm"]), default="local", show_default=True)
@click.option("--sbatch", default="", help="Further options of sbatch, such as '--partition=short --time=2:00:00'.")
@click.option(
    "--token-file", type=click.Path(path_type=Path), help="File with the token. By default ETC_ENGINE_TOKEN holds it."
)
@click.option("--allow-host", "hosts", multiple=True, help="Another name of this service, such as that of a proxy.")
@click.option(
    "--max-units",
    type=click.IntRange(1),
    default=100_000,
    show_default=True,
    help="Largest number of packings in a study.",
)
@click.option(
    "--max-particles",
    type=click.IntRange(1),
    default=1_000_000,
    show_default=True,
    help="Largest number of particles in a packing.",
)
@click.option(
    "--max-memory", type=click.IntRange(256), default=8192, show_default=True, help="Largest memory of a rank [MB]."
)
@click.option(
    "--max-hours",
    type=click.FloatRange(0.0, min_open=True),
    default=168.0,
    show_default=True,
    callback=_number,
    help="Longest run of a study [h].",
)
def serve_command(
    data: Path,
    host: str,
    port: int,
    ranks: int,
    launcher: str,
    sbatch: str,
    token_file: Path | None,
    hosts: tuple[str, ...],
    max_units: int,
    max_particles: int,
    max_memory: int,
    max_hours: float,
) -> None:
    """Serve studies and single solves over HTTP, with a web page.

    Studies wait in a queue and run one after the other as `sweep --resume` under mpiexec, or through Slurm. The service
    may be stopped or killed at any moment and continues after a restart. Needs the extra 'service'.
    """
    try:
        from etc_engine.service.server import serve
    except ModuleNotFoundError as error:
        raise InputError(
            f"the service needs {error.name}: install it with pip install '.[service]' in the folder of etc_engine"
        ) from None
    from etc_engine.service.accounts import exposures
    from etc_engine.service.launchers import find_mpiexec
    from etc_engine.service.settings import Limits, Settings
    from etc_engine.service.token import read_token, readable_by_others

    limits = Limits(
        units=max_units,
        cells=10 * max_units,
        particles=max_particles,
        memory_bytes=max_memory * 10**6,
        study_seconds=3600.0 * max_hours,
    )
    settings = Settings(
        data=data,
        host=host,
        port=port,
        ranks=ranks,
        launcher="slurm" if launcher == "slurm" else "local",
        token=read_token(token_file),
        hosts=tuple(name.lower() for name in hosts),
        sbatch=_words(sbatch),
        limits=limits,
    )
    if token_file is not None and readable_by_others(token_file):
        click.echo(f"etc-engine: others can read the token in {token_file}: chmod 600 {token_file}", err=True)
    if settings.launcher == "local" and ranks > 1 and find_mpiexec() is None:
        click.echo("etc-engine: no mpiexec is found: studies run on one process (extra 'mpi')", err=True)

    def ready(address: str) -> None:
        for line in (*exposures(settings), f"serving {data} on {address}"):
            click.echo(f"etc-engine: {line}", err=True)

    serve(settings, ready)


def _words(text: str) -> tuple[str, ...]:
    """The words of an option that holds options."""
    try:
        return tuple(shlex.split(text))
    except ValueError as error:
        raise InputError(f"--sbatch {text!r}: {error}") from None
