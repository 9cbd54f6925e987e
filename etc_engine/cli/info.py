"""``etc-engine info``: where a result file comes from and what is in it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    import xarray


@click.command("info")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--study", is_flag=True, help="Print the study file the result was made from, and nothing else.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def info_command(file: Path, study: bool, as_json: bool) -> None:
    """Print the provenance of FILE: study, seed, versions, commit, command, hosts, times, and how cells ended.

    `etc-engine info FILE.nc --study > again.toml` gives the study back, ready to be run again.
    """
    from etc_engine.sweep.dataset import open_dataset

    dataset = open_dataset(file)
    if study:
        click.echo(dataset.attrs["study"], nl=False)
    elif as_json:
        click.echo(json.dumps(describe(dataset)))
    else:
        for line in _lines(describe(dataset)):
            click.echo(line)


def describe(dataset: xarray.Dataset) -> dict[str, Any]:
    """Provenance and content of a sweep's dataset, as plain values."""
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
        "dimensions": {str(name): size for name, size in dataset.sizes.items()},
        "units": int((dataset["worker_rank"] >= 0).sum()),
        "cells": {s.name.lower(): int((status == s).sum()) for s in Status if (status == s).any()},
        "pack_seconds": float(dataset["pack_seconds"].sum()),
        "solve_seconds": float(dataset["solve_seconds"].sum()),
    }


def _lines(found: dict[str, Any]) -> list[str]:
    plain = ("name", "seed", "source", "commit", "command", "hosts", "started", "ended", "study_digest", "units")
    lines = [f"{key:13} {found[key]}" for key in plain]
    for key in ("dimensions", "cells", "versions"):
        lines.append(f"{key:13} " + ", ".join(f"{name} {value}" for name, value in found[key].items()))
    lines.append(f"{'computing':13} packing {found['pack_seconds']:.3g} s, solving {found['solve_seconds']:.3g} s")
    for run in found["runs"]:
        job = f", {run['job']}" if run["job"] else ""
        lines.append(f"{'run':13} {run['started']} on {run['host']}, {run['ranks']} ranks{job}: {run['command']}")
    for table, values in found["study"].items():
        rows = values if isinstance(values, dict) else {"": values}
        lines += [f"{'study':13} {table}{'.' * bool(key)}{key} = {json.dumps(value)}" for key, value in rows.items()]
    return lines
