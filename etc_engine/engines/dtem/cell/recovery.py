r"""Temperatures inside cells: around every disk, in it, and in the fluid up to the edges.

In a disk the temperature is the harmonic function of its rim temperature, by Fourier's series
T(r, phi) = sum_k (r/R)^|k| c_k exp(i k phi). In the strip outside it is the interpolation of the element (`strip`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from etc_engine.arrays import Floats, Ints
from etc_engine.engines.dtem.cell.assembly import rim_nodes
from etc_engine.engines.dtem.cell.element import reduce_cell, strip_of, workspace
from etc_engine.engines.dtem.cell.elimination import substitute_back
from etc_engine.engines.dtem.cell.steady import CellModel, CellSolution
from etc_engine.engines.dtem.cell.strip import FIELDS

HARMONICS = 48
"""Fourier modes of the temperature inside a disk."""


@dataclass(frozen=True, eq=False)
class CellField:
    """Temperatures of all cells under one load, mean gradient included.

    Parameters
    ----------
    model : CellModel
    starts : ndarray of int64, shape (n + 1,)
        The rim nodes of disk i are the rows ``starts[i]`` to ``starts[i + 1]``, counter-clockwise.
    angles : ndarray [rad]
        Ascending within a disk.
    sides : ndarray of int64
        Row of the side (of the Laguerre cells) whose strip begins at the node.
    rim, edge, bump : ndarray [K]
        Temperature of the rim, of the edge opposite to it, and of the quadratic part halfway across the strip.
    disk_temperatures : ndarray, shape (n,) [K]
        Mean temperature of each disk.
    edge_flows : ndarray, shape (m,) [W/m]
        Heat flow through each edge, from its first cell to the second.
    """

    model: CellModel
    starts: Ints
    angles: Floats
    sides: Ints
    rim: Floats
    edge: Floats
    bump: Floats
    disk_temperatures: Floats
    edge_flows: Floats


def recover_cells(solution: CellSolution, load: int = 0) -> CellField:
    """Temperatures inside the cells of a steady solution.

    Parameters
    ----------
    solution : CellSolution
    load : int
        Column of the solution.

    Returns
    -------
    CellField
        Along a periodic axis the disks are at their home images and the mean gradient is included.

    Notes
    -----
    The heat flow through an edge is the mean of what enters its two cells; what enters at a vertex counts half for
    either edge that ends there, which is good to a few per cent.
    """
    model = solution.model
    frame, geometry = model.frame, model.geometry
    values = solution.fluctuations[frame.unknowns, load]
    centers = np.zeros(geometry.count)
    if solution.periodic:
        axis = solution.axes[load]
        values = values + frame.positions[:, axis]
        centers = geometry.centers[:, axis]
    return recover_values(model, values, centers)


def recover_values(model: CellModel, values: Floats, shifts: Floats) -> CellField:
    """Temperatures inside cells from those on their frames.

    Parameters
    ----------
    model : CellModel
    values : ndarray [K]
        One for each entry of ``model.frame.unknowns``.
    shifts : ndarray, shape (n,) [K]
        Added to the temperatures of each cell.
    """
    cells, frame, geometry = model.geometry.cells, model.frame, model.geometry
    nodes = rim_nodes(cells, model.grid)
    starts = np.concatenate(([0], np.cumsum(nodes)))
    out = np.empty((5, starts[-1]))
    sides = np.empty(starts[-1], dtype=np.int64)
    flows = np.zeros(cells.edges.size)
    work = workspace(int(nodes.max()), int(np.diff(cells.starts).max()), int(np.diff(frame.starts).max()))
    _recover(
        (cells.starts, cells.edges, cells.forward),
        geometry.edges,
        model.grid,
        (frame.starts, frame.degrees, frame.storing, values),
        model.materials,
        work,
        (starts, out, sides, flows),
    )
    owner = np.repeat(np.arange(geometry.count), nodes)
    out[1] += shifts[owner]
    out[2] += shifts[owner]
    signed = np.where(cells.forward, -1.0, 1.0) * flows
    number = np.bincount(cells.edges, minlength=cells.edge_count)
    edge_flows = np.bincount(cells.edges, signed, minlength=cells.edge_count) / number
    after = np.roll(out[0], -1)
    after[starts[1:] - 1] = out[0][starts[:-1]] + 2.0 * np.pi
    steps = after - out[0]
    following = np.roll(out[1], -1)
    following[starts[1:] - 1] = out[1][starts[:-1]]
    means = np.bincount(owner, steps * 0.5 * (out[1] + following), minlength=geometry.count) / (2.0 * np.pi)
    return CellField(model, starts, out[0], sides, out[1], out[2], out[3], means, edge_flows)


@njit(cache=True)
def _recover(cells, edges, grid, frame, materials, work, result):  # type: ignore[no-untyped-def]
    """Inner unknowns of all cells from their frames; ``result`` is (starts, values by kind, side rows, side flows)."""
    starts, degrees, storing, values = frame
    offsets, out, sides, flows = result
    rim, numbers, matrix, _, solved, _, second, local = work
    for i in range(cells[0].size - 1):
        count, inner, size = reduce_cell(i, cells, edges, grid, degrees, storing, materials, work)
        dense = np.empty(size)
        for k in range(size - inner):
            dense[inner + k] = values[starts[i] + k]
        substitute_back(matrix, inner, size, dense)
        polygon = cells[0][i + 1] - cells[0][i]
        before = np.empty(polygon + 1, dtype=np.int64)
        before[0] = inner + polygon
        for side in range(polygon):
            before[side + 1] = before[side] + degrees[rim[2][side]] - 1
        for c in range(count):
            side = rim[1][c]
            weights = rim[6][c]
            edge = weights[0] * dense[inner + side] + weights[1] * dense[inner + (side + 1) % polygon]
            for k in range(degrees[rim[2][side]] - 1):
                edge += weights[2 + k] * dense[before[side] + k]
            row = offsets[i] + c
            bump = 0.0
            if numbers[2][c]:
                for q in range(size):
                    bump -= solved[c, q] * dense[q]
            out[0, row], out[2, row], out[3, row] = rim[0][c], edge, bump
            out[1, row] = edge + (dense[numbers[0][c]] if numbers[0][c] >= 0 else 0.0)
            sides[row] = cells[0][i] + side
        flow = out[4, offsets[i] : offsets[i] + count]
        _edge_node_flows(i, count, edges, rim, numbers, materials, dense, out[:, offsets[i] :], second, local, flow)
        if storing:
            _add_stored(count, rim[0], materials[1][i], out[1, offsets[i] :], dense[size - 1], flow)
        for c in range(count):
            side = rim[1][c]
            before_side = side - 1 if side > 0 else polygon - 1
            at_vertex = c == 0 or rim[1][c - 1] != side
            flows[cells[0][i] + side] += 0.5 * flow[c] if at_vertex else flow[c]
            if at_vertex:
                flows[cells[0][i] + before_side] += 0.5 * flow[c]


@njit(cache=True)
def _add_stored(count, angles, solid, rim, mean, flow):  # type: ignore[no-untyped-def]
    """Add the heat that a disk takes up, 8 pi k (mean of the rim - mean of the disk), evenly over its rim."""
    part = np.empty(count)
    lag = -mean
    for c in range(count):
        before = angles[c - 1] if c > 0 else angles[count - 1] - 2.0 * np.pi
        after = angles[c + 1] if c < count - 1 else angles[0] + 2.0 * np.pi
        part[c] = (after - before) / (4.0 * np.pi)
        lag += part[c] * rim[c]
    for c in range(count):
        flow[c] += 8.0 * np.pi * solid * lag * part[c]


@njit(cache=True)
def _edge_node_flows(i, count, edges, rim, numbers, materials, dense, values, disk, local, flow):  # type: ignore[no-untyped-def]
    """Heat into the cell at each edge node: that into the rim opposite to it, A T, and that of the strips beside it."""
    x = np.zeros(FIELDS)
    for c in range(count):
        flow[c] = 0.0
        for d in range(count):
            flow[c] += disk[c, d] * values[1, d]
    for c in range(count):
        d = c + 1 if c + 1 < count else 0
        fields = strip_of(c, d, i, edges, rim, materials, local)
        for end in range(2):
            node = c if end == 0 else d
            x[2 * end] = values[1, node] - values[2, node]
            x[2 * end + 1] = values[3, node]
            x[4 + end] = values[2, node]
            x[6 + end] = dense[numbers[1][node]] if numbers[1][node] >= 0 else 0.0
        for a in range(fields):
            flow[c] += local[4, a] * x[a]
            flow[d] += local[5, a] * x[a]


def temperatures_inside(field: CellField, disks: Ints, offsets: Floats) -> Floats:
    """Temperatures at points of cells, in the disk or in the fluid around it.

    Parameters
    ----------
    field : CellField
    disks : ndarray of int64, shape (q,)
        Cell of each point.
    offsets : ndarray, shape (q, 2) [m]
        Position relative to the centre of its disk.

    Returns
    -------
    ndarray, shape (q,) [K]

    Notes
    -----
    Inside a disk with `HARMONICS` Fourier modes, which blurs the temperature within R/50 of the rim.
    """
    out = np.empty(disks.size)
    geometry = field.model.geometry
    harmonics = np.empty((geometry.count, HARMONICS + 1), dtype=np.complex128)
    wanted = np.zeros(geometry.count, dtype=np.bool_)
    wanted[disks] = True
    _harmonics(field.starts, field.angles, field.rim, wanted, harmonics)
    cells = geometry.cells
    own = np.where(cells.forward, 0, 1)
    distances = geometry.edges.distances[cells.edges, own]
    directions = geometry.edges.angles[cells.edges] + np.where(cells.forward, 0.0, np.pi)
    _evaluate(
        np.ascontiguousarray(disks, np.int64),
        np.ascontiguousarray(offsets, np.float64),
        geometry.radii,
        harmonics,
        (field.starts, field.angles, field.sides, field.rim, field.edge, field.bump),
        (distances, directions),
        out,
    )
    return out


@njit(cache=True)
def _harmonics(starts, angles, rim, wanted, out):  # type: ignore[no-untyped-def]
    """Fourier coefficients of rim temperatures linear between nodes: c_k = -sum_m [T']_m exp(-i k phi_m)/(2 pi k^2)."""
    for i in range(out.shape[0]):
        if not wanted[i]:
            continue
        first, last = starts[i], starts[i + 1]
        out[i, :] = 0.0
        for m in range(first, last):
            after, before = (m + 1 if m + 1 < last else first), (m - 1 if m > first else last - 1)
            step = angles[after] - angles[m] + (0.0 if after > m else 2.0 * np.pi)
            back = angles[m] - angles[before] + (0.0 if before < m else 2.0 * np.pi)
            out[i, 0] += 0.25 * (step + back) / np.pi * rim[m]
            kink = (rim[after] - rim[m]) / step - (rim[m] - rim[before]) / back
            turn = np.exp(-1j * angles[m])
            power = turn
            for k in range(1, out.shape[1]):
                out[i, k] -= kink * power / (2.0 * np.pi * k * k)
                power *= turn


@njit(cache=True)
def _evaluate(disks, offsets, radii, harmonics, nodes, sides, out):  # type: ignore[no-untyped-def]
    """Temperature of each point: Fourier's series inside the disk, the strip's interpolation outside."""
    starts, angles, rows, rim, edge, bump = nodes
    distances, directions = sides
    for p in range(disks.size):
        i = disks[p]
        r, phi = np.hypot(offsets[p, 0], offsets[p, 1]), np.arctan2(offsets[p, 1], offsets[p, 0])
        if r <= radii[i]:
            value = harmonics[i, 0].real
            z = r / radii[i] * np.exp(1j * phi)
            power = z
            for k in range(1, harmonics.shape[1]):
                value += 2.0 * (harmonics[i, k] * power).real
                power *= z
            out[p] = value
            continue
        first, last = starts[i], starts[i + 1]
        while phi < angles[first]:
            phi += 2.0 * np.pi
        while phi >= angles[first] + 2.0 * np.pi:
            phi -= 2.0 * np.pi
        m = first + np.searchsorted(angles[first:last], phi, side="right") - 1
        after = m + 1 if m + 1 < last else first
        h, direction = distances[rows[m]], directions[rows[m]]
        low = h * np.tan(angles[m] - direction)
        high = h * np.tan(angles[after] - direction)
        u = (h * np.tan(phi - direction) - low) / (high - low)
        t = (r - radii[i]) / (h / np.cos(phi - direction) - radii[i])
        rim_here = (1.0 - u) * rim[m] + u * rim[after]
        edge_here = (1.0 - u) * edge[m] + u * edge[after]
        bump_here = (1.0 - u) * bump[m] + u * bump[after]
        out[p] = rim_here * (1.0 - t) + edge_here * t + 4.0 * bump_here * t * (1.0 - t)
