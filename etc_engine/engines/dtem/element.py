r"""The disk as a finite element: its contacts are nodes, its conductivity matrix comes from H.

With arc temperatures T_e, heat flows into the disk Q_e and the mean temperature T_o,

    T_e = T_o e + H Q_e,    e . Q_e = 0    =>    Q_e = K_e T_e.

K_e lives on differences of temperatures: with P = [I; -1 ... -1] (n x (n-1)) the zero-sum heat flows
are Q = P y, and K_e = P (P^T H P)^{-1} P^T. That equals K_hat - g g^T / kappa_e of Feng et al. 2008 (Eq. 30),
needs one small Cholesky factor, and cannot see a constant added to H.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from etc_engine.arrays import Floats, Ints
from etc_engine.errors import GeometryError
from etc_engine.laws.disk import position_angles
from etc_engine.medium.sides import ContactSides


class DiskContacts(NamedTuple):
    """The contacts of disks as compiled code takes them, sorted by particle.

    Parameters
    ----------
    offsets : ndarray of int, shape (n + 1,)
        Contacts of disk p: ``offsets[p]`` to ``offsets[p + 1]``.
    theta, alpha : ndarray, shape (s,) [rad]
        Position angle and half-angle of each contact.
    signs : ndarray, shape (s,)
        -1 where odd modes change sign.
    resistances : ndarray, shape (s,) [m K/W]
        Share of the contact resistance.
    conductivity : ndarray, shape (n,) [W/(m K)]
    """

    offsets: Ints
    theta: Floats
    alpha: Floats
    signs: Floats
    resistances: Floats
    conductivity: Floats


def disk_contacts(sides: ContactSides, conductivity: Floats) -> DiskContacts:
    """Contact sides of disks with their position angles."""
    return DiskContacts(
        sides.offsets,
        position_angles(sides.arms),
        sides.alpha,
        sides.mode_signs,
        sides.resistances,
        np.ascontiguousarray(conductivity),
    )


@dataclass(frozen=True, eq=False)
class Elements:
    """Element conductivity matrices, packed.

    A method may resolve the flux over a contact in several modes; every mode of a contact is a node, and mode
    0 carries its whole heat flow. Rows run over the contact sides of a particle, modes fastest.

    Parameters
    ----------
    modes : int
        Modes of every contact, M.
    offsets : ndarray of int, shape (n + 1,)
        Rows of element p: ``offsets[p]`` to ``offsets[p + 1]``.
    nodes : ndarray of int, shape (rows,)
        Global node of each row, M times its contact plus its mode. A node has at most two rows.
    starts : ndarray of int, shape (n + 1,)
        Element p is ``values[starts[p]:starts[p + 1]]``, a square matrix row by row.
    values : ndarray [W/K per unit thickness]
        The matrices.
    """

    modes: int
    offsets: Ints
    nodes: Ints
    starts: Ints
    values: Floats

    def apply(self, temperatures: Floats) -> Floats:
        """Heat flows K_e T_e into every element, shape (rows, k), for row temperatures of that shape."""
        return _apply(self.offsets, self.starts, self.values, np.ascontiguousarray(temperatures))


class Resistances(NamedTuple):
    """Resistance matrices H of all disks, packed as `Elements` are, and how their rows see a field of one dipole.

    Parameters
    ----------
    modes : int
        Modes of every contact, M.
    starts : ndarray of int, shape (n + 1,)
        H of particle p is ``values[starts[p]:starts[p + 1]]``, row by row.
    values : ndarray [m K/W]
        Contact resistances included.
    moments : ndarray, shape (rows, 2)
        Of cos(angle) and sin(angle) over each row's flux mode; over an arc of uniform flux the first is
        cos(theta) sin(alpha)/alpha.
    """

    modes: int
    starts: Ints
    values: Floats
    moments: Floats


LARGEST_ELEMENT = 2000
"""Rows of the matrix of one particle (contacts times modes): its factor costs their cube, ten seconds at this size."""


def packed_starts(offsets: Ints) -> Ints:
    """Where each square matrix begins in a packed array, for elements of ``offsets[p + 1] - offsets[p]`` rows.

    Raises
    ------
    GeometryError
        If a particle has more rows than an element is solved with.
    """
    sizes = np.diff(offsets)
    if sizes.max(initial=0) > LARGEST_ELEMENT:
        raise GeometryError(
            f"particle {int(sizes.argmax())} has {sizes.max()} contacts (times modes), an element of more than "
            f"{LARGEST_ELEMENT} is not solved: its cost grows with their cube; use the engine pipe"
        )
    return np.concatenate([[0], np.cumsum(sizes**2)])


def condensed_elements(resistances: Resistances, sides: ContactSides) -> Elements:
    """Conductivity matrices K_e = P (P^T H P)^{-1} P^T of all disks from their resistances.

    Raises
    ------
    GeometryError
        If the contacts of a disk are so wide or close that P^T H P is not positive definite.
    """
    modes = resistances.modes
    offsets = modes * sides.offsets
    values = np.zeros_like(resistances.values)
    bad = _condense_all(offsets, resistances.starts, resistances.values, modes, values)
    refuse_indefinite(bad, sides)
    nodes = (modes * sides.nodes[:, None] + np.arange(modes)).ravel()
    return Elements(modes, offsets, nodes, resistances.starts, values)


def contact_potentials(resistances: Resistances, sides: ContactSides, flows: Floats) -> Floats:
    """Temperature of every contact above its particle's mean, sum_j h_ij Q_j, shape (s,).

    Parameters
    ----------
    resistances : Resistances
    sides : ContactSides
        All sides, those without flux included.
    flows : ndarray, shape (s, modes) [W/m]
        Flux modes into the particle at each side.
    """
    modes = resistances.modes
    temperatures = _apply(
        modes * sides.offsets, resistances.starts, resistances.values, np.ascontiguousarray(flows).reshape(-1, 1)
    )
    return np.ascontiguousarray(temperatures[::modes, 0])


def refuse_indefinite(particle: int, sides: ContactSides) -> None:
    """Raise the error of an element whose resistance matrix has no inverse, unless ``particle`` is -1."""
    if particle >= 0:
        widest = np.degrees(sides.alpha[sides.offsets[particle] : sides.offsets[particle + 1]].max())
        raise GeometryError(
            f"the resistance matrix of particle {particle} is not positive definite: its contact arcs (half-angles up "
            f"to {widest:.4g} degrees) are too wide or too close for this method; use smaller contact angles"
        )


def smallest_ratio(elements: Elements, reference: Elements) -> float:
    """A c > 0 with K_e >= c K_e0 for every element, not far below the largest one.

    Parameters
    ----------
    elements, reference : Elements
        K_e and K_e0, of the same sides.

    Notes
    -----
    1/c is the largest over the elements of m + s sqrt(n - 1), which bounds the n eigenvalues of K_e^-1 K_e0 (one
    node grounded) by their mean m and standard deviation s, both from traces.

    References
    ----------
    Wolkowicz, Styan 1980, Bounds for eigenvalues using traces, Theorem 2.1, doi:10.1016/0024-3795(80)90258-X.
    """
    widest = int(np.diff(elements.offsets).max(initial=1))
    return 1.0 / _largest_ratio(
        elements.offsets, elements.starts, reference.values, elements.values, elements.modes, widest
    )


@njit(cache=True)
def _largest_ratio(
    offsets: Ints,
    starts: Ints,
    upper: Floats,
    lower: Floats,
    modes: int,
    widest: int,
) -> float:
    """Bound of the eigenvalues of lower^-1 upper over all elements; infinite if one cannot be inverted."""
    inverse, product = np.empty((widest, widest)), np.empty((widest, widest))
    largest = 1e-300
    for p in range(offsets.size - 1):
        size = offsets[p + 1] - offsets[p]
        m, ground = size - 1, size - modes
        if m < 1 or not np.any(lower[starts[p] : starts[p + 1]]):
            continue
        for i in range(m):
            row = i + (i >= ground)
            for j in range(i + 1):
                inverse[i, j] = lower[starts[p] + row * size + j + (j >= ground)]
        if not cholesky_inverse(inverse, m):
            return np.inf
        trace = 0.0
        for i in range(m):
            for j in range(m):
                column = j + (j >= ground)
                value = 0.0
                for k in range(m):
                    value += inverse[i, k] * upper[starts[p] + (k + (k >= ground)) * size + column]
                product[i, j] = value
            trace += product[i, i]
        squares = 0.0
        for i in range(m):
            for j in range(m):
                squares += product[i, j] * product[j, i]
        mean = trace / m
        spread = np.sqrt(max(squares / m - mean * mean, 0.0))
        largest = max(largest, mean + spread * np.sqrt(m - 1.0))
    return largest


@njit(cache=True)
def _condense_all(
    offsets: Ints,
    starts: Ints,
    resistances: Floats,
    modes: int,
    values: Floats,
) -> int:
    """Condense every disk of at least two contacts; returns the first that has no inverse, or -1."""
    for p in range(offsets.size - 1):
        size = offsets[p + 1] - offsets[p]
        if size < 2 * modes:
            continue
        h = resistances[starts[p] : starts[p + 1]].reshape((size, size))
        if not condense(h, size, modes, np.empty((size, size)), values[starts[p] : starts[p + 1]]):
            return p
    return -1


@njit(cache=True)
def condense(h: Floats, size: int, modes: int, work: Floats, out: Floats) -> bool:
    """K_e = P (P^T H P)^{-1} P^T of one element, row by row into ``out``.

    ``h[:size, :size]`` is H; rows ``0, modes, 2 modes, ...`` carry the heat flows that sum to zero, the first row
    of the last contact is the one left out of the basis. ``work`` has the shape of ``h``. Returns False if
    P^T H P is not positive definite.
    """
    last = size - modes
    m = 0
    for i in range(size):
        if i == last:
            continue
        n = 0
        for j in range(i + 1):
            if j == last:
                continue
            value = h[i, j]
            if i % modes == 0:
                value -= h[last, j]
            if j % modes == 0:
                value -= h[i, last]
            if i % modes == 0 and j % modes == 0:
                value += h[last, last]
            work[m, n] = value
            n += 1
        m += 1
    if not cholesky_inverse(work, size - 1):
        return False
    out[:] = 0.0
    row = 0
    for i in range(size):
        if i == last:
            continue
        column = 0
        for j in range(size):
            if j == last:
                continue
            value = work[row, column]
            out[i * size + j] = value
            if j % modes == 0:
                out[i * size + last] -= value
            if i % modes == 0:
                out[last * size + j] -= value
            if i % modes == 0 and j % modes == 0:
                out[last * size + last] += value
            column += 1
        row += 1
    return True


@njit(cache=True)
def cholesky_inverse(a: Floats, m: int) -> bool:
    """Invert ``a[:m, :m]`` in place, given its lower triangle; False if it is not positive definite."""
    for j in range(m):
        pivot = a[j, j]
        for k in range(j):
            pivot -= a[j, k] * a[j, k]
        if not pivot > 0.0:
            return False
        a[j, j] = np.sqrt(pivot)
        for i in range(j + 1, m):
            value = a[i, j]
            for k in range(j):
                value -= a[i, k] * a[j, k]
            a[i, j] = value / a[j, j]
    for j in range(m):  # the inverse factor takes the place of the factor, column by column
        a[j, j] = 1.0 / a[j, j]
        for i in range(j + 1, m):
            value = 0.0
            for k in range(j, i):
                value -= a[i, k] * a[k, j]
            a[i, j] = value / a[i, i]
    for i in range(m):  # L^-T L^-1 into the upper triangle; row i of the factor is read for the last time here
        for j in range(i + 1):
            value = 0.0
            for k in range(i, m):
                value += a[k, i] * a[k, j]
            a[j, i] = value
    for i in range(m):
        for j in range(i):
            a[i, j] = a[j, i]
    return True


@njit(cache=True)
def _apply(
    offsets: Ints,
    starts: Ints,
    values: Floats,
    temperatures: Floats,
) -> Floats:
    flows = np.zeros(temperatures.shape)
    for p in range(offsets.size - 1):
        first, n = offsets[p], offsets[p + 1] - offsets[p]
        for i in range(n):
            for j in range(n):
                k = values[starts[p] + i * n + j]
                for load in range(temperatures.shape[1]):
                    flows[first + i, load] += k * temperatures[first + j, load]
    return flows
