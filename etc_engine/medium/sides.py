"""The contacts of a network as each particle sees them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.errors import GeometryError
from etc_engine.laws.by_dimension import law_of
from etc_engine.medium.network import ContactNetwork, over_area


@dataclass(frozen=True, eq=False)
class InsulatedCuts:
    """Contacts at which insulated walls cut particles.

    Parameters
    ----------
    particles : ndarray of int, shape (c,)
    walls : ndarray of int, shape (c,)
        Row of the cut among the wall contacts of the network.
    arms : ndarray, shape (c, d)
        Unit direction of each cut.
    alpha : ndarray, shape (c,) [rad]
        Its half-angle.
    """

    particles: Ints
    walls: Ints
    arms: Floats
    alpha: Floats


NONE = np.zeros(0, dtype=np.int64)
NO_CUTS = InsulatedCuts(NONE, NONE, np.zeros((0, 2)), np.zeros(0))


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
    alpha : ndarray, shape (s,) [rad]
        Half-angle of the contact.
    lumped_resistances : ndarray, shape (s,) [K/W, in 2D m K/W]
        Part of the contact's resistance that belongs to the side: half of it on either side of a particle contact,
        all of it on the one side of a wall contact.
    area_resistances : ndarray, shape (s,) [m2 K/W]
        Likewise of the resistance of a unit of contact area.
    reaches : ndarray, shape (s,) [m]
        Half-width of the contact, as of `ContactNetwork.reaches`.
    radii : ndarray, shape (n,) [m]
        Of the particles.
    of_contacts : ndarray of int, shape (m, 2)
        The two sides of each particle contact.
    of_walls : ndarray of int, shape (w,)
        The side of each wall contact.
    cuts : InsulatedCuts
        What insulated walls cut off; only ``exact`` heeds it.
    """

    offsets: Ints
    nodes: Ints
    arms: Floats
    alpha: Floats
    lumped_resistances: Floats
    area_resistances: Floats
    reaches: Floats
    radii: Floats
    of_contacts: Ints
    of_walls: Ints
    cuts: InsulatedCuts = NO_CUTS

    @property
    def dimension(self) -> int:
        """2 for disks, 3 for spheres."""
        return int(self.arms.shape[1])

    @property
    def particles(self) -> Ints:
        """Particle of each side, shape (s,)."""
        return np.repeat(np.arange(self.offsets.size - 1), np.diff(self.offsets))

    @property
    def resistances(self) -> Floats:
        """Part of the whole resistance of the contact that belongs to the side, shape (s,) [K/W, in 2D m K/W]."""
        return self.lumped_resistances + over_area(self.area_resistances, self.reaches, self.dimension)

    def with_half_angle(self, half_angle: float) -> ContactSides:
        """The same contacts, all with one half-angle [rad] on either side."""
        alpha, radii = np.full_like(self.alpha, half_angle), self.radii[self.particles]
        reaches = radii * np.sin(alpha)
        reaches[self.of_contacts] = reaches[self.of_contacts].min(axis=1, keepdims=True, initial=np.inf)
        return replace(self, alpha=alpha, reaches=reaches)

    @property
    def mode_signs(self) -> Floats:
        """-1 at the second side of a particle contact, whose arc runs the other way: odd modes change sign there."""
        signs = np.ones(self.nodes.size)
        signs[self.of_contacts[:, 1]] = -1.0
        return signs


def insulated_cuts(network: ContactNetwork, driven: Flags) -> InsulatedCuts:
    """The cuts at the wall contacts that are not driven; none where arcs are prescribed.

    Parameters
    ----------
    network : ContactNetwork
    driven : ndarray of bool, shape (w,)
    """
    if not network.geometric:
        return NO_CUTS
    rows = np.flatnonzero(~driven)
    arms = wall_normals(network.walls[rows], network.packing.dimension)
    return InsulatedCuts(network.wall_particles[rows], rows, arms, network.wall_angles[rows])


