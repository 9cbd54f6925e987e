"""``etc-engine rerun``: one realization of a result file again, and whether its bits agree."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from etc_engine.sweep.rerun import Comparison
    from etc_engine.sweep.sweep import Realize

EXIT_DIFFERENT = 1


@click.command("rerun")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--density", type=float, help="Density of the cell. Needed where the file has several.")
@click.option("--realization", type=int, required=True, help="Number of the realization, from 0.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def rerun_command(file: Path, density: float | None, realization: int, as_json: bool) -> int:
    """Run one realization of FILE again, with all its contact angles and methods.

    Reports for each variable whether its bits are the same. Exit status: 0 all agree, 1 some differ, 2 refused.
    """
    return compare_again(file, density, realization, as_json)


def compare_again(
    file: Path, density: float | None, realization: int, as_json: bool, realize: Realize | None = None
) -> int:
    """Run a realization again and report the result; ``realize`` may be a stand-in."""
    from etc_engine import realization as real
    from etc_engine.durable.provenance import versions
    from etc_engine.sweep.rerun import rerun
    from etc_engine.sweep.result_file import open_dataset

    dataset = open_dataset(file)
    comparison = rerun(dataset, density, realization, realize or real.realize)
    then, now = json.loads(dataset.attrs["versions"]), versions()
    changed = {name: [then.get(name), now.get(name)] for name in now if then.get(name) != now.get(name)}
    if as_json:
        click.echo(json.dumps(_plain(comparison, changed)))
    else:
        _tell(comparison, changed)
    return 0 if comparison.same else EXIT_DIFFERENT


def _plain(comparison: Comparison, changed: dict[str, list[str]]) -> dict[str, Any]:
    return {
        "density": comparison.density,
        "realization": comparison.realization,
        "same": comparison.same,
        "variables": comparison.agree,
        "changed_versions": changed,
        "status": comparison.found["status"].values.ravel().tolist(),
    }


def _tell(comparison: Comparison, changed: dict[str, list[str]]) -> None:
    click.echo(f"density {comparison.density:.12g}, realization {comparison.realization}")
    for name, same in comparison.agree.items():
        words = "same bits"
        if not same:
            stored, found = (part[name].values.ravel().tolist() for part in (comparison.stored, comparison.found))
            words = f"DIFFERENT: {stored} in the file, {found} now"
        click.echo(f"  {name:24} {words}")
    click.echo("all bits agree" if comparison.same else "the bits differ")
    for name, (before, after) in changed.items():
        click.echo(f"etc-engine: {name} was {before} and is {after} now", err=True)
