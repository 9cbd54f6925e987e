"""Kernel of the power diagram: every facet of every cell, clipped out of its plane.

Seen from its seed, the cell of i is the intersection of half-spaces n . y <= c, one for each neighbour (the radical
plane) and one for each wall. The facet in plane f is the polygon that the other half-spaces leave of that plane. No
topology is kept, so that degenerate (regular) arrangements of seeds are as safe as random ones. With planes in
ascending c, clipping ends at the first plane farther than the farthest vertex.
"""

from __future__ import annotations

import numpy as np
from numba import njit

MOST_VERTICES = 256
"""Vertices a polygon has room for."""

# Polygons below this part of the squared seed spacing are edges or corners, not facets.
SMALLEST_FACET = 1e-13

# Two planes closer than this, relative to the seed spacing, are one.
SAME_PLANE = 1e-12


@njit(cache=True)
def sort_into_grid(centers, lengths, cells):  # type: ignore[no-untyped-def]
    """Counting sort of seeds by cell: sorted row numbers, and where each cell starts in them."""
    n = centers.shape[0]
    cell = np.empty(n, dtype=np.int64)
    starts = np.zeros(cells[0] * cells[1] * cells[2] + 1, dtype=np.int64)
    for i in range(n):
        number = 0
        for axis in range(3):
            at = int(centers[i, axis] / lengths[axis] * cells[axis])
            number = number * cells[axis] + min(max(at, 0), cells[axis] - 1)
        cell[i] = number
        starts[number + 1] += 1
    for c in range(starts.size - 1):
        starts[c + 1] += starts[c]
    fill, order = np.empty(starts.size, dtype=np.int64), np.empty(n, dtype=np.int64)
    for c in range(starts.size):
        fill[c] = starts[c]
    for i in range(n):
        order[fill[cell[i]]] = i
        fill[cell[i]] += 1
    return order, starts


@njit(cache=True)
def gather_planes(i, reach, seeds, frame, grid, planes, sources):  # type: ignore[no-untyped-def]
    """Half-spaces of the walls and of all seeds within reach of seed i.

    Fills ``planes`` (nx, ny, nz, c) and ``sources`` (neighbour and its three shifts; a wall is -1 - number).
    Returns how many there are; -1 if the cell is empty, -2 if there was no room.
    """
    centers, weights = seeds
    lengths, periodic = frame
    order, starts, cells = grid
    count = 0
    low = np.empty(3, dtype=np.int64)
    high = np.empty(3, dtype=np.int64)
    for axis in range(3):
        x, length = centers[i, axis], lengths[axis]
        low[axis] = int(np.floor((x - reach) / length * cells[axis]))
        high[axis] = int(np.floor((x + reach) / length * cells[axis]))
        if not periodic[axis]:
            low[axis] = min(max(low[axis], 0), cells[axis] - 1)
            high[axis] = min(max(high[axis], 0), cells[axis] - 1)
            for end in range(2):
                planes[count, :] = 0.0
                planes[count, axis] = 1.0 if end else -1.0
                planes[count, 3] = length - x if end else x
                sources[count, :] = 0
                sources[count, 0] = -1 - 2 * axis - end
                count += 1
    for cx in range(low[0], high[0] + 1):
        sx = cx // cells[0]
        for cy in range(low[1], high[1] + 1):
            sy = cy // cells[1]
            for cz in range(low[2], high[2] + 1):
                sz = cz // cells[2]
                c = ((cx - sx * cells[0]) * cells[1] + cy - sy * cells[1]) * cells[2] + cz - sz * cells[2]
                for place in range(starts[c], starts[c + 1]):
                    j = order[place]
                    if j == i and sx == 0 and sy == 0 and sz == 0:
                        continue
                    dx = centers[j, 0] - centers[i, 0] + sx * lengths[0]
                    dy = centers[j, 1] - centers[i, 1] + sy * lengths[1]
                    dz = centers[j, 2] - centers[i, 2] + sz * lengths[2]
                    square = dx * dx + dy * dy + dz * dz
                    if square > reach * reach:
                        continue
                    if square == 0.0:  # two seeds in one place: the heavier one, or the first, owns it
                        if weights[j] > weights[i] or (weights[j] == weights[i] and j < i):
                            return -1
                        continue
                    if count == planes.shape[0]:
                        return -2
                    d = np.sqrt(square)
                    planes[count, 0], planes[count, 1], planes[count, 2] = dx / d, dy / d, dz / d
                    planes[count, 3] = 0.5 * (d + (weights[i] - weights[j]) / d)
                    sources[count, 0], sources[count, 1], sources[count, 2], sources[count, 3] = j, sx, sy, sz
                    count += 1
    return count


