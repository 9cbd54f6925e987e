"""``etc-engine compare``: the result of a sweep beside closed-form models and bounds."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    import xarray

    from etc_engine.comparison import Fit

EXIT_BOUND_BROKEN = 3
COLUMN = 18


@click.command("compare")
@click.argument("result", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="Figure to write: .png, .pdf or .svg. An existing figure is replaced.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def compare_command(result: Path, output: Path | None, as_json: bool) -> int:
    """Compare the sweep in RESULT (netCDF) with conductivity models.

    Prints the simulated mean with its confidence half-width and the estimated error of its method beside every model
    of the study, and constants fitted over the density. A closest model is named only where it lies outside that
    error. Exit status 3 if a rigorous bound is violated. Bounds hold for overlapping particles, and for whole
    cells with pores that conduct. Elsewhere they are only shown.
    """
    from etc_engine.cli.options import check_picture, check_place, print_json
    from etc_engine.comparison import evaluate_models, fit_models, model_lines
    from etc_engine.durable.files import replacing
    from etc_engine.errors import InputError
    from etc_engine.sweep.result_file import open_dataset

    if output is not None:
        check_picture(output)
        check_place(output, result)
    dataset = open_dataset(result)
    comparison, fits = evaluate_models(dataset), fit_models(dataset)
    if not (dataset["count"] > 0).any():
        raise InputError(f"{result} has no cell with a conductivity to compare: see `etc-engine info` and `message`")
    if output is not None:
        from etc_engine.output.figures import save_comparison

        with replacing(output) as file:
            save_comparison(comparison, model_lines(comparison), file)
    if as_json:
        print_json(_record(result, output, comparison, fits))
    else:
        _print_head(result, comparison)
        _print_table(comparison)
        _print_notes(comparison, int(((dataset["status"] > 1) & (dataset["status"] < 5)).sum()))
        _print_fits(fits)
        if output is not None:
            click.echo(f"figure: {output}")
    if comparison.attrs["bound_broken"]:
        _tell_broken(comparison)
        return EXIT_BOUND_BROKEN
    return 0


def _cells(comparison: xarray.Dataset) -> list[tuple[dict[str, Any], xarray.Dataset]]:
    """Every cell of the sweep with its labels, densities outermost."""
    from etc_engine.study.quantities import SWEPT

    dims = [dim for dim in SWEPT if dim in comparison["conductivity_mean"].dims]
    indices = itertools.product(*(range(comparison.sizes[dim]) for dim in dims))
    picked = [dict(zip(dims, index, strict=True)) for index in indices]
    return [
        (
            {
                dim: comparison[dim].values[i].item() if dim != "method" else str(comparison[dim].values[i])
                for dim, i in p.items()
            },
            comparison.isel(p),
        )
        for p in picked
    ]


def _record(result: Path, output: Path | None, comparison: xarray.Dataset, fits: tuple[Fit, ...]) -> dict[str, Any]:
    from dataclasses import asdict

    return {
        "result": str(result),
        "figure": None if output is None else str(output),
        **{key: comparison.attrs[key] for key in ("pore_conductivity", "particle_conductivity", "dimension")},
        "confidence_level": comparison["half_width"].attrs["confidence_level"],
        "bounds_bind": bool(comparison.attrs["bounds_bind"]),
        "bound_broken": bool(comparison.attrs["bound_broken"]),
        "best_model": comparison.attrs["best_model"] or None,
        "best_plain_model": comparison.attrs["best_plain_model"] or None,
        "within_error": comparison.attrs["within_error"].split(),
        "cells": [_cell_record(labels, cell) for labels, cell in _cells(comparison)],
        "fits": [
            asdict(fit) | {"parameters": [asdict(p) | {"determined": p.determined} for p in fit.parameters]}
            for fit in fits
        ],
    }


def _cell_record(labels: dict[str, Any], cell: xarray.Dataset) -> dict[str, Any]:
    interval = ("half_width", "conductivity_ci_low", "conductivity_ci_high")
    numbers = ("solid_fraction", "conductivity_mean", *interval, "method_error", "band_low", "band_high")
    return {
        **labels,
        **{name: float(cell[name]) for name in numbers},
        "count": int(cell["count"]),
        "inside_bounds": bool(cell["inside_bounds"]),
        "models": {
            str(name): {
                "conductivity": float(one["model_conductivity"]),
                "relative_difference": float(one["relative_difference"]),
                "kind": str(one["model_kind"].item()),
                "outside_bound": bool(one["outside_bound"]),
                "bound_broken": bool(one["bound_broken"]),
            }
            for name in cell["model"].values
            for one in [cell.sel({"model": name})]
        },
    }


def _print_head(result: Path, comparison: xarray.Dataset) -> None:
    from etc_engine.comparison.simulation import in_words

    level = comparison["half_width"].attrs["confidence_level"]
    pores, particles = (in_words(comparison.attrs[f"{name}_conductivity"]) for name in ("pore", "particle"))
    click.echo(f"{result}: particles of {particles} W/(m K), pores of {pores} W/(m K)")
    click.echo(
        "simulation: mean of the tensor's diagonal over n realizations +- half-width of its "
        f"{100 * level:g} % Student-t interval [W/(m K)]"
    )
    if bool(comparison["method_error"].notnull().any()):
        click.echo("error: estimated error of the method, of the discretization too [W/(m K)]; it adds to the interval")
    click.echo(
        "models: conductivity [W/(m K)] and relative difference to the simulation; * the simulation lies beyond it"
    )


def _shown(comparison: xarray.Dataset) -> list[str]:
    """The models that get a column: those with a value other than 0 somewhere."""
    values = comparison["model_conductivity"]
    return [str(name) for name in comparison["model"].values if bool((values.sel({"model": name}) > 0.0).any())]


def _print_table(comparison: xarray.Dataset) -> None:
    from etc_engine.study.quantities import SWEPT

    shown = _shown(comparison)
    dims = [dim for dim in SWEPT if dim in comparison["conductivity_mean"].dims]
    columns = [dim.split("_") for dim in dims] + [["solid", "fraction"], ["n"]]
    narrow = [max(9, 2 + max(map(len, dim.split("_")))) for dim in dims] + [9, 5]
    models = [name.split("_") for name in shown]
    simulation = [["simulation"]] + ([["error"]] if bool(comparison["method_error"].notnull().any()) else [])
    deep = max(map(len, [*columns, *models]))
    click.echo()
    for level in range(deep):
        line = "".join(_word(c, level, deep).rjust(w) for c, w in zip(columns, narrow, strict=True))
        line += "".join(_word(c, level, deep).rjust(w) for c, w in zip(simulation, (20, 9), strict=False))
        click.echo(line + "".join(_word(m, level, deep).rjust(COLUMN) for m in models))
    for labels, cell in _cells(comparison):
        words = [value if isinstance(value, str) else f"{value:.4g}" for value in labels.values()]
        words += [f"{float(cell['solid_fraction']):.4f}", str(int(cell["count"]))]
        line = "".join(word.rjust(w) for word, w in zip(words, narrow, strict=True))
        line += f"{_number(float(cell['conductivity_mean']))} +- {_number(float(cell['half_width']))}".rjust(20)
        line += _number(float(cell["method_error"])).rjust(9) if len(simulation) > 1 else ""
        click.echo(line + "".join(_model_words(cell.sel({"model": name})).rjust(COLUMN) for name in shown))


def _number(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.4f}"


def _word(words: list[str], level: int, deep: int) -> str:
    """Headings of several words stand on the bottom line of the head."""
    i = level - (deep - len(words))
    return words[i] if i >= 0 else ""


def _model_words(one: xarray.Dataset) -> str:
    value, difference = float(one["model_conductivity"]), float(one["relative_difference"])
    if math.isnan(value):
        return "-"
    mark = "*" if bool(one["outside_bound"]) else ""
    return f"{mark}{value:.4f} " + ("      -" if math.isnan(difference) else f"{100 * difference:+6.1f}%")


def _print_notes(comparison: xarray.Dataset, failed: int) -> None:
    from etc_engine.comparison.closest import closest_words

    click.echo()
    notes = dict(zip(comparison["model"].values.tolist(), comparison["model_note"].values.tolist(), strict=True))
    zero = [name for name, note in notes.items() if note.startswith("is 0")]
    if zero:
        click.echo(f"0 because the pores insulate: {', '.join(zero)}")
    for name, note in notes.items():
        if note and name not in zero:
            click.echo(f"{name}: {note}")
    if failed:
        click.echo(f"{failed} cells failed (status 2 to 4, see `message`): the means leave them out and may be biased")
    bound = "whole cells" if comparison.attrs["pores_conduct"] else "overlapping particles"
    if not comparison.attrs["bounds_bind"]:
        click.echo(f"bounds: only a comparison here: {comparison.attrs['bounds_unbound']}")
    elif comparison.attrs["bound_broken"]:
        click.echo(f"bounds: they hold for {bound}, and are broken")
    else:
        click.echo(f"bounds: they hold for {bound}, and no mean or realization breaks them")
    for line in closest_words(comparison):
        click.echo(line)


def _print_fits(fits: tuple[Fit, ...]) -> None:
    """Fits with constants, one per line; reasons why there is none, once each."""
    reasons: dict[str, str] = {}
    for fit in fits:
        where = ", ".join(f"{key} {value:g}" if key != "method" else str(value) for key, value in fit.selection.items())
        if not fit.parameters:
            reasons.setdefault(f"no fit of {fit.model}: {fit.note}", where)
            continue
        click.echo(f"fit of {fit.model}{f' ({where})' if where else ''}, {fit.points} densities: {fit.constants}")
    for reason in reasons:
        click.echo(reason)


def _tell_broken(comparison: xarray.Dataset) -> None:
    """The first broken bound, on stderr."""
    for labels, cell in _cells(comparison):
        where = ", ".join(f"{key} {value}" for key, value in labels.items())
        for name in cell["model"].values[cell["bound_broken"].values]:
            bound = float(cell["model_conductivity"].sel({"model": name}))
            text = f"{where}: {float(cell['conductivity_mean']):.6g} W/(m K) breaks {name} = {bound:.6g}"
            click.echo(f"etc-engine: a rigorous bound is broken at {text}", err=True)
            return
    total = int(comparison["realizations_outside_bounds"].sum())
    click.echo(f"etc-engine: {total} realizations break the Wiener bounds of their own solid fraction", err=True)
