"""What a sweep says of an isotropic medium: one conductivity, its confidence interval, its phases."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from etc_engine.errors import InputError
from etc_engine.medium.rules import find_rule
from etc_engine.realization import Status
from etc_engine.study.files import SCHEMA
from etc_engine.sweep.statistics import interval, student_t

if TYPE_CHECKING:
    import xarray

TENSOR = ("direction_i", "direction_j")


@dataclass(frozen=True)
class Phases:
    """The two phases of a simulated medium.

    Parameters
    ----------
    pores, particles : DataArray [W/(m K)]
        Conductivity of phase 1 and of phase 2: a number, or one per value of the dimensions that vary it.
    dimension : int
        2 for disks, 3 for spheres.
    unbound : str
        Why the rigorous bounds do not apply; empty if they do. They apply to the union of the particles, whose solid
        fraction is known.
    """

    pores: xarray.DataArray
    particles: xarray.DataArray
    dimension: int
    unbound: str

    @property
    def bounds_bind(self) -> bool:
        """Whether the rigorous bounds apply to the simulated body."""
        return not self.unbound

    @property
    def pores_conduct(self) -> bool:
        """Whether heat goes through the pores in the simulation."""
        return bool((self.pores > 0.0).any())


def study_of(dataset: xarray.Dataset) -> dict[str, Any]:
    """The study behind the result of a sweep, all defaults written out.

    Raises
    ------
    InputError
        If the dataset is not the result of a sweep.
    """
    needed = {"conductivity", "conductivity_mean", "count", "solid_fraction", "status"}
    missing = sorted(needed - {str(name) for name in dataset.variables})
    if "study_resolved" not in dataset.attrs or missing:
        what = "attribute study_resolved" if "study_resolved" not in dataset.attrs else ", ".join(missing)
        raise InputError(f"this is not the result of a sweep: it has no {what}")
    try:
        study: dict[str, Any] = json.loads(dataset.attrs["study_resolved"])
    except ValueError as error:
        raise InputError(f"the attribute study_resolved is not valid JSON ({error}): the file is damaged") from None
    return study


def current_study(dataset: xarray.Dataset) -> dict[str, Any]:
    """The study behind the result of a sweep, in the form of today.

    Raises
    ------
    InputError
        If the dataset is not the result of a sweep, or is of an older version of the engine.
    """
    study = study_of(dataset)
    if study.get("schema") != SCHEMA:
        raise InputError(
            f"this result is of a study of schema {study.get('schema')}, from an older version of the engine: "
            f"compare it with that version, or run the study again in schema {SCHEMA}"
        )
    return study


def phases(dataset: xarray.Dataset) -> Phases:
    """The phases of the medium that a sweep simulates.

    Raises
    ------
    InputError
        If the dataset is not the result of a sweep, or its particles are of two materials.
    """
    study = current_study(dataset)
    if "particle_conductivity" not in dataset.coords:
        raise InputError(
            "two-phase models need particles of one material: the particles of this sweep differ in conductivity "
            "(by type, or a column of their files)"
        )
    pores, particles = dataset["pore_conductivity"], dataset["particle_conductivity"]
    if "mixture_conductivity" in dataset.coords:
        other = dataset["mixture_conductivity"]
        if not bool((other == particles).all()):
            raise InputError(
                f"two-phase models need particles of one material, this study mixes {in_words(particles)} and "
                f"{in_words(other)} W/(m K): compare it as studies/mixture does"
            )
    glow = bool((dataset.coords.get("emissivity", pores * 0.0) > 0.0).any())
    unbound = _unbound(study["contacts"].get("rule", "overlap"), gas="pressure" in dataset.coords, glow=glow)
    if not unbound and study["conduction"].get("nonlinear"):
        unbound = "the conductivities follow the temperature between the walls"
    return Phases(pores, particles, dataset.sizes["direction_i"], unbound)


def _unbound(rule: str, *, gas: bool, glow: bool) -> str:
    """Why the bounds of two phases of known volume do not apply, or an empty text."""
    if glow:
        return "radiation crosses the pores beside what fills them"
    if gas:
        return "a gas may conduct less in narrow gaps than in wide ones"
    return find_rule(rule).unbound


MANY = 6
"""More values than this are printed as their lowest and highest."""


def in_words(values: Any) -> str:
    """One number, or several, for readers.

    Examples
    --------
    >>> in_words(2.0), in_words(np.array([1.0, 5.0]))
    ('2', '1, 5')
    >>> in_words(np.linspace(0.25, 0.5, 20))
    '0.25 to 0.5'
    """
    several = np.ravel(values)
    if several.size > MANY:
        return f"{several.min():g} to {several.max():g}"
    return ", ".join(f"{value:g}" for value in several)


def mean_diagonal(tensor: xarray.DataArray) -> xarray.DataArray:
    """Mean of the diagonal of a conductivity tensor, k = (k_xx + k_yy)/2 in the plane.

    Axes without a conductivity stay out: those without walls, where properties follow the temperature between walls.

    Examples
    --------
    >>> import xarray
    >>> axes = {"direction_i": ["x", "y"], "direction_j": ["x", "y"]}
    >>> float(mean_diagonal(xarray.DataArray([[1.0, np.nan], [np.nan, 3.0]], coords=axes)))
    2.0
    >>> float(mean_diagonal(xarray.DataArray([[np.nan, np.nan], [np.nan, 3.0]], coords=axes)))
    3.0
    """
    import xarray

    diagonal = [tensor.isel(direction_i=i, direction_j=i, drop=True) for i in range(tensor.sizes["direction_i"])]
    total, count = xarray.zeros_like(diagonal[0]), xarray.zeros_like(diagonal[0])
    for component in diagonal:
        total, count = total + component.fillna(0.0), count + component.notnull()
    return total / count.where(count > 0.0)


def simulated(dataset: xarray.Dataset) -> xarray.Dataset:
    r"""Isotropic conductivity of every cell, with the interval of its mean.

    .. math:: \bar k \pm t_{n-1,(1+c)/2}\, s/\sqrt n, \qquad k = \tfrac{1}{d} \operatorname{tr} \mathbf{k}

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of a sweep.

    Returns
    -------
    xarray.Dataset
        ``conductivity_mean``, ``conductivity_sem``, ``half_width``, ``conductivity_ci_low``,
        ``conductivity_ci_high`` [W/(m K)], ``count`` and ``solid_fraction``, on the dimensions of the sweep.
        ``method_error`` [W/(m K)]: mean over realizations of k times ``model_error_estimate``, the error of the
        discretization and of the method, NaN where there is no estimate. ``band_low``, ``band_high`` [W/(m K)]: the
        interval of the mean, wider by the method error at both ends; NaN where there is neither.

    Notes
    -----
    The ensembles are isotropic up to the walls' order, so the mean of the diagonal is the estimate of their
    one conductivity, with less scatter than a component; s is its spread over realizations, not that of a
    component. Realizations without a conductivity stay out; those that do not percolate count as 0. Where there are
    any, the interval is that of `etc_engine.sweep.statistics.interval` and not symmetric; ``half_width`` is half of it.
    The method error is added to the interval and not to its square: it has the same sign in all realizations, and
    does not fall with their number.
    """
    valid = dataset["status"] <= int(Status.NOT_PERCOLATING)
    samples = mean_diagonal(dataset["conductivity"]).where(valid)
    count = dataset["count"]
    confidence = float(dataset.attrs.get("confidence_level", 0.95))
    several = count >= 2
    sem = samples.std("realization", ddof=1, skipna=True).where(several) / np.sqrt(count.where(several))
    quantiles = np.array([student_t(confidence, int(n)) if n >= 2 else np.nan for n in count.values.ravel()])
    half_width = sem * count.copy(data=quantiles.reshape(count.shape))
    mean = mean_diagonal(dataset["conductivity_mean"])
    low, high, fraction = _with_zeros(samples, mean - half_width, mean + half_width, confidence)
    result = mean.to_dataset(name="conductivity_mean")
    result["conductivity_sem"] = sem
    result["half_width"] = 0.5 * (high - low)
    result["conductivity_ci_low"] = low
    result["conductivity_ci_high"] = high
    estimate = dataset["model_error_estimate"] if "model_error_estimate" in dataset else samples * np.nan
    _add_band(result, (samples * estimate).mean("realization"))
    result["percolating_fraction"] = fraction
    result["count"] = count
    result["solid_fraction"] = dataset["solid_fraction"].mean("realization")
    for name, meaning in _MEANINGS.items():
        result[name].attrs = {"long_name": meaning, "units": "W m-1 K-1"}
    for name in ("conductivity_ci_low", "conductivity_ci_high", "half_width"):
        result[name].attrs["confidence_level"] = confidence
    result["percolating_fraction"].attrs = {"long_name": "fraction of the realizations that percolate", "units": "1"}
    result["solid_fraction"].attrs = dict(dataset["solid_fraction"].attrs)
    return result


def _add_band(result: xarray.Dataset, error: xarray.DataArray) -> None:
    """Add the error of the method, and the band that holds it and the scatter of the realizations."""
    mean, low, high = (result[name] for name in ("conductivity_mean", "conductivity_ci_low", "conductivity_ci_high"))
    known, wider = low.notnull() | error.notnull(), error.fillna(0.0)
    result["method_error"] = error.transpose(*mean.dims)
    result["band_low"] = (low.fillna(mean) - wider).clip(min=0.0).where(known).transpose(*mean.dims)
    result["band_high"] = (high.fillna(mean) + wider).where(known).transpose(*mean.dims)


def _with_zeros(
    samples: xarray.DataArray, low: xarray.DataArray, high: xarray.DataArray, confidence: float
) -> tuple[xarray.DataArray, xarray.DataArray, xarray.DataArray]:
    """Bounds of the mean and percolating fraction; bounds are replaced where a realization has the conductivity 0."""
    low, high, fraction = low.copy(), high.copy(), _undefined(low)
    swept = samples.transpose(*low.dims, "realization").values
    for place in np.ndindex(*low.shape):
        values = swept[place][np.isfinite(swept[place])]
        if not values.size:
            continue
        found = interval(np.maximum(values, 0.0), confidence)
        fraction.values[place] = found.percolating_fraction
        if found.percolating_fraction < 1.0:
            low.values[place], high.values[place] = found.low, found.high
    return low, high, fraction


def _undefined(values: xarray.DataArray) -> xarray.DataArray:
    """An array of NaN on the dimensions of another."""
    return values.copy(data=np.full(values.shape, np.nan))


_MEANINGS = {
    "conductivity_mean": "simulated conductivity: mean of the tensor's diagonal over realizations",
    "conductivity_sem": "standard error of the simulated conductivity",
    "half_width": "half-width of the confidence interval of the simulated conductivity",
    "conductivity_ci_low": "lower end of the confidence interval of the simulated conductivity",
    "conductivity_ci_high": "upper end of the confidence interval of the simulated conductivity",
    "method_error": "estimated error of the method (discretization) in the simulated conductivity",
    "band_low": "lower end of the confidence interval less the error of the method",
    "band_high": "upper end of the confidence interval and the error of the method",
}
