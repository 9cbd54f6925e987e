r"""Resistance matrices of method ``chord``: a disk cut at straight contacts that are isothermal, or nearly so.

Where contacts stand apart, the mutual resistances are those of uniform arcs on the whole disk
(`etc_engine.laws.disk.mutual_resistance`). Where they come close, modes of the flux and the segments cut away count:
H = (1 - w) H_apart + w H_close. The weight w = 1 - exp[-(C/.25)^6] rises with the crowding C of a disk, the mean over
its contacts i of sum_j [(a_i + a_j)/gamma_ij]^4, gamma_ij the angle between two contacts. H_close is right for the
segments. What both leave out, the different slopes on the two sides of a contact, has the other sign in random
packings, and H_apart gains from that.

**Close contacts.** Radius 1, contact j the chord z = (cos a + i s sin a) e^{i theta}, |s| <= 1. Sources of the
densities T_k(s)/(pi sqrt(1 - s^2)), k = 0, 1, 2, on the chords of the whole disk exchange heat through its Neumann
function with a sink at the centre,

    2 pi N(z, z') = ln|z z'| - ln|z - z'| - ln|1 - z conj z'|.

The means over one chord are closed: with x the place of z' in the coordinate s of chord i, rho = x + sqrt(x^2 - 1),
|rho| > 1, and rho' likewise for the image 1/conj z', a unit source at z' makes

    <T_0, T> = -[ln|rho rho'|/2 + ln(sin(a_i/2)/2)]/pi + const,
    <T_k, T> = Re[rho^-k + rho'^-k]/(2 pi k) + c_k,       c_2 = <T_2, ln|z|>/(2 pi), c_1 = 0.

The means over the other chord take a few Chebyshev points. Mode 0 carries the heat flow Q. The strengths q of modes 1
and 2 follow from it: along an isothermal chord the temperature has no mode 2, and the segment behind the chord, cut
away, would conduct the heat of mode 1 with the conductance L. With
V the means of the modes, that is

    (V_qq - D) q + V_qQ Q = 0,    D = 1/(4 L) for mode 1 and 0 for mode 2,    H = V_QQ - V_Qq (V_qq - D)^-1 V_qQ,

the first part of H = (V^-1 - L)^-1, as for spheres. L is exact: the segment is a strip of height a, on whose side s is
tanh(chi/2),

    L = 4 pi int_0^inf k tanh(k a)/sinh^2(pi k) dk.

Of one isothermal chord and a sink at the centre the resistance is exact, r(a) = `lune_resistance`, and replaces what
the modes of that chord make of it. The matrices hold `chord_resistance` on their diagonal without the other chords:
(chord_resistance - r)/2 of both contacts is added to every entry, which changes no difference of temperatures.
"""

from __future__ import annotations

import cmath
import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.polynomial import chebyshev
from numpy.polynomial.legendre import leggauss
from numpy.typing import ArrayLike

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.laws.disk import chord_resistance, mutual_resistance_scalar
from etc_engine.laws.disk import resistance_matrices as uniform_matrices

# Chebyshev points of a chord for (a_i + a_j)/separation below each bound: means to 1e-6
_BOUNDS = np.array([0.1, 0.3, 0.45, 0.65, 0.85, 2.0])
_COUNTS = np.array([2, 3, 4, 8, 16, 32], dtype=np.int64)
_POINTS = np.array([[math.cos(math.pi * (n + 0.5) / m) if n < m else 0.0 for n in range(32)] for m in _COUNTS])
CHUNK = 1 << 12
"""Half-angles that are worked on at a time: intermediate results stay in the cache."""
CROWDING = 0.25
"""Crowding of a disk at which w is 1 - 1/e: a hexagonal lattice has .14 at 15 degrees, .43 at 20."""
SHARPNESS = 6
"""Power of the crowding in w."""
NEGLIGIBLE = 1e-5
"""Weight below which H_close is left out: hexagonal lattices up to 10 degrees."""
_DEGREE = 24
"""Of the tables over the half-angle, up to 90 degrees; to 1e-9."""


class OwnModes(NamedTuple):
    """What the modes of single chords do to themselves, shape (s,) each.

    Parameters
    ----------
    diagonal : ndarray
        Resistance that the matrices hold for the chord alone.
    shift : ndarray
        Half of the diagonal less `lune_resistance`.
    level : ndarray
        c_2.
    even : ndarray
        <T_2, T> of mode 0.
    first, second : ndarray
        <T_1, T> of mode 1, less D, and <T_2, T> of mode 2.
    cuts : ndarray of bool
        Whether the disk ends at the chord.
    """

    diagonal: Floats
    shift: Floats
    level: Floats
    even: Floats
    first: Floats
    second: Floats
    cuts: Flags


