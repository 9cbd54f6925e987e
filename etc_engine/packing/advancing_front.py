"""Advancing-front packing of disks: every new disk is tangent to two objects of the front."""

from __future__ import annotations

import numpy as np
from numba import njit

from etc_engine.arrays import Floats
from etc_engine.box import Box, ball_measure
from etc_engine.errors import InputError, PackingError
from etc_engine.packing.cell_grids import cell_grids, cell_of, cell_range
from etc_engine.packing.particles import ParticlePacking
from etc_engine.packing.radii import RadiusDistribution

RETRIES = 4
"""How often an edge too wide for the radius at hand waits for another radius."""

WALL_DEPTH = 0.8
"""A disk that would cross a wall by less than this times its radius waits; by more, it goes to the wall.

With edges at walls waiting, 0.8 gives the published coordination: 3.86 of 3.88 in 1073 disks, 0.5 gives 3.84."""

CORNERS = np.array([[0, 2], [2, 1], [1, 3], [3, 0]])
"""The pairs of walls that meet, each in the order of an edge of the front."""

OVERLAP = 1e-12
"""Relative overlap that counts as tangency: rounding of the tangent positions stays below it."""


def pack_advancing_front(radii: RadiusDistribution, box: Box, rng: np.random.Generator) -> ParticlePacking:
    """Fill a walled rectangle with disks, each tangent to two objects placed before it.

    Parameters
    ----------
    radii : RadiusDistribution
        Sizes of the disks [m].
    box : Box
        Two-dimensional box with walls on all sides.
    rng : numpy.random.Generator
        Source of the radii and of the corner where the front starts.

    Returns
    -------
    ParticlePacking
        Tangent disks (gaps of about 1e-16 box lengths), in the order in which they were placed.

    Raises
    ------
    InputError
        If the box is periodic or not two-dimensional, or a disk is wider than it.
    PackingError
        If the box is so small that a wall could not be touched.

    Notes
    -----
    The front grows out of a corner drawn at random. An oriented edge (a, b) of the front has its free side on the
    left; the next radius is tried tangent to a and b there. If it hits an object c, the edges (a, c) and (c, b) are
    tried with the same radius; otherwise the disk is placed and brings two new edges. Walls take part as objects. A
    radius is kept until it has found a place, so the sizes are an unbiased sample of the distribution. Each step
    places a disk or uses up an edge, and a disk has a bounded number of edges: the cost is linear in the number of
    disks.

    A young front packs more densely than an old one: its covered fraction falls from 0.85 to 0.82 over the first
    five disks and approaches 0.81 slowly. A front that starts in the middle of the box shows that as a dense centre of
    smaller disks; out of a corner its first disks stand where the wall disturbs the packing anyway. More than five
    mean diameters from a wall the covered fraction is uniform within 1 %, over square shells about the centre.

    Every disk has exactly two tangencies when it is placed, so that the mean coordination is 4 - 2 w / N
    with w wall tangencies. The area fraction is about 0.8 for sizes uniform within a factor of two.

    References
    ----------
    Y. T. Feng, K. Han, D. R. J. Owen, Filling domains with disks: an advancing front approach, Int. J. Numer.
    Meth. Engng 56 (2003) 699-713, doi:10.1002/nme.583.

    Examples
    --------
    >>> from etc_engine.packing.radii import parse_radii
    >>> packing = pack_advancing_front(parse_radii("equal:0.05"), Box((1.0, 1.0)), np.random.default_rng(3))
    >>> bool(packing.density > 0.7)
    True
    """
    sizes = enough_radii(radii, box, rng)
    centers = _fill_box(sizes, box, rng)
    return ParticlePacking(centers, sizes[: len(centers)], box)


