r"""Laguerre (power) cells of disks: who is a neighbour of whom, and across which piece of their radical line.

A point belongs to the disk of least power,

.. math:: \mathrm{pow}_i(x) = |x - x_i|^2 - R_i^2 ,

so that a cell is a convex polygon whose sides lie on radical lines. Across a periodic border the neighbours are
images. A wall is the radical line of a disk and its own mirror image, so walls are sides like the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from etc_engine.arrays import Flags, Floats, Ints, read_only
from etc_engine.box import Box
from etc_engine.errors import GeometryError
from etc_engine.structure.polygons import clip_cells, cluster, lasting_sides, match_sides, sort_into_bins

SAME_VERTEX = 1e-8
"""Vertices closer than this, in units of the mean spacing, are one; sides shorter than it vanish."""


@dataclass(frozen=True, eq=False)
class LaguerreCells:
    """Laguerre cells of n disks: s sides, two for each of the m edges between disks and one for each edge at a wall.

    Parameters
    ----------
    starts : ndarray of int64, shape (n + 1,)
        The sides of cell i are the rows ``starts[i]`` to ``starts[i + 1]``, counter-clockwise.
    edges : ndarray of int64, shape (s,)
        Edge that the side belongs to.
    forward : ndarray of bool, shape (s,)
        Whether the side looks at its edge from ``cells[edge, 0]``.
    vertices : ndarray of int64, shape (s,)
        Vertex where the side begins; the next side of the cell begins where it ends.
    corners : ndarray, shape (s, 2) [m]
        That vertex as seen from the centre of the disk.
    vertex_count : int
        Number of different vertices; images of a vertex are one vertex.
    cells : ndarray of int64, shape (m, 2)
        The cells i and j on both sides of an edge; at a wall j is -1 - wall, where wall ``2 * axis`` lies at 0 and
        ``2 * axis + 1`` at the far end.
    shifts : ndarray of int64, shape (m, 2)
        The image of j across the edge has its centre at ``x_j + shift * lengths``.
    normals : ndarray, shape (m, 2)
        Unit vectors from i to the image of j (or to the wall).
    gaps : ndarray, shape (m,) [m]
        Surface gap, negative where disks overlap; at a wall the gap to the mirror image.
    distances : ndarray, shape (m, 2) [m]
        Distances h of both centres from the radical line.
    ends : ndarray, shape (m, 2) [m]
        Where the edge begins and ends along the tangent (-n_y, n_x), measured from the foot of the centres.
    """

    starts: Ints
    edges: Ints
    forward: Flags
    vertices: Ints
    corners: Floats
    vertex_count: int
    cells: Ints
    shifts: Ints
    normals: Floats
    gaps: Floats
    distances: Floats
    ends: Floats

    @property
    def edge_count(self) -> int:
        """Number of edges, those at walls included."""
        return int(self.gaps.size)

    @property
    def at_wall(self) -> Flags:
        """Whether an edge lies on a wall, shape (m,)."""
        return np.asarray(self.cells[:, 1] < 0)


def laguerre_cells(centers: Floats, radii: Floats, box: Box) -> LaguerreCells:
    """Laguerre cells of disks in a rectangular box, each axis walled or periodic.

    Parameters
    ----------
    centers : ndarray, shape (n, 2) [m]
        Inside the box.
    radii : ndarray, shape (n,) [m]
    box : Box
        Two-dimensional.

    Returns
    -------
    LaguerreCells

    Raises
    ------
    GeometryError
        If the box is not two-dimensional, two centres coincide, a disk owns no cell, or a centre lies outside its
        own cell. The message names the first such disk.

    Notes
    -----
    Cost and memory are linear in the number of disks (about 2 microseconds an edge). A wall cuts a cell; it never
    hides one. Vertices where more than three cells meet are merged, so regular arrangements are safe.

    References
    ----------
    F. Aurenhammer, Power diagrams: properties, algorithms and applications, SIAM J. Comput. 16 (1987) 78-96,
    doi:10.1137/0216006.

    Examples
    --------
    >>> two = laguerre_cells(np.array([[0.25, 0.5], [0.75, 0.5]]), np.array([0.25, 0.25]), Box((1.0, 1.0)))
    >>> two.cells.tolist()
    [[0, -3], [0, 1], [0, -4], [0, -1], [1, -3], [1, -2], [1, -4]]
    >>> two.distances[1].tolist(), two.ends[1].tolist()
    ([0.25, 0.25], [-0.5, 0.5])
    """
    if box.dimension != 2:
        raise GeometryError(f"Laguerre cells of disks need a two-dimensional box, found {box.dimension} axes")
    centers, radii = read_only(centers), read_only(radii)
    lengths, periodic = np.asarray(box.lengths), np.asarray(box.periodic)
    spacing = float(np.sqrt(box.volume / radii.size))
    bins = np.maximum(np.floor(lengths / (1.2 * spacing)), 1.0).astype(np.int64)
    order, first = sort_into_bins(centers, lengths, bins)
    starts, who, corners, failed = clip_cells((centers, radii**2, lengths, periodic), (order, first, bins))
    if failed >= 0:
        _refuse_lost(int(failed), centers, radii, box)
    near = SAME_VERTEX * spacing
    owners = np.repeat(np.arange(radii.size), np.diff(starts))
    vertices, corners = _merge_vertices(centers[owners] + corners, corners, box, near)
    keep = lasting_sides(starts, vertices, corners, near)
    starts = np.concatenate(([0], np.cumsum(np.bincount(owners[keep], minlength=radii.size))))
    thin = np.diff(starts) < 3
    if thin.any():
        _refuse_lost(int(np.flatnonzero(thin)[0]), centers, radii, box)
    who, vertices, corners = who[keep], vertices[keep], corners[keep]
    vertices, vertex_count = _renumber(vertices)
    edges, forward, seen, unmatched = match_sides(starts, who)
    if unmatched >= 0:
        i = int(np.searchsorted(starts, unmatched, side="right")) - 1
        raise GeometryError(
            f"the Laguerre cells of particles {i} and {int(who[unmatched, 0])} disagree about their common side: "
            f"coordinates need more digits than they have; scale the box to about 1 and round the centres"
        )
    ends = np.roll(np.arange(edges.size), -1)
    ends[starts[1:] - 1] = starts[:-1]
    normals, gaps, distances = _edge_geometry(centers, radii, box, owners[keep][seen], who[seen])
    tangents = np.column_stack((-normals[:, 1], normals[:, 0]))
    span = [np.einsum("ea,ea->e", corners[rows], tangents) for rows in (seen, ends[seen])]
    cells = np.column_stack((owners[keep][seen], who[seen, 0]))
    _refuse_outside(cells, distances, centers, radii)
    return LaguerreCells(
        starts,
        edges,
        forward,
        vertices,
        corners,
        vertex_count,
        cells,
        who[seen, 1:],
        normals,
        gaps,
        distances,
        np.column_stack(span),
    )


def _refuse_lost(i: int, centers: Floats, radii: Floats, box: Box) -> None:
    """Raise the reason why particle i owns no cell."""
    apart = np.linalg.norm(box.minimum_image(centers - centers[i]), axis=1)
    apart[i] = np.inf
    j = int(np.argmin(apart - radii))
    if apart[j] == 0.0:
        raise GeometryError(f"particles {min(i, j)} and {max(i, j)} have the same centre: remove one of them")
    raise GeometryError(
        f"particle {i} (radius {radii[i]:.6g}) has no Laguerre cell: it is hidden by its neighbours, of which "
        f"particle {j} (radius {radii[j]:.6g}) is {apart[j]:.6g} away; remove particle {i}"
    )


def _refuse_outside(cells: Ints, distances: Floats, centers: Floats, radii: Floats) -> None:
    """Raise for the first disk whose centre lies outside its own cell."""
    wrong = distances <= 1e-12 * radii[cells[:, :1]]
    if wrong.any():
        row, side = (int(v[0]) for v in np.nonzero(wrong))
        i, j = int(cells[row, side]), int(cells[row, 1 - side])
        if min(i, j) < 0:
            raise GeometryError(
                f"the centre of particle {max(i, j)} lies on a wall ({centers[max(i, j)]}): move it into the box"
            )
        raise GeometryError(
            f"the centre of particle {i} (radius {radii[i]:.6g}) lies outside its own Laguerre cell, beyond the "
            f"radical line with particle {j} (radius {radii[j]:.6g}): they overlap too far; remove one of them"
        )


def _edge_geometry(centers: Floats, radii: Floats, box: Box, i: Ints, who: Ints) -> tuple[Floats, Floats, Floats]:
    """Unit normals, gaps and distances h of the centres from the radical line, without cancellation.

    h_i = R_i + g (g + 2 R_j) / (2 d), with the gap g = d - R_i - R_j.
    """
    wall = who[:, 0] < 0
    j = np.where(wall, i, who[:, 0])
    branches = centers[j] - centers[i] + who[:, 1:] * np.asarray(box.lengths)
    axis, end = np.divmod(-1 - who[wall, 0], 2)
    rows = np.flatnonzero(wall)
    beyond = np.where(end == 1, np.asarray(box.lengths)[axis], 0.0) - centers[i[wall], axis]
    branches[rows, axis] = 2.0 * beyond
    apart = np.linalg.norm(branches, axis=1)
    flat = rows[apart[rows] == 0.0]  # a centre on a wall is refused by the caller
    branches[flat, axis[apart[rows] == 0.0]] = 1.0
    apart[flat] = 1.0
    normals = branches / apart[:, None]
    apart[flat] = 0.0
    gaps = apart - radii[i] - radii[j]
    half = 0.5 * gaps / np.where(apart > 0.0, apart, 1.0)
    distances = np.column_stack((radii[i] + half * (gaps + 2.0 * radii[j]), radii[j] + half * (gaps + 2.0 * radii[i])))
    distances[flat] = 0.0
    return normals, gaps, distances


def _merge_vertices(points: Floats, corners: Floats, box: Box, near: float) -> tuple[Ints, Floats]:
    """Number of the vertex at each corner, and the corners moved to where that vertex is."""
    lengths = np.asarray(box.lengths)
    wrapped = read_only(box.wrap(points))
    bins = np.maximum(np.floor(lengths * np.sqrt(0.5 * len(points) / box.volume)), 1.0).astype(np.int64)
    bins = np.minimum(bins, np.maximum(np.floor(lengths / (4.0 * near)), 1.0).astype(np.int64))
    order, first = sort_into_bins(wrapped, lengths, bins)
    roots = cluster(wrapped, lengths, np.asarray(box.periodic), order, first, bins, near)
    return roots, corners + box.minimum_image(wrapped[roots] - wrapped)


def _renumber(vertices: Ints) -> tuple[Ints, int]:
    """The same numbers without holes, in order, and how many there are."""
    present = np.zeros(int(vertices.max()) + 1, dtype=np.bool_)
    present[vertices] = True
    return (np.cumsum(present) - 1)[vertices], int(present.sum())
