r"""The thermal element of one Laguerre cell: a disk and the fluid out to the polygon, as a matrix on its frame.

The energy of a cell is that of the whole disk (`rim`) plus that of the strips between rim and edges (`strip`). Inner
unknowns are, at every rim node c, the temperature W_c of the rim above that of the edge opposite to it, the bump m_c
halfway across the strip, and at resisting contacts the jump v_c to the edge. They are eliminated:

.. math:: K = D - G^T X^{-1} G .

K is symmetric, semi-definite, and gives no flow at a uniform temperature.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from etc_engine.engines.dtem.cell.elimination import eliminate_dense, solve_cyclic
from etc_engine.engines.dtem.cell.frame import HIGHEST, lagrange_values
from etc_engine.engines.dtem.cell.rim import disk_energy
from etc_engine.engines.dtem.cell.rim_grid import BONDED, CUT, NECK, TOUCHING
from etc_engine.engines.dtem.cell.strip import FIELDS, corner_exponent, strip_matrix

FLUID_THAT_COUNTS = 1e-4
"""Below this ratio k_f/k_s the fluid wedge beside a resisting contact is left to the strips."""


@njit(cache=True)
def own_coordinate(sigma, start, stop, corner, own):  # type: ignore[no-untyped-def]
    """Coordinate of one side for the common coordinate: piecewise linear, ends kept, corner to own corner."""
    if corner in (own, 0.0):
        return sigma
    if sigma < -corner:
        return start + (sigma - start) * (-own - start) / (-corner - start)
    if sigma > corner:
        return stop + (sigma - stop) * (own - stop) / (corner - stop)
    return sigma * own / corner


@njit(cache=True)
def place_rim(i, cells, edges, grid, degrees, rim):  # type: ignore[no-untyped-def]
    """Rim nodes of cell i: angle, side, common and own coordinate, frame weights. Returns how many.

    ``rim`` is (angles, side of node, edge of side, forward, sigma, own, weights).
    """
    starts, side_edges, side_forward = cells
    angles, sides, edge_of, forward, sigmas, owns, weights = rim
    count = 0
    for side in range(starts[i + 1] - starts[i]):
        e = side_edges[starts[i] + side]
        ahead = side_forward[starts[i] + side]
        own = 0 if ahead else 1
        edge_of[side], forward[side] = e, ahead
        direction = edges.angles[e] + (0.0 if ahead else math.pi)
        first, last = grid.starts[e], grid.starts[e + 1] - 1
        start, stop = edges.ends[e, 0], edges.ends[e, 1]
        if not ahead:
            start, stop = -stop, -start
        for k in range(last - first):
            sigma = grid.points[first + k] if ahead else -grid.points[last - k]
            s = own_coordinate(sigma, start, stop, edges.corners[e], edges.own_corners[e, own])
            turn = math.atan2(s, edges.distances[e, own])
            if k == 0 and count > 0:  # angles ascend from side to side
                while direction + turn < angles[count - 1]:
                    direction += 2.0 * math.pi
                while direction + turn >= angles[count - 1] + 2.0 * math.pi:
                    direction -= 2.0 * math.pi
            angles[count] = direction + turn
            sides[count], sigmas[count], owns[count] = side, sigma, s
            weights[count, :] = 0.0
            lagrange_values(2.0 * (sigma - start) / (stop - start) - 1.0, degrees[e], weights[count])
            if k == 0:
                weights[count, :] = 0.0
                weights[count, 0] = 1.0
            count += 1
    return count


@njit(cache=True)
def number_unknowns(count, edges, rim, numbers):  # type: ignore[no-untyped-def]
    """Dense unknowns of the rim nodes; returns how many.

    ``numbers`` is (of W, of v, whether m lives): -1 marks what is held at zero. Where rim and edge meet (a touching
    point, the ends of a contact) W and m are zero; a resisting contact has v there instead, equal to W.
    """
    of_rim, of_jump, bump = numbers
    _, sides, edge_of, _, sigmas, _, _ = rim
    found = count
    uniform, uniform_side = -1, -1
    for c in range(count):
        e = edge_of[sides[c]]
        kind, corner = edges.kind[e], edges.corners[e]
        at_corner = abs(abs(sigmas[c]) - corner) <= 1e-12 * corner and kind >= CUT
        meets = at_corner and kind != NECK
        if kind == TOUCHING or (kind == NECK and edges.widths[e] == 0.0):
            meets = meets or sigmas[c] == 0.0
        resists = edges.resistances[e] > 0.0 and kind >= CUT and (abs(sigmas[c]) < corner or at_corner)
        of_rim[c], of_jump[c], bump[c] = c, -1, not meets
        if not resists:
            if meets:
                of_rim[c] = -1
        elif edges.uniform_jump:
            if uniform_side != sides[c]:
                uniform, uniform_side = found, sides[c]
                found += 1
            of_jump[c] = uniform
            if meets:
                of_rim[c] = uniform
        elif meets:
            of_jump[c] = c
        else:
            of_jump[c] = found
            found += 1
    return found


@njit(cache=True)
def strip_of(c, following, i, edges, rim, materials, local):  # type: ignore[no-untyped-def]
    """Strip matrix of the interval after node c, the resistance of a contact in it; returns the coefficients used."""
    _, sides, edge_of, forward, sigmas, owns, _ = rim
    radii, solid, fluid = materials
    side = sides[c]
    e = edge_of[side]
    own = 0 if forward[side] else 1
    start, stop, from_s, to_s = sigmas[c], 0.0, owns[c], 0.0
    if sides[following] == side and following > 0:
        stop, to_s = sigmas[following], owns[following]
    else:
        stop = edges.ends[e, 1] if forward[side] else -edges.ends[e, 0]
        to_s = stop
    kind, corner, radius = edges.kind[e], edges.corners[e], radii[i]
    inside = kind >= CUT and abs(start + stop) < 2.0 * corner
    h, clearance = edges.distances[e, own], edges.clearances[e, own]
    if inside and kind == BONDED:
        half = edges.half_angles[e, own]
        scale = radius * math.cos(half) / h
        clearance = -2.0 * radius * math.sin(0.5 * half) ** 2
        h = radius + clearance
        from_s, to_s = from_s * scale, to_s * scale
    resists = edges.resistances[e] > 0.0
    fields = FIELDS if inside and resists else 6
    strip_matrix(h, clearance, radius, from_s, to_s, solid[i] if inside else fluid, fields, local)
    at_start, at_stop = abs(abs(start) - corner) <= 1e-12 * corner, abs(abs(stop) - corner) <= 1e-12 * corner
    if inside and resists:
        # both sides of a contact take half of its resistance; at a wall the disk takes all of it
        share = (stop - start) / (2.0 * corner) * (1.0 if edges.at_wall[e] else 2.0) / edges.resistances[e]
        local[6, 6] += share / 3.0
        local[7, 7] += share / 3.0
        local[6, 7] += share / 6.0
        local[7, 6] += share / 6.0
        if kind == NECK and not edges.uniform_jump:
            exponent = 2.0 / math.pi * math.atan(math.sqrt(fluid / solid[i]))
            wedge = fluid / math.tan(0.5 * math.pi * exponent)
            local[6, 6] += wedge if at_start else 0.0
            local[7, 7] += wedge if at_stop else 0.0
    if not inside and resists and kind == CUT and (at_start or at_stop) and fluid > FLUID_THAT_COUNTS * solid[i]:
        # the fluid wedge at the end of the contact carries k_f cot(lambda a) times the square of the jump in it
        opening = math.acos(min(1.0, h / radius))
        wedge = 0.25 * fluid / math.tan(corner_exponent(solid[i], fluid, opening) * opening)
        local[:4, :] = 0.0
        local[:, :4] = 0.0
        local[0, 0] = local[0, 2] = local[2, 0] = local[2, 2] = wedge
    return fields


@njit(cache=True)
def reduce_cell(i, cells, edges, grid, degrees, storing, materials, work):  # type: ignore[no-untyped-def]
    """Eliminate the inner unknowns of cell i; a cell that is ``storing`` heat keeps the disk's mean as its last one.

    Returns (rim nodes, inner dense unknowns, size). In ``work`` are left: the reduced dense matrix, whose block
    [inner:size, inner:size] is K (upper triangle), and T^-1 times the coupling of the bumps m to the dense unknowns.
    """
    rim, numbers, matrix, coupling, solved, first, second, local = work
    count = place_rim(i, cells, edges, grid, degrees, rim)
    inner = number_unknowns(count, edges, rim, numbers)
    polygon = cells[0][i + 1] - cells[0][i]
    size = inner + polygon
    columns = np.empty((polygon, HIGHEST + 1), dtype=np.int64)
    for side in range(polygon):
        columns[side, 0], columns[side, 1] = inner + side, inner + (side + 1) % polygon
        for k in range(degrees[rim[2][side]] - 1):
            columns[side, 2 + k] = size
            size += 1
    size += 1 if storing else 0
    matrix[:size, :size] = 0.0
    coupling[:count, :size] = 0.0
    _add_disk(count, size, rim, columns, degrees, numbers[0], materials[1][i], matrix, first, second)
    if storing:
        _add_store(count, size, rim, columns, degrees, numbers[0], materials[1][i], matrix)
    diagonal, beside = np.zeros(count), np.zeros(count)
    places = (
        np.zeros((FIELDS, HIGHEST + 1), np.int64),
        np.zeros((FIELDS, HIGHEST + 1)),
        np.zeros(FIELDS, np.int64),
    )
    for c in range(count):
        d = c + 1 if c + 1 < count else 0
        fields = strip_of(c, d, i, edges, rim, materials, local)
        _spread(c, d, rim, numbers, columns, degrees, places)
        diagonal[c] += local[1, 1]
        diagonal[d] += local[3, 3]
        beside[c] += local[1, 3]
        _scatter(c, d, fields, local, places, matrix, coupling)
    for c in range(count):
        if not numbers[2][c]:  # m is held at zero
            diagonal[c], beside[c], beside[c - 1 if c > 0 else count - 1] = 1.0, 0.0, 0.0
            coupling[c, :size] = 0.0
        if numbers[0][c] != c and numbers[1][c] != c:  # a dense unknown that is not used
            matrix[c, c] = 1.0
    for c in range(count):
        for a in range(size):
            solved[c, a] = coupling[c, a]
    solve_cyclic(diagonal, beside, count, size, solved)
    _eliminate_bumps(count, size, coupling, solved, matrix)
    eliminate_dense(matrix, inner, size)
    return count, inner, size


@njit(cache=True)
def _eliminate_bumps(count, size, coupling, solved, matrix):  # type: ignore[no-untyped-def]
    """Subtract G^T (T^-1 G) from the upper triangle, of four nodes at a time that a dense unknown is coupled to."""
    first, last = np.full(size, count, np.int64), np.full(size, -1, np.int64)
    for c in range(count):
        for a in range(size):
            if coupling[c, a] != 0.0:
                first[a], last[a] = min(first[a], c), c
    nodes, shares = np.empty(4, np.int64), np.empty(4)
    for a in range(size):
        row, found = matrix[a, a:size], 0
        for c in range(first[a], last[a] + 1):
            if coupling[c, a] != 0.0:
                nodes[found], shares[found] = c, coupling[c, a]
                found += 1
            if found == 4 or (c == last[a] and found > 0):
                for k in range(found, 4):
                    nodes[k], shares[k] = c, 0.0
                found = 0
                r0, r1, r2, r3 = (
                    solved[nodes[0], a:size],
                    solved[nodes[1], a:size],
                    solved[nodes[2], a:size],
                    solved[nodes[3], a:size],
                )
                w0, w1, w2, w3 = shares[0], shares[1], shares[2], shares[3]
                for b in range(row.size):  # slices from 0: vector instructions
                    value = row[b] - w0 * r0[b] - w1 * r1[b]
                    row[b] = value - w2 * r2[b] - w3 * r3[b]


@njit(cache=True)
def _spread(c, d, rim, numbers, columns, degrees, places):  # type: ignore[no-untyped-def]
    """Dense columns and weights of the coefficients of the interval from node c to d; bumps have none."""
    sides, weights = rim[1], rim[6]
    where, share, many = places
    for end in range(2):
        node = c if end == 0 else d
        for field, number in ((2 * end, numbers[0][node]), (6 + end, numbers[1][node])):
            where[field, 0], share[field, 0], many[field] = number, 1.0, 1 if number >= 0 else 0
        field, found = 4 + end, 0
        for k in range(degrees[rim[2][sides[node]]] + 1):
            if weights[node, k] != 0.0:
                where[field, found], share[field, found] = columns[sides[node], k], weights[node, k]
                found += 1
        many[field] = found


@njit(cache=True)
def _scatter(c, d, fields, local, places, matrix, coupling):  # type: ignore[no-untyped-def]
    """Add a strip matrix to the upper triangle of the dense matrix and to the coupling of the bumps."""
    where, share, many = places
    for b in range(fields):
        for q in range(many[b]):
            column, weight = where[b, q], share[b, q]
            coupling[c, column] += local[1, b] * weight
            coupling[d, column] += local[3, b] * weight
            for a in range(fields):
                value = local[a, b] * weight
                for p in range(many[a]):
                    if where[a, p] <= column:
                        matrix[where[a, p], column] += share[a, p] * value


@njit(cache=True)
def _add_disk(count, size, rim, columns, degrees, of_rim, solid, matrix, first, second):  # type: ignore[no-untyped-def]
    """Add the energy of the disk, a form of T_rim = Phi F + W, to the upper triangle of the dense matrix."""
    sides, weights = rim[1], rim[6]
    disk_energy(rim[0], count, solid, first, second)
    begin = columns[0, 0]
    product = first  # P = A Phi
    product[:count, : size - begin] = 0.0
    start = 0
    while start < count:  # side by side
        side, stop = sides[start], start + 1
        while stop < count and sides[stop] == side:
            stop += 1
        for k in range(degrees[rim[2][side]] + 1):
            column = columns[side, k] - begin
            for i in range(0, count - 3, 4):  # four sums at once, which need not wait for each other
                a, b, c, d = product[i, column], product[i + 1, column], product[i + 2, column], product[i + 3, column]
                for j in range(start, stop):
                    weight = weights[j, k]
                    a += second[i, j] * weight
                    b += second[i + 1, j] * weight
                    c += second[i + 2, j] * weight
                    d += second[i + 3, j] * weight
                product[i, column], product[i + 1, column], product[i + 2, column], product[i + 3, column] = a, b, c, d
            for i in range(count - count % 4, count):
                for j in range(start, stop):
                    product[i, column] += second[i, j] * weights[j, k]
        start = stop
    for i in range(count):
        row = of_rim[i]
        if row >= 0:
            for j in range(count):
                column = of_rim[j]
                if column >= row:
                    matrix[row, column] += second[i, j]
            for q in range(begin, size):
                matrix[row, q] += product[i, q - begin]
        for k in range(degrees[rim[2][sides[i]]] + 1):
            weight = weights[i, k]
            if weight != 0.0:
                row = columns[sides[i], k]
                target, source = matrix[row, row:size], product[i, row - begin : size - begin]
                for q in range(target.size):
                    target[q] += weight * source[q]


@njit(cache=True)
def _add_store(count, size, rim, columns, degrees, of_rim, solid, matrix):  # type: ignore[no-untyped-def]
    """Add 8 pi k (mean of the rim - mean of the disk)^2, the energy of heat stored evenly over a disk.

    A disk whose every part warms at one rate has T = harmonic part + rate (r^2 - R^2)/(4 a), so that its mean lags
    behind that of the rim by Q/(8 pi k) for a heat flow Q into it.
    """
    angles, sides, weights = rim[0], rim[1], rim[6]
    share = np.zeros(size)
    for c in range(count):
        before = angles[c - 1] if c > 0 else angles[count - 1] - 2.0 * math.pi
        after = angles[c + 1] if c < count - 1 else angles[0] + 2.0 * math.pi
        part = (after - before) / (4.0 * math.pi)
        if of_rim[c] >= 0:
            share[of_rim[c]] += part
        for k in range(degrees[rim[2][sides[c]]] + 1):
            share[columns[sides[c], k]] += part * weights[c, k]
    share[size - 1] = -1.0
    for a in range(size):
        value = 8.0 * math.pi * solid * share[a]
        if value != 0.0:
            for b in range(a, size):
                matrix[a, b] += value * share[b]


def workspace(nodes: int, sides: int, frame: int) -> tuple:
    """Room for `reduce_cell` on cells of at most so many rim nodes, sides and frame unknowns."""
    size = 2 * nodes + frame
    rim = (
        np.empty(nodes),
        np.empty(nodes, np.int64),
        np.empty(sides, np.int64),
        np.empty(sides, np.bool_),
        np.empty(nodes),
        np.empty(nodes),
        np.zeros((nodes, HIGHEST + 1)),
    )
    numbers = (np.empty(nodes, np.int64), np.empty(nodes, np.int64), np.empty(nodes, np.bool_))
    return (
        rim,
        numbers,
        np.empty((size, size)),
        np.empty((nodes, size)),
        np.empty((nodes, size)),
        np.empty((nodes, max(nodes, frame))),
        np.empty((nodes, nodes)),
        np.empty((FIELDS, FIELDS)),
    )
