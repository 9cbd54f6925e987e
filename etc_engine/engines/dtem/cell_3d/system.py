"""System of all cells: loads, block preconditioner, conductivity.

With the temperature E . x + u, u periodic, the energy of load a over cell p is t.K_p t, t = P_p u + (x - x_p)_a on the
vertices. It is smallest where K u = - sum_p P_p^T K_p (x - x_p)_a; the conductivity is k_ab = sum_p t_a.K_p t_b / V.
Across a walled axis u vanishes on the two walls of that axis, and the other walls insulate.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import LinearOperator

from etc_engine.box import Box
from etc_engine.engines.dtem.cell_3d.cells import CellSystem
from etc_engine.solvers import Limits, Preconditioner, SolveReport, build_preconditioner, solve_energy

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

MOST_ITERATIONS = 2000
DEPENDENT = 1e-10
"""Bubbles of a coarsely divided facet that depend on each other to this part are one."""


@dataclass(frozen=True, eq=False)
class CellSolution:
    """Temperatures and conductivity.

    Parameters
    ----------
    conductivity : ndarray, shape (3, 3) [W/(m K)]
        Columns and rows of axes that were not solved are NaN, and off-diagonals of walled boxes.
    temperatures : dict of int to ndarray, shape (size,)
        Deviation u from the linear field of unit gradient along each axis [m], over the unknowns of the frame.
    reports : dict of int to SolveReport
    """

    conductivity: Floats
    temperatures: dict[int, Floats]
    reports: dict[int, SolveReport]


@njit(cache=True)
def _apply(matrices, starts, unknowns, values, result):  # type: ignore[no-untyped-def]
    """Fill result = sum_p P_p^T K_p P_p values, K_p as lower triangles."""
    result[:] = 0.0
    at = 0
    for cell in range(len(starts) - 1):
        own = unknowns[starts[cell] : starts[cell + 1]]
        n = len(own)
        local, product = np.empty(n), np.zeros(n)
        for i in range(n):
            local[i] = values[own[i]]
        for i in range(n):
            total, x = 0.0, local[i]
            row = matrices[at : at + i + 1]
            for j in range(i):
                total += row[j] * local[j]
                product[j] += row[j] * x
            product[i] += total + row[i] * x
            at += i + 1
        for i in range(n):
            result[own[i]] += product[i]


@njit(cache=True)
def _load(matrices, starts, unknowns, arms, size):  # type: ignore[no-untyped-def]
    """sum_p P_p^T K_p arms_p, shape (size, 3), and sum_p arms_p^T K_p arms_p."""
    load, energy = np.zeros((size, 3)), np.zeros((3, 3))
    at = 0
    for cell in range(len(starts) - 1):
        first, n = starts[cell], starts[cell + 1] - starts[cell]
        for i in range(n):
            for j in range(i + 1):
                k = matrices[at + j]
                for a in range(3):
                    load[unknowns[first + i], a] += k * arms[first + j, a]
                    if j < i:
                        load[unknowns[first + j], a] += k * arms[first + i, a]
                    for b in range(3):
                        energy[a, b] += k * arms[first + i, a] * arms[first + j, b]
                        if j < i:
                            energy[a, b] += k * arms[first + j, a] * arms[first + i, b]
            at += i + 1
    return load, energy


@njit(cache=True)
def _blocks(matrices, starts, unknowns, blocks, block_of, vertices):  # type: ignore[no-untyped-def]
    """Diagonal blocks of edges and facets, one after the other, and the vertices' matrix as (row, column, value)."""
    places = np.zeros(len(blocks), dtype=np.int64)
    for b in range(vertices, len(blocks) - 1):
        places[b + 1] = places[b] + (blocks[b + 1] - blocks[b]) ** 2
    diagonal = np.zeros(places[-1])
    corners = 0
    for cell in range(len(starts) - 1):
        n = 0
        while n < starts[cell + 1] - starts[cell] and unknowns[starts[cell] + n] < vertices:
            n += 1
        corners += n * n
    rows, columns = np.empty(corners, dtype=np.int64), np.empty(corners, dtype=np.int64)
    values = np.empty(corners)
    at, found = 0, 0
    for cell in range(len(starts) - 1):
        own = unknowns[starts[cell] : starts[cell + 1]]
        for i in range(len(own)):
            for j in range(i + 1):
                k, r, c = matrices[at], own[i], own[j]
                at += 1
                if r < vertices:
                    rows[found], columns[found], values[found] = r, c, k
                    found += 1
                    if j < i:
                        rows[found], columns[found], values[found] = c, r, k
                        found += 1
                elif block_of[r] == block_of[c]:
                    b = block_of[r]
                    width = blocks[b + 1] - blocks[b]
                    diagonal[places[b] + (r - blocks[b]) * width + c - blocks[b]] += k
                    if j < i:
                        diagonal[places[b] + (c - blocks[b]) * width + r - blocks[b]] += k
    return diagonal, rows, columns, values