def lune_resistance(alpha: ArrayLike) -> Floats:
    """Resistance kappa h of an isothermal chord of half-angle alpha to a sink at the centre of the disk it cuts.

    (1/2 pi) [ln cot(beta a) - ln(beta sin a)], beta = pi/(2 pi - 2 a), by conformal map; the temperature at the centre
    is counted without the logarithm of the sink.

    Examples
    --------
    >>> round(float(lune_resistance(np.radians(20.0))), 6)
    0.519345
    """
    alpha = np.asarray(alpha, dtype=np.float64)
    beta = np.pi / (2.0 * np.pi - 2.0 * alpha)
    return np.asarray(-np.log(np.tan(beta * alpha) * beta * np.sin(alpha)) / (2.0 * np.pi))


def segment_conductance(alpha: ArrayLike) -> Floats:
    """Conductance L over kappa of the segment behind a chord, from the temperature s on the chord: its energy.

    Examples
    --------
    >>> (segment_conductance([1e-3, 0.5]) / np.array([1e-3, 0.5])).round(4).tolist()
    [0.6667, 0.6563]
    """
    x, w = leggauss(64)
    k = 4.0 * (x + 1.0)
    factor = 4.0 * np.pi * k / np.sinh(np.pi * k) ** 2 * 4.0 * w
    return np.asarray((factor * np.tanh(k * np.asarray(alpha, dtype=np.float64)[..., None])).sum(axis=-1))


def _tables() -> Floats:
    """Chebyshev coefficients over the half-angle of L/a, c_2, and <T_2, T>, <T_1, T>, <T_2, T> of modes 0, 1, 2."""
    nodes = np.cos(np.pi * (np.arange(_DEGREE + 1) + 0.5) / (_DEGREE + 1))
    alpha = 0.25 * np.pi * (nodes + 1.0)[:, None]
    turns = np.pi * (np.arange(256) + 0.5) / 256
    s = np.cos(turns)
    first, second = s, np.cos(2.0 * turns)
    z = np.cos(alpha) + 1j * s * np.sin(alpha)
    place = (1.0 / z.conj() - np.cos(alpha)) / (1j * np.sin(alpha))
    root = np.sqrt(place * place - 1.0)
    inner = np.where(np.abs(place + root) >= 1.0, 1.0 / (place + root), 1.0 / (place - root))
    level = (second * np.log(np.abs(z))).mean(axis=1) / (2.0 * np.pi)
    rows = [
        segment_conductance(alpha[:, 0]) / alpha[:, 0],
        level,
        (inner**2).real.mean(axis=1) / (4.0 * np.pi) + level,
        1.0 / (4.0 * np.pi) + (inner.real * first).mean(axis=1) / (2.0 * np.pi),
        1.0 / (8.0 * np.pi) + ((inner**2).real * second).mean(axis=1) / (4.0 * np.pi),
    ]
    return np.linalg.solve(chebyshev.chebvander(nodes, _DEGREE), np.array(rows).T)


_TABLES = _tables()


def own_modes(alpha: Floats, cutting: Flags | None) -> OwnModes:
    """The part of the modes of each chord that its half-angle gives; arguments of `resistance_matrices`."""
    columns = np.empty((6, alpha.size))
    for start in range(0, alpha.size, CHUNK):
        columns[:, start : start + CHUNK] = _of_half_angles(alpha[start : start + CHUNK])
    diagonal, shift, level, even, first, second = columns
    cuts = np.ones(alpha.size, dtype=np.bool_) if cutting is None else cutting
    return OwnModes(diagonal, shift, level, even, first, second, cuts)


def _of_half_angles(alpha: Floats) -> tuple[Floats, ...]:
    """The columns of `OwnModes` that are functions of the half-angle."""
    diagonal = chord_resistance(alpha)
    conductance, level, even, first, second = chebyshev.chebval(4.0 * alpha / np.pi - 1.0, _TABLES)
    extra = 0.5 * (diagonal - lune_resistance(alpha))
    return diagonal, extra, level, even, first - 0.25 / (conductance * alpha), second


