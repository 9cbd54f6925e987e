"""``etc-engine keys``: the keys of study files."""

from __future__ import annotations

from dataclasses import asdict

import click


@click.command("keys")
@click.argument("section", default="")
@click.option(
    "--study",
    "kind",
    default="sweep",
    show_default=True,
    metavar="sweep|files|transient|meshless",
    help="Kind of study file. files: a sweep over packings of your own.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def keys_command(section: str, kind: str, as_json: bool) -> None:
    """Print the keys of study files with type, unit and default.

    SECTION is a table of the study file, such as contacts. Without it all keys are printed.
    """
    from etc_engine.cli.options import print_json
    from etc_engine.study.reference import key_rows

    rows = key_rows(kind, section)
    if as_json:
        print_json({"study": kind, "keys": [asdict(row) for row in rows]})
        return
    width = max(len(row.key) for row in rows)
    for row in rows:
        meaning = f"{row.meaning}: " if row.meaning else ""
        default = (
            "needed" if row.default == "needed" else "optional" if row.default == "-" else f"default {row.default}"
        )
        click.echo(f"{row.key:{width}s}  {meaning}{row.allowed} ({default})")
    click.echo("The guide explains every key in words: studies/README.md, section Study files.")
