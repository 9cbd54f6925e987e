"""Exact area of a union of disks, volume of a union of spheres, and the solid fraction."""

from __future__ import annotations

import numpy as np
from numba import njit

from etc_engine.arrays import Floats, Ints
from etc_engine.errors import InputError
from etc_engine.packing.neighbors import neighbor_pairs
from etc_engine.packing.particles import ParticlePacking
from etc_engine.structure.cut_sphere import cut_sphere_volume


def union_area(packing: ParticlePacking) -> float:
    r"""Exact area of the union of the disks inside the box.

    The union is divided by the radical axes of overlapping disks; with the walls they cut disk i down to a
    convex region whose boundary consists of arcs and chords, and Green's theorem about its centre gives

    .. math:: A = \sum_i \tfrac12 \Big( R_i^2 \sum_{arcs} \Delta\theta + \sum_{chords} c\,l \Big)

    with l the length of a chord's free part and c its signed distance from the centre.

    Parameters
    ----------
    packing : ParticlePacking
        Disks in a 2D box, walled or periodic, overlapping or not, of any sizes.

    Returns
    -------
    float
        Area [m2], exact to rounding; overlaps count once, parts behind walls do not count.

    Raises
    ------
    InputError
        If the packing is not two-dimensional.

    Examples
    --------
    A disk in a corner of which a quarter lies inside the box:

    >>> from etc_engine.box import Box
    >>> round(union_area(ParticlePacking([[0.0, 0.0]], [0.5], Box((1.0, 1.0)))), 6)
    0.19635
    """
    if packing.dimension != 2:
        raise InputError(f"union_area is for disks in a 2D box, found {packing.dimension}D: use union_volume")
    return float(_sum_of_cut_disks(packing.radii, *particle_cuts(packing)))


def union_volume(packing: ParticlePacking) -> float:
    r"""Volume of the union of the spheres inside the box.

    As :func:`union_area` in three dimensions: radical planes and walls cut sphere i down to a convex region, whose
    volume :func:`etc_engine.structure.cut_sphere.cut_sphere_volume` has in closed form.

    Parameters
    ----------
    packing : ParticlePacking
        Spheres in a 3D box, walled or periodic, overlapping or not, of any sizes.

    Returns
    -------
    float
        Volume [m3], exact to rounding; overlaps count once, parts behind walls do not count.

    Raises
    ------
    InputError
        If the packing is not three-dimensional.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> round(union_volume(ParticlePacking([[0.0, 0.0, 0.0]], [0.5], Box((1.0, 1.0, 1.0)))), 9)
    0.065449847
    """
    if packing.dimension != 3:
        raise InputError(f"union_volume is for spheres in a 3D box, found {packing.dimension}D: use union_area")
    return float(_sum_of_cut_spheres(packing.radii, *particle_cuts(packing)))


def solid_fraction(packing: ParticlePacking) -> float:
    """Area (volume) of the union of the particles inside the box over that of the box."""
    union = union_area(packing) if packing.dimension == 2 else union_volume(packing)
    return union / packing.box.volume


def particle_cuts(packing: ParticlePacking) -> tuple[Ints, Floats, Floats]:
    """Half-spaces ``normal . p <= cut`` about the centres: the walls, and the radical planes of overlapping particles.

    Parameters
    ----------
    packing : ParticlePacking

    Returns
    -------
    starts : ndarray of int, shape (n + 1,)
        Rows ``starts[i]:starts[i + 1]`` are those of particle i.
    normals : ndarray, shape (m, d)
        Outward unit normals.
    cuts : ndarray, shape (m,) [m]
        Signed distances from the particle's centre.
    """
    lengths = np.asarray(packing.box.lengths)
    touching = neighbor_pairs(packing)
    i, j = touching.pairs.T
    separation = packing.centers[j] + touching.shifts * lengths - packing.centers[i]
    wall_rows, wall_normals, wall_distances = _wall_cuts(packing)
    rows = np.concatenate((i, j, wall_rows))
    normals = np.concatenate((separation, -separation, wall_normals))
    distance = np.sqrt(np.einsum("mk,mk->m", separation, separation))
    coincident = distance == 0.0
    normals[: 2 * i.size, 0][np.tile(coincident, 2)] = 1.0
    distance[coincident] = 1.0
    excess = (packing.radii[i] - packing.radii[j]) * (packing.radii[i] + packing.radii[j]) / (2.0 * distance)
    cuts = np.concatenate((0.5 * distance + excess, 0.5 * distance - excess, wall_distances))
    # of two coincident particles the smaller, or of equal ones the second, is swallowed whole
    first_wins = packing.radii[i[coincident]] >= packing.radii[j[coincident]]
    cuts[: i.size][coincident] = np.where(first_wins, np.inf, -np.inf)
    cuts[i.size : 2 * i.size][coincident] = np.where(first_wins, -np.inf, np.inf)
    normals /= np.sqrt(np.einsum("mk,mk->m", normals, normals))[:, None]
    order = np.argsort(rows, kind="stable")
    starts = np.searchsorted(rows[order], np.arange(packing.count + 1))
    return starts, normals[order], cuts[order]


