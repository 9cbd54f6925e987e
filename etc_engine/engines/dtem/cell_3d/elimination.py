"""Matrix of one Laguerre cell: sphere and shell, everything inside eliminated."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.linalg import lapack
from scipy.linalg.blas import dtrsm

from etc_engine.engines.dtem.cell_3d.side import side_energy
from etc_engine.engines.dtem.cell_3d.sphere_energy import green_matrix, sandwich


@njit(cache=True)
def boundary_places(corner_vertices, corner_edges, forward, pieces, edge_places):  # type: ignore[no-untyped-def]
    """Node inside the cell of every boundary node of a facet."""
    places = np.empty(2 * pieces.sum(), dtype=np.int64)
    at = 0
    for k in range(len(pieces)):
        count = 2 * pieces[k]
        places[at] = corner_vertices[k]
        for step in range(1, count):
            places[at + step] = edge_places[corner_edges[k]] + (step - 1 if forward[k] else count - 1 - step)
        at += count
    return places


@njit(cache=True)
def cell_sizes(cell, topology, mesh, frame):  # type: ignore[no-untyped-def]
    """Nodes before each edge and side, unknowns of the frame before each, and the places left for jumps."""
    side_starts, side_faces, starts, edge_of_corner, vertex_starts, edge_starts, edges = topology
    pieces, level_starts, levels, jumping_faces = mesh
    edge_bubbles, face_bubbles = frame
    vertices = vertex_starts[cell + 1] - vertex_starts[cell]
    own = edges[edge_starts[cell] : edge_starts[cell + 1]]
    edge_places, edge_columns = np.empty(len(own), dtype=np.int64), np.empty(len(own), dtype=np.int64)
    node, column = vertices, vertices
    for e in range(len(own)):
        edge_places[e], edge_columns[e] = node, column
        node += 2 * pieces[own[e]] - 1
        column += edge_bubbles[own[e]]
    outer = node
    sides = side_starts[cell + 1] - side_starts[cell]
    side_places, side_columns = np.empty(sides, dtype=np.int64), np.empty(sides, dtype=np.int64)
    jump_places = np.empty(sides, dtype=np.int64)
    jumps = 0
    for s in range(sides):
        face = side_faces[side_starts[cell] + s]
        side_places[s], side_columns[s], jump_places[s] = node, column, jumps
        around = 0
        for c in range(starts[face], starts[face + 1]):
            around += pieces[edge_of_corner[c]]
        rings = level_starts[face + 1] - level_starts[face]
        node += 1 + around * (4 * rings - 3)
        column += face_bubbles[face]
        if jumping_faces[face]:
            inside = 0
            for r in range(rings):
                if levels[level_starts[face] + r] <= 1.0:
                    inside += 1
            jumps += 1 + around * (4 * inside - 3)
    return outer, node, column, jumps, (edge_places, edge_columns, side_places, side_columns, jump_places)


@njit(cache=True)
def cell_energy(cell, topology, geometry, mesh, frame, media, tables):  # type: ignore[no-untyped-def]  # noqa: PLR0915
    """Energy of one cell over bubbles of edge nodes, jumps, rim temperatures and frame, and where the frame begins.

    The sphere adds k R S G S over the rim; every side of a facet adds its shell.
    """
    side_starts, side_faces, side_ends, starts, edge_of_corner, vertex_starts, edge_starts, edges = topology[:8]
    corner_vertices, corner_edges, forward = topology[8:]
    corners, axes, heights, disks = geometry
    pieces, centers, level_starts, levels, circles, contacts = mesh
    edge_bubbles, face_bubbles, powers = frame
    radius, sphere, fluid, conductances = media
    moments, rule, green = tables
    bubbles = moments.shape[1] - 2
    outer, nodes, columns, jumps, places = cell_sizes(
        cell,
        (side_starts, side_faces, starts, edge_of_corner, vertex_starts, edge_starts, edges),
        (pieces, level_starts, levels, (conductances > 0.0) & contacts),
        (edge_bubbles, face_bubbles),
    )
    edge_places, edge_columns, side_places, side_columns, jump_places = places
    first_rim = bubbles * outer + jumps
    first = first_rim + nodes
    matrix = np.zeros((first + columns, first + columns))
    directions = np.zeros((nodes, 3))
    room = 16 * nodes + 4096
    rows, cols, values = np.empty(room, dtype=np.int64), np.empty(room, dtype=np.int64), np.empty(room)
    entries = 0
    dead = np.empty(nodes, dtype=np.int64)
    dead_basis = np.zeros((nodes, columns))
    dead_count = 0
    for s in range(len(side_places)):
        face, end = side_faces[side_starts[cell] + s], side_ends[side_starts[cell] + s]
        span = slice(starts[face], starts[face + 1])
        own_edges = edge_of_corner[span]
        count = face_bubbles[face]
        local, rim, points, inner, on_edge, edge_basis, own_jumps = side_energy(
            corners[span],
            (pieces[own_edges], forward[span], edge_bubbles[own_edges]),
            powers[:count],
            (centers[face], levels[level_starts[face] : level_starts[face + 1]], circles[face], contacts[face]),
            (heights[face, end], disks[face, end], (radius, fluid, sphere), conductances[face]),
            (moments, rule),
        )
        n = len(points)
        edge_nodes = boundary_places(
            corner_vertices[end, span], corner_edges[end, span], forward[span], pieces[own_edges], edge_places
        )
        node = np.empty(n, dtype=np.int64)
        for a in range(n):
            node[a] = side_places[s] + a if a < inner else edge_nodes[a - inner]
        where = np.empty(len(local), dtype=np.int64)
        at = 0
        for p in range(bubbles):
            for a in range(n - inner):
                where[at] = p * outer + edge_nodes[a]
                at += 1
        for j in range(own_jumps):
            where[at] = bubbles * outer + jump_places[s] + j
            at += 1
        for a in range(n):
            where[at] = first_rim + node[a]
            at += 1
        frame_start = at
        for k in range(len(own_edges)):
            where[at] = first + corner_vertices[end, starts[face] + k]
            at += 1
        for k in range(len(own_edges)):
            for b in range(edge_bubbles[own_edges[k]]):
                where[at] = first + edge_columns[corner_edges[end, starts[face] + k]] + b
                at += 1
        for b in range(count):
            where[at] = first + side_columns[s] + b
            at += 1
        for a in range(len(local)):
            for b in range(len(local)):
                matrix[where[a], where[b]] += local[a, b]
        sign = 1.0 if end == 0 else -1.0
        for a in range(n):
            for axis in range(3):
                directions[node[a], axis] = (
                    sign * points[a, 0] * axes[face, 0, axis]
                    + points[a, 1] * axes[face, 1, axis]
                    + points[a, 2] * axes[face, 2, axis]
                )
        if entries + n * n > len(rows):
            more = len(rows) + n * n
            rows = np.concatenate((rows, np.empty(more, dtype=np.int64)))
            cols = np.concatenate((cols, np.empty(more, dtype=np.int64)))
            values = np.concatenate((values, np.empty(more)))
        for a in range(n):
            for b in range(n):
                if rim[a, b] != 0.0:
                    rows[entries], cols[entries], values[entries] = node[a], node[b], rim[a, b]
                    entries += 1
        for e in range(len(on_edge)):
            dead[dead_count] = node[on_edge[e]]
            for c in range(edge_basis.shape[1]):
                dead_basis[dead_count, where[frame_start + c] - first] = edge_basis[e, c]
            dead_count += 1
    ball = sandwich(green_matrix(directions, green), rows[:entries], cols[:entries], values[:entries])
    _add_ball(matrix, sphere * radius * ball, dead[:dead_count], dead_basis[:dead_count], first_rim)
    return matrix, first, directions


@njit(cache=True)
def _add_ball(matrix, ball, dead, dead_basis, first_rim):  # type: ignore[no-untyped-def]
    """Add the sphere's energy; on the edge of a contact disk the rim has the temperature of the facet."""
    nodes = len(ball)
    first = first_rim + nodes
    free = np.ones(nodes)
    free[dead] = 0.0
    if len(dead) > 0:
        to_frame = np.dot(np.ascontiguousarray(ball[:, dead]), dead_basis)
        both = np.dot(dead_basis.T, np.ascontiguousarray(to_frame[dead]))
        matrix[first:, first:] += both
        for a in range(nodes):
            for c in range(len(both)):
                value = free[a] * to_frame[a, c]
                matrix[first_rim + a, first + c] += value
                matrix[first + c, first_rim + a] += value
    for a in range(nodes):
        for b in range(nodes):
            matrix[first_rim + a, first_rim + b] += free[a] * free[b] * 0.5 * (ball[a, b] + ball[b, a])


def eliminate(matrix: NDArray[np.float64], inside: int, definite: bool) -> NDArray[np.float64]:
    """Schur complement of the unknowns from `inside` on: energy of the frame with everything inside in balance.

    Parameters
    ----------
    matrix : ndarray, shape (n, n)
        Symmetric.
    inside : int
        Unknowns eliminated.
    definite : bool
        Whether the eliminated block is positive definite; with contact disks (signed shell) it need not be.

    Returns
    -------
    ndarray, shape (n - inside, n - inside)
    """
    block, mixed = matrix[:inside, :inside], matrix[:inside, inside:]
    if definite:
        factor, info = lapack.dpotrf(block.T, lower=1, clean=0)
        if info == 0:
            half = dtrsm(1.0, factor, mixed, lower=1)
            left: NDArray[np.float64] = matrix[inside:, inside:] - half.T @ half
            return 0.5 * (left + left.T)
    left = matrix[inside:, inside:] - mixed.T @ np.linalg.solve(block, mixed)
    return 0.5 * (left + left.T)
