r"""Meshes of Laguerre facets: a fan of quadratic triangles about the foot of the branch vector, in rings.

A node has a *level* and a *ray*. Ray q goes from the fan's centre to the q-th node of the boundary, at distance D_q.
Without a contact disk the level runs from 0 to 1 and the radius is level * D_q. With a disk of radius b it runs to 2:

    radius = level * b                         (level <= 1: on the disk)
    radius = b + (level - 1) (D_q - b)         (level > 1: around it)

Nodes: the centre; the points and arc middles of the inner rings; the middles of spokes and of diagonals; then the
boundary, points and middles in turn. The rings get narrow towards the edge of a disk, where the temperature of the rim
goes like the square root of the distance. (Quarter-point elements would represent that root, but it has no finite
Dirichlet energy on the surface, which the energy of the sphere is made of.)
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def boundary_nodes(corners, counts):  # type: ignore[no-untyped-def]
    """Boundary points and middles of a polygon whose k-th edge is cut into counts[k] pieces, in turn."""
    total = 2 * counts.sum()
    nodes = np.empty((total, 2))
    place = 0
    for k in range(len(counts)):
        m = (k + 1) % len(counts)
        pieces = 2 * counts[k]
        for step in range(pieces):
            z = step / pieces
            nodes[place, 0] = corners[k, 0] + z * (corners[m, 0] - corners[k, 0])
            nodes[place, 1] = corners[k, 1] + z * (corners[m, 1] - corners[k, 1])
            place += 1
    return nodes


@njit(cache=True)
def node_levels(levels, pieces):  # type: ignore[no-untyped-def]
    """Level and ray of every node of a fan of `pieces` boundary pieces with rings at `levels`."""
    rings = len(levels)
    inner = 1 + pieces * (4 * rings - 3)
    level, ray = np.zeros(inner + 2 * pieces), np.zeros(inner + 2 * pieces, dtype=np.int64)
    for r in range(1, rings):
        for q in range(2 * pieces):
            level[1 + (r - 1) * 2 * pieces + q], ray[1 + (r - 1) * 2 * pieces + q] = levels[r - 1], q
    for r in range(rings):
        low, high = (0.0 if r == 0 else levels[r - 1]), levels[r]
        for k in range(pieces):
            spoke = 1 + 2 * pieces * (rings - 1) + r * pieces + k
            level[spoke], ray[spoke] = 0.5 * (low + high), 2 * k
            if r > 0:
                diagonal = 1 + 2 * pieces * (rings - 1) + pieces * rings + (r - 1) * pieces + k
                level[diagonal], ray[diagonal] = 0.5 * (low + high), 2 * k + 1
    for q in range(2 * pieces):
        level[inner + q], ray[inner + q] = levels[rings - 1], q
    return level, ray, inner


@njit(cache=True)
def fan_triangles(pieces, levels, disk):  # type: ignore[no-untyped-def]
    """Quadratic triangles (three corners, middles of 01, 12, 20), and which lie on the contact disk."""
    rings = len(levels)
    inner = 1 + pieces * (4 * rings - 3)
    count = pieces * (2 * rings - 1)
    triangles, on_disk = np.empty((count, 6), dtype=np.int64), np.zeros(count, dtype=np.bool_)
    spokes = 1 + 2 * pieces * (rings - 1)
    diagonals = spokes + pieces * rings
    place = 0
    for r in range(rings):
        near = 1 + (r - 1) * 2 * pieces
        far = inner if r == rings - 1 else 1 + r * 2 * pieces
        for k in range(pieces):
            m = (k + 1) % pieces
            s0, s1 = spokes + r * pieces + k, spokes + r * pieces + m
            if r == 0:
                corners = (0, far + 2 * k, far + 2 * m, s0, far + 2 * k + 1, s1)
            else:
                d = diagonals + (r - 1) * pieces + k
                corners = (near + 2 * k, far + 2 * k, far + 2 * m, s0, far + 2 * k + 1, d)
                other = (near + 2 * k, far + 2 * m, near + 2 * m, d, s1, near + 2 * k + 1)
                for c in range(6):
                    triangles[place, c] = other[c]
                on_disk[place] = disk and levels[r] <= 1.0
                place += 1
            for c in range(6):
                triangles[place, c] = corners[c]
            on_disk[place] = disk and levels[r] <= 1.0
            place += 1
    return triangles, on_disk


@njit(cache=True)
def _radius(level, far, circle):  # type: ignore[no-untyped-def]
    """Radius of a level on a ray that meets the boundary at `far`."""
    if circle == 0.0:
        return level * far
    return level * circle if level <= 1.0 else circle + (level - 1.0) * (far - circle)


@njit(cache=True)
def node_positions(boundary, center, levels, circle, level, ray):  # type: ignore[no-untyped-def]
    """Positions in the facet's plane; `circle` is the radius b up to which rings are circles, 0 for straight rings."""
    nodes = np.empty((len(level), 2))
    rings, pieces = len(levels), len(boundary) // 2
    diagonals = 1 + 2 * pieces * (rings - 1) + pieces * rings
    inner = len(level) - 2 * pieces
    arms, far = np.empty_like(boundary), np.empty(2 * pieces)
    for q in range(2 * pieces):
        arms[q, 0], arms[q, 1] = boundary[q, 0] - center[0], boundary[q, 1] - center[1]
        far[q] = np.sqrt(arms[q, 0] ** 2 + arms[q, 1] ** 2)
    for a in range(len(level)):
        q, radius = ray[a], _radius(level[a], far[ray[a]], circle)
        du, dv = arms[q, 0] / far[q], arms[q, 1] / far[q]
        if circle > 0.0 and q % 2 == 1:  # middles of arcs bisect the angle, those of the boundary its pieces
            p, n = q - 1, (q + 1) % (2 * pieces)
            bu, bv = arms[p, 0] / far[p] + arms[n, 0] / far[n], arms[p, 1] / far[p] + arms[n, 1] / far[n]
            norm, part = np.sqrt(bu * bu + bv * bv), min(max(level[a] - 1.0, 0.0), 1.0)
            du, dv = part * du + (1.0 - part) * bu / norm, part * dv + (1.0 - part) * bv / norm
            norm = np.sqrt(du * du + dv * dv)
            du, dv = du / norm, dv / norm
        nodes[a, 0], nodes[a, 1] = center[0] + radius * du, center[1] + radius * dv
    if circle == 0.0:  # straight diagonals
        for r in range(1, rings):
            for k in range(pieces):
                a, m = diagonals + (r - 1) * pieces + k, 2 * ((k + 1) % pieces)
                for axis in range(2):
                    middle = 0.5 * (levels[r - 1] * arms[2 * k, axis] + levels[r] * arms[m, axis])
                    nodes[a, axis] = center[axis] + middle
    for q in range(2 * pieces):
        nodes[inner + q, 0], nodes[inner + q, 1] = boundary[q, 0], boundary[q, 1]
    return nodes


