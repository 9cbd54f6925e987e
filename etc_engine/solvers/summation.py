"""Sums of products in one order: their bits depend neither on the number of threads nor on the BLAS library."""

from __future__ import annotations

import numpy as np
from numba import njit

from etc_engine.arrays import Floats


def dot(a: Floats, b: Floats) -> float:
    """Inner product of two vectors of shape (n,).

    Examples
    --------
    >>> dot(np.ones(3), np.arange(3.0))
    3.0
    """
    return float(inner(a[:, None], b[:, None])[0, 0])


def inner(a: Floats, b: Floats) -> Floats:
    """Inner products of the columns of two tall matrices, a^T b, shape (q, k)."""
    return np.asarray(_sum_products(np.ascontiguousarray(a), np.ascontiguousarray(b)))


def combine(columns: Floats, weights: Floats) -> Floats:
    """Product of a tall and a small matrix, shape (n, a)."""
    return np.asarray(np.einsum("iq,qa->ia", columns, weights))


@njit(cache=True)
def _sum_products(a: Floats, b: Floats) -> Floats:
    """Sums over short blocks of rows, four at a time, then over the blocks: fast, and little round-off."""
    rows = a.shape[0]
    total = np.zeros((a.shape[1], b.shape[1]))
    for first in range(0, rows, 256):
        last = min(first + 256, rows)
        even = last - (last - first) % 4
        for j in range(a.shape[1]):
            for k in range(b.shape[1]):
                s0, s1, s2, s3 = 0.0, 0.0, 0.0, 0.0
                for i in range(first, even, 4):
                    s0 += a[i, j] * b[i, k]
                    s1 += a[i + 1, j] * b[i + 1, k]
                    s2 += a[i + 2, j] * b[i + 2, k]
                    s3 += a[i + 3, j] * b[i + 3, k]
                for i in range(even, last):
                    s0 += a[i, j] * b[i, k]
                total[j, k] += (s0 + s1) + (s2 + s3)
    return total
