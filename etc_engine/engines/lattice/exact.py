"""Exact transients of homogeneous bodies with prescribed surface temperatures."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from etc_engine.arrays import Floats
from etc_engine.errors import InputError

# Terms exp(-n^2 pi^2 Fo) below this are left out.
NEGLIGIBLE = 1e-18


def _terms(fourier: float) -> Floats:
    """Numbers n of the terms of a series in exp(-n^2 pi^2 Fo)."""
    if not fourier > 0.0:
        raise InputError(f"the series need a time after the start, found the Fourier number {fourier:g}")
    return np.arange(1.0, np.ceil(np.sqrt(-np.log(NEGLIGIBLE) / (np.pi**2 * fourier))) + 1.0)


def slab_temperature(
    position: ArrayLike, time: float, *, diffusivity: float, length: float, initial: float, low: float, high: float
) -> Floats:
    r"""Temperature in a slab at one temperature whose faces take two others at time 0.

    .. math:: T = T_1 + \frac{y}{L} \Delta T + \Delta T \sum_n C_n \sin\frac{n \pi y}{L} e^{-n^2 \pi^2 \alpha t / L^2},
              \quad C_n = 2 \frac{(-1)^n (1 - \theta_0) + \theta_0}{n \pi}

    Parameters
    ----------
    position : array_like [m]
        Distance y from the face at T_1.
    time : float [s]
    diffusivity : float [m2/s]
    length : float [m]
    initial, low, high : float [K]
        T_0, T_1 (y = 0), T_2 (y = L); theta_0 = (T_0 - T_1) / (T_2 - T_1).

    Returns
    -------
    ndarray [K]

    References
    ----------
    H. S. Carslaw, J. C. Jaeger, Conduction of Heat in Solids, 2nd ed., Oxford 1959, section 3.4; Haddad et al. 2021,
    eq. 17, doi:10.1016/j.ijthermalsci.2020.106799.

    Examples
    --------
    >>> steel = dict(diffusivity=33.0 / (7800.0 * 0.9), length=0.1, initial=25.0, low=25.0, high=35.0)
    >>> slab_temperature([0.01, 0.05, 0.09], 0.1, **steel).round(6)
    array([25.029993, 26.029586, 32.443227])
    """
    y = np.asarray(position, dtype=np.float64) / length
    n = _terms(diffusivity * time / length**2)
    # C_n times the temperature difference: no difference needs be divided by
    weights = 2.0 * ((-1.0) ** n * (high - initial) + (initial - low)) / (n * np.pi)
    decay = weights * np.exp(-(n**2) * np.pi**2 * diffusivity * time / length**2)
    return np.asarray(low + y * (high - low) + np.sin(np.pi * y[..., None] * n) @ decay)


def ball_temperature(
    distance: ArrayLike, time: float, *, diffusivity: float, radius: float, initial: float, surface: float
) -> Floats:
    r"""Temperature in a ball at one temperature whose surface takes another at time 0.

    .. math:: T = T_s + \frac{2 R (T_s - T_0)}{\pi r} \sum_n \frac{(-1)^n}{n} \sin\frac{n \pi r}{R}
              e^{-n^2 \pi^2 \alpha t / R^2}

    Parameters
    ----------
    distance : array_like [m]
        Distance r from the centre.
    time : float [s]
    diffusivity : float [m2/s]
    radius : float [m]
    initial, surface : float [K]

    Returns
    -------
    ndarray [K]

    References
    ----------
    H. S. Carslaw, J. C. Jaeger, Conduction of Heat in Solids, 2nd ed., Oxford 1959, section 9.3. Eqs. 18 and 19 of
    Haddad et al. 2021 exchange the two temperatures and leave out R.

    Examples
    --------
    >>> aluminium = dict(diffusivity=185.0 / (2700.0 * 900.0), radius=0.05, initial=20.0, surface=200.0)
    >>> ball_temperature([0.0, 0.05], 5.0, **aluminium).round(6)
    array([120.778087, 200.      ])
    """
    r = np.asarray(distance, dtype=np.float64) / radius
    n = _terms(diffusivity * time / radius**2)
    decay = 2.0 * (surface - initial) * (-1.0) ** n * np.exp(-(n**2) * np.pi**2 * diffusivity * time / radius**2)
    return np.asarray(surface + np.sinc(r[..., None] * n) @ decay)
