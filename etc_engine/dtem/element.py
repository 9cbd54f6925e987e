r"""The disk as a finite element: its contacts are nodes, its conductivity matrix comes from H.

With arc temperatures T_e, heat flows into the disk Q_e and the mean temperature T_o,

    T_e = T_o e + H Q_e,    e . Q_e = 0    =>    Q_e = K_e T_e.

K_e lives on differences of temperatures: with P = [I; -1 ... -1] (n x (n-1)) the zero-sum heat flows
are Q = P y, and K_e = P (P^T H P)^{-1} P^T. That equals K_hat - g g^T / kappa_e of the literature, needs
one small Cholesky factor, and cannot see a constant added to H.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etc_engine.contacts import ContactNetwork
from etc_engine.dtem.resistance import mutual_resistance_scalar, self_resistance
from etc_engine.errors import GeometryError


@dataclass(frozen=True, eq=False)
class ContactSides:
    """The contacts as each particle sees them, sorted by particle.

    Parameters
    ----------
    offsets : ndarray of int, shape (n + 1,)
        The sides of particle p are rows ``offsets[p]`` to ``offsets[p + 1]``.
    nodes : ndarray of int, shape (s,)
        Contact of each side: particle contacts first, wall contacts after them.
    arms : ndarray, shape (s, d) [m]
        Vector from the particle's centre towards the contact; at the two sides of a particle contact they
        differ by the branch vector.
    theta : ndarray, shape (s,) [rad]
        Position angle of the contact.
    alpha : ndarray, shape (s,) [rad]
        Half-angle of the contact's arc.
    of_contacts : ndarray of int, shape (m, 2)
        The two sides of each particle contact.
    of_walls : ndarray of int, shape (w,)
        The side of each wall contact.
    """

    offsets: NDArray[np.int64]
    nodes: NDArray[np.int64]
    arms: NDArray[np.float64]
    theta: NDArray[np.float64]
    alpha: NDArray[np.float64]
    of_contacts: NDArray[np.int64]
    of_walls: NDArray[np.int64]

    @property
    def particles(self) -> NDArray[np.int64]:
        """Particle of each side, shape (s,)."""
        return np.repeat(np.arange(self.offsets.size - 1), np.diff(self.offsets))


@dataclass(frozen=True, eq=False)
class Elements:
    """Element conductivity matrices, packed.

    Parameters
    ----------
    offsets : ndarray of int, shape (n + 1,)
        Rows of element p: ``offsets[p]`` to ``offsets[p + 1]``.
    nodes : ndarray of int, shape (rows,)
        Global node of each row. A node has at most two rows.
    starts : ndarray of int, shape (n + 1,)
        Element p is ``values[starts[p]:starts[p + 1]]``, a square matrix row by row.
    values : ndarray [W/K per unit thickness]
        The matrices.
    """

    offsets: NDArray[np.int64]
    nodes: NDArray[np.int64]
    starts: NDArray[np.int64]
    values: NDArray[np.float64]

    def apply(self, temperatures: NDArray[np.float64]) -> NDArray[np.float64]:
        """Heat flows K_e T_e into every element, shape (rows, k), for row temperatures of that shape."""
        return _apply(self.offsets, self.starts, self.values, np.ascontiguousarray(temperatures))


def contact_sides(network: ContactNetwork) -> ContactSides:
    """The two sides of every particle contact and the one side of every wall contact, by particle."""
    packing, m = network.packing, network.count
    radii = packing.radii[network.pairs]
    share = radii[:, :1] / radii.sum(axis=1, keepdims=True)
    normals = np.zeros((network.walls.size, packing.dimension))
    normals[np.arange(network.walls.size), network.walls // 2] = 2.0 * (network.walls % 2) - 1.0
    owner = np.concatenate([network.pairs[:, 0], network.pairs[:, 1], network.wall_particles])
    nodes = np.concatenate([np.arange(m), np.arange(m), m + np.arange(network.walls.size)])
    arms = np.concatenate(
        [
            network.branches * share,
            -network.branches * (1.0 - share),
            normals * packing.radii[network.wall_particles, None],
        ]
    )
    alpha = np.concatenate([network.angles[:, 0], network.angles[:, 1], network.wall_angles])
    order = np.argsort(owner, kind="stable")
    offsets = np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=packing.count))])
    place = np.empty_like(order)
    place[order] = np.arange(order.size)
    arms = arms[order]
    return ContactSides(
        offsets=offsets,
        nodes=nodes[order],
        arms=arms,
        theta=np.arctan2(arms[:, 1], arms[:, 0]),
        alpha=alpha[order],
        of_contacts=place[: 2 * m].reshape(2, m).T,
        of_walls=place[2 * m :],
    )


def side_resistances(
    sides: ContactSides,
    method: str,
    conductivity: NDArray[np.float64],
    contact_resistance: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Diagonal of H at every side: h_ii of the method, and the side's share of the contact resistance.

    Parameters
    ----------
    sides : ContactSides
    method : str
        ``standard``, ``enhanced`` or ``chord``.
    conductivity : ndarray, shape (n,) [W/(m K)]
        Conductivity of each particle.
    contact_resistance : ndarray, shape (nodes,) [m K/W]
        Resistance of each contact per unit thickness: half of it goes to either side of a particle
        contact, all of it to the one side of a wall contact.

    Returns
    -------
    ndarray, shape (s,) [m K/W]
    """
    resistance = self_resistance(sides.alpha, method) / conductivity[sides.particles]
    if contact_resistance.any():
        sides_of_node = np.bincount(sides.nodes, minlength=contact_resistance.size)
        resistance += (contact_resistance / np.maximum(sides_of_node, 1))[sides.nodes]
    return resistance


