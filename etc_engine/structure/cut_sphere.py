"""Exact volume of a sphere within half-spaces, in closed form."""

from __future__ import annotations

import numpy as np
from numba import njit

from etc_engine.structure.clipping import MOST_VERTICES, clip_facet, rank

SAME_PLANE = 1e-15
"""Two planes closer than this part of the radius are one."""

NEAR_EDGE = 1e-7
"""Two planes closer to the centre than this part of the radius go through it: solid angles seen from beside an edge
lose as many digits as the edge is near."""


@njit(cache=True)
def _triangle_angle(p, start, end, height):  # type: ignore[no-untyped-def]
    """Solid angle of the triangle between the foot of a perpendicular and a part of a line in the same plane.

    The line has the distance p > 0 from the foot and the part runs from ``start`` to ``end`` along it: the difference
    of two orthoschemes, each theta - asin(h sin(theta) / sqrt(h^2 + p^2)) with tan(theta) = t / p.
    """
    slant = height / np.sqrt(height * height + p * p)
    angle = np.arctan2(end, p) - np.arctan2(start, p)
    angle -= np.arcsin(slant * end / np.sqrt(p * p + end * end))
    return angle + np.arcsin(slant * start / np.sqrt(p * p + start * start))


@njit(cache=True)
def _under_edge(p, start, end, height, radius):  # type: ignore[no-untyped-def]
    """Share of one edge of a plane face in the volume cut off beyond that face.

    Inside the disk of radius c in which the plane cuts the sphere, the triangle of foot and edge has the area p t / 2.
    Outside the disk the sector takes its place, with the area c^2 theta / 2 and the solid angle theta (1 - h / R).
    """
    square = (radius - height) * (radius + height)  # c^2
    half = np.sqrt(max(square - p * p, 0.0))
    low, high = min(max(start, -half), half), min(max(end, -half), half)
    beyond = (np.arctan2(end, p) - np.arctan2(start, p)) - (np.arctan2(high, p) - np.arctan2(low, p))
    share = beyond * (radius**3 * (1.0 - height / radius) / 3.0 - height * square / 6.0)
    if high > low:
        share += radius**3 * _triangle_angle(p, low, high, height) / 3.0 - height * p * (high - low) / 6.0
    return share


@njit(cache=True)
def _over_face(polygon, corners, height, radius):  # type: ignore[no-untyped-def]
    """Sum over the edges of a polygon: the volume cut off beyond it, or its solid angle where the radius is 0."""
    total = 0.0
    for k in range(corners):
        n = k + 1 if k + 1 < corners else 0
        ux, uy = polygon[n, 0] - polygon[k, 0], polygon[n, 1] - polygon[k, 1]
        length = np.sqrt(ux * ux + uy * uy)
        if length == 0.0:
            continue
        ux, uy = ux / length, uy / length
        p = polygon[k, 0] * uy - polygon[k, 1] * ux
        start, end = polygon[k, 0] * ux + polygon[k, 1] * uy, polygon[n, 0] * ux + polygon[n, 1] * uy
        if p == 0.0:
            continue
        if radius > 0.0:
            share = _under_edge(abs(p), start, end, height, radius)
        else:
            share = _triangle_angle(abs(p), start, end, height)
        total += share if p > 0.0 else -share
    return total


@njit(cache=True)
def _cone_angle(planes, count, rooms):  # type: ignore[no-untyped-def]
    """Solid angle of the cone within half-spaces whose planes go through the centre, on the faces of a cube."""
    tangents, polygon, spare = rooms
    around = np.zeros((count + 6, 4))
    for m in range(count):
        for axis in range(3):
            around[m, axis] = planes[m, axis]
    for face in range(6):
        around[count + face, face // 2], around[count + face, 3] = 1.0 - 2.0 * (face % 2), 1.0
    total = 0.0
    for face in range(count, count + 6):
        corners, _ = clip_facet(face, around, count + 6, 1.0, SAME_PLANE, tangents, polygon, spare)
        total += _over_face(polygon, corners, 1.0, 0.0)
    return total


@njit(cache=True)
def cut_sphere_volume(radius, normals, cuts):  # type: ignore[no-untyped-def]
    r"""Volume of a sphere within the half-spaces ``normal . p <= cut`` about its centre.

    .. math:: V = \tfrac13 R^3 \Omega_0 - \sum_f \Big( \tfrac13 R^3 \Omega_f - \tfrac13 h_f A_f \Big)

    with h the cut of plane f, A the area of the face's part within the sphere and Omega its solid angle, which has
    the sign of h. The solid angle Omega_0 of the whole region is 4 pi where the centre is inside it and 0 where the
    centre is outside it; planes through the centre leave a cone. Exact to rounding, or to
    `NEAR_EDGE` where an edge of the region passes that near to the centre without meeting it.

    Parameters
    ----------
    radius : float [m]
    normals : ndarray, shape (m, 3)
        Outward unit normals.
    cuts : ndarray, shape (m,) [m]
        Signed distances of the planes from the centre.

    Returns
    -------
    float
        [m3]

    Examples
    --------
    >>> half = cut_sphere_volume(1.0, np.array([[0.0, 0.0, 1.0]]), np.array([0.0]))
    >>> round(half / np.pi, 12)
    0.666666666667
    """
    unsorted, count = np.empty((cuts.size, 4)), np.int64(0)
    for m in range(cuts.size):
        if cuts[m] <= -radius:
            return 0.0
        if cuts[m] < radius:
            unsorted[count, 3] = cuts[m]
            for axis in range(3):
                unsorted[count, axis] = normals[m, axis]
            count += 1
    planes, near = np.empty((count, 4)), 0
    for m, row in enumerate(rank(unsorted, 3, count)):
        for k in range(4):
            planes[m, k] = unsorted[row, k]
        near += abs(planes[m, 3]) <= NEAR_EDGE * radius
    through = np.int64(0)
    for m in range(count):
        if near > 1 and abs(planes[m, 3]) <= NEAR_EDGE * radius:
            planes[m, 3] = 0.0
        through += planes[m, 3] == 0.0
    rooms = np.empty((2, 3)), np.empty((MOST_VERTICES, 2)), np.empty((MOST_VERTICES, 2))
    if count > 0 and planes[0, 3] < 0.0:
        volume = 0.0
    elif through:
        volume = radius**3 * _cone_angle(planes, through, rooms) / 3.0
    else:
        volume = 4.0 / 3.0 * np.pi * radius**3
    tangents, polygon, spare = rooms
    for f in range(count):
        cut = planes[f, 3]
        if cut == 0.0:  # the cone under this face is flat
            continue
        size = np.sqrt((radius - cut) * (radius + cut))
        corners, _ = clip_facet(f, planes, count, size, SAME_PLANE * radius, tangents, polygon, spare)
        volume -= np.copysign(_over_face(polygon, corners, abs(cut), radius), cut)
    return max(volume, 0.0)
