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
            row, before = rows[c, :columns], rows[c - 1, :columns]
            for q in range(columns):
                row[q] -= below * before[q]
        inverse = 1.0 / pivot
        factor[c] = coupling[c] * inverse
        z[c] *= inverse
        for q in range(columns):
            rows[c, q] *= inverse
    for c in range(size - 2, -1, -1):
        part = factor[c]
        z[c] -= part * z[c + 1]
        row, after = rows[c, :columns], rows[c + 1, :columns]
        for q in range(columns):
            row[q] -= part * after[q]
    scale = 1.0 / (1.0 + z[0] + last * z[size - 1] / shift)
    wrap = np.empty(columns)
    for q in range(columns):
        wrap[q] = scale * (rows[0, q] + last * rows[size - 1, q] / shift)
    for c in range(size):
        row, part = rows[c, :columns], z[c]
        for q in range(columns):
            row[q] -= part * wrap[q]


@njit(cache=True)
def eliminate_dense(matrix, inner, size):  # type: ignore[no-untyped-def]
    """Symmetric elimination of the first ``inner`` unknowns from the upper triangle of ``matrix``, in place.

    Row k < inner then holds the pivot and the eliminated row, and the rest the Schur complement. There is no
    pivoting: the matrix is positive definite, or (disks that overlap) close to it. Two unknowns go at a time.
    """
    k = 0
    while k + 8 <= inner:  # four pairs, then the other rows once: the same operations in the same order
        for pair in range(k, k + 8, 2):
            _eliminate_pair(matrix, pair, k + 8, size)
        _eliminate_eight(matrix, k, size)
        k += 8
    while k + 2 <= inner:
        _eliminate_pair(matrix, k, size, size)
        k += 2
    if k < inner:
        inverse = 1.0 / matrix[k, k]
        for i in range(k + 1, size):
            a = matrix[k, i] * inverse
            for j in range(i, size):
                matrix[i, j] -= a * matrix[k, j]


@njit(cache=True)
def _eliminate_pair(matrix, k, stop, size):  # type: ignore[no-untyped-def]
    """Eliminate unknowns k and k + 1 from each other and from the rows up to ``stop``.

    Loops over slices from 0 are compiled to vector instructions; indices that might be negative are not.
    """
    inverse = 1.0 / matrix[k, k]
    a = matrix[k, k + 1] * inverse
    first, second = matrix[k, k + 1 : size], matrix[k + 1, k + 1 : size]
    for j in range(second.size):
        second[j] -= a * first[j]
    following = 1.0 / matrix[k + 1, k + 1]
    for i in range(k + 2, stop):
        a, b = matrix[k, i] * inverse, matrix[k + 1, i] * following
        row, first, second = matrix[i, i:size], matrix[k, i:size], matrix[k + 1, i:size]
        for j in range(row.size):
            row[j] -= a * first[j] + b * second[j]


@njit(cache=True)
def _eliminate_eight(matrix, k, size):  # type: ignore[no-untyped-def]
    """Eliminate unknowns k to k + 7, already eliminated from each other, from all rows below."""
    inverse = np.empty(8)
    for p in range(8):
        inverse[p] = 1.0 / matrix[k + p, k + p]
    for i in range(k + 8, size):
        r0, r1, r2, r3 = matrix[k, i:size], matrix[k + 1, i:size], matrix[k + 2, i:size], matrix[k + 3, i:size]
        r4, r5, r6, r7 = matrix[k + 4, i:size], matrix[k + 5, i:size], matrix[k + 6, i:size], matrix[k + 7, i:size]
        a, b, c, d = r0[0] * inverse[0], r1[0] * inverse[1], r2[0] * inverse[2], r3[0] * inverse[3]
        e, f, g, h = r4[0] * inverse[4], r5[0] * inverse[5], r6[0] * inverse[6], r7[0] * inverse[7]
        row = matrix[i, i:size]
        for j in range(row.size):
            value = row[j] - (a * r0[j] + b * r1[j])
            value -= c * r2[j] + d * r3[j]
            value -= e * r4[j] + f * r5[j]
            row[j] = value - (g * r6[j] + h * r7[j])


@njit(cache=True)
def substitute_back(matrix, inner, size, values):  # type: ignore[no-untyped-def]
    """Inner unknowns from the outer ones in ``values[inner:size]``, after `eliminate_dense`."""
    for k in range(inner - 1, -1, -1):
        total = 0.0
        for j in range(k + 1, size):
            total += matrix[k, j] * values[j]
        values[k] = -total / matrix[k, k]
