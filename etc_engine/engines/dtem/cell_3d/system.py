"""System of all cells: operator, loads, block preconditioner, conjugate gradients."""

from __future__ import annotations

import time

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import LinearOperator

from etc_engine.engines.dtem.cell_3d.cells import CellSystem
from etc_engine.solvers import Limits, Preconditioner, SolveReport, build_preconditioner, solve_loads

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

MOST_ITERATIONS = 2000
DEPENDENT = 1e-10
"""Bubbles of a coarsely divided facet that depend on each other to this part are one."""


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
def _split(matrices, starts, unknowns, coarse_of, group_of, first_of, widths):  # type: ignore[no-untyped-def]
    """The matrix of the coarse unknowns as (row, column, value), and the diagonal blocks of the others in a row.

    `coarse_of` numbers the coarse unknowns, -1 for the others; these belong to group `group_of`, whose first unknown is
    `first_of` and which has `widths` of them.
    """
    places = np.zeros(len(widths) + 1, dtype=np.int64)
    for g in range(len(widths)):
        places[g + 1] = places[g] + widths[g] ** 2
    diagonal = np.zeros(places[-1])
    pairs = 0
    for cell in range(len(starts) - 1):
        n = 0
        for i in range(starts[cell], starts[cell + 1]):
            n += coarse_of[unknowns[i]] >= 0
        pairs += n * n
    rows, columns = np.empty(pairs, dtype=np.int32), np.empty(pairs, dtype=np.int32)
    values = np.empty(pairs)
    at, found = 0, 0
    for cell in range(len(starts) - 1):
        own = unknowns[starts[cell] : starts[cell + 1]]
        for i in range(len(own)):
            for j in range(i + 1):
                k, r, c = matrices[at], own[i], own[j]
                at += 1
                for turn in range(2 if j < i else 1):
                    u, v = (r, c) if turn == 0 else (c, r)
                    if coarse_of[u] >= 0 and coarse_of[v] >= 0:
                        rows[found], columns[found], values[found] = coarse_of[u], coarse_of[v], k
                        found += 1
                    elif coarse_of[u] < 0 and coarse_of[v] < 0 and group_of[u] == group_of[v]:
                        g = group_of[u]
                        diagonal[places[g] + (u - first_of[g]) * widths[g] + v - first_of[g]] += k
    return diagonal, places, rows[:found], columns[:found], values[:found]


def cell_preconditioner(system: CellSystem, fixed: NDArray[np.bool_]) -> Preconditioner:
    """Block-diagonal preconditioner: temperatures by multigrid, the bubbles of every edge and facet by their own block.

    Parameters
    ----------
    system : CellSystem
    fixed : ndarray of bool, shape (size,)
        Unknowns that are given; blocks are free or fixed as a whole.
    """
    start = time.perf_counter()
    coarse = np.flatnonzero(system.is_temperature)
    coarse_of = np.full(system.size, -1)
    coarse_of[coarse] = np.arange(len(coarse))
    others = np.flatnonzero(coarse_of < 0)
    block = np.repeat(np.arange(len(system.blocks) - 1), np.diff(system.blocks))
    group_of = np.full(system.size, -1)
    _, first, group_of[others], widths = np.unique(
        block[others], return_index=True, return_inverse=True, return_counts=True
    )
    first_of = others[first]
    diagonal, places, rows, columns, values = _split(
        system.matrices, system.starts, system.unknowns, coarse_of, group_of, first_of, widths
    )
    matrix = csr_matrix((values, (rows, columns)), shape=(len(coarse), len(coarse)))
    kept = np.flatnonzero(~fixed[coarse])
    inner = build_preconditioner(csr_matrix(matrix[kept][:, kept])) if len(kept) else None
    groups: list[tuple[Integers, Floats]] = []
    for width in np.unique(widths):
        chosen = np.flatnonzero((widths == width) & ~fixed[first_of])
        entries = diagonal[places[chosen][:, None] + np.arange(width * width)].reshape(-1, width, width)
        inverse = np.linalg.pinv(entries, rcond=DEPENDENT, hermitian=True)
        groups.append((first_of[chosen][:, None] + np.arange(width), inverse))
    unknowns = coarse[kept]

    def apply(residual: Floats) -> Floats:
        result = np.zeros_like(residual)
        if inner is not None:
            result[unknowns] = inner.apply(residual[unknowns])
        for numbers, inverse in groups:
            result[numbers] = np.einsum("bij,bj->bi", inverse, residual[numbers])
        return result

    return Preconditioner(apply, inner.levels if inner else 1, time.perf_counter() - start)


