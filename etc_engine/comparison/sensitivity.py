"""Sensitivity of the conductivity of a sweep to each of its dimensions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from etc_engine.study.quantities import QUANTITIES

if TYPE_CHECKING:
    import xarray


def sensitivities(comparison: xarray.Dataset) -> dict[str, xarray.DataArray]:
    r"""Logarithmic slope of the mean conductivity between neighbouring values of each dimension.

    .. math:: s_x = \frac{\ln k(x_{i+1}) - \ln k(x_i)}{\ln x_{i+1} - \ln x_i}

    Parameters
    ----------
    comparison : xarray.Dataset
        Conductivities with their means, see `etc_engine.comparison.simulation.simulated`.

    Returns
    -------
    dict of DataArray
        By dimension: slopes at the geometric means of neighbouring values. Dimensions with a single value or one that
        is not positive are left out.

    Examples
    --------
    >>> import xarray
    >>> k = xarray.DataArray([2.0, 16.0], coords={"temperature": [300.0, 600.0]})
    >>> sensitivities(xarray.Dataset({"conductivity_mean": k}))["temperature"].values.round(9)
    array([3.])
    """
    found = {}
    k = comparison["conductivity_mean"]
    for name in (str(dim) for dim in k.dims):
        if name not in QUANTITIES or k.sizes[name] < 2 or float(k[name].min()) <= 0.0:
            continue
        at = np.log(k[name].values)
        steps = k[name].diff(name).copy(data=np.diff(at))
        logarithm = k.copy(data=np.log(k.where(k > 0.0).values))
        slope = logarithm.diff(name) / steps
        found[name] = slope.assign_coords({name: np.exp(0.5 * (at[1:] + at[:-1]))})
    return found
