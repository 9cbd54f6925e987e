"""Random sequential insertion of disks and spheres."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etc_engine.arrays import Floats
from etc_engine.box import Box, ball_measure
from etc_engine.errors import InputError, PackingError
from etc_engine.packing.cell_grids import CellGrids, cell_grids, cell_of, cell_range
from etc_engine.packing.particles import ParticlePacking

SATURATION = {2: 0.5471, 3: 0.3841}
"""Density at which random sequential insertion of equal disks and spheres saturates in a large box."""

TRIALS = 100_000
"""Failures in a row after which a particle among particles of other sizes is given up."""

BLIND_TRIALS = 500
"""Failures in a row after which equal particles are no longer tried everywhere, but in what space is left."""

MOST_VOXELS = 8_000_000
BLOCK = 200_000


@dataclass(frozen=True, eq=False)
class Insertion:
    """Result of a random sequential insertion.

    Parameters
    ----------
    packing : ParticlePacking
        The particles, in the order of their insertion.
    saturated : bool
        Whether no place is left for the next particle: proven for equal sizes, where the whole box is
        searched; for other sizes, the next one found none in 100 000 trials.
    """

    packing: ParticlePacking
    saturated: bool


@dataclass
class _State:
    """Particles placed so far and the cell grids that hold them."""

    sizes: Floats
    grids: CellGrids
    heads: NDArray[np.int32]
    following: NDArray[np.int32]
    centers: Floats
    dimension: int
    placed: int = 0


def insert_randomly(
    sizes: Floats,
    box: Box,
    rng: np.random.Generator,
    progress: Callable[[float], None] | None = None,
) -> Insertion:
    """Insert particles one after the other at uniformly random free places, until all are in or none fits.

    Parameters
    ----------
    sizes : ndarray, shape (n,) [m]
        Radii, in the order of insertion.
    box : Box
        Walled or periodic along each axis; particles stay inside the walls.
    rng : numpy.random.Generator
        Source of the trial points.
    progress : callable, optional
        Called with the fraction of the particles placed.

    Returns
    -------
    Insertion

    Raises
    ------
    InputError
        If a particle is wider than the box, or a periodic box under two diameters wide.
    PackingError
        If not even the first particle could be placed.

    Notes
    -----
    Trials that fail often are confined to the voxels that the particles' exclusion zones do not cover, which
    are halved again and again; trial points stay uniform over the free space, and when no voxel is left the
    packing is saturated.

    References
    ----------
    G. Zhang, S. Torquato, Precise algorithm to generate random sequential addition of hard hyperspheres at
    saturation, Phys. Rev. E 88 (2013) 053312, doi:10.1103/PhysRevE.88.053312 (voxels; densities 0.547067 and
    0.384131).

    Examples
    --------
    >>> made = insert_randomly(np.full(400, 0.05), Box((1.0, 1.0), (True, True)), np.random.default_rng(6))
    >>> made.saturated, bool(0.5 < made.packing.density < 0.6)
    (True, True)
    """
    refuse_wide_particles(sizes, box)
    equal = bool(np.ptp(sizes) == 0.0)
    state = _start(sizes, box)
    saturated = not _try_everywhere(state, box, rng, BLIND_TRIALS if equal else TRIALS, progress)
    if saturated and equal:
        saturated = not _try_what_is_left(state, box, rng, progress)
    if state.placed == 0:
        raise PackingError(f"not one particle of radius {sizes[0]:g} found a place in the box {box.lengths}")
    centers = state.centers[: state.placed, : box.dimension]
    return Insertion(ParticlePacking(centers, sizes[: state.placed], box), saturated)


def insert_in_turn(sizes: Floats, box: Box, rng: np.random.Generator, trials: int = 20_000) -> Floats:
    """Centres of all the particles, shape (n, d), inserted by plain trials; PackingError if one fails."""
    state = _start(sizes, box)
    if not _try_everywhere(state, box, rng, trials, None):
        raise PackingError(f"particle {state.placed} of {sizes.size} found no place in {trials} trials")
    return state.centers[:, : box.dimension]


def refuse_wide_particles(sizes: Floats, box: Box) -> None:
    """Refuse particles wider than a walled box, or than half of a periodic one."""
    widest = 2.0 * float(sizes.max())
    for axis, length in enumerate(box.lengths):
        needed, what = (2.0 * widest, "two diameters") if box.periodic[axis] else (widest, "one diameter")
        if length < needed:
            raise InputError(
                f"the box is {length:g} long along {'xyz'[axis]}, under {what} ({needed:g}) of the largest "
                "particle: use smaller particles or a longer box"
            )


def _start(sizes: Floats, box: Box) -> _State:
    grids = cell_grids(sizes, box)
    heads = np.full(grids.first_cell[-1], -1, dtype=np.int32)
    following = np.full(sizes.size, -1, dtype=np.int32)
    return _State(sizes, grids, heads, following, np.zeros((sizes.size, 3)), box.dimension)


def _try(state: _State, points: Floats, failures: int, most: int) -> int:
    """Use up trial points; returns the number of failures in a row."""
    arrays = (state.sizes, state.grids, state.heads, state.following, state.centers)
    state.placed, failures = _try_points(*arrays, points, state.dimension, state.placed, failures, most)
    return int(failures)


def _try_everywhere(
    state: _State,
    box: Box,
    rng: np.random.Generator,
    most: int,
    progress: Callable[[float], None] | None,
) -> bool:
    """Trials all over the box till all are placed (True) or so many failed in a row (False)."""
    count, d, failures = state.sizes.size, box.dimension, 0
    lengths = np.asarray(box.lengths)
    while state.placed < count and failures < most:
        points = np.zeros((min(BLOCK, 20 * (count - state.placed) + 1000), 3))
        points[:, :d] = rng.random((len(points), d)) * lengths
        failures = _try(state, points, failures, most)
        if progress is not None:
            progress(state.placed / count)
    return state.placed == count


def _try_what_is_left(
    state: _State, box: Box, rng: np.random.Generator, progress: Callable[[float], None] | None
) -> bool:
    """Trials in the voxels that are not covered; False when none is left, so that the box is saturated."""
    d, radius = box.dimension, float(state.sizes[0])
    cells = np.ceil(np.asarray(box.lengths) / radius).astype(np.int64)
    width = np.zeros(3)
    width[:d] = np.asarray(box.lengths) / cells
    corners = np.zeros((int(cells.prod()), 3))
    corners[:, :d] = np.indices(tuple(cells)).reshape(d, -1).T * width[:d]
    halves = np.zeros((2**d, 3))
    halves[:, :d] = np.indices((2,) * d).reshape(d, -1).T
    while state.placed < state.sizes.size:
        arrays = (state.sizes, state.grids, state.heads, state.following, state.centers)
        corners = corners[_uncovered(*arrays, corners, width, radius, d)]
        if len(corners) == 0:
            return False
        if len(corners) * len(halves) > MOST_VOXELS:
            raise PackingError(
                f"saturation could not be decided within {MOST_VOXELS} voxels: use fewer particles at a time",
                reached=float(state.placed * ball_measure(radius, d) / box.volume),
            )
        picked = rng.integers(0, len(corners), 4 * len(corners))
        points = corners[picked] + rng.random((len(picked), 3)) * width
        _try(state, points, 0, len(picked) + 1)
        width = width / 2.0
        corners = (corners[:, None, :] + halves * width).reshape(-1, 3)
        if progress is not None:
            progress(state.placed / state.sizes.size)
    return True


@njit(cache=True)
def _is_free(x, y, z, radius, centers, sizes, grids, heads, following):  # type: ignore[no-untyped-def]
    """Whether a particle of this radius at this place overlaps none of those placed."""
    _, cells, first_cell, largest, lengths, periodic = grids
    for k in range(largest.size):
        reach = radius + largest[k]
        x0, x1 = cell_range(x, reach, lengths[0], cells[k, 0], periodic[0])
        y0, y1 = cell_range(y, reach, lengths[1], cells[k, 1], periodic[1])
        z0, z1 = cell_range(z, reach, lengths[2], cells[k, 2], periodic[2])
        for cx in range(x0, min(x1, x0 + cells[k, 0] - 1) + 1):
            for cy in range(y0, min(y1, y0 + cells[k, 1] - 1) + 1):
                for cz in range(z0, min(z1, z0 + cells[k, 2] - 1) + 1):
                    c = ((cx % cells[k, 0]) * cells[k, 1] + cy % cells[k, 1]) * cells[k, 2] + cz % cells[k, 2]
                    j = heads[first_cell[k] + c]
                    while j >= 0:
                        dx, dy, dz = x - centers[j, 0], y - centers[j, 1], z - centers[j, 2]
                        if periodic[0]:
                            dx -= lengths[0] * np.rint(dx / lengths[0])
                        if periodic[1]:
                            dy -= lengths[1] * np.rint(dy / lengths[1])
                        if periodic[2]:
                            dz -= lengths[2] * np.rint(dz / lengths[2])
                        touch = radius + sizes[j]
                        if dx * dx + dy * dy + dz * dz < touch * touch:
                            return False
                        j = following[j]
    return True


@njit(cache=True)
def _try_points(sizes, grids, heads, following, centers, points, d, placed, failures, most):  # type: ignore[no-untyped-def]
    """Use up a block of trial points: number of particles placed, and failures in a row at the end."""
    lengths, periodic = grids.lengths, grids.periodic
    for m in range(len(points)):
        if placed == sizes.size or failures >= most:
            break
        radius, x, y, z = sizes[placed], points[m, 0], points[m, 1], points[m, 2]
        inside = True
        for axis in range(d):
            if not periodic[axis] and not radius <= points[m, axis] <= lengths[axis] - radius:
                inside = False
        if not inside or not _is_free(x, y, z, radius, centers, sizes, grids, heads, following):
            failures += 1
            continue
        cell = cell_of(x, y, z, grids.level[placed], grids.cells, grids.first_cell, lengths)
        centers[placed, 0], centers[placed, 1], centers[placed, 2] = x, y, z
        following[placed], heads[cell] = heads[cell], placed
        placed, failures = placed + 1, 0
    return placed, failures


@njit(cache=True)
def _uncovered(sizes, grids, heads, following, centers, corners, width, radius, d):  # type: ignore[no-untyped-def]
    """Which voxels may hold the centre of one more particle: those that no exclusion zone covers whole."""
    _, cells, first_cell, largest, lengths, periodic = grids
    free = np.ones(len(corners), dtype=np.bool_)
    half = 0.5 * width
    for m in range(len(corners)):
        x, y, z = corners[m, 0] + half[0], corners[m, 1] + half[1], corners[m, 2] + half[2]
        for axis in range(d):
            low, high = corners[m, axis], corners[m, axis] + width[axis]
            if not periodic[axis] and (high <= radius or low >= lengths[axis] - radius):
                free[m] = False
        for k in range(largest.size):
            reach = radius + largest[k]
            x0, x1 = cell_range(x, reach, lengths[0], cells[k, 0], periodic[0])
            y0, y1 = cell_range(y, reach, lengths[1], cells[k, 1], periodic[1])
            z0, z1 = cell_range(z, reach, lengths[2], cells[k, 2], periodic[2])
            for cx in range(x0, min(x1, x0 + cells[k, 0] - 1) + 1):
                for cy in range(y0, min(y1, y0 + cells[k, 1] - 1) + 1):
                    for cz in range(z0, min(z1, z0 + cells[k, 2] - 1) + 1):
                        c = ((cx % cells[k, 0]) * cells[k, 1] + cy % cells[k, 1]) * cells[k, 2] + cz % cells[k, 2]
                        j = heads[first_cell[k] + c]
                        while j >= 0 and free[m]:
                            dx, dy, dz = x - centers[j, 0], y - centers[j, 1], z - centers[j, 2]
                            if periodic[0]:
                                dx -= lengths[0] * np.rint(dx / lengths[0])
                            if periodic[1]:
                                dy -= lengths[1] * np.rint(dy / lengths[1])
                            if periodic[2]:
                                dz -= lengths[2] * np.rint(dz / lengths[2])
                            far = (abs(dx) + half[0]) ** 2 + (abs(dy) + half[1]) ** 2 + (abs(dz) + half[2]) ** 2
                            free[m] = far >= (radius + sizes[j]) ** 2
                            j = following[j]
    return free
