"""A sweep as one self-contained HTML page: no script, no style sheet, no picture is fetched from elsewhere."""

from __future__ import annotations

import base64
import itertools
import json
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from etc_engine.comparison.closest import closest_words
from etc_engine.comparison.sensitivity import sensitivities
from etc_engine.comparison.simulation import in_words
from etc_engine.realization import Status
from etc_engine.study.quantities import QUANTITIES, SWEPT, heading_of, word_of
from etc_engine.sweep.table import measured

if TYPE_CHECKING:
    import xarray

    from etc_engine.comparison.fits import Fit

READABLE = 0.85
"""Least width on a narrow screen over that of the picture: of 130 dots an inch, letters of 7 points are 10.7 pixels."""
STYLE = """
body { font: 15px/1.5 system-ui, "Segoe UI", Roboto, sans-serif; color: #1d2430; background: #fff;
       max-width: 1080px; margin: 0 auto; padding: 24px 28px 64px; }
h1 { font-size: 26px; margin: 0 0 4px; } h2 { font-size: 19px; margin: 40px 0 8px; border-bottom: 2px solid #e3e7ee; }
p { max-width: 78ch; } .faint { color: #5b6677; }
nav a { margin-right: 14px; color: #0a5c9e; text-decoration: none; }
dl.facts { display: grid; grid-template-columns: repeat(auto-fit, minmax(190px, 1fr)); gap: 10px; margin: 18px 0; }
dl.facts div { background: #f4f6fa; border-radius: 6px; padding: 8px 12px; }
dt { color: #5b6677; font-size: 12.5px; } dd { margin: 0; font-weight: 600; overflow-wrap: anywhere; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 13.5px; }
th, td { padding: 3px 10px; text-align: right; border-bottom: 1px solid #e8ebf0; white-space: nowrap; }
th { background: #f4f6fa; vertical-align: bottom; white-space: normal; }
td.text, th.text { text-align: left; white-space: normal; overflow-wrap: break-word; }
td.text:first-child { white-space: nowrap; }
tr.broken td { background: #fde8e6; } .bad { color: #b42318; font-weight: 600; }
img { max-width: 100%; min-width: 640px; height: auto; display: block; margin: 8px 0; }
@media (max-width: 560px) { body { padding: 16px 14px 40px; } nav a { display: inline-block; padding: 4px 0; }
       img { min-width: var(--readable); } }
pre { background: #f4f6fa; padding: 12px; border-radius: 6px; overflow-x: auto; font-size: 13px; }
@media print { nav { display: none; } h2 { break-after: avoid; } img, tr { break-inside: avoid; } }
"""


def report_page(
    dataset: xarray.Dataset,
    comparison: xarray.Dataset,
    fits: Sequence[Fit],
    systems: xarray.Dataset,
    pictures: Mapping[str, bytes],
    absent: str = "",
) -> str:
    """The HTML page of a sweep.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of a sweep.
    comparison : xarray.Dataset
        The models beside it.
    fits : sequence of Fit
        The fitted models.
    systems : xarray.Dataset
        Statistics of the same study over ``system``: boxes of several sizes, or this one alone.
    pictures : mapping of str to bytes
        PNG files: ``comparison``, ``convergence``, ``histograms``, ``bed`` where a packing could be made again,
        ``temperature`` with several temperatures, and with several systems ``systems``.
    absent : str
        Why there is no picture of the bed.

    Returns
    -------
    str
    """
    study = json.loads(dataset.attrs["study_resolved"])
    sections = (
        ("bed", "Bed", _bed(dataset, study, pictures, absent)),
        ("conductivity", "Conductivity", _picture(pictures["comparison"], "mean conductivity and models")),
        ("statistics", "Statistics", _statistics(dataset, comparison)),
        ("models", "Models and bounds", _models(comparison) + _fits(fits)),
        ("sensitivity", "Sensitivity", _sensitivity(comparison)),
        ("realizations", "Convergence with realizations", _convergence(comparison, pictures)),
        ("size", "Convergence with system size", _system_sizes(systems, pictures)),
        ("histograms", "Histograms", _picture(pictures["histograms"], "histograms of the conductivity")),
        ("failures", "Failures", _failures(dataset)),
        ("cost", "Cost", _cost(dataset)),
        ("provenance", "Provenance", _provenance(dataset)),
    )
    links = "".join(f'<a href="#{key}">{escape(title)}</a>' for key, title, _ in sections)
    body = "\n".join(f'<section id="{key}"><h2>{escape(title)}</h2>\n{text}</section>' for key, title, text in sections)
    name = escape(study["name"])
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{name}</title>'
        f'<meta name="viewport" content="width=device-width, initial-scale=1"><style>{STYLE}</style></head>\n<body>'
        f"<h1>{name}</h1><p class='faint'>Effective thermal conductivity over random realizations</p>"
        f"{_facts(dataset, comparison, study)}<nav>{links}</nav>\n{body}\n</body></html>\n"
    )


