"""What the walls of a crop do to particles and contacts that they go through."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etc_engine.laws.by_dimension import law_of
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.sides import contact_sides, unit_vectors


def trim_crop(network: ContactNetwork, walls: NDArray[np.bool_]) -> tuple[ContactNetwork, int, int]:
    """The network that a crop leaves: deep cuts made shallower, contacts that its walls go through left out.

    Parameters
    ----------
    network, walls
        As in `cut_contacts`.

    Returns
    -------
    network : ContactNetwork
    trimmed : int
        Particles that a wall cuts near their middle; of spheres the cut is taken at 75 degrees.
    left_out : int
        Contacts between particles through which a wall goes.

    Notes
    -----
    Of a bed of 14 000 spheres the conductivity between two crops changes by .1 % if 75 degrees become 60.
    """
    widest = law_of(network.packing.dimension).widest_cut
    deep = walls[network.walls] & (network.wall_angles > widest)
    network = replace(network, wall_angles=np.where(deep, widest, network.wall_angles))
    cut = cut_contacts(network, walls)
    kept = network.select(~cut, np.ones(network.walls.size, dtype=np.bool_))
    return kept, int(deep.sum()), int(cut.sum())


def cut_contacts(network: ContactNetwork, walls: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Particle contacts that meet the contact of one of their particles with a wall, shape (m,).

    Parameters
    ----------
    network : ContactNetwork
        With contacts as particles and walls cut them out of each other.
    walls : ndarray of bool, shape (2 d,)
        The walls in question.

    Notes
    -----
    Where a crop goes through particles, it goes through some of their contacts. No element has a form for half a
    contact; next to an isothermal wall such a contact carries little heat, since both of its particles touch the wall.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.rules import overlap_contacts
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> packing = ParticlePacking([[0.05, 0.5], [0.05, 1.45], [0.9, 0.9]], [0.5, 0.5, 0.45], Box((2.0, 2.0)))
    >>> network = overlap_contacts(packing)
    >>> network.pairs[cut_contacts(network, np.array([True, False, False, False]))].tolist()
    [[0, 1]]
    """
    sides = contact_sides(network.select(np.ones(network.count, dtype=np.bool_), walls[network.walls]))
    cut = np.zeros(network.count, dtype=np.bool_)
    _mark(sides.offsets, sides.nodes, unit_vectors(sides.arms), sides.alpha, cut)
    return cut


@njit(cache=True)
def _mark(
    offsets: NDArray[np.int64],
    nodes: NDArray[np.int64],
    normals: NDArray[np.float64],
    alpha: NDArray[np.float64],
    cut: NDArray[np.bool_],
) -> None:
    for p in range(offsets.size - 1):
        for wall in range(offsets[p], offsets[p + 1]):
            if nodes[wall] < cut.size:
                continue
            for side in range(offsets[p], offsets[p + 1]):
                if nodes[side] >= cut.size:
                    continue
                square = 0.0  # |n - n'|^2 = 4 sin^2(separation/2)
                for k in range(normals.shape[1]):
                    square += (normals[wall, k] - normals[side, k]) ** 2
                if np.sqrt(square) < 2.0 * np.sin(0.5 * min(alpha[wall] + alpha[side], np.pi)):
                    cut[nodes[side]] = True
