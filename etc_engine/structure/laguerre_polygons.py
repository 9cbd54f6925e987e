"""Polygons of the Laguerre (power) diagram of spheres: every facet, over vertices that all cells share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.box import Box
from etc_engine.errors import GeometryError
from etc_engine.structure.clipping import (
    MOST_VERTICES,
    SAME_PLANE,
    SMALLEST_FACET,
    clip_facet,
    gather_planes,
    sort_into_grid,
)

MERGED = 1e-6
"""Vertices closer than this part of the mean spacing are one: degenerate vertices of regular packings."""
SEEDS_PER_CELL = 3.0
FILLED = 1e-6
"""The cells must fill the box to this part of its volume."""


@dataclass(frozen=True, eq=False)
class LaguerrePolygons:
    """Facets of a power diagram as polygons over shared vertices.

    Parameters
    ----------
    cells : ndarray of int64, shape (m, 2)
        Cells i <= j on either side; the second is ``-1 - wall`` for a facet on wall ``2 * axis`` (at 0) or
        ``2 * axis + 1`` (at the far end).
    shifts : ndarray of int64, shape (m, 3)
        The image of j across the facet has its centre at ``x_j + shift * lengths``.
    normals : ndarray, shape (m, 3)
        Unit normals from i to j.
    starts : ndarray of int64, shape (m + 1,)
        Corners ``starts[f] : starts[f + 1]`` belong to facet f, counter-clockwise about its normal.
    corners : ndarray of int64, shape (c,)
        Vertex of each corner.
    images : ndarray of int64, shape (c, 3)
        The corner lies at ``vertices[corner] + image * lengths``, beside the centre of i.
    vertices : ndarray, shape (v, 3) [m]
    """

    cells: Ints
    shifts: Ints
    normals: Floats
    starts: Ints
    corners: Ints
    images: Ints
    vertices: Floats

    @property
    def count(self) -> int:
        """Number of facets."""
        return int(self.cells.shape[0])


@njit(cache=True)
def _clip_all(seeds, frame, grid, spacing, widest):  # type: ignore[no-untyped-def]  # noqa: PLR0915
    """Corner points of all facets, every pair once, and the volume of every cell.

    The cell of i is the set n . y <= c over the radical planes of its neighbours; its volume is the sum of
    area * c / 3. Returns volumes, rows (i, j or -1 - wall, shifts, number of corners), normals and corner points.
    """
    centers, weights = seeds
    n = centers.shape[0]
    heaviest = weights.max()
    volumes = np.zeros(n)
    who = np.empty((10 * n + 64, 6), dtype=np.int64)
    normals = np.empty((10 * n + 64, 3))
    points = np.empty((60 * n + 512, 3))
    room = 256
    planes = np.empty((room, 4))
    sources = np.empty((room, 4), dtype=np.int64)
    polygon, spare = np.empty((MOST_VERTICES, 2)), np.empty((MOST_VERTICES, 2))
    tangents = np.empty((2, 3))
    found, placed = 0, 0
    for i in range(n):
        reach, first, first_point = 2.0 * spacing, found, placed
        while True:
            found, placed, volume, farthest = first, first_point, 0.0, 0.0
            count = gather_planes(i, reach, seeds, frame, grid, planes, sources)
            while count == -2:
                room *= 2
                planes = np.empty((room, 4))
                sources = np.empty((room, 4), dtype=np.int64)
                count = gather_planes(i, reach, seeds, frame, grid, planes, sources)
            if count < 0:
                break
            order = np.argsort(planes[:count, 3], kind="mergesort")
            ranked = planes[order]
            for f in range(count):
                corners, square = clip_facet(
                    f, ranked, count, 2.0 * reach, SAME_PLANE * spacing, tangents, polygon, spare
                )
                if corners == 0:
                    continue
                farthest = max(farthest, square)
                area = 0.0
                for k in range(corners):
                    m = (k + 1) % corners
                    area += 0.5 * (polygon[k, 0] * polygon[m, 1] - polygon[m, 0] * polygon[k, 1])
                volume += area * ranked[f, 3] / 3.0
                source = sources[order[f]]
                j, sx, sy, sz = source[0], source[1], source[2], source[3]
                mine = j < 0 or j > i or (j == i and (sx > 0 or (sx == 0 and (sy > 0 or (sy == 0 and sz > 0)))))
                if not mine or area <= SMALLEST_FACET * spacing * spacing:
                    continue
                if found == who.shape[0]:
                    who = np.concatenate((who, np.empty_like(who)))
                    normals = np.concatenate((normals, np.empty_like(normals)))
                if placed + corners > points.shape[0]:
                    points = np.concatenate((points, np.empty_like(points)))
                who[found, 0], who[found, 1:5], who[found, 5] = i, source, corners
                normals[found] = ranked[f, :3]
                for k in range(corners):
                    for axis in range(3):
                        points[placed, axis] = (
                            centers[i, axis]
                            + ranked[f, 3] * ranked[f, axis]
                            + polygon[k, 0] * tangents[0, axis]
                            + polygon[k, 1] * tangents[1, axis]
                        )
                    placed += 1
                found += 1
            # a seed farther than this can cut no vertex of the cell
            needed = np.sqrt(farthest) + np.sqrt(max(farthest - weights[i] + heaviest, 0.0))
            if (farthest > 0.0 and needed <= reach) or reach >= widest or (farthest == 0.0 and count > 0):
                break
            reach = min(max(1.001 * needed if needed < 3.0 * reach else 2.0 * reach, 1.2 * reach), widest)
        volumes[i] = volume
    return volumes, who[:found], normals[:found], points[:placed]


def laguerre_polygons(centers: Floats, radii: Floats, box: Box) -> LaguerrePolygons:
    r"""Facets of the power diagram of spheres, as polygons over shared vertices.

    .. math:: \mathrm{pow}_i(x) = |x - x_i|^2 - R_i^2

    Parameters
    ----------
    centers : ndarray, shape (n, 3) [m]
        Inside the box.
    radii : ndarray, shape (n,) [m]
    box : Box
        Three-dimensional; each axis is walled (cells end there) or periodic.

    Returns
    -------
    LaguerrePolygons

    Raises
    ------
    GeometryError
        If the box is not three-dimensional, a sphere owns no cell, or the cells do not fill the box.

    Notes
    -----
    Vertices closer than 1e-6 of the mean spacing are merged, and edges and facets that collapse are dropped. In
    regular packings more than four cells meet in a vertex. Cost is linear in the number of spheres.

    References
    ----------
    F. Aurenhammer, Power diagrams: properties, algorithms and applications, SIAM J. Comput. 16 (1987) 78-96,
    doi:10.1137/0216006.

    Examples
    --------
    >>> cubic = laguerre_polygons(np.full((1, 3), 0.5), np.full(1, 0.4), Box((1.0, 1.0, 1.0), (True, True, True)))
    >>> cubic.count, len(cubic.vertices), np.diff(cubic.starts).tolist()
    (3, 1, [4, 4, 4])
    """
    if box.dimension != 3:
        raise GeometryError(f"Laguerre polygons need a three-dimensional box, found {box.dimension} dimensions")
    centers, radii = np.ascontiguousarray(centers, dtype=np.float64), np.asarray(radii, dtype=np.float64)
    lengths, periodic = np.asarray(box.lengths), np.asarray(box.periodic)
    spacing = float((box.volume / len(radii)) ** (1.0 / 3.0))
    grid = np.maximum(np.floor(lengths / (spacing * SEEDS_PER_CELL ** (1.0 / 3.0))), 1.0).astype(np.int64)
    order, places = sort_into_grid(centers, lengths, grid)
    widest = 3.0 * float(np.linalg.norm(lengths)) + spacing
    volumes, who, normals, points = _clip_all(
        (centers, radii**2), (lengths, periodic), (order, places, grid), spacing, widest
    )
    if not np.all(volumes > 0.0):
        hidden = int(np.argmin(volumes))
        raise GeometryError(
            f"sphere {hidden} at {centers[hidden].tolist()} has no Laguerre cell: it lies inside its neighbours; "
            f"remove it or make it larger"
        )
    filled = float(volumes.sum()) / box.volume
    if abs(filled - 1.0) > FILLED:
        raise GeometryError(
            f"the Laguerre cells fill {filled:.9g} of the box: a cell lies too far from its sphere; use radii that "
            f"differ less, or spheres that overlap less"
        )
    vertices, numbers, images = _merge(points, lengths, periodic, MERGED * spacing)
    facet = np.repeat(np.arange(len(who)), who[:, 5])
    starts = np.concatenate(([0], np.cumsum(who[:, 5])))
    following = np.arange(1, len(points) + 1)
    following[starts[1:] - 1] = starts[:-1]
    distinct = (numbers != numbers[following]) | (images != images[following]).any(axis=1)
    kept = np.bincount(facet[distinct], minlength=len(who))
    distinct &= (kept >= 3)[facet]
    full = kept >= 3
    return LaguerrePolygons(
        who[full][:, :2],
        who[full][:, 2:5],
        normals[full],
        np.concatenate(([0], np.cumsum(kept[full]))).astype(np.int64),
        numbers[distinct],
        images[distinct],
        vertices,
    )


def _merge(points: Floats, lengths: Floats, periodic: Flags, tolerance: float) -> tuple[Floats, Ints, Ints]:
    """Vertices of the points modulo the box, the vertex of each point, and its image."""
    inside = np.where(periodic, points - np.floor(points / lengths) * lengths, points)
    inside = np.where(periodic & (inside >= lengths), 0.0, inside)
    # a walled axis may repeat far away: no two points meet across it
    around = np.where(periodic, lengths, 4.0 * lengths)
    tree = cKDTree(np.where(periodic, inside, inside + lengths), boxsize=around)
    pairs = tree.query_pairs(tolerance, output_type="ndarray")
    links = csr_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))
    count, numbers = connected_components(links, directed=False)
    first = np.full(count, len(points), dtype=np.int64)
    np.minimum.at(first, numbers, np.arange(len(points)))
    vertices = inside[first]
    images = np.where(periodic, np.rint((points - vertices[numbers]) / lengths), 0.0).astype(np.int64)
    return vertices, numbers.astype(np.int64), images
