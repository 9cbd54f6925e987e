r"""Thermal resistance between contact arcs of a disk, in closed form.

A disk of conductivity kappa receives the heat Q_j through the arc of half-angle alpha_j about the
position angle theta_j, spread uniformly over it. The mean temperature of arc i is then

    T_i = T_o + sum_j h_ij Q_j,
    h_ij = -1/(4 pi kappa alpha_i alpha_j) int_i int_j ln |sin((s - t)/2)| ds dt

(Feng et al. 2008, Eq. 20). Everything here is the dimensionless kappa h. With

    C(x) = sum_{k>=1} cos(k x)/k^3,      C''(x) = ln |2 sin(x/2)|,

the double integral is a second difference of C. It does not need quadrature, for i = j either.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
from numba import njit
from numpy.typing import ArrayLike
from scipy.special import zeta

from etc_engine.arrays import Floats, Ints
from etc_engine.errors import InputError

_ZETA_3 = 1.2020569031595942
_TERMS = 22

CLAUSEN_SERIES = np.array(
    [-zeta(2 * k) / (k * (2 * k + 1) * (2 * k + 2)) / (2.0 * np.pi) ** (2 * k) for k in range(1, _TERMS + 1)]
)
"""The c_k of C(x) = zeta(3) + x^2/2 ln x - 3 x^2/4 + x^4 sum_k c_k x^{2k}, from the series of ln(sin z / z)."""

# mean of ln cos(t/2) over |t| <= alpha, as a series in alpha^2, from ln cos z = ln(sin 2z / 2z) - ln(sin z / z)
_LN_COS = np.array([-zeta(2 * k) * (4.0**k - 1.0) / (k * (2 * k + 1)) / (2.0 * np.pi) ** (2 * k) for k in range(1, 61)])

# Feng et al. 2008, Table 1: the factor on the uniform-flux h_ii of the enhanced method
_ENHANCED_DEGREES = np.array([1.0, 2.5, 5.0, 7.5, 10.0, 12.5, 15.0, 17.5, 20.0])
_ENHANCED_FACTORS = np.array([0.9799, 0.9762, 0.9729, 0.9707, 0.9693, 0.9682, 0.9675, 0.9672, 0.9671])


def position_angles(arms: Floats) -> Floats:
    """Position angle of each arm of a disk, shape (s,) [rad], for arms of shape (s, 2).

    Examples
    --------
    >>> position_angles(np.array([[0.0, 2.0], [-1.0, 0.0]])) / np.pi
    array([0.5, 1. ])
    """
    return np.asarray(np.arctan2(arms[:, 1], arms[:, 0]))


@njit(cache=True)
def _remainder(x: float) -> float:
    """C(x) less its singular part zeta(3) + x^2/2 ln x - 3x^2/4, for 0 <= x <= pi."""
    square = x * x
    value = 0.0
    for k in range(_TERMS - 1, -1, -1):
        value = value * square + CLAUSEN_SERIES[k]
    return value * square * square


@njit(cache=True)
def _reduced_clausen(x: float) -> float:
    """C(x) - zeta(3) for any x."""
    x = abs(x) % (2.0 * math.pi)
    if x > math.pi:
        x = 2.0 * math.pi - x
    if x == 0.0:
        return 0.0
    return x * x * (0.5 * math.log(x) - 0.75) + _remainder(x)


@njit(cache=True, error_model="numpy")
def mutual_resistance_scalar(separation: float, a: float, b: float) -> float:
    """Scalar kernel of `mutual_resistance`."""
    half = math.sin(0.5 * separation)
    c = 1.0 / (half * half)
    if (a + b) ** 2 * c < 0.03:
        # Far arcs: Taylor series of the mean of -ln|sin(x/2)|, where the second difference would cancel.
        a2, b2 = a * a, b * b
        a4, b4 = a2 * a2, b2 * b2
        second = c / 4.0 * (a2 + b2) / 3.0
        fourth = (3.0 * c - 2.0) * c / 8.0 * ((a4 + b4) / 5.0 + 2.0 * a2 * b2 / 3.0)
        sixth = ((15.0 * c - 15.0) * c + 2.0) * c / 8.0 * ((a4 * a2 + b4 * b2) / 7.0 + a4 * b2 + a2 * b4)
        eighth = (((157.5 * c - 210.0) * c + 63.0) * c - 2.0) * c / 8.0
        eighth *= (a4 * a4 + b4 * b4) / 9.0 + 4.0 / 3.0 * (a4 * a2 * b2 + a2 * b4 * b2) + 2.8 * a4 * b4
        series = second / 2.0 + fourth / 24.0 + sixth / 720.0 + eighth / 40320.0
        return (series - math.log(abs(half))) / math.pi
    difference = (
        _reduced_clausen(separation + a - b)
        + _reduced_clausen(separation - a + b)
        - _reduced_clausen(separation + a + b)
        - _reduced_clausen(separation - a - b)
    )
    return (math.log(2.0) + difference / (4.0 * a * b)) / math.pi


@njit(cache=True)
def _mutual_resistances(separations: Floats, a: Floats, b: Floats) -> Floats:
    out = np.empty(separations.size)
    for k in range(separations.size):
        out[k] = mutual_resistance_scalar(separations[k], a[k], b[k])
    return out


@njit(cache=True)
def _clausen_values(x: Floats) -> Floats:
    out = np.empty(x.size)
    for k in range(x.size):
        out[k] = _reduced_clausen(x[k]) + _ZETA_3
    return out


def clausen_c3(x: ArrayLike) -> Floats:
    """Sum of cos(kx)/k^3 over k >= 1, to machine precision.

    Examples
    --------
    >>> round(float(clausen_c3(0.0)), 12)
    1.20205690316
    """
    x = np.asarray(x, dtype=np.float64)
    return _clausen_values(x.ravel()).reshape(x.shape)


def mutual_resistance(separation: ArrayLike, alpha_i: ArrayLike, alpha_j: ArrayLike) -> Floats:
    """Resistance kappa h_ij between two different arcs of a disk, uniform flux on each.

    kappa h_ij = 1/pi {ln 2 + [C(D+a-b) + C(D-a+b) - C(D+a+b) - C(D-a-b)] / (4ab)}; for arcs that
    are small against their distance, its Taylor series.

    Parameters
    ----------
    separation : array_like [rad]
        Difference D of the position angles.
    alpha_i, alpha_j : array_like [rad]
        Half-angles a, b of the two arcs. Broadcast together with ``separation``.

    Returns
    -------
    ndarray
        kappa h_ij, dimensionless.

    Notes
    -----
    Tends to -ln|sin(D/2)|/pi for small arcs.

    References
    ----------
    Feng, Han, Li, Owen 2008, Eqs. 20 and 35, doi:10.1016/j.jcp.2008.01.031.

    Examples
    --------
    >>> float(mutual_resistance(np.pi, 1e-3, 1e-3)) < 1e-6
    True
    """
    separation, alpha_i, alpha_j = np.broadcast_arrays(
        *(np.asarray(v, dtype=np.float64) for v in (separation, alpha_i, alpha_j))
    )
    flat = (np.ascontiguousarray(v).ravel() for v in (separation, alpha_i, alpha_j))
    return _mutual_resistances(*flat).reshape(separation.shape)


def standard_resistance(alpha: ArrayLike) -> Floats:
    """Self-resistance kappa h_ii of an arc under uniform flux (method ``standard``).

    kappa h_ii = (-ln a + 3/2 + a^2/36 + a^4/2700 + a^6/79380 + ...)/pi, in closed form for any a.

    Parameters
    ----------
    alpha : array_like [rad]
        Contact half-angle.

    Returns
    -------
    ndarray
        kappa h_ii, dimensionless.

    References
    ----------
    Feng, Han, Li, Owen 2008, Eq. 34 (whose last coefficient is misprinted), doi:10.1016/j.jcp.2008.01.031.

    Examples
    --------
    >>> a = np.radians(5.0)
    >>> bool(np.isclose(np.pi * standard_resistance(a), -np.log(a) + 1.5 + a**2 / 36, atol=1e-7))
    True
    """
    alpha = np.asarray(alpha, dtype=np.float64)
    two = 2.0 * alpha
    # for 2a > pi the reduced Clausen function folds; below it, only its smooth part is left after the logarithm
    smooth = _smooth_remainder(np.minimum(two, np.pi))
    folded = clausen_c3(two) - _ZETA_3
    below = -np.log(alpha) + 1.5 - 2.0 * smooth / two**2
    above = np.log(2.0) - 2.0 * folded / two**2
    return np.where(two <= np.pi, below, above) / np.pi


def _smooth_remainder(x: Floats) -> Floats:
    return x**4 * np.polynomial.polynomial.polyval(x * x, CLAUSEN_SERIES)


def enhanced_resistance(alpha: ArrayLike) -> Floats:
    """Self-resistance kappa h_ii with the tabulated flux correction (method ``enhanced``).

    lambda(alpha) times the uniform-flux value; lambda is linear between the tabulated angles
    (1 to 20 degrees) and constant outside.

    Parameters
    ----------
    alpha : array_like [rad]
        Contact half-angle.

    Returns
    -------
    ndarray
        kappa h_ii, dimensionless.

    References
    ----------
    Feng, Han, Li, Owen 2008, Table 1 and Eq. 42, doi:10.1016/j.jcp.2008.01.031.

    Examples
    --------
    >>> bool(enhanced_resistance(0.1) < standard_resistance(0.1))
    True
    """
    factor = np.interp(np.degrees(np.asarray(alpha, dtype=np.float64)), _ENHANCED_DEGREES, _ENHANCED_FACTORS)
    return factor * standard_resistance(alpha)


def chord_resistance(alpha: ArrayLike) -> Floats:
    """Self-resistance kappa h_ii of a contact chord (method ``chord``).

    kappa h_ii = -(1/pi) ln[beta tan(alpha/2)] + 2 kappa h_E,   beta = pi/(2 pi - 2 alpha),
    kappa h_E = -(1/pi) mean_{|phi|<=alpha} ln cos(phi/2).

    Parameters
    ----------
    alpha : array_like [rad]
        Contact half-angle.

    Returns
    -------
    ndarray
        kappa h_ii, dimensionless.

    Notes
    -----
    The exact resistance, by conformal map, of the disk less the circular segment behind an
    isothermal chord, for a far source. Mutual resistances: see `etc_engine.laws.disk_chords`.

    Examples
    --------
    >>> bool(chord_resistance(0.1) < enhanced_resistance(0.1))
    True
    """
    alpha = np.asarray(alpha, dtype=np.float64)
    beta = np.pi / (2.0 * np.pi - 2.0 * alpha)
    square = alpha * alpha
    mean_ln_cos = square * np.polynomial.polynomial.polyval(square, _LN_COS)
    return (-np.log(beta * np.tan(0.5 * alpha)) - 2.0 * mean_ln_cos) / np.pi


SELF_RESISTANCE: Mapping[str, Callable[[ArrayLike], Floats]] = {
    "chord": chord_resistance,
    "standard": standard_resistance,
    "enhanced": enhanced_resistance,
}


def self_resistance(alpha: ArrayLike, method: str) -> Floats:
    """Self-resistance kappa h_ii by the named method: ``chord``, ``standard`` or ``enhanced``.

    Raises
    ------
    InputError
        If the method is not one of these.

    Examples
    --------
    >>> bool(self_resistance(0.1, "chord") == chord_resistance(0.1))
    True
    """
    if method not in SELF_RESISTANCE:
        raise InputError(f"unknown method {method!r}: expected one of {', '.join(SELF_RESISTANCE)}")
    return SELF_RESISTANCE[method](alpha)


def resistance_matrices(offsets: Ints, arms: Floats, alpha: Floats, method: str) -> Floats:
    """Resistance matrices kappa H of many disks with uniform flux on their arcs, packed row by row.

    Parameters
    ----------
    offsets : ndarray of int, shape (n + 1,)
        Contacts of disk p: ``offsets[p]`` to ``offsets[p + 1]``.
    arms : ndarray, shape (s, 2)
        Directions of the contacts from the centre, of any length.
    alpha : ndarray, shape (s,) [rad]
    method : str
        ``standard`` or ``enhanced``.

    Returns
    -------
    ndarray, shape (sum of squared contact numbers,)
        Dimensionless.

    Examples
    --------
    >>> arms = np.array([[1.0, 0.0], [-1.0, 0.0]])
    >>> h = resistance_matrices(np.array([0, 2]), arms, np.array([0.1, 0.1]), "standard")
    >>> h.reshape(2, 2).round(4).tolist()
    [[1.2105, 0.0003], [0.0003, 1.2105]]
    """
    theta = np.arctan2(arms[:, 1], arms[:, 0])
    starts = np.concatenate([[0], np.cumsum(np.diff(offsets) ** 2)])
    return _matrices(offsets, starts, theta, np.ascontiguousarray(alpha), self_resistance(alpha, method))


@njit(cache=True)
def _matrices(
    offsets: Ints,
    starts: Ints,
    theta: Floats,
    alpha: Floats,
    own: Floats,
) -> Floats:
    values = np.empty(starts[-1])
    for p in range(offsets.size - 1):
        o, s, n = offsets[p], starts[p], offsets[p + 1] - offsets[p]
        for i in range(n):
            values[s + i * n + i] = own[o + i]
            for j in range(i):
                h = mutual_resistance_scalar(theta[o + i] - theta[o + j], alpha[o + i], alpha[o + j])
                values[s + i * n + j] = h
                values[s + j * n + i] = h
    return values


def first_moments(arms: Floats, alpha: Floats) -> Floats:
    """Mean unit direction over each arc, n sin(alpha)/alpha, shape (s, 2)."""
    theta = np.arctan2(arms[:, 1], arms[:, 0])
    return np.sinc(alpha / np.pi)[:, None] * np.stack([np.cos(theta), np.sin(theta)], axis=1)


def segment_area(alpha: Floats) -> Floats:
    """Area behind a chord of half-angle alpha, alpha - sin alpha cos alpha, of the unit disk."""
    return np.asarray(alpha - np.sin(alpha) * np.cos(alpha))
