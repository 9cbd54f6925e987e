r"""The frame of a cell: temperatures at its vertices and at inner nodes of its edges.

On an edge of degree p the temperature is the polynomial through its values at the Gauss-Lobatto-Legendre points, the
zeros of (1 - y^2) P_p'(y). The outer two are vertices; the p - 1 inner ones belong to the edge. All unknowns are
temperatures, so a uniform temperature is a vector of ones. Edges that are long against the disks get more than the
degree asked for, one more for every `LONG` radii of the smaller disk.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from etc_engine.arrays import Floats, Ints
from etc_engine.structure.laguerre_2d import LaguerreCells

MOST_DEGREES = 5
"""Highest degree that can be asked for."""
HIGHEST = 8
"""Highest degree that a long edge gets."""
LONG = 1.25
"""Edge length in radii of the smaller disk for which the degree grows by one."""


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


_LOBATTO = np.zeros((HIGHEST + 1, HIGHEST + 1))
for _degree in range(1, HIGHEST + 1):
    _LOBATTO[_degree, : _degree + 1] = lobatto_points(_degree)


@njit(cache=True)
def lagrange_values(y, last, values):  # type: ignore[no-untyped-def]
    """Values at y of the Lagrange polynomials of degree ``last``: first end, last end, then the inner nodes."""
    points = _LOBATTO[last]
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
    degrees : ndarray of int64, shape (m,)
        Polynomial degree of each edge.
    first : ndarray of int64, shape (m + 1,)
        Unknown of the first inner node of each edge; vertices come before, the total is last.
    starts : ndarray of int64, shape (n + 1,)
        The frame of cell i is ``unknowns[starts[i]:starts[i + 1]]``.
    unknowns : ndarray of int64
        Number of each unknown: vertices in the order of the sides, then the inner nodes side by side, both
        counter-clockwise.
    positions : ndarray, shape (., 2) [m]
        Where they are, seen from the centre of the disk.
    storing : bool
        Whether every cell ends with the mean temperature of its disk, which is needed where disks store heat.
    """

    degrees: Ints
    first: Ints
    starts: Ints
    unknowns: Ints
    positions: Floats
    storing: bool = False

    @property
    def count(self) -> int:
        """Number of unknowns; the means of storing disks come last."""
        return int(self.first[-1]) + (self.starts.size - 1 if self.storing else 0)


def edge_degrees(lengths: Floats, smaller: Floats, degree: int) -> Ints:
    """Degree of each edge for its length and the smaller radius beside it.

    Examples
    --------
    >>> edge_degrees(np.array([1.5, 2.5, 40.0]), np.ones(3), 3).tolist()
    [4, 5, 8]
    """
    longer = np.floor(lengths / (LONG * smaller))
    return np.minimum(degree + longer, HIGHEST).astype(np.int64)


def build_frame(cells: LaguerreCells, degrees: Ints, *, storing: bool = False) -> Frame:
    """Unknowns of the frames of Laguerre cells, for edges of given degrees."""
    sides = np.diff(cells.starts)
    owner = np.repeat(np.arange(sides.size), sides)
    inner = degrees[cells.edges] - 1
    before = np.concatenate(([0], np.cumsum(inner)))
    starts = np.concatenate(([0], np.cumsum(sides + storing))) + before[cells.starts]
    rows = np.arange(cells.edges.size)
    unknowns = np.empty(starts[-1], dtype=np.int64)
    positions = np.zeros((starts[-1], 2))
    at = starts[owner] + rows - cells.starts[owner]
    unknowns[at], positions[at] = cells.vertices, cells.corners
    following = rows + 1
    following[cells.starts[1:] - 1] = cells.starts[:-1]
    first = cells.vertex_count + np.concatenate(([0], np.cumsum(degrees - 1)))
    for k in range(int(inner.max())):
        has = rows[inner > k]
        at = starts[owner[has]] + sides[owner[has]] + before[has] - before[cells.starts[owner[has]]] + k
        node = np.where(cells.forward[has], k, inner[has] - 1 - k)
        unknowns[at] = first[cells.edges[has]] + node
        share = 0.5 * (_LOBATTO[inner[has] + 1, k + 1] + 1.0)[:, None]
        positions[at] = cells.corners[has] + share * (cells.corners[following[has]] - cells.corners[has])
    if storing:
        unknowns[starts[1:] - 1] = first[-1] + np.arange(sides.size)
    return Frame(degrees, first, starts, unknowns, positions, storing)
