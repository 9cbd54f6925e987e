r"""How the edges of Laguerre cells are divided, and with them the rims of the disks.

Inside a cell the temperature is sharp where two disks come close. The intervals of an edge shrink towards these places.
With s along the edge, measured from the line of centres, an interval is at most as long as

.. math:: \min\bigl(0.3\,R_{min},\ (s_2 - s_1)/p,\ \mathrm{graded}(s)\bigr)

for an edge of polynomial degree p, where graded(s) is hypot(s, w) with w = sqrt(gap R_eff) at a gap, and the distance
to the nearest corner (but at least a smallest size) at a contact: s = 0 of touching disks, both ends of a contact of
finite width.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LONGEST = 0.3
"""Longest interval in radii of the smaller disk."""
CORNER = 0.05
"""Smallest interval at the ends of a contact, in half-widths of the contact."""
FINEST = 1e-5
"""Smallest interval at a touching point in radii; above it, the conductivity ratio k_f/k_s sets it."""

GAP, TOUCHING, CUT, BONDED, NECK = 0, 1, 2, 3, 4
"""Kinds of edges: a gap of fluid, one point, overlap, a contact without thickness, a bridge of solid in the gap."""


class EdgeGrid(NamedTuple):
    """Division of m edges.

    Attributes
    ----------
    starts : ndarray of int64, shape (m + 1,)
        The points of edge e are the rows ``starts[e]`` to ``starts[e + 1]``.
    points : ndarray [m]
        Ascending positions along the edge, both ends included.
    """

    starts: Ints
    points: Floats


@njit(cache=True)
def _longest(a, b, singular, smallest, count, width):  # type: ignore[no-untyped-def]
    """Longest interval allowed on [a, b] by the corners and, if width > 0, by a gap about s = 0."""
    longest = np.inf
    for k in range(count):
        longest = min(longest, max(a - singular[k], singular[k] - b, 0.0, smallest[k]))
    if width > 0.0:
        longest = min(longest, math.hypot(max(a, -b, 0.0), width))
    return longest


@njit(cache=True)
def divide_edge(start, stop, cap, singular, smallest, count, width, points):  # type: ignore[no-untyped-def]
    """Break points of one edge by recursive bisection; returns how many (into ``points``)."""
    forced = np.empty(count + 2)
    forced[0], pieces = start, 1
    tiny = 1e-9 * (stop - start)
    for k in range(count):
        if start + tiny < singular[k] < stop - tiny:
            forced[pieces] = singular[k]
            pieces += 1
    forced[pieces] = stop
    forced = np.sort(forced[: pieces + 1])
    stack = np.empty(128)
    points[0], found = start, 1
    for piece in range(pieces):
        a, top = forced[piece], 0
        stack[0] = forced[piece + 1]
        while top >= 0:
            b = stack[top]
            if b - a <= 1.0001 * min(cap, _longest(a, b, singular, smallest, count, width)) or top == 127:
                points[found] = b
                found, a, top = found + 1, b, top - 1
            else:
                top += 1
                stack[top] = 0.5 * (a + b)
    return found


@njit(cache=True)
def divide_edges(kind, ends, corner, width, smallest, cap):  # type: ignore[no-untyped-def]
    """Break points of all edges.

    Parameters
    ----------
    kind : ndarray of int64, shape (m,)
    ends : ndarray, shape (m, 2)
    corner : ndarray, shape (m,)
        Half-width of the contact, 0 for none.
    width : ndarray, shape (m,)
        Length w over which a gap opens, sqrt(gap R_eff); only used at gaps.
    smallest : ndarray, shape (m, 2)
        Smallest interval at the ends of the contact, and at s = 0.
    cap : ndarray, shape (m,)
        Longest interval.

    Returns
    -------
    starts, points : ndarray
    """
    m = kind.size
    starts = np.zeros(m + 1, dtype=np.int64)
    points = np.empty(16 * m + 1024)
    singular, size = np.empty(3), np.empty(3)
    buffer = np.empty(1024)
    for e in range(m):
        count = 0
        if kind[e] >= CUT:
            singular[0], singular[1], count = -corner[e], corner[e], 2
            size[0] = size[1] = smallest[e, 0]
        if kind[e] == TOUCHING or (kind[e] == NECK and width[e] == 0.0):
            singular[count], size[count] = 0.0, smallest[e, 1]
            count += 1
        opening = width[e] if kind[e] == GAP else 0.0
        found = divide_edge(ends[e, 0], ends[e, 1], cap[e], singular, size, count, opening, buffer)
        begin = starts[e]
        if begin + found > points.size:
            more = np.empty(2 * points.size + 1024)
            more[:begin] = points[:begin]
            points = more
        points[begin : begin + found] = buffer[:found]
        starts[e + 1] = begin + found
    return starts, points[: starts[m]].copy()
