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
resistance R_gap = sum w_k^2/G_k + R_bond w_disk^2 between. Their sum is stationary in w.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etc_engine.errors import InputError
from etc_engine.laws.coaxial import Y_TERMS, coaxial_column, coaxial_tables
from etc_engine.laws.sphere import chord_resistance

RINGS = 12
"""Rings between the innermost cap, or the contact disk, and the rim of the facet's disk."""
MODES = RINGS + 2
"""Most flux modes: contact disk at equilibrium, cap, rings."""
WIDEST_CONTACT = np.sin(np.radians(85.0))
"""Largest contact radius, in radii of the smaller sphere."""
LONE_DISK = np.radians(60.0)
"""Beyond this half-angle a contact disk carries all the heat of its facet."""

# Gauss points per ring, in the logarithm of the gap.
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(4)
# The flux density at the edge of a contact without a gap is cut off at this part of the first ring.
_EDGE = 1e-3
# A gap below this part of the smaller radius is closed.
_CLOSED = 1e-12
# Rows of one pair in the kernels.
_DISTANCE, _REACH, _CONTACT, _R1, _R2, _K1, _K2, _FLUID, _JUMP, _RADIATION, _BOND = range(11)


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
    bonds : ndarray, shape (m,) [K/W]
        Contact resistance of the solid contact disk as a whole.
    """

    distances: NDArray[np.float64]
    reaches: NDArray[np.float64]
    contacts: NDArray[np.float64]
    radii: NDArray[np.float64]
    conductivities: NDArray[np.float64]
    fluid: NDArray[np.float64]
    jumps: NDArray[np.float64]
    radiation: NDArray[np.float64]
    bonds: NDArray[np.float64]

    @property
    def rows(self) -> NDArray[np.float64]:
        """All values, a row per pair, shape (m, 11)."""
        return np.column_stack([getattr(self, field.name) for field in fields(self)])


@dataclass(frozen=True, eq=False)
class CondensedPairs:
    """Resistances of pairs of facing spheres.

    Parameters
    ----------
    constrictions : ndarray, shape (m, 2) [K/W]
        h_1 and h_2: mean temperature of the facet's flux above that of the sphere, per heat flow, one facet alone.
    gaps : ndarray, shape (m,) [K/W]
        R_gap, of the fluid and of the contact's own resistance.
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
    About 7 microseconds a pair of like spheres, 12 otherwise. Both ring spacings, all edges and every second one, go
    into h and R_gap, which removes their leading error: against 120 rings R is off by less than 6e-4, mostly 1e-4.
    Where spheres reach into each other beyond the contact (Hertz: they flatten), the gap starts from zero at its edge.
    Without a contact, spheres that touch meet at one temperature over a cap below the thermal boundary layer,
    0.3 R k_f/kappa.

    Examples
    --------
    Unit spheres of conductivity 100, 0.01 apart in a fluid of 1:

    >>> one = np.ones(1)
    >>> radii, none = np.ones((1, 2)), np.zeros(1)
    >>> pair = FacingSpheres(2.01 * one, 0.9 * one, none, radii, 100.0 * radii, one, none, none, none)
    >>> found = condense_pairs(pair)
    >>> round(float(1.0 / (found.gaps + found.constrictions.sum(axis=1))[0]), 2)
    11.63
    """
    rows = np.ascontiguousarray(pairs.rows, dtype=np.float64)
    _check(rows)
    count = rows.shape[0]
    resistances = np.empty((count, 3))
    shapes = np.zeros((count, MODES))
    disks = chord_resistance(np.arcsin(np.maximum(rows[:, _CONTACT, None], 1e-12) / rows[:, _R1 : _R2 + 1]))
    _condense(rows, disks, coaxial_tables(), resistances, shapes)
    return CondensedPairs(resistances[:, :2].copy(), resistances[:, 2].copy(), shapes)


def _check(rows: NDArray[np.float64]) -> None:
    smaller = np.minimum(rows[:, _R1], rows[:, _R2])
    refused = (
        (~np.isfinite(rows).all(axis=1), "a value is not finite"),
        (
            (rows[:, [_DISTANCE, _REACH, _R1, _R2, _K1, _K2]] <= 0.0).any(axis=1),
            "a length or conductivity is <= 0",
        ),
        ((rows[:, [_CONTACT, _FLUID, _JUMP, _RADIATION, _BOND]] < 0.0).any(axis=1), "a value is negative"),
        (rows[:, _REACH] > smaller * (1.0 + 1e-12), "the facet's disk is wider than the smaller sphere"),
        (rows[:, _CONTACT] > WIDEST_CONTACT * smaller, "the contact disk spans more than a half-angle of 85 degrees"),
        (
            (rows[:, [_CONTACT, _FLUID, _RADIATION]] == 0.0).all(axis=1),
            "no contact, fluid or radiation between",
        ),
    )
    for bad, what in refused:
        if bad.any():
            row = int(np.flatnonzero(bad)[0])
            values = ", ".join(f"{v:.6g}" for v in rows[row])
            raise InputError(
                f"pair {row} of facing spheres: {what} (distance, reach, contact, radii, conductivities, fluid, jump, "
                f"radiation, bond: {values})"
            )


@njit(cache=True)
def ring_edges(row: NDArray[np.float64], edges: NDArray[np.float64]) -> int:
    """Radii of the rings' edges; returns how many rings lie beyond the innermost cap.

    Spaced by the angle on the smaller sphere: geometrically from the boundary layer outwards, or by a power away from
    the edge of a contact.
    """
    small = min(row[_R1], row[_R2])
    widest = np.arcsin(min(row[_REACH] / small, 1.0 - 1e-15))
    contact = row[_CONTACT]
    if contact > 0.0:
        edges[0] = contact
        first = np.arcsin(contact / small)
        if widest <= 1.02 * first or first > LONE_DISK or (row[_FLUID] == 0.0 and row[_RADIATION] == 0.0):
            return 0
        power = 1.0 + 2.0 * (widest - first) / widest  # rings thinner than 1 % of their cap are lost in round-off
        for k in range(1, RINGS + 1):
            edges[k] = small * np.sin(first + (widest - first) * (k / RINGS) ** power)
        return RINGS
    first = 0.25 * widest
    if row[_FLUID] > 0.0:  # smooth in all of its arguments, as results shall be
        mean = 2.0 * row[_R1] * row[_R2] / (row[_R1] + row[_R2])
        gap = max(row[_DISTANCE] - row[_R1] - row[_R2], 0.0) + row[_JUMP]
        layer = 0.5 * row[_FLUID] * (1.0 / row[_K1] + 1.0 / row[_K2])
        scale = 0.3 * np.sqrt(layer * layer + gap / mean) * mean / small
        first = scale / (1.0 + (scale / first) ** 4) ** 0.25
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
def _tube_conductances(
    row: NDArray[np.float64], edges: NDArray[np.float64], rings: int, out: NDArray[np.float64]
) -> None:
    """G of the innermost cap and of every ring beyond it; infinite where both sides have one temperature.

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
        out[k] = np.inf
        if k == 0 and (row[_CONTACT] > 0.0 or (floor <= closed and row[_FLUID] > 0.0)):
            continue
        out[k] = row[_RADIATION] * np.pi * (high - low)
        if row[_FLUID] > 0.0:
            if k == 1 and floor <= closed and row[_CONTACT] > 0.0:
                low = (edges[0] + _EDGE * (edges[1] - edges[0])) ** 2
            bottom = np.log(floor + (low - inner) / (2.0 * curvature))
            top = np.log(floor + (high - inner) / (2.0 * curvature))
            for q in range(_POINTS.size):
                parabola = np.exp(bottom + 0.5 * (top - bottom) * (_POINTS[q] + 1.0))
                square = inner + 2.0 * curvature * (parabola - floor)
                width = max(_gap(row, square) + lift, 0.0) + row[_JUMP]
                out[k] += (top - bottom) * _WEIGHTS[q] * row[_FLUID] * np.pi * curvature * parabola / width


