"""Elimination of the inner unknowns of a cell: a cyclic tridiagonal system and a dense symmetric one."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def solve_cyclic(diagonal, coupling, size, columns, rows):  # type: ignore[no-untyped-def]
    """Replace ``rows`` (size, columns) by T^-1 rows for the symmetric cyclic tridiagonal T.

    T_cc = diagonal_c and T_c,c+1 = coupling_c, the last coupling back to the first unknown (Sherman and Morrison's
    formula on Thomas's algorithm). Needs at least three unknowns.
    """
    last = coupling[size - 1]
    shift = -diagonal[0]
    z = np.zeros(size)
    z[0], z[size - 1] = shift, last
    factor = np.empty(size)
    pivot = diagonal[0] - shift
    for c in range(size):
        if c > 0:
            below = coupling[c - 1]
            pivot = diagonal[c] - below * factor[c - 1] - (last * last / shift if c == size - 1 else 0.0)
            z[c] -= below * z[c - 1]
            for q in range(columns):
                rows[c, q] -= below * rows[c - 1, q]
        inverse = 1.0 / pivot
        factor[c] = coupling[c] * inverse
        z[c] *= inverse
        for q in range(columns):
            rows[c, q] *= inverse
    for c in range(size - 2, -1, -1):
        z[c] -= factor[c] * z[c + 1]
        for q in range(columns):
            rows[c, q] -= factor[c] * rows[c + 1, q]
    scale = 1.0 / (1.0 + z[0] + last * z[size - 1] / shift)
    wrap = np.empty(columns)
    for q in range(columns):
        wrap[q] = scale * (rows[0, q] + last * rows[size - 1, q] / shift)
    for c in range(size):
        for q in range(columns):
            rows[c, q] -= z[c] * wrap[q]


@njit(cache=True)
def eliminate_dense(matrix, inner, size):  # type: ignore[no-untyped-def]
    """Symmetric elimination of the first ``inner`` unknowns from the upper triangle of ``matrix``, in place.

    Row k < inner then holds the pivot and the eliminated row, and the rest the Schur complement. There is no
    pivoting: the matrix is positive definite, or (disks that overlap) close to it. Two unknowns go at a time.
    """
    k = 0
    while k < inner:
        if k + 1 == inner:
            inverse = 1.0 / matrix[k, k]
            for i in range(k + 1, size):
                a = matrix[k, i] * inverse
                if a != 0.0:
                    for j in range(i, size):
                        matrix[i, j] -= a * matrix[k, j]
            return
        inverse = 1.0 / matrix[k, k]
        a = matrix[k, k + 1] * inverse
        for j in range(k + 1, size):
            matrix[k + 1, j] -= a * matrix[k, j]
        following = 1.0 / matrix[k + 1, k + 1]
        for i in range(k + 2, size):
            a, b = matrix[k, i] * inverse, matrix[k + 1, i] * following
            if a != 0.0 or b != 0.0:
                for j in range(i, size):
                    matrix[i, j] -= a * matrix[k, j] + b * matrix[k + 1, j]
        k += 2


@njit(cache=True)
def substitute_back(matrix, inner, size, values):  # type: ignore[no-untyped-def]
    """Inner unknowns from the outer ones in ``values[inner:size]``, after `eliminate_dense`."""
    for k in range(inner - 1, -1, -1):
        total = 0.0
        for j in range(k + 1, size):
            total += matrix[k, j] * values[j]
        values[k] = -total / matrix[k, k]