@njit(cache=True)
def shape_functions(xi, eta):  # type: ignore[no-untyped-def]
    """Quadratic shape functions of a triangle and their derivatives, rows (N, dN/dxi, dN/deta)."""
    values = np.empty((3, 6))
    l = (1.0 - xi - eta, xi, eta)
    dx, dy = (-1.0, 1.0, 0.0), (-1.0, 0.0, 1.0)
    for a in range(3):
        b = (a + 1) % 3
        values[0, a], values[0, 3 + a] = l[a] * (2.0 * l[a] - 1.0), 4.0 * l[a] * l[b]
        values[1, a], values[1, 3 + a] = dx[a] * (4.0 * l[a] - 1.0), 4.0 * (dx[a] * l[b] + l[a] * dx[b])
        values[2, a], values[2, 3 + a] = dy[a] * (4.0 * l[a] - 1.0), 4.0 * (dy[a] * l[b] + l[a] * dy[b])
    return values


def triangle_rule() -> tuple[np.ndarray, np.ndarray]:
    """Six-point rule of degree 4 on the unit triangle: points, shape (6, 2), and weights that sum to 1/2.

    References
    ----------
    D. A. Dunavant 1985, High degree efficient symmetrical Gaussian quadrature rules for the triangle,
    doi:10.1002/nme.1620210612.
    """
    points, weights = [], []
    for a, w in ((0.445948490915965, 0.223381589678011), (0.091576213509771, 0.109951743655322)):
        points += [(a, a), (1.0 - 2.0 * a, a), (a, 1.0 - 2.0 * a)]
        weights += [0.5 * w] * 3
    return np.array(points), np.array(weights)
