r"""Temperature inside a disk, accurate up to its boundary.

Heat Q_j enters through the arc of half-angle alpha about theta_j with the density w(s) over s = phi/alpha. With
z = (r/R) e^{i(theta - theta_j)} and sigma = -i ln(z)/alpha,

    T(r, theta) = T_o - 1/(pi kappa) sum_j Q_j int w(s) ln|z - e^{i alpha s}| ds,
    ln|z - e^{i alpha s}| = ln|z|/2 + ln alpha + ln|sigma - s| + ln|sin(x)/x|,   x = alpha (sigma - s)/2.

The third term is the whole singularity and has a closed integral for every density used here; the last one is
smooth and takes a few Gauss points. (Feng et al. 2008, Eq. 37, is the uniform density.)
"""

from __future__ import annotations

import cmath
import math

import numpy as np
from numba import njit
from numpy.polynomial.legendre import leggauss

from etc_engine.arrays import Floats, Ints
from etc_engine.engines.dtem.element import DiskContacts, disk_contacts
from etc_engine.engines.dtem.exact.field import exact_temperatures
from etc_engine.engines.dtem.methods import find_method
from etc_engine.medium.field import ParticleField

_POINTS = 12
_LEGENDRE = leggauss(_POINTS)[0], 0.5 * leggauss(_POINTS)[1]
_CHEBYSHEV = np.cos((np.arange(_POINTS) + 0.5) * np.pi / _POINTS), np.full(_POINTS, 1.0 / _POINTS)


def temperatures_inside(field: ParticleField, method: str, particles: Ints, points: Floats) -> Floats:
    """Temperature at points inside particles.

    Parameters
    ----------
    field : ParticleField
        Of a steady solution.
    method : str
        That solved it.
    particles : ndarray of int, shape (q,)
        The particle each point belongs to.
    points : ndarray, shape (q, 2) [m]
        Position relative to that particle's centre; a point outside its circle is taken on it.

    Returns
    -------
    ndarray, shape (q,) [K]
        NaN in particles without a temperature.

    Notes
    -----
    The mean over a contact arc, weighted with the flux density of the method, is the contact temperature of
    ``standard`` and ``arc``. ``enhanced`` and ``chord`` correct h_ii but not the density; there the two differ by
    the correction (``chord`` uses the edge-singular density 1/(pi sqrt(1 - s^2)), which differs by O(alpha)).

    References
    ----------
    Feng, Han, Li, Owen 2008, Eq. 37, doi:10.1016/j.jcp.2008.01.031.
    """
    sides = field.sides
    kappa, scaled = field.medium.conductivity, points / field.medium.packing.radii[particles, None]
    if method == "exact":
        above = exact_temperatures(sides, kappa, field.flow_modes, particles, scaled)
        return field.particle_temperatures[particles] + above
    uniform = find_method(method).uniform_flux
    values = _evaluate(
        disk_contacts(sides, kappa),
        np.ascontiguousarray(particles, dtype=np.int64),
        np.ascontiguousarray(scaled),
        field.flow_modes,
        uniform,
        *(_LEGENDRE if uniform else _CHEBYSHEV),
    )
    return field.particle_temperatures[particles] + values


@njit(cache=True)
def _evaluate(
    disks: DiskContacts,
    particles: Ints,
    points: Floats,
    flows: Floats,
    uniform: bool,
    nodes: Floats,
    weights: Floats,
) -> Floats:
    """Temperature above the particle's mean at every point, given in radii: the sum of the module's equation."""
    theta, alpha, signs = disks.theta, disks.alpha, disks.signs
    values = np.zeros(particles.size)
    for q in range(particles.size):
        p = particles[q]
        radius = min(math.hypot(points[q, 0], points[q, 1]), 1.0)
        angle = math.atan2(points[q, 1], points[q, 0])
        if radius < 1e-12:
            continue  # the centre of a disk without net flux has its mean temperature
        for side in range(disks.offsets[p], disks.offsets[p + 1]):
            if flows[side, 0] == 0.0:
                continue
            turn = angle - theta[side]
            turn -= 2.0 * math.pi * round(turn / (2.0 * math.pi))
            sigma = complex(turn, -math.log(radius)) / alpha[side]
            smooth = 0.5 * math.log(radius) + math.log(alpha[side])
            for u in range(nodes.size):
                x = 0.5 * alpha[side] * (sigma - nodes[u])
                smooth += weights[u] * (math.log(abs(cmath.sin(x) / x)) if abs(x) > 1e-9 else 0.0)
            if uniform:
                total = flows[side, 0] * (smooth + _uniform_log(sigma))
            else:
                # |J| >= 1 with J + 1/J = 2 sigma: int w_0 ln|sigma - s| = ln|J| - ln 2, of w_k: -Re J^-k / k
                joukowski = sigma + cmath.sqrt(sigma - 1.0) * cmath.sqrt(sigma + 1.0)
                total = flows[side, 0] * (smooth + math.log(abs(joukowski)) - math.log(2.0))
                power = 1.0 / joukowski
                for k in range(1, flows.shape[1]):
                    sign = signs[side] if k % 2 else 1.0
                    total -= sign * flows[side, k] * power.real / k
                    power /= joukowski
                    total += sign * flows[side, k] * _smooth_mode(k, alpha[side], sigma, nodes, weights)
            values[q] -= total / (math.pi * disks.conductivity[p])
    return values


@njit(cache=True)
def _smooth_mode(k: int, alpha: float, sigma: complex, nodes: Floats, weights: Floats) -> float:
    """Part of mode k in the smooth term ln|sin(x)/x|."""
    value = 0.0
    for u in range(nodes.size):
        x = 0.5 * alpha * (sigma - nodes[u])
        if abs(x) > 1e-9:
            value += weights[u] * math.cos(k * math.acos(nodes[u])) * math.log(abs(cmath.sin(x) / x))
    return value


@njit(cache=True)
def _uniform_log(sigma: complex) -> float:
    """Mean of ln|sigma - s| over -1 <= s <= 1."""
    value = -1.0
    for end in (1.0, -1.0):
        distance = sigma + end
        if abs(distance) > 0.0:
            value += 0.5 * end * (distance * cmath.log(distance)).real
    return value
