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
        for k in range(_TERMS - 1, -1, -1):
            term = CLAUSEN_SERIES[k]
            for j in range(i):
                spare[i, j] = spare[i, j] * squares[j] + term
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
        for j in range(count):
            out[i, j] = (low + high) * spare[i, j] - low * spare[before, j] - high * spare[after, j]
    for i in range(count):  # out = (S C) S, row by row
        first, last = out[i, 0], out[i, count - 1]
        left = last
        for j in range(count):
            here = out[i, j]
            right = out[i, j + 1] if j < count - 1 else first
            low, high = inverse[j - 1 if j > 0 else count - 1], inverse[j]
            out[i, j] = (low + high) * here - low * left - high * right
            left = here
