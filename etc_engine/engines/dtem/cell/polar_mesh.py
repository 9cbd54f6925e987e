r"""Conforming polar mesh of all cells: disks in rings about their centres, one layer of fluid out to the edges.

Every element is a quadrilateral in (s, t): s along an edge, t along the ray from the centre, with the exact curved
geometry r = a(s) + t (b(s) - a(s)), where a and b are parts of R or of rho(s) = sqrt(h^2 + s^2). Temperatures are
polynomials of degree p in s and t at Gauss-Lobatto points. Neighbouring elements share all nodes of a side, also across
the edge between two cells, so that the temperature is continuous and its energy is an upper bound.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.engines.dtem.cell.frame import lobatto_points
from etc_engine.engines.dtem.cell.geometry import CellGeometry
from etc_engine.engines.dtem.cell.rim_grid import CUT, NECK, TOUCHING, EdgeGrid

GROWTH = 0.35
"""Each ring towards the rim is thinner by this factor."""
CORE = 0.35
"""Rings begin at this part of the radius; inside it the elements reach to the centre."""
FINEST_RING = 1e-7


@dataclass(frozen=True, eq=False)
class PolarMesh:
    """Elements of all cells.

    Parameters
    ----------
    degree : int
        Degree p; an element has (p + 1)^2 nodes, t running fastest.
    count : int
        Number of nodes; vertices first, then inner nodes of edges, then those inside cells.
    nodes : ndarray of int64, shape (q, (p + 1)^2)
    places : ndarray, shape (q, (p + 1)^2, 2) [m]
        Positions of the nodes, from the centre of the cell.
    shape : ndarray, shape (q, 9)
        h, R, h - R of the element's edge, s at both ends, and the parts (of R, of rho) at t = 0 and at t = 1.
    cells : ndarray of int64, shape (q,)
    solid : ndarray of bool, shape (q,)
    on_wall : tuple of ndarray
        Nodes on the walls 0 to 3.
    """

    degree: int
    count: int
    nodes: Ints
    places: Floats
    shape: Floats
    cells: Ints
    solid: Flags
    on_wall: tuple[Ints, ...]


@dataclass(frozen=True, eq=False)
class _Columns:
    """Rays of one cell: their place on the edge, the node there, whether rim and edge meet, whether they end inside."""

    s: Floats
    h: Floats
    clearance: Floats
    direction: Floats
    edge_nodes: Ints
    meets: Flags
    chord: Flags
    neck: Flags
    ends: Ints


def polar_mesh(geometry: CellGeometry, grid: EdgeGrid, degree: int) -> PolarMesh:
    """Mesh of all cells with the intervals of an edge grid; contacts must be geometric or necks."""
    cells, edges = geometry.cells, geometry.edges
    share = 0.5 * (lobatto_points(degree) + 1.0)
    intervals = np.diff(grid.starts) - 1
    first_inner = cells.vertex_count + np.concatenate(([0], np.cumsum(intervals * degree - 1)))
    count = int(first_inner[-1])
    blocks: list[tuple[Ints, Floats, Floats, Flags]] = []
    owners: list[Ints] = []
    smallest = np.array(
        [np.diff(grid.points[a:b]).min() for a, b in zip(grid.starts[:-1], grid.starts[1:], strict=True)]
    )
    for i in range(geometry.count):
        rows = np.arange(cells.starts[i], cells.starts[i + 1])
        columns = [_columns(geometry, grid, row, share, first_inner) for row in rows]
        rings = _rings(float(smallest[cells.edges[rows]].min()) / geometry.radii[i])
        nodes, places, shape, solid, count = _cell_elements(columns, geometry.radii[i], rings, degree, count)
        blocks.append((nodes, places, shape, solid))
        owners.append(np.full(len(nodes), i))
    walls = []
    for wall in range(4):
        found = np.flatnonzero(cells.cells[:, 1] == -1 - wall)
        inner = [np.arange(first_inner[e], first_inner[e + 1]) for e in found]
        rows = np.flatnonzero(np.isin(cells.edges, found))
        following = rows + 1
        end = np.searchsorted(cells.starts, rows, side="right")
        following = np.where(following == cells.starts[end], cells.starts[end - 1], following)
        ends = np.concatenate((cells.vertices[rows], cells.vertices[following]))
        walls.append(np.unique(np.concatenate((ends, *inner))))
    assert edges.kind.size == intervals.size
    nodes, places, shape, solid = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    return PolarMesh(degree, count, nodes, places, shape, np.concatenate(owners), solid, tuple(walls))


def _rings(finest: float) -> Floats:
    """Ring boundaries in radii, from the centre to the rim, the last as thin as the finest interval."""
    rings, thickness = [1.0], min(max(finest, FINEST_RING), 0.5)
    while 1.0 - thickness > CORE:
        rings.append(1.0 - thickness)
        thickness /= GROWTH
    return np.array([*rings, 0.0])[::-1]


def _columns(geometry: CellGeometry, grid: EdgeGrid, row: int, share: Floats, first_inner: Ints) -> _Columns:
    """Rays over one side, both ends included."""
    cells, edges = geometry.cells, geometry.edges
    e, ahead = int(cells.edges[row]), bool(cells.forward[row])
    own = 0 if ahead else 1
    points = grid.points[grid.starts[e] : grid.starts[e + 1]]
    s = np.concatenate([(points[:-1, None] + np.diff(points)[:, None] * share[:-1]).ravel(), points[-1:]])
    inner = np.arange(first_inner[e], first_inner[e + 1])
    i = int(np.searchsorted(cells.starts, row, side="right")) - 1
    following = row + 1 if row + 1 < cells.starts[i + 1] else int(cells.starts[i])
    direction = edges.angles[e]
    if not ahead:
        s, inner, direction = -s[::-1], inner[::-1], direction + np.pi
    nodes = np.concatenate((cells.vertices[row : row + 1], inner, cells.vertices[following : following + 1]))
    corner, kind = edges.corners[e], edges.kind[e]
    inside = np.abs(s) <= corner * (1.0 + 1e-12)
    chord = inside & (kind == CUT)
    centre = (s == 0.0) & ((kind == TOUCHING) | ((kind == NECK) & (edges.widths[e] == 0.0)))
    size = s.size
    return _Columns(
        s,
        np.full(size, edges.distances[e, own]),
        np.full(size, edges.clearances[e, own]),
        np.full(size, direction),
        nodes,
        chord | centre,
        chord,
        inside & (kind == NECK),
        np.array([size - 1]),
    )


def _cell_elements(
    sides: list[_Columns], radius: float, rings: Floats, degree: int, count: int
) -> tuple[Ints, Floats, Floats, Flags, int]:
    """Elements of one cell, with new nodes numbered from ``count``."""
    layers, share = rings.size - 1, 0.5 * (lobatto_points(degree) + 1.0)
    lengths = np.array([side.s.size - 1 for side in sides])
    total = int(lengths.sum())  # different rays
    inner_rows = layers * degree - 1  # between centre and rim
    centre = count
    inner = centre + 1 + np.arange(total * inner_rows).reshape(total, inner_rows)
    rim = centre + 1 + total * inner_rows + np.arange(total)
    middle = centre + 1 + total * (inner_rows + 1) + np.arange(total * (degree - 1)).reshape(total, degree - 1)
    levels = np.concatenate(([0.0], *(rings[k] + (rings[k + 1] - rings[k]) * share[1:] for k in range(layers))))
    nodes, places, shape, solid = [], [], [], []
    begin = 0
    for side, length in zip(sides, lengths, strict=True):
        ray = (begin + np.arange(length + 1)) % total
        outer = np.where(side.meets, side.edge_nodes, rim[ray])
        rho = np.hypot(side.h, side.s)
        unit = np.column_stack((side.h, side.s)) / rho[:, None]
        turn = np.array(
            [
                [np.cos(side.direction[0]), -np.sin(side.direction[0])],
                [np.sin(side.direction[0]), np.cos(side.direction[0])],
            ]
        )
        unit = unit @ turn.T
        reach = np.where(side.chord, rho, radius)
        column = np.column_stack((np.full(length + 1, centre), inner[ray], outer))
        at = (levels * reach[:, None])[:, :, None] * unit[:, None]
        fluid_column = np.column_stack((outer, middle[ray], side.edge_nodes))
        spread = reach[:, None] + share * (rho - reach)[:, None]
        fluid_at = spread[:, :, None] * unit[:, None]
        for first in range(0, length, degree):
            span = slice(first, first + degree + 1)
            on_chord = bool(side.chord[span].all()) and bool(side.chord[first + degree // 2 + (degree == 1)])
            frame = (side.h[0], radius, side.clearance[0], side.s[first], side.s[first + degree])
            for k in range(layers):
                part = slice(k * degree, (k + 1) * degree + 1)
                nodes.append(column[span, part].ravel())
                places.append(at[span, part].reshape(-1, 2))
                low, high = rings[k], rings[k + 1]
                shape.append((*frame, 0.0, low, 0.0, high) if on_chord else (*frame, low, 0.0, high, 0.0))
                solid.append(True)
            if not on_chord:
                nodes.append(fluid_column[span].ravel())
                places.append(fluid_at[span].reshape(-1, 2))
                shape.append((*frame, 1.0, 0.0, 0.0, 1.0))
                solid.append(bool(side.neck[span].all()))
        begin += int(length)
    used = centre + 1 + total * (inner_rows + 1) + total * (degree - 1)
    return np.array(nodes), np.array(places), np.array(shape), np.array(solid), int(used)


def unit_energies(mesh: PolarMesh, part: slice) -> Floats:
    r"""Energy matrices of elements of unit conductivity, shape (q, nn, nn).

    int int [(T_t/B)^2 + ((T_s - r_s T_t/B)/(phi' r))^2] r B phi' ds dt, B = b - a, by Gauss's rule with p + 3 points.
    """
    h, radius, clearance, low, high, r0, e0, r1, e1 = mesh.shape[part].T
    nodes = 0.5 * (lobatto_points(mesh.degree) + 1.0)
    points, weights = np.polynomial.legendre.leggauss(mesh.degree + 3)
    points, weights = 0.5 * (points + 1.0), 0.5 * weights
    powers = np.linalg.inv(np.vander(nodes, increasing=True))
    values = np.vander(points, nodes.size, increasing=True) @ powers
    slopes = np.column_stack([k * points ** max(k - 1, 0) for k in range(nodes.size)]) @ powers
    length = high - low
    out = np.zeros((h.size, nodes.size**2, nodes.size**2))
    for a, u in enumerate(points):
        s = low + length * u
        rho = np.hypot(h, s)
        beyond = (clearance * (h + radius) + s * s) / (rho + radius)  # rho - R
        turn = h / rho**2
        for b, t in enumerate(points):
            thickness = np.where((r0 == 1.0) & (e1 == 1.0), beyond, (r1 - r0) * radius + (e1 - e0) * rho)
            r = (r0 + t * (r1 - r0)) * radius + (e0 + t * (e1 - e0)) * rho
            skew = (e0 + t * (e1 - e0)) * s / rho
            along, across = np.outer(slopes[a], values[b]).ravel(), np.outer(values[a], slopes[b]).ravel()
            radial = across / thickness[:, None]
            around = (along / length[:, None] - skew[:, None] * radial) / (turn * r)[:, None]
            weight = (weights[a] * weights[b] * length * r * thickness * turn)[:, None, None]
            out += weight * (radial[:, :, None] * radial[:, None, :] + around[:, :, None] * around[:, None, :])
    return out
