r"""Energy of the strip between the rim of a disk and the straight edge of its cell.

The strip is parametrized by s along the edge and t from the rim (0) to the edge (1). With rho = sqrt(h^2 + s^2) its
thickness is B = rho - R = [(h - R)(h + R) + s^2]/(rho + R), and

.. math::

    T(s, t) = T_{edge} + W (1 - t) + m\, 4 t (1 - t) + v\, t, \qquad
    E = k \int\!\!\int \Bigl[\bigl(\tfrac{T_t}{B}\bigr)^2 +
    \bigl(\tfrac{T_s - t B' T_t / B}{\varphi' r}\bigr)^2\Bigr] r B \varphi'\, ds\, dt,

r = R + t B, B' = s/rho, phi' = h/rho^2; every coefficient is linear in s over an interval. The edge temperature
multiplies 1, so that a thin strip loses no digits. Where the edge cuts the disk, B < 0 and the energy counts negative:
the part of the whole disk beyond the edge is taken away.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

_GAUSS_4 = np.polynomial.legendre.leggauss(4)
_GAUSS_3 = np.polynomial.legendre.leggauss(3)
_ALONG, _ALONG_WEIGHTS = 0.5 * (_GAUSS_4[0] + 1.0), 0.5 * _GAUSS_4[1]
_ACROSS, _ACROSS_WEIGHTS = 0.5 * (_GAUSS_3[0] + 1.0), 0.5 * _GAUSS_3[1]

FIELDS = 8
"""Coefficients of an interval: W0, m0, W1, m1, edge0, edge1, and v0, v1 where a contact resists."""


@njit(cache=True)
def _plain_strip(h, clearance, radius, s0, s1, conductivity, out):  # type: ignore[no-untyped-def]
    """`strip_matrix` of 6 coefficients: the same operations without those of zeros and on registers."""
    e00 = e01 = e02 = e03 = e11 = e12 = e13 = e22 = e23 = e33 = 0.0
    e04 = e14 = e24 = e34 = e44 = 0.0
    length = s1 - s0
    for i in range(4):
        high = _ALONG[i]
        low = 1.0 - high
        s = s0 + length * high
        rho = math.sqrt(h * h + s * s)
        turn = h / (rho * rho)
        thickness = (clearance * (h + radius) + s * s) / (rho + radius)
        for j in range(3):
            t = _ACROSS[j]
            r = radius + t * thickness
            weight = _ALONG_WEIGHTS[i] * _ACROSS_WEIGHTS[j] * length * r * thickness * turn * conductivity
            around = 1.0 / (turn * r)
            slope = around / length
            skew = around * t * s / rho
            value = 1.0 - t
            rise = -1.0 / thickness
            r0, r2 = low * rise, high * rise
            a0, a2 = -value * slope - skew * low * rise, value * slope - skew * high * rise
            value = 4.0 * t * (1.0 - t)
            rise = (4.0 - 8.0 * t) / thickness
            r1, r3 = low * rise, high * rise
            a1, a3 = -value * slope - skew * low * rise, value * slope - skew * high * rise
            x, y = weight * r0, weight * a0
            e00 += x * r0 + y * a0
            e01 += x * r1 + y * a1
            e02 += x * r2 + y * a2
            e03 += x * r3 + y * a3
            e04 += y * slope
            x, y = weight * r1, weight * a1
            e11 += x * r1 + y * a1
            e12 += x * r2 + y * a2
            e13 += x * r3 + y * a3
            e14 += y * slope
            x, y = weight * r2, weight * a2
            e22 += x * r2 + y * a2
            e23 += x * r3 + y * a3
            e24 += y * slope
            x, y = weight * r3, weight * a3
            e33 += x * r3 + y * a3
            e34 += y * slope
            e44 += weight * slope * slope
    out[0, 0], out[0, 1], out[0, 2], out[0, 3], out[0, 4], out[0, 5] = e00, e01, e02, e03, -e04, e04
    out[1, 1], out[1, 2], out[1, 3], out[1, 4], out[1, 5] = e11, e12, e13, -e14, e14
    out[2, 2], out[2, 3], out[2, 4], out[2, 5] = e22, e23, -e24, e24
    out[3, 3], out[3, 4], out[3, 5] = e33, -e34, e34
    out[4, 4], out[4, 5], out[5, 5] = e44, -e44, e44
    for a in range(6):
        for b in range(a):
            out[a, b] = out[b, a]


@njit(cache=True)
def strip_matrix(h, clearance, radius, s0, s1, conductivity, fields, out):  # type: ignore[no-untyped-def]
    """Symmetric energy matrix of one interval [s0, s1] on its first 6 or 8 coefficients; clearance = h - R.

    The energy is x . out x (no factor 1/2), Gauss's rule with 4 points along and 3 across.
    """
    if fields == 6:
        _plain_strip(h, clearance, radius, s0, s1, conductivity, out)
        return
    radial, angular = np.empty(FIELDS), np.empty(FIELDS)
    out[:fields, :fields] = 0.0
    length = s1 - s0
    for i in range(4):
        high = _ALONG[i]
        low = 1.0 - high
        s = s0 + length * high
        rho = math.sqrt(h * h + s * s)
        turn = h / (rho * rho)
        thickness = (clearance * (h + radius) + s * s) / (rho + radius)
        for j in range(3):
            t = _ACROSS[j]
            r = radius + t * thickness
            weight = _ALONG_WEIGHTS[i] * _ACROSS_WEIGHTS[j] * length * r * thickness * turn * conductivity
            around = 1.0 / (turn * r)
            slope = around / length
            skew = around * t * s / rho
            for f in range(3 if fields == FIELDS else 2):
                value = (1.0 - t, 4.0 * t * (1.0 - t), t)[f]
                rise = (-1.0, 4.0 - 8.0 * t, 1.0)[f] / thickness
                first = f if f < 2 else 6
                second = f + 2 if f < 2 else 7
                radial[first], radial[second] = low * rise, high * rise
                angular[first] = -value * slope - skew * low * rise
                angular[second] = value * slope - skew * high * rise
            radial[4] = radial[5] = 0.0
            angular[4], angular[5] = -slope, slope
            for a in range(fields):
                x, y = weight * radial[a], weight * angular[a]
                for b in range(a, fields):
                    out[a, b] += x * radial[b] + y * angular[b]
    for a in range(fields):
        for b in range(a):
            out[a, b] = out[b, a]


@njit(cache=True)
def corner_exponent(k_s, k_f, angle):  # type: ignore[no-untyped-def]
    """Exponent lambda of the jump at the corner of a resisting contact, from the wedge of fluid that opens there.

    k_f cot(lambda a) = k_s tan(lambda (pi - a)): fluid over the angle a, solid over the rest of a half plane.
    """
    low, high = 0.0, min(0.5 * math.pi / angle, 0.5 * math.pi / (math.pi - angle))
    for _ in range(60):
        middle = 0.5 * (low + high)
        fluid = k_f * math.cos(middle * angle) * math.cos(middle * (math.pi - angle))
        if fluid > k_s * math.sin(middle * angle) * math.sin(middle * (math.pi - angle)):
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
