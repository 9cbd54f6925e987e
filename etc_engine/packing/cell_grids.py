"""One cell grid for each size class, so that searches stay linear in the number for any mixture of sizes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.box import Box

MAX_OCTAVES = 40
"""Radii halve from one class to the next; below 2**-40 of the largest they share the last class."""


class CellGrids(NamedTuple):
    """Size classes, from the largest radius down, and their cell grids (always three axes).

    Attributes
    ----------
    level : ndarray of int64, shape (n,)
        Size class of each particle.
    cells : ndarray of int64, shape (classes, 3)
        Number of cells of each class along each axis.
    first_cell : ndarray of int64, shape (classes + 1,)
        Number of the first cell of each class; the cells of all classes are numbered one after another.
    largest : ndarray, shape (classes,) [m]
        Largest radius of each class.
    lengths : ndarray, shape (3,) [m]
        Edge lengths of the box; a third axis of unit length in 2D.
    periodic : ndarray of bool, shape (3,)
        Periodic axes.
    """

    level: Ints
    cells: Ints
    first_cell: Ints
    largest: Floats
    lengths: Floats
    periodic: Flags


def cell_grids(radii: Floats, box: Box, gap: float = 0.0, relative_gap: float = 0.0) -> CellGrids:
    """Cell grids for particles of these radii that are neighbours up to the given surface gaps.

    Notes
    -----
    A class has at most about two cells for each of its members: a few large particles among many small
    ones cost neither memory nor search time.
    """
    octave = np.floor(np.log2(radii.max() / radii)).astype(np.int64)
    present, level = np.unique(np.minimum(octave, MAX_OCTAVES), return_inverse=True)
    members = np.bincount(level)
    largest = np.zeros(present.size)
    np.maximum.at(largest, level, radii)
    d = box.dimension
    lengths = np.array([*box.lengths, *(1.0,) * (3 - d)])
    periodic = np.array([*box.periodic, *(False,) * (3 - d)])
    width = 2.0 * largest + gap + relative_gap * largest
    width = np.maximum(width, (box.volume / (2.0 * members)) ** (1.0 / d))
    cells = np.ones((present.size, 3), dtype=np.int64)
    most = 2 * members[:, None] + 1
    cells[:, :d] = np.clip(np.floor(lengths[:d] / width[:, None]), 1, most)
    first_cell = np.concatenate(([0], np.cumsum(cells.prod(axis=1))))
    return CellGrids(level, cells, first_cell, largest, lengths, periodic)


@njit(cache=True)
def cell_range(x, reach, length, count, periodic):  # type: ignore[no-untyped-def]
    """First and last cell along an axis that a search of the given reach around x visits (not wrapped)."""
    low = int(np.floor((x - reach) / length * count))
    high = int(np.floor((x + reach) / length * count))
    if not periodic:
        low = min(max(low, 0), count - 1)
        high = min(max(high, 0), count - 1)
    return low, high


@njit(cache=True)
def cell_of(x, y, z, k, cells, first_cell, lengths):  # type: ignore[no-untyped-def]
    """Number of the cell of class k that holds a point inside the box."""
    cx = min(max(int(x / lengths[0] * cells[k, 0]), 0), cells[k, 0] - 1)
    cy = min(max(int(y / lengths[1] * cells[k, 1]), 0), cells[k, 1] - 1)
    cz = min(max(int(z / lengths[2] * cells[k, 2]), 0), cells[k, 2] - 1)
    return first_cell[k] + (cx * cells[k, 1] + cy) * cells[k, 2] + cz
