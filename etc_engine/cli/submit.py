"""``etc-engine submit``: hand a study to a service."""

from __future__ import annotations

from pathlib import Path

import click

from etc_engine.cli.remote import connect, progress_of, server_options
from etc_engine.errors import InputError

EXIT_FAILED_CELLS = 4
EXIT_RESUMABLE = 75


@click.command("submit")
@click.argument("study", type=click.Path(path_type=Path))
@server_options
@click.option("--wait", "waiting", is_flag=True, help="Wait until the study has ended.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Wait, and write the result to this netCDF file.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def submit_command(
    study: Path, server: str, token_file: Path | None, waiting: bool, output: Path | None, as_json: bool
) -> int:
    """Hand in STUDY (a TOML file). Stdout gets its identity alone. Everything else goes to stderr.

    A study that was submitted before is not computed again. With --wait the exit status is that of `sweep`: 0
    done, 4 done with failed realizations, 75 ended without a result.
    """
    from etc_engine.cli.options import check_place, print_json
    from etc_engine.service import client
    from etc_engine.study.sweep import read_study

    _, text = read_study(study)
    if output is not None:
        if output.suffix != ".nc":
            raise InputError(f"a result is written as .nc: found {str(output)!r}")
        check_place(output, study, replaces_result=True)
    place = connect(server, token_file)
    found = client.submit(place, text)
    if not as_json:
        click.echo(found["id"])
    teller = _Teller()
    teller.tell(found)
    if waiting or output is not None:
        found = client.wait(place, found["id"], tell=teller.tell)
        if found["state"] == "done" and output is not None:
            client.download(place, found["id"], output)
    if as_json:
        print_json(found)
    if found["state"] in ("failed", "cancelled") and (waiting or output is not None):
        return EXIT_RESUMABLE
    return EXIT_FAILED_CELLS if found["failed_cells"] else 0


class _Teller:
    """Says on stderr what has changed."""

    def __init__(self) -> None:
        self._said = ""

    def tell(self, found: dict[str, object]) -> None:
        """Take in a status."""
        line = progress_of(found)
        if line != self._said:
            click.echo(line, err=True)
        self._said = line
