"""Matrix of one Laguerre cell: sphere and shell, everything inside eliminated."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.linalg import lapack
from scipy.linalg.blas import dtrsm

from etc_engine.engines.dtem.cell_3d.side import side_energy
from etc_engine.engines.dtem.cell_3d.sphere_energy import green_matrix, sandwich
from etc_engine.laws.sphere import FOUR_PI
from etc_engine.laws.sphere_field import disk_temperature


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
    """Numbers of edge nodes, nodes and unknowns of the frame of a cell, and where each edge and side begins."""
    side_starts, side_faces, starts, edge_of_corner, vertex_starts, edge_starts, edges = topology
    pieces, level_starts = mesh
    edge_bubbles, face_bubbles = frame
    node = column = vertex_starts[cell + 1] - vertex_starts[cell]
    own = edges[edge_starts[cell] : edge_starts[cell + 1]]
    edge_places, edge_columns = np.empty(len(own), dtype=np.int64), np.empty(len(own), dtype=np.int64)
    for e in range(len(own)):
        edge_places[e], edge_columns[e] = node, column
        node += 2 * pieces[own[e]] - 1
        column += edge_bubbles[own[e]]
    outer = node
    sides = side_starts[cell + 1] - side_starts[cell]
    side_places, side_columns = np.empty(sides, dtype=np.int64), np.empty(sides, dtype=np.int64)
    for s in range(sides):
        face = side_faces[side_starts[cell] + s]
        side_places[s], side_columns[s] = node, column
        around = 0
        for c in range(starts[face], starts[face + 1]):
            around += pieces[edge_of_corner[c]]
        node += 1 + around * (4 * (level_starts[face + 1] - level_starts[face]) - 3)
        column += face_bubbles[face]
    return outer, node, column, (edge_places, edge_columns, side_places, side_columns)


@njit(cache=True)
def cell_energy(cell, topology, geometry, mesh, frame, media, tables):  # type: ignore[no-untyped-def]  # noqa: PLR0915
    """Energy of one cell over bubbles of edge nodes, rim, contact flows and frame.

    Every side of a facet adds its shell, the sphere k R S G S over the rim (`add_sphere`). Returns the matrix; where
    the frame begins; weights of the mean rim temperature; the number of rim nodes; and for every side the place of its
    bubbles in the frame, and its middle from the centre.
    """
    side_starts, side_faces, side_ends, starts, edge_of_corner, vertex_starts, edge_starts, edges = topology[:8]
    corner_vertices, corner_edges, forward = topology[8:]
    corners, axes, heights, disks = geometry
    pieces, centers, level_starts, levels, circles, contacts = mesh
    edge_bubbles, face_bubbles, powers = frame
    radius, sphere, fluid, resistances = media
    moments, rule, green = tables
    bubbles = moments.shape[1] - 2
    outer, nodes, columns, places = cell_sizes(
        cell,
        (side_starts, side_faces, starts, edge_of_corner, vertex_starts, edge_starts, edges),
        (pieces, level_starts),
        (edge_bubbles, face_bubbles),
    )
    edge_places, edge_columns, side_places, side_columns = places
    flows, first_rim = len(resistances), bubbles * outer
    first_flow = first_rim + nodes
    first = first_flow + flows
    matrix = np.zeros((first + columns, first + columns))
    directions, angles = np.zeros((nodes, 3)), np.zeros(nodes)
    arms = np.zeros((len(side_places), 3))
    normals, sines = np.zeros((flows, 3)), np.zeros(flows)
    room = 0
    for s in range(len(side_places)):
        after = side_places[s + 1] if s + 1 < len(side_places) else nodes
        room += (3 * (after - side_places[s])) ** 2  # a side has at most three nodes per inner node
    rows, cols, values = np.empty(room, dtype=np.int64), np.empty(room, dtype=np.int64), np.empty(room)
    entries, flow = 0, 0
    for s in range(len(side_places)):
        face, end = side_faces[side_starts[cell] + s], side_ends[side_starts[cell] + s]
        span = slice(starts[face], starts[face + 1])
        own_edges = edge_of_corner[span]
        count = face_bubbles[face]
        local, rim, own_angles, points, inner, mean, arm = side_energy(
            corners[span],
            (pieces[own_edges], forward[span], edge_bubbles[own_edges]),
            powers[:count],
            (centers[face], levels[level_starts[face] : level_starts[face + 1]], circles[face], contacts[face]),
            (heights[face, end], disks[face, end], radius, fluid),
            (moments, rule),
        )
        n = len(points)
        edge_nodes = boundary_places(
            corner_vertices[end, span], corner_edges[end, span], forward[span], pieces[own_edges], edge_places
        )
        where = np.empty(len(local), dtype=np.int64)
        at = 0
        for p in range(bubbles):
            for a in range(n - inner):
                where[at] = p * outer + edge_nodes[a]
                at += 1
        first_own = at
        for a in range(n):
            where[at] = first_rim + (side_places[s] + a if a < inner else edge_nodes[a - inner])
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
        height = sign * (radius + heights[face, end, 0])
        for axis in range(3):
            arms[s, axis] = height * axes[face, 0, axis] + arm[0] * axes[face, 1, axis] + arm[1] * axes[face, 2, axis]
        for a in range(n):
            node = where[first_own + a] - first_rim
            angles[node] += own_angles[a]
            for axis in range(3):
                directions[node, axis] = (
                    sign * points[a, 0] * axes[face, 0, axis]
                    + points[a, 1] * axes[face, 1, axis]
                    + points[a, 2] * axes[face, 2, axis]
                )
        for a in range(n):
            for b in range(n):
                if rim[a, b] != 0.0:
                    rows[entries] = where[first_own + a] - first_rim
                    cols[entries] = where[first_own + b] - first_rim
                    values[entries] = rim[a, b]
                    entries += 1
        if contacts[face]:
            sines[flow] = disks[face, end, 1] / radius
            for axis in range(3):
                normals[flow, axis] = sign * axes[face, 0, axis]
            for c in range(len(mean)):
                matrix[first_flow + flow, where[frame_start + c]] += mean[c]
                matrix[where[frame_start + c], first_flow + flow] += mean[c]
            flow += 1
    ball = sandwich(green_matrix(directions, green), rows[:entries], cols[:entries], values[:entries])
    add_sphere(
        matrix, (first_rim, first_flow), sphere * radius, (ball, directions, angles), (normals, sines, resistances)
    )
    weights = np.zeros(first)  # mean of u over the sphere's surface
    weights[first_rim:first_flow] = angles / angles.sum()
    return matrix, first, weights, nodes, side_columns, arms


@njit(cache=True)
def add_sphere(matrix, places, strength, rim, contacts):  # type: ignore[no-untyped-def]
    r"""Add the sphere: temperature u from the rim and N_c Q_c from the flows Q_c through contact disks.

    N_c is the potential of a disk that sends out its flow as an isothermal disk does, and takes it in uniformly over
    the surface; `resistances` are the temperatures of disk c by unit flows, contact resistance included. With the rim
    at z = u + N Q the stationary value over u and Q of

        (1/2) k R u.S G S u - mean(u) sum Q - (1/2) Q.H Q + tau.Q + shell(z)

    is half of the energy; tau are the temperatures of the contact disks. In vacuum u is uniform, and this is the
    network of contact resistances of the sphere.
    """
    first_rim, first_flow = places
    ball, directions, angles = rim
    normals, sines, resistances = contacts
    nodes, flows = len(ball), len(resistances)
    first = first_flow + flows
    total = angles.sum()
    if flows > 0:
        potential = np.empty((nodes, flows))
        for c in range(flows):
            a = np.arcsin(min(sines[c], 1.0))
            for i in range(nodes):
                cosine = 0.0
                for axis in range(3):
                    cosine += directions[i, axis] * normals[c, axis]
                potential[i, c] = disk_temperature(1.0, cosine, a) / (FOUR_PI * strength)
        carried = np.dot(np.ascontiguousarray(matrix[:, first_rim:first_flow]), potential)
        both = np.dot(potential.T, np.ascontiguousarray(carried[first_rim:first_flow]))
        for c in range(flows):
            for i in range(len(matrix)):
                value = carried[i, c]
                if first_rim <= i < first_flow:
                    value -= angles[i - first_rim] / total
                elif first_flow <= i < first:
                    value = both[i - first_flow, c] - resistances[i - first_flow, c]
                matrix[i, first_flow + c] += value
                if i < first_flow or i >= first:
                    matrix[first_flow + c, i] += value
    for a in range(nodes):
        for b in range(nodes):
            matrix[first_rim + a, first_rim + b] += strength * 0.5 * (ball[a, b] + ball[b, a])


def eliminate(
    matrix: NDArray[np.float64], inside: int, weights: NDArray[np.float64], definite: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Schur complement of the unknowns from `inside` on, and a weighted mean of the others over them.

    Parameters
    ----------
    matrix : ndarray, shape (n, n)
        Symmetric.
    inside : int
        Unknowns eliminated.
    weights : ndarray, shape (inside,)
    definite : bool
        Whether the eliminated block is positive definite; with contact flows it is not.

    Returns
    -------
    ndarray, shape (n - inside, n - inside)
        Energy of the frame with everything inside in balance.
    ndarray, shape (n - inside,)
        ``weights`` times the unknowns inside, as a function of the frame.
    """
    block, mixed = matrix[:inside, :inside], matrix[:inside, inside:]
    if definite:
        factor, info = lapack.dpotrf(block.T, lower=1, clean=0)
        if info == 0:
            half = dtrsm(1.0, factor, np.column_stack((mixed, weights)), lower=1)
            left: NDArray[np.float64] = matrix[inside:, inside:] - half[:, :-1].T @ half[:, :-1]
            return 0.5 * (left + left.T), -half[:, -1] @ half[:, :-1]
    solved = np.linalg.solve(block, mixed)
    left = matrix[inside:, inside:] - mixed.T @ solved
    return 0.5 * (left + left.T), -weights @ solved
