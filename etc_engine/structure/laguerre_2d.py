r"""Laguerre (power) cells of disks: who is a neighbour of whom, and across which piece of their radical line.

A point belongs to the disk of least power,

.. math:: \mathrm{pow}_i(x) = |x - x_i|^2 - R_i^2 ,

so that a cell is a convex polygon whose sides lie on radical lines. Across a periodic border the neighbours are
images. A wall is the radical line of a disk and its own mirror image, so walls are sides like the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etc_engine.box import Box
from etc_engine.errors import GeometryError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SAME_VERTEX = 1e-8
"""Vertices closer than this, in units of the mean spacing, are one; sides shorter than it vanish."""

MOST_SIDES = 256
"""Sides a polygon has room for."""


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
    forward: NDArray[np.bool_]
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
    def at_wall(self) -> NDArray[np.bool_]:
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
    centers, radii = np.ascontiguousarray(centers, np.float64), np.ascontiguousarray(radii, np.float64)
    lengths, periodic = np.asarray(box.lengths), np.asarray(box.periodic)
    spacing = float(np.sqrt(box.volume / radii.size))
    bins = np.maximum(np.floor(lengths / (1.2 * spacing)), 1.0).astype(np.int64)
    order, first = _sort_into_bins(centers, lengths, bins)
    starts, who, corners, failed = _clip_cells((centers, radii**2, lengths, periodic), (order, first, bins))
    if failed >= 0:
        _refuse_lost(int(failed), centers, radii, box)
    near = SAME_VERTEX * spacing
    owners = np.repeat(np.arange(radii.size), np.diff(starts))
    vertices, corners = _merge_vertices(centers[owners] + corners, corners, box, near)
    keep = _lasting_sides(starts, vertices, corners, near)
    starts = np.concatenate(([0], np.cumsum(np.bincount(owners[keep], minlength=radii.size))))
    thin = np.diff(starts) < 3
    if thin.any():
        _refuse_lost(int(np.flatnonzero(thin)[0]), centers, radii, box)
    who, vertices, corners = who[keep], vertices[keep], corners[keep]
    vertices, vertex_count = _renumber(vertices)
    edges, forward, seen, unmatched = _match_sides(starts, who)
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
        f"particle {i} (radius {radii[i]:.6g}) owns no Laguerre cell: it is hidden by its neighbours, of which "
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
    wrapped = box.wrap(points)
    bins = np.maximum(np.floor(lengths * np.sqrt(0.5 * len(points) / box.volume)), 1.0).astype(np.int64)
    bins = np.minimum(bins, np.maximum(np.floor(lengths / (4.0 * near)), 1.0).astype(np.int64))
    order, first = _sort_into_bins(wrapped, lengths, bins)
    roots = _cluster(wrapped, lengths, np.asarray(box.periodic), order, first, bins, near)
    return roots, corners + box.minimum_image(wrapped[roots] - wrapped)


def _renumber(vertices: Ints) -> tuple[Ints, int]:
    """The same numbers without holes, in order, and how many there are."""
    present = np.zeros(int(vertices.max()) + 1, dtype=np.bool_)
    present[vertices] = True
    return (np.cumsum(present) - 1)[vertices], int(present.sum())


@njit(cache=True)
def _sort_into_bins(points, lengths, bins):  # type: ignore[no-untyped-def]
    """Counting sort of points by bin: sorted row numbers, and where each bin starts in them."""
    n = points.shape[0]
    where = np.empty(n, dtype=np.int64)
    first = np.zeros(bins[0] * bins[1] + 1, dtype=np.int64)
    for p in range(n):
        cx = min(max(int(points[p, 0] / lengths[0] * bins[0]), 0), bins[0] - 1)
        cy = min(max(int(points[p, 1] / lengths[1] * bins[1]), 0), bins[1] - 1)
        where[p] = cx * bins[1] + cy
        first[where[p] + 1] += 1
    for c in range(first.size - 1):
        first[c + 1] += first[c]
    fill = first[:-1].copy()
    order = np.empty(n, dtype=np.int64)
    for p in range(n):
        order[fill[where[p]]] = p
        fill[where[p]] += 1
    return order, first


@njit(cache=True)
def _clip_polygon(xy, labels, count, nx, ny, c, spare, spare_labels):  # type: ignore[no-untyped-def]
    """Keep the part n . p <= c of a convex polygon; row k of the labels belongs to the side from corner k to k + 1.

    The new side gets the labels in row ``MOST_SIDES``. Returns the number of corners left.
    """
    outside = False
    for k in range(count):
        if nx * xy[k, 0] + ny * xy[k, 1] > c:
            outside = True
            break
    if not outside:
        return count
    kept = 0
    for k in range(count):
        following = k + 1 if k + 1 < count else 0
        here = nx * xy[k, 0] + ny * xy[k, 1] - c
        there = nx * xy[following, 0] + ny * xy[following, 1] - c
        if here <= 0.0:
            spare[kept, :] = xy[k, :]
            spare_labels[kept, :] = labels[k, :]
            kept += 1
        if (here <= 0.0) != (there <= 0.0):
            part = here / (here - there)
            spare[kept, 0] = xy[k, 0] + part * (xy[following, 0] - xy[k, 0])
            spare[kept, 1] = xy[k, 1] + part * (xy[following, 1] - xy[k, 1])
            spare_labels[kept, :] = labels[MOST_SIDES, :] if here <= 0.0 else labels[k, :]
            kept += 1
    for k in range(kept):
        xy[k, :] = spare[k, :]
        labels[k, :] = spare_labels[k, :]
    return kept


@njit(cache=True)
def _rectangle(i, centers, lengths, periodic, xy, labels):  # type: ignore[no-untyped-def]
    """First polygon of cell i: walls, and on periodic axes the radical lines with its own images."""
    for wall in range(4):
        axis, end = wall // 2, wall % 2
        k = (3, 1, 0, 2)[wall]  # corners and sides run counter-clockwise from the lower left corner and the lower side
        if periodic[axis]:
            at = (end - 0.5) * lengths[axis]
            labels[k, 0], labels[k, 1], labels[k, 2] = i, 0, 0
            labels[k, 1 + axis] = 2 * end - 1
        else:
            at = (lengths[axis] if end else 0.0) - centers[i, axis]
            labels[k, 0], labels[k, 1], labels[k, 2] = -1 - wall, 0, 0
        xy[k, axis] = xy[(k + 1) % 4, axis] = at


@njit(cache=True)
def _clip_ring(i, ring, home, count, disks, grid, polygon):  # type: ignore[no-untyped-def]
    """Clip the polygon of cell i by the disks of one square ring of bins; -1 if a disk has the same centre."""
    centers, weights, lengths, periodic = disks
    order, first, bins = grid
    xy, labels, spare, spare_labels = polygon
    for cx in range(home[0] - ring, home[0] + ring + 1):
        sx = cx // bins[0]
        if sx != 0 and not periodic[0]:
            continue
        step = 1 if abs(cx - home[0]) == ring or ring == 0 else 2 * ring
        for cy in range(home[1] - ring, home[1] + ring + 1, step):
            sy = cy // bins[1]
            if sy != 0 and not periodic[1]:
                continue
            c = (cx - sx * bins[0]) * bins[1] + cy - sy * bins[1]
            for place in range(first[c], first[c + 1]):
                j = order[place]
                if j == i:
                    continue
                dx = centers[j, 0] - centers[i, 0] + sx * lengths[0]
                dy = centers[j, 1] - centers[i, 1] + sy * lengths[1]
                square = dx * dx + dy * dy
                if square == 0.0:
                    return -1
                labels[MOST_SIDES, 0], labels[MOST_SIDES, 1], labels[MOST_SIDES, 2] = j, sx, sy
                offset = 0.5 * (square + weights[i] - weights[j])
                count = _clip_polygon(xy, labels, count, dx, dy, offset, spare, spare_labels)
                if count >= MOST_SIDES - 2:
                    return -1
    return count


@njit(cache=True)
def _covered(i, ring, home, centers, lengths, periodic, bins):  # type: ignore[no-untyped-def]
    """Distance from centre i within which the rings so far hold every disk."""
    covered = np.inf
    for axis in range(2):
        if periodic[axis] or home[axis] - ring > 0:
            covered = min(covered, centers[i, axis] - (home[axis] - ring) * lengths[axis] / bins[axis])
        if periodic[axis] or home[axis] + ring < bins[axis] - 1:
            covered = min(covered, (home[axis] + ring + 1) * lengths[axis] / bins[axis] - centers[i, axis])
    return covered


@njit(cache=True)
def _clip_cells(disks, grid):  # type: ignore[no-untyped-def]
    """Polygons of all cells, clipped ring by ring of bins about the centre until no farther disk can cut a corner.

    A disk at distance D cuts a corner v only if D <= |v| + sqrt(|v|^2 - w_i + w_j). Returns where each cell starts,
    its sides (j or -1 - wall, shifts), its corners, and the first cell that vanishes (or -1).
    """
    centers, weights, lengths, periodic = disks
    bins = grid[2]
    n, heaviest = centers.shape[0], weights.max()
    starts = np.zeros(n + 1, dtype=np.int64)
    who = np.empty((8 * n + MOST_SIDES, 3), dtype=np.int64)
    corners = np.empty((8 * n + MOST_SIDES, 2))
    xy, spare = np.empty((MOST_SIDES + 2, 2)), np.empty((MOST_SIDES + 2, 2))
    labels, spare_labels = np.zeros((MOST_SIDES + 2, 3), np.int64), np.zeros((MOST_SIDES + 2, 3), np.int64)
    polygon = (xy, labels, spare, spare_labels)
    home = np.empty(2, dtype=np.int64)
    for i in range(n):
        _rectangle(i, centers, lengths, periodic, xy, labels)
        for axis in range(2):
            home[axis] = min(max(int(centers[i, axis] / lengths[axis] * bins[axis]), 0), bins[axis] - 1)
        count, ring = 4, 0
        while True:
            count = _clip_ring(i, ring, home, count, disks, grid, polygon)
            if count < 3:
                return starts, who[:0], corners[:0], i
            farthest = 0.0
            for k in range(count):
                farthest = max(farthest, xy[k, 0] ** 2 + xy[k, 1] ** 2)
            reach = np.sqrt(farthest) + np.sqrt(max(farthest - weights[i] + heaviest, 0.0))
            if _covered(i, ring, home, centers, lengths, periodic, bins) >= reach:
                break
            ring += 1
        begin = starts[i]
        if begin + count > who.shape[0]:
            more_who = np.empty((2 * who.shape[0], 3), dtype=np.int64)
            more_corners = np.empty((2 * who.shape[0], 2))
            more_who[:begin], more_corners[:begin] = who[:begin], corners[:begin]
            who, corners = more_who, more_corners
        for k in range(count):
            who[begin + k, :] = labels[k, :]
            corners[begin + k, :] = xy[k, :]
        starts[i + 1] = begin + count
    return starts, who[: starts[n]].copy(), corners[: starts[n]].copy(), -1


@njit(cache=True)
def _cluster(points, lengths, periodic, order, first, bins, near):  # type: ignore[no-untyped-def]
    """First point of the cluster of each point: points closer than ``near`` are joined (union by least row)."""
    roots = np.arange(points.shape[0])
    for p in range(points.shape[0]):
        x0 = int(np.floor((points[p, 0] - near) / lengths[0] * bins[0]))
        x1 = int(np.floor((points[p, 0] + near) / lengths[0] * bins[0]))
        y0 = int(np.floor((points[p, 1] - near) / lengths[1] * bins[1]))
        y1 = int(np.floor((points[p, 1] + near) / lengths[1] * bins[1]))
        for cx in range(x0, x1 + 1):
            bx = cx % bins[0] if periodic[0] else min(max(cx, 0), bins[0] - 1)
            for cy in range(y0, y1 + 1):
                by = cy % bins[1] if periodic[1] else min(max(cy, 0), bins[1] - 1)
                for place in range(first[bx * bins[1] + by], first[bx * bins[1] + by + 1]):
                    q = order[place]
                    if q >= p:
                        continue
                    dx, dy = points[q, 0] - points[p, 0], points[q, 1] - points[p, 1]
                    if periodic[0]:
                        dx -= lengths[0] * np.rint(dx / lengths[0])
                    if periodic[1]:
                        dy -= lengths[1] * np.rint(dy / lengths[1])
                    if dx * dx + dy * dy > near * near:
                        continue
                    a, b = p, q
                    while roots[a] != a:
                        a = roots[a]
                    while roots[b] != b:
                        b = roots[b]
                    roots[max(a, b)] = min(a, b)
    for p in range(points.shape[0]):
        while roots[roots[p]] != roots[p]:
            roots[p] = roots[roots[p]]
    return roots


@njit(cache=True)
def _lasting_sides(starts, vertices, corners, near):  # type: ignore[no-untyped-def]
    """Sides that do not vanish when their two corners are one vertex (two images of one vertex are apart)."""
    keep = np.ones(vertices.size, dtype=np.bool_)
    for i in range(starts.size - 1):
        for row in range(starts[i], starts[i + 1]):
            following = row + 1 if row + 1 < starts[i + 1] else starts[i]
            if vertices[row] == vertices[following]:
                dx, dy = corners[row, 0] - corners[following, 0], corners[row, 1] - corners[following, 1]
                keep[row] = dx * dx + dy * dy > near * near
    return keep


@njit(cache=True)
def _match_sides(starts, who):  # type: ignore[no-untyped-def]
    """Edge of each side and whether the side is its first; the first sides in order; a side without partner, or -1."""
    edges = np.full(who.shape[0], -1, dtype=np.int64)
    forward = np.ones(who.shape[0], dtype=np.bool_)
    seen = np.empty(who.shape[0], dtype=np.int64)
    count = 0
    for i in range(starts.size - 1):
        for row in range(starts[i], starts[i + 1]):
            j, sx, sy = who[row]
            if edges[row] >= 0:
                continue
            partner = row
            if j >= 0:
                partner = -1
                for other in range(starts[j], starts[j + 1]):
                    if who[other, 0] == i and who[other, 1] == -sx and who[other, 2] == -sy:
                        partner = other
                if partner < 0:
                    return edges, forward, seen[:count], row
            forward[partner] = partner == row
            edges[row] = edges[partner] = count
            seen[count] = row
            count += 1
    return edges, forward, seen[:count].copy(), -1
