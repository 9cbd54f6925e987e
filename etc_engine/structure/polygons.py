"""Kernels of the Laguerre cells of disks: polygons by clipping, vertices in clusters, sides in pairs."""

from __future__ import annotations

import numpy as np
from numba import njit

MOST_SIDES = 256
"""Sides a polygon has room for."""


@njit(cache=True)
def sort_into_bins(points, lengths, bins):  # type: ignore[no-untyped-def]
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
    fill, order = np.empty(first.size, dtype=np.int64), np.empty(n, dtype=np.int64)
    for c in range(first.size):
        fill[c] = first[c]
    for p in range(n):
        order[fill[where[p]]] = p
        fill[where[p]] += 1
    return order, first


@njit(cache=True)
def _copy_corner(xy, labels, row, to_xy, to_labels, to_row):  # type: ignore[no-untyped-def]
    """Copy a corner and the labels of its side. An assignment of slices takes numba a second to compile."""
    to_xy[to_row, 0], to_xy[to_row, 1] = xy[row, 0], xy[row, 1]
    to_labels[to_row, 0], to_labels[to_row, 1] = labels[row, 0], labels[row, 1]
    to_labels[to_row, 2] = labels[row, 2]


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
            _copy_corner(xy, labels, k, spare, spare_labels, kept)
            kept += 1
        if (here <= 0.0) != (there <= 0.0):
            part = here / (here - there)
            spare[kept, 0] = xy[k, 0] + part * (xy[following, 0] - xy[k, 0])
            spare[kept, 1] = xy[k, 1] + part * (xy[following, 1] - xy[k, 1])
            side = MOST_SIDES if here <= 0.0 else k
            for m in range(3):
                spare_labels[kept, m] = labels[side, m]
            kept += 1
    for k in range(kept):
        _copy_corner(spare, spare_labels, k, xy, labels, k)
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
def clip_cells(disks, grid):  # type: ignore[no-untyped-def]
    """Polygons of all cells, clipped ring by ring of bins about the centre until no farther disk can cut a corner.

    A disk at distance D cuts a corner v only if D <= |v| + sqrt(|v|^2 - w_i + w_j). Returns where each cell starts,
    its sides (j or -1 - wall, shifts), its corners, and the first cell that vanishes (or -1).
    """
    centers, weights, lengths, periodic = disks
    bins = grid[2]
    n, heaviest = centers.shape[0], weights[0]
    for i in range(1, n):
        heaviest = max(heaviest, weights[i])
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
        count, ring = np.int64(4), np.int64(0)  # plain numbers are types of their own: the kernels compile twice
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
            for k in range(begin):
                _copy_corner(corners, who, k, more_corners, more_who, k)
            who, corners = more_who, more_corners
        for k in range(count):
            _copy_corner(xy, labels, k, corners, who, begin + k)
        starts[i + 1] = begin + count
    return starts, who[: starts[n]].copy(), corners[: starts[n]].copy(), -1


@njit(cache=True)
def cluster(points, lengths, periodic, order, first, bins, near):  # type: ignore[no-untyped-def]
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
def lasting_sides(starts, vertices, corners, near):  # type: ignore[no-untyped-def]
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
def match_sides(starts, who):  # type: ignore[no-untyped-def]
    """Edge of each side and whether the side is its first; the first sides in order; a side without partner, or -1."""
    edges = np.empty(who.shape[0], dtype=np.int64)
    for row in range(edges.size):
        edges[row] = -1
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
