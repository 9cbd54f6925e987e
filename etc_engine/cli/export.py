"""``etc-engine export``: the conductivity of a sweep for another program."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click


class _Format(click.ParamType):
    """A row of the exports, which are imported when one is asked for."""

    name = "format"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """The word, if there is such a row."""
        from etc_engine.output.exports import EXPORTS

        if value not in EXPORTS:
            self.fail(f"{value!r} is not one of {', '.join(EXPORTS)}", param, ctx)
        return str(value)

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str:  # noqa: ARG002 - of the base class
        """The words, for the help."""
        from etc_engine.output.exports import EXPORTS

        return f"[{'|'.join(EXPORTS)}]"


@click.command("export")
@click.argument("result", type=click.Path(path_type=Path))
@click.option("--to", "form", type=_Format(), required=True, help="Format of the file.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="File to write. By default standard output.")
@click.option("--at", "fixed", multiple=True, metavar="NAME=VALUE", help="Keep one value of a dimension of the sweep.")
def export_command(result: Path, form: str, output: Path | None, fixed: tuple[str, ...]) -> None:
    """Write the conductivity of the sweep in RESULT (netCDF) over temperature for another program.

    The file holds means with their confidence intervals, and a polynomial in temperature. Its order is
    the lowest one that stays within the intervals. The comments state its residual.

    csv: every cell. moose: input blocks. comsol: an interpolation file. openfoam: the transport dictionary of a solid.
    """
    from etc_engine.cli.options import check_place
    from etc_engine.durable.files import replacing
    from etc_engine.errors import InputError
    from etc_engine.output.exports import EXPORTS, curves_of
    from etc_engine.sweep.result_file import open_dataset

    at: dict[str, str] = {}
    for setting in fixed:
        name, equals, value = setting.partition("=")
        if not equals or not name.strip() or not value.strip():
            raise InputError(f"--at takes NAME=VALUE, such as density=0.62: found {setting!r}")
        if name.strip() in at:
            raise InputError(f"--at {name.strip()} is given twice")
        at[name.strip()] = value.strip()
    if output is not None:
        check_place(output, result)
    curves, source = curves_of(open_dataset(result), at)
    text = EXPORTS[form](curves, source)
    if output is None:
        click.echo(text, nl=False)
        return
    with replacing(output) as file:
        file.write_text(text, encoding="utf-8")
    click.echo(f"{output}: {len(curves)} curve{'s' if len(curves) > 1 else ''}, {form}")