def element_matrices(sides: ContactSides, diagonal: NDArray[np.float64], conductivity: NDArray[np.float64]) -> Elements:
    """Conductivity matrices of all disks.

    Parameters
    ----------
    sides : ContactSides
    diagonal : ndarray, shape (s,) [m K/W]
        Self-resistance h_ii of every side (`side_resistances`).
    conductivity : ndarray, shape (n,) [W/(m K)]

    Returns
    -------
    Elements

    Raises
    ------
    GeometryError
        If two arcs of a disk overlap, or are so wide that its resistance matrix is not positive definite.

    References
    ----------
    Feng, Han, Li, Owen 2008, Eqs. 24 to 30, doi:10.1016/j.jcp.2008.01.031.
    """
    check_arcs(sides)
    widths = np.diff(sides.offsets)
    starts = np.concatenate([[0], np.cumsum(widths**2)])
    values = np.zeros(int(starts[-1]))
    bad = _fill_elements(
        sides.offsets,
        sides.theta,
        sides.alpha,
        diagonal,
        conductivity,
        starts,
        values,
        int(widths.max(initial=0)),
    )
    if bad >= 0:
        widest = np.degrees(sides.alpha[sides.offsets[bad] : sides.offsets[bad + 1]].max())
        raise GeometryError(
            f"the resistance matrix of particle {bad} is not positive definite: its contact arcs (half-angles up to "
            f"{widest:.4g} degrees) are too wide or too close for this method; use smaller contact angles"
        )
    return Elements(sides.offsets, sides.nodes, starts, values)


def check_arcs(sides: ContactSides) -> None:
    """Refuse contact arcs that overlap on one particle.

    Raises
    ------
    GeometryError
        Naming the first particle, the distance of the two arcs and their half-angles.
    """
    particle, a, b = _overlapping_arcs(sides.offsets, sides.theta, sides.alpha)
    if particle >= 0:
        alpha, theta = np.degrees(sides.alpha[[a, b]]), np.degrees(sides.theta[[a, b]])
        apart = abs((theta[0] - theta[1] + 180.0) % 360.0 - 180.0)
        raise GeometryError(
            f"two contact arcs of particle {particle} overlap: {apart:.4g} degrees apart with half-angles "
            f"{alpha[0]:.4g} and {alpha[1]:.4g}; use smaller contact angles or less overlap"
        )


