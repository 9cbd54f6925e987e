"""The estimate closest to a simulation, named only where the error of the simulation leaves it the closest."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from etc_engine.models.catalogue import find_model

if TYPE_CHECKING:
    import xarray

PHASES = ("k1", "k2", "fraction")
"""Inputs that every model of a two-phase medium may have."""


def further_inputs(name: str, known: Mapping[str, object]) -> tuple[str, ...]:
    """Inputs of a model beyond the two conductivities and the fraction that the sweep, or the caller, gives it.

    Examples
    --------
    >>> further_inputs("kirkpatrick", {"coordination": 4.0}), further_inputs("maxwell", {"coordination": 4.0})
    (('coordination',), ())
    """
    return tuple(item.name for item in find_model(name).inputs if item.name not in PHASES and item.name in known)


def add_closest(result: xarray.Dataset) -> None:
    r"""Add the closest estimate of every part of a sweep, and of the whole sweep.

    .. math:: r_m^2 = \frac{1}{n} \sum_i \left(\frac{k_m - k}{\bar k}\right)_i^2, \qquad
              e^2 = \frac{1}{n} \sum_i \max\left(\frac{\bar k - k_{low}}{\bar k},
              \frac{k_{high} - \bar k}{\bar k}\right)_i^2

    over the n densities of a part. The estimate of least r_m is named if it lies outside the band, :math:`r_m > e`, and
    is also the closest to the lower and to the upper end of the band (k in place of the mean :math:`\bar k`).

    Parameters
    ----------
    result : xarray.Dataset
        Comparison with ``model_conductivity``, ``conductivity_mean``, ``band_low`` and ``band_high`` [W/(m K)],
        ``rms_relative_difference`` and the coordinates ``model_kind`` and ``model_inputs``. Gets ``best_model`` on
        the dimensions of the sweep without the density, and the attributes ``best_model``, ``best_plain_model``
        (among the formulas of the fraction alone), ``within_error`` (names of the estimates inside the band, separated
        by blanks), ``rms_error`` (e) and ``best_model_note`` (why none is named).

    Notes
    -----
    A model that is 0 is 100 % off everywhere and would beat every model that is too high by more: it stays out. So
    does a model without a value somewhere in the sweep, for the whole sweep.
    """
    k, model = result["conductivity_mean"], result["model_conductivity"]
    estimates = result["model_kind"].isin(("estimate", "exact"))
    nonzero = (model > 0.0).any([dim for dim in model.dims if dim != "model"])
    ends = [k, *(result[name].fillna(k) for name in ("band_low", "band_high"))]
    parts = [_rms((model - end) / k.where(k > 0.0), k).where(estimates & nonzero) for end in ends]
    below, above = ends[0] - ends[1], ends[2] - ends[0]
    half = below.where(below > above, above)
    error = _rms(half / k.where(k > 0.0), k)
    names = result["model"].values
    named = _named([part.transpose("model", ...).values for part in parts], error.values, names)[0]
    result["best_model"] = error.copy(data=named.astype(object))
    totals = [_over_parts(part).values for part in parts]
    total_error = np.asarray(_over_parts(error).values)
    best, inside, note = _named(totals, total_error, names)
    plain = result["model_inputs"].values == ""
    result.attrs |= {
        "best_model": str(best[()]),
        "best_plain_model": str(_named([np.where(plain, t, np.nan) for t in totals], total_error, names)[0][()]),
        "within_error": " ".join(names[inside]),
        "best_model_note": note,
        "rms_error": float(total_error),
    }


def closest_words(comparison: xarray.Dataset) -> list[str]:
    """The closest models of a whole sweep in words for readers, or why none is named; empty where there is none."""
    attrs = comparison.attrs
    percent = 100.0 * attrs["rms_error"]
    error = "unknown" if np.isnan(percent) else f"{percent:.0f} %" if percent >= 10.0 else f"{percent:.2g} %"

    def described(name: str) -> str:
        rms = comparison["rms_relative_difference"].sel({"model": name})
        knows = comparison["model_inputs"].sel({"model": name}).item()
        return (
            f"{name}{f' (it knows {knows})' if knows else ''}, rms relative difference "
            f"{100 * float((rms**2).mean()) ** 0.5:.1f} %, rms error of the simulation {error}"
        )

    lines = []
    best, plain = attrs["best_model"], attrs["best_plain_model"]
    if best:
        lines.append(f"closest model over the sweep: {described(best)}")
    elif attrs["best_model_note"]:
        inside = attrs["within_error"].split()
        verb = "agrees" if len(inside) == 1 else "agree"
        found = f"{', '.join(inside)} {verb} with the simulation within its rms error of {error}; " if inside else ""
        lines.append(f"no closest model is named: {found}{attrs['best_model_note']}")
    if plain and plain != best:
        lines.append(f"closest of the models that know the solid fraction alone: {described(plain)}")
    return lines


def _rms(values: xarray.DataArray, k: xarray.DataArray) -> xarray.DataArray:
    """Root mean square over the densities that conduct; NaN where a model has no value at one of them."""
    points = (k > 0.0).sum("density")
    square = (values**2).where(k > 0.0, 0.0).sum("density", skipna=False)
    return (square / points.where(points > 0)) ** 0.5


def _over_parts(part: xarray.DataArray) -> xarray.DataArray:
    """Root mean square over the parts of a sweep that conduct somewhere."""
    others = [dim for dim in part.dims if dim != "model"]
    if "model" not in part.dims:
        single: xarray.DataArray = (part**2).mean(others) ** 0.5
        return single
    conducts = part.notnull().any("model")
    square = (part**2).where(conducts, 0.0).sum(others, skipna=False)
    root: xarray.DataArray = (square / conducts.sum(others).where(conducts.any())) ** 0.5
    return root


def _named(differences: list[np.ndarray], error: np.ndarray, names: np.ndarray) -> tuple[np.ndarray, np.ndarray, str]:
    """Names of the closest or "", which models lie inside the band, and why none is named (of a single part).

    ``differences``, each (models, ...), are those to the mean and to both ends of the band.
    """
    filled = [np.where(np.isfinite(values), values, np.inf) for values in differences]
    first, low, high = (values.argmin(axis=0) for values in filled)
    least = filled[0].min(axis=0)
    known = np.isfinite(least)
    inside = filled[0] <= np.nan_to_num(error)
    same = (first == low) & (first == high)
    certain = known & ~inside.any(axis=0) & same
    exact = known & (least == 0.0) & (np.nan_to_num(error) == 0.0)
    found = np.where(certain | exact, names[first], "")
    note = ""
    if found.ndim == 0 and not found[()] and bool(known):
        rivals = dict.fromkeys(str(names[int(i)]) for i in (first, low, high))
        note = (
            "what lies inside the error has no order"
            if bool(inside.any())
            else f"inside the error of the simulation {' and '.join(rivals)} change places"
        )
    return found, inside, note
