r"""Heat between two spheres through a fluid: coaxial rings, straight tubes between them, one flux shape per pair.

Two spheres face each other over a facet of area A. The facet becomes a disk of equal area about the line of centres,
rho_max = sqrt(A/pi), and the disk a set of rings. Heat leaves one sphere through a ring, crosses the fluid in a
straight tube and enters the other sphere through the mirrored ring:

.. math:: 1/G_k = \Bigl[\int_k \frac{2\pi k_f\,\rho\,d\rho}{g(\rho) + j} + h_r\,\pi(\rho_{k+1}^2-\rho_k^2)\Bigr]^{-1},
   \qquad g(\rho) = d - \sqrt{R_1^2-\rho^2} - \sqrt{R_2^2-\rho^2},

with the jump length j of both surfaces together (rarefied gas) and the radiative conductance h_r per area. A contact
disk of radius c takes the place of the innermost ring. Inside a sphere, uniform flux over ring l warms ring k by
M_kl/(4 pi kappa R) (module `coaxial`). If both faces are isothermal,

.. math:: (M_1/4\pi\kappa_1R_1 + M_2/4\pi\kappa_2R_2 + \mathrm{diag}(1/G))\,q = e, \qquad w = q/\textstyle\sum q,

and the shape w of the flux condenses the pair: constriction h_i = w.M_i w/(4 pi kappa_i R_i) of either side and
resistance R_gap = sum w_k^2/G_k of the fluid between. Their sum is stationary in w.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etc_engine.errors import InputError
from etc_engine.laws.coaxial import Y_TERMS, beta_sums, coaxial_tables, contact_disk, y_sum

RINGS = 12
"""Rings between the innermost cap, or the contact disk, and the rim of the facet's disk."""
MODES = RINGS + 2
"""Most flux modes: contact disk at equilibrium, cap, rings."""
WIDEST_CONTACT = np.sin(np.pi / 3.0)
"""Largest contact radius, in radii of the smaller sphere: the law of the contact disk ends at 60 degrees."""

# Gauss points per ring, in the logarithm of the gap.
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(6)
# The flux density at the edge of a contact without a gap is cut off at this part of the first ring.
_EDGE = 1e-3
# A gap below this part of the smaller radius is closed.
_CLOSED = 1e-12
# Rows of one pair in the kernels.
_DISTANCE, _REACH, _CONTACT, _R1, _R2, _K1, _K2, _FLUID, _JUMP, _RADIATION = range(10)


@dataclass(frozen=True, eq=False)
class FacingSpheres:
    """Pairs of spheres that face each other.

    Parameters
    ----------
    distances : ndarray, shape (m,) [m]
        Of the centres.
    reaches : ndarray, shape (m,) [m]
        Radius of the disk of equal area, at most that of the smaller sphere.
    contacts : ndarray, shape (m,) [m]
        Radius of the solid contact disk, 0 for a gap.
    radii : ndarray, shape (m, 2) [m]
    conductivities : ndarray, shape (m, 2) [W/(m K)]
        Of the solids.
    fluid : ndarray, shape (m,) [W/(m K)]
    jumps : ndarray, shape (m,) [m]
        Temperature jump lengths, both surfaces together.
    radiation : ndarray, shape (m,) [W/(m2 K)]
        Radiative conductance per facing area.
    """

    distances: NDArray[np.float64]
    reaches: NDArray[np.float64]
    contacts: NDArray[np.float64]
    radii: NDArray[np.float64]
    conductivities: NDArray[np.float64]
    fluid: NDArray[np.float64]
    jumps: NDArray[np.float64]
    radiation: NDArray[np.float64]

    @property
    def rows(self) -> NDArray[np.float64]:
        """All values, a row per pair, shape (m, 10)."""
        return np.column_stack([getattr(self, field.name) for field in fields(self)])


@dataclass(frozen=True, eq=False)
class CondensedPairs:
    """Resistances of pairs of facing spheres.

    Parameters
    ----------
    constrictions : ndarray, shape (m, 2) [K/W]
        h_1 and h_2: mean temperature of the facet's flux above that of the sphere, per heat flow, one facet alone.
    gaps : ndarray, shape (m,) [K/W]
        R_gap, of the fluid.
    shapes : ndarray, shape (m, MODES)
        Part of the heat flow in each mode; `legendre_means` reads them.
    """

    constrictions: NDArray[np.float64]
    gaps: NDArray[np.float64]
    shapes: NDArray[np.float64]


