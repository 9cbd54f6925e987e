"""Conductivity over temperature out of the result of a sweep: what every export writes."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from etc_engine.arrays import Floats, Ints
from etc_engine.comparison.simulation import simulated, study_of
from etc_engine.errors import InputError

if TYPE_CHECKING:
    import xarray

TEMPERATURE, PRESSURE = "temperature", "pressure"


@dataclass(frozen=True)
class Curve:
    """Conductivity of one bed over temperature, everything else fixed.

    Parameters
    ----------
    temperature : ndarray, shape (n,) [K]
        Increasing; empty if the study has no temperature, and then n below is 1.
    conductivity : ndarray, shape (n,) [W/(m K)]
        Mean over realizations.
    half_width : ndarray, shape (n,) [W/(m K)]
        Half-width of its confidence interval; NaN for a single realization.
    count : ndarray, shape (n,)
        Realizations behind each mean.
    at : mapping
        The other coordinates of the sweep: density, pressure, ...
    """

    temperature: Floats
    conductivity: Floats
    half_width: Floats
    count: Ints
    at: Mapping[str, Any]

    @property
    def pressure(self) -> float | None:
        """Pressure of the gas [Pa], if the sweep has one."""
        return self.at.get(PRESSURE)


@dataclass(frozen=True)
class Source:
    """Where the curves come from, for the comments of a file.

    Parameters
    ----------
    study : str
    confidence : float
    attributes : mapping
        Global attributes of the result: commit, command, versions.
    units : mapping
        Of the coordinates that have a dimension, in the spelling of CF.
    method_error : float
        Largest estimated relative error of the method, which the intervals do not hold; NaN if there is none.
    below_zero : int
        Number of intervals that reach below 0. Student's interval is symmetric about the mean.
    """

    study: str
    confidence: float
    attributes: Mapping[str, Any]
    units: Mapping[str, str]
    method_error: float = np.nan
    below_zero: int = 0

    @property
    def lines(self) -> list[str]:
        """Sentences that say what the numbers are and where they come from."""
        text = [
            f"Effective thermal conductivity [W/(m K)] of the bed of study {self.study!r}.",
            f"Mean over realizations; intervals of {100.0 * self.confidence:g} % (Student's t).",
        ]
        if np.isfinite(self.method_error):
            text.append(
                f"Estimated error of the method, not in the intervals: up to {100.0 * self.method_error:.2g} %."
            )
        if self.below_zero:
            text.append(
                f"Intervals that reach below 0: {self.below_zero}. Student's interval is symmetric; no conductivity is "
                "negative, so read these lower limits as 0, or run more realizations."
            )
        for key in ("source", "commit", "study_digest"):
            if self.attributes.get(key):
                text.append(f"{key}: {' '.join(str(self.attributes[key]).split())}")
        return text


def curves_of(dataset: xarray.Dataset, at: Mapping[str, str]) -> tuple[list[Curve], Source]:
    """One curve for each combination of the coordinates other than temperature.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of a sweep.
    at : mapping of str to str
        Coordinates to keep, as a user writes them: ``{"density": "0.62"}``.

    Raises
    ------
    InputError
        If the dataset is not the result of a sweep, a coordinate or value is not there, or no cell has a
        conductivity.
    """
    study = study_of(dataset)
    values = simulated(dataset)
    for name, text in at.items():
        values = _kept(values, name, text)
    others = [str(dim) for dim in values["conductivity_mean"].dims if dim != TEMPERATURE]
    curves = []
    for index in itertools.product(*(range(values.sizes[dim]) for dim in others)):
        cell = values.isel(dict(zip(others, index, strict=True)))
        fixed = {str(name): _plain(cell[name].item()) for name in cell.coords if cell[name].ndim == 0}
        curve = _curve(cell, fixed)
        if curve.conductivity.size:
            curves.append(curve)
    if not curves:
        raise InputError("no cell of this result has a conductivity to export: see `etc-engine info`")
    confidence = float(dataset.attrs.get("confidence_level", 0.95))
    units = {str(name): str(dataset[name].attrs.get("units", "1")) for name in values.coords if name in dataset}
    with_units = {name: unit for name, unit in units.items() if unit != "1"}
    k = values["conductivity_mean"]
    error = float((values["method_error"] / k.where(k > 0.0)).max())
    below = sum(int((curve.conductivity < curve.half_width).sum()) for curve in curves)
    return curves, Source(str(study.get("name", "")), confidence, dict(dataset.attrs), with_units, error, below)


def _curve(cell: xarray.Dataset, fixed: Mapping[str, Any]) -> Curve:
    k = np.atleast_1d(cell["conductivity_mean"].values).astype(np.float64)
    there = np.flatnonzero(np.isfinite(k))
    temperature = np.empty(0)
    if TEMPERATURE in cell.dims:
        temperature = cell[TEMPERATURE].values.astype(np.float64)[there]
        order = np.argsort(temperature)
        there, temperature = there[order], temperature[order]
    half = np.atleast_1d(cell["half_width"].values).astype(np.float64)[there]
    return Curve(temperature, k[there], half, np.atleast_1d(cell["count"].values).astype(np.int64)[there], fixed)


def _kept(values: xarray.Dataset, name: str, text: str) -> xarray.Dataset:
    if name not in values.dims:
        raise InputError(f"this result has no dimension {name!r}; it has {', '.join(map(str, values.dims)) or 'none'}")
    present = values[name].values
    if present.dtype.kind in "fiu":
        try:
            wanted = float(text)
        except ValueError:
            raise InputError(f"--at {name} takes a number, found {text!r}") from None
        match = np.flatnonzero(np.isclose(present.astype(np.float64), wanted, rtol=1e-9, atol=0.0))
    else:
        match = np.flatnonzero(present.astype(str) == text)
    if not match.size:
        raise InputError(f"{name} has no value {text}; it has {', '.join(str(value) for value in present)}")
    return values.isel({name: int(match[0])})


def _plain(value: Any) -> Any:
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else value


def described(curve: Curve) -> str:
    """The coordinates of a curve in one line.

    Examples
    --------
    >>> described(Curve(np.empty(0), np.ones(1), np.ones(1), np.ones(1, dtype=int), {"density": 0.62}))
    'density = 0.62'
    """
    return (
        ", ".join(
            f"{name} = {value:g}" if isinstance(value, float) else f"{name} = {value}"
            for name, value in curve.at.items()
        )
        or "the only cell"
    )


def only_curve(curves: list[Curve], what: str) -> Curve:
    """The one curve of a format that can hold no more.

    Raises
    ------
    InputError
        If there are several: the message names the coordinates to fix.
    """
    if len(curves) > 1:
        varying = [name for name in curves[0].at if len({str(curve.at.get(name)) for curve in curves}) > 1]
        choices = "; ".join(
            f"{name}: {', '.join(dict.fromkeys(_word(curve.at[name]) for curve in curves))}" for name in varying
        )
        raise InputError(f"{what} holds one curve, this result has {len(curves)}: fix --at NAME=VALUE of {choices}")
    return curves[0]


def _word(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
