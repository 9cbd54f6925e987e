"""Which contacts can carry a steady heat flow: clusters, spanning, rattlers and dead ends."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etc_engine.medium.loads import Links, asked_groups, driven_walls
from etc_engine.packing.particles import ParticlePacking


@dataclass(frozen=True, eq=False)
class Backbone:
    """The part of a contact network that may carry a steady flux.

    Parameters
    ----------
    contacts : ndarray of bool, shape (m,)
        Particle contacts kept.
    wall_contacts : ndarray of bool, shape (w,)
        Wall contacts kept: of all those of the network, only ones with a driven wall.
    clusters : ndarray of int, shape (n,)
        Connected cluster of each particle, by its lowest row number.
    spans : tuple of bool
        For each load axis asked for, whether some cluster spans it (walls) or wraps around it (periodic).
    """

    contacts: NDArray[np.bool_]
    wall_contacts: NDArray[np.bool_]
    clusters: NDArray[np.int64]
    spans: tuple[bool, ...]


def find_backbone(
    network: Links,
    axes: tuple[int, ...],
    conducts: NDArray[np.bool_] | None = None,
    walls_conduct: NDArray[np.bool_] | None = None,
) -> Backbone:
    """Keep the clusters that span a load axis, and prune their dead ends.

    Between walls a cluster spans when it touches both of them; around a periodic box when a path inside
    it returns to its start displaced by a whole box. Particles left with a single contact carry no steady
    flux and are taken away, repeatedly.

    Parameters
    ----------
    network : Links
        Such as a `etc_engine.medium.network.ContactNetwork`.
    axes : tuple of int
        Load axes that share one system: a single walled axis, or periodic axes only.
    conducts, walls_conduct : ndarray of bool, shapes (m,) and (w,), optional
        Links that conduct at all; all by default.

    Returns
    -------
    Backbone

    Notes
    -----
    Linear in the number of contacts (union-find with displacements, then a queue of dead ends).

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.rules import bonded_contacts
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> box = Box((1.0, 1.0))
    >>> chain = ParticlePacking([[0.25, 0.5], [0.75, 0.5], [0.75, 0.9]], [0.25, 0.25, 0.1], box)
    >>> find_backbone(bonded_contacts(chain, 0.1), (0,)).spans
    (True,)
    """
    n, box = network.packing.count, network.packing.box
    conducts = np.ones(len(network.pairs), dtype=np.bool_) if conducts is None else conducts
    driven = driven_walls(network, axes)
    if walls_conduct is not None:
        driven &= walls_conduct
    clusters, winding = join_clusters(n, network.pairs[conducts], network.shifts[conducts])
    if box.periodic[axes[0]]:
        spanning = winding[:, list(axes)]
    else:
        touches = np.zeros((n, 2), dtype=np.bool_)
        touches[clusters[network.wall_particles[driven]], network.walls[driven] % 2] = True
        spanning = (touches[:, 0] & touches[:, 1])[:, None]
    spans = tuple(bool(column.any()) for column in spanning.T)
    in_play = np.zeros(n, dtype=np.bool_)
    for column in spanning.T:
        in_play |= column[clusters]
    kept = prune_dead_ends(in_play, network.pairs[conducts], network.wall_particles[driven])
    contacts = conducts & kept[network.pairs[:, 0]] & kept[network.pairs[:, 1]]
    wall_contacts = driven & kept[network.wall_particles]
    return Backbone(contacts, wall_contacts, clusters, spans)


def restore_dead_ends(network: Links, backbone: Backbone) -> Backbone:
    """The same backbone with the dead ends of its clusters.

    They pass on no heat, but a contact resolved over its width sees some of it turn back in them.

    Parameters
    ----------
    network : Links
    backbone : Backbone
        Of this network.
    """
    ends, walls = network.pairs[:, 0], network.wall_particles
    in_play = np.zeros(network.packing.count, dtype=np.bool_)
    in_play[backbone.clusters[ends[backbone.contacts]]] = True
    in_play[backbone.clusters[walls[backbone.wall_contacts]]] = True
    driven_walls = np.isin(network.walls, network.walls[backbone.wall_contacts])
    return replace(
        backbone,
        contacts=in_play[backbone.clusters[ends]],
        wall_contacts=driven_walls & in_play[backbone.clusters[walls]],
    )


def joined_axes(
    packing: ParticlePacking,
    pairs: NDArray[np.int64],
    shifts: NDArray[np.int64],
    wall_particles: NDArray[np.int64],
    walls: NDArray[np.int64],
) -> tuple[int, ...]:
    """Axes along which linked particles join: wrap around the box, or touch both of its walls.

    Parameters are as in `etc_engine.medium.network.ContactNetwork`.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> none = np.zeros(0, dtype=np.int64)
    >>> disk = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0), (True, True)))
    >>> joined_axes(disk, np.array([[0, 0]]), np.array([[1, 0]]), none, none)
    (0,)
    """
    box = packing.box
    return joined_nodes(packing.count, box.periodic, (pairs, shifts), (wall_particles, walls))


def joined_nodes(
    count: int,
    periodic: tuple[bool, ...],
    links: tuple[NDArray[np.int64], NDArray[np.int64]],
    ends: tuple[NDArray[np.int64], NDArray[np.int64]],
) -> tuple[int, ...]:
    """The same of any nodes in a box: ``links`` are pairs and shifts, ``ends`` nodes at walls and the walls.

    Examples
    --------
    >>> none = np.zeros(0, dtype=np.int64)
    >>> joined_nodes(1, (True, True), (np.array([[0, 0]]), np.array([[0, 1]])), (none, none))
    (1,)
    """
    clusters, winding = join_clusters(count, *links)
    touches = np.zeros((count, 2 * len(periodic)), dtype=np.bool_)
    touches[clusters[ends[0]], ends[1]] = True
    spanning = np.where(periodic, winding, touches[:, 0::2] & touches[:, 1::2])
    return tuple(int(axis) for axis in np.flatnonzero(spanning.any(axis=0)))


def find_backbones(network: Links, axes: tuple[int, ...] | None = None) -> dict[tuple[int, ...], Backbone]:
    """Backbone of every load group; shared by all contact angles and methods on one network."""
    return {group: find_backbone(network, group) for group in asked_groups(network.packing.box, axes)}


@njit(cache=True)
def _root(parent: NDArray[np.int64], offset: NDArray[np.int64], i: int, displacement: NDArray[np.int64]) -> int:
    """Root of i; ``displacement`` becomes the boxes between the two (union by size keeps paths short)."""
    for axis in range(displacement.size):
        displacement[axis] = 0
    while parent[i] != i:
        for axis in range(displacement.size):
            displacement[axis] += offset[i, axis]
        i = parent[i]
    return i


@njit(cache=True)
def join_clusters(
    n: int, pairs: NDArray[np.int64], shifts: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Cluster label (lowest row) of each particle, and the axes around which each labelled cluster wraps."""
    d = shifts.shape[1]
    parent, size, label = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    for i in range(n):
        parent[i], size[i], label[i] = i, 1, -1
    offset = np.zeros((n, d), dtype=np.int64)
    winding = np.zeros((n, d), dtype=np.bool_)
    of_i, of_j, step = np.empty(d, dtype=np.int64), np.empty(d, dtype=np.int64), np.empty(d, dtype=np.int64)
    for c in range(pairs.shape[0]):
        a = _root(parent, offset, pairs[c, 0], of_i)
        b = _root(parent, offset, pairs[c, 1], of_j)
        for axis in range(d):
            step[axis] = of_i[axis] + shifts[c, axis] - of_j[axis]  # of root b from root a along this contact
        if a == b:
            for axis in range(d):
                winding[a, axis] |= step[axis] != 0
            continue
        sign = 1
        if size[a] < size[b]:
            a, b, sign = b, a, -1
        parent[b] = a
        size[a] += size[b]
        for axis in range(d):
            offset[b, axis] = sign * step[axis]
            winding[a, axis] |= winding[b, axis]
    clusters = np.empty(n, dtype=np.int64)
    wraps = np.zeros((n, d), dtype=np.bool_)
    for i in range(n):
        root = _root(parent, offset, i, of_i)
        if label[root] < 0:
            label[root] = i
            for axis in range(d):
                wraps[i, axis] = winding[root, axis]
        clusters[i] = label[root]
    return clusters, wraps