def cell_preconditioner(system: CellSystem, free: NDArray[np.bool_]) -> Preconditioner:
    """Block-diagonal preconditioner: vertices by multigrid, every edge and facet by its own block.

    Parameters
    ----------
    system : CellSystem
    free : ndarray of bool, shape (size,)
        Unknowns that are solved for; blocks are free or fixed as a whole.
    """
    start = time.perf_counter()
    sizes = np.diff(system.blocks)
    block_of = np.repeat(np.arange(len(sizes)), sizes)
    vertices = system.vertices
    diagonal, rows, columns, values = _blocks(
        system.matrices, system.starts, system.unknowns, system.blocks, block_of, vertices
    )
    matrix = csr_matrix((values, (rows, columns)), shape=(vertices, vertices))
    kept = np.flatnonzero(free[:vertices])
    coarse = build_preconditioner(csr_matrix(matrix[kept][:, kept])) if len(kept) else None
    groups: list[tuple[Integers, Floats]] = []
    places = np.concatenate((np.zeros(vertices, dtype=np.int64), np.cumsum(sizes[vertices:] ** 2)))
    places = np.concatenate(([0], places))[: len(sizes)]
    for width in np.unique(sizes[vertices:]):
        if width == 0:
            continue
        chosen = vertices + np.flatnonzero(sizes[vertices:] == width)
        chosen = chosen[free[system.blocks[chosen]]]
        entries = diagonal[places[chosen][:, None] + np.arange(width * width)].reshape(-1, width, width)
        groups.append(
            (
                system.blocks[chosen][:, None] + np.arange(width),
                np.linalg.pinv(entries, rcond=DEPENDENT, hermitian=True),
            )
        )

    def apply(residual: Floats) -> Floats:
        result = np.zeros_like(residual)
        if coarse is not None:
            result[kept] = coarse.apply(residual[kept])
        for numbers, inverse in groups:
            result[numbers] = np.einsum("bij,bj->bi", inverse, residual[numbers])
        return result

    return Preconditioner(apply, coarse.levels if coarse else 1, time.perf_counter() - start)


def _fixed_on_walls(system: CellSystem, axis: int) -> NDArray[np.bool_]:
    """Unknowns on the two walls of an axis: vertices, edges and facets there."""
    topology = system.topology
    second = topology.polygons.cells[:, 1]
    faces = np.flatnonzero((second == -1 - 2 * axis) | (second == -2 - 2 * axis))
    on_wall = np.isin(np.repeat(np.arange(len(second)), np.diff(topology.polygons.starts)), faces)
    block = np.zeros(len(system.blocks) - 1, dtype=np.bool_)
    block[topology.polygons.corners[on_wall]] = True
    block[system.vertices + topology.edge_of_corner[on_wall]] = True
    block[system.vertices + topology.edge_count + faces] = True
    return np.repeat(block, np.diff(system.blocks))


def solve_cells(
    system: CellSystem, box: Box, axes: tuple[int, ...] = (0, 1, 2), tolerance: float = 1e-8
) -> CellSolution:
    """Conductivity along the axes.

    Parameters
    ----------
    system : CellSystem
    box : Box
    axes : tuple of int
    tolerance : float
        Relative error of the energy, and so of the conductivity, at which conjugate gradients stop.

    Raises
    ------
    ConvergenceError
        If that is not reached.
    """
    load, energy = _load(system.matrices, system.starts, system.unknowns, system.arms, system.size)
    result = np.full((3, 3), np.nan)
    temperatures: dict[int, Floats] = {}
    reports: dict[int, SolveReport] = {}
    shared: dict[bool | int, tuple[NDArray[np.bool_], Preconditioner]] = {}
    apply = _operator(system)
    for axis in axes:
        key: bool | int = True if box.periodic[axis] else axis
        if key not in shared:
            free = np.ones(system.size, dtype=np.bool_)
            if box.periodic[axis]:
                free[0] = False  # temperatures are known up to a constant
            else:
                free = ~_fixed_on_walls(system, axis)
            shared[key] = (free, cell_preconditioner(system, free))
        free, preconditioner = shared[key]
        temperatures[axis] = np.zeros(system.size)
        if not free.any():
            continue
        solution, reports[axis] = solve_energy(
            LinearOperator(
                (system.size, system.size), matvec=lambda v, f=free: np.where(f, apply(np.where(f, v, 0.0)), v)
            ),
            np.where(free, -load[:, axis], 0.0),
            float(energy[axis, axis]),
            preconditioner=preconditioner,
            tolerance=tolerance,
            limits=Limits(max_iterations=MOST_ITERATIONS),
            conserved=np.where(free & (np.arange(system.size) < system.vertices), 1.0, 0.0),
        )
        temperatures[axis] = solution
    for a in axes:
        for b in axes:
            if a == b or all(box.periodic):
                u, v = temperatures[a], temperatures[b]
                total = energy[a, b] + u @ load[:, b] + v @ load[:, a] + u @ apply(v)
                result[a, b] = total / box.volume
    return CellSolution(result, temperatures, reports)


def _operator(system: CellSystem) -> Callable[[Floats], Floats]:
    def apply(values: Floats) -> Floats:
        result = np.empty(system.size)
        _apply(system.matrices, system.starts, system.unknowns, np.ascontiguousarray(values), result)
        return result

    return apply