def wall_normals(walls: Ints, dimension: int) -> Floats:
    """Outward unit normals of walls, shape (w, d)."""
    normals = np.zeros((walls.size, dimension))
    normals[np.arange(walls.size), walls // 2] = 2.0 * (walls % 2) - 1.0
    return normals


def contact_sides(network: ContactNetwork, cuts: InsulatedCuts = NO_CUTS) -> ContactSides:
    """The two sides of every particle contact and the one side of every wall contact, by particle."""
    packing, m = network.packing, network.count
    owner = np.concatenate([network.pairs[:, 0], network.pairs[:, 1], network.wall_particles])
    order = np.argsort(owner, kind="stable")
    offsets = np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=packing.count))])
    place = np.empty_like(order)
    place[order] = np.arange(order.size)
    nodes = np.concatenate([np.arange(m), np.arange(m), m + np.arange(network.walls.size)])[order]
    parts = np.concatenate([np.full(2 * m, 0.5), np.ones(network.walls.size)])[order]
    lumped = np.concatenate([network.lumped_resistances, network.wall_lumped_resistances])[nodes]
    lumped *= parts
    area = np.zeros(nodes.size) if network.area_resistances is None else parts * network.area_resistances[nodes]
    del owner, parts  # of millions of contacts: each column is made and put in order alone
    return ContactSides(
        offsets=offsets,
        nodes=nodes,
        arms=_arms(network)[order],
        alpha=np.concatenate([network.angles[:, 0], network.angles[:, 1], network.wall_angles])[order],
        lumped_resistances=lumped,
        area_resistances=area,
        reaches=network.reaches[nodes],
        radii=packing.radii,
        of_contacts=place[: 2 * m].reshape(2, m).T,
        of_walls=place[2 * m :],
        cuts=cuts,
    )


def _arms(network: ContactNetwork) -> Floats:
    """From the centre to the contact: of the first sides of all contacts, the second ones, and those at walls."""
    packing = network.packing
    radii = packing.radii[network.pairs]
    share = radii[:, :1] / radii.sum(axis=1, keepdims=True)
    normals = wall_normals(network.walls, packing.dimension)
    at_walls = normals * packing.radii[network.wall_particles, None]
    return np.concatenate([network.branches * share, -network.branches * (1.0 - share), at_walls])


def check_arcs(sides: ContactSides) -> None:
    """Refuse contacts that overlap on one particle.

    Raises
    ------
    GeometryError
        Naming the first particle, the distance of the two contacts and their half-angles.
    """
    refuse_overlap(sides.offsets, sides.arms, sides.alpha)


def refuse_overlap(offsets: Ints, arms: Floats, alpha: Floats) -> None:
    """Raise the error of `check_arcs` for the contacts ``offsets[p]`` to ``offsets[p + 1]`` of each particle p."""
    normals = unit_vectors(arms)
    number, a, b = _close_pairs(offsets, normals, alpha, 1.0)
    if number:
        particle = int(np.searchsorted(offsets, a, side="right")) - 1
        apart = 2.0 * np.degrees(np.arcsin(min(0.5 * float(np.linalg.norm(normals[a] - normals[b])), 1.0)))
        raise GeometryError(
            f"two contact {law_of(arms.shape[1]).contact}s of particle {particle} overlap: {apart:.4g} degrees apart "
            f"with half-angles {np.degrees(alpha[a]):.4g} and {np.degrees(alpha[b]):.4g}; use smaller contact angles "
            f"or less overlap"
        )


def unit_vectors(arms: Floats) -> Floats:
    """Directions of arms, shape (s, d)."""
    lengths = np.sqrt((arms**2).sum(axis=1))
    return np.ascontiguousarray(arms / np.where(lengths > 0.0, lengths, 1.0)[:, None])


def count_close_arcs(sides: ContactSides) -> int:
    """Pairs of contacts on one particle whose gap is less than the sum of their half-angles.

    There the flux through one contact feels the other, and ``chord``, which takes every source for a far one,
    loses its accuracy.
    """
    return int(_close_pairs(sides.offsets, unit_vectors(sides.arms), sides.alpha, 2.0)[0])


@njit(cache=True)
def _close_pairs(offsets: Ints, normals: Floats, alpha: Floats, factor: float) -> tuple[int, int, int]:
    """Number of pairs on one particle closer than ``factor`` times the sum of their half-angles, and the first of them.

    The chord |n_a - n_b| = 2 sin(separation/2) keeps its digits for near directions, in 2D and 3D.
    """
    number, first, second = 0, -1, -1
    for p in range(offsets.size - 1):
        for a in range(offsets[p], offsets[p + 1]):
            for b in range(offsets[p], a):
                square = 0.0
                for k in range(normals.shape[1]):
                    square += (normals[a, k] - normals[b, k]) ** 2
                reach = min(factor * (alpha[a] + alpha[b]), np.pi)
                if np.sqrt(square) < 2.0 * np.sin(0.5 * reach):
                    if number == 0:
                        first, second = a, b
                    number += 1
    return number, first, second