@njit(cache=True)
def clip_facet(f, planes, count, size, same, tangents, polygon, spare):  # type: ignore[no-untyped-def]  # noqa: PLR0915
    """Clip a square of half-width `size` in plane f by all other planes, in ascending c.

    Fills ``tangents`` with two unit vectors in the plane and ``polygon`` with the vertices in their coordinates,
    seen from the foot of the seed's perpendicular. Returns the number of vertices, 0 for no facet, and the largest
    squared distance of a vertex from the seed.
    """
    nx, ny, nz, offset = planes[f, 0], planes[f, 1], planes[f, 2], planes[f, 3]
    if abs(nx) < 0.6:
        tx, ty, tz = 0.0, nz, -ny  # n x e_x
    else:
        tx, ty, tz = -nz, 0.0, nx  # n x e_y
    norm = np.sqrt(tx * tx + ty * ty + tz * tz)
    tx, ty, tz = tx / norm, ty / norm, tz / norm
    bx, by, bz = ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx
    tangents[0, 0], tangents[0, 1], tangents[0, 2] = tx, ty, tz
    tangents[1, 0], tangents[1, 1], tangents[1, 2] = bx, by, bz
    vertices = 4
    for k in range(4):
        polygon[k, 0] = size if k in (0, 3) else -size
        polygon[k, 1] = size if k < 2 else -size
    farthest = offset * offset + 2.0 * size * size
    for g in range(count):
        c = planes[g, 3]
        if c > 0.0 and c * c > farthest:
            break  # neither this plane nor any later one reaches the polygon
        if g == f:
            continue
        a = planes[g, 0] * tx + planes[g, 1] * ty + planes[g, 2] * tz
        b = planes[g, 0] * bx + planes[g, 1] * by + planes[g, 2] * bz
        t = c - offset * (planes[g, 0] * nx + planes[g, 1] * ny + planes[g, 2] * nz)
        if a * a + b * b < 1e-24:
            if t < -same or (t <= same and g < f):
                return 0, 0.0
            continue
        kept = 0
        cut = False
        last_u, last_v = polygon[vertices - 1, 0], polygon[vertices - 1, 1]
        last = a * last_u + b * last_v - t
        if abs(last) <= same:
            last = 0.0
        for k in range(vertices):
            u, v = polygon[k, 0], polygon[k, 1]
            side = a * u + b * v - t
            if abs(side) <= same:
                side = 0.0  # a line along an edge must not cut it in two
            if (side <= 0.0) != (last <= 0.0):
                part = last / (last - side)
                spare[kept, 0], spare[kept, 1] = last_u + part * (u - last_u), last_v + part * (v - last_v)
                kept += 1
                cut = True
            if side <= 0.0:
                spare[kept, 0], spare[kept, 1] = u, v
                kept += 1
            else:
                cut = True
            last_u, last_v, last = u, v, side
        if not cut:
            continue
        if kept < 3 or kept > MOST_VERTICES - 2:
            return 0, 0.0
        vertices, reach = kept, 0.0
        for k in range(kept):
            u, v = spare[k, 0], spare[k, 1]
            polygon[k, 0], polygon[k, 1] = u, v
            reach = max(reach, u * u + v * v)
        farthest = offset * offset + reach
    return vertices, farthest


@njit(cache=True)
def area_and_centroid(polygon, vertices):  # type: ignore[no-untyped-def]
    """Area of a polygon and its centroid in the coordinates of its plane."""
    area, cu, cv = 0.0, 0.0, 0.0
    u0, v0 = polygon[0, 0], polygon[0, 1]
    for k in range(1, vertices - 1):
        au, av = polygon[k, 0] - u0, polygon[k, 1] - v0
        bu, bv = polygon[k + 1, 0] - u0, polygon[k + 1, 1] - v0
        part = 0.5 * (au * bv - av * bu)
        area += part
        cu += part * (au + bu) / 3.0
        cv += part * (av + bv) / 3.0
    if area == 0.0:
        return 0.0, u0, v0
    return abs(area), u0 + cu / area, v0 + cv / area


@njit(cache=True)
def _sort_planes(planes, sources, count, ranked, from_whom):  # type: ignore[no-untyped-def]
    """Copies in ascending c; ties keep their order."""
    order = rank(planes, 3, count)
    for k in range(count):
        for m in range(4):
            ranked[k, m] = planes[order[k], m]
            from_whom[k, m] = sources[order[k], m]