@njit(cache=True)
def prune_dead_ends(
    in_play: NDArray[np.bool_], pairs: NDArray[np.int64], wall_particles: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Particles in play that keep at least two contacts when dead ends are taken away repeatedly."""
    n, m = in_play.size, pairs.shape[0]
    start = np.zeros(n + 1, dtype=np.int64)
    for c in range(m):
        start[pairs[c, 0] + 1] += 1
        start[pairs[c, 1] + 1] += 1
    degree = start[1:].copy()
    for w in range(wall_particles.size):
        degree[wall_particles[w]] += 1
    for i in range(n):
        start[i + 1] += start[i]
    fill = start[:-1].copy()
    partner = np.empty(2 * m, dtype=np.int64)
    for c in range(m):
        i, j = pairs[c, 0], pairs[c, 1]
        partner[fill[i]] = j
        fill[i] += 1
        partner[fill[j]] = i
        fill[j] += 1
    kept = in_play.copy()
    queue = np.empty(n, dtype=np.int64)
    tail = 0
    for i in range(n):
        if kept[i] and degree[i] < 2:
            kept[i] = False
            queue[tail] = i
            tail += 1
    head = 0
    while head < tail:
        i = queue[head]
        head += 1
        for s in range(start[i], start[i + 1]):
            j = partner[s]
            degree[j] -= 1
            if kept[j] and degree[j] < 2:
                kept[j] = False
                queue[tail] = j
                tail += 1
    return kept
