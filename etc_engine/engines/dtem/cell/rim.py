r"""Energy of a whole disk as a quadratic form of the temperatures at points of its rim.

With the rim temperature linear in the angle between nodes at phi_1 .. phi_M,

.. math:: E = -\frac{k}{\pi} \int\!\!\int T'(a)\, T'(b) \ln\Bigl|2 \sin\frac{a - b}{2}\Bigr|\, da\, db
    = T \cdot A\, T, \qquad A = \frac{k}{\pi}\, S\, C\, S,

where C_ij = sum_k cos(k (phi_i - phi_j))/k^3 (its second derivative is the logarithm; a constant in it does not
matter) and S is the cyclic tridiagonal stiffness of the hat functions, S_ii = 1/d_(i-1) + 1/d_i, S_i,i+1 = -1/d_i.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from etc_engine.laws.disk import CLAUSEN_SERIES

_TERMS = 18
"""Terms of the series of C that reach round-off on 0 .. pi."""


@njit(cache=True)
def disk_energy(angles, count, conductivity, spare, out):  # type: ignore[no-untyped-def]
    """Fill out[:count, :count] with A for ascending rim angles within one turn; ``spare`` has the same shape.

    C is folded to 0 .. pi. The series of a row is summed term by term for all columns at once.
    """
    squares, logs = np.empty(count), np.empty(count)
    for i in range(count):
        for j in range(i):
            x = angles[i] - angles[j]
            x = 2.0 * math.pi - x if x > math.pi else x
            squares[j] = x * x
            logs[j] = 0.25 * math.log(x * x) - 0.75
            spare[i, j] = 0.0
        for k in range(_TERMS - 1, -1, -6):
            a, b, c = CLAUSEN_SERIES[k], CLAUSEN_SERIES[k - 1], CLAUSEN_SERIES[k - 2]
            d, e, f = CLAUSEN_SERIES[k - 3], CLAUSEN_SERIES[k - 4], CLAUSEN_SERIES[k - 5]
            for j in range(i):
                x = squares[j]
                spare[i, j] = (((((spare[i, j] * x + a) * x + b) * x + c) * x + d) * x + e) * x + f
        for j in range(i):
            spare[i, j] = squares[j] * (logs[j] + spare[i, j] * squares[j])
        spare[i, i] = 0.0
    for i in range(count):
        for j in range(i):
            spare[j, i] = spare[i, j]
    inverse = np.empty(count)
    for i in range(count - 1):
        inverse[i] = 1.0 / (angles[i + 1] - angles[i])
    inverse[count - 1] = 1.0 / (angles[0] + 2.0 * math.pi - angles[count - 1])
    factor = conductivity / math.pi
    for i in range(count):  # out = S C
        before, after = (i - 1 if i > 0 else count - 1), (i + 1 if i < count - 1 else 0)
        low, high = factor * inverse[before], factor * inverse[i]
        here, left, right, row = spare[i, :count], spare[before, :count], spare[after, :count], out[i, :count]
        for j in range(count):  # slices: vector instructions
            row[j] = (low + high) * here[j] - low * left[j] - high * right[j]
    end = count - 1
    below, above = inverse[: count - 2], inverse[1:end]
    for i in range(count):  # out = (S C) S, row by row
        row, source = out[i, :count], logs
        for j in range(count):  # an assignment of slices compiles for a second
            source[j] = row[j]
        left, here, right, inner = source[: count - 2], source[1:end], source[2:], row[1:end]
        for j in range(inner.size):
            inner[j] = (below[j] + above[j]) * here[j] - below[j] * left[j] - above[j] * right[j]
        row[0] = (inverse[end] + inverse[0]) * source[0] - inverse[end] * source[end] - inverse[0] * source[1]
        low, high = inverse[end - 1], inverse[end]
        row[end] = (low + high) * source[end] - low * source[end - 1] - high * source[0]
    # close nodes leave round-off that grows with inverse[i]^2: a uniform temperature still must give no flow
    for i in range(count):
        row = out[i, :count]
        total = 0.0
        for j in range(i):
            row[j] = out[j, i]
            total += row[j]
        for j in range(i + 1, count):
            total += row[j]
        row[i] = -total
