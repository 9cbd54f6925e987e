"""What a sweep says of an isotropic medium: one conductivity, its confidence interval, its phases."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from etc_engine.errors import InputError
from etc_engine.realization import Status
from etc_engine.sweep.statistics import student_t

if TYPE_CHECKING:
    import xarray

TENSOR = ("direction_i", "direction_j")


@dataclass(frozen=True)
class Phases:
    """The two phases of a simulated medium.

    Parameters
    ----------
    pores, particles : float [W/(m K)]
        Conductivity of phase 1 (pores or matrix) and of phase 2.
    dimension : int
        2 for disks, 3 for spheres.
    overlapping : bool
        True if the simulated body is the union of the particles, whose solid fraction is known: then the bounds bind
        it. A bonded contact is wider than its geometry.
    composite : bool
        True if the pores are a matrix that conducts in the simulation too.
    """

    pores: float
    particles: float
    dimension: int
    overlapping: bool
    composite: bool = False


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


def phases(dataset: xarray.Dataset) -> tuple[Phases, ...]:
    """The phases of the medium a sweep simulates, from the study stored with it: one, or one a contrast.

    Raises
    ------
    InputError
        If the dataset is not the result of a sweep, or its particles are of two materials.
    """
    study = study_of(dataset)
    conduction = study["conduction"]
    mixture = conduction.get("mixture")
    if mixture is not None and mixture["conductivity"] != conduction["conductivity"]:
        raise InputError(
            f"models of two phases need particles of one material, this study mixes {conduction['conductivity']:g} and "
            f"{mixture['conductivity']:g} W/(m K): compare it as studies/mixture does"
        )
    dimension = dataset.sizes["direction_i"]
    composite = study.get("composite")
    if composite is None:
        pores, overlapping = float(study["models"]["pore_conductivity"]), study["contacts"]["rule"] == "overlap"
        return (Phases(pores, float(conduction["conductivity"]), dimension, overlapping),)
    matrix = float(composite["matrix_conductivity"])
    contrasts = composite["contrast"] or [float(conduction["conductivity"]) / matrix]
    return tuple(Phases(matrix, contrast * matrix, dimension, True, True) for contrast in contrasts)


def half_trace(tensor: xarray.DataArray) -> xarray.DataArray:
    """Mean of the diagonal of a conductivity tensor, k = (k_xx + k_yy)/2 in the plane.

    Examples
    --------
    >>> import xarray
    >>> axes = {"direction_i": ["x", "y"], "direction_j": ["x", "y"]}
    >>> float(half_trace(xarray.DataArray([[1.0, np.nan], [np.nan, 3.0]], coords=axes)))
    2.0
    """
    diagonal = [tensor.isel(direction_i=i, direction_j=i, drop=True) for i in range(tensor.sizes["direction_i"])]
    total = diagonal[0]
    for component in diagonal[1:]:
        total = total + component
    return total / len(diagonal)


def simulated(dataset: xarray.Dataset) -> xarray.Dataset:
    r"""Isotropic conductivity of every cell, with the Student-t interval of its mean.

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

    Notes
    -----
    The ensembles are isotropic up to the walls' order, so the mean of the diagonal is the estimate of their
    one conductivity, with less scatter than a component; s is its spread over realizations, not that of a
    component. Realizations without a conductivity stay out; those that do not percolate count as 0.
    """
    valid = dataset["status"] <= int(Status.NOT_PERCOLATING)
    samples = half_trace(dataset["conductivity"]).where(valid)
    count = dataset["count"]
    confidence = float(dataset.attrs.get("confidence_level", 0.95))
    several = count >= 2
    sem = samples.std("realization", ddof=1, skipna=True).where(several) / np.sqrt(count.where(several))
    quantiles = np.array([student_t(confidence, int(n)) if n >= 2 else np.nan for n in count.values.ravel()])
    half_width = sem * count.copy(data=quantiles.reshape(count.shape))
    mean = half_trace(dataset["conductivity_mean"])
    result = mean.to_dataset(name="conductivity_mean")
    result["conductivity_sem"] = sem
    result["half_width"] = half_width
    result["conductivity_ci_low"] = mean - half_width
    result["conductivity_ci_high"] = mean + half_width
    result["count"] = count
    result["solid_fraction"] = dataset["solid_fraction"].mean("realization")
    for name, meaning in _MEANINGS.items():
        result[name].attrs = {"long_name": meaning, "units": "W m-1 K-1"}
    for name in ("conductivity_ci_low", "conductivity_ci_high", "half_width"):
        result[name].attrs["confidence_level"] = confidence
    result["solid_fraction"].attrs = dict(dataset["solid_fraction"].attrs)
    return result


_MEANINGS = {
    "conductivity_mean": "simulated conductivity: mean of the tensor's diagonal over realizations",
    "conductivity_sem": "standard error of the simulated conductivity",
    "half_width": "half-width of the confidence interval of the simulated conductivity",
    "conductivity_ci_low": "lower end of the confidence interval of the simulated conductivity",
    "conductivity_ci_high": "upper end of the confidence interval of the simulated conductivity",
}