def _bed(dataset: xarray.Dataset, study: Mapping[str, Any], pictures: Mapping[str, bytes], absent: str) -> str:
    """A picture of the packing, and every condition of the study with its values."""
    picture = (
        _picture(pictures["bed"], "the packing of the first realization, made again from its random stream")
        if "bed" in pictures
        else f"<p class='faint'>No picture of the packing: {escape(absent)}.</p>"
    )
    rows = [
        [heading_of(name, dataset[name].attrs), in_words(dataset[name].values)]
        for name in QUANTITIES
        if name in dataset.coords
        and "realization" not in dataset[name].dims  # of contacts that were counted
        and dataset[name].dtype.kind == "f"
        and np.isfinite(dataset[name].values).all()
    ]
    named = [[key, words] for key, words in _conditions(study).items() if key in ("particles", "pores")]
    curves = _picture(pictures["temperature"], "conductivity over the temperature") if "temperature" in pictures else ""
    return picture + curves + "<p>Conditions:</p>" + _table(["quantity", "value"], named + rows, text_columns=(0, 1))


def _packing(packing: Mapping[str, Any]) -> str:
    """What made the packings, or the files that hold them."""
    return f"files {packing['files']}" if "files" in packing else f"{packing['method']}, {packing['radii']}"


def _facts(dataset: xarray.Dataset, comparison: xarray.Dataset, study: Mapping[str, Any]) -> str:
    status = dataset["status"].values
    failed = int(((status > Status.NOT_PERCOLATING) & (status < Status.NOT_RUN)).sum())
    particles = dataset["particles"].where(dataset["particles"] > 0)
    bound = "broken" if comparison.attrs["bound_broken"] else "kept"
    unbound = comparison.attrs["bounds_unbound"]
    box = " x ".join(f"{length:g}" for length in study["packing"]["box"])
    facts = {
        "packing": _packing(study["packing"]),
        "box [m]": f"{box}, {study['packing']['periodic'] or 'not'} periodic",
        "contacts": study["contacts"].get("rule", "none: the whole cell is solved"),
        **_conditions(study),
        "engine and method": f"{study['conduction']['engine']}, {_words(study['conduction']['method'])}",
        "particles of a realization": _number(float(particles.mean()), ".0f"),
        "realizations of a cell": _range(dataset["count"].values.ravel().tolist()),
        "failed cells": str(failed),
        "rigorous bounds": f"do not apply: {unbound}" if unbound else bound,
        "closest model": comparison.attrs["best_model"]
        or f"not named: {comparison.attrs['best_model_note'] or 'none'}",
    }
    items = "".join(f"<div><dt>{escape(key)}</dt><dd>{escape(value)}</dd></div>" for key, value in facts.items())
    return f"<dl class='facts'>{items}</dl>"