@njit(cache=True)
def rank(values, column, count):  # type: ignore[no-untyped-def]
    """Rows of ``values`` in ascending order of a column; ties keep their order.

    Merge sort from runs of one upwards, as numba's own argsort, which takes a second to compile.
    """
    order, other = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    for k in range(count):
        order[k] = k
    width = 1
    while width < count:
        for begin in range(0, count, 2 * width):
            middle, end = min(begin + width, count), min(begin + 2 * width, count)
            left, right = begin, middle
            for k in range(begin, end):
                if left < middle and (right >= end or not values[order[right], column] < values[order[left], column]):
                    other[k] = order[left]
                    left += 1
                else:
                    other[k] = order[right]
                    right += 1
        order, other = other, order
        width *= 2
    return order


@njit(cache=True)
def _room(who, what, rows):  # type: ignore[no-untyped-def]
    """The same rows with room for more."""
    more_who, more_what = np.empty((rows, who.shape[1]), dtype=np.int64), np.empty((rows, what.shape[1]))
    for k in range(who.shape[0]):
        for m in range(who.shape[1]):
            more_who[k, m], more_what[k, m] = who[k, m], what[k, m]
    return more_who, more_what


@njit(cache=True)
def tessellate(seeds, frame, grid, spacing, widest):  # type: ignore[no-untyped-def]
    """All facets of all cells.

    Returns cell volumes; facets as rows (i, j or -1 - wall, shifts) and (area, centroid seen from i, distance of the
    plane from i), every pair once.
    """
    centers, weights = seeds
    n = centers.shape[0]
    heaviest = weights[0]
    for i in range(1, n):
        heaviest = max(heaviest, weights[i])
    volumes = np.zeros(n)
    who = np.empty((9 * n + 64, 5), dtype=np.int64)
    what = np.empty((9 * n + 64, 5))
    planes, ranked = np.empty((256, 4)), np.empty((256, 4))
    sources, from_whom = np.empty((256, 4), dtype=np.int64), np.empty((256, 4), dtype=np.int64)
    polygon, spare = np.empty((MOST_VERTICES, 2)), np.empty((MOST_VERTICES, 2))
    tangents = np.empty((2, 3))
    found = 0
    for i in range(n):
        reach, first = 2.0 * spacing, found
        while True:
            found, volume, farthest = first, 0.0, 0.0
            count = gather_planes(i, reach, seeds, frame, grid, planes, sources)
            while count == -2:
                room = 2 * planes.shape[0]
                sources, planes = _room(sources, planes, room)
                from_whom, ranked = _room(from_whom, ranked, room)
                count = gather_planes(i, reach, seeds, frame, grid, planes, sources)
            if count < 0:
                break
            _sort_planes(planes, sources, count, ranked, from_whom)
            for f in range(count):
                corners, square = clip_facet(
                    f, ranked, count, 2.0 * reach, SAME_PLANE * spacing, tangents, polygon, spare
                )
                if corners == 0:
                    continue
                farthest = max(farthest, square)
                area, u, v = area_and_centroid(polygon, corners)
                volume += area * ranked[f, 3] / 3.0
                j, sx, sy, sz = from_whom[f]
                mine = j < 0 or j > i or (j == i and (sx > 0 or (sx == 0 and (sy > 0 or (sy == 0 and sz > 0)))))
                if not mine or area <= SMALLEST_FACET * spacing * spacing:
                    continue
                if found == who.shape[0]:
                    who, what = _room(who, what, 2 * found + 64)
                who[found, 0], who[found, 1], who[found, 2], who[found, 3], who[found, 4] = i, j, sx, sy, sz
                what[found, 0], what[found, 4] = area, ranked[f, 3]
                for axis in range(3):
                    what[found, 1 + axis] = (
                        ranked[f, 3] * ranked[f, axis] + u * tangents[0, axis] + v * tangents[1, axis]
                    )
                found += 1
            # a seed farther than this can cut no vertex of the cell
            needed = np.sqrt(farthest) + np.sqrt(max(farthest - weights[i] + heaviest, 0.0))
            if (farthest > 0.0 and needed <= reach) or reach >= widest or (farthest == 0.0 and count > 0):
                break
            reach = min(max(1.001 * needed if needed < 3.0 * reach else 2.0 * reach, 1.2 * reach), widest)
        volumes[i] = volume
    return volumes, who[:found], what[:found]
