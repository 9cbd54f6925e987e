r"""Dirichlet energy of a ball whose surface temperature is given at the nodes of a quadratic surface mesh.

With the spherical harmonics of degree l of the surface temperature T, the energy is k R sum_l l |T_l|^2. For an
interpolated T it is written through the Laplace-Beltrami stiffness S of the mesh (exact for the interpolant):

    E = k R T.S G S T,   4 pi G(gamma) = sum_{l>=1} (2l+1) / (l (l+1)^2) P_l(cos gamma)
                                       = 1 - 2 ln(1+s) + F(s),   s = sin(gamma/2),
    F = sum_{l>=1} P_l / (l+1)^2 = int_0^inf u e^-u / sqrt((1 - e^-u)^2 + 4 s^2 e^-u) du - 1,

because S T holds the charges -Lap T and l (l+1)^2 = [l (l+1)]^2 / l.
"""

from __future__ import annotations

import functools

import numpy as np
from numba import njit
from scipy.interpolate import CubicSpline

from etc_engine.arrays import Floats

KNOTS = 2000
"""Knots of the table, uniform in sqrt(s)."""


def green_function(s: Floats) -> Floats:
    """G at s = sin(gamma/2), by quadrature.

    Examples
    --------
    >>> l = np.arange(1.0, 4000.0)
    >>> opposite = ((2 * l + 1) / (l * (l + 1) ** 2) * (-1.0) ** l).sum() / (4.0 * np.pi)
    >>> bool(abs(green_function(np.array([1.0]))[0] - opposite) < 1e-8)
    True
    """
    points, weights = np.polynomial.legendre.leggauss(20)
    ends = np.concatenate(([0.0], np.geomspace(1e-9, 1.0, 46), np.linspace(1.0, 40.0, 30)[1:]))
    half = 0.5 * np.diff(ends)
    u = (ends[:-1] + half)[:, None] + half[:, None] * points
    e = np.exp(-u)
    density, beyond = u * e * half[:, None] * weights, np.expm1(-u) ** 2
    integral = [float(np.sum(density / np.sqrt(beyond + 4.0 * x * x * e))) for x in s]
    green: Floats = (1.0 - 2.0 * np.log1p(s) + np.array(integral) - 1.0) / (4.0 * np.pi)
    return green


@functools.cache
def green_table() -> Floats:
    """Cubic pieces of G over sqrt(s), shape (knots, 4), highest power first; off by less than 1e-11."""
    root = np.linspace(0.0, 1.0, KNOTS + 1)
    spline = CubicSpline(root, green_function(root**2), bc_type=((1, 0.0), "not-a-knot"))
    table = np.ascontiguousarray(spline.c.T)
    table.setflags(write=False)
    return table


@njit(cache=True)
def green_matrix(directions, table):  # type: ignore[no-untyped-def]
    """G between all pairs of unit directions."""
    n, knots = len(directions), len(table)
    green = np.empty((n, n))
    for i in range(n):
        for j in range(i + 1):
            dx = directions[i, 0] - directions[j, 0]
            dy = directions[i, 1] - directions[j, 1]
            dz = directions[i, 2] - directions[j, 2]
            root = np.sqrt(0.5 * np.sqrt(dx * dx + dy * dy + dz * dz))  # sqrt(sin(gamma / 2))
            k = min(int(root * knots), knots - 1)
            t = root - k / knots
            value = ((table[k, 0] * t + table[k, 1]) * t + table[k, 2]) * t + table[k, 3]
            green[i, j] = value
            green[j, i] = value
    return green


@njit(cache=True)
def sandwich(green, rows, columns, stiffness):  # type: ignore[no-untyped-def]
    """S G S for a symmetric sparse S given as (row, column, value) with repetitions."""
    n = len(green)
    left = np.zeros((n, n))
    for e in range(len(rows)):
        left[rows[e]] += stiffness[e] * green[columns[e]]
    turned = np.ascontiguousarray(left.T)
    energy = np.zeros((n, n))
    for e in range(len(rows)):
        energy[rows[e]] += stiffness[e] * turned[columns[e]]
    return energy
