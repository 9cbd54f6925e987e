"""The contacts of a network as each particle sees them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etc_engine.errors import GeometryError
from etc_engine.laws.by_dimension import law_of
from etc_engine.medium.network import ContactNetwork


@dataclass(frozen=True, eq=False)
class InsulatedCuts:
    """Chords at which insulated walls cut disks.

    Parameters
    ----------
    particles : ndarray of int, shape (c,)
    walls : ndarray of int, shape (c,)
        Row of the cut among the wall contacts of the network.
    theta, alpha : ndarray, shape (c,) [rad]
        Position angle and half-angle of each cut.
    """

    particles: NDArray[np.int64]
    walls: NDArray[np.int64]
    theta: NDArray[np.float64]
    alpha: NDArray[np.float64]


NO_CUTS = InsulatedCuts(*np.zeros((2, 0), dtype=np.int64), *np.zeros((2, 0)))


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
    radii : ndarray, shape (n,) [m]
        Of the particles.
    cuts : InsulatedCuts
        What insulated walls cut off; only ``exact`` heeds it.
    """

    offsets: NDArray[np.int64]
    nodes: NDArray[np.int64]
    arms: NDArray[np.float64]
    theta: NDArray[np.float64]
    alpha: NDArray[np.float64]
    of_contacts: NDArray[np.int64]
    of_walls: NDArray[np.int64]
    radii: NDArray[np.float64]
    cuts: InsulatedCuts = NO_CUTS

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return int(self.arms.shape[1])

    @property
    def particles(self) -> NDArray[np.int64]:
        """Particle of each side, shape (s,)."""
        return np.repeat(np.arange(self.offsets.size - 1), np.diff(self.offsets))

    @property
    def mode_signs(self) -> NDArray[np.float64]:
        """-1 at the second side of a particle contact, whose arc runs the other way: odd modes change sign there."""
        signs = np.ones(self.nodes.size)
        signs[self.of_contacts[:, 1]] = -1.0
        return signs


def insulated_cuts(network: ContactNetwork, driven: NDArray[np.bool_]) -> InsulatedCuts:
    """The cuts at the wall contacts that are not driven; none where arcs are prescribed.

    Parameters
    ----------
    network : ContactNetwork
        Two-dimensional.
    driven : ndarray of bool, shape (w,)
    """
    if not network.geometric:
        return NO_CUTS
    rows = np.flatnonzero(~driven)
    towards = np.array([np.pi, 0.0, -0.5 * np.pi, 0.5 * np.pi])
    return InsulatedCuts(network.wall_particles[rows], rows, towards[network.walls[rows]], network.wall_angles[rows])


def contact_sides(network: ContactNetwork, cuts: InsulatedCuts = NO_CUTS) -> ContactSides:
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
        radii=packing.radii,
        cuts=cuts,
    )


def check_arcs(sides: ContactSides) -> None:
    """Refuse contacts that overlap on one particle.

    Raises
    ------
    GeometryError
        Naming the first particle, the distance of the two contacts and their half-angles.
    """
    refuse_overlap(sides.offsets, sides.arms, sides.alpha)


def refuse_overlap(offsets: NDArray[np.int64], arms: NDArray[np.float64], alpha: NDArray[np.float64]) -> None:
    """Raise the error of `check_arcs` for the contacts ``offsets[p]`` to ``offsets[p + 1]`` of each particle p."""
    particle, a, b, apart = _overlapping(offsets, np.ascontiguousarray(arms), alpha)
    if particle >= 0:
        widths = np.degrees(alpha[[a, b]])
        raise GeometryError(
            f"two contact {law_of(arms.shape[1]).contact}s of particle {particle} overlap: {np.degrees(apart):.4g} "
            f"degrees apart with half-angles {widths[0]:.4g} and {widths[1]:.4g}; use smaller contact angles or less "
            f"overlap"
        )


@njit(cache=True)
def _separation(arms: NDArray[np.float64], a: int, b: int) -> float:
    """Angle between two directions, 2 arcsin(|u - v|/2) of the unit vectors u and v."""
    d = arms.shape[1]
    first, second, square = 0.0, 0.0, 0.0
    for axis in range(d):
        first += arms[a, axis] ** 2
        second += arms[b, axis] ** 2
    for axis in range(d):
        square += (arms[a, axis] / np.sqrt(first) - arms[b, axis] / np.sqrt(second)) ** 2
    return 2.0 * np.arcsin(min(1.0, 0.5 * np.sqrt(square)))


@njit(cache=True)
def _overlapping(
    offsets: NDArray[np.int64], arms: NDArray[np.float64], alpha: NDArray[np.float64]
) -> tuple[int, int, int, float]:
    """First particle with overlapping contacts, the two sides and the angle between them, or -1."""
    for p in range(offsets.size - 1):
        for a in range(offsets[p], offsets[p + 1]):
            for b in range(offsets[p], a):
                separation = _separation(arms, a, b)
                if separation < alpha[a] + alpha[b]:
                    return p, a, b, separation
    return -1, -1, -1, 0.0


def count_close_arcs(sides: ContactSides) -> int:
    """Pairs of contacts on one particle whose gap is less than the sum of their half-angles.

    There the flux through one contact feels the other, and ``chord``, which takes every source for a far one,
    loses its accuracy.
    """
    return int(_close(sides.offsets, np.ascontiguousarray(sides.arms), sides.alpha))


@njit(cache=True)
def _close(offsets: NDArray[np.int64], arms: NDArray[np.float64], alpha: NDArray[np.float64]) -> int:
    number = 0
    for p in range(offsets.size - 1):
        for a in range(offsets[p], offsets[p + 1]):
            for b in range(offsets[p], a):
                if _separation(arms, a, b) < 2.0 * (alpha[a] + alpha[b]):
                    number += 1
    return number