def resistance_matrices(
    offsets: Ints,
    arms: Floats,
    alpha: Floats,
    method: str,
    cutting: Flags | None = None,
) -> Floats:
    """Resistance matrices kappa H of many disks, packed row by row one after the other.

    Parameters
    ----------
    offsets : ndarray of int, shape (n + 1,)
        Contacts of disk p: ``offsets[p]`` to ``offsets[p + 1]``.
    arms : ndarray, shape (s, 2)
        Directions of the contacts from the centre, of any length.
    alpha : ndarray, shape (s,) [rad]
        Half-angles; two contacts of a disk must not meet.
    method : str
        ``chord``, or a method of `etc_engine.laws.disk.resistance_matrices`.
    cutting : ndarray of bool, shape (s,), optional
        Contacts behind which the disk ends; all by default.

    Returns
    -------
    ndarray, shape (sum of squared contact numbers,)
        Dimensionless.

    Notes
    -----
    Mode 1 assumes the same slope of the temperature along both sides of a contact, which holds exactly in lattices: the
    conductivity of the bonded hexagonal lattice is within .05 % at 20 to 27 degrees.

    Examples
    --------
    >>> h = resistance_matrices(np.array([0, 2]), np.array([[1.0, 0.0], [-1.0, 0.0]]), np.array([0.1, 0.1]), "chord")
    >>> h.reshape(2, 2).round(4).tolist()
    [[1.1639, 0.0003], [0.0003, 1.1639]]
    """
    if method != "chord":
        return uniform_matrices(offsets, arms, alpha, method)
    starts = np.concatenate([[0], np.cumsum(np.diff(offsets) ** 2)])
    theta = np.arctan2(arms[:, 1], arms[:, 0])
    own = own_modes(alpha, cutting)
    alpha = np.ascontiguousarray(alpha)
    return _matrices(offsets, starts, theta, alpha, own, closeness(offsets, theta, alpha, own.cuts))


@njit(cache=True)
def closeness(offsets: Ints, theta: Floats, alpha: Floats, cuts: Flags) -> Floats:
    """Weight w of H_close of every disk, shape (n,), for position angles and half-angles of its contacts that cut."""
    weights = np.zeros(offsets.size - 1)
    for p in range(weights.size):
        total, number = 0.0, 0
        for i in range(offsets[p], offsets[p + 1]):
            if cuts[i]:
                number += 1
                for j in range(offsets[p], i):
                    if cuts[j]:
                        total += 2.0 * _ratio(theta[i] - theta[j], alpha[i], alpha[j]) ** 4
        crowding = total / max(number, 1)
        weights[p] = -math.expm1(-((crowding / CROWDING) ** SHARPNESS))
    return weights


@njit(cache=True, error_model="numpy")
def _ratio(apart: float, a: float, b: float) -> float:
    """(a + b)/gamma of two contacts."""
    near = abs(apart) % (2.0 * math.pi)
    return (a + b) / min(near, 2.0 * math.pi - near)


@njit(cache=True, error_model="numpy")
def _inner(place: complex) -> complex:
    """1/rho = x - sqrt(x^2 - 1), of modulus below 1."""
    root = cmath.sqrt(place * place - 1.0)
    outer = place + root if place.real * root.real + place.imag * root.imag >= 0.0 else place - root
    return 1.0 / outer


@njit(cache=True, error_model="numpy")
def _means(apart: float, a: float, b: float, row: int, out: Floats) -> None:
    """Means over chord b, at the angle ``apart`` from chord a, of what its modes make on chord a.

    ``out[k, l]`` is <T_k, T> of mode l for k = 1, 2, without c_k; ``out[0, 0]`` is <T_0, T> of mode 0.
    """
    ca, sa, cb, sb = math.cos(a), math.sin(a), math.cos(b), math.sin(b)
    turn, m = complex(math.cos(apart), math.sin(apart)), _COUNTS[row]
    product, log = 1.0, 0.0
    out[:] = 0.0
    for n in range(m):
        s = _POINTS[row, n]
        z = complex(cb, sb * s) * turn
        square = z.real * z.real + z.imag * z.imag
        one = _inner(complex(z.imag, ca - z.real) / sa)
        two = _inner(complex(z.imag / square, ca - z.real / square) / sa)
        product *= (one.real**2 + one.imag**2) * (two.real**2 + two.imag**2) / square
        if product < 1e-100:
            log, product = log + math.log(product), 1.0
        odd, even = one.real + two.real, (one * one).real + (two * two).real
        second = 2.0 * s * s - 1.0
        out[1, 0] += odd
        out[1, 1] += odd * s
        out[1, 2] += odd * second
        out[2, 0] += even
        out[2, 1] += even * s
        out[2, 2] += even * second
    for l in range(3):  # an assignment to a slice of an array takes numba a second to compile
        out[1, l] /= 2.0 * math.pi * m
        out[2, l] /= 4.0 * math.pi * m
    # ln|rho' z| is smooth at the centre; the mean of ln|z| over chord b is ln cos^2(b/2)
    mean = -0.5 * (log + math.log(product)) / m - 2.0 * math.log(math.cos(0.5 * b))
    out[0, 0] = -(0.5 * mean + math.log(math.sin(0.5 * a))) / math.pi


