r"""Thermal resistance between contact disks of a sphere, in closed form.

A sphere of radius R and conductivity kappa receives the heat Q_j through its contact disk j, of half-angle a_j
(disk radius c_j = R sin a_j) about the unit direction n_j. The mean temperature of disk i is then

    T_i = T_o + sum_j h_ij Q_j.

Everything here is the dimensionless kappa R h. The Neumann function of the ball with a sink at its centre,

    4 pi N(gamma) = sum_{l>=1} (2l+1)/l P_l(cos gamma) = 1/s - 2 - ln(s + s^2),    s = sin(gamma/2),

is the limit of small contacts. Two flux densities are offered: ``standard``, uniform over the spherical cap, and
``chord``, the equilibrium density of an isothermal flat disk, with the sphere cut at the plane of the disk.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Mapping

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from etc_engine.arrays import Floats
from etc_engine.errors import InputError

FOUR_PI = 4.0 * math.pi

# standard: kappa R h - 8/(3 pi^2 a) + ln(a)/(4 pi) in Chebyshev polynomials of 4a/pi - 1, 0 < a <= 90 degrees.
# Interpolates sums of 4e6 Legendre terms with their mean remainder, to 1e-13.
_STANDARD = np.array(
    [-8.31075808389e-02, 5.99719328064e-03, 4.97117439969e-03, -3.67192271829e-05, -5.57477239e-06, -8.95117898e-07]
    + [-1.23090419e-07, -8.94783484e-09, -1.00611679e-09, -5.96229137e-11, -5.55656916e-12, -1.93836852e-13]
)
# chord: (kappa R h_disk - kappa R h) cos(a)/a in Chebyshev polynomials of 6a/pi - 1 (up to 60 degrees, to 2e-11) and of
# 12a/pi - 5 (above, to 1e-11 up to 88 degrees), fitted to spectral-element solutions of the cut sphere.
_CUT = np.array(
    [7.03245456e-03, 3.24016334e-03, 8.03374247e-04, 1.11209464e-04, 1.44098820e-05, 2.16568570e-06]
    + [3.13996256e-07, 5.61054879e-08, 8.62409050e-09, 1.18984397e-09, 3.20067432e-10]
)
_CUT_WIDE = np.array(
    [1.72476903e-02, 6.92644965e-03, 9.99250739e-04, 1.33417482e-04, 1.97638231e-05, 3.11535478e-06, 5.07214678e-07]
    + [8.42765714e-08, 1.41560513e-08, 2.38799516e-09, 4.02817630e-10, 6.73821216e-11, 1.08436400e-11, 1.48266100e-12]
)

# Quadrature orders over a disk for (a_i + a_j)/gamma below .1, .35, .7, .9 and above, one after the other.
_ORDERS = (2, 4, 8, 16, 32)
_FIRST = np.array([0, 2, 6, 14, 30], dtype=np.int64)
_LEGENDRE = np.concatenate([np.array(np.polynomial.legendre.leggauss(m)) for m in _ORDERS], axis=1)
# the positive nodes of the Chebyshev rule of the second kind with 2m points, and its weights
_CHEBYSHEV = np.concatenate(
    [
        np.array([np.cos(angle), np.pi / (2 * m + 1) * np.sin(angle) ** 2])
        for m in _ORDERS
        for angle in [np.pi * np.arange(1, m + 1) / (2 * m + 1)]
    ],
    axis=1,
)


def neumann(cosine: ArrayLike) -> Floats:
    """Temperature kappa R N at the surface of a ball, at an angle from a unit point source on it.

    4 pi N = 1/s - 2 - ln(s + s^2), s = sin(gamma/2), for a sink at the centre; T_o is 0.

    Parameters
    ----------
    cosine : array_like
        cos(gamma), below 1.

    Returns
    -------
    ndarray
        Dimensionless.

    Examples
    --------
    >>> bool(np.isclose(neumann(-1.0), (-1.0 - np.log(2.0)) / (4.0 * np.pi)))
    True
    """
    s = np.sqrt(0.5 * (1.0 - np.asarray(cosine, dtype=np.float64)))
    return np.asarray((1.0 / s - 2.0 - np.log(s + s * s)) / FOUR_PI)


def standard_resistance(alpha: ArrayLike) -> Floats:
    """Self-resistance kappa R h_ii of a cap under uniform flux (method ``standard``).

    4 pi kappa R h_ii = sum_{l>=1} (2l+1)/l A_l^2, A_l = (P_{l-1} - P_{l+1})(cos a)/((2l+1)(1 - cos a)): the small-angle
    part 8/(3 pi^2 a) - ln(a)/(4 pi), and a Chebyshev series for the rest.

    Parameters
    ----------
    alpha : array_like [rad]
        Contact half-angle, at most pi/2.

    Returns
    -------
    ndarray
        Dimensionless, to 1e-12.

    Examples
    --------
    >>> round(float(standard_resistance(np.radians(20.0))), 9)
    0.769417786
    """
    alpha = np.asarray(alpha, dtype=np.float64)
    smooth = np.polynomial.chebyshev.chebval(4.0 * alpha / np.pi - 1.0, _STANDARD)
    return np.asarray(8.0 / (3.0 * np.pi**2 * alpha) - np.log(alpha) / FOUR_PI + smooth)


def disk_resistance(alpha: ArrayLike) -> Floats:
    """Self-resistance kappa R h_ii of a flat disk with the density 1/sqrt(c^2 - rho^2) inside the full ball.

    4 pi kappa R h_ii = pi/(2 sin a) - 2a/sin a + 2 - ln(2 sin a) + (pi/2 - a) cot a;
    an upper bound of `chord_resistance`.

    Parameters
    ----------
    alpha : array_like [rad]
        Contact half-angle, at most pi/2.

    Returns
    -------
    ndarray
        Dimensionless; 1/(4a) - [ln(2a) + 1]/(4 pi) for small angles.

    Examples
    --------
    >>> round(float(disk_resistance(np.radians(20.0))), 8)
    0.6595314
    """
    alpha = np.asarray(alpha, dtype=np.float64)
    sine = np.sin(alpha)
    value = (0.5 * np.pi - 2.0 * alpha) / sine + 2.0 - np.log(2.0 * sine) + (0.5 * np.pi - alpha) / np.tan(alpha)
    return np.asarray(value / FOUR_PI)


def chord_resistance(alpha: ArrayLike) -> Floats:
    """Self-resistance kappa R h_ii of the sphere cut at an isothermal contact disk (method ``chord``).

    h_ii = h_disk - (a/cos a) sum_k c_k T_k. Exact for one disk and a sink at the centre.

    Parameters
    ----------
    alpha : array_like [rad]
        Contact half-angle, below pi/2.

    Returns
    -------
    ndarray
        Dimensionless, to 2e-11 up to 60 degrees and 1e-9 up to 89.

    Notes
    -----
    Becomes negative above 69 degrees, where the disk is nearer to the centre than the surface mean. The differences
    h_ii + h_jj - 2 h_ij, which alone matter, stay positive for contacts that do not meet.

    Examples
    --------
    >>> round(float(chord_resistance(np.radians(20.0))), 9)
    0.657516806
    """
    alpha = np.asarray(alpha, dtype=np.float64)
    narrow = np.polynomial.chebyshev.chebval(np.minimum(6.0 * alpha / np.pi, 2.0) - 1.0, _CUT)
    wide = np.polynomial.chebyshev.chebval(np.maximum(12.0 * alpha / np.pi, 4.0) - 5.0, _CUT_WIDE)
    series = np.where(alpha <= np.pi / 3.0, narrow, wide)
    return np.asarray(disk_resistance(alpha) - alpha / np.cos(alpha) * series)


SELF_RESISTANCE: Mapping[str, Callable[[ArrayLike], Floats]] = {
    "chord": chord_resistance,
    "standard": standard_resistance,
}


def holm_resistance(alpha: ArrayLike) -> Floats:
    """Resistance kappa R h = 1/(4 sin alpha) of an isothermal disk on a half-space (pipe method ``holm``).

    Two of them in series conduct 2 kappa c, c = R sin alpha. The limit of `chord_resistance` for small contacts.

    References
    ----------
    Batchelor, O'Brien 1977, Thermal or electrical conduction through a granular material, doi:10.1098/rspa.1977.0100.

    Examples
    --------
    >>> bool(np.isclose(holm_resistance(1e-4), chord_resistance(1e-4), rtol=1e-3))
    True
    """
    return np.asarray(0.25 / np.sin(np.asarray(alpha, dtype=np.float64)))


def root_area_resistance(alpha: ArrayLike) -> Floats:
    """Resistance kappa R h = 1/(4 sqrt(pi) sin alpha) of the conductance 4 k_1 k_2/(k_1 + k_2) sqrt(A) of DEM codes.

    A = pi c^2 is the area of the contact. It is there to reproduce such codes: it conducts sqrt(pi) = 1.77 times as
    much as a small contact does.

    References
    ----------
    LIGGGHTS, ``fix heat/gran/conduction``, source of the public version.
    """
    return np.asarray(holm_resistance(alpha) / np.sqrt(np.pi))


PIPE_RESISTANCE: Mapping[str, Callable[[ArrayLike], Floats]] = {
    **SELF_RESISTANCE,
    "holm": holm_resistance,
    "root-area": root_area_resistance,
}
"""Self-resistances for which no mutual ones exist are for the pipe network alone."""


def self_resistance(alpha: ArrayLike, method: str) -> Floats:
    """Self-resistance kappa R h_ii by the named method, ``chord`` or ``standard``.

    Raises
    ------
    InputError
        If spheres have no such method.
    """
    if method not in SELF_RESISTANCE:
        raise InputError(f"spheres have no method {method!r}: expected one of {', '.join(SELF_RESISTANCE)}")
    return SELF_RESISTANCE[method](alpha)


def mutual_resistance(cosine: ArrayLike, alpha_i: ArrayLike, alpha_j: ArrayLike, method: str = "chord") -> Floats:
    """Resistance kappa R h_ij between two different contacts of a sphere.

    The mean of the ball's Neumann function over the flux densities of both contacts. An equilibrium disk (``chord``)
    is a line of sources at the complex heights cos a + i x sin a, |x| <= 1; a uniform cap (``standard``) follows
    from the Mehler-Dirichlet integral. Either mean is a Gauss rule of m x m points; for disks m = 2, 4, 8, 16, 32 where
    (a_i + a_j)/gamma is below .1, .35, .7, .9, 1, for caps half of that.

    Parameters
    ----------
    cosine : array_like
        cos(gamma), gamma the angle between the contact directions.
    alpha_i, alpha_j : array_like [rad]
        Half-angles; a_i + a_j < gamma. Broadcast together with ``cosine``.
    method : str
        ``chord`` or ``standard``.

    Returns
    -------
    ndarray
        Dimensionless; tends to `neumann` for small contacts.

    Examples
    --------
    >>> bool(np.isclose(mutual_resistance(-1.0, 1e-3, 1e-3), neumann(-1.0), atol=1e-6))
    True
    """
    self_resistance(0.1, method)
    cosine, alpha_i, alpha_j = np.broadcast_arrays(
        *(np.asarray(v, dtype=np.float64) for v in (cosine, alpha_i, alpha_j))
    )
    a, b = alpha_i.ravel(), alpha_j.ravel()
    return _mutual(cosine.ravel(), a, b, method == "standard").reshape(cosine.shape)


def first_moments(arms: Floats, alpha: Floats) -> Floats:
    """First harmonic of an equilibrium disk, n (1 + 2 cos alpha)/3, shape (s, 3); of a cap nearly the same."""
    unit = arms / np.linalg.norm(arms, axis=1, keepdims=True)
    return np.asarray(unit * ((1.0 + 2.0 * np.cos(alpha)) / 3.0)[:, None])


@njit(cache=True)
def _order(cosine: float, a: float, b: float) -> int:
    """Row of the quadrature table for two contacts."""
    ratio = (a + b) / math.acos(min(1.0, max(-1.0, cosine)))
    return 0 if ratio < 0.1 else 1 if ratio < 0.35 else 2 if ratio < 0.7 else 3 if ratio < 0.9 else 4


@njit(cache=True, error_model="numpy")
def mutual_of_disks(cosine: float, a: float, b: float) -> float:
    """4 pi h_ij = (1/4) int int Re[1/D1 + 1/D2 - ln((1 - t cos gamma + D2)/2)] dx dy - a/sin a - b/sin b.

    zeta = cos a + i x sin a, zeta' = cos b + i y sin b, t = zeta zeta', D1^2 = zeta^2 - 2 t cos gamma + zeta'^2,
    D2^2 = 1 - 2 t cos gamma + t^2.
    """
    row = _order(cosine, a, b)
    first, m = _FIRST[row], 2 << row
    ca, sa, cb, sb = math.cos(a), math.sin(a), math.cos(b), math.sin(b)
    total = 0.0
    for p in range(m):
        u = complex(ca, sa * _LEGENDRE[0, first + p])
        inner = 0.0
        for q in range(m // 2):  # (x, y) and (-x, -y) are conjugate
            v = complex(cb, sb * _LEGENDRE[0, first + q])
            t = u * v
            image = cmath.sqrt(1.0 - 2.0 * t * cosine + t * t)
            value = 1.0 / cmath.sqrt(u * u - 2.0 * t * cosine + v * v) + 1.0 / image
            product = 0.5 * (1.0 - t * cosine + image)
            inner += _LEGENDRE[1, first + q] * (value.real - math.log(abs(product)))
        total += _LEGENDRE[1, first + p] * inner
    return (0.5 * total - a / sa - b / sb) / FOUR_PI


@njit(cache=True, error_model="numpy")
def _cap_kernel(x: float, cosine: float) -> float:
    """sum_{l>=1} (2l+1)/l P_l(cos gamma) cos((l + 1/2) x), for |x| < gamma."""
    z, root = complex(math.cos(x), math.sin(x)), complex(math.cos(0.5 * x), math.sin(0.5 * x))
    chord = math.sqrt(2.0 * (z.real - cosine))
    return 2.0 / chord - 2.0 * root.real - (root * cmath.log(0.5 * (1.0 - z * cosine + root * chord))).real


@njit(cache=True, error_model="numpy")
def mutual_of_caps(cosine: float, a: float, b: float) -> float:
    """4 pi h_ij = int_0^a int_0^b g(t) g(u) [k(t + u) + k(t - u)]/2 du dt with k the kernel of the caps.

    g(t) = (2 sqrt 2/pi) sqrt(cos t - cos a)/(1 - cos a), from A_l = int_0^a g(t) cos((l + 1/2) t) dt.
    """
    row = max(_order(cosine, a, b) - 1, 0)
    first, m = _FIRST[row], 2 << row
    total = 0.0
    for p in range(m):
        x = a * _CHEBYSHEV[0, first + p]
        inner = 0.0
        for q in range(m):
            y = b * _CHEBYSHEV[0, first + q]
            kernel = _cap_kernel(x + y, cosine) + _cap_kernel(x - y, cosine)
            inner += _CHEBYSHEV[1, first + q] * _cap_density(y, b) * kernel
        total += _CHEBYSHEV[1, first + p] * _cap_density(x, a) * inner
    return 0.5 * total / FOUR_PI


@njit(cache=True, error_model="numpy")
def _cap_density(t: float, a: float) -> float:
    """Smooth factor a g(t)/sqrt(1 - (t/a)^2) of the density g."""
    root = math.sqrt(2.0 * math.sin(0.5 * (a + t)) * math.sin(0.5 * (a - t)) / (a * a - t * t))
    return 2.0 * math.sqrt(2.0) / math.pi * a * a * root / (2.0 * math.sin(0.5 * a) ** 2)


@njit(cache=True)
def _mutual(cosine: Floats, a: Floats, b: Floats, uniform: bool) -> Floats:
    out = np.empty(cosine.size)
    for k in range(cosine.size):
        out[k] = mutual_of_caps(cosine[k], a[k], b[k]) if uniform else mutual_of_disks(cosine[k], a[k], b[k])
    return out
