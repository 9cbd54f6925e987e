"""The V-cycle of a multigrid hierarchy: one Gauss-Seidel sweep before and one after each coarse correction."""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.sparse import csc_matrix, csr_matrix
from scipy.sparse.linalg import splu

from etc_engine.arrays import Floats, Ints


class Level:
    """A matrix that is smoothed, the prolongator from the next level, and its work space.

    Parameters
    ----------
    matrix : csr_matrix, shape (n, n)
        Symmetric, columns of a row in order.
    prolongator : csr_matrix, shape (n, m)
    """

    def __init__(self, matrix: csr_matrix, prolongator: csr_matrix) -> None:
        diagonal = matrix.diagonal()
        self.matrix = (matrix.indptr, matrix.indices, matrix.data)
        self.prolongator = (prolongator.indptr, prolongator.indices, prolongator.data)
        # a matrix with another diagonal is not positive definite, which conjugate gradients find out
        self.inverse = np.divide(1.0, diagonal, out=np.zeros_like(diagonal), where=diagonal > 0.0)
        self.residual = np.empty(matrix.shape[0])
        self.coarse = np.empty(prolongator.shape[1])


class VCycle:
    """Symmetric approximation of A^-1: smooth, correct on the next level, smooth in the opposite order.

    Parameters
    ----------
    levels : tuple of Level
    coarsest : csr_matrix
        Matrix of the last level, which is factorised.
    """

    def __init__(self, levels: tuple[Level, ...], coarsest: csr_matrix) -> None:
        self.levels = levels
        self._factor = splu(csc_matrix(coarsest))

    def __len__(self) -> int:
        return len(self.levels) + 1

    def apply(self, residual: Floats) -> Floats:
        """The correction for a residual, both of shape (n,)."""
        loads, corrections = [np.ascontiguousarray(residual)], []
        for level in self.levels:
            correction = np.empty(level.residual.size)
            _forward(*level.matrix, level.inverse, loads[-1], correction, level.residual)
            _restrict(*level.prolongator, level.residual, level.coarse)
            corrections.append(correction)
            loads.append(level.coarse)
        result = np.asarray(self._factor.solve(loads[-1]))
        for level, load, correction in zip(self.levels[::-1], loads[-2::-1], corrections[::-1], strict=True):
            _interpolate(*level.prolongator, result, correction)
            _backward(*level.matrix, level.inverse, load, correction)
            result = correction
        return result


@njit(cache=True)
def _forward(
    indptr: Ints, indices: Ints, data: Floats, inverse: Floats, load: Floats, x: Floats, residual: Floats
) -> None:
    """Solve (L + D) x = b; the residual b - A x = -L^T x is added up on the way, from the same entries."""
    for i in range(load.size):
        residual[i] = 0.0
    for i in range(load.size):
        first, k = indptr[i], indptr[i]
        total = load[i]
        while k < indptr[i + 1] and indices[k] < i:
            total -= data[k] * x[indices[k]]
            k += 1
        x[i] = total * inverse[i]
        for m in range(first, k):
            residual[indices[m]] -= data[m] * x[i]


@njit(cache=True)
def _backward(indptr: Ints, indices: Ints, data: Floats, inverse: Floats, load: Floats, x: Floats) -> None:
    """One Gauss-Seidel sweep on A x = b from the last unknown to the first."""
    for i in range(load.size - 1, -1, -1):
        total = load[i]
        for k in range(indptr[i], indptr[i + 1]):
            total -= data[k] * x[indices[k]]
        x[i] += total * inverse[i]


@njit(cache=True)
def _restrict(indptr: Ints, indices: Ints, data: Floats, fine: Floats, coarse: Floats) -> None:
    """Coarse load P^T r."""
    for j in range(coarse.size):
        coarse[j] = 0.0
    for i in range(fine.size):
        for k in range(indptr[i], indptr[i + 1]):
            coarse[indices[k]] += data[k] * fine[i]


@njit(cache=True)
def _interpolate(indptr: Ints, indices: Ints, data: Floats, coarse: Floats, fine: Floats) -> None:
    """Add P e to x."""
    for i in range(fine.size):
        for k in range(indptr[i], indptr[i + 1]):
            fine[i] += data[k] * coarse[indices[k]]
