"""Loads of a box: walls at temperatures, or mean gradients. Made here once for all engines on particles and links."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.box import AXES, Box
from etc_engine.errors import InputError
from etc_engine.medium.sides import ContactSides
from etc_engine.packing.particles import ParticlePacking


class Links(Protocol):
    """Nodes at the centres of particles, links between them, and links to walls.

    ``pairs`` (m, 2), ``shifts`` (m, d), ``branches`` (m, d), ``wall_particles`` (w,) and ``walls`` (w,) are as in
    `etc_engine.medium.network.ContactNetwork`.
    """

    @property
    def packing(self) -> ParticlePacking: ...  # noqa: D102
    @property
    def pairs(self) -> Ints: ...  # noqa: D102
    @property
    def shifts(self) -> Ints: ...  # noqa: D102
    @property
    def branches(self) -> Floats: ...  # noqa: D102
    @property
    def wall_particles(self) -> Ints: ...  # noqa: D102
    @property
    def walls(self) -> Ints: ...  # noqa: D102


def load_groups(box: Box) -> tuple[tuple[int, ...], ...]:
    """Load axes that share a matrix: each walled axis alone, all periodic axes together.

    Next to a walled axis a periodic axis has a separate system, because the walls drive only their axis.

    Examples
    --------
    >>> load_groups(Box((1.0, 1.0), (True, True))), load_groups(Box((1.0, 1.0), (False, True)))
    (((0, 1),), ((0,), (1,)))
    """
    periodic = tuple(axis for axis in range(box.dimension) if box.periodic[axis])
    walled = tuple((axis,) for axis in range(box.dimension) if not box.periodic[axis])
    return tuple(sorted(walled + ((periodic,) if periodic else ())))


def asked_groups(box: Box, axes: tuple[int, ...] | None) -> tuple[tuple[int, ...], ...]:
    """Load groups that hold one of the axes asked for; all by default.

    Raises
    ------
    InputError
        If the box has no such axis.
    """
    groups = load_groups(box)
    if axes is None:
        return groups
    if not axes or not set(axes) <= set(range(box.dimension)):
        raise InputError(f"a box of {box.dimension} axes has the load axes {AXES[: box.dimension]}, found {axes!r}")
    return tuple(group for group in groups if set(group) & set(axes))


def driven_walls(links: Links, axes: tuple[int, ...]) -> Flags:
    """Wall links whose wall has a prescribed temperature, shape (w,)."""
    return np.asarray((links.walls // 2 == axes[0]) & (not links.packing.box.periodic[axes[0]]))


def wall_temperatures(walls: Ints) -> Floats:
    """Temperature of driven walls: 1 at the low end of the axis, 0 at the far end [K]."""
    return np.asarray(1.0 - walls % 2)


@dataclass(frozen=True, eq=False)
class LinkLoads:
    """Loads of one group on nodes at particle centres, one column k per axis.

    Parameters
    ----------
    jumps : ndarray, shape (m, k) [K]
        Rise of the mean gradient along each link: its branch vector's component; 0 between walls.
    offsets : ndarray, shape (m, k) [K]
        Rise from the home image of j to the linked one.
    walls : ndarray, shape (w, k) [K]
        Prescribed temperatures at the driven walls, 0 elsewhere.
    """

    jumps: Floats
    offsets: Floats
    walls: Floats


def link_loads(links: Links, axes: tuple[int, ...]) -> LinkLoads:
    """Mean gradients of 1 along periodic axes, or walls at temperatures 1 and 0."""
    box, columns = links.packing.box, list(axes)
    none = np.zeros((len(links.pairs), len(axes)))
    walls = np.zeros((links.walls.size, len(axes)))
    if box.periodic[axes[0]]:
        return LinkLoads(links.branches[:, columns], links.shifts[:, columns] * np.asarray(box.lengths)[columns], walls)
    walls[:, 0] = np.where(driven_walls(links, axes), wall_temperatures(links.walls), 0.0)
    return LinkLoads(none, none, walls)


def first_of_clusters(labels: Ints) -> Ints:
    """Row of the first member of each cluster: the node that is pinned under mean gradients."""
    return np.unique(labels, return_index=True)[1]


def contact_lift(
    reduced: Links, axes: tuple[int, ...], clusters: Ints, sides: ContactSides, modes: int
) -> tuple[Floats, Flags]:
    """Lift and prescribed nodes of a system whose nodes are the contacts, each of several flux modes.

    The walls of a walled axis are prescribed, and one contact of each cluster along periodic axes, whose lift are the
    components of the arms. Both are uniform over a contact: they load mode 0, and a wall holds the other modes at 0.

    Parameters
    ----------
    reduced : Links
        The contacts that take part.
    axes : tuple of int
    clusters : ndarray of int, shape (n,)
        Of the particles.
    sides : ContactSides
        Of ``reduced``.
    modes : int

    Returns
    -------
    lift : ndarray, shape (s modes, k)
    prescribed : ndarray of bool, shape ((m + w) modes,)
    """
    m = len(reduced.pairs)
    prescribed = np.zeros((m + reduced.walls.size, modes), dtype=np.bool_)
    lift = np.zeros((sides.nodes.size, modes, len(axes)))
    if reduced.packing.box.periodic[axes[0]]:
        prescribed[first_of_clusters(clusters[reduced.pairs[:, 0]]), 0] = True
        lift[:, 0, :] = sides.arms[:, list(axes)]
    else:
        prescribed[m:] = True
        lift[:, 0, 0] = np.concatenate([np.zeros(m), wall_temperatures(reduced.walls)])[sides.nodes]
    return lift.reshape(-1, len(axes)), prescribed.ravel()