def _conditions(study: Mapping[str, Any]) -> dict[str, str]:
    """Solid, gas and radiation, where the study has them by name."""
    gas, emissivity = study["pores"].get("gas"), study["radiation"].get("emissivity")
    material = study["particles"].get("material")
    fractions = gas.items() if isinstance(gas, dict) else ()
    found = {
        "particles": material if isinstance(material, str) else "a table of the study" if material else "",
        "pores": ", ".join(f"{share:g} {name}" for name, share in fractions) if fractions else gas or "",
    }
    numbers = {
        "pressure [Pa]": study["pores"].get("pressure"),
        "temperature [K]": study["conduction"].get("temperature"),
        "emissivity": emissivity,
    }
    found |= {key: in_words(value) for key, value in numbers.items() if value is not None}
    return {key: words for key, words in found.items() if words}


def _sensitivity(comparison: xarray.Dataset) -> str:
    """Slopes over every dimension with several values: range over all cells, and the mean."""
    rows = []
    for name, slope in sensitivities(comparison).items():
        known = slope.values[np.isfinite(slope.values)]
        if known.size:
            numbers = (known.min(), known.mean(), known.max())
            rows.append([heading_of(name, comparison[name].attrs), *(_number(float(v), "+.3f") for v in numbers)])
    if not rows:
        return "<p class='faint'>No quantity has several values.</p>"
    text = "<p>d ln k/d ln x between neighbouring values of each quantity, over all cells.</p>"
    return text + _table(["quantity", "lowest", "mean", "highest"], rows)


def _statistics(dataset: xarray.Dataset, comparison: xarray.Dataset) -> str:
    level = comparison["half_width"].attrs["confidence_level"]
    text = (
        "<p>Conductivity in W/(m K): mean over n realizations of the mean of the tensor's diagonal, half-width of the "
        f"{100 * level:g} % Student-t interval of that mean, standard error. Realizations that do not percolate count "
        "as 0. The last column is the number of realizations that would bring the half-width to 1 %. The "
        "method error is the engine's estimate for its discretization and method; it does not fall with n.</p>"
    )
    head = [
        *_labels(comparison),
        "n",
        "solid fraction",
        "coordination",
        "mean",
        "half-width",
        "half-width [%]",
        "method error [%]",
        "standard error",
        "n for 1 %",
    ]
    rows = []
    for index in _cells(comparison):
        cell = comparison.isel(index)
        mean, width, n = float(cell["conductivity_mean"]), float(cell["half_width"]), int(cell["count"])
        relative = width / mean if mean > 0.0 else math.nan
        rows.append(
            [
                *_values(comparison, index),
                str(n),
                _number(float(cell["solid_fraction"]), ".4f"),
                _number(float(measured(dataset, "coordination").isel(index).mean()), ".3f"),
                _number(mean, ".5g"),
                _number(width, ".2g"),
                _number(100.0 * relative, ".2f"),
                _number(100.0 * float(cell["method_error"]) / mean if mean > 0.0 else math.nan, ".2f"),
                _number(float(cell["conductivity_sem"]), ".2g"),
                _number(
                    max(2.0, math.ceil(n * (relative / 0.01) ** 2)) if math.isfinite(relative) else math.nan, ".0f"
                ),
            ]
        )
    return text + _table(head, rows)