def condense_pairs(pairs: FacingSpheres) -> CondensedPairs:
    r"""Constriction of either sphere and resistance of the fluid, of every pair.

    .. math:: R = h_1 + h_2 + R_{gap}, \qquad R = \min_w \{ w\cdot(H_1 + H_2 + \mathrm{diag}(1/G))\,w : e\cdot w = 1\}

    Parameters
    ----------
    pairs : FacingSpheres

    Returns
    -------
    CondensedPairs

    Raises
    ------
    InputError
        If a value is out of range, or a pair has neither a contact nor a fluid nor radiation between.

    Notes
    -----
    About 10 microseconds a pair, 6 if the two spheres are alike. Where spheres reach into each other beyond the contact
    (Hertz: they flatten), the gap starts from zero at its edge. Without a contact, spheres that touch meet at one
    temperature over a cap below the thermal boundary layer, 0.3 R k_f/kappa.

    Examples
    --------
    Unit spheres of conductivity 100, 0.01 apart in a fluid of 1:

    >>> one = np.ones(1)
    >>> pair = FacingSpheres(2.01 * one, 0.9 * one, 0 * one, np.ones((1, 2)), np.full((1, 2), 100.0), one, 0 * one, 0 * one)
    >>> found = condense_pairs(pair)
    >>> bool(found.constrictions[0, 0] == found.constrictions[0, 1]), found.gaps.shape
    (True, (1,))
    """
    rows = np.ascontiguousarray(pairs.rows, dtype=np.float64)
    _check(rows)
    count = rows.shape[0]
    resistances = np.empty((count, 3))
    shapes = np.zeros((count, MODES))
    _condense(rows, coaxial_tables(), resistances, shapes)
    return CondensedPairs(resistances[:, :2].copy(), resistances[:, 2].copy(), shapes)


def _check(rows: NDArray[np.float64]) -> None:
    smaller = np.minimum(rows[:, _R1], rows[:, _R2])
    refused = (
        (~np.isfinite(rows).all(axis=1), "a value is not finite"),
        ((rows[:, [_DISTANCE, _REACH, _R1, _R2, _K1, _K2]] <= 0.0).any(axis=1), "a length or conductivity is not positive"),
        ((rows[:, [_CONTACT, _FLUID, _JUMP, _RADIATION]] < 0.0).any(axis=1), "a value is negative"),
        (rows[:, _REACH] > smaller * (1.0 + 1e-12), "the facet's disk is wider than the smaller sphere"),
        (rows[:, _CONTACT] > WIDEST_CONTACT * smaller, "the contact disk spans more than a half-angle of 60 degrees"),
        ((rows[:, [_CONTACT, _FLUID, _RADIATION]] == 0.0).all(axis=1), "neither contact nor fluid nor radiation between"),
    )
    for bad, what in refused:
        if bad.any():
            row = int(np.flatnonzero(bad)[0])
            values = ", ".join(f"{v:.6g}" for v in rows[row])
            raise InputError(
                f"pair {row} of facing spheres: {what} (distance, reach, contact, radii, conductivities, fluid, jump, "
                f"radiation: {values})"
            )


@njit(cache=True)
def ring_edges(row: NDArray[np.float64], edges: NDArray[np.float64]) -> int:
    """Radii of the rings' edges; returns how many rings lie beyond the innermost cap.

    Spaced by the angle on the smaller sphere: geometrically from the boundary layer outwards, or cubically away from
    the edge of a contact.
    """
    small = min(row[_R1], row[_R2])
    widest = np.arcsin(min(row[_REACH] / small, 1.0 - 1e-15))
    contact = row[_CONTACT]
    if contact > 0.0:
        edges[0] = contact
        first = np.arcsin(contact / small)
        if widest <= first * (1.0 + 1e-6) or (row[_FLUID] == 0.0 and row[_RADIATION] == 0.0):
            return 0
        for k in range(1, RINGS + 1):
            edges[k] = small * np.sin(first + (widest - first) * (k / RINGS) ** 3)
        return RINGS
    first = 0.25 * widest
    if row[_FLUID] > 0.0:
        mean = 2.0 * row[_R1] * row[_R2] / (row[_R1] + row[_R2])
        gap = max(row[_DISTANCE] - row[_R1] - row[_R2], 0.0) + row[_JUMP]
        layer = 0.5 * row[_FLUID] * (1.0 / row[_K1] + 1.0 / row[_K2])
        first = min(first, 0.3 * max(layer, np.sqrt(gap / mean)) * mean / small)
    for k in range(RINGS + 1):
        edges[k] = small * np.sin(first * (widest / first) ** (k / RINGS))
    return RINGS


