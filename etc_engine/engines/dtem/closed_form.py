"""Elements with one flux mode a contact: the methods ``standard``, ``enhanced`` and ``chord``."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etc_engine.engines.dtem.element import Elements, Material, Resistances, condense, packed_starts, refuse_indefinite
from etc_engine.laws.disk import mutual_resistance_scalar, self_resistance
from etc_engine.medium.sides import ContactSides


def closed_form_elements(sides: ContactSides, material: Material, modes: int = 1, *, method: str) -> Elements:
    """Conductivity matrices of all disks, H in closed form.

    H = (kappa h_ij)/kappa, plus each side's share of the contact resistance on the diagonal.

    Parameters
    ----------
    sides : ContactSides
    material : Material
    modes : int
        Always 1.
    method : str
        ``standard``, ``enhanced`` or ``chord``: what h_ii is.

    Returns
    -------
    Elements

    Raises
    ------
    GeometryError
        If the arcs of a disk are so wide that its resistance matrix is not positive definite.

    References
    ----------
    Feng, Han, Li, Owen 2008, Eqs. 20 to 30, doi:10.1016/j.jcp.2008.01.031.
    """
    starts = packed_starts(sides.offsets)
    values = np.zeros(int(starts[-1]))
    bad = _fill(
        sides.offsets,
        sides.theta,
        sides.alpha,
        _diagonal(sides, material, method),
        material.conductivity,
        starts,
        values,
        int(np.diff(sides.offsets).max(initial=1)),
    )
    refuse_indefinite(bad, sides)
    return Elements(modes, sides.offsets, sides.nodes, starts, values)


def closed_form_resistances(sides: ContactSides, material: Material, modes: int = 1, *, method: str) -> Resistances:
    """Resistance matrices H of all disks; arguments as in `closed_form_elements`."""
    starts = packed_starts(sides.offsets)
    values = np.zeros(int(starts[-1]))
    _fill_resistances(
        sides.offsets,
        sides.theta,
        sides.alpha,
        _diagonal(sides, material, method),
        material.conductivity,
        starts,
        values,
        int(np.diff(sides.offsets).max(initial=1)),
    )
    directions = np.stack([np.cos(sides.theta), np.sin(sides.theta)], axis=1)
    return Resistances(modes, starts, values, np.sinc(sides.alpha / np.pi)[:, None] * directions)


def closed_form_potentials(
    sides: ContactSides, material: Material, flows: NDArray[np.float64], method: str
) -> NDArray[np.float64]:
    """Temperature of every arc above its particle's mean, sum_j h_ij Q_j, shape (s,).

    Parameters
    ----------
    sides : ContactSides
        All sides, those without flux included.
    material : Material
    flows : ndarray, shape (s, 1) [W/m]
        Heat flow into the particle at each side.
    method : str
    """
    return _potentials(
        sides.offsets, sides.theta, sides.alpha, _diagonal(sides, material, method), material.conductivity, flows[:, 0]
    )


def _diagonal(sides: ContactSides, material: Material, method: str) -> NDArray[np.float64]:
    own = self_resistance(sides.alpha, method) / material.conductivity[sides.particles]
    return own + material.side_resistances(sides)


@njit(cache=True)
def _disk_resistances(
    first: int,
    n: int,
    theta: NDArray[np.float64],
    alpha: NDArray[np.float64],
    diagonal: NDArray[np.float64],
    conductivity: float,
    h: NDArray[np.float64],
) -> None:
    """H of the disk with sides ``first`` to ``first + n`` into ``h[:n, :n]``."""
    for i in range(n):
        a = first + i
        h[i, i] = diagonal[a]
        for j in range(i):
            b = first + j
            h[i, j] = mutual_resistance_scalar(theta[a] - theta[b], alpha[a], alpha[b]) / conductivity
            h[j, i] = h[i, j]


@njit(cache=True)
def _fill_resistances(
    offsets: NDArray[np.int64],
    theta: NDArray[np.float64],
    alpha: NDArray[np.float64],
    diagonal: NDArray[np.float64],
    conductivity: NDArray[np.float64],
    starts: NDArray[np.int64],
    values: NDArray[np.float64],
    widest: int,
) -> None:
    """Fill the packed matrices H."""
    h = np.empty((widest, widest))
    for p in range(offsets.size - 1):
        n = offsets[p + 1] - offsets[p]
        _disk_resistances(offsets[p], n, theta, alpha, diagonal, conductivity[p], h)
        for i in range(n):
            for j in range(n):
                values[starts[p] + i * n + j] = h[i, j]


@njit(cache=True)
def _fill(
    offsets: NDArray[np.int64],
    theta: NDArray[np.float64],
    alpha: NDArray[np.float64],
    diagonal: NDArray[np.float64],
    conductivity: NDArray[np.float64],
    starts: NDArray[np.int64],
    values: NDArray[np.float64],
    widest: int,
) -> int:
    """Fill the packed matrices; answers the first particle whose H is not positive definite, or -1."""
    h = np.empty((widest, widest))
    work = np.empty((widest, widest))
    for p in range(offsets.size - 1):
        first, n = offsets[p], offsets[p + 1] - offsets[p]
        if n < 2:
            continue
        _disk_resistances(first, n, theta, alpha, diagonal, conductivity[p], h)
        if not condense(h, n, 1, work, values[starts[p] : starts[p + 1]]):
            return p
    return -1


@njit(cache=True)
def _potentials(
    offsets: NDArray[np.int64],
    theta: NDArray[np.float64],
    alpha: NDArray[np.float64],
    diagonal: NDArray[np.float64],
    conductivity: NDArray[np.float64],
    flows: NDArray[np.float64],
) -> NDArray[np.float64]:
    potentials = np.zeros(theta.size)
    for p in range(offsets.size - 1):
        for i in range(offsets[p], offsets[p + 1]):
            for j in range(offsets[p], offsets[p + 1]):
                if flows[j] == 0.0:
                    continue
                if i == j:
                    potentials[i] += diagonal[i] * flows[i]
                else:
                    h = mutual_resistance_scalar(theta[i] - theta[j], alpha[i], alpha[j])
                    potentials[i] += h / conductivity[p] * flows[j]
    return potentials