def _wall_cuts(packing: ParticlePacking):  # type: ignore[no-untyped-def]
    """Disks that reach over a wall: row numbers, outward normals and distances of the wall."""
    rows, normals, distances = [], [], []
    for axis, length in enumerate(packing.box.lengths):
        if packing.box.periodic[axis]:
            continue
        position = packing.centers[:, axis]
        for sign, distance in ((-1.0, position), (1.0, length - position)):
            crossing = np.flatnonzero(distance < packing.radii)
            normal = np.zeros((crossing.size, packing.dimension))
            normal[:, axis] = sign
            rows.append(crossing)
            normals.append(normal)
            distances.append(distance[crossing])
    if not rows:
        return np.zeros(0, dtype=np.int64), np.zeros((0, packing.dimension)), np.zeros(0)
    return np.concatenate(rows), np.concatenate(normals), np.concatenate(distances)


@njit(cache=True)
def cut_disk_area(radius, normals, cuts):  # type: ignore[no-untyped-def]
    """Area of a disk within the half planes ``normal . p <= cut`` about its centre."""
    for m in range(cuts.size):
        if cuts[m] <= -radius:
            return 0.0
    area, count = 0.0, 0
    edges = np.empty((2 * cuts.size, 2))  # covered angular intervals within [-pi, pi]
    for m in range(cuts.size):
        if cuts[m] >= radius:
            continue
        # the chord, from -half to half along the direction at right angles to the normal
        half = np.sqrt((radius - cuts[m]) * (radius + cuts[m]))
        low, high = -half, half
        fx, fy = cuts[m] * normals[m, 0], cuts[m] * normals[m, 1]
        for k in range(cuts.size):
            if k == m:
                continue
            slope = normals[m, 0] * normals[k, 1] - normals[m, 1] * normals[k, 0]
            room = cuts[k] - (fx * normals[k, 0] + fy * normals[k, 1])
            if slope > 0.0:
                high = min(high, room / slope)
            elif slope < 0.0:
                low = max(low, room / slope)
            elif room < 0.0 or (room == 0.0 and k < m):  # hidden, or the same line a second time
                high = low
        if high > low:
            area += 0.5 * cuts[m] * (high - low)
        middle = np.arctan2(normals[m, 1], normals[m, 0])
        opening = np.arctan2(half, cuts[m])
        begin, end = middle - opening, middle + opening
        if begin < -np.pi:
            edges[count, 0], edges[count, 1] = begin + 2.0 * np.pi, np.pi
            begin, count = -np.pi, count + 1
        elif end > np.pi:
            edges[count, 0], edges[count, 1] = -np.pi, end - 2.0 * np.pi
            end, count = np.pi, count + 1
        edges[count, 0], edges[count, 1] = begin, end
        count += 1
    free, reached = 0.0, -np.pi
    for m in range(1, count):  # insertion sort: intervals are few, and numba's own sort takes a second to compile
        begin, end = edges[m, 0], edges[m, 1]
        slot = m
        while slot > 0 and edges[slot - 1, 0] > begin:
            edges[slot, 0], edges[slot, 1] = edges[slot - 1, 0], edges[slot - 1, 1]
            slot -= 1
        edges[slot, 0], edges[slot, 1] = begin, end
    for m in range(count):
        free += max(edges[m, 0] - reached, 0.0)
        reached = max(reached, edges[m, 1])
    free += max(np.pi - reached, 0.0)
    return area + 0.5 * radius * radius * free


@njit(cache=True)
def _sum_of_cut_disks(radii, starts, normals, cuts):  # type: ignore[no-untyped-def]
    total = 0.0
    for i in range(radii.size):
        total += cut_disk_area(radii[i], normals[starts[i] : starts[i + 1]], cuts[starts[i] : starts[i + 1]])
    return total


@njit(cache=True)
def _sum_of_cut_spheres(radii, starts, normals, cuts):  # type: ignore[no-untyped-def]
    total = 0.0
    for i in range(radii.size):
        rows = slice(starts[i], starts[i + 1])
        total += cut_sphere_volume(radii[i], normals[rows], cuts[rows])
    return total
