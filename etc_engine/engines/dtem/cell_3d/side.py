"""One side of a facet: energy over bubbles on its boundary, jumps, rim temperatures and frame."""

from __future__ import annotations

import numpy as np
from numba import njit

from etc_engine.engines.dtem.cell_3d.face_basis import face_basis
from etc_engine.engines.dtem.cell_3d.face_mesh import boundary_nodes, fan_triangles, node_levels, node_positions
from etc_engine.engines.dtem.cell_3d.shell import shell_matrices


@njit(cache=True)
def disk_mean(nodes, basis, level, rings_inside, pieces):  # type: ignore[no-untyped-def]
    """Mean of the frame over a contact disk, weighted with 1/sqrt(c^2 - rho^2) as its flux is.

    A third of the centre and two thirds of the edge: exact up to the second degree. The edge by Simpson's rule.
    """
    columns = basis.shape[1]
    mean = np.empty(columns)
    for i in range(columns):
        mean[i] = basis[0, i] / 3.0
    first = 1 + (rings_inside - 1) * 2 * pieces
    if level[first] != 1.0:
        first = len(level) - 2 * pieces
    for k in range(pieces):
        a, b, c = first + 2 * k, first + 2 * k + 1, first + (2 * k + 2) % (2 * pieces)
        turn = nodes[a, 0] * nodes[c, 1] - nodes[a, 1] * nodes[c, 0]
        along = nodes[a, 0] * nodes[c, 0] + nodes[a, 1] * nodes[c, 1]
        part = np.arctan2(turn, along) / (18.0 * np.pi)
        for i in range(columns):
            mean[i] += part * (basis[a, i] + 4.0 * basis[b, i] + basis[c, i])
    return mean


@njit(cache=True)
def use_as_unknown(basis, mean, column):  # type: ignore[no-untyped-def]
    """Make the temperature of the facet's middle, `mean` over the frame, the unknown of a column, in place.

    With it a uniform temperature has equal unknowns at vertices and middles, as multigrid expects.
    """
    nodes, columns, scale = basis.shape[0], basis.shape[1], mean[column]
    for a in range(nodes):
        value = basis[a, column] / scale
        for c in range(columns):
            basis[a, c] -= mean[c] * value
        basis[a, column] = value
    for c in range(columns):
        mean[c] = 1.0 if c == column else 0.0


@njit(cache=True)
def side_positions(boundary, center, levels, level, ray, heights, disk):  # type: ignore[no-untyped-def]
    """Nodes of this side around the disk and on it: positions (2, n, 2) and heights above the sphere's radius (2, n).

    `heights` = (facet, contact plane) above the radius; `disk` = (radius of the disk's edge in the facet, radius of
    the disk in its plane, lift of the facet at the edge of the disk).
    """
    n = len(level)
    nodes, offsets = np.empty((2, n, 2)), np.empty((2, n))
    nodes[0] = node_positions(boundary, center, levels, disk[0], level, ray)
    scale = disk[1] / disk[0] if disk[1] > 0.0 else 1.0
    for a in range(n):
        around = max(min(2.0 - level[a], 1.0), 0.0) if disk[1] > 0.0 else 0.0
        offsets[0, a] = heights[0] + around * disk[2]
        offsets[1, a] = heights[1]
        nodes[1, a, 0], nodes[1, a, 1] = scale * nodes[0, a, 0], scale * nodes[0, a, 1]
    return nodes, offsets


