r"""Resistance between coaxial caps of a ball: heat in through one, mean temperature over the other.

The Neumann function of the ball, sources and readings on its surface, heat drawn off evenly, is

.. math:: 4\pi\kappa R\,N(\gamma) = \sum_{l \ge 1}\frac{2l+1}{l}P_l(\cos\gamma) = \frac1s - 2 - \ln(s + s^2),
   \qquad s = \sin(\gamma/2).

Uniform flux over a cap of half-angle theta has the Legendre means A_l(theta), the equilibrium flux of a flat contact
disk, 1/sqrt(c^2 - rho^2), the means B_l(theta),

.. math:: A_l = \frac{P_{l-1}(\cos\theta) - P_{l+1}(\cos\theta)}{(2l+1)(1-\cos\theta)}, \qquad
   B_l = \frac{\sin((l+\frac12)\theta)}{(2l+1)\sin(\theta/2)}.

This module tabulates two functions of two caps a <= b, with beta = sin(b/2) and p = sin(a/2)/beta:

    F(a, b) = sum (2l+1)/l A_l(a) A_l(b),        D(a, b) = sum (2l+1)/l B_l(a) A_l(b).

**No series.** By Mehler's integral every cap has A_l = int_0^theta g(t) cos((l + 1/2) t) dt, and the cosines are
complete: sum_{l >= 0} 2 A_l A'_l = pi int g g' dt. The rest, sum (1/l) A_l A'_l, is the mean of -ln s - ln(1+s):

    F = 8/(pi beta) int_0^{pi/2} cos^2 u f du - 2 - <ln s> - <ln(1+s)>,
    D = 2/beta int_0^{pi/2} cos u f du - 2 - <ln s> - <ln(1+s)>,
    f^2 = (1 - p^2 sin^2 u)/(1 - p^2 beta^2 sin^2 u).

The mean of ln s over a circle is elementary, ln(cos(theta</2) sin(theta>/2)). What is left, beta (F + ln beta), is
smooth in beta and in sqrt(1 - p): products of Chebyshev polynomials have it to 1e-6.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numba import njit
from numpy.polynomial import chebyshev
from numpy.polynomial.legendre import leggauss

from etc_engine.arrays import Floats

WIDEST = np.sqrt(0.5)
"""sin(b/2) of the widest cap, a hemisphere."""
Y_TERMS, BETA_TERMS = 16, 8
"""Chebyshev polynomials in sqrt(1 - p) and in beta."""


@lru_cache(maxsize=1)
def coaxial_tables() -> Floats:
    """Chebyshev coefficients of beta (F + ln beta) and beta (D + ln beta), shape (2, Y_TERMS, BETA_TERMS).

    Notes
    -----
    Made once in about half a second. The interpolation error is below 2e-6, that of the quadrature, which a cone in
    ln(1 + s) limits, below 3e-6.
    """
    y = 0.5 * (np.cos(np.pi * (np.arange(Y_TERMS) + 0.5) / Y_TERMS) + 1.0)
    beta = 0.5 * WIDEST * (np.cos(np.pi * (np.arange(BETA_TERMS) + 0.5) / BETA_TERMS) + 1.0)
    on_y = np.linalg.inv(chebyshev.chebvander(2.0 * y - 1.0, Y_TERMS - 1))
    on_beta = np.linalg.inv(chebyshev.chebvander(2.0 * beta / WIDEST - 1.0, BETA_TERMS - 1))
    samples = np.array([[[_scaled(1.0 - v * v, b, disk) for b in beta] for v in y] for disk in (False, True)])
    return np.ascontiguousarray(on_y @ samples @ on_beta.T)


def _scaled(p: float, beta: float, disk: bool) -> float:
    """Sample of beta (F + ln beta), or with D, by Gauss quadrature: in u, over both caps, around the axis."""
    x, w = leggauss(48)
    u, wu = 0.25 * np.pi * (x + 1.0), 0.25 * np.pi * w
    f = np.sqrt((1.0 - (p * np.sin(u)) ** 2) / (1.0 - (p * beta * np.sin(u)) ** 2))
    first = 2.0 * np.sum(wu * np.cos(u) * f) if disk else 8.0 / np.pi * np.sum(wu * np.cos(u) ** 2 * f)
    x, w = leggauss(24)
    z, wz = 0.5 * (x + 1.0), 0.5 * w
    small, large = (p * beta) ** 2, beta * beta  # v = sin^2(theta/2) is uniform over a cap
    v = small * (1.0 - z * z) if disk else small * z * z
    wv = wz if disk else 2.0 * z * wz
    other, wo = large * z * z, 2.0 * z * wz
    ln_s = 0.5 * np.sum(wv * ((large - 1.0) / large * np.log1p(-v) - 1.0))  # less ln beta
    around = np.cos((np.arange(24) + 0.5) * np.pi / 24)
    both = np.sqrt(np.outer(v * (1.0 - v), other * (1.0 - other)))
    cosine = np.outer(1.0 - 2.0 * v, 1.0 - 2.0 * other)[..., None] + 4.0 * both[..., None] * around
    s = np.sqrt(np.maximum(0.5 * (1.0 - cosine), 0.0))
    ln_1_s = float(wv @ np.log1p(s).mean(axis=2) @ wo)
    return float(first - beta * (2.0 + ln_s + ln_1_s))


@njit(cache=True)
def coaxial_column(
    table: Floats,
    b: Floats,
    k: int,
    count: int | np.int64,
    out: Floats,
    work: Floats,
) -> None:
    """F or D of the first ``count`` caps (or disks) in cap k, by Clenshaw's recurrence in beta, then in y.

    Parameters
    ----------
    table : ndarray, shape (Y_TERMS, BETA_TERMS)
    b : ndarray
        sin^2(theta/2) of the caps, ascending.
    k, count : int
    out : ndarray
        Filled up to ``count``.
    work : ndarray, shape (6, n), n >= Y_TERMS, count
    """
    beta = np.sqrt(b[k])
    x = 2.0 * beta / WIDEST - 1.0
    coefficients, after, last = work[0], work[1], work[2]
    y, up, down = work[3], work[4], work[5]
    for t in range(Y_TERMS):
        after[t] = last[t] = 0.0
    for m in range(BETA_TERMS - 1, 0, -1):
        for t in range(Y_TERMS):
            value = table[t, m] + 2.0 * x * after[t] - last[t]
            last[t] = after[t]
            after[t] = value
    for t in range(Y_TERMS):
        coefficients[t] = table[t, 0] + x * after[t] - last[t]
    for l in range(count):
        y[l] = 2.0 * np.sqrt(max(1.0 - np.sqrt(b[l]) / beta, 0.0)) - 1.0
        up[l] = down[l] = 0.0
    for t in range(Y_TERMS - 1, 0, -1):
        for l in range(count):
            value = coefficients[t] + 2.0 * y[l] * up[l] - down[l]
            down[l] = up[l]
            up[l] = value
    for l in range(count):
        out[l] = (coefficients[0] + y[l] * up[l] - down[l]) / beta - np.log(beta)