def fixed_unknowns(system: CellSystem, axis: int, periodic: bool) -> NDArray[np.bool_]:
    """Unknowns with a given temperature: one vertex of periodic loads, or all on the two walls of an axis."""
    if periodic:
        return np.arange(system.size) == 0
    topology = system.topology
    low, high = (wall_facets(system, 2 * axis + end) for end in range(2))
    on_wall = low | high
    corners = np.repeat(on_wall, np.diff(topology.polygons.starts))
    block = np.zeros(len(system.blocks) - 1, dtype=np.bool_)
    block[topology.polygons.corners[corners]] = True
    block[system.vertices + topology.edge_of_corner[corners]] = True
    block[system.vertices + topology.edge_count + np.flatnonzero(on_wall)] = True
    return np.asarray(np.repeat(block, np.diff(system.blocks)))


def wall_facets(system: CellSystem, wall: int) -> NDArray[np.bool_]:
    """Facets on a wall; wall ``2 * axis`` lies at 0, ``2 * axis + 1`` at the far end."""
    return np.asarray(system.topology.polygons.cells[:, 1] == -1 - wall)


def apply_cells(system: CellSystem, values: Floats) -> Floats:
    """K u, the heat that leaves the unknowns, shape (size,)."""
    result = np.empty(system.size)
    _apply(system.matrices, system.starts, system.unknowns, np.ascontiguousarray(values), result)
    return result


def cell_loads(system: CellSystem) -> tuple[Floats, Floats]:
    """sum_p P_p^T K_p arms_p, shape (size, 3), and sum_p arms_p^T K_p arms_p, shape (3, 3)."""
    load, energy = _load(system.matrices, system.starts, system.unknowns, system.arms, system.size)
    return load, energy


def solve_cells(
    system: CellSystem,
    fixed: NDArray[np.bool_],
    loads: Floats,
    lift_energies: Floats,
    tolerance: float,
) -> tuple[Floats, tuple[SolveReport, ...]]:
    """Minimize lift_energy + 2 load.u + u.K u for every load, over the unknowns that are not fixed (u = 0 there).

    Parameters
    ----------
    system : CellSystem
    fixed : ndarray of bool, shape (size,)
    loads : ndarray, shape (size, k)
    lift_energies : ndarray, shape (k,)
    tolerance : float
        Relative error of the energies.

    Returns
    -------
    u : ndarray, shape (size, k)
    reports : tuple of SolveReport

    Raises
    ------
    ConvergenceError
        If the relative error of an energy does not fall to the tolerance.
    """
    if fixed.all():
        return np.zeros_like(loads), (SolveReport(0, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0),) * loads.shape[1]

    def free_part(values: Floats) -> Floats:
        return np.where(fixed, values, apply_cells(system, np.where(fixed, 0.0, values)))

    u, reports = solve_loads(
        LinearOperator((system.size, system.size), matvec=free_part, dtype=np.float64),
        np.where(fixed[:, None], 0.0, -loads),
        lift_energies,
        preconditioner=cell_preconditioner(system, fixed),
        tolerance=tolerance,
        limits=Limits(max_iterations=MOST_ITERATIONS),
        conserved=np.where(~fixed & system.is_temperature, 1.0, 0.0),
    )
    return u, reports
