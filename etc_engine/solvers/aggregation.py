"""Smoothed-aggregation hierarchy on plain CSR matrices, with PyAMG's aggregates.

PyAMG's own set-up stores the strong entries with their values, the product of the matrix and the tentative
prolongator, and that of the matrix and the prolongator. The kernels here store none of them. The mathematics is the
same.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.sparse import csr_matrix

from etc_engine.arrays import Floats, Ints
from etc_engine.solvers.cycle import Level, VCycle

STRENGTH = 0.08
"""Entries below this part of the geometric mean of their diagonals do not aggregate."""
WEAK = 0.02
"""The same on coarse levels with more than ``DENSE`` entries a row, as of spheres: with 0.08 few entries of such a row
count as strong, aggregates stay small, and the next level is nearly full."""
DENSE = 40
DAMPING = 4.0 / 3.0
"""Damping of the Jacobi sweep that smooths a prolongator, relative to the absolute row sum."""
COARSEST = 500
"""The coarsest level is factorised."""
MOST_LEVELS = 20


def aggregation_hierarchy(matrix: csr_matrix) -> VCycle:
    """The V-cycle of a symmetric positive definite matrix.

    Aggregates of strongly connected unknowns carry the constant; the prolongator is smoothed by one Jacobi sweep,
    P = (I - w D^-1 A) T with D the absolute row sums; coarse matrices are P^T A P. `VCycle` smooths with Gauss-Seidel.

    Parameters
    ----------
    matrix : csr_matrix, shape (n, n)

    Returns
    -------
    VCycle

    Notes
    -----
    Nothing draws on a random state: two builds agree bit for bit.

    References
    ----------
    Vanek, Mandel, Brezina 1996, Algebraic multigrid by smoothed aggregation for second and fourth order elliptic
    problems, Computing 56, doi:10.1007/BF02238511.
    """
    levels: list[Level] = []
    # aggregates follow the order of columns, and so does the cycle
    current = matrix if matrix.has_sorted_indices else matrix.sorted_indices()
    near_kernel = np.ones(matrix.shape[0])
    while current.shape[0] > COARSEST and len(levels) < MOST_LEVELS - 1:
        dense = len(levels) > 0 and current.nnz > DENSE * current.shape[0]
        aggregates, count = _aggregates(current, WEAK if dense else STRENGTH)
        if not 0 < count < current.shape[0]:
            break  # nothing aggregates any more
        inside = aggregates >= 0
        norms = np.sqrt(np.bincount(aggregates[inside], near_kernel[inside] ** 2, minlength=count))
        values = near_kernel / norms[aggregates]  # those outside are not read
        prolongator = csr_matrix(
            _prolongator(current.indptr, current.indices, current.data, aggregates, values, count)[::-1],
            shape=(current.shape[0], count),
        )
        levels.append(Level(current, prolongator))
        current = _coarse_matrix(current, prolongator)
        near_kernel = norms
    return VCycle(tuple(levels), current)


def _aggregates(matrix: csr_matrix, strength: float) -> tuple[Ints, int]:
    """Aggregate of each unknown, -1 where no entry of its row is strong, and their number."""
    from pyamg.aggregation.aggregate import standard_aggregation

    indptr, indices = _strong(matrix.indptr, matrix.indices, matrix.data, matrix.diagonal(), strength)
    pattern = csr_matrix((np.ones(len(indices), np.int8), indices, indptr), shape=matrix.shape)
    members = standard_aggregation(pattern)[0].tocsr()
    aggregates = np.full(matrix.shape[0], -1, dtype=matrix.indices.dtype)
    aggregates[np.diff(members.indptr) > 0] = members.indices[: members.nnz]
    return aggregates, members.shape[1] if members.nnz else 0


def _coarse_matrix(matrix: csr_matrix, prolongator: csr_matrix) -> csr_matrix:
    """P^T A P, its columns in order."""
    across = prolongator.tocsc()  # the rows of P^T
    count = prolongator.shape[1]
    data, indices, indptr = _galerkin(
        matrix.indptr,
        matrix.indices,
        matrix.data,
        prolongator.indptr,
        prolongator.indices,
        prolongator.data,
        across.indptr,
        across.indices,
        across.data,
    )
    coarse = csr_matrix((data, indices, indptr), shape=(count, count))
    coarse.sort_indices()
    return coarse


@njit(cache=True)
def _strong(indptr: Ints, indices: Ints, data: Floats, diagonal: Floats, strength: float) -> tuple[Ints, Ints]:
    """Pattern of the diagonal and of the entries with a_ij^2 >= strength^2 |a_ii a_jj|."""
    rows = diagonal.size
    square = strength * strength
    starts = np.zeros(rows + 1, indices.dtype)
    columns = np.empty(0, indices.dtype)
    for fill in range(2):
        found = 0
        for i in range(rows):
            for k in range(indptr[i], indptr[i + 1]):
                j = indices[k]
                if i == j or data[k] * data[k] >= square * abs(diagonal[i] * diagonal[j]):
                    if fill:
                        columns[found] = j
                    found += 1
            starts[i + 1] = found
        if not fill:
            columns = np.empty(found, indices.dtype)
    return starts, columns


@njit(cache=True)
def _prolongator(
    indptr: Ints, indices: Ints, data: Floats, aggregates: Ints, values: Floats, count: int
) -> tuple[Ints, Ints, Floats]:
    """P = (I - w D^-1 A) T, row by row; column J of T holds the values of the unknowns in aggregate J."""
    rows = aggregates.size
    last_row = np.full(count, -1, indices.dtype)
    starts = np.zeros(rows + 1, indices.dtype)
    found = 0
    for i in range(rows):
        if aggregates[i] >= 0:
            last_row[aggregates[i]] = i
            found += 1
        for k in range(indptr[i], indptr[i + 1]):
            column = aggregates[indices[k]]
            if column >= 0 and last_row[column] != i:
                last_row[column] = i
                found += 1
        starts[i + 1] = found
    columns = np.empty(found, indices.dtype)
    entries = np.empty(found)
    place = np.full(count, -1, indices.dtype)
    for i in range(rows):
        first = starts[i]
        at = first
        size = 0.0
        for k in range(indptr[i], indptr[i + 1]):
            size += abs(data[k])
        if aggregates[i] >= 0:
            place[aggregates[i]] = at
            columns[at] = aggregates[i]
            entries[at] = values[i]
            at += 1
        for k in range(indptr[i], indptr[i + 1]):
            column = aggregates[indices[k]]
            if column < 0:
                continue
            term = -DAMPING / size * data[k] * values[indices[k]]
            if place[column] >= first:
                entries[place[column]] += term
            else:
                place[column] = at
                columns[at] = column
                entries[at] = term
                at += 1
    return starts, columns, entries


@njit(cache=True)
def _galerkin(
    indptr: Ints,
    indices: Ints,
    data: Floats,
    fine_starts: Ints,
    fine_columns: Ints,
    fine_entries: Floats,
    coarse_starts: Ints,
    coarse_rows: Ints,
    coarse_entries: Floats,
) -> tuple[Floats, Ints, Ints]:
    """Rows of P^T A P, by way of one row of P^T A at a time; the arguments are A, the rows of P and those of P^T."""
    count = coarse_starts.size - 1
    most = 0
    for row in range(count):
        terms = 0
        for t in range(coarse_starts[row], coarse_starts[row + 1]):
            terms += indptr[coarse_rows[t] + 1] - indptr[coarse_rows[t]]
        most = max(most, terms)
    near = np.empty(most, indices.dtype)  # columns of the row of P^T A, and its entries
    weights = np.empty(most)
    near_place = np.full(fine_starts.size - 1, -1, indices.dtype)
    row_columns = np.empty(count, indices.dtype)
    sums = np.empty(count)
    last_row = np.full(count, -1, indices.dtype)
    columns = np.empty(indices.size // 4 + 1024, indices.dtype)
    entries = np.empty(columns.size)
    starts = np.zeros(count + 1, indices.dtype)
    for row in range(count):
        reached = 0
        for t in range(coarse_starts[row], coarse_starts[row + 1]):
            i = coarse_rows[t]
            entry = coarse_entries[t]
            for k in range(indptr[i], indptr[i + 1]):
                j = indices[k]
                place = near_place[j]
                if 0 <= place < reached and near[place] == j:
                    weights[place] += entry * data[k]
                else:
                    near_place[j] = reached
                    near[reached] = j
                    weights[reached] = entry * data[k]
                    reached += 1
        found = 0
        for q in range(reached):
            j = near[q]
            weight = weights[q]
            for m in range(fine_starts[j], fine_starts[j + 1]):
                column = fine_columns[m]
                if last_row[column] == row:
                    sums[column] += weight * fine_entries[m]
                else:
                    last_row[column] = row
                    sums[column] = weight * fine_entries[m]
                    row_columns[found] = column
                    found += 1
        at = starts[row]
        if at + found > columns.size:
            room = at + found + columns.size // 2
            more_columns, more_entries = np.empty(room, indices.dtype), np.empty(room)
            for q in range(at):
                more_columns[q] = columns[q]
                more_entries[q] = entries[q]
            columns, entries = more_columns, more_entries
        for q in range(found):
            columns[at + q] = row_columns[q]
            entries[at + q] = sums[row_columns[q]]
        starts[row + 1] = at + found
    total = starts[count]
    return entries[:total].copy(), columns[:total].copy(), starts
