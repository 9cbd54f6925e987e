"""etc-engine transient: run a transient study file and write its dataset."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from etc_engine.errors import InputError, OutputError, StudyError

if TYPE_CHECKING:
    import xarray

    from etc_engine.study.transient import NetworkStudy
    from etc_engine.transient.run import Transient

EXIT_RESUMABLE = 75


@dataclass(frozen=True)
class Wanted:
    """What the command line asks for besides the study."""

    study: Path
    text: str
    output: Path
    resume: bool
    overwrite: bool
    plot: Path | None
    vtk: Path | None


@click.command("transient")
@click.argument("study", type=click.Path(path_type=Path))
@click.option("-o", "--output", "output", required=True, type=click.Path(path_type=Path), help="netCDF file to write.")
@click.option("--overwrite", is_flag=True, help="Replace an existing output file, or states of one.")
@click.option("--resume", is_flag=True, help="Continue from the last written state (kind network).")
@click.option("--plot", type=click.Path(path_type=Path), help="Panel picture (kind network).")
@click.option("--vtk", type=click.Path(path_type=Path), help="VTK series (.pvd) for ParaView (kind network).")
def transient_command(
    study: Path, output: Path, overwrite: bool, resume: bool, plot: Path | None, vtk: Path | None
) -> int:
    """Run the transient STUDY (a TOML file with schema and kind) and write the fields to a netCDF file."""
    content, text = read_study(study)
    if overwrite and resume:
        raise InputError("--resume continues with what is there and --overwrite replaces it: choose one")
    if output.is_file() and not (overwrite or resume):
        raise OutputError(f"{output} exists: choose another name or give --overwrite")
    if not output.parent.is_dir():
        raise OutputError(f"the folder {output.parent} does not exist: create it first")
    return KINDS[content["kind"]](content, Wanted(study, text, output, resume, overwrite, plot, vtk))


def _run_meshless(content: dict[str, Any], wanted: Wanted) -> int:
    from etc_engine.cli.options import check_netcdf, check_place
    from etc_engine.durable.files import replacing
    from etc_engine.study.meshless import run_study

    for name, given in (("--resume", wanted.resume), ("--plot", wanted.plot), ("--vtk", wanted.vtk)):
        if given:
            raise InputError(f"{name} is only valid with studies of kind 'network', this one is of kind 'meshless'")
    check_place(wanted.output, wanted.study, replaces_result=True)
    check_netcdf(wanted.output)
    result = run_study(content, str(wanted.study))
    with replacing(wanted.output) as file:
        result.assign_attrs(study_file=wanted.text).to_netcdf(file)
    click.echo(f"{wanted.output}: {dict(result.sizes)}", err=True)
    return 0


def _run_network(content: dict[str, Any], wanted: Wanted) -> int:
    from etc_engine.cli.progress import PackingProgress
    from etc_engine.durable.files import replacing
    from etc_engine.output.series import series_dataset
    from etc_engine.study.transient import parse_study
    from etc_engine.transient.run import run_transient
    from etc_engine.transient.states import remove_states, state_folder, state_path

    study = parse_study(content, str(wanted.study))
    _check_outputs(study, wanted)
    states = state_folder(wanted.output)
    if wanted.resume and wanted.output.exists() and not states.exists():
        return _finish(study, wanted)
    if states.exists() and not (wanted.resume or wanted.overwrite):
        raise OutputError(f"{states} holds states of a former run: give --resume or --overwrite")
    try:
        with PackingProgress("marching") as progress:
            done = run_transient(
                study, wanted.study.parent, wanted.output, resume=wanted.resume, progress=progress.report
            )
    except InputError as error:
        # a refused study leaves nothing behind, unless there is more than the start to continue from
        if not wanted.resume and not state_path(states, 1).exists():
            remove_states(wanted.output)
        if isinstance(error, StudyError) and str(wanted.study) not in str(error):
            raise StudyError(f"{wanted.study}: {error}") from None
        raise
    if done.stopped:
        click.echo(
            f"etc-engine: stopped early ({done.stopped}): {len(done.states)} of {done.times.size} states are "
            f"kept, continue with --resume",
            err=True,
        )
        return EXIT_RESUMABLE
    _warn_of_digits(study, done)
    series = series_dataset(done, wanted.text)
    _draw(series, wanted)
    with replacing(wanted.output) as file:
        series.to_netcdf(file)
    remove_states(wanted.output)
    last, unit = done.states[-1], series["stored_heat"].attrs["units"]
    click.echo(
        f"{wanted.output}: {done.network.packing.count} particles, {len(done.states)} times"
        f"{f' ({done.resumed} of them from before)' if done.resumed else ''}, {last.steps} steps, "
        f"heat stored {last.stored:.6g} {unit}, imbalance {last.imbalance:.1e} {unit}",
        err=True,
    )
    return 0


def _warn_of_digits(study: NetworkStudy, done: Transient) -> None:
    """What the reader decided, and contacts that the printed digits of the first or the last frame do not decide."""
    from etc_engine.cli.particle_options import warn
    from etc_engine.medium.rules import find_rule
    from etc_engine.medium.sample_warnings import digit_warnings

    for note in done.tables[0].notes if done.tables else ():
        click.echo(f"etc-engine: note: {note}", err=True)
    values = study.contacts.values()
    bonded = find_rule(study.contacts.rule).takes_gap
    for table in dict.fromkeys((done.tables[0], done.tables[-1]) if done.tables else ()):
        warn(digit_warnings(table, values.get("bond_gap", 0.0) if bonded else 0.0, bonded=bonded))


def _check_outputs(study: NetworkStudy, wanted: Wanted) -> None:
    """Refuse what cannot be written, or would replace an input, before the work begins."""
    from etc_engine.cli.options import check_netcdf, check_picture, check_place
    from etc_engine.output.series import check_vtk_series
    from etc_engine.study.transient import FileTable

    inputs = [wanted.study]
    if isinstance(study.packing, FileTable):
        inputs.append(wanted.study.parent / study.packing.files)
    if wanted.plot is not None:
        check_picture(wanted.plot)
    if wanted.vtk is not None:
        check_vtk_series(wanted.vtk, overwrite=wanted.overwrite)
        folder = wanted.vtk.with_suffix("").resolve()
        if any(path.resolve().parent == folder for path in inputs):
            raise OutputError(f"the frames of {wanted.vtk} go to the folder of the input: choose another name")
    for path in (wanted.output, wanted.plot, wanted.vtk):
        if path is not None:
            check_place(path, *inputs, replaces_result=path == wanted.output)
    check_netcdf(wanted.output)


def _finish(study: NetworkStudy, wanted: Wanted) -> int:
    """A complete output: check that it belongs to this study, and draw the pictures asked for."""
    import json

    from etc_engine.sweep.claim import refuse_other_study
    from etc_engine.sweep.result_file import open_dataset

    series = open_dataset(wanted.output)
    found = json.loads(series.attrs.get("study_resolved", "{}"))
    refuse_other_study(study, series.attrs["study_digest"], found, str(wanted.output))
    drawn = _draw(series, wanted)
    click.echo(f"{wanted.output} is complete: {drawn or 'nothing is left to do'}", err=True)
    return 0


def _draw(series: xarray.Dataset, wanted: Wanted) -> str:
    """Write the picture and the VTK series that are asked for; what was written, in words."""
    from etc_engine.durable.files import replacing
    from etc_engine.output.series import write_vtk_series

    if wanted.plot is not None:
        from etc_engine.output.figures.transient import save_transient

        with replacing(wanted.plot) as file:
            save_transient(series, file)
    if wanted.vtk is not None:
        write_vtk_series(wanted.vtk, series)
    written = [str(path) for path in (wanted.plot, wanted.vtk) if path is not None]
    return f"{' and '.join(written)} drawn from it" if written else ""


KINDS: dict[str, Callable[[dict[str, Any], Wanted], int]] = {"meshless": _run_meshless, "network": _run_network}
"""What runs a study, by its kind; returns the exit status."""


def read_study(path: Path) -> tuple[dict[str, Any], str]:
    """A study file's content and text, with a kind that is known.

    Raises
    ------
    StudyError
        If the file cannot be read, is not TOML, is of an older schema or of no known kind.
    """
    from etc_engine.study.files import parse_toml, read_text

    text = read_text(path)
    content = parse_toml(text, str(path))
    kind = content.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        found = "missing" if kind is None else f"found {kind!r}"
        raise StudyError(f"{path}: kind: {found}, allowed: {', '.join(KINDS)}")
    return content, text
