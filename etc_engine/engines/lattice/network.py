"""Lattice: nodes that stand for pieces of a continuous body, and the surfaces that heat passes between them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from etc_engine.arrays import Floats, Ints
from etc_engine.errors import GeometryError, InputError
from etc_engine.medium.touching import closest_neighbors
from etc_engine.packing.particles import ParticlePacking
from etc_engine.structure.laguerre import laguerre_facets

TRANSMISSIONS = ("laguerre", "contact")
"""Rules that give the transmission surfaces."""

ATTACHMENTS = ("mirror", "particle")
"""Ways to tie a contact lattice to a wall: across its distance from it, or by holding whole particles."""

COORDINATION = 7.5
"""Mean coordination number of the contact lattice of Haddad et al. 2021."""

# A wall link of this part of its length holds its particle at the temperature of the wall.
SHORT = 1e-8


@dataclass(frozen=True, eq=False)
class Lattice:
    """Nodes of a continuous body and the links between them.

    Parameters
    ----------
    packing : ParticlePacking
        The particles, n of them in three dimensions; their centres are the nodes.
    pairs : ndarray of int64, shape (m, 2)
        Linked nodes i <= j.
    shifts : ndarray of int64, shape (m, 3)
        The image of j that is linked to i lies at ``x_j + shift * lengths``.
    sections : ndarray, shape (m,) [m2]
        Transmission surface S of each link.
    segments : ndarray, shape (m, 2) [m]
        Lengths from i and from j to the transmission surface; they add up to the distance of the nodes.
    crossings : ndarray, shape (m, 3) [m]
        Where the heat crosses: centroid of the transmission surface, as seen from i.
    volumes : ndarray, shape (n,) [m3]
        Volume of the body that a node stands for; they add up to that of the body.
    wall_particles, walls : ndarray of int64, shape (w,)
        Node and wall of each wall link; wall ``2 * axis`` lies at 0, ``2 * axis + 1`` at the far end of the box.
    wall_sections, wall_segments : ndarray, shape (w,)
        Surface [m2] and length [m] of each wall link.
    wall_crossings : ndarray, shape (w, 3) [m]
        Where the heat crosses the wall, as seen from the node.
    """

    packing: ParticlePacking
    pairs: Ints
    shifts: Ints
    sections: Floats
    segments: Floats
    crossings: Floats
    volumes: Floats
    wall_particles: Ints
    walls: Ints
    wall_sections: Floats
    wall_segments: Floats
    wall_crossings: Floats

    @property
    def count(self) -> int:
        """Number of nodes."""
        return self.packing.count

    @property
    def coordination(self) -> float:
        """Mean number of links of a node to others, 2 m / n."""
        return 2.0 * self.sections.size / self.count

    @cached_property
    def branches(self) -> Floats:
        """Branch vectors from node i to the linked image of j, shape (m, 3) [m]."""
        return _branches(self.packing, self.pairs, self.shifts)


@dataclass(frozen=True, eq=False)
class Conductances:
    """Conductances of the links of a lattice.

    Parameters
    ----------
    links : ndarray, shape (m,) [W/K]
    walls : ndarray, shape (w,) [W/K]
    """

    links: Floats
    walls: Floats


def laguerre_lattice(packing: ParticlePacking) -> Lattice:
    """Lattice of the Laguerre tessellation: exact facet areas, distances and volumes, nothing to calibrate.

    Parameters
    ----------
    packing : ParticlePacking
        Spheres, best without overlaps.

    Returns
    -------
    Lattice

    Raises
    ------
    GeometryError
        If the tessellation fails or a node lies outside its own cell (spheres that overlap too far).

    Notes
    -----
    Every cell is a closed polyhedron whose facets are normal to the branch vectors, so that a linear temperature field
    leaves no node a net heat flow: homogeneous bodies conduct exactly, between walls and periodic.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> two = ParticlePacking([[0.25, 0.5, 0.5], [0.8, 0.5, 0.5]], [0.2, 0.1], Box((1.0, 1.0, 1.0)))
    >>> lattice = laguerre_lattice(two)
    >>> lattice.sections.round(12).tolist(), lattice.wall_sections.sum().round(12)
    ([1.0], np.float64(6.0))
    """
    facets = laguerre_facets(packing)
    outside = (facets.distances <= 0.0).any(axis=1)
    if outside.any():
        i, j = facets.pairs[np.flatnonzero(outside)[0]]
        raise GeometryError(
            f"the radical plane of spheres {i} and {j} does not pass between their centres: a Laguerre lattice needs "
            "spheres that overlap little or not at all"
        )
    if (facets.volumes == 0.0).any():
        raise GeometryError(
            f"sphere {int(np.argmin(facets.volumes))} has no Laguerre cell: it lies within others; remove it"
        )
    return Lattice(
        packing,
        facets.pairs,
        facets.shifts,
        facets.areas,
        facets.distances,
        facets.centroids,
        facets.volumes,
        facets.wall_cells,
        facets.walls,
        facets.wall_areas,
        facets.wall_distances,
        facets.wall_centroids,
    )


def contact_lattice(
    packing: ParticlePacking,
    coordination: float = COORDINATION,
    transmission: float = 1.0,
    *,
    attachment: str = "mirror",
) -> Lattice:
    """Lattice of the closest pairs of a packing, with transmission surfaces in proportion to their size.

    S = C_t pi R_m^2 with R_m the mean radius of the pair; at a wall S = C_t pi R^2 over the distance y of the centre
    (half the link to the mirror image of the particle).

    Parameters
    ----------
    packing : ParticlePacking
        Dense spheres.
    coordination : float
        Mean coordination number Z of the links.
    transmission : float
        Coefficient C_t; see `etc_engine.engines.lattice.calibration.calibrate`.
    attachment : str
        ``mirror``, or ``particle``: particles at a wall take its temperature as a whole, which makes C_t depend on
        the number of particles.

    Returns
    -------
    Lattice

    Raises
    ------
    InputError
        If the coordination number cannot be reached, C_t is not positive or the attachment is unknown.

    Notes
    -----
    A particle stands for its own volume over the density of the packing, so that mass is conserved.

    References
    ----------
    Haddad et al. 2021, eqs. 3, 7, doi:10.1016/j.ijthermalsci.2020.106799.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> row = ParticlePacking([[0.25, 0.5, 0.5], [0.75, 0.5, 0.5]], [0.25, 0.25], Box((1.0, 1.0, 1.0)))
    >>> lattice = contact_lattice(row, coordination=1.0)
    >>> float((lattice.sections / np.pi).round(6)[0]), lattice.walls.tolist()
    (0.0625, [0, 1])
    """
    if packing.dimension != 3:
        raise GeometryError(f"a particle lattice needs a three-dimensional box, found {packing.dimension} dimensions")
    if not (np.isfinite(transmission) and transmission > 0.0):
        raise InputError(f"the transmission coefficient C_t must be positive and finite, found {transmission:g}")
    if attachment not in ATTACHMENTS:
        raise InputError(f"unknown attachment {attachment!r}: expected one of {', '.join(ATTACHMENTS)}")
    network = closest_neighbors(packing, coordination)
    radii = packing.radii
    pairs, walls, nodes = network.pairs, network.walls, network.wall_particles
    branches = _branches(packing, pairs, network.shifts)
    ends = radii[pairs]
    share = ends / ends.sum(axis=1, keepdims=True)
    outward = np.zeros((walls.size, 3))
    to_low = packing.centers[nodes, walls // 2]
    distance = np.where(walls % 2, np.asarray(packing.box.lengths)[walls // 2] - to_low, to_low)
    outward[np.arange(walls.size), walls // 2] = np.where(walls % 2, distance, -distance)
    return Lattice(
        packing,
        pairs,
        network.shifts,
        transmission * np.pi * (0.5 * ends.sum(axis=1)) ** 2,
        share * np.linalg.norm(branches, axis=1)[:, None],
        share[:, :1] * branches,
        packing.measures / packing.density,
        nodes,
        walls,
        transmission * np.pi * radii[nodes] ** 2,
        distance * (SHORT if attachment == "particle" else 1.0),
        outward,
    )


def link_conductances(
    lattice: Lattice,
    conductivity: ArrayLike = 1.0,
    *,
    interface_resistance: float = 0.0,
    phase: Ints | None = None,
) -> Conductances:
    """Conductances of the links: both sides of the transmission surface, and the interface, in series.

    H = S / (h_i / k_i + h_j / k_j + r)

    Parameters
    ----------
    lattice : Lattice
    conductivity : float or array_like, shape (n,) [W/(m K)]
        Of the body at each node, not negative; 0 insulates.
    interface_resistance : float [m2 K/W]
        Resistance r of a unit area of interface (Kapitza), on links between different phases.
    phase : ndarray of int, shape (n,), optional
        Phase of each node; needed where there is an interface resistance.

    Returns
    -------
    Conductances

    Raises
    ------
    InputError
        If a conductivity or the resistance is negative or not finite, or no node conducts.

    Notes
    -----
    Harmonic by the lengths of the two segments, exact for a layer; the harmonic mean of the two conductivities
    (Haddad et al. 2021, eq. 24) is the case of equal radii.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> two = ParticlePacking([[0.25, 0.5, 0.5], [0.8, 0.5, 0.5]], [0.2, 0.2], Box((1.0, 1.0, 1.0)))
    >>> lattice = laguerre_lattice(two)
    >>> link_conductances(lattice, [1.0, 3.0]).links.round(6)
    array([2.727273])
    """
    k = np.asarray(conductivity, dtype=np.float64)
    if k.ndim and k.shape != (lattice.count,):
        raise InputError(f"one conductivity, or one for each of {lattice.count} nodes, is needed; found {k.shape}")
    bad = ~(np.isfinite(k) & (k >= 0.0))
    if bad.any():
        raise InputError(f"conductivities must be finite and not negative, found {k[bad].flat[0]:g}")
    if not (k > 0.0).any():
        raise InputError("no node conducts: at least one conductivity must be positive")
    if not (np.isfinite(interface_resistance) and interface_resistance >= 0.0):
        raise InputError(f"the interface resistance must be finite and not negative, found {interface_resistance:g}")
    k = np.broadcast_to(k, (lattice.count,))
    with np.errstate(divide="ignore"):
        resistance = (lattice.segments / k[lattice.pairs]).sum(axis=1)
        wall_resistance = lattice.wall_segments / k[lattice.wall_particles]
    if interface_resistance > 0.0:
        if phase is None:
            raise InputError("an interface resistance needs the phase of each node")
        resistance = resistance + interface_resistance * (phase[lattice.pairs[:, 0]] != phase[lattice.pairs[:, 1]])
    return Conductances(lattice.sections / resistance, lattice.wall_sections / wall_resistance)


def _branches(packing: ParticlePacking, pairs: Ints, shifts: Ints) -> Floats:
    lengths = np.asarray(packing.box.lengths)
    return packing.centers[pairs[:, 1]] - packing.centers[pairs[:, 0]] + shifts * lengths
