r"""A sphere cut at all its contact disks, the flux through them in modes: resistances that converge.

Lengths in radii, kappa = 1. Over a contact disk of radius c = sin a the flux density is a sum of the modes

    s_mk  ~  s^m P_k^(m,-1/2)(1 - 2 s^2) cos(m phi) / sqrt(1 - s^2),      s = rho/c,  m + 2k <= degree,

and likewise with sin(m phi); s_00 is the equilibrium density of total 1. The temperature is tested with the
same modes; the polynomials t_mk ~ s^m P_k^(m,-1/2)(1 - 2 s^2) cos(m phi) are their dual, <s, t> = 1.

**Inside the full ball** a mode is a line of m-th transverse derivatives of point sources at the complex heights
zeta = cos a + i y sin a, |y| <= 1, of the density w_mk(y) ~ (1 - y^2)^m C_2k^(m+1/2)(y). With E = e_1 + i e_2 across
the axis, E . E = 0, derivatives along E leave |x| unchanged, so that all means V = <s, N s'> follow from derivatives of
the Neumann function N(|x|^2, |x'|^2, x . x') with respect to x . x' alone, by Gauss rules as for single disks.

**What the contacts cut away.** Let sigma be the sources that make T in the ball, T = V sigma. Behind a disk lies a cap
with an insulated back; it takes the heat L T, L its conductance from the disk. The cut sphere takes the rest, the flux

    q = sigma - L T      =>      T = H q,      H = (V^-1 - L)^-1.

No approximation but the number of modes. On one isothermal disk the exact h_00 is `chord_resistance`; the first entry
of each V_ii is set so that it is met, since the edge of the cut sphere has another exponent than 1/sqrt(1 - s^2).
"""

from __future__ import annotations

import cmath
import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray
from scipy.special import binom, eval_gegenbauer, eval_jacobi, factorial, gamma

from etc_engine.arrays import Floats, Ints
from etc_engine.laws.sphere import FOUR_PI, chord_resistance

WIDEST = np.radians(80.0)
"""Largest half-angle of the tables."""
_NODES = 20
_ORDERS = (4, 8, 16, 32)
_FIRST = np.array([0, 4, 12, 28], dtype=np.int64)
_RULE = np.concatenate([np.array(leggauss(m)) for m in _ORDERS], axis=1)


class ModeTables(NamedTuple):
    """What the modes of one degree need.

    Parameters
    ----------
    orders, radials : ndarray of int, shape (f,)
        m and k of each family of modes; a family has one mode for m = 0 and two, cosine and sine, else.
    lines : ndarray, shape (f, nodes)
        Line densities w_mk times the quadrature weights, at the nodes of all rules one after the other.
    selves : ndarray, shape (20, f, f)
        c V_ii in Chebyshev polynomials of the half-angle.
    caps : ndarray, shape (20, f, f)
        L/c^2 likewise.
    gauges : ndarray, shape (20, f)
        <s, 1/|x|>/(4 pi), by which T_o is the temperature of the centre.
    """

    orders: Ints
    radials: Ints
    lines: Floats
    selves: Floats
    caps: Floats
    gauges: Floats


def number_of_modes(degree: int) -> int:
    """Modes m + 2k <= degree of a contact, cosine and sine counted: (degree + 1)(degree + 2)/2.

    Examples
    --------
    >>> [number_of_modes(degree) for degree in range(4)]
    [1, 3, 6, 10]
    """
    return (degree + 1) * (degree + 2) // 2


