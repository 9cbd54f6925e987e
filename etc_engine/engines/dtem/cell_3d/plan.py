"""How every facet is divided: pieces of its edges, centre and rings of its fan, contact disks from both sides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.box import Box
from etc_engine.engines.dtem.cell_3d.topology import CellTopology
from etc_engine.errors import GeometryError

Integers = Ints

WITHIN = 0.12
"""The centre of a fan keeps this part of the centroid's distance from every edge."""
ROUND = 0.7
"""Rings are circles up to this part of the foot's distance from the nearest edge."""
NARROW = 0.15
"""Rings are circles where the narrow part of a gap is smaller than this part of that distance."""
TOUCHING = 1e-9
"""Gaps below this part of the radius are closed."""


@dataclass(frozen=True)
class Fineness:
    """How finely the rim is divided.

    Parameters
    ----------
    largest : float
        Largest piece, in radii of the smaller sphere.
    growth : float
        Ring width over its distance from the narrowest place.
    disk_rings : tuple of float
        Rings on a contact disk, as parts of its radius; the last is 1.
    disk_growth : float
        Growth of the rings around a contact disk.
    radial_degree : int
        Degree of the temperature along the rays from rim to facet.
    """

    largest: float = 1.2
    growth: float = 2.0
    disk_rings: tuple[float, ...] = (1.0,)
    disk_growth: float = 1.4
    radial_degree: int = 3


@dataclass(frozen=True, eq=False)
class CellPlan:
    """Geometry and division of all facets.

    Parameters
    ----------
    corners : ndarray, shape (c, 2) [m]
        Corners in the facet's plane, from the foot of the branch vector.
    axes : ndarray, shape (m, 3, 3)
        Normal and two tangents.
    heights : ndarray, shape (m, 2, 2) [m]
        For both ends: heights of the facet and of the contact plane above the sphere's radius.
    disks : ndarray, shape (m, 2, 3) [m]
        For both ends: radius of the contact disk's edge in the facet, radius of the disk in its plane, and lift of
        the facet at that edge.
    circles : ndarray, shape (m,) [m]
        Radius up to which rings are circles, in the coordinates common to both ends; that of the contact disk, if any.
    contacts : ndarray of bool, shape (m,)
    pieces : ndarray, shape (edges,)
    centers : ndarray, shape (m, 2) [m]
    level_starts : ndarray, shape (m + 1,)
    levels : ndarray
    arms : ndarray, shape (cell vertices, 3) [m]
        Vertices of each cell from its centre.
    areas : ndarray, shape (m,) [m2]
    """

    corners: Floats
    axes: Floats
    heights: Floats
    disks: Floats
    circles: Floats
    contacts: Flags
    pieces: Integers
    centers: Floats
    level_starts: Integers
    levels: Floats
    arms: Floats
    areas: Floats