def _models(comparison: xarray.Dataset) -> str:
    names = [str(name) for name in comparison["model"].values]
    titles = dict(zip(names, comparison["model_title"].values.tolist(), strict=True))
    notes = dict(zip(names, comparison["model_note"].values.tolist(), strict=True))
    shown = [n for n in names if not notes[n].startswith("is 0")]
    pores, particles = (in_words(comparison.attrs[f"{name}_conductivity"]) for name in ("pore", "particle"))
    bound = "whole cells" if comparison.attrs["pores_conduct"] else "overlapping particles"
    binding = (
        f"The bounds hold for {bound}: an asterisk marks a result that breaks one."
        if comparison.attrs["bounds_bind"]
        else f"The bounds are only a comparison here: {comparison.attrs['bounds_unbound']}."
    )
    text = (
        f"<p>Pores of {pores} W/(m K), particles of {particles} W/(m K), at the mean solid fraction. "
        f"Each model: conductivity in W/(m K), and relative difference to the simulation. {binding}</p>"
    )
    head = [*_labels(comparison), "simulation", *(titles[name] for name in shown)]
    rows, broken = [], []
    for index in _cells(comparison):
        cell = comparison.isel(index)
        row = [*_values(comparison, index), _number(float(cell["conductivity_mean"]), ".5g")]
        for name in shown:
            one = cell.sel({"model": name})
            mark = "*" if bool(one["outside_bound"]) else ""
            value = _number(float(one["model_conductivity"]), ".4g")
            row.append(f"{mark}{value} ({_number(100.0 * float(one['relative_difference']), '+.1f')} %)")
        rows.append(row)
        broken.append(bool(comparison.attrs["bounds_bind"]) and not bool(cell["inside_bounds"]))
    others = [f"{titles[name]}: {notes[name]}" for name in shown if notes[name]]
    zero = [titles[name] for name in names if name not in shown]
    if zero:
        others.insert(0, f"0 because the pores insulate: {', '.join(zero)}")
    others += closest_words(comparison)
    tail = "".join(f"<p class='faint'>{escape(note)}.</p>" for note in others)
    return text + _table(head, rows, broken) + tail


def _fits(fits: Sequence[Fit]) -> str:
    rows = [
        [
            fit.model,
            ", ".join(word_of(key, value) for key, value in fit.selection.items()) or "all",
            str(fit.points),
            fit.constants,
            _number(100.0 * fit.rms_relative_residual, ".2f"),
        ]
        for fit in fits
        if fit.parameters
    ]
    reasons = dict.fromkeys(f"No fit of {fit.model}: {fit.note}." for fit in fits if not fit.parameters)
    table = ""
    if rows:
        head = ["fitted model", "part of the sweep", "densities", "constants [confidence interval]", "residual [%]"]
        table = "<p>Constants by least squares over the densities.</p>" + _table(head, rows, text_columns=(0, 1, 3))
    return table + "".join(f"<p class='faint'>{escape(reason)}</p>" for reason in reasons)


def _convergence(comparison: xarray.Dataset, pictures: Mapping[str, bytes]) -> str:
    lines = len(_cells(comparison))
    text = f"<p>One line for each of the {lines} cells, in the order of their realizations.</p>"
    return text + _picture(pictures["convergence"], "running mean and half-width")


def _system_sizes(systems: xarray.Dataset, pictures: Mapping[str, bytes]) -> str:
    several = systems.sizes["system"] > 1
    text = (
        _picture(pictures["systems"], "conductivity and spread against the number of particles")
        if several
        else "<p>This report holds one size of system. Name results of the same study in other boxes after the first "
        "one to see the conductivity settle with the number of particles. The spread of a realization falls as "
        "N<sup>-1/2</sup> in systems large enough.</p>"
    )
    first = systems.isel(system=0)
    head = [*_labels(first), "particles", "mean", "half-width", "spread of a realization [%]"]
    rows = []
    for index in _cells(first):
        for number in range(systems.sizes["system"]):
            cell = systems.isel(system=number).isel({k: v for k, v in index.items() if k in systems.dims})
            rows.append(
                [
                    *_values(first, index),
                    _number(float(cell["particles"]), ".0f"),
                    _number(float(cell["conductivity_mean"]), ".5g"),
                    _number(float(cell["half_width"]), ".2g"),
                    _number(100.0 * float(cell["relative_spread"]), ".2f"),
                ]
            )
    return text + _table(head, rows)


def _failures(dataset: xarray.Dataset) -> str:
    status = dataset["status"].values.ravel().tolist()
    counts = Counter(Status(value) for value in status)
    table = _table(["status", "cells"], [[s.name.lower(), str(counts.get(s, 0))] for s in Status], text_columns=(0,))
    messages = Counter(
        (Status(value).name.lower(), message)
        for value, message in zip(status, dataset["message"].values.ravel().tolist(), strict=True)
        if message
    )
    if not messages:
        return table + "<p>Every cell that was run has a conductivity.</p>"
    rows = [[kind, str(n), message] for (kind, message), n in messages.most_common(20)]
    more = f"<p class='faint'>{len(messages) - 20} more messages are in the file.</p>" if len(messages) > 20 else ""
    return table + "<p>Messages:</p>" + _table(["status", "cells", "message"], rows, text_columns=(0, 2)) + more


