"""Laguerre (power) tessellation of a sphere packing: facets, their areas and centroids, cell volumes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from etc_engine.arrays import Floats, Ints
from etc_engine.errors import GeometryError
from etc_engine.packing.particles import ParticlePacking
from etc_engine.structure.clipping import sort_into_grid, tessellate

# Seeds in a cell of the search grid.
SEEDS_PER_CELL = 3.0

# The cells must fill the box to this part of its volume.
FILLED = 1e-9


@dataclass(frozen=True, eq=False)
class LaguerreFacets:
    """Facets of a power diagram, each between two cells or between a cell and a wall.

    Parameters
    ----------
    pairs : ndarray of int64, shape (m, 2)
        Cells i <= j on either side; i == j only for a cell next to its own periodic image.
    shifts : ndarray of int64, shape (m, 3)
        The image of j across the facet has its seed at ``x_j + shift * lengths``.
    areas : ndarray, shape (m,) [m2]
    centroids : ndarray, shape (m, 3) [m]
        Centroid of the facet as seen from the seed of i.
    distances : ndarray, shape (m, 2) [m]
        Distances of the seeds of i and of j from the facet's plane; negative for a seed outside its own cell.
    volumes : ndarray, shape (n,) [m3]
        Cell volumes, 0 for a seed that owns no cell.
    wall_cells, walls : ndarray of int64, shape (w,)
        Cell and wall of each wall facet; wall ``2 * axis`` lies at 0, ``2 * axis + 1`` at the far end.
    wall_areas : ndarray, shape (w,) [m2]
    wall_centroids : ndarray, shape (w, 3) [m]
        As seen from the seed.
    wall_distances : ndarray, shape (w,) [m]
        Distance of the seed from the wall.
    """

    pairs: Ints
    shifts: Ints
    areas: Floats
    centroids: Floats
    distances: Floats
    volumes: Floats
    wall_cells: Ints
    walls: Ints
    wall_areas: Floats
    wall_centroids: Floats
    wall_distances: Floats

    @property
    def count(self) -> int:
        """Number of facets between cells."""
        return int(self.areas.size)


def laguerre_facets(packing: ParticlePacking) -> LaguerreFacets:
    r"""Power diagram of spheres in a box: x belongs to the cell of the sphere of least power.

    .. math:: \mathrm{pow}_i(x) = |x - x_i|^2 - R_i^2

    Parameters
    ----------
    packing : ParticlePacking
        Spheres in a three-dimensional box, each axis walled (cells end there) or periodic.

    Returns
    -------
    LaguerreFacets

    Raises
    ------
    GeometryError
        If the box is not three-dimensional, or the cells do not fill it (radii so different that a cell lies far
        away from its seed).

    Notes
    -----
    A facet is part of the radical plane of two spheres and normal to their branch vector; between spheres that do not
    overlap it separates them. Cost and memory are linear in the number of spheres (about 15 microseconds and 2 kB
    each); much larger spheres among small ones make every search as wide as they are.
    A seed deep inside another sphere may own no cell.

    References
    ----------
    F. Aurenhammer, Power diagrams: properties, algorithms and applications, SIAM J. Comput. 16 (1987) 78-96,
    doi:10.1137/0216006.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> two = ParticlePacking([[0.25, 0.5, 0.5], [0.8, 0.5, 0.5]], [0.2, 0.1], Box((1.0, 1.0, 1.0)))
    >>> facets = laguerre_facets(two)
    >>> facets.pairs.tolist(), facets.areas.round(12).tolist(), facets.volumes.round(6).tolist()
    ([[0, 1]], [1.0], [0.552273, 0.447727])
    """
    box = packing.box
    if box.dimension != 3:
        raise GeometryError(f"a Laguerre lattice needs a three-dimensional box, found {box.dimension} dimensions")
    lengths = np.asarray(box.lengths)
    spacing = float((box.volume / packing.count) ** (1.0 / 3.0))
    cells = np.maximum(np.floor(lengths / (spacing * SEEDS_PER_CELL ** (1.0 / 3.0))), 1.0).astype(np.int64)
    order, starts = sort_into_grid(packing.centers, lengths, cells)
    widest = 3.0 * float(np.linalg.norm(lengths)) + spacing
    volumes, who, what = tessellate(
        (packing.centers, packing.radii**2),
        (lengths, np.asarray(box.periodic)),
        (order, starts, cells),
        spacing,
        widest,
    )
    filled = float(volumes.sum()) / box.volume
    if abs(filled - 1.0) > FILLED:
        raise GeometryError(
            f"the Laguerre cells fill {filled:.9g} of the box: a cell lies too far from its seed; use radii "
            f"that differ less, or spheres that do not overlap"
        )
    between = who[:, 1] >= 0
    pairs, shifts = who[between, :2], who[between, 2:]
    branches = packing.centers[pairs[:, 1]] - packing.centers[pairs[:, 0]] + shifts * lengths
    near = what[between, 4]
    wall = ~between
    return LaguerreFacets(
        pairs,
        shifts,
        what[between, 0],
        what[between, 1:4],
        np.column_stack((near, np.linalg.norm(branches, axis=1) - near)),
        volumes,
        who[wall, 0],
        -1 - who[wall, 1],
        what[wall, 0],
        what[wall, 1:4],
        what[wall, 4],
    )


def refuse_hidden(facets: LaguerreFacets) -> None:
    """Refuse particles without a cell, and particles whose centre lies outside their own cell.

    Raises
    ------
    GeometryError
        Naming the first particle, and the neighbour or wall that lies beyond its centre.
    """
    empty = np.flatnonzero(facets.volumes <= 0.0)
    if empty.size:
        raise GeometryError(
            f"{empty.size} particle(s) have no Laguerre cell (the first: particle {empty[0]}): they are hidden inside "
            f"larger neighbours; remove them"
        )
    outside = np.argwhere(facets.distances <= 0.0)
    if outside.size:
        row, side = outside[0]
        here, there = facets.pairs[row, side], facets.pairs[row, 1 - side]
        raise GeometryError(
            f"the centre of particle {here} lies outside its own Laguerre cell, beyond its facet with particle "
            f"{there}: they overlap too far; remove one of them or let them overlap less"
        )
    beyond = np.flatnonzero(facets.wall_distances <= 0.0)
    if beyond.size:
        row = beyond[0]
        raise GeometryError(
            f"the centre of particle {facets.wall_cells[row]} lies on or beyond wall {facets.walls[row]}; "
            f"move it inside"
        )