@njit(cache=True)
def _overlapping_arcs(
    offsets: NDArray[np.int64], theta: NDArray[np.float64], alpha: NDArray[np.float64]
) -> tuple[int, int, int]:
    """First particle with overlapping arcs and the two sides, or -1."""
    for p in range(offsets.size - 1):
        for a in range(offsets[p], offsets[p + 1]):
            for b in range(offsets[p], a):
                separation = abs(theta[a] - theta[b])
                if min(separation, 2.0 * np.pi - separation) < alpha[a] + alpha[b]:
                    return p, a, b
    return -1, -1, -1


@njit(cache=True)
def _fill_elements(
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
    inverse = np.empty((widest, widest))
    for p in range(offsets.size - 1):
        first, n = offsets[p], offsets[p + 1] - offsets[p]
        if n < 2:
            continue
        for i in range(n):
            h[i, i] = diagonal[first + i]
            for j in range(i):
                a, b = first + i, first + j
                mutual = mutual_resistance_scalar(theta[a] - theta[b], alpha[a], alpha[b])
                h[i, j] = mutual / conductivity[p]
                h[j, i] = h[i, j]
        if not _invert_on_differences(h, n, inverse):
            return p
        out = values[starts[p] : starts[p + 1]]
        for i in range(n - 1):
            total = 0.0
            for j in range(n - 1):
                out[i * n + j] = inverse[i, j]
                total += inverse[i, j]
            out[i * n + n - 1] = -total
            out[(n - 1) * n + i] = -total
        corner = 0.0
        for i in range(n - 1):
            corner -= out[(n - 1) * n + i]
        out[n * n - 1] = corner
    return -1


@njit(cache=True)
def _invert_on_differences(h: NDArray[np.float64], n: int, inverse: NDArray[np.float64]) -> bool:
    """``inverse[:n-1, :n-1]`` = (P^T H P)^{-1} by Cholesky; False if it is not positive definite. Destroys h."""
    m = n - 1
    last = h[m, m]
    for i in range(m):
        for j in range(i + 1):
            h[i, j] += last - h[i, m] - h[j, m]
    for j in range(m):
        pivot = h[j, j]
        for k in range(j):
            pivot -= h[j, k] * h[j, k]
        if not pivot > 0.0:
            return False
        h[j, j] = np.sqrt(pivot)
        for i in range(j + 1, m):
            value = h[i, j]
            for k in range(j):
                value -= h[i, k] * h[j, k]
            h[i, j] = value / h[j, j]
    # the inverse factor in the lower triangle, then L^-T L^-1 into the upper one
    for j in range(m):
        inverse[j, j] = 1.0 / h[j, j]
        for i in range(j + 1, m):
            value = 0.0
            for k in range(j, i):
                value -= h[i, k] * inverse[k, j]
            inverse[i, j] = value / h[i, i]
    for i in range(m):
        for j in range(i + 1):
            value = 0.0
            for k in range(i, m):
                value += inverse[k, i] * inverse[k, j]
            inverse[j, i] = value
    for i in range(m):
        for j in range(i):
            inverse[i, j] = inverse[j, i]
    return True


@njit(cache=True)
def _apply(
    offsets: NDArray[np.int64],
    starts: NDArray[np.int64],
    values: NDArray[np.float64],
    temperatures: NDArray[np.float64],
) -> NDArray[np.float64]:
    flows = np.zeros_like(temperatures)
    for p in range(offsets.size - 1):
        first, n = offsets[p], offsets[p + 1] - offsets[p]
        for i in range(n):
            for j in range(n):
                k = values[starts[p] + i * n + j]
                for load in range(temperatures.shape[1]):
                    flows[first + i, load] += k * temperatures[first + j, load]
    return flows