@njit(cache=True)
def _gap(row: NDArray[np.float64], square: float) -> float:
    """Surface to surface at rho^2, without the cancellation of d - z_1 - z_2."""
    r1, r2 = row[_R1], row[_R2]
    z1, z2 = np.sqrt(max(r1 * r1 - square, 0.0)), np.sqrt(max(r2 * r2 - square, 0.0))
    return (row[_DISTANCE] - r1 - r2) + square / (r1 + z1) + square / (r2 + z2)


@njit(cache=True)
def _tube_resistances(
    row: NDArray[np.float64], edges: NDArray[np.float64], rings: int, out: NDArray[np.float64]
) -> None:
    """1/G of the innermost cap and of every ring beyond it.

    Integrated in the logarithm of the parabolic gap g_0 + (rho^2 - rho_0^2)/(2 R*), in which the integrand is flat.
    """
    curvature = row[_R1] * row[_R2] / (row[_R1] + row[_R2])
    inner = row[_CONTACT] ** 2
    start = _gap(row, inner)
    lift = max(-start, 0.0)  # flattened spheres meet at the edge of their contact
    closed = _CLOSED * min(row[_R1], row[_R2])
    floor = start + lift + row[_JUMP]
    for k in range(rings + 1):
        low = inner if k == 0 else edges[k - 1] ** 2
        high = edges[k] ** 2
        out[k] = 0.0
        if k == 0 and (row[_CONTACT] > 0.0 or (floor <= closed and row[_FLUID] > 0.0)):
            continue  # one temperature on both sides
        whole = row[_RADIATION] * np.pi * (high - low)
        if row[_FLUID] > 0.0:
            if k == 1 and floor <= closed and row[_CONTACT] > 0.0:
                low = (edges[0] + _EDGE * (edges[1] - edges[0])) ** 2
            bottom = np.log(floor + (low - inner) / (2.0 * curvature))
            top = np.log(floor + (high - inner) / (2.0 * curvature))
            for q in range(_POINTS.size):
                parabola = np.exp(bottom + 0.5 * (top - bottom) * (_POINTS[q] + 1.0))
                square = inner + 2.0 * curvature * (parabola - floor)
                width = max(_gap(row, square) + lift, 0.0) + row[_JUMP]
                whole += (
                    0.5 * (top - bottom) * _WEIGHTS[q] * row[_FLUID] * 2.0 * np.pi * curvature * parabola / width
                )
        out[k] = 1.0 / whole


@njit(cache=True)
def _self_matrix(
    row: NDArray[np.float64],
    side: int,
    edges: NDArray[np.float64],
    rings: int,
    tables: NDArray[np.float64],
    m: NDArray[np.float64],
) -> int:
    """M/(4 pi kappa R) between the modes of one sphere; returns their number.

    Caps first; a ring's mean is (B_k cap_k - B_{k-1} cap_{k-1})/(B_k - B_{k-1}), B = sin^2(theta/2).
    """
    radius, scale = row[_R1 + side], 1.0 / (4.0 * np.pi * row[_K1 + side] * row[_R1 + side])
    disk = 1 if row[_CONTACT] > 0.0 else 0
    b = np.empty(MODES)
    coefficients = np.empty(Y_TERMS)
    for k in range(rings + 1):
        sine = min(edges[k] / radius, 1.0)
        b[k] = 0.5 * sine * sine / (1.0 + np.sqrt(1.0 - sine * sine))
    for k in range(rings + 1):
        beta = np.sqrt(b[k])
        beta_sums(tables[0], beta, coefficients)
        for l in range(k + 1):
            m[disk + l, disk + k] = y_sum(coefficients, np.sqrt(b[l]) / beta, beta)
        if disk:
            beta_sums(tables[1], beta, coefficients)
            m[0, disk + k] = y_sum(coefficients, np.sqrt(b[0]) / beta, beta)
    size = rings + 1 + disk
    for k in range(size):
        for l in range(k):
            m[k, l] = m[l, k]
    for k in range(rings, 0, -1):
        for l in range(size):
            m[disk + k, l] = (b[k] * m[disk + k, l] - b[k - 1] * m[disk + k - 1, l]) / (b[k] - b[k - 1])
    for k in range(rings, 0, -1):
        for l in range(size):
            m[l, disk + k] = (b[k] * m[l, disk + k] - b[k - 1] * m[l, disk + k - 1]) / (b[k] - b[k - 1])
    if disk:
        m[0, 0] = m[0, 1] = m[1, 0] = 4.0 * np.pi * contact_disk(np.arcsin(edges[0] / radius))
    m[:size, :size] *= scale
    return size


