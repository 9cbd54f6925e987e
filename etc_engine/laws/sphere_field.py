r"""Temperature inside a sphere that takes heat through its contacts, in closed form.

With lengths in radii, c = sin a the radius of a contact disk, x a point in the ball and x* = x/|x|^2 its image,

    4 pi kappa R (T(x) - T_o) = sum_j Q_j [U(x) + V(1) + int_0^1 (V(s) - 1) ds/s - a/sin a - 1],
    V(s) = U(x*/s)/(s |x|),
    U(x) = (1/c) arcsin{2c / [sqrt((rho - c)^2 + z^2) + sqrt((rho + c)^2 + z^2)]}

for equilibrium disks (method ``chord``): U is the potential of a conducting disk at the distance z from its plane and
rho from its axis, V that of its image in the sphere. For uniform caps (method ``standard``) the Mehler-Dirichlet
integral of `etc_engine.laws.sphere` continues into the ball. Both need sum_j Q_j = 0.
"""

from __future__ import annotations

import cmath
import math

import numpy as np
from numba import njit
from numpy.polynomial.legendre import leggauss

from etc_engine.arrays import Floats, Ints
from etc_engine.laws.sphere import FOUR_PI

_POINTS = 24
_NODES, _WEIGHTS = 0.5 * (leggauss(_POINTS)[0] + 1.0), 0.5 * leggauss(_POINTS)[1]


def sphere_temperatures(
    spheres: Ints,
    points: Floats,
    offsets: Ints,
    normals: Floats,
    alpha: Floats,
    flows: Floats,
    method: str,
) -> Floats:
    """Temperature above the mean of its sphere at points inside spheres.

    Parameters
    ----------
    spheres : ndarray of int, shape (q,)
        The sphere of each point.
    points : ndarray, shape (q, 3)
        Positions relative to the centre, in radii; a point outside the sphere is taken on it.
    offsets : ndarray of int, shape (n + 1,)
        Contacts of sphere p: ``offsets[p]`` to ``offsets[p + 1]``.
    normals : ndarray, shape (s, 3)
    alpha : ndarray, shape (s,) [rad]
    flows : ndarray, shape (s,) [K]
        Q/(kappa R) into the sphere at each contact; they sum to zero over a sphere.
    method : str
        ``chord`` or ``standard``.

    Returns
    -------
    ndarray, shape (q,) [K]

    Notes
    -----
    The centre has the mean temperature. The heat that the dents of other contacts deflect is left out.

    Examples
    --------
    >>> ends = np.array([[0, 0, 1.0], [0, 0, -1.0]])
    >>> at = np.array([[0, 0, 0.5], [0, 0, 0.0], [0, 0, -0.5]])
    >>> values = sphere_temperatures(
    ...     np.zeros(3, dtype=np.int64), at, np.array([0, 2]), ends, np.full(2, 0.1), np.array([1.0, -1.0]), "chord"
    ... )
    >>> (values.round(4) + 0.0).tolist()
    [0.297, 0.0, -0.297]
    """
    return _temperatures(
        np.ascontiguousarray(spheres, dtype=np.int64),
        np.ascontiguousarray(points, dtype=np.float64),
        np.ascontiguousarray(offsets, dtype=np.int64),
        np.ascontiguousarray(normals, dtype=np.float64),
        np.ascontiguousarray(alpha, dtype=np.float64),
        np.ascontiguousarray(flows, dtype=np.float64),
        method == "standard",
    )


@njit(cache=True)
def _temperatures(
    spheres: Ints,
    points: Floats,
    offsets: Ints,
    normals: Floats,
    alpha: Floats,
    flows: Floats,
    uniform: bool,
) -> Floats:
    out = np.empty(spheres.size)
    for q in range(spheres.size):
        r = math.sqrt(points[q, 0] ** 2 + points[q, 1] ** 2 + points[q, 2] ** 2)
        scale = 1.0 / max(r, 1.0)
        total = 0.0
        for j in range(offsets[spheres[q]], offsets[spheres[q] + 1]):
            height = 0.0
            for axis in range(3):
                height += scale * points[q, axis] * normals[j, axis]
            value = (
                cap_temperature(min(r, 1.0), height, alpha[j])
                if uniform
                else disk_temperature(r * scale, height, alpha[j])
            )
            total += flows[j] * value
        out[q] = total / FOUR_PI
    return out


@njit(cache=True)
def disk_potential(height: float, rho: float, c: float) -> float:
    """U = (1/c) arcsin{2c / [sqrt((rho - c)^2 + z^2) + sqrt((rho + c)^2 + z^2)]}, of a conducting disk."""
    near = math.sqrt((rho - c) ** 2 + height * height)
    far = math.sqrt((rho + c) ** 2 + height * height)
    return math.asin(min(1.0, 2.0 * c / (near + far))) / c


@njit(cache=True)
def disk_temperature(r: float, height: float, a: float) -> float:
    """U(x) + V(1) + int_0^1 (V(s) - 1) ds/s - a/sin a - 1 for a point at |x| = r and x . n = height."""
    c, plane = math.sin(a), math.cos(a)
    if r < 1e-6:
        return disk_potential(height - plane, r, c) - a / c
    rho = math.sqrt(max(r * r - height * height, 0.0))
    square = r * r
    image = disk_potential(height / square - plane, rho / square, c) / r
    value = disk_potential(height - plane, rho, c) + image - a / c - 1.0
    for k in range(_POINTS):
        s = 1.0 - _NODES[k] ** 2  # clustered at the surface
        v = disk_potential(height / (s * square) - plane, rho / (s * square), c) / (s * r)
        value += _WEIGHTS[k] * 2.0 * _NODES[k] * (v - 1.0) / s
    return value


@njit(cache=True, error_model="numpy")
def cap_temperature(r: float, height: float, a: float) -> float:
    """int_0^a g(t) Re{z^(1/2) [2/D - 2 - ln((1 - r z cos gamma + D)/2)]} dt, z = e^{it}.

    D^2 = 1 - 2 r z cos gamma + r^2 z^2. The integral is split at t = gamma, where D is small near the surface.
    """
    cosine = min(1.0, max(-1.0, height / r)) if r > 0.0 else 1.0
    gamma = math.acos(cosine)
    split = min(gamma, a)
    value = 0.0
    for part in range(2):
        length = split if part == 0 else a - split
        for k in range(_POINTS):
            x = _NODES[k]
            # t = split -+ length p(x): p ~ x^2 at the split, 1 - p ~ (1 - x)^2 at a
            p = x * x if part == 0 else x * x * (3.0 - 2.0 * x)
            slope = 2.0 * x if part == 0 else 6.0 * x * (1.0 - x)
            t = split - length * p if part == 0 else split + length * p
            g = math.sqrt(max(2.0 * math.sin(0.5 * (a + t)) * math.sin(0.5 * (a - t)), 0.0))
            root = complex(math.cos(0.5 * t), math.sin(0.5 * t))
            z = root * root
            left = complex(1.0 - r * math.cos(t + gamma), -r * math.sin(t + gamma))
            right = complex(1.0 - r * math.cos(t - gamma), -r * math.sin(t - gamma))
            d = cmath.sqrt(left) * cmath.sqrt(right)
            kernel = root * (2.0 / d - 2.0 - cmath.log(0.5 * (1.0 - r * z * cosine + d)))
            value += _WEIGHTS[k] * slope * length * g * kernel.real
    return value * 2.0 * math.sqrt(2.0) / math.pi / (2.0 * math.sin(0.5 * a) ** 2)