@njit(cache=True)
def _matrices(offsets: Ints, starts: Ints, theta: Floats, alpha: Floats, own: OwnModes, weights: Floats) -> Floats:
    values = np.empty(starts[-1])
    widest = 0
    for p in range(offsets.size - 1):
        widest = max(widest, offsets[p + 1] - offsets[p])
    inner, towards, close = np.empty((2 * widest, 2 * widest)), np.empty((2 * widest, widest)), np.empty(widest**2)
    for p in range(offsets.size - 1):
        first, last = offsets[p], offsets[p + 1]
        n = last - first
        apart = values[starts[p] : starts[p + 1]].reshape((n, n))
        for i in range(n):
            apart[i, i] = own.diagonal[first + i]
            for j in range(i):
                a, b = alpha[first + i], alpha[first + j]
                apart[i, j] = mutual_resistance_scalar(theta[first + i] - theta[first + j], a, b)
                apart[j, i] = apart[i, j]
        if weights[p] < NEGLIGIBLE:
            continue
        h = close[: n * n].reshape((n, n))
        _modes_of_disk(theta[first:last], alpha[first:last], first, own, h, inner, towards)
        _eliminate(h, inner[: 2 * n, : 2 * n], towards[: 2 * n, :n])
        for i in range(n):
            c = first + i
            if own.cuts[c]:
                h[i, i] += own.even[c] ** 2 / own.second[c]
            for j in range(n):
                value = h[i, j] + own.shift[c] + own.shift[first + j]
                apart[i, j] = (1.0 - weights[p]) * apart[i, j] + weights[p] * value
    return values


@njit(cache=True)
def _modes_of_disk(
    theta: Floats, alpha: Floats, first: int, own: OwnModes, h: Floats, inner: Floats, towards: Floats
) -> None:
    """V_QQ into ``h``, V_qq - D into ``inner`` and V_qQ into ``towards``, rows 2 i of mode 1 and 2 i + 1 of mode 2."""
    n = theta.size
    here, there = np.empty((3, 3)), np.empty((3, 3))
    for i in range(n):
        c, a = first + i, alpha[i]
        h[i, i] = own.diagonal[c] - 2.0 * own.shift[c]
        inner[2 * i, 2 * i], inner[2 * i + 1, 2 * i + 1] = own.first[c], own.second[c]
        inner[2 * i, 2 * i + 1], inner[2 * i + 1, 2 * i] = 0.0, 0.0
        towards[2 * i, i], towards[2 * i + 1, i] = 0.0, own.even[c]
        for j in range(i):
            apart, b = theta[j] - theta[i], alpha[j]
            row, ratio = 0, _ratio(apart, a, b)
            while row < _BOUNDS.size - 1 and ratio >= _BOUNDS[row]:
                row += 1
            _means(apart, a, b, row, here)
            _means(-apart, b, a, row, there)
            # points on the narrower chord are the more accurate ones
            h[i, j] = there[0, 0] if a < b else here[0, 0]
            h[j, i] = h[i, j]
            for k in range(2):
                towards[2 * i + k, j] = here[k + 1, 0] + k * own.level[c]
                towards[2 * j + k, i] = there[k + 1, 0] + k * own.level[first + j]
                for l in range(2):
                    inner[2 * i + k, 2 * j + l] = there[l + 1, k + 1] if a < b else here[k + 1, l + 1]
                    inner[2 * j + l, 2 * i + k] = inner[2 * i + k, 2 * j + l]
    for i in range(n):
        if not own.cuts[first + i]:  # a chord that cuts nothing has no sources of its own
            for k in range(2 * i, 2 * i + 2):
                inner[k, : 2 * n], inner[: 2 * n, k], towards[k, :n] = 0.0, 0.0, 0.0
                inner[k, k] = 1.0


@njit(cache=True)
def _eliminate(h: Floats, inner: Floats, towards: Floats) -> None:
    """Take off towards^T inner^-1 towards from h by an LDL^T factor, which a quasi-definite matrix has in any order."""
    m, n = towards.shape
    for k in range(m):
        pivot = inner[k, k]
        for i in range(n):
            for j in range(n):
                h[i, j] -= towards[k, i] * towards[k, j] / pivot
        for r in range(k + 1, m):
            factor = inner[r, k] / pivot
            if factor != 0.0:
                for c in range(k + 1, m):
                    inner[r, c] -= factor * inner[k, c]
                for j in range(n):
                    towards[r, j] -= factor * towards[k, j]