@lru_cache(maxsize=8)
def mode_tables(degree: int) -> ModeTables:
    """The tables of all modes up to a degree; made once, in about a tenth of a second."""
    families = sorted(((m, k) for m in range(degree + 1) for k in range((degree - m) // 2 + 1)), key=_by_degree)
    x = np.cos(np.pi * (np.arange(_NODES) + 0.5) / _NODES)
    angles = 0.5 * WIDEST * (x + 1.0)
    selves = np.array([_self_block(families, a) for a in angles])
    caps = np.array([_cap_block(families, a) for a in angles])
    interpolate = np.linalg.inv(np.polynomial.chebyshev.chebvander(x, _NODES - 1))
    orders, radials = np.array(families, dtype=np.int64).T
    return ModeTables(
        np.ascontiguousarray(orders),
        np.ascontiguousarray(radials),
        np.array([_line(m, k, _RULE[0]) * _RULE[1] for m, k in families]),
        np.einsum("nj,jfg->nfg", interpolate, selves),
        np.einsum("nj,jfg->nfg", interpolate, caps),
        interpolate @ np.array([_gauge(families, a) for a in angles]),
    )


class OwnBlocks(NamedTuple):
    """What belongs to single contacts: V_ii and L, shape (s, f, f), and the gauge, shape (s, f)."""

    selves: Floats
    caps: Floats
    gauges: Floats


def own_blocks(tables: ModeTables, alpha: Floats) -> OwnBlocks:
    """V_ii, L and gauge of contacts of half-angles alpha up to `WIDEST`, by family."""
    x = 2.0 * alpha / WIDEST - 1.0
    c = np.sin(alpha)[:, None, None]
    selves = np.moveaxis(np.polynomial.chebyshev.chebval(x, tables.selves), -1, 0) / c
    caps = np.moveaxis(np.polynomial.chebyshev.chebval(x, tables.caps), -1, 0) * c**2
    gauges = np.polynomial.chebyshev.chebval(x, tables.gauges).T
    selves[:, 0, :] -= gauges
    selves[:, :, 0] -= gauges
    selves[:, 0, 0] = chord_resistance(alpha)  # of one isothermal disk: V_00 - V_0k (V_kl)^-1 V_l0
    radial = np.flatnonzero((tables.orders == 0) & (tables.radials > 0))
    if radial.size:
        row = selves[:, radial, 0]
        inner = np.linalg.solve(selves[:, radial[:, None], radial], row[..., None])[..., 0]
        selves[:, 0, 0] += (row * inner).sum(axis=1)
    return OwnBlocks(*(np.ascontiguousarray(block) for block in (selves, caps, gauges)))


@njit(cache=True, error_model="numpy")
def neumann_derivatives(u: complex, v: complex, w: complex, out: NDArray[np.complex128]) -> None:
    """Derivatives 0, 1, ... of 1/D1 + 1/D2 - ln((1 - w + D2)/2) with respect to w = x . x'.

    u = |x|^2, v = |x'|^2, D1^2 = u - 2w + v, D2^2 = 1 - 2w + u v. ``out`` has room for the powers of w.
    """
    square1, square2 = u - 2.0 * w + v, 1.0 - 2.0 * w + u * v
    d1, d2 = cmath.sqrt(square1), cmath.sqrt(square2)
    inner = 1.0 - w + d2
    out[0] = 1.0 / d1 + 1.0 / d2 - cmath.log(0.5 * inner)
    first, second, root, odd, whole = 1.0 / d1, 1.0 / d2, d2, 1.0, 1.0
    # Taylor coefficients i_k of (1 - w + D2)/inner and l_k of its logarithm: l_k = i_k - sum_j j l_j i_(k-j)/k
    coefficients = np.empty((2, out.size), dtype=np.complex128)
    for k in range(1, out.size):
        root *= (2.0 * k - 3.0) / (k * square2)
        coefficients[0, k] = ((root - 1.0) if k == 1 else root) / inner
        value = coefficients[0, k]
        for j in range(1, k):
            value -= j * coefficients[1, j] * coefficients[0, k - j] / k
        coefficients[1, k] = value
        odd, whole = odd * (2.0 * k - 1.0), whole * k
        first, second = first / square1, second / square2
        out[k] = odd * (first + second) - whole * value


@njit(cache=True, error_model="numpy")
def pair_means(cosine: float, a: float, b: float, orders: Ints, lines: Floats, out: Floats) -> None:
    """Means of the derivatives of N over the lines of two contacts, for each pair of families (f, g) and r.

    out[f, g, r] = c_a^p c_b^q Re int int w_f w_g zeta'^(p-r) zeta^(q-r) N^(p+q-r) dy dy',  p, q the orders of f and g.
    """
    top = orders.max()
    ratio = (a + b) / math.acos(min(1.0, max(-1.0, cosine)))
    row = 0 if ratio < 0.15 else 1 if ratio < 0.4 else 2 if ratio < 0.75 else 3
    first, m = _FIRST[row], 4 << row
    n = np.empty(2 * top + 1, dtype=np.complex128)
    powers_z, powers_t = np.ones(top + 1, dtype=np.complex128), np.ones(top + 1, dtype=np.complex128)
    at = np.empty((top + 1, top + 1, top + 1))  # zeta'^(p-r) zeta^(q-r) N^(p+q-r) at one pair of points
    ca, sa, cb, sb = math.cos(a), math.sin(a), math.cos(b), math.sin(b)
    out[:] = 0.0
    for x in range(m):
        z = complex(ca, sa * _RULE[0, first + x])
        for y in range(m // 2):  # (y, y') and (-y, -y') are conjugate
            t = complex(cb, sb * _RULE[0, first + y])
            neumann_derivatives(z * z, t * t, z * t * cosine, n)
            for k in range(top):
                powers_z[k + 1], powers_t[k + 1] = powers_z[k] * z, powers_t[k] * t
            for p in range(top + 1):
                for q in range(top + 1):
                    for r in range(min(p, q) + 1):
                        at[p, q, r] = (powers_t[p - r] * powers_z[q - r] * n[p + q - r]).real
            for f in range(orders.size):
                for g in range(orders.size):
                    p, q = orders[f], orders[g]
                    weight = 2.0 * lines[f, first + x] * lines[g, first + y]
                    for r in range(min(p, q) + 1):
                        out[f, g, r] += weight * at[p, q, r]
    for f in range(orders.size):
        for g in range(orders.size):
            out[f, g] *= sa ** orders[f] * sb ** orders[g]


@njit(cache=True)
def combine(means: Floats, p: int, q: int, dots: tuple[complex, complex, complex, complex]) -> tuple[complex, complex]:
    """<s, V s'> of two modes along E and F, and along E and F*, times 4 pi.

    sum_r p! q!/((p-r)! (q-r)! r!) (E . n')^(p-r) (F . n)^(q-r) (E . F)^r means_r; ``dots`` are E . n', F . n, E . F and
    E . F*.
    """
    straight, crossed = 0j, 0j
    for r in range(min(p, q) + 1):
        factor = means[r]
        for i in range(r):
            factor *= (p - i) * (q - i) / (i + 1.0)
        along = dots[0] ** (p - r) * factor
        straight += along * dots[1] ** (q - r) * dots[2] ** r
        crossed += along * dots[1].conjugate() ** (q - r) * dots[3] ** r
    return straight, crossed


def _by_degree(family: tuple[int, int]) -> tuple[int, int]:
    return family[0] + 2 * family[1], family[0]


def _half(m: int) -> float:
    """Part of a transverse derivative that cos(m phi) sees: of Re (d_1 + i d_2)^m on J_m(rho) cos(m phi)."""
    return 1.0 if m == 0 else 0.5


def _line(m: int, k: int, y: Floats) -> Floats:
    """w_mk with y^m times its Fourier transform the spherical Bessel function (-1)^k j_(m+2k); 1/2 for m = k = 0."""
    n, nu = 2 * k, m + 0.5
    scale = np.pi * 2.0 ** (1.0 - nu) * gamma(n + 2.0 * nu) / (factorial(n) * gamma(nu)) * np.sqrt(2.0 / np.pi)
    return np.asarray((-1.0) ** k * (1.0 - y * y) ** m * eval_gegenbauer(n, nu, y) / scale)


def _dual_scale(m: int, k: int) -> float:
    """Factor of s^m P_k^(m,-1/2)(1 - 2 s^2) in t_mk, from <s_mk, J_m(x s) cos(m phi)> at the power m + 2k of x."""
    y, weight = leggauss(2 * k + 2 * m + 4)
    moment = _half(m) * float((_line(m, k, y) * y ** (2 * k)) @ weight) / factorial(2 * k)
    moment *= 2.0 ** (m + 2 * k) * factorial(k) * factorial(m + k)
    return float((-1.0) ** k / (binom(2 * k + m - 0.5, k) * moment))


def _self_block(families: list[tuple[int, int]], a: float) -> Floats:
    """V_ii times c: 1/(4 pi |x - x'|) in closed form, diagonal, and its image.

    The image needs int int w(y) w'(y') D^-j dy dy', D = 1 - zeta zeta': by parts over y', w' being a polynomial, and
    numerically over y, halving the intervals towards the ends where D vanishes.
    """
    x, weight = leggauss(10)
    edges = np.concatenate([[0.0], 2.0 ** -np.arange(24.0, -1.0, -1.0)])
    widths = np.diff(edges)[:, None]
    g, wg = (edges[:-1, None] + 0.5 * widths * (x + 1.0)).ravel(), (0.5 * widths * weight).ravel()
    c, out = math.sin(a), np.zeros((len(families),) * 2)
    powers = _image_powers(max(m for m, _ in families))
    for i, (m, k) in enumerate(families):
        out[i, i] = _half(m) / (8.0 * (2 * m + 4 * k + 1))
        for j in (j for j, (n, _) in enumerate(families) if n == m):
            mean = 0.0
            for end in (-1.0, 1.0):  # y = end (1 - g): the mirror image gives the complex conjugate
                zeta = np.asarray(math.cos(a) + 1j * end * c * (1.0 - g), dtype=np.complex128)
                inner = _by_parts(_line_polynomial(*families[j]), m, powers[m], zeta, a)
                mean += float((wg * _line(m, k, 1.0 - g) * inner.real).sum())
            # (E . E*)^m = 2^m, of which the cosine has half
            out[i, j] += c ** (2 * m + 1) * _half(m) * 2.0**m * math.factorial(m) * mean / FOUR_PI
    return out


def _gauge(families: list[tuple[int, int]], a: float) -> Floats:
    """Mean of 1/(4 pi zeta) over each line; of the derivatives it is zero."""
    y, weight = leggauss(48)
    heights = math.cos(a) + 1j * math.sin(a) * y
    return np.array([(weight * _line(m, k, y) / heights).sum().real * (m == 0) / FOUR_PI for m, k in families])


def _line_polynomial(m: int, k: int) -> np.polynomial.Polynomial:
    """w_mk as a polynomial, through as many points as it has coefficients."""
    nodes = np.cos(np.pi * (np.arange(2 * (m + k) + 1) + 0.5) / (2 * (m + k) + 1))
    return np.polynomial.Polynomial.fit(nodes, _line(m, k, nodes), 2 * (m + k), domain=[-1.0, 1.0])


def _image_powers(top: int) -> list[Floats]:
    """Derivatives 0 .. top of 1/D - ln((1 - w + D)/2), D^2 = 1 - 2w + t^2, at w = t by powers of 1/D; no ln D."""
    polynomial, log = np.polynomial.polynomial, [np.zeros(1)]
    ratio: list[Floats] = [np.ones(1)]
    root = 1.0
    for k in range(1, top + 1):  # sqrt(1 - 2e/D^2) = sum root_k (e/D^2)^k; 1 - w + D over its value 2D
        root *= (2.0 * k - 3.0) / k
        ratio.append(0.5 * root * np.eye(2 * k + 1)[2 * k] - 0.5 * (k == 1) * np.eye(2 * k + 1)[1])
        mixed: Floats = ratio[k]
        for j in range(1, k):
            mixed = np.asarray(polynomial.polysub(mixed, polynomial.polymul(log[j], ratio[k - j]) * j / k))
        log.append(mixed)
    odd = [math.prod(range(1, 2 * k, 2)) * np.eye(2 * k + 2)[2 * k + 1] for k in range(top + 1)]
    return [polynomial.polysub(odd[k], math.factorial(k) * log[k]) for k in range(top + 1)]


def _by_parts(
    line: np.polynomial.Polynomial, m: int, powers: Floats, zeta: NDArray[np.complex128], a: float
) -> NDArray[np.complex128]:
    """Integral over y' of line(y') [sum_j powers_j D^-j - (ln D if m = 0)], D = 1 - zeta (cos a + i y' sin a)."""
    step = 1j / (zeta * math.sin(a))  # dy'/dD
    total = np.zeros_like(zeta)
    for end in (-1.0, 1.0):
        d = 1.0 - zeta * (math.cos(a) + 1j * end * math.sin(a))
        for n in range(m, line.degree() + 1):  # the first m derivatives vanish at the ends
            value = sum(power * _antiderivative(j, n + 1, d) for j, power in enumerate(powers) if j > 0 and power)
            if m == 0:
                value = value - d ** (n + 1) / math.factorial(n + 1) * (np.log(d) - _harmonic(n + 1))
            total += end * (-1.0) ** n * float(line.deriv(n)(end)) * step ** (n + 1) * value
    return total


def _antiderivative(j: int, n: int, d: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """N-fold integral of D^-j."""
    if n < j:
        return (-1.0) ** n * math.factorial(j - 1 - n) / math.factorial(j - 1) * d ** (n - j)
    q = n - j
    return (-1.0) ** (j - 1) / math.factorial(j - 1) * d**q / math.factorial(q) * (np.log(d) - _harmonic(q))


def _harmonic(n: int) -> float:
    return sum(1.0 / i for i in range(1, n + 1))


def _cap_block(families: list[tuple[int, int]], a: float) -> Floats:
    """L/c^2: the least energy in the cap behind a disk with the temperatures t on it, by polynomials."""
    c, deep = math.sin(a), 2.0 * math.sin(0.5 * a) ** 2
    x, w = leggauss(24)
    s = np.sqrt(0.5 * (x + 1.0))[:, None]
    height = np.sqrt(1.0 - (c * s) ** 2) - math.cos(a)
    z = height * 0.5 * (x + 1.0) / deep
    weight = np.sqrt(0.25 * c * c * w[:, None] * 0.5 * height * w)  # s ds = (1/4) dx
    out = np.zeros((len(families),) * 2)
    for m in {m for m, _ in families}:
        rows = [i for i, (n, _) in enumerate(families) if n == m]
        free = []
        for i in range(6):
            for j in range(1, 6):
                value, slope = s ** (m + 2 * i), (m + 2 * i) * s ** max(m + 2 * i - 1, 0)
                free.append(_gradient(value * z**j, slope * z**j / c, value * j * z ** (j - 1) / deep, m / (c * s)))
        given = []
        for i in rows:
            k = families[i][1]
            value = s**m * eval_jacobi(k, m, -0.5, 1.0 - 2.0 * s * s)
            slope = m * s ** max(m - 1, 0) * eval_jacobi(k, m, -0.5, 1.0 - 2.0 * s * s)
            if k > 0:
                slope = slope - 2.0 * (k + m + 0.5) * s ** (m + 1) * eval_jacobi(k - 1, m + 1, 0.5, 1.0 - 2.0 * s * s)
            scale = _dual_scale(m, k)
            given.append(scale * _gradient(value, slope / c, np.zeros_like(value), m / (c * s), z.shape))
        basis = np.array([(weight * f).ravel() for f in free])
        basis /= np.linalg.norm(basis, axis=1, keepdims=True)
        target = np.array([(weight * f).ravel() for f in given])
        rest = target - (basis.T @ np.linalg.lstsq(basis.T, target.T, rcond=1e-12)[0]).T
        out[np.ix_(rows, rows)] = (2.0 if m == 0 else 1.0) * np.pi * (rest @ rest.T) / (c * c)
    return out


def _gradient(
    value: Floats,
    radial: Floats,
    axial: Floats,
    turns: Floats,
    shape: tuple[int, ...] | None = None,
) -> Floats:
    """(d/drho, d/dz, m/rho) of a function at all points."""
    parts = np.broadcast_arrays(radial, axial, turns * value)
    return np.array([np.broadcast_to(part, shape or part.shape) for part in parts])
