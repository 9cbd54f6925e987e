"""The numbers of the figure: conductivity with confidence intervals over a dimension, and the models beside it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.comparison import evaluate_models, model_lines
from etc_engine.comparison.simulation import simulated
from etc_engine.errors import InputError
from etc_engine.study.quantities import QUANTITIES, heading_of, word_of

if TYPE_CHECKING:
    import xarray


def curve_of(dataset: xarray.Dataset) -> dict[str, Any]:
    """Mean conductivity, Student-t interval and count of every cell, and the models, as plain JSON values.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of a sweep, complete or not.

    Returns
    -------
    dict
        ``confidence``, ``units``, ``density``, ``along``: the dimension drawn along the horizontal axis with its
        ``title`` and ``values``, the density unless it has one value and the temperature, or another quantity, several.
        ``solid_fraction`` over the densities and ``series``: ``values`` of the other dimensions of the sweep, in words
        too as ``name``, ``mean``, ``low``, ``high`` [W/(m K)] and ``count`` along that dimension.
        ``method_error``: the largest estimated relative error of the method, which low and high do not hold.
        ``models`` with their curves, ``remark`` where there are none, ``bounds_broken``, ``best_model`` and
        ``within_error``: names of the estimates inside the error of the simulation. A missing number is None.
    """
    units = int((dataset["worker_rank"].values >= 0).sum())
    found: dict[str, Any] = {"units": units, "confidence": float(dataset.attrs["confidence_level"])}
    found["density"] = plain(dataset["density"].values)
    along = _horizontal(dataset)
    title = heading_of(along, dataset[along].attrs)
    found["along"] = {"name": along, "title": title, "values": plain(dataset[along].values)}
    found |= {"series": [], "models": [], "solid_fraction": [], "remark": "", "bounds_broken": False}
    found |= {"method_error": None, "best_model": "", "within_error": []}
    if not units:
        return found
    statistics = simulated(dataset)
    found["solid_fraction"] = plain(_over(statistics["solid_fraction"], "density"))
    k = statistics["conductivity_mean"]
    found["method_error"] = plain((statistics["method_error"] / k.where(k > 0.0)).max().values)
    found["series"] = [
        _series(statistics.isel(place), [name for name in place if name != "density"])
        for place in _places(statistics, along)
    ]
    try:
        comparison = evaluate_models(dataset)
    except InputError as error:
        found["remark"] = str(error)
        return found
    found["models"] = _models(comparison, along)
    found["bounds_broken"] = bool(comparison.attrs["bound_broken"])
    found["best_model"] = str(comparison.attrs["best_model"])
    found["within_error"] = str(comparison.attrs["within_error"]).split()
    return found


def _horizontal(dataset: xarray.Dataset) -> str:
    """The dimension of the horizontal axis: the density, or where it has one value the temperature or the longest."""
    if dataset.sizes["density"] > 1:
        return "density"
    several = {name: dataset.sizes[name] for name in QUANTITIES if dataset.sizes.get(name, 1) > 1}
    if "temperature" in several:
        return "temperature"
    return max(several, key=lambda name: several[name], default="density")


def _places(statistics: xarray.Dataset, along: str) -> list[dict[str, int]]:
    """One index for every curve."""
    names = [str(name) for name in statistics["conductivity_mean"].dims if name != along]
    sizes = [statistics.sizes[name] for name in names]
    return [dict(zip(names, place, strict=True)) for place in np.ndindex(*sizes)]


def _series(cell: xarray.Dataset, names: Iterable[str]) -> dict[str, Any]:
    values = {name: cell[name].values.item() for name in names}
    return {
        "name": ", ".join(word_of(name, value) for name, value in values.items()),
        "values": values,
        "mean": plain(cell["conductivity_mean"].values),
        "low": plain(cell["conductivity_ci_low"].values),
        "high": plain(cell["conductivity_ci_high"].values),
        "count": cell["count"].values.tolist(),
    }


def _models(comparison: xarray.Dataset, along: str) -> list[dict[str, Any]]:
    """Every model: a smooth line, and how far it is from the simulation."""
    lines = model_lines(comparison) if along == "density" else None
    drawn = (
        {}
        if lines is None
        else {
            str(name): lines["model_conductivity"].sel(model=name).transpose(..., "density").values
            for name in lines["model"].values
        }
    )
    found = []
    for name in comparison["model"].values:
        one = comparison.sel(model=name)
        value = one["model_conductivity"]
        if lines is not None and str(name) in drawn:
            at, curves = lines["density"].values, drawn[str(name)].reshape(-1, lines.sizes["density"])
        else:  # along another dimension, or the contact mean field: values on the sweep only, a curve per cell
            at = comparison[along].values
            places = [{k: v for k, v in place.items() if k in value.dims} for place in _places(comparison, along)]
            curves = np.array([_over(value.isel(place).broadcast_like(comparison[along]), along) for place in places])
        squares = np.asarray(one["rms_relative_difference"].values, dtype=np.float64) ** 2
        found.append(
            {
                "name": str(name),
                "title": str(one["model_title"].values),
                "kind": str(one["model_kind"].values),
                "note": str(one["model_note"].values),
                "at": plain(at),
                "curves": plain(curves),
                "rms_relative_difference": plain(np.sqrt(squares.mean())),
            }
        )
    return found


def _over(values: xarray.DataArray, along: str) -> Floats:
    """The first curve of an array that may have several."""
    other = {name: 0 for name in values.dims if name != along}
    return np.asarray(values.isel(other).values, dtype=np.float64)


def plain(values: Any) -> Any:
    """Numbers for JSON: lists, and None for what is not finite.

    Examples
    --------
    >>> plain(np.array([1.0, np.nan]))
    [1.0, None]
    """
    if isinstance(values, np.ndarray | np.generic):
        values = values.tolist()
    if isinstance(values, list):
        return [plain(value) for value in values]
    return None if isinstance(values, float) and not math.isfinite(values) else values
