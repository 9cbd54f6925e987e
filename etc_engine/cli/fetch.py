"""``etc-engine fetch``: a result from a service."""

from __future__ import annotations

from pathlib import Path

import click

from etc_engine.cli.remote import connect, server_options
from etc_engine.errors import InputError

PARTS = {".nc": "result.nc", ".html": "report.html"}


@click.command("fetch")
@click.argument("study")
@server_options
@click.option(
    "-o",
    "--output",
    required=True,
    type=click.Path(path_type=Path),
    help="File to write: .nc, or .html for the report.",
)
def fetch_command(study: str, server: str, token_file: Path | None, output: Path) -> None:
    """Write the result of a finished STUDY (its identity) to a file."""
    from etc_engine.cli.options import check_place
    from etc_engine.service import client

    part = PARTS.get(output.suffix)
    if part is None:
        raise InputError(f"a result is written as .nc, its report as .html: found {str(output)!r}")
    check_place(output, replaces_result=True)
    client.download(connect(server, token_file), study, output, part)
    click.echo(f"{output}: {output.stat().st_size / 1e6:.2g} MB")
