r"""What a resistance over the area of a contact adds beyond its mean: the flux must spread more evenly.

A contact of half-width (radius) c between two bodies carries the heat Q. Without a resistance its flux is that of an
isothermal contact, crowded at the edge. A resistance r of a unit of area evens it out. With 1/kappa* = 1/kappa_A +
1/kappa_B (kappa* = kappa_A at an isothermal wall) and lambda = r kappa*/c, the whole resistance exceeds the sum of
that of the isothermal contact and r/A by

    Delta R = D f(lambda)/(kappa* c^(d-2)),      f(lambda) = lambda (lambda + p_0)/(lambda (lambda + p_1) + p_2).

D is the difference between uniform flux and isothermal contact on a half-plane, (3/2 - 2 ln 2)/pi, or a half-space,
8/(3 pi^2) - 1/4. f rises from 0 to 1. The flux at the edge of a wider contact is less singular: of disks D falls as
1 - 1.25 alpha + alpha^2/4, by chains of disks solved by method ``exact`` at half-angles up to 40 degrees.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from etc_engine.arrays import Floats

LIMITS: Mapping[int, float] = {2: (1.5 - 2.0 * np.log(2.0)) / np.pi, 3: 8.0 / (3.0 * np.pi**2) - 0.25}
"""D by the dimension."""
_FITS: Mapping[int, tuple[float, float, float]] = {
    2: (0.06095515, 0.25108922, 0.00483694),
    3: (0.05222857, 0.20050227, 0.00311989),
}
"""p_0, p_1, p_2: within .0045 of minima of the dissipated power over 400 intervals (2D) and 60 polynomials (3D)."""


_WIDE: Mapping[int, tuple[float, float]] = {2: (-1.25, 0.25), 3: (0.0, 0.0)}
"""Change of D over the half-angle and its square; not known of spheres."""


def edge_factor(alpha: ArrayLike, dimension: int) -> Floats:
    """D at a half-angle [rad] over that of narrow contacts.

    Examples
    --------
    >>> edge_factor([0.0, 0.4, 1.5], 2).round(3).tolist()
    [1.0, 0.54, 0.0]
    """
    alpha = np.asarray(alpha, dtype=np.float64)
    linear, square = _WIDE[dimension]
    return np.asarray(np.maximum(1.0 + alpha * (linear + square * alpha), 0.0))


def film_excess(film: ArrayLike, dimension: int) -> Floats:
    r"""Excess kappa* c^(d-2) Delta R of a contact that resists over its area, dimensionless.

    Parameters
    ----------
    film : array_like
        lambda = r kappa*/c, >= 0.
    dimension : int
        2 or 3.

    Returns
    -------
    ndarray

    Notes
    -----
    For contacts much narrower than their particles.

    Examples
    --------
    >>> film_excess([0.0, 0.3, 1e9], 2).round(4).tolist()
    [0.0, 0.023, 0.0362]
    """
    film = np.minimum(np.asarray(film, dtype=np.float64), 1e12)
    p, q, s = _FITS[dimension]
    return np.asarray(LIMITS[dimension] * film * (film + p) / (film * (film + q) + s))
