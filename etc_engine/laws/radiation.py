"""Radiation between facing grey surfaces, linear in the temperature difference."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from etc_engine.arrays import Floats
from etc_engine.errors import InputError

STEFAN_BOLTZMANN = 5.670374419e-8
"""W/(m2 K4) (CODATA 2018)."""


def grey_exchange(temperature: float, emissivity_1: ArrayLike, emissivity_2: ArrayLike) -> Floats:
    r"""Conductance per area of two parallel grey surfaces at a mean temperature [W/(m2 K)].

    .. math:: h_r = \frac{4 \sigma T^3}{1/e_1 + 1/e_2 - 1}

    Parameters
    ----------
    temperature : float [K]
        Mean temperature T of both.
    emissivity_1, emissivity_2 : array_like [-]
        Between 0 (no radiation) and 1.

    Returns
    -------
    ndarray [W/(m2 K)]

    Raises
    ------
    InputError
        If the temperature is not positive, or an emissivity not in [0, 1].

    Notes
    -----
    The linear form of sigma (T_1^4 - T_2^4), exact to second order in (T_1 - T_2)/T. Between the spheres of a dense bed
    every point is taken to face the same point of its neighbour across their common facet; sight lines past the
    neighbours are left out.

    References
    ----------
    R. Siegel and J. R. Howell, Thermal Radiation Heat Transfer: infinite parallel plates.

    Examples
    --------
    >>> grey_exchange(1000.0, [1.0, 0.0], 1.0).round(3)
    array([226.815,   0.   ])
    """
    if not (np.isfinite(temperature) and temperature > 0.0):
        raise InputError(f"radiation needs a positive absolute temperature [K], found {temperature:g}")
    e1, e2 = np.asarray(emissivity_1, dtype=np.float64), np.asarray(emissivity_2, dtype=np.float64)
    for e in (e1, e2):
        bad = ~((e >= 0.0) & (e <= 1.0))
        if bad.any():
            raise InputError(f"an emissivity must lie between 0 and 1, found {e[bad].flat[0]:g}")
    product = e1 * e2
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(product > 0.0, product / (e1 + e2 - product), 0.0)
    return np.asarray(4.0 * STEFAN_BOLTZMANN * temperature**3 * share)