@njit(cache=True)
def _cap_matrix(
    row: NDArray[np.float64],
    side: int,
    edges: NDArray[np.float64],
    rings: int,
    tables: NDArray[np.float64],
    caps: NDArray[np.float64],
    b: NDArray[np.float64],
) -> None:
    """F of all caps into ``caps[1:, 1:]``, D of the disk in them into row and column 0; ``b`` = sin^2(theta/2)."""
    radius = row[_R1 + side]
    column, work = np.empty(RINGS + 1), np.empty((6, max(Y_TERMS, RINGS + 1)))
    one = np.int64(1)  # a plain 1 is a type of its own for numba: a second compilation
    for k in range(rings + 1):
        sine = min(edges[k] / radius, 1.0)
        b[k] = 0.5 * sine * sine / (1.0 + np.sqrt(1.0 - sine * sine))
    for k in range(rings + 1):
        coaxial_column(tables[0], b, k, k + 1, column, work)
        for l in range(k + 1):
            caps[1 + l, 1 + k] = caps[1 + k, 1 + l] = column[l]
        if row[_CONTACT] > 0.0:
            coaxial_column(tables[1], b, k, one, column, work)
            caps[0, 1 + k] = caps[1 + k, 0] = column[0]


@njit(cache=True)
def _ring_matrix(
    caps: NDArray[np.float64],
    b: NDArray[np.float64],
    scheme: tuple[int, int, int],
    scale: float,
    disk_resistance: float,
    m: NDArray[np.float64],
) -> int:
    """M/(4 pi kappa R) between the modes of one sphere; returns their number.

    A ring's mean is (B_k cap_k - B_{k-1} cap_{k-1})/(B_k - B_{k-1}). ``scheme``: rings, stride over edges, disk or not.
    """
    rings, stride, disk = scheme
    size = rings + 1 + disk
    for k in range(size):
        for l in range(size):
            from_k, from_l = k - disk, l - disk
            m[k, l] = caps[1 + from_k * stride if from_k >= 0 else 0, 1 + from_l * stride if from_l >= 0 else 0]
    for k in range(rings, 0, -1):
        high, low = b[k * stride], b[(k - 1) * stride]
        for l in range(size):
            m[disk + k, l] = (high * m[disk + k, l] - low * m[disk + k - 1, l]) / (high - low)
    for k in range(rings, 0, -1):
        high, low = b[k * stride], b[(k - 1) * stride]
        for l in range(size):
            m[l, disk + k] = (high * m[l, disk + k] - low * m[l, disk + k - 1]) / (high - low)
    if disk:
        m[0, 0] = m[0, 1] = m[1, 0] = 4.0 * np.pi * disk_resistance
    for k in range(size):
        for l in range(size):
            m[k, l] *= scale
    return size


