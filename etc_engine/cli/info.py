"""``etc-engine info``: where a file comes from and what is in it."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from etc_engine.errors import InputError, OutputError

if TYPE_CHECKING:
    import xarray

NETCDF = (b"\x89HDF", b"CDF")
WIDTH = 13
LONG = ("study", "study_resolved", "study_file", "versions", "runs")
"""Attributes that are printed as tables, or with --study."""


@click.command("info")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--study", is_flag=True, help="Print the study file the result was made from, and nothing else.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def info_command(file: Path, study: bool, as_json: bool) -> None:
    """Print what FILE holds and where it comes from: a sweep, a transient, a single solve, a packing, a dump.

    Of results: study, seed, versions, commit, command, hosts, times, and how cells ended.

    etc-engine info FILE.nc --study > again.toml writes the study again, ready to run.
    """
    from etc_engine.cli.options import print_json

    dataset = _load(file)
    if study:
        text = "" if dataset is None else dataset.attrs.get("study", dataset.attrs.get("study_file", ""))
        if not text:
            raise InputError(f"{file} was made without a study file")
        click.echo(text, nl=False)
        return
    found = describe_particles(file) if dataset is None else describe(dataset, str(file))
    if as_json:
        print_json(found)
    else:
        for line in _lines(found):
            click.echo(line)


def describe(dataset: xarray.Dataset, place: str = "the file") -> dict[str, Any]:
    """Provenance and content of a dataset that the engine wrote, as plain values.

    Raises
    ------
    OutputError
        If it is none of the engine's.
    """
    for kind in KINDS:
        if kind.recognises(dataset):
            return {"kind": kind.name} | kind.describe(dataset)
    raise OutputError(f"{place} is not the result of a command of this engine: it is none of {_known()}")


def describe_particles(path: Path) -> dict[str, Any]:
    """What a particle file of any format holds.

    Raises
    ------
    InputError, OutputError
    """
    from etc_engine.particle_files.formats import count_frames, format_to_read

    if not path.exists():
        raise OutputError(f"cannot read {path}: there is no file of that name")
    kind = format_to_read(path)
    return {"kind": f"particles ({kind.name})", "frames": count_frames(path)} | _particles(path)


def _particles(path: Path) -> dict[str, Any]:
    import numpy as np

    from etc_engine.box import AXES
    from etc_engine.particle_files.formats import read_rows

    rows = read_rows(path)
    sound = np.isfinite(rows.radii) & (rows.radii > 0.0) & np.isfinite(rows.positions).all(axis=1)
    if not sound.any():
        raise InputError(f"{path}: no particle has a finite centre and a finite, positive radius")
    radii, positions = rows.radii[sound], rows.positions[sound]
    low, high = positions.min(axis=0), positions.max(axis=0)
    found: dict[str, Any] = {"particles": len(rows.radii)}
    if not sound.all():
        found["unusable"] = (
            f"{np.count_nonzero(~sound)} of {sound.size}, first particle {int(np.argmin(sound))}: a centre must be "
            "finite, a radius finite and positive; the other commands refuse this file"
        )
    found |= {
        "radii": [float(radii.min()), float(radii.max())],
        "centres": {AXES[k]: [float(low[k]), float(high[k])] for k in range(low.size)},
    }
    if rows.bounds is not None:
        found["box"] = {AXES[k]: face for k, face in enumerate(rows.bounds.tolist())}
        found["periodic"] = "".join(axis for axis, flag in zip(AXES, rows.periodic or (), strict=False) if flag)
    given = {name: getattr(rows, name) for name in ("ids", "types", "conductivity", "temperature")}
    found["columns"] = [name for name, values in given.items() if values is not None]
    if rows.types is not None:
        found["types"] = sorted(set(rows.types.tolist()))
    if rows.printed is not None:
        found["significant_digits"] = max(column.digits.significant for column in rows.printed.positions)
    return found


def _load(path: Path) -> xarray.Dataset | None:
    """The dataset of a netCDF file; None if it is something else."""
    try:
        with path.open("rb") as file:
            opening = file.read(4)
    except FileNotFoundError:
        raise OutputError(f"cannot read {path}: there is no file of that name") from None
    except OSError as error:
        raise OutputError(f"cannot read {path}: {error.strerror or error}") from None
    if not opening.startswith(NETCDF):
        if path.suffix == ".nc":
            raise OutputError(f"cannot read {path}: it is damaged or no netCDF file")
        return None
    from etc_engine.sweep.result_file import load_netcdf

    return load_netcdf(path)


def _sweep(dataset: xarray.Dataset) -> dict[str, Any]:
    from etc_engine.realization import Status

    attributes, status = dataset.attrs, dataset["status"].values
    return {
        "name": json.loads(attributes["study_resolved"])["name"],
        "seed": int(attributes["seed"]),
        "source": attributes["source"],
        "commit": attributes["commit"],
        "command": attributes["command"],
        "hosts": attributes["hosts"],
        "started": attributes["started"],
        "ended": attributes["ended"],
        "runs": json.loads(attributes["runs"]),
        "versions": json.loads(attributes["versions"]),
        "study": json.loads(attributes["study_resolved"]),
        "study_digest": attributes["study_digest"],
        "dimensions": _sizes(dataset),
        "units": int((dataset["worker_rank"] >= 0).sum()),
        "cells": {s.name.lower(): int((status == s).sum()) for s in Status if (status == s).any()},
        "pack_seconds": float(dataset["pack_seconds"].sum()),
        "solve_seconds": float(dataset["solve_seconds"].sum()),
    }


def _transient(dataset: xarray.Dataset) -> dict[str, Any]:
    times = dataset["time"].values
    found = _plain(dataset.attrs)
    found["times"] = [float(times[0]), float(times[-1])] if times.size else []
    return found | _tables(dataset) | {"dimensions": _sizes(dataset), "variables": list(map(str, dataset.data_vars))}


def _general(dataset: xarray.Dataset) -> dict[str, Any]:
    variables = list(map(str, dataset.data_vars))
    return _plain(dataset.attrs) | _tables(dataset) | {"dimensions": _sizes(dataset), "variables": variables}


def _tables(dataset: xarray.Dataset) -> dict[str, Any]:
    """Attributes that hold JSON."""
    found = {}
    for name, key in (("versions", "versions"), ("study_resolved", "study")):
        if name in dataset.attrs:
            found[key] = json.loads(dataset.attrs[name])
    return found


def _plain(attributes: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in attributes.items() if name not in LONG}


def _sizes(dataset: xarray.Dataset) -> dict[str, int]:
    return {str(name): size for name, size in dataset.sizes.items()}


@dataclass(frozen=True)
class Kind:
    """A kind of file that the engine writes: how it is recognised, and how it is described."""

    name: str
    recognises: Callable[[xarray.Dataset], bool]
    describe: Callable[[xarray.Dataset], dict[str, Any]]


KINDS = (
    Kind("sweep", lambda data: "study_digest" in data.attrs and "worker_rank" in data, _sweep),
    Kind("transient of a network", lambda data: "study_digest" in data.attrs and "time" in data.dims, _transient),
    Kind("transient without mesh", lambda data: "study_file" in data.attrs and "time" in data.dims, _transient),
    Kind("homogenization", lambda data: "effective_conductivity" in data, _general),
    Kind("single solve", lambda data: "conductivity" in data.attrs and "particle" in data.dims, _general),
    Kind("packing", lambda data: {"box", "periodic"} <= set(data.attrs) and "radius" in data, _general),
)


def _known() -> str:
    return ", ".join(kind.name for kind in KINDS)


def _lines(found: dict[str, Any]) -> list[str]:
    lines = []
    for key, value in found.items():
        if key in ("runs", "study", "pack_seconds", "solve_seconds"):
            continue
        if isinstance(value, dict):
            text = ", ".join(f"{name} {item}" for name, item in value.items())
        elif isinstance(value, (list, tuple)):
            text = ", ".join(map(str, value)) or "none"
        else:
            text = str(value)
        lines.append(f"{key:{WIDTH}} {text}")
    if "pack_seconds" in found:
        lines.append(
            f"{'computing':{WIDTH}} packing {found['pack_seconds']:.3g} s, solving {found['solve_seconds']:.3g} s"
        )
    for run in found.get("runs", ()):
        job = f", {run['job']}" if run["job"] else ""
        lines.append(f"{'run':{WIDTH}} {run['started']} on {run['host']}, {run['ranks']} ranks{job}: {run['command']}")
    for table, values in found.get("study", {}).items():
        rows = values if isinstance(values, dict) else {"": values}
        for key, value in rows.items():
            lines.append(f"{'study':{WIDTH}} {table}{'.' * bool(key)}{key} = {json.dumps(value)}")
    return lines
