r"""The frame of a cell: temperatures at its vertices and at inner nodes of its edges.

On an edge of degree p the temperature is the polynomial through its values at the Gauss-Lobatto-Legendre points, the
zeros of (1 - y^2) P_p'(y). The outer two are vertices; the p - 1 inner ones belong to the edge. All unknowns are
temperatures, so a uniform temperature is a vector of ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etc_engine.structure.laguerre_2d import LaguerreCells

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MOST_DEGREES = 5
"""Highest polynomial degree of an edge."""


def lobatto_points(degree: int) -> Floats:
    """Gauss-Lobatto-Legendre points on [-1, 1], shape (degree + 1,).

    Examples
    --------
    >>> lobatto_points(3).round(6).tolist()
    [-1.0, -0.447214, 0.447214, 1.0]
    """
    if degree == 1:
        return np.array([-1.0, 1.0])
    legendre = np.zeros(degree + 1)
    legendre[degree] = 1.0
    inner = np.sort(np.polynomial.legendre.legroots(np.polynomial.legendre.legder(legendre)))
    inner = 0.5 * (inner - inner[::-1])
    return np.concatenate(([-1.0], inner, [1.0]))


@njit(cache=True)
def lagrange_values(y, points, values):  # type: ignore[no-untyped-def]
    """Values at y of the Lagrange polynomials of ``points``: first end, last end, then the inner nodes."""
    last = points.size - 1
    for m in range(last + 1):
        product = 1.0
        for l in range(last + 1):
            if l != m:
                product *= (y - points[l]) / (points[m] - points[l])
        values[0 if m == 0 else (1 if m == last else m + 1)] = product


@dataclass(frozen=True, eq=False)
class Frame:
    """Unknowns of all frames.

    Parameters
    ----------
    degree : int
        Polynomial degree p of every edge.
    count : int
        Number of unknowns: vertices first, then p - 1 for each edge.
    starts : ndarray of int64, shape (n + 1,)
        The frame of cell i is ``unknowns[starts[i]:starts[i + 1]]``.
    unknowns : ndarray of int64
        Number of each unknown: vertices in the order of the sides, then the inner nodes side by side, both
        counter-clockwise.
    positions : ndarray, shape (., 2) [m]
        Where they are, seen from the centre of the disk.
    """

    degree: int
    count: int
    starts: Ints
    unknowns: Ints
    positions: Floats


def build_frame(cells: LaguerreCells, degree: int) -> Frame:
    """Unknowns of the frames of Laguerre cells, for edges of one degree."""
    inner = degree - 1
    sides = np.diff(cells.starts)
    starts = np.concatenate(([0], np.cumsum(sides * degree)))
    rows = np.arange(cells.edges.size)
    owner = np.repeat(np.arange(sides.size), sides)
    within = rows - cells.starts[owner]
    unknowns = np.empty(starts[-1], dtype=np.int64)
    positions = np.empty((starts[-1], 2))
    at = starts[owner] + within
    unknowns[at], positions[at] = cells.vertices, cells.corners
    following = rows + 1
    following[cells.starts[1:] - 1] = cells.starts[:-1]
    shares = 0.5 * (lobatto_points(degree)[1:-1] + 1.0)
    for k in range(inner):
        at = starts[owner] + sides[owner] + within * inner + k
        node = np.where(cells.forward, k, inner - 1 - k)
        unknowns[at] = cells.vertex_count + cells.edges * inner + node
        positions[at] = cells.corners + shares[k] * (cells.corners[following] - cells.corners)
    return Frame(degree, cells.vertex_count + cells.edge_count * inner, starts, unknowns, positions)
