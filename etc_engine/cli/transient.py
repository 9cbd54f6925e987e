"""etc-engine transient: run a transient study file and write its dataset."""

from __future__ import annotations

import os
import tempfile
import tomllib
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from etc_engine.errors import OutputError, StudyError

if TYPE_CHECKING:
    import xarray

#: kind of study -> "module:function", a function from the parsed TOML file to a dataset.
KINDS = {"meshless": "etc_engine.meshless.study:run_study"}


@click.command("transient")
@click.argument("study", type=click.Path(path_type=Path))
@click.option("-o", "--output", "output", required=True, type=click.Path(path_type=Path), help="netCDF file to write.")
@click.option("--overwrite", is_flag=True, help="Replace an existing output file.")
def transient_command(study: Path, output: Path, overwrite: bool) -> None:
    """Run the transient STUDY (a TOML file with schema and kind) and write the fields to a netCDF file."""
    content, text = read_study(study)
    if output.exists() and not overwrite:
        raise OutputError(f"{output} exists: choose another name or give --overwrite")
    if not output.parent.is_dir():
        raise OutputError(f"the folder {output.parent} does not exist: create it first")
    module, function = KINDS[content["kind"]].split(":")
    result = getattr(import_module(module), function)(content)
    write_dataset(result.assign_attrs(study_file=text), output)
    click.echo(f"{output}: {dict(result.sizes)}", err=True)


def read_study(path: Path) -> tuple[dict[str, Any], str]:
    """A study file's content and text, its ``schema`` and ``kind`` checked.

    Raises
    ------
    StudyError
        If the file cannot be read, is not TOML, or is of no known schema or kind.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise StudyError(f"the study {path} cannot be read: {error}") from error
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise StudyError(f"{path} is not a TOML file: {error}") from error
    if content.get("schema") != 1:
        raise StudyError(f"{path}: schema = 1 is expected, found {content.get('schema')!r}")
    if content.get("kind") not in KINDS:
        raise StudyError(f"{path}: kind = {content.get('kind')!r} is unknown: expected one of {', '.join(KINDS)}")
    return content, text


def write_dataset(result: xarray.Dataset, output: Path) -> None:
    """Write to a temporary file beside the output, then rename: a file is there whole or not at all.

    Raises
    ------
    OutputError
        If the folder does not let itself be written to.
    """
    try:
        handle, name = tempfile.mkstemp(prefix=f".{output.name}.", suffix=".tmp", dir=output.parent)
        os.close(handle)
        temporary = Path(name)
        try:
            result.to_netcdf(temporary)
            temporary.replace(output)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"{output} cannot be written: {error}") from error
