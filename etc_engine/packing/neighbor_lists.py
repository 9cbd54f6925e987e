"""Neighbour lists of moving particles, renewed one particle at a time.

The anchor of a particle is the ball it stays in, its own surface included, till its list is renewed: two
particles whose balls do not meet cannot collide.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from etc_engine.packing.cell_grids import cell_of, cell_range


@njit(cache=True, error_model="numpy")
def unlist(lists, offsets, sizes, i, j):  # type: ignore[no-untyped-def]
    """Take j out of the neighbour list of i."""
    begin, last = offsets[i], offsets[i] + sizes[i] - 1
    for entry in range(begin, last + 1):
        if lists[entry] == j:
            lists[entry] = lists[last]
            sizes[i] -= 1
            return


@njit(cache=True, error_model="numpy")
def _enlist(lists, offsets, sizes, i, j):  # type: ignore[no-untyped-def]
    """Put j into the neighbour list of i; False if it is full."""
    entry = offsets[i] + sizes[i]
    if entry >= offsets[i + 1]:
        return False
    lists[entry] = j
    sizes[i] += 1
    return True


@njit(cache=True, error_model="numpy")
def _move_home(anchor, frame, level, cells, first_cell, heads, following, home, i):  # type: ignore[no-untyped-def]
    """Put the anchor of particle i into its cell, taking it out of the one where it was."""
    x = anchor[i, 0] - np.floor(anchor[i, 0] * frame[1, 0]) * frame[0, 0]
    y = anchor[i, 1] - np.floor(anchor[i, 1] * frame[1, 1]) * frame[0, 1]
    z = anchor[i, 2] - np.floor(anchor[i, 2] * frame[1, 2]) * frame[0, 2]
    cell = cell_of(x, y, z, level[i], cells, first_cell, frame[0])
    old = home[i]
    if cell == old:
        return
    if old >= 0:
        if heads[old] == i:
            heads[old] = following[i]
        else:
            before = heads[old]
            while following[before] != i:
                before = following[before]
            following[before] = following[i]
    home[i] = cell
    following[i] = heads[cell]
    heads[cell] = i


@njit(cache=True, error_model="numpy")
def drop_anchor(  # type: ignore[no-untyped-def]
    i, now, scale, excursion, state, anchor, frame, level, cells, first_cell, heads, following, home
):
    """Centre the ball of the neighbour list on the present place of particle i."""
    for axis in range(3):
        anchor[i, axis] = state[i, axis]
    radius = state[i, 7] * scale
    anchor[i, 3], anchor[i, 4], anchor[i, 5] = now, excursion * radius, radius
    _move_home(anchor, frame, level, cells, first_cell, heads, following, home, i)


@njit(cache=True, error_model="numpy")
def list_neighbors(  # type: ignore[no-untyped-def]
    i, both, anchor, frame, lists, offsets, sizes, cells, first_cell, largest, heads, following
):
    """Fill the list of i with all particles whose balls meet its own (`both`: and their lists with i)."""
    own = anchor[i, 4] + anchor[i, 5]
    sizes[i] = 0
    x = anchor[i, 0] - np.floor(anchor[i, 0] * frame[1, 0]) * frame[0, 0]
    y = anchor[i, 1] - np.floor(anchor[i, 1] * frame[1, 1]) * frame[0, 1]
    z = anchor[i, 2] - np.floor(anchor[i, 2] * frame[1, 2]) * frame[0, 2]
    for k in range(largest.size):
        reach = own + largest[k]
        x0, x1 = cell_range(x, reach, frame[0, 0], cells[k, 0], frame[1, 0] > 0.0)
        y0, y1 = cell_range(y, reach, frame[0, 1], cells[k, 1], frame[1, 1] > 0.0)
        z0, z1 = cell_range(z, reach, frame[0, 2], cells[k, 2], frame[1, 2] > 0.0)
        for sx in range(x0, min(x1, x0 + cells[k, 0] - 1) + 1):
            cx = sx % cells[k, 0]
            for sy in range(y0, min(y1, y0 + cells[k, 1] - 1) + 1):
                cy = sy % cells[k, 1]
                for sz in range(z0, min(z1, z0 + cells[k, 2] - 1) + 1):
                    cell = first_cell[k] + (cx * cells[k, 1] + cy) * cells[k, 2] + sz % cells[k, 2]
                    j = heads[cell]
                    while j >= 0:
                        if j != i:
                            dx = anchor[j, 0] - anchor[i, 0]
                            dy = anchor[j, 1] - anchor[i, 1]
                            dz = anchor[j, 2] - anchor[i, 2]
                            dx -= frame[0, 0] * np.rint(dx * frame[1, 0])
                            dy -= frame[0, 1] * np.rint(dy * frame[1, 1])
                            dz -= frame[0, 2] * np.rint(dz * frame[1, 2])
                            meet = own + anchor[j, 4] + anchor[j, 5]
                            if dx * dx + dy * dy + dz * dz < meet * meet and not (
                                _enlist(lists, offsets, sizes, i, j)
                                and (not both or _enlist(lists, offsets, sizes, j, i))
                            ):
                                return False
                        j = following[j]
    return True