def plan_cells(
    topology: CellTopology,
    spheres: tuple[Floats, Floats],
    box: Box,
    contact_radii: Floats,
    contrast: float,
    fineness: Fineness,
) -> CellPlan:
    """Divide all facets.

    Parameters
    ----------
    topology : CellTopology
    spheres : tuple of ndarray
        Centres, shape (n, 3) [m], and radii, shape (n,) [m].
    box : Box
    contact_radii : ndarray, shape (m,) [m]
        Radius of the contact disk of each facet, 0 where the spheres do not touch.
    contrast : float
        Conductivity of the spheres over that of the fluid.
    fineness : Fineness

    Raises
    ------
    GeometryError
        If a centre lies outside its own cell, spheres overlap without a contact, or a contact disk reaches over its
        facet.
    """
    polygons = topology.polygons
    centers, radii = spheres
    lengths = np.asarray(box.lengths)
    first, second = polygons.cells[:, 0], polygons.cells[:, 1]
    wall = second < 0
    mirror = np.where(wall, first, second)
    normals = polygons.normals
    ends = np.stack((radii[first], radii[mirror]), axis=1)
    distance = np.linalg.norm(centers[mirror] - centers[first] + polygons.shifts * lengths, axis=1)
    number = -1 - second[wall]
    at = np.where(number % 2 == 1, lengths[number // 2], 0.0)
    distance[wall] = 2.0 * np.abs(at - centers[first[wall], number // 2])
    gap = distance - ends.sum(axis=1)
    gap = np.where(np.abs(gap) < TOUCHING * ends.min(axis=1), 0.0, gap)
    above = (gap * (gap + 2.0 * ends[:, ::-1].T) / (2.0 * distance)).T  # h - R, exact for small gaps
    _check(above + ends, gap, contact_radii, polygons.cells)
    tangents = _tangents(normals)
    axes = np.stack((normals, *tangents), axis=1)

    face = np.repeat(np.arange(polygons.count), np.diff(polygons.starts))
    points = polygons.vertices[polygons.corners] + polygons.images * lengths - centers[first[face]]
    corners = np.stack([(points * tangents[k][face]).sum(axis=1) for k in range(2)], axis=1)
    cell = np.repeat(np.arange(len(radii)), np.diff(topology.vertex_starts))
    arms = polygons.vertices[topology.vertices] + topology.vertex_images * lengths - centers[cell]

    disks, plane = _disks(ends, above, contact_radii)
    common = np.sqrt(disks[:, 0, 0] * disks[:, 1, 0])
    smaller = ends.min(axis=1)
    effective = 2.0 * ends[:, 0] * ends[:, 1] / ends.sum(axis=1)
    narrow = np.maximum(np.sqrt(np.maximum(gap, 0.0) * effective), min(1.0 / contrast, 0.3) * 0.3 * smaller)
    narrow = np.where(common > 0.0, common / 2.0, narrow)
    pieces = _pieces(topology, corners, fineness.largest * smaller, common)
    fan, starts, levels, areas, circles, fits = _fans(
        polygons.starts,
        corners,
        (narrow, fineness.largest * smaller, common),
        (fineness.growth, fineness.disk_growth, np.asarray(fineness.disk_rings)),
    )
    if not fits.all():
        bad = int(np.argmin(fits))
        raise GeometryError(
            f"the contact disk between {polygons.cells[bad].tolist()} (radius {contact_radii[bad]:.4g} m) reaches over "
            f"the Laguerre facet they share: neighbouring contacts overlap; make the contacts smaller"
        )
    disks[common <= 0.0, :, 0] = circles[common <= 0.0, None]
    return CellPlan(
        corners,
        axes,
        np.stack((above, plane), axis=2),
        disks,
        circles,
        common > 0.0,
        pieces,
        fan,
        starts,
        levels,
        arms,
        areas,
    )


def _check(heights: Floats, gap: Floats, contact_radii: Floats, cells: Integers) -> None:
    low = (heights <= 0.0).any(axis=1)
    if low.any():
        bad = int(np.argmax(low))
        raise GeometryError(
            f"the centre of a sphere lies outside its own Laguerre cell (spheres {cells[bad].tolist()}): they overlap "
            f"too deeply; remove one or use radii that differ less"
        )
    loose = (gap < 0.0) & (contact_radii <= 0.0)
    if loose.any():
        bad = int(np.argmax(loose))
        raise GeometryError(
            f"spheres {cells[bad].tolist()} overlap by {-gap[bad]:.4g} m but have no contact; give the contact a radius"
        )


def _tangents(normals: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors normal to each normal, right-handed."""
    helper = np.where(np.abs(normals[:, :1]) < 0.6, np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, 1.0, 0.0]]))
    first = np.cross(normals, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(normals, first)


def _disks(ends: Floats, above: Floats, contact_radii: Floats) -> tuple[Floats, Floats]:
    """Contact disks as seen from both ends, and the height of their planes above the radius.

    The disk of radius c has half-angle asin(c / R). Its edge lies on the facet, at h tan(angle), where the sphere does
    not reach the facet; where it does (overlap), the facet is lifted to the disk, to h_c = R cos(angle) > h.
    """
    sine = np.minimum(contact_radii[:, None] / ends, 1.0)
    angle = np.arcsin(sine)
    plane = -2.0 * ends * np.sin(0.5 * angle) ** 2  # R cos(angle) - R
    lift = np.maximum(plane - above, 0.0)
    edge = (ends + above + lift) * np.tan(angle)
    radius = np.repeat(contact_radii[:, None], 2, axis=1)
    disks = np.stack((edge, radius, lift), axis=2)
    disks[contact_radii <= 0.0] = 0.0
    return disks, plane


def _pieces(topology: CellTopology, corners: Floats, largest: Floats, disks: Floats) -> Integers:
    """Pieces of every edge: short enough for every facet around it, and for the angle a contact disk sees."""
    polygons = topology.polygons
    face = np.repeat(np.arange(polygons.count), np.diff(polygons.starts))
    following = np.arange(1, len(corners) + 1)
    following[polygons.starts[1:] - 1] = polygons.starts[:-1]
    a, b = corners, corners[following]
    wanted = np.ceil(np.linalg.norm(b - a, axis=1) / largest[face] - 1e-6)
    angle = np.abs(np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1)))
    wanted = np.maximum(wanted, np.where(disks[face] > 0.0, np.ceil(angle / MOST_ANGLE - 1e-6), 1.0))
    pieces = np.ones(topology.edge_count, dtype=np.int64)
    np.maximum.at(pieces, topology.edge_of_corner, wanted.astype(np.int64))
    return pieces


MOST_ANGLE = 1.1
"""Widest angle of a piece around a contact disk, in radians."""


@njit(cache=True)
def _fans(starts, corners, sizes, growths):  # type: ignore[no-untyped-def]  # noqa: PLR0915
    """Centre and rings of the fan of every facet, its area, and whether its contact disk fits into it."""
    narrow, largest, disks = sizes
    growth, disk_growth, disk_rings = growths
    count = len(starts) - 1
    fans, areas, fits = np.zeros((count, 2)), np.zeros(count), np.ones(count, dtype=np.bool_)
    circles = disks.copy()
    level_starts = np.zeros(count + 1, dtype=np.int64)
    levels = np.empty(64 * count + 64)
    placed = 0
    for f in range(count):
        polygon = corners[starts[f] : starts[f + 1]]
        nv = len(polygon)
        middle = np.zeros(2)
        for k in range(nv):
            middle += polygon[k] / nv
        part = 1.0
        while part > 0.0:
            clear = True
            for k in range(nv):
                a, b = polygon[k], polygon[(k + 1) % nv]
                e0, e1 = b[0] - a[0], b[1] - a[1]
                of_middle = e0 * (middle[1] - a[1]) - e1 * (middle[0] - a[0])
                p0, p1 = (1.0 - part) * middle[0], (1.0 - part) * middle[1]
                of_point = e0 * (p1 - a[1]) - e1 * (p0 - a[0])
                if of_point < WITHIN * of_middle:
                    clear = False
            if clear:
                break
            part -= 0.05
        part = max(part, 0.0)
        if disks[f] > 0.0:
            part = 1.0
        fans[f, 0], fans[f, 1] = (1.0 - part) * middle[0], (1.0 - part) * middle[1]
        far, nearest = 0.0, np.inf
        for k in range(nv):
            a, b = polygon[k], polygon[(k + 1) % nv]
            areas[f] += 0.5 * (a[0] * b[1] - a[1] * b[0])
            far += np.sqrt((a[0] - fans[f, 0]) ** 2 + (a[1] - fans[f, 1]) ** 2) / nv
            length = np.sqrt((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2)
            nearest = min(nearest, (a[0] * (b[1] - a[1]) - a[1] * (b[0] - a[0])) / length)
        offset = np.sqrt(fans[f, 0] ** 2 + fans[f, 1] ** 2)
        begin = placed
        if disks[f] > 0.0:
            fits[f] = nearest > 1.02 * disks[f]
            for ring in disk_rings:
                levels[placed] = ring
                placed += 1
            s, reach = 0.0, max(far - disks[f], 1e-3 * far)
            begin = placed
            while s < reach and placed < len(levels) - 2:
                s += min(largest[f], disk_growth * (s + narrow[f]))
                levels[placed] = s
                placed += 1
            last = levels[placed - 1]
            for k in range(begin, placed):
                levels[k] = 1.0 + levels[k] / last
        else:
            s, width = 0.0, narrow[f] + offset
            while s < far and placed < len(levels) - 2:
                s += min(largest[f], growth * np.sqrt(s * s + width * width))
                levels[placed] = s
                placed += 1
            last = levels[placed - 1] / far
            if part == 1.0 and width < NARROW * nearest:
                circles[f] = ROUND * nearest
            for k in range(begin, placed):
                s = levels[k] / last
                if circles[f] == 0.0:
                    levels[k] = s / far
                else:
                    levels[k] = s / circles[f] if s <= circles[f] else 1.0 + (s - circles[f]) / (far - circles[f])
        level_starts[f + 1] = placed
    return fans, level_starts, levels[:placed], areas, circles, fits
