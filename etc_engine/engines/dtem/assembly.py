"""The global system: element matrices summed over shared contacts, prescribed nodes moved to the right."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from etc_engine.engines.dtem.element import Elements

ROWS = 1 << 16
"""Rows of a matrix that are compared at a time."""


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """K u = b for the free nodes, and the energy of the part that is prescribed.

    Parameters
    ----------
    matrix : csr_matrix, shape (f, f)
        Symmetric positive definite.
    rhs : ndarray, shape (f, k)
        One column a load.
    lift : ndarray, shape (rows, k)
        Prescribed part of the element temperatures: wall temperatures and periodic jumps.
    lift_energies : ndarray, shape (k,)
        sum_p t_p . K_p t_p of the prescribed part; the solution's energy is this less b . u.
    free : ndarray of int, shape (nodes,)
        Row of each node in the system, -1 where its temperature is prescribed.
    """

    matrix: csr_matrix
    rhs: NDArray[np.float64]
    lift: NDArray[np.float64]
    lift_energies: NDArray[np.float64]
    free: NDArray[np.int64]

    def element_temperatures(self, elements: Elements, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Temperatures at all element rows, shape (rows, k), of the free values u, shape (f, k)."""
        known = np.zeros((1, u.shape[1]))  # row -1: a prescribed node has all of its temperature in the lift
        return self.lift + np.concatenate([u, known])[self.free[elements.nodes]]


def assemble(elements: Elements, lift: NDArray[np.float64], prescribed: NDArray[np.bool_]) -> LinearSystem:
    """Global system for the temperatures of the nodes that are not prescribed.

    Parameters
    ----------
    elements : Elements
    lift : ndarray, shape (rows, k)
        Prescribed part of the element temperatures, one column a load.
    prescribed : ndarray of bool, shape (nodes,)
        Nodes whose whole temperature is in ``lift``.

    Returns
    -------
    LinearSystem
    """
    free = np.where(prescribed, -1, np.cumsum(~prescribed) - 1).astype(np.int64)
    size = int((~prescribed).sum())
    matrix = csr_matrix(
        _assemble_csr(elements.offsets, elements.nodes, elements.starts, elements.values, free, size),
        shape=(size, size),
    )
    matrix.has_sorted_indices = True
    matrix.has_canonical_format = True
    flows = elements.apply(lift)
    rows = free[elements.nodes]
    inside = rows >= 0
    rhs = np.zeros((size, lift.shape[1]))
    for load in range(lift.shape[1]):
        rhs[:, load] = -np.bincount(rows[inside], flows[inside, load], minlength=size)
    return LinearSystem(matrix, rhs, lift, np.asarray((lift * flows).sum(axis=0)), free)


def count_positive_off_diagonals(matrix: csr_matrix) -> int:
    """Off-diagonal entries above round-off of their diagonal; 0 for an M-matrix."""
    diagonal, found = matrix.diagonal(), 0
    for first in range(0, matrix.shape[0], ROWS):
        ends = matrix.indptr[first : first + ROWS + 1]
        rows = np.repeat(np.arange(first, first + ends.size - 1), np.diff(ends))
        indices, data = matrix.indices[ends[0] : ends[-1]], matrix.data[ends[0] : ends[-1]]
        found += int(np.count_nonzero((indices != rows) & (data > 1e-12 * diagonal[rows])))
    return found


@njit(cache=True)
def _assemble_csr(
    offsets: NDArray[np.int64],
    nodes: NDArray[np.int64],
    starts: NDArray[np.int64],
    values: NDArray[np.float64],
    free: NDArray[np.int64],
    size: int,
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.int32]]:
    """K = sum_p P_p^T K_p P_p as CSR arrays (data, indices, indptr), columns sorted, repeated columns summed."""
    # the (at most two) element rows of every unknown
    element, local = np.empty((size, 2), dtype=np.int64), np.zeros((size, 2), dtype=np.int64)
    for row in range(size):
        element[row, 0] = element[row, 1] = -1
    capacity = 0
    for p in range(offsets.size - 1):
        for i in range(offsets[p + 1] - offsets[p]):
            row = free[nodes[offsets[p] + i]]
            if row >= 0:
                side = 0 if element[row, 0] < 0 else 1
                element[row, side] = p
                local[row, side] = i
                capacity += offsets[p + 1] - offsets[p]
    data = np.empty(capacity)
    indices = np.empty(capacity, dtype=np.int32)
    indptr = np.zeros(size + 1, dtype=np.int32)
    end = 0
    for row in range(size):
        begin = end
        for side in range(2):
            p = element[row, side]
            if p < 0:
                continue
            n = offsets[p + 1] - offsets[p]
            for j in range(n):
                column = free[nodes[offsets[p] + j]]
                if column < 0:
                    continue
                value = values[starts[p] + local[row, side] * n + j]
                slot = end
                while slot > begin and indices[slot - 1] > column:
                    slot -= 1
                if slot > begin and indices[slot - 1] == column:
                    data[slot - 1] += value
                    continue
                for k in range(end, slot, -1):
                    indices[k] = indices[k - 1]
                    data[k] = data[k - 1]
                indices[slot] = column
                data[slot] = value
                end += 1
        indptr[row + 1] = end
    return data[:end].copy(), indices[:end].copy(), indptr