def pack_given_disks(sizes: Floats, spare: RadiusDistribution, box: Box, rng: np.random.Generator) -> ParticlePacking:
    """Pack exactly these disks, spread over the whole box, by the advancing front.

    The box is filled with the given disks and others from the distribution in random order; the others are
    then taken out, so that vacancies are spread at random.

    Parameters
    ----------
    sizes : ndarray, shape (n,) [m]
        Radii of the disks.
    spare : RadiusDistribution
        Sizes of the disks that hold the places of the vacancies.
    box : Box
        Two-dimensional box with walls on all sides.
    rng : numpy.random.Generator

    Returns
    -------
    ParticlePacking
        The n disks, in the order in which they were placed.

    Raises
    ------
    PackingError
        If the box, filled to the algorithm's own density, does not hold them all; `reached` is that density.
    """
    spares = enough_radii(spare, box, rng)
    stream = np.concatenate((rng.permutation(sizes), spares))
    filled = _fill_box(stream, box, rng)
    own = float(np.pi * np.sum(stream[: len(filled)] ** 2) / box.volume)
    slots = int(0.99 * len(filled))
    while slots >= sizes.size:
        given = np.zeros(sizes.size + spares.size, dtype=np.bool_)
        given[rng.permutation(slots)[: sizes.size]] = True
        stream = np.empty(given.size)
        stream[given], stream[~given] = rng.permutation(sizes), spares
        centers = _fill_box(stream, box, rng)
        given[len(centers) :] = False
        if given.sum() == sizes.size:
            return ParticlePacking(centers[given[: len(centers)]], stream[given], box)
        slots = int(0.99 * min(slots, len(centers)))
    wanted = float(np.sum(ball_measure(sizes, 2)) / box.volume)
    raise PackingError(
        f"{sizes.size} disks of total density {wanted:.6g} do not fit: the advancing front fills this box to "
        f"about {own:.4g}; ask for less, let the radii grow, or use lubachevsky-stillinger",
        reached=own,
    )


def enough_radii(radii: RadiusDistribution, box: Box, rng: np.random.Generator) -> Floats:
    """More radii than the box can hold: their full areas (volumes) exceed its area (volume)."""
    d = box.dimension
    block = int(1.1 * box.volume / radii.mean_measure(d)) + 10
    sizes = radii.sample(block, rng)
    while True:
        filled = np.cumsum(ball_measure(sizes, d))
        if filled[-1] > box.volume:
            return sizes[: int(np.searchsorted(filled, box.volume)) + 1]
        sizes = np.concatenate((sizes, radii.sample(block, rng)))


def _fill_box(sizes: Floats, box: Box, rng: np.random.Generator) -> Floats:
    """Centres of as many of the disks, in their order, as the front can place."""
    if box.dimension != 2 or any(box.periodic):
        raise InputError(
            f"the advancing front fills 2D boxes with walls, found {box.dimension}D with periodic axes "
            f"{box.periodic_axes!r}: use lubachevsky-stillinger"
        )
    if 2.0 * sizes.max() > min(box.lengths):
        raise InputError(f"a disk of radius {sizes.max():g} is wider than the box {box.lengths}: use smaller radii")
    grids = cell_grids(sizes, box)
    corner = int(rng.integers(4))
    centers: Floats = _fill(sizes, grids, CORNERS[corner : corner + 1], RETRIES, WALL_DEPTH)
    if not _touches_all_walls(centers, sizes, box):  # a small box: start at every wall
        centers = _fill(sizes, grids, CORNERS, RETRIES, WALL_DEPTH)
    if not _touches_all_walls(centers, sizes, box):
        raise PackingError(f"the box {box.lengths} is too small for these radii: not every wall could be touched")
    return centers


def _touches_all_walls(centers: Floats, sizes: Floats, box: Box) -> bool:
    r = sizes[: len(centers), None]
    gaps = np.concatenate((centers - r, np.asarray(box.lengths) - centers - r), axis=1)
    return bool((np.abs(gaps) <= 1e-9 * r).any(axis=0).all())


@njit(cache=True)
def _tangent_to_disks(ax, ay, ra, bx, by, rb, r):  # type: ignore[no-untyped-def]
    """Centre of the disk of radius r tangent to disks a and b, left of a -> b."""
    dx, dy = bx - ax, by - ay
    square = dx * dx + dy * dy
    along = 0.5 * (square + (ra - rb) * (ra + rb + 2.0 * r))  # component along a -> b, times the distance
    across = (ra + r) * (ra + r) * square - along * along
    if across < 0.0:
        return False, 0.0, 0.0
    across = np.sqrt(across)
    return True, ax + (along * dx - across * dy) / square, ay + (along * dy + across * dx) / square


