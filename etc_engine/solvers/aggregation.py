"""Smoothed-aggregation hierarchy on plain CSR matrices, out of PyAMG's parts.

PyAMG's own set-up keeps prolongators as block matrices of 1 x 1 blocks; sorting those takes more than half of its
time on contact networks, and the cycle runs slower on them too. The mathematics here is the same.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from etc_engine.arrays import Floats

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


def aggregation_hierarchy(matrix: csr_matrix) -> Any:
    """A `pyamg.MultilevelSolver` for a symmetric positive definite matrix.

    Aggregates of strongly connected unknowns carry the constant; the prolongator is smoothed by one Jacobi sweep,
    P = (I - w D^-1 A) T with D the absolute row sums; coarse matrices are P^T A P. One forward Gauss-Seidel sweep
    goes before the coarse correction and one backward sweep after it, so that the V-cycle is symmetric.

    Parameters
    ----------
    matrix : csr_matrix, shape (n, n)

    Returns
    -------
    pyamg.multilevel.MultilevelSolver

    Notes
    -----
    Nothing draws on a random state: two builds agree bit for bit.

    References
    ----------
    Vanek, Mandel, Brezina 1996, Algebraic multigrid by smoothed aggregation for second and fourth order elliptic
    problems, Computing 56, doi:10.1007/BF02238511.
    """
    from pyamg.multilevel import MultilevelSolver
    from pyamg.relaxation.smoothing import change_smoothers

    levels = []
    current, near_kernel = _sorted(matrix), np.ones(matrix.shape[0])  # aggregates follow the order of columns
    while True:
        level = MultilevelSolver.Level()
        level.A = current
        levels.append(level)
        if current.shape[0] <= COARSEST or len(levels) == MOST_LEVELS:
            break
        dense = len(levels) > 1 and current.nnz > DENSE * current.shape[0]
        tentative, coarse_kernel = _tentative(current, near_kernel, WEAK if dense else STRENGTH)
        if tentative.shape[1] >= current.shape[0]:
            break  # nothing aggregates any more
        near_kernel = coarse_kernel
        level.P = _smoothed(current, tentative)
        level.R = level.P.T  # shares its memory; the sums of its products run in the same order as in rows
        current = _sorted(csr_matrix(level.R.tocsr() @ (current @ level.P)))
    hierarchy = MultilevelSolver(levels, coarse_solver="splu")
    change_smoothers(hierarchy, ("gauss_seidel", {"sweep": "forward"}), ("gauss_seidel", {"sweep": "backward"}))
    return hierarchy


def _sorted(matrix: csr_matrix) -> csr_matrix:
    """The matrix itself where the columns of each row are in order, else a copy in order."""
    return matrix if matrix.has_sorted_indices else matrix.sorted_indices()


def _tentative(matrix: csr_matrix, near_kernel: Floats, strength: float) -> tuple[csr_matrix, Floats]:
    """Prolongator of orthonormal columns, one an aggregate, that carries the near kernel, and that of its level."""
    from pyamg.aggregation.aggregate import standard_aggregation
    from pyamg.strength import symmetric_strength_of_connection

    aggregates = standard_aggregation(symmetric_strength_of_connection(matrix, theta=strength))[0].tocsr()
    values = near_kernel[np.repeat(np.arange(matrix.shape[0]), np.diff(aggregates.indptr))]
    norms = np.sqrt(np.bincount(aggregates.indices, values**2, minlength=aggregates.shape[1]))
    tentative = csr_matrix(
        (values / norms[aggregates.indices], aggregates.indices, aggregates.indptr), aggregates.shape
    )
    return tentative, norms


def _smoothed(matrix: csr_matrix, tentative: csr_matrix) -> csr_matrix:
    """One damped Jacobi sweep on every column."""
    correction = csr_matrix(matrix @ tentative)
    sizes = csr_matrix((np.abs(matrix.data), matrix.indices, matrix.indptr), matrix.shape, copy=False)
    rows = np.asarray(sizes.sum(axis=1)).ravel()
    del sizes
    correction.data *= np.repeat(DAMPING / rows, np.diff(correction.indptr))
    return csr_matrix(tentative - correction)
