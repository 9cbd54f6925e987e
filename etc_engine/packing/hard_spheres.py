"""Event-driven dynamics of growing hard disks and spheres: exact collisions, neighbour lists, event queue.

Particle i moves freely between collisions, and its radius grows as R_i(t) = s_i (g + gamma t) with its shape
s_i and one scale for all. Every particle keeps its own clock and one event, its next: a collision, a wall, or
leaving the ball in which its neighbour list is valid.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etc_engine.arrays import Floats, Ints
from etc_engine.box import Box
from etc_engine.packing.cell_grids import cell_grids
from etc_engine.packing.event_queue import empty_queue, reschedule
from etc_engine.packing.neighbor_lists import drop_anchor, list_neighbors, unlist

EXCURSION = 0.5
"""Radius of the ball in which a particle moves before its neighbour list is renewed, in particle radii."""

LEAVES, STALE, WALL = -1, -2, -3
"""Kinds of event other than a collision with a partner; walls are WALL, WALL - 1, ..."""

DONE, FULL = 0, 1
"""Why a run stopped: as asked, or because a neighbour list had no room left."""


class Gas(NamedTuple):
    """The arrays of a hard-sphere system, always with three axes.

    Attributes
    ----------
    state : shape (n, 8)
        Position, velocity, own clock and shape s of each particle (one cache line a particle).
    anchor : shape (n, 6)
        Centre of the ball of the neighbour list, its clock, its radius and the particle's radius then.
    times, partners, heap, place
        Next event of each particle: when, with whom; and the queue.
    lists, offsets, sizes
        Neighbour lists: where each begins, and how long it is.
    frame : shape (3, 3)
        Edge lengths; 1 / length on periodic axes, else 0; 1 on walled axes, else 0.
    level, cells, first_cell, largest
        Cell grids of the anchors.
    heads, following, home
        Particles of each cell as linked lists, and the cell of each particle.
    """

    state: Floats
    anchor: Floats
    times: Floats
    partners: NDArray[np.int32]
    heap: NDArray[np.int32]
    place: NDArray[np.int32]
    lists: NDArray[np.int32]
    offsets: Ints
    sizes: Ints
    frame: Floats
    level: Ints
    cells: Ints
    first_cell: Ints
    largest: Floats
    heads: NDArray[np.int32]
    following: NDArray[np.int32]
    home: Ints


def make_gas(
    centers: Floats,
    velocities: Floats,
    shapes: Floats,
    box: Box,
    largest_scale: float,
    excursion: float,
    room: int,
) -> Gas:
    """Arrays for particles of radii ``shapes * scale``, with scales up to `largest_scale`.

    Parameters
    ----------
    centers, velocities : ndarray, shape (n, d)
    shapes : ndarray, shape (n,)
    box : Box
    largest_scale : float
        The scale the cell grids must cope with.
    excursion : float
        Ball radius of the neighbour lists in particle radii.
    room : int
        Neighbours that the list of a particle of the smallest size can hold; larger ones get more.
    """
    n, d = centers.shape
    state = np.zeros((n, 8))
    state[:, :d], state[:, 3 : 3 + d], state[:, 7] = centers, velocities, shapes
    grids = cell_grids(shapes * largest_scale * (1.0 + excursion), box)
    rooms = np.ceil(room * ((shapes / shapes.min() + 1.0) / 2.0) ** (d - 1)).astype(np.int64)
    rooms = np.minimum(rooms, max(n - 1, 1))
    heap, place = empty_queue(n)
    walled = (np.arange(3) < d) & ~grids.periodic
    frame = np.stack((grids.lengths, np.where(grids.periodic, 1.0 / grids.lengths, 0.0), walled))
    return Gas(
        state, np.zeros((n, 6)), np.full(n, np.inf), np.full(n, STALE, dtype=np.int32), heap, place,
        np.empty(rooms.sum(), dtype=np.int32), np.concatenate(([0], np.cumsum(rooms))),
        np.zeros(n, dtype=np.int64), frame, *grids[:4],
        np.full(grids.first_cell[-1], -1, dtype=np.int32), np.full(n, -1, dtype=np.int32),
        np.full(n, -1, dtype=np.int64),
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def _advance(state, i, now):  # type: ignore[no-untyped-def]
    step = now - state[i, 6]
    for axis in range(3):
        state[i, axis] += state[i, 3 + axis] * step
    state[i, 6] = now


@njit(cache=True, error_model="numpy")
def _leaving_time(state, anchor, i, now, rate):  # type: ignore[no-untyped-def]
    """Time till particle i, growing, leaves the ball in which its neighbour list is valid."""
    qx = state[i, 0] - anchor[i, 0]
    qy = state[i, 1] - anchor[i, 1]
    qz = state[i, 2] - anchor[i, 2]
    vx, vy, vz = state[i, 3], state[i, 4], state[i, 5]
    growth = state[i, 7] * rate
    room = anchor[i, 4] - growth * (now - anchor[i, 3])
    a = vx * vx + vy * vy + vz * vz - growth * growth
    b = qx * vx + qy * vy + qz * vz + room * growth
    c = qx * qx + qy * qy + qz * qz - room * room
    if c >= 0.0 or room <= 0.0:
        return 0.0
    root = np.sqrt(max(b * b - a * c, 0.0))
    if b > 0.0:
        return -c / (b + root)
    return (root - b) / a if a > 0.0 else np.inf


@njit(cache=True, error_model="numpy")
def _assign(times, partners, heap, place, i, j, time):  # type: ignore[no-untyped-def]
    """Make `time` the next event of i, with partner or kind j; partners that lose theirs become stale."""
    old = partners[i]
    if old >= 0 and old != j and partners[old] == i:
        partners[old] = STALE
    partners[i] = j
    times[i] = time
    reschedule(heap, place, times, i)
    if j >= 0:
        old = partners[j]
        if old >= 0 and old != i:
            partners[old] = STALE
        partners[j] = i
        times[j] = time
        reschedule(heap, place, times, j)


@njit(cache=True, error_model="numpy")
def _predict(  # type: ignore[no-untyped-def]
    i, now, scale, rate, state, anchor, times, partners, heap, place, lists, offsets, sizes, frame
):
    """Find and queue the next event of particle i, whose clock stands at `now`."""
    best, kind = now + _leaving_time(state, anchor, i, now, rate), LEAVES
    for axis in range(3):
        if frame[2, axis] > 0.0:
            radius, growth, velocity = state[i, 7] * scale, state[i, 7] * rate, state[i, 3 + axis]
            if velocity - growth < 0.0:
                time = now + max((state[i, axis] - radius) / (growth - velocity), 0.0)
                if time < best:
                    best, kind = time, WALL - 2 * axis
            if velocity + growth > 0.0:
                time = now + max((frame[0, axis] - state[i, axis] - radius) / (growth + velocity), 0.0)
                if time < best:
                    best, kind = time, WALL - 2 * axis - 1
    # the first positive root of |r + v t|^2 = S^2 (scale + rate t)^2 for each neighbour
    x, y, z, u, v, w = state[i, 0], state[i, 1], state[i, 2], state[i, 3], state[i, 4], state[i, 5]
    lx, ly, lz = frame[0, 0], frame[0, 1], frame[0, 2]
    ix, iy, iz = frame[1, 0], frame[1, 1], frame[1, 2]
    for entry in range(offsets[i], offsets[i] + sizes[i]):
        j = lists[entry]
        step = now - state[j, 6]
        dx = state[j, 0] + state[j, 3] * step - x
        dy = state[j, 1] + state[j, 4] * step - y
        dz = state[j, 2] + state[j, 5] * step - z
        dx -= lx * np.rint(dx * ix)
        dy -= ly * np.rint(dy * iy)
        dz -= lz * np.rint(dz * iz)
        du, dv, dw = state[j, 3] - u, state[j, 4] - v, state[j, 5] - w
        shape = state[i, 7] + state[j, 7]
        touch, growth = shape * scale, shape * rate
        b = dx * du + dy * dv + dz * dw - touch * growth
        a = du * du + dv * dv + dw * dw - growth * growth
        if b >= 0.0 and a >= 0.0:
            continue
        c = dx * dx + dy * dy + dz * dz - touch * touch
        root = b * b - a * c
        if c <= 0.0 and b < 0.0:  # touching to rounding, and approaching
            time = now
        elif root < 0.0:
            continue
        elif b < 0.0:
            time = now + c / (np.sqrt(root) - b)
        else:
            time = now - (b + np.sqrt(root)) / a
        # an event of j before that time will change j's course, and j then looks at i again
        if time < best and (time < times[j] or partners[j] == i):
            best, kind = time, j
    _assign(times, partners, heap, place, i, kind, best)


@njit(cache=True, error_model="numpy")
def _collide(state, frame, i, j, scale, rate):  # type: ignore[no-untyped-def]
    """Elastic collision of equal masses at surfaces that move at the growth rate; returns the virial."""
    rx = state[j, 0] - state[i, 0]
    ry = state[j, 1] - state[i, 1]
    rz = state[j, 2] - state[i, 2]
    rx -= frame[0, 0] * np.rint(rx * frame[1, 0])
    ry -= frame[0, 1] * np.rint(ry * frame[1, 1])
    rz -= frame[0, 2] * np.rint(rz * frame[1, 2])
    distance = np.sqrt(rx * rx + ry * ry + rz * rz)
    nx, ny, nz = rx / distance, ry / distance, rz / distance
    approach = (state[j, 3] - state[i, 3]) * nx + (state[j, 4] - state[i, 4]) * ny + (state[j, 5] - state[i, 5]) * nz
    growth = (state[i, 7] + state[j, 7]) * rate
    # relative to the moving surfaces the approach speed changes its sign: half of the change for each
    kick = max(growth - approach, 1e-14 * abs(approach))
    state[i, 3] -= kick * nx
    state[i, 4] -= kick * ny
    state[i, 5] -= kick * nz
    state[j, 3] += kick * nx
    state[j, 4] += kick * ny
    state[j, 5] += kick * nz
    return kick * (state[i, 7] + state[j, 7]) * scale


@njit(cache=True, error_model="numpy")
def _bounce(state, i, kind, rate):  # type: ignore[no-untyped-def]
    """Elastic reflection at a wall against which the surface of particle i moves at its growth rate."""
    axis, upper = (WALL - kind) // 2, (WALL - kind) % 2
    growth, velocity = state[i, 7] * rate, state[i, 3 + axis]
    state[i, 3 + axis] = -velocity - 2.0 * growth if upper else -velocity + 2.0 * growth


@njit(cache=True, error_model="numpy")
def start_lists(gas, scale, rate, excursion):  # type: ignore[no-untyped-def]
    """Neighbour lists and first events of all particles, whose clocks stand at 0; False if a list is full."""
    state, anchor, times, partners, heap, place, lists, offsets, sizes, frame = gas[:10]
    level, cells, first_cell, largest, heads, following, home = gas[10:]
    course = (state, anchor, times, partners, heap, place, lists, offsets, sizes, frame)
    homes = (state, anchor, frame, level, cells, first_cell, heads, following, home)
    search = (anchor, frame, lists, offsets, sizes, cells, first_cell, largest, heads, following)
    n = times.size
    for i in range(n):
        drop_anchor(i, 0.0, scale, excursion, *homes)
    for i in range(n):
        if not list_neighbors(i, False, *search):
            return False
    times[:] = np.inf
    partners[:] = STALE
    for i in range(n):
        _predict(i, 0.0, scale, rate, *course)
    return True


@njit(cache=True, error_model="numpy")
def run(gas, scale, rate, excursion, end, collisions):  # type: ignore[no-untyped-def]
    """Advance the gas from time 0 to `end`, or till so many collisions have happened.

    All clocks stand at the same time when it returns: (why, time, collisions, renewals, virial sum).
    """
    state, anchor, times, partners, heap, place, lists, offsets, sizes, frame = gas[:10]
    level, cells, first_cell, largest, heads, following, home = gas[10:]
    course = (state, anchor, times, partners, heap, place, lists, offsets, sizes, frame)
    homes = (state, anchor, frame, level, cells, first_cell, heads, following, home)
    search = (anchor, frame, lists, offsets, sizes, cells, first_cell, largest, heads, following)
    done, renewals, virial, why, now = 0, 0, 0.0, DONE, 0.0
    while done < collisions:
        i = heap[0]
        if times[i] >= end:
            now = end
            break
        now = times[i]
        kind = partners[i]
        present = scale + rate * now
        _advance(state, i, now)
        if kind >= 0:
            j = kind
            _advance(state, j, now)
            virial += _collide(state, frame, i, j, present, rate)
            done += 1
            partners[i], partners[j] = STALE, STALE
            _predict(i, now, present, rate, *course)
            _predict(j, now, present, rate, *course)
            continue
        if kind <= WALL:
            _bounce(state, i, kind, rate)
        elif kind == LEAVES:
            renewals += 1
            for entry in range(offsets[i], offsets[i] + sizes[i]):
                unlist(lists, offsets, sizes, lists[entry], i)
            drop_anchor(i, now, present, excursion, *homes)
            if not list_neighbors(i, True, *search):
                why = FULL
                break
        _predict(i, now, present, rate, *course)
    for i in range(times.size):
        _advance(state, i, now)
    return why, now, done, renewals, virial
