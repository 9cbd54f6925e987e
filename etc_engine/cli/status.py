"""``etc-engine status``: studies of a service."""

from __future__ import annotations

from pathlib import Path

import click

from etc_engine.cli.remote import connect, progress_of, server_options, shown


@click.command("status")
@click.argument("study", required=False)
@server_options
@click.option("--cancel", is_flag=True, help="Cancel the study. Finished units are kept.")
@click.option("--resume", is_flag=True, help="Continue a study that was cancelled or has failed.")
@click.option("--remove", is_flag=True, help="Delete the study and all its files. Cancel a running study first.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def status_command(
    study: str | None, server: str, token_file: Path | None, cancel: bool, resume: bool, remove: bool, as_json: bool
) -> None:
    """Show the queue of a service, or state, progress and log of one STUDY (its identity)."""
    from etc_engine.cli.options import print_json
    from etc_engine.service import client

    place = connect(server, token_file)
    if study is None:
        if cancel or resume or remove:
            raise click.UsageError("--cancel, --resume and --remove need the identity of a study")
        found = client.studies(place)
        if as_json:
            print_json({"studies": found})
        else:
            click.echo("\n".join(map(progress_of, found)) or "no studies")
        return
    if cancel + resume + remove > 1:
        raise click.UsageError("--cancel, --resume and --remove exclude each other")
    if remove:
        client.remove(place, study)
        if as_json:
            print_json({"id": study, "state": "removed"})
        else:
            click.echo(f"{study}  removed")
        return
    if cancel:
        client.cancel(place, study)
    if resume:
        client.resume(place, study)
    one = client.status(place, study)
    if as_json:
        print_json(one)
    else:
        click.echo(progress_of(one))
        for line in one["log"].splitlines():
            click.echo(shown(line))
