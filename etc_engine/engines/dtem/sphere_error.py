r"""Estimated error of ``chord`` for spheres, from its heat flows.

``chord`` takes the temperature to vary in the same way along the two sides of a contact. Where the slopes G_A and G_B
of the two spheres along it differ, heat crosses the disk in one half and returns in the other. A disk of radius c
between two half-spaces of conductivity kappa lets 4/3 kappa c^3 |G_A - G_B|^2 pass in this way, twice that from an
isothermal wall, whose own slope is zero. With

    G_j = sum_k Q_k g_jk/(kappa R^2)      (g_jk the gradient of the Neumann function at contact j, source at k),
    J = (4/3) [sum_contacts <kappa> c^3 |G_A - G_B|^2 + 2 sum_walls kappa c^3 |G|^2]/E,

<kappa> the harmonic mean and E the energy, the conductivity by ``chord`` is low by about J in random packings. In
lattices J vanishes, and neighbouring contacts raise it: by about .005 to .02 times the sixth power of the ratio
(a_i + a_j)/gamma_ij, summed over neighbours j and averaged over contacts i with their heat flows.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from etc_engine.arrays import Floats, Ints
from etc_engine.laws.sphere_dents import neumann_slope
from etc_engine.medium.sides import ContactSides

CROWDING = 0.011
"""What the sixth powers are multiplied with."""
ALLOWANCE = 2.5
"""Factor on the sum. It covers 113 of 117 lattices and random packings whose error against ``exact`` is known (the
other four have errors below .02 %), and is 2.5 times the error in the median."""


def crossing_and_crowding(sides: ContactSides, kappa: Floats, flows: Floats, energy: float) -> tuple[float, float]:
    """J, and the mean sum of sixth powers.

    Parameters
    ----------
    sides : ContactSides
        Of spheres.
    kappa : ndarray, shape (n,) [W/(m K)]
    flows : ndarray, shape (s,) [W]
        Heat flow into the sphere at each side.
    energy : float [W K]
        Of the same solution.
    """
    powers, slopes = sphere_slopes(sides, kappa, flows)
    own, widths = kappa[sides.particles], sides.radii[sides.particles] * np.sin(sides.alpha)
    a, b = sides.of_contacts.T
    mean = 2.0 * own[a] * own[b] / (own[a] + own[b])
    crossing = (mean * np.minimum(widths[a], widths[b]) ** 3 * ((slopes[a] - slopes[b]) ** 2).sum(axis=1)).sum()
    walls = sides.of_walls
    crossing += 2.0 * (own[walls] * widths[walls] ** 3 * (slopes[walls] ** 2).sum(axis=1)).sum()
    total = float(np.abs(flows).sum())
    return float(4.0 / 3.0 * crossing / energy), float(powers / total)


def sphere_slopes(sides: ContactSides, kappa: Floats, flows: Floats) -> tuple[float, Floats]:
    """Sum of sixth powers with the heat flows of some spheres, and the slope G of each side, shape (s, 3)."""
    normals = sides.arms / np.linalg.norm(sides.arms, axis=1, keepdims=True)
    slopes = np.zeros((flows.size, 3))
    scales = kappa * sides.radii**2
    powers = _slopes(sides.offsets, normals, sides.alpha, np.ascontiguousarray(flows), scales, slopes)
    return float(powers), slopes


def sphere_estimate(crossing: float, crowding: float) -> float:
    """2.5 (J + 0.011 <sum_j [(a_i + a_j)/gamma_ij]^6>) from its two terms."""
    return ALLOWANCE * (crossing + CROWDING * crowding)


def sphere_error_estimate(sides: ContactSides, kappa: Floats, flows: Floats, energy: float) -> float:
    """Estimated relative error of the conductivity of spheres by method ``chord``, in magnitude.

    2.5 (J + 0.011 <sum_j [(a_i + a_j)/gamma_ij]^6>).

    Parameters
    ----------
    sides, kappa, flows, energy
        As in `crossing_and_crowding`.

    Returns
    -------
    float

    Notes
    -----
    An estimate, not a bound. The caps cut off by insulated walls, and dead ends, which ``chord`` leaves out, are not
    in it; method ``exact`` has them.
    """
    if energy == 0.0:
        return 0.0
    crossing, crowding = crossing_and_crowding(sides, kappa, flows, energy)
    return sphere_estimate(crossing, crowding)


@njit(cache=True)
def _slopes(
    offsets: Ints,
    normals: Floats,
    alpha: Floats,
    flows: Floats,
    scales: Floats,
    slopes: Floats,
) -> float:
    """G of all sides; returns sum_i |Q_i| sum_j [(a_i + a_j)/gamma_ij]^6."""
    total = 0.0
    for p in range(offsets.size - 1):
        for i in range(offsets[p], offsets[p + 1]):
            for j in range(offsets[p], offsets[p + 1]):
                if i == j:
                    continue
                cosine = 0.0
                for axis in range(3):
                    cosine += normals[i, axis] * normals[j, axis]
                total += abs(flows[i]) * ((alpha[i] + alpha[j]) / np.arccos(max(-1.0, min(1.0, cosine)))) ** 6
                slope = neumann_slope(cosine) * flows[j] / scales[p]
                for axis in range(3):
                    slopes[i, axis] += slope * (normals[j, axis] - cosine * normals[i, axis])
    return total