@njit(cache=True)
def _tangent_to_wall(ax, ay, ra, wall, outwards, r, lx, ly):  # type: ignore[no-untyped-def]
    """Centre of the disk of radius r tangent to disk a and a wall, left of disk -> wall (or wall -> disk).

    Walls are numbered 0: x = 0, 1: x = lx, 2: y = 0, 3: y = ly.
    """
    normal = ax if wall < 2 else ay
    level = r if wall % 2 == 0 else (lx if wall == 1 else ly) - r
    square = (ra + r) * (ra + r) - (normal - level) * (normal - level)
    if square < 0.0:
        return False, 0.0, 0.0
    step = np.sqrt(square)
    if (wall in (0, 3)) == outwards:  # the left of a -> wall is -y at wall 0, -x at wall 3
        step = -step
    if wall < 2:
        return True, level, ay + step
    return True, ax + step, level


@njit(cache=True)
def _tangent_position(a, b, r, x, y, sizes, lx, ly):  # type: ignore[no-untyped-def]
    """Centre of the disk of radius r tangent to objects a and b; objects from sizes.size on are walls."""
    wall_a, wall_b = a - sizes.size, b - sizes.size
    if wall_a < 0 and wall_b < 0:
        return _tangent_to_disks(x[a], y[a], sizes[a], x[b], y[b], sizes[b], r)
    if wall_a < 0 or wall_b < 0:
        outwards = wall_a < 0
        disk, wall = (a, wall_b) if outwards else (b, wall_a)
        return _tangent_to_wall(x[disk], y[disk], sizes[disk], wall, outwards, r, lx, ly)
    across, along = min(wall_a, wall_b), max(wall_a, wall_b)
    if across >= 2 or along < 2:  # opposite walls
        return False, 0.0, 0.0
    return True, (r if across == 0 else lx - r), (r if along == 2 else ly - r)


@njit(cache=True)
def _overlap(j, r, cx, cy, x, y, sizes, lx, ly):  # type: ignore[no-untyped-def]
    """Depth by which a disk of radius r at (cx, cy) overlaps object j; negative if it does not."""
    if j < sizes.size:
        return r + sizes[j] - np.sqrt((x[j] - cx) ** 2 + (y[j] - cy) ** 2)
    wall = j - sizes.size
    if wall < 2:
        return r - cx if wall == 0 else cx + r - lx
    return r - cy if wall == 2 else cy + r - ly


@njit(cache=True)
def _all_hits(a, b, r, cx, cy, x, y, sizes, grids, heads, following, hits):  # type: ignore[no-untyped-def]
    """Collect in `hits` the objects, other than a and b, that a disk of radius r at (cx, cy) overlaps."""
    _, cells, first_cell, largest, lengths, periodic = grids
    count = 0
    for wall in range(sizes.size, sizes.size + 4):
        if wall not in (a, b) and _overlap(wall, r, cx, cy, x, y, sizes, lengths[0], lengths[1]) > OVERLAP * r:
            hits[count] = wall
            count += 1
    for k in range(largest.size):
        reach = r + largest[k]
        x0, x1 = cell_range(cx, reach, lengths[0], cells[k, 0], periodic[0])
        y0, y1 = cell_range(cy, reach, lengths[1], cells[k, 1], periodic[1])
        for column in range(x0, x1 + 1):
            for row in range(y0, y1 + 1):
                j = np.int64(heads[first_cell[k] + column * cells[k, 1] + row])
                while j >= 0:
                    touch = (r + sizes[j]) * (1.0 - OVERLAP)
                    if (x[j] - cx) ** 2 + (y[j] - cy) ** 2 < touch * touch and j not in (a, b):
                        if count == hits.size:
                            larger = np.empty(2 * count, dtype=np.int64)
                            for m in range(count):
                                larger[m] = hits[m]
                            hits = larger
                        hits[count] = j
                        count += 1
                    j = np.int64(following[j])
    return hits, count


@njit(cache=True)
def _first_hit(a, b, r, x, y, sizes, lx, ly, hits, count):  # type: ignore[no-untyped-def]
    """Of the objects hit, the first one met by a disk that grows between a and b up to radius r.

    The triangle of a, b and that object is empty: hits make as few edges as a triangulation has.
    """
    low, high = 0.0, r
    for _ in range(40):
        if count == 1:
            break
        radius = 0.5 * (low + high)
        fits, cx, cy = _tangent_position(a, b, radius, x, y, sizes, lx, ly)
        still = 0
        if fits:
            for m in range(count):
                if _overlap(hits[m], radius, cx, cy, x, y, sizes, lx, ly) > OVERLAP * radius:
                    hits[m], hits[still] = hits[still], hits[m]
                    still += 1
        if still > 0:
            count, high = still, radius
        else:
            low = radius
    return hits[0]