@njit(cache=True)
def condense(energy, basis, level, inner, contact):  # type: ignore[no-untyped-def]
    """Project the facet's temperature on its frame and eliminate the bubbles of inner nodes.

    `energy` holds the facet's temperature, the rim's and the bubbles, in that order. Unknowns left: bubbles of boundary
    nodes, rim temperatures, frame. On the edge of a contact disk the fluid ends: the rim has the facet's temperature,
    and there are no bubbles there and on the disk.
    """
    n, frame = len(basis), basis.shape[1]
    functions = len(energy) // n
    bubbles = functions - 2
    if contact:
        for a in range(inner):
            if level[a] == 1.0:
                for b in range(functions * n):
                    energy[a, b] += energy[n + a, b]
                    energy[n + a, b] = 0.0
                for b in range(functions * n):
                    energy[b, a] += energy[b, n + a]
                    energy[b, n + a] = 0.0
            if level[a] <= 1.0:
                for p in range(2, functions):
                    for b in range(functions * n):
                        energy[p * n + a, b] = 0.0
                        energy[b, p * n + a] = 0.0
                    energy[p * n + a, p * n + a] = 1.0
    outer = n - inner
    # the order of the rows kept: bubbles of boundary nodes, rim, frame; then the inner bubbles
    order = np.empty(functions * n - n, dtype=np.int64)
    at = 0
    for p in range(2, functions):
        for a in range(inner, n):
            order[at] = p * n + a
            at += 1
    for a in range(n):
        order[at] = n + a
        at += 1
    for p in range(2, functions):
        for a in range(inner):
            order[at] = p * n + a
            at += 1
    projected = np.dot(np.ascontiguousarray(energy[:, :n]), basis)
    both = np.dot(basis.T, np.ascontiguousarray(projected[:n]))
    rim, inside = bubbles * outer + n, bubbles * inner
    kept = rim + frame
    matrix, mixed, block = np.empty((kept, kept)), np.empty((inside, kept)), np.empty((inside, inside))
    for i in range(kept):
        for j in range(kept):
            if i < rim and j < rim:
                matrix[i, j] = energy[order[i], order[j]]
            elif i < rim:
                matrix[i, j] = projected[order[i], j - rim]
            elif j < rim:
                matrix[i, j] = projected[order[j], i - rim]
            else:
                matrix[i, j] = both[i - rim, j - rim]
    for i in range(inside):
        for j in range(kept):
            mixed[i, j] = energy[order[rim + i], order[j]] if j < rim else projected[order[rim + i], j - rim]
        for j in range(inside):
            block[i, j] = energy[order[rim + i], order[rim + j]]
    if inside > 0:
        matrix -= np.dot(mixed.T, np.linalg.solve(block, mixed))
    return matrix


@njit(cache=True)
def side_energy(corners, edges, bubbles, mesh, side, tables):  # type: ignore[no-untyped-def]
    """Matrix of one side of a facet, its rim, and what a contact on it sees.

    `edges` = (pieces, forward, bubbles) of the facet's edges; `mesh` = (centre of the fan, levels of its rings, radius
    of its circle common to both sides, whether that is a contact disk); `side` = (heights, disk, radius, fluid).
    Returns the matrix of `condense`, stiffness and solid angles of the rim, unit directions of the nodes, the number
    of inner nodes, the temperature of the facet's middle over the frame, and where the middle lies in the plane.
    """
    moments, rule = tables
    center, levels, circle, contact = mesh
    heights, own_disk, radius, fluid = side
    boundary = boundary_nodes(corners, edges[0])
    pieces = len(boundary) // 2
    level, ray, inner = node_levels(levels, pieces)
    triangles, on_disk = fan_triangles(pieces, levels, contact)
    common = node_positions(boundary, center, levels, circle, level, ray)
    basis = face_basis(common, triangles, inner, edges, bubbles, rule)
    nodes, offsets = side_positions(boundary, center, levels, level, ray, heights, own_disk)
    energy, rim, angles = shell_matrices(nodes, offsets, triangles, on_disk, (radius, fluid), moments, rule)
    if contact:
        inside = 0
        while inside < len(levels) and levels[inside] <= 1.0:
            inside += 1
        mean = disk_mean(common, basis, level, inside, pieces)
    else:
        mean = basis[0].copy()
    arm = np.zeros(2)
    for k in range(len(corners)):
        for axis in range(2):
            arm[axis] += mean[k] * corners[k, axis]
    if len(bubbles) > 0:
        use_as_unknown(basis, mean, basis.shape[1] - len(bubbles))
    n = len(level)
    points = np.empty((n, 3))
    for a in range(n):
        x, y, z = radius + offsets[0, a], nodes[0, a, 0], nodes[0, a, 1]
        norm = np.sqrt(x * x + y * y + z * z)
        points[a, 0], points[a, 1], points[a, 2] = x / norm, y / norm, z / norm
    return condense(energy, basis, level, inner, contact), rim, angles, points, inner, mean, arm