@njit(cache=True)
def _condense(
    rows: NDArray[np.float64],
    tables: NDArray[np.float64],
    resistances: NDArray[np.float64],
    shapes: NDArray[np.float64],
) -> None:
    """(h_1, h_2, R_gap) and the shape w of each pair: (H_1 + H_2 + diag(1/G)) q = e, w = q/sum q."""
    own, other, factor = np.zeros((MODES, MODES)), np.zeros((MODES, MODES)), np.zeros((MODES, MODES))
    edges, tubes, fluid, w = np.empty(RINGS + 1), np.empty(RINGS + 1), np.empty(MODES), np.empty(MODES)
    for p in range(rows.shape[0]):
        row = rows[p]
        rings = ring_edges(row, edges)
        _tube_resistances(row, edges, rings, tubes)
        size = _self_matrix(row, 0, edges, rings, tables, own)
        alike = row[_R1] == row[_R2] and row[_K1] == row[_K2]
        if not alike:
            _self_matrix(row, 1, edges, rings, tables, other)
        fluid[0] = 0.0
        for k in range(rings + 1):
            fluid[size - rings - 1 + k] = tubes[k]
        for k in range(size):
            for l in range(k + 1):
                factor[k, l] = own[k, l] + (own[k, l] if alike else other[k, l])
            factor[k, k] += fluid[k]
        _solve_ones(factor, size, w)
        total = w[:size].sum()
        gap, constriction, opposite = 0.0, 0.0, 0.0
        for k in range(size):
            w[k] /= total
            shapes[p, k] = w[k]
        for k in range(size):
            gap += fluid[k] * w[k] * w[k]
            for l in range(size):
                constriction += w[k] * own[k, l] * w[l]
                opposite += w[k] * other[k, l] * w[l]
        resistances[p, 0] = constriction
        resistances[p, 1] = constriction if alike else opposite
        resistances[p, 2] = gap


@njit(cache=True)
def _solve_ones(a: NDArray[np.float64], n: int, x: NDArray[np.float64]) -> None:
    """A x = (1, ..., 1) by Cholesky in the lower triangle of ``a``."""
    for j in range(n):
        for k in range(j):
            for i in range(j, n):
                a[i, j] -= a[i, k] * a[j, k]
        pivot = np.sqrt(a[j, j])
        for i in range(j, n):
            a[i, j] /= pivot
    for i in range(n):
        x[i] = 1.0
        for k in range(i):
            x[i] -= a[i, k] * x[k]
        x[i] /= a[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            x[i] -= a[k, i] * x[k]
        x[i] /= a[i, i]


@njit(cache=True)
def legendre_means(row: NDArray[np.float64], side: int, shape: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    """a_l = sum_k w_k A_l(mode k) of one side, l = 1 .. out.size, into ``out``.

    The mean of P_l over a ring is [P_{l-1} - P_{l+1}] between its edges over (2l+1) 2 (B_k - B_{k-1}).
    """
    radius = row[_R1 + side]
    edges = np.empty(RINGS + 1)
    rings = ring_edges(row, edges)
    disk = 1 if row[_CONTACT] > 0.0 else 0
    x, lower, upper, weight = np.empty(RINGS + 1), np.ones(RINGS + 1), np.empty(RINGS + 1), np.zeros(RINGS + 1)
    inside = 0.0
    for k in range(rings + 1):
        sine = min(edges[k] / radius, 1.0)
        x[k] = np.sqrt(1.0 - sine * sine)
        b = 0.5 * sine * sine / (1.0 + x[k])
        part = 0.5 * shape[disk + k] / (b - inside)
        weight[k] += part
        if k > 0:
            weight[k - 1] -= part
        inside = b
        upper[k] = x[k]
    angle = np.arcsin(edges[0] / radius)
    for l in range(1, out.size + 1):
        value = 0.0
        for k in range(rings + 1):
            next_one = ((2 * l + 1) * x[k] * upper[k] - l * lower[k]) / (l + 1)
            value += weight[k] * (lower[k] - next_one)
            lower[k], upper[k] = upper[k], next_one
        out[l - 1] = value / (2 * l + 1)
        if disk:
            out[l - 1] += shape[0] * np.sin((l + 0.5) * angle) / ((2 * l + 1) * np.sin(0.5 * angle))
