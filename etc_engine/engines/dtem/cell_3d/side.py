"""One side of a facet: energy over bubbles on its boundary, jumps, rim temperatures and frame."""

from __future__ import annotations

import numpy as np
from numba import njit

from etc_engine.engines.dtem.cell_3d.face_basis import face_basis
from etc_engine.engines.dtem.cell_3d.face_mesh import boundary_nodes, fan_triangles, node_levels, node_positions
from etc_engine.engines.dtem.cell_3d.shell import shell_matrices


@njit(cache=True)
def contact_mass(nodes, triangles, on_disk, rule):  # type: ignore[no-untyped-def]
    """Mass matrix of the contact disk, int N_a N_b dA."""
    shapes, weights = rule
    mass = np.zeros((len(nodes), len(nodes)))
    for t in range(len(triangles)):
        if on_disk[t]:
            for g in range(len(weights)):
                a11 = a12 = a21 = a22 = 0.0
                for a in range(6):
                    u, v = nodes[triangles[t, a], 0], nodes[triangles[t, a], 1]
                    a11, a12 = a11 + shapes[g, 1, a] * u, a12 + shapes[g, 1, a] * v
                    a21, a22 = a21 + shapes[g, 2, a] * u, a22 + shapes[g, 2, a] * v
                w = weights[g] * abs(a11 * a22 - a12 * a21)
                for a in range(6):
                    for b in range(6):
                        mass[triangles[t, a], triangles[t, b]] += w * shapes[g, 0, a] * shapes[g, 0, b]
    return mass


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
def condense(energy, jump_energy, basis, parts, functions):  # type: ignore[no-untyped-def]
    """Project the facet's temperature on its frame and eliminate the bubbles of inner nodes.

    `parts` = (inner nodes, edge nodes of the disk, nodes with a jump). Unknowns left: bubbles of boundary nodes, jumps,
    rim temperatures, frame. On the edge of a disk rim and facet share their temperature and bubbles vanish.
    """
    inner, on_edge, jumping = parts
    n, frame, bubbles = len(basis), basis.shape[1], functions - 2
    for e in range(len(on_edge)):  # the rim follows the facet
        a = on_edge[e]
        energy[a] += energy[n + a]
        energy[:, a] += energy[:, n + a]
        for p in range(1, functions):
            energy[p * n + a] = 0.0
            energy[:, p * n + a] = 0.0
            energy[p * n + a, p * n + a] = 1.0
        if len(jumping) > 0:
            jump_energy[:, a] += jump_energy[:, n + a]
            for p in range(1, functions):
                jump_energy[:, p * n + a] = 0.0
    rim, jumps, outer = n, len(jumping), n - inner
    kept = bubbles * outer + jumps + rim + frame
    matrix, mixed = np.zeros((kept, kept)), np.zeros((bubbles * inner, kept))
    first_jump, first_rim, first_frame = bubbles * outer, bubbles * outer + jumps, bubbles * outer + jumps + rim
    projected = np.dot(np.ascontiguousarray(energy[:, :n]), basis)
    matrix[first_rim:first_frame, first_rim:first_frame] = energy[n : 2 * n, n : 2 * n]
    matrix[first_rim:first_frame, first_frame:] = projected[n : 2 * n]
    matrix[first_frame:, first_frame:] = np.dot(basis.T, projected[:n])
    inside = np.empty((bubbles * inner, bubbles * inner))
    for p in range(bubbles):
        at, put = (2 + p) * n, p * inner
        for q in range(bubbles):
            to = (2 + q) * n
            inside[put : put + inner, q * inner : (q + 1) * inner] = energy[at : at + inner, to : to + inner]
            mixed[put : put + inner, q * outer : (q + 1) * outer] = energy[at : at + inner, to + inner : to + n]
            matrix[p * outer : (p + 1) * outer, q * outer : (q + 1) * outer] = energy[
                at + inner : at + n, to + inner : to + n
            ]
        mixed[put : put + inner, first_rim:first_frame] = energy[at : at + inner, n : 2 * n]
        mixed[put : put + inner, first_frame:] = projected[at : at + inner]
        matrix[p * outer : (p + 1) * outer, first_rim:first_frame] = energy[at + inner : at + n, n : 2 * n]
        matrix[p * outer : (p + 1) * outer, first_frame:] = projected[at + inner : at + n]
    for j in range(jumps):
        a, row = jumping[j], first_jump + j
        for i in range(jumps):
            matrix[row, first_jump + i] = jump_energy[j, jumping[i]] + jump_energy[j, functions * n + jumping[i]]
        matrix[row, first_rim:first_frame] = jump_energy[j, n : 2 * n]
        matrix[row, first_frame:] = np.dot(jump_energy[j, :n], basis)
        for p in range(bubbles):
            for i in range(inner):
                mixed[p * inner + i, row] = jump_energy[j, (2 + p) * n + i]
    for i in range(kept):
        for j in range(i):
            matrix[i, j] = matrix[j, i]
    if inner > 0 and bubbles > 0:
        matrix -= np.dot(mixed.T, np.linalg.solve(inside, mixed))
    return matrix


@njit(cache=True)
def side_energy(corners, edges, bubbles, mesh, side, tables):  # type: ignore[no-untyped-def]
    """Matrix of one side of a facet, its rim stiffness, its nodes as seen from the centre, and its special nodes.

    `edges` = (pieces, forward, bubbles) of the facet's edges; `mesh` = (centre of the fan, levels of its rings, radius
    of its circle common to both sides, whether that is a contact disk); `side` = (heights, disk, medium, contact
    conductance per area on this side).
    """
    moments, rule = tables
    center, levels, circle, contact = mesh
    heights, own_disk, medium, conductance = side
    boundary = boundary_nodes(corners, edges[0])
    pieces = len(boundary) // 2
    level, ray, inner = node_levels(levels, pieces, contact)
    triangles, on_disk = fan_triangles(pieces, levels, contact)
    common = node_positions(boundary, center, levels, circle, level, ray)
    basis = face_basis(common, triangles, inner, edges, bubbles, rule)
    nodes, offsets = side_positions(boundary, center, levels, level, ray, heights, own_disk)
    energy, rim = shell_matrices(nodes, offsets, triangles, on_disk, medium, moments, rule)
    n, functions = len(level), moments.shape[1]
    on_edge = np.flatnonzero(level == 1.0) if contact else np.empty(0, dtype=np.int64)
    jumping = np.empty(0, dtype=np.int64)
    jump_energy = np.zeros((0, 0))
    if contact and conductance > 0.0:
        jumping = np.flatnonzero(level < 1.0)
        lens = shell_matrices(nodes, offsets, triangles[on_disk], on_disk[on_disk], medium, moments, rule)[0]
        mass = contact_mass(nodes[1], triangles, on_disk, rule)
        jump_energy = np.zeros((len(jumping), (functions + 1) * n))
        for j in range(len(jumping)):
            jump_energy[j, : functions * n] = lens[jumping[j]]
            jump_energy[j, functions * n :] = conductance * mass[jumping[j]]
    matrix = condense(energy, jump_energy, basis, (inner, on_edge, jumping), functions)
    points = np.empty((n, 3))
    for a in range(n):
        points[a, 0] = medium[0] + offsets[0, a]
        points[a, 1], points[a, 2] = nodes[0, a, 0], nodes[0, a, 1]
        points[a] /= np.sqrt((points[a] ** 2).sum())
    edge_basis = np.ascontiguousarray(basis[on_edge])
    return matrix, rim, points, inner, on_edge, edge_basis, len(jumping)