@njit(cache=True)
def _append(queue, end, a, b, tries):  # type: ignore[no-untyped-def]
    """The queue, larger if need be, with one more edge at its end."""
    if end == len(queue):
        larger = np.empty((2 * end, 3), dtype=np.int32)
        for k in range(end):
            for m in range(3):
                larger[k, m] = queue[k, m]
        queue = larger
    queue[end, 0], queue[end, 1], queue[end, 2] = a, b, tries
    return queue


@njit(cache=True)
def _fill(sizes, grids, corners, retries, wall_depth):  # type: ignore[no-untyped-def]  # noqa: PLR0915
    """Place disks of the given sizes, in their order, until no edge of the front takes the next one.

    Edges wait in three places: `pending` (last in, first out) holds the edges to be tried at once with the
    radius that hit something, `front` the edges between disks, `wall_front` those that may wait till the
    inside is full, so that no more disks line the walls than must.
    """
    n, placed = sizes.size, 0
    lx, ly = grids.lengths[0], grids.lengths[1]
    x, y = np.empty(n), np.empty(n)
    heads, following = np.empty(grids.first_cell[-1], dtype=np.int32), np.empty(n, dtype=np.int32)
    for c in range(heads.size):
        heads[c] = -1
    for i in range(n):
        following[i] = -1
    none = np.int64(0)  # a plain 0 is a type of its own for numba: another compilation of `_append`
    front, front_begin, front_end = np.empty((2 * n + 16, 3), dtype=np.int32), 0, none
    wall_front, wall_begin, wall_end = np.empty((256, 3), dtype=np.int32), 0, none
    pending, pending_end = np.empty((256, 3), dtype=np.int32), none
    hits = np.empty(64, dtype=np.int64)
    seen = {np.int64(-1)}  # edges made by hits, each tried once

    for corner in range(len(corners)):
        front = _append(front, front_end, n + corners[corner, 0], n + corners[corner, 1], none)
        front_end += 1

    while placed < n:
        if pending_end > 0:
            pending_end -= 1
            a, b, tries = pending[pending_end]
        elif front_begin < front_end:
            a, b, tries = front[front_begin]
            front_begin += 1
        elif wall_begin < wall_end:
            a, b, tries = wall_front[wall_begin]
            wall_begin += 1
        else:
            break
        a, b, r = np.int64(a), np.int64(b), sizes[placed]
        fits, cx, cy = _tangent_position(a, b, r, x, y, sizes, lx, ly)
        if not fits:  # the radius falls through between a and b
            if tries < retries:
                front = _append(front, front_end, a, b, tries + 1)
                front_end += 1
            continue
        hits, count = _all_hits(a, b, r, cx, cy, x, y, sizes, grids, heads, following, hits)
        if count > 0:
            hit = _first_hit(a, b, r, x, y, sizes, lx, ly, hits, count)
            depth = _overlap(hit, r, cx, cy, x, y, sizes, lx, ly)
            for p, q in ((a, hit), (hit, b)):
                edge = np.int64(p) * (n + 4) + q
                if edge in seen:
                    continue
                seen.add(edge)
                if (p >= n or q >= n) and depth < wall_depth * r:
                    wall_front = _append(wall_front, wall_end, p, q, none)
                    wall_end += 1
                else:
                    pending = _append(pending, pending_end, p, q, none)
                    pending_end += 1
            continue
        x[placed], y[placed] = cx, cy
        cell = cell_of(cx, cy, 0.0, grids.level[placed], grids.cells, grids.first_cell, grids.lengths)
        following[placed], heads[cell] = heads[cell], placed
        for p, q in ((a, placed), (placed, b)):
            if p >= n or q >= n:
                wall_front = _append(wall_front, wall_end, p, q, none)
                wall_end += 1
            else:
                front = _append(front, front_end, p, q, none)
                front_end += 1
        placed += 1
    centers = np.empty((placed, 2))
    for i in range(placed):
        centers[i, 0], centers[i, 1] = x[i], y[i]
    return centers