@njit(cache=True)
def _condense(rows, disks, tables, resistances, shapes):  # type: ignore[no-untyped-def]
    """(h_1, h_2, R_gap) and the shape w of each pair: (H_1 + H_2 + diag(1/G)) q = e, w = q/sum q.

    All rings and every second edge: the error is proportional to the square of the spacing, h = (4 h_all - h_half)/3.
    """
    caps, b = np.zeros((2, MODES, MODES)), np.empty((2, RINGS + 1))
    m, factor = np.zeros((2, MODES, MODES)), np.zeros((MODES, MODES))
    edges, tubes, fluid, w = np.empty(RINGS + 1), np.empty(RINGS + 1), np.empty(MODES), np.empty(MODES)
    for p in range(rows.shape[0]):
        row = rows[p]
        most = ring_edges(row, edges)
        _tube_conductances(row, edges, most, tubes)
        disk = 1 if row[_CONTACT] > 0.0 else 0
        alike = row[_R1] == row[_R2] and row[_K1] == row[_K2]
        sides = 1 if alike else 2
        for side in range(sides):
            _cap_matrix(row, side, edges, most, tables, caps[side], b[side])
        for side in range(3):
            resistances[p, side] = 0.0
        for stride in (1, 2):
            rings = most // stride
            size = rings + 1 + disk
            share = 1.0 if most == 0 else (4.0 / 3.0 if stride == 1 else -1.0 / 3.0)
            for k in range(size):
                for l in range(size):
                    factor[k, l] = 0.0
            for side in range(sides):
                scale = 1.0 / (4.0 * np.pi * row[_K1 + side] * row[_R1 + side])
                _ring_matrix(caps[side], b[side], (rings, stride, disk), scale, disks[p, side], m[side])
                for k in range(size):
                    for l in range(size):
                        factor[k, l] += m[side, k, l] * (2.0 if alike else 1.0)
            fluid[0] = fluid[1] = 0.0  # the modes of the disk have no tube
            for k in range(rings + 1):
                conductance = tubes[k * stride]
                if k > 0 and stride == 2:
                    conductance += tubes[k * stride - 1]
                fluid[disk + k] = 1.0 / conductance
                factor[disk + k, disk + k] += fluid[disk + k]
            if disk:
                for k in range(2):
                    for l in range(2):
                        factor[k, l] += row[_BOND]
            if most == 0 and disk:
                w[0], w[1] = 1.0, 0.0
            else:
                _solve_ones(factor, size, w)
                total = 0.0
                for k in range(size):
                    total += w[k]
                for k in range(size):
                    w[k] /= total
            if stride == 1:
                for k in range(size):
                    shapes[p, k] = w[k]
            gap = row[_BOND] * (w[0] + w[1]) ** 2 if disk else 0.0
            for k in range(size):
                gap += fluid[k] * w[k] * w[k]
                for l in range(size):
                    for side in range(sides):
                        resistances[p, side] += share * w[k] * m[side, k, l] * w[l]
            resistances[p, 2] += share * gap
            if most == 0:
                break
        if alike:
            resistances[p, 1] = resistances[p, 0]


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


@njit(cache=True, fastmath={"reassoc", "contract", "nsz"})
def legendre_means(row: NDArray[np.float64], side: int, shape: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    """a_l = sum_k w_k A_l(mode k) of one side, l = 1 .. out.size, into ``out``.

    The mean of P_l over a ring is [P_{l-1} - P_{l+1}] between its edges over (2l+1) 2 (B_k - B_{k-1}).
    """
    radius = row[_R1 + side]
    edges = np.empty(RINGS + 1)
    rings = ring_edges(row, edges)
    disk = 1 if row[_CONTACT] > 0.0 else 0
    x, lower, upper, weight = np.empty(RINGS + 1), np.empty(RINGS + 1), np.empty(RINGS + 1), np.zeros(RINGS + 1)
    for k in range(RINGS + 1):
        lower[k] = 1.0
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