def _cost(dataset: xarray.Dataset) -> str:
    rows = []
    for name, what in (("pack_seconds", "packing a realization"), ("solve_seconds", "solving a cell")):
        values = dataset[name].where(dataset[name] > 0.0)
        numbers = [float(values.median()), float(values.max()), float(values.sum())]
        rows.append([what, *(_number(value, ".3g") for value in numbers)])
    return _table(["", "median [s]", "longest [s]", "together [s]"], rows, text_columns=(0,))


def _provenance(dataset: xarray.Dataset) -> str:
    rows = []
    for key in ("command", "started", "ended", "hosts", "commit", "seed", "study_digest", "source", "Conventions"):
        if key in dataset.attrs:
            rows.append([key, str(dataset.attrs[key])])
    versions = json.loads(dataset.attrs.get("versions", "{}"))
    rows.append(["versions", ", ".join(f"{name} {number}" for name, number in versions.items())])
    for run in json.loads(dataset.attrs.get("runs", "[]")):
        rows.append(["run", ", ".join(f"{key} {value}" for key, value in run.items() if value not in ("", None))])
    study = f"<p>The study file:</p><pre>{escape(str(dataset.attrs.get('study', '')))}</pre>"
    return _table(["", ""], rows, text_columns=(0, 1)) + study


def _cells(data: xarray.Dataset) -> list[dict[str, int]]:
    """Indices of every cell, densities outermost."""
    dims = [dim for dim in SWEPT if dim in data["conductivity_mean"].dims]
    ranges = (range(data.sizes[dim]) for dim in dims)
    return [dict(zip(dims, index, strict=True)) for index in itertools.product(*ranges)]


def _words(value: str | list[str]) -> str:
    """One word, or several."""
    return value if isinstance(value, str) else ", ".join(value)


def _labels(data: xarray.Dataset) -> list[str]:
    return [heading_of(dim, data[dim].attrs) for dim in SWEPT if dim in data["conductivity_mean"].dims]


def _values(data: xarray.Dataset, index: Mapping[str, int]) -> list[str]:
    values = {dim: data[dim].values[i] for dim, i in index.items()}
    return [str(value) if dim == "method" else f"{value:.4g}" for dim, value in values.items()]


def _number(value: float, form: str) -> str:
    return format(value, form) if math.isfinite(value) else "–"


def _range(values: Sequence[int]) -> str:
    low, high = min(values), max(values)
    return str(low) if low == high else f"{low} to {high}"


def _picture(png: bytes, description: str) -> str:
    data, width = base64.b64encode(png).decode("ascii"), int.from_bytes(png[16:20], "big")
    style = f"--readable: {READABLE * width:.0f}px"
    source = f"data:image/png;base64,{data}"
    return f'<div class="wide"><img alt="{escape(description)}" style="{style}" src="{source}"></div>\n'


def _table(
    head: Sequence[str], rows: Sequence[Sequence[str]], marked: Iterable[bool] = (), text_columns: Sequence[int] = ()
) -> str:
    """A table of text; the marked rows are coloured, the text columns set to the left."""

    def cell(tag: str, column: int, text: str) -> str:
        kind = ' class="text"' if column in text_columns else ""
        return f"<{tag}{kind}>{escape(text)}</{tag}>"

    marks = list(marked) or [False] * len(rows)
    lines = ["<tr>" + "".join(cell("th", i, text) for i, text in enumerate(head)) + "</tr>"] if any(head) else []
    for row, mark in zip(rows, marks, strict=True):
        kind = ' class="broken"' if mark else ""
        lines.append(f"<tr{kind}>" + "".join(cell("td", i, text) for i, text in enumerate(row)) + "</tr>")
    return '<div class="wide"><table>\n' + "\n".join(lines) + "\n</table></div>\n"
