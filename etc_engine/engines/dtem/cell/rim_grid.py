r"""How the edges of Laguerre cells are divided, and with them the rims of the disks.

Inside a cell the temperature is sharp where two disks come close. The intervals of an edge shrink towards these places.
With x the distance along the edge from such a place, an interval is about as long as

.. math:: \min\bigl(0.2\,R_{min},\ (s_2 - s_1)/p,\ \mathrm{graded}(x)\bigr)

for an edge of polynomial degree p. graded(x) is 0.7 hypot(x, w), w = sqrt(gap R_eff), about the line of centres across
a gap, and 0.7 x (but at least a smallest size) about a touching point and both ends of a contact. The break points cut
the integral of 1/size into equal parts, so that they move smoothly with gaps, angles and conductivities.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from etc_engine.arrays import Floats, Ints

LONGEST = 0.2
"""Longest interval in radii of the smaller disk."""
CORNER_GROWTH, GAP_GROWTH = 0.7, 0.7
"""Growth of the intervals with the distance from a contact, and from the line of centres across a gap."""
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
def _count_to(x, law, scale, rate, cap):  # type: ignore[no-untyped-def]
    """Intervals between a place and a distance x from it: the integral of 1/size.

    size(x) = min(cap, max(scale, rate x)) at a corner (law 0), min(cap, rate hypot(x, scale)) at a gap (law 1).
    """
    if law == 0:
        first = min(scale, cap)
        flat = first / rate
        if x <= flat or first == cap:
            return x / first
        curved = min(x, cap / rate)
        return 1.0 / rate + math.log(curved / flat) / rate + (x - curved) / cap
    if rate * scale >= cap:
        return x / cap
    curved = min(x, math.sqrt((cap / rate) ** 2 - scale * scale))
    return math.asinh(curved / scale) / rate + (x - curved) / cap


@njit(cache=True)
def _distance_of(n, law, scale, rate, cap):  # type: ignore[no-untyped-def]
    """Inverse of `_count_to`: the distance that n intervals reach."""
    if law == 0:
        first = min(scale, cap)
        if n <= 1.0 / rate or first == cap:
            return n * first
        last = cap / rate
        most = 1.0 / rate + math.log(last * rate / first) / rate
        if n > most:
            return last + (n - most) * cap
        return first / rate * math.exp(n * rate - 1.0)
    if rate * scale >= cap:
        return n * cap
    last = math.sqrt((cap / rate) ** 2 - scale * scale)
    most = math.asinh(last / scale) / rate
    return scale * math.sinh(n * rate) if n <= most else last + (n - most) * cap


@njit(cache=True)
def _divide_piece(start, stop, origin, law, scale, cap, points, found):  # type: ignore[no-untyped-def]
    """Add the break points of a piece on one side of the place ``origin``; returns how many there are now."""
    rate = CORNER_GROWTH if law == 0 else GAP_GROWTH
    sign = 1.0 if start >= origin else -1.0
    low = _count_to(abs(start - origin), law, scale, rate, cap)
    high = _count_to(abs(stop - origin), law, scale, rate, cap)
    pieces = max(math.ceil(abs(high - low) * (1.0 - 1e-9)), 1)
    for k in range(1, pieces):
        n = low + (high - low) * k / pieces
        points[found] = origin + sign * _distance_of(n, law, scale, rate, cap)
        found += 1
    points[found] = stop
    return found + 1


@njit(cache=True)
def divide_edge(start, stop, cap, places, scales, count, law, points):  # type: ignore[no-untyped-def]
    """Break points of one edge, graded about ascending ``places``; returns how many (into ``points``).

    Each part of the edge is graded from its nearest place; the places inside are break points, and so are the middles
    between them.
    """
    points[0], found = start, np.int64(1)  # a plain 1 is a type of its own: a second compilation of `_divide_piece`
    tiny = 1e-9 * (stop - start)
    here = start
    for k in range(count):
        last = stop if k == count - 1 else min(0.5 * (places[k] + places[k + 1]), stop)
        if here < places[k] - tiny and places[k] < stop - tiny:
            found = _divide_piece(here, places[k], places[k], law, scales[k], cap, points, found)
            here = places[k]
        elif abs(here - places[k]) <= tiny:
            here = points[found - 1]
        if here < last - tiny:
            found = _divide_piece(here, last, places[k], law, scales[k], cap, points, found)
            here = last
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
    places, scales = np.empty(3), np.empty(3)
    buffer = np.empty(4096)
    for e in range(m):
        law, count = 0, 1
        places[0], scales[0] = 0.0, smallest[e, 1]
        if kind[e] == GAP:
            law, scales[0] = 1, width[e]
        elif kind[e] >= CUT:
            count = 2
            if kind[e] == NECK and width[e] == 0.0:
                places[1], scales[1], count = 0.0, smallest[e, 1], 3
            places[0], places[count - 1] = -corner[e], corner[e]
            scales[0] = scales[count - 1] = smallest[e, 0]
        found = divide_edge(ends[e, 0], ends[e, 1], cap[e], places, scales, count, law, buffer)
        begin = starts[e]
        if begin + found > points.size:
            more = np.empty(2 * points.size + 1024)
            for k in range(begin):
                more[k] = points[k]
            points = more
        for k in range(found):
            points[begin + k] = buffer[k]
        starts[e + 1] = begin + found
    return starts, points[: starts[m]].copy()
