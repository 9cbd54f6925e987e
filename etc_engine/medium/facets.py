"""Links of a 3D packing through its pores: one per Laguerre facet, with or without a solid contact in it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.medium.network import ContactNetwork
from etc_engine.packing.particles import ParticlePacking
from etc_engine.structure.laguerre import laguerre_facets, refuse_hidden


@dataclass(frozen=True, eq=False)
class FacetLinks:
    """Facets between particles, and between particles and walls, with the solid contacts they hold.

    Parameters
    ----------
    packing : ParticlePacking
        The spheres, n of them.
    pairs : ndarray of int, shape (m, 2)
        Spheres (i, j), i <= j.
    shifts : ndarray of int, shape (m, 3)
        The image of j that i faces: its centre lies at ``x_j + shift * lengths``.
    areas : ndarray, shape (m,) [m2]
        Of the facets; of the contact disk where a contact has no facet.
    wall_particles, walls : ndarray of int, shape (w,)
        Sphere and wall of each wall facet; wall ``2 * axis`` lies at 0, ``2 * axis + 1`` at the far end.
    wall_areas, wall_distances : ndarray, shape (w,) [m2], [m]
    contacts : ndarray, shape (m + w,) [m]
        Radius of the contact disk, 0 without one; between spheres first, at walls after them.
    bonds : ndarray, shape (m + w,) [K/W]
        Resistance of the contact itself.
    volumes : ndarray, shape (n,) [m3]
        Of the Laguerre cells.
    """

    packing: ParticlePacking
    pairs: Ints
    shifts: Ints
    areas: Floats
    wall_particles: Ints
    walls: Ints
    wall_areas: Floats
    wall_distances: Floats
    contacts: Floats
    bonds: Floats
    volumes: Floats

    @property
    def count(self) -> int:
        """Number of facets between spheres, m."""
        return int(self.areas.size)

    @property
    def solid_contacts(self) -> int:
        """Facets between spheres that hold a contact."""
        return int(np.count_nonzero(self.contacts[: self.count]))

    @cached_property
    def branches(self) -> Floats:
        """Branch vectors from the centre of i to that of the image of j, shape (m, 3) [m]."""
        centers, lengths = self.packing.centers, np.asarray(self.packing.box.lengths)
        return centers[self.pairs[:, 1]] - centers[self.pairs[:, 0]] + self.shifts * lengths

    @cached_property
    def lengths(self) -> Floats:
        """Distance of the two centres, and of the centre from the wall, shape (m + w,) [m]."""
        return np.concatenate([np.linalg.norm(self.branches, axis=1), self.wall_distances])

    @cached_property
    def smaller_radii(self) -> Floats:
        """Radius of the smaller sphere of each link, shape (m + w,) [m]."""
        radii = self.packing.radii
        return np.concatenate([radii[self.pairs].min(axis=1, initial=np.inf), radii[self.wall_particles]])

    @cached_property
    def overlap_of_caps(self) -> Floats:
        r"""S = sum_j n_j n_j^T (1 - cos^3 psi_j)/2 of every sphere, shape (n, 3, 3).

        The caps have the areas of the facets, seen along the line of centres. If they tiled the sphere, S would be I.
        Walls of all kinds count.
        """
        m, radii = self.count, self.packing.radii
        normals = self.branches / self.lengths[:m, None]
        owner = np.concatenate([self.pairs[:, 0], self.pairs[:, 1], self.wall_particles])
        normals = np.concatenate([normals, -normals, self.wall_normals])
        rho = np.minimum(np.sqrt(np.concatenate([self.areas, self.wall_areas]) / np.pi), self.smaller_radii)
        sine = np.minimum(np.concatenate([rho[:m], rho]) / radii[owner], 1.0)
        weight = 0.5 * (1.0 - (1.0 - sine**2) ** 1.5)
        overlap = np.empty((radii.size, 3, 3))
        for a in range(3):
            for b in range(a + 1):
                overlap[:, a, b] = np.bincount(owner, weight * normals[:, a] * normals[:, b], minlength=radii.size)
                overlap[:, b, a] = overlap[:, a, b]
        return overlap

    @cached_property
    def wall_normals(self) -> Floats:
        """Unit vectors from the sphere to its wall, shape (w, 3)."""
        normals = np.zeros((self.walls.size, 3))
        normals[np.arange(self.walls.size), self.walls // 2] = 2.0 * (self.walls % 2) - 1.0
        return normals


def facet_links(network: ContactNetwork) -> FacetLinks:
    """All links of a packing of spheres: the facets of its Laguerre tessellation, joined with its contacts.

    Parameters
    ----------
    network : ContactNetwork
        Three-dimensional; its contacts become contact disks of radius R sin(alpha), the smaller of the two sides'.
        `no_contacts` gives one without any.

    Returns
    -------
    FacetLinks

    Raises
    ------
    InputError, GeometryError
        If the box is not three-dimensional, or a particle is hidden (see
        `etc_engine.structure.laguerre.refuse_hidden`).

    Notes
    -----
    Cells end at walls of all kinds: a wall facet is half of the facet with the sphere's mirror image.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.rules import bonded_contacts
    >>> one = ParticlePacking([[0.5, 0.5, 0.5]], [0.5], Box((1.0, 1.0, 1.0), (True, True, False)))
    >>> links = facet_links(bonded_contacts(one, 0.1))
    >>> links.count, links.walls.tolist(), links.contacts.round(4).tolist()
    (2, [4, 5], [0.0499, 0.0499, 0.0499, 0.0499])
    """
    packing = network.packing
    facets = laguerre_facets(packing)
    refuse_hidden(facets)
    widths = (packing.radii[network.pairs] * np.sin(network.angles)).min(axis=1, initial=np.inf)
    at, alone = _find(_pair_keys(facets.pairs, facets.shifts), _pair_keys(network.pairs, network.shifts))
    wall_at, wall_alone = _find(
        np.column_stack([facets.wall_cells, facets.walls]), np.column_stack([network.wall_particles, network.walls])
    )
    wall_widths = packing.radii[network.wall_particles] * np.sin(network.wall_angles)
    wall_depths = packing.radii[network.wall_particles] * np.cos(network.wall_angles)
    contacts = [np.zeros(facets.count), widths[alone], np.zeros(facets.walls.size), wall_widths[wall_alone]]
    bonds = [
        np.zeros(facets.count),
        network.resistances[alone],
        np.zeros(facets.walls.size),
        network.wall_resistances[wall_alone],
    ]
    contacts[0][at], contacts[2][wall_at] = widths[~alone], wall_widths[~wall_alone]
    bonds[0][at], bonds[2][wall_at] = network.resistances[~alone], network.wall_resistances[~wall_alone]
    return FacetLinks(
        packing,
        np.concatenate([facets.pairs, network.pairs[alone]]),
        np.concatenate([facets.shifts, network.shifts[alone]]),
        np.concatenate([facets.areas, np.pi * widths[alone] ** 2]),
        np.concatenate([facets.wall_cells, network.wall_particles[wall_alone]]),
        np.concatenate([facets.walls, network.walls[wall_alone]]),
        np.concatenate([facets.wall_areas, np.pi * wall_widths[wall_alone] ** 2]),
        np.concatenate([facets.wall_distances, wall_depths[wall_alone]]),
        np.concatenate(contacts),
        np.concatenate(bonds),
        facets.volumes,
    )


def no_contacts(packing: ParticlePacking) -> ContactNetwork:
    """A network without links."""
    none, pairs = np.zeros(0, dtype=np.int64), np.zeros((0, 2), dtype=np.int64)
    shifts = np.zeros((0, packing.dimension), dtype=np.int64)
    empty = np.zeros(0)
    return ContactNetwork(packing, pairs, shifts, np.zeros((0, 2)), empty, none, none, empty, empty, "none")


def links_network(links: FacetLinks, rule: str) -> ContactNetwork:
    """All facets as links of a network: half-angle 0 where they hold no contact."""
    m, radii = links.count, links.packing.radii
    angles = np.arcsin(np.minimum(links.contacts[:m, None] / radii[links.pairs], 1.0))
    at_walls = np.arcsin(np.minimum(links.contacts[m:] / radii[links.wall_particles], 1.0))
    return ContactNetwork(
        links.packing,
        links.pairs,
        links.shifts,
        angles,
        links.bonds[:m],
        links.wall_particles,
        links.walls,
        at_walls,
        links.bonds[m:],
        rule,
    )


def _pair_keys(pairs: Ints, shifts: Ints) -> Ints:
    """Rows (i, j, shift), with the first non-zero shift of a sphere's own image positive."""
    leading = np.where(shifts[:, 0] != 0, shifts[:, 0], np.where(shifts[:, 1] != 0, shifts[:, 1], shifts[:, 2]))
    turned = (pairs[:, 0] == pairs[:, 1]) & (leading < 0)
    return np.column_stack([pairs, np.where(turned[:, None], -shifts, shifts)])


def _find(rows: Ints, wanted: Ints) -> tuple[Ints, Flags]:
    """Where each wanted row stands among the rows, and which ones stand nowhere; the former without the latter."""
    both = np.concatenate([rows, wanted])
    low = both.min(axis=0, initial=0)
    key = np.zeros(both.shape[0], dtype=np.int64)
    for column, span in zip((both - low).T, (both.max(axis=0, initial=0) - low + 1).tolist(), strict=True):
        key = key * span + column
    known, sought = key[: rows.shape[0]], key[rows.shape[0] :]
    order = np.argsort(known, kind="stable")
    place = np.searchsorted(known[order], sought)
    inside = np.minimum(place, max(known.size - 1, 0))
    alone = (place == known.size) | (known[order][inside] != sought) if known.size else np.ones(sought.size, np.bool_)
    return order[inside[~alone]], alone
