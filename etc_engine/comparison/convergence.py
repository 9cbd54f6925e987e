"""How the simulated conductivity settles: with the number of realizations, and with the size of the system."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from etc_engine.comparison.simulation import current_study, mean_diagonal, simulated
from etc_engine.errors import InputError
from etc_engine.realization import Status
from etc_engine.sweep.statistics import student_t

if TYPE_CHECKING:
    import xarray


def samples(dataset: xarray.Dataset) -> xarray.DataArray:
    """Mean of the tensor's diagonal of every realization [W/(m K)], NaN where there is none."""
    return mean_diagonal(dataset["conductivity"]).where(dataset["status"] <= int(Status.NOT_PERCOLATING))


def running_statistics(dataset: xarray.Dataset) -> xarray.Dataset:
    r"""Mean and half-width of its confidence interval after 1, 2, 3, ... realizations.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of a sweep.

    Returns
    -------
    xarray.Dataset
        ``mean`` and ``half_width`` [W/(m K)] on the dimensions of the sweep and ``realization``: the statistics of
        all realizations up to that one. The half-width is NaN before the second.

    Notes
    -----
    One pass by the update of Welford (1962), Technometrics 4, 419, doi:10.1080/00401706.1962.10490022.
    """
    values = samples(dataset).transpose(..., "realization")
    confidence = float(dataset.attrs.get("confidence_level", 0.95))
    data = values.values
    count, mean, square = (np.zeros(data.shape[:-1]) for _ in range(3))
    means, widths = np.full(data.shape, np.nan), np.full(data.shape, np.nan)
    quantile = {n: student_t(confidence, n) for n in range(2, data.shape[-1] + 1)}
    for r in range(data.shape[-1]):
        x = data[..., r]
        valid = np.isfinite(x)
        count += valid
        step = np.where(valid, x - mean, 0.0)
        mean += step / np.maximum(count, 1.0)
        square += step * np.where(valid, x - mean, 0.0)
        means[..., r] = np.where(count > 0, mean, np.nan)
        t = np.array([quantile.get(int(n), np.nan) for n in count.ravel()]).reshape(count.shape)
        widths[..., r] = t * np.sqrt(square / np.maximum(count - 1.0, 1.0) / np.maximum(count, 1.0))
    result = values.copy(data=means).to_dataset(name="mean")
    result["half_width"] = values.copy(data=widths)
    for name in ("mean", "half_width"):
        result[name].attrs = {"long_name": f"{name.replace('_', '-')} after so many realizations", "units": "W m-1 K-1"}
    return result


def system_sizes(datasets: Sequence[xarray.Dataset]) -> xarray.Dataset:
    """Simulated conductivity of the same study in boxes of several sizes.

    Parameters
    ----------
    datasets : sequence of xarray.Dataset
        Results of sweeps that vary the same.

    Returns
    -------
    xarray.Dataset
        ``conductivity_mean``, ``half_width``, ``relative_spread`` (standard deviation of a realization over the mean)
        and ``particles`` on ``system`` (in ascending number of particles) and the dimensions of the sweep.

    Raises
    ------
    InputError
        If sweeps vary different quantities, or differ in anything but the box, the number of particles, the seed
        and the statistics.
    """
    import xarray

    first = _comparable(datasets[0])
    systems = []
    for number, dataset in enumerate(datasets):
        other = _comparable(dataset)
        for key, value in first.items():
            if other[key] != value:
                raise InputError(f"result {number + 1} belongs to another study: {key} is {other[key]}, not {value}")
        statistics = simulated(dataset)
        system = statistics[["conductivity_mean", "half_width"]]
        system["relative_spread"] = samples(dataset).std("realization", ddof=1) / system["conductivity_mean"]
        particles = dataset["particles"].where(dataset["particles"] > 0).mean("realization")
        system["particles"] = particles
        systems.append(system.assign_coords(density=datasets[0]["density"]))
    systems.sort(key=lambda system: float(system["particles"].mean()))
    return xarray.concat(systems, dim="system", join="exact")


def _comparable(dataset: xarray.Dataset) -> dict[str, object]:
    study = current_study(dataset)
    packing = {key: value for key, value in study["packing"].items() if key not in ("box", "count", "radii")}
    return {
        **{f"packing.{key}": value for key, value in packing.items()},
        **{k: study.get(k) for k in ("particles", "contacts", "pores", "radiation", "conduction")},
    }
