"""Neighbour pairs of a packing: all pairs whose surfaces are closer than a given reach, in linear time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from etc_engine.arrays import Floats, Ints
from etc_engine.errors import InputError
from etc_engine.packing.cell_grids import cell_grids, cell_of, cell_range
from etc_engine.packing.particles import ParticlePacking


@dataclass(frozen=True, eq=False)
class NeighborPairs:
    """Pairs of neighbouring particles, sorted by i, then j, then shift.

    Parameters
    ----------
    pairs : ndarray of int64, shape (m, 2)
        Row numbers i <= j; i == j only for a particle next to its own periodic image.
    shifts : ndarray of int64, shape (m, d)
        Box shifts s: the neighbour of i is the image of j at ``x_j + s * lengths``.
    gaps : ndarray, shape (m,) [m]
        Surface gaps ``|x_j + s L - x_i| - R_i - R_j``; negative where particles overlap.
    """

    pairs: Ints
    shifts: Ints
    gaps: Floats

    @property
    def count(self) -> int:
        """Number of pairs."""
        return int(self.gaps.size)


def neighbor_pairs(
    packing: ParticlePacking, gap: float = 0.0, relative_gap: float = 0.0, *, images: bool = True
) -> NeighborPairs:
    r"""All pairs of particles whose surface gap is within reach.

    .. math:: |x_j + s L - x_i| - R_i - R_j \le g + g_r (R_i + R_j) / 2

    Parameters
    ----------
    packing : ParticlePacking
        Disks or spheres in a box with any mix of walled and periodic axes.
    gap : float
        Largest gap g [m], not negative.
    relative_gap : float
        Largest gap in units of the mean radius of the pair, not negative.
    images : bool
        Whether to report a particle as the neighbour of its own periodic image (i == j).

    Returns
    -------
    NeighborPairs
        Each pair (i, j, s) once, with i < j, or i == j and the first nonzero component of s positive.
        A periodic box under two diameters wide gives one pair for each image within reach.

    Raises
    ------
    InputError
        If a reach is negative or not finite.

    Notes
    -----
    Particles are sorted into size classes, each with a cell grid as wide as its largest reach, and every
    particle searches the grids of its own and the larger classes. The cost is linear in the number of
    particles for any mixture of sizes, times the number of size classes present.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> packing = ParticlePacking([[0.1, 0.5], [0.9, 0.5]], [0.1, 0.1], Box((1.0, 1.0), (True, False)))
    >>> found = neighbor_pairs(packing, gap=1e-9)
    >>> found.pairs.tolist(), found.shifts.tolist()
    ([[0, 1]], [[-1, 0]])
    """
    for name, value in (("gap", gap), ("relative_gap", relative_gap)):
        if not (np.isfinite(value) and value >= 0.0):
            raise InputError(f"the {name} of neighbour pairs must be finite and not negative, found {value}")
    d = packing.dimension
    centers = np.zeros((packing.count, 3))
    centers[:, :d] = packing.centers
    grids = cell_grids(packing.radii, packing.box, gap, relative_gap)
    i, j, shift, gaps = _search(centers, packing.radii, grids, float(gap), float(relative_gap), images)
    order = _sort_pairs(i, j, shift, packing.count)
    pairs = np.column_stack((i[order], j[order]))
    return NeighborPairs(pairs, shift[order, :d].astype(np.int64), gaps[order])


@njit(cache=True)
def _sort_into_cells(centers, level, cells, first_cell, lengths, classes):  # type: ignore[no-untyped-def]
    """Counting sort of the particles by class and cell.

    Returns the sorted row numbers, where each cell starts in them, and where each class starts.
    """
    n = level.size
    starts = np.zeros(first_cell[-1] + 1, dtype=np.int64)
    cell = np.empty(n, dtype=np.int64)
    for i in range(n):
        cell[i] = cell_of(centers[i, 0], centers[i, 1], centers[i, 2], level[i], cells, first_cell, lengths)
        starts[cell[i] + 1] += 1
    for c in range(starts.size - 1):
        starts[c + 1] += starts[c]
    fill, order = np.empty(starts.size, dtype=np.int64), np.empty(n, dtype=np.int64)
    for c in range(starts.size):
        fill[c] = starts[c]
    for i in range(n):
        order[fill[cell[i]]] = i
        fill[cell[i]] += 1
    begin = np.empty(classes + 1, dtype=np.int64)
    for k in range(classes + 1):
        begin[k] = starts[first_cell[k]]
    return order, starts, begin


@njit(cache=True)
def _search(centers, radii, grids, gap, relative, images):  # type: ignore[no-untyped-def]
    """Pairs found by every particle in the grids of its own and of the larger classes."""
    level, cells, first_cell, largest, lengths, periodic = grids
    order, starts, begin = _sort_into_cells(centers, level, cells, first_cell, lengths, largest.size)
    n = radii.size
    capacity = 4 * n + 16
    out_i = np.empty(capacity, dtype=np.int64)
    out_j = np.empty(capacity, dtype=np.int64)
    out_shift = np.empty((capacity, 3), dtype=np.int32)
    out_gap = np.empty(capacity)
    longest = max(lengths[0], lengths[1], lengths[2])
    found = 0
    for own in range(largest.size):
        for place in range(begin[own], begin[own + 1]):
            i = order[place]
            for k in range(own + 1):
                reach = (radii[i] + largest[k]) * (1.0 + 0.5 * relative) + gap
                reach += 1e-12 * (reach + longest)  # rounding of the cell index must not lose a pair
                x0, x1 = cell_range(centers[i, 0], reach, lengths[0], cells[k, 0], periodic[0])
                y0, y1 = cell_range(centers[i, 1], reach, lengths[1], cells[k, 1], periodic[1])
                z0, z1 = cell_range(centers[i, 2], reach, lengths[2], cells[k, 2], periodic[2])
                for cx in range(x0, x1 + 1):
                    sx = cx // cells[k, 0]
                    for cy in range(y0, y1 + 1):
                        sy = cy // cells[k, 1]
                        for cz in range(z0, z1 + 1):
                            sz = cz // cells[k, 2]
                            c = (cx - sx * cells[k, 0]) * cells[k, 1] + (cy - sy * cells[k, 1])
                            c = first_cell[k] + c * cells[k, 2] + (cz - sz * cells[k, 2])
                            for other in range(starts[c], starts[c + 1]):
                                j = order[other]
                                if k == own and j < i:
                                    continue  # j finds i
                                if i == j and not (
                                    images and (sx > 0 or (sx == 0 and (sy > 0 or (sy == 0 and sz > 0))))
                                ):
                                    continue
                                if i <= j:
                                    low, high, tx, ty, tz = i, j, sx, sy, sz
                                else:
                                    low, high, tx, ty, tz = j, i, -sx, -sy, -sz
                                dx = centers[high, 0] + tx * lengths[0] - centers[low, 0]
                                dy = centers[high, 1] + ty * lengths[1] - centers[low, 1]
                                dz = centers[high, 2] + tz * lengths[2] - centers[low, 2]
                                touch = radii[low] + radii[high]
                                square = dx * dx + dy * dy + dz * dz
                                limit = touch + gap + relative * 0.5 * touch
                                if square > limit * limit * (1.0 + 1e-12):
                                    continue
                                surface = np.sqrt(square) - touch
                                if surface > gap + relative * 0.5 * touch:
                                    continue
                                if found == capacity:
                                    capacity *= 2
                                    out_i, out_j, out_shift, out_gap = _grown(
                                        out_i, out_j, out_shift, out_gap, capacity
                                    )
                                out_i[found], out_j[found], out_gap[found] = low, high, surface
                                out_shift[found, 0], out_shift[found, 1], out_shift[found, 2] = tx, ty, tz
                                found += 1
    return out_i[:found], out_j[:found], out_shift[:found], out_gap[:found]


@njit(cache=True)
def _grown(out_i, out_j, out_shift, out_gap, capacity):  # type: ignore[no-untyped-def]
    """The same pairs with room for more."""
    i, j = np.empty(capacity, dtype=np.int64), np.empty(capacity, dtype=np.int64)
    shift, gap = np.empty((capacity, 3), dtype=np.int32), np.empty(capacity)
    for m in range(out_i.size):
        i[m], j[m], gap[m] = out_i[m], out_j[m], out_gap[m]
        for axis in range(3):
            shift[m, axis] = out_shift[m, axis]
    return i, j, shift, gap


@njit(cache=True)
def _after(i, j, shift, a, b):  # type: ignore[no-untyped-def]
    """Whether pair a comes after pair b in the order (i, j, shift)."""
    if i[a] != i[b]:
        return i[a] > i[b]
    if j[a] != j[b]:
        return j[a] > j[b]
    for axis in range(3):
        if shift[a, axis] != shift[b, axis]:
            return shift[a, axis] > shift[b, axis]
    return False


@njit(cache=True)
def _sort_pairs(i, j, shift, n):  # type: ignore[no-untyped-def]
    """Stable order of the pairs by (i, j, shift): counting sorts by j, then i, then the few equal ones."""
    order = np.empty(i.size, dtype=np.int64)
    for m in range(i.size):
        order[m] = m
    for key in (j, i):
        fill = np.zeros(n + 1, dtype=np.int64)
        for m in range(key.size):
            fill[key[m] + 1] += 1
        for row in range(n):
            fill[row + 1] += fill[row]
        sorted_order = np.empty(order.size, dtype=np.int64)
        for m in order:
            sorted_order[fill[key[m]]] = m
            fill[key[m]] += 1
        order = sorted_order
    for place in range(1, order.size):
        m = order[place]
        slot = place
        while slot > 0 and _after(i, j, shift, order[slot - 1], m):
            order[slot] = order[slot - 1]
            slot -= 1
        order[slot] = m
    return order
