"""``etc-engine fetch``: a result from a service."""

from __future__ import annotations

from pathlib import Path

import click

from etc_engine.cli.remote import connect, server_options


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
    """Write the result of STUDY (its identity), which is done, to a file."""
    from etc_engine.cli.options import check_place
    from etc_engine.service import client

    check_place(output)
    part = "report.html" if output.suffix == ".html" else "result.nc"
    client.download(connect(server, token_file), study, output, part)
    click.echo(f"{output}: {output.stat().st_size / 1e6:.2g} MB")
