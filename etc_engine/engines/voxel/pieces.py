"""Pieces of particles in the voxels of a grid, in their exact measures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etc_engine.engines.voxel.fractions import ball_in_box
from etc_engine.packing.particles import ParticlePacking
from etc_engine.structure.cut_sphere import cut_sphere_volume
from etc_engine.structure.union import cut_disk_area, particle_cuts

GRAIN = 1e-9
"""Part of a voxel below which a plane or a sphere does not cut it."""


@dataclass(frozen=True, eq=False)
class Pieces:
    """What the inclusions occupy: whole voxels, and pieces of voxels.

    ``owner`` is the inclusion of a whole voxel or -1; a piece is row ``inclusion``'s ``fraction`` of ``voxel``, with
    ``normal`` from its centre to the voxel's and whether it holds the voxel's centre.
    """

    owner: NDArray[np.int64]
    voxel: NDArray[np.int64]
    inclusion: NDArray[np.int64]
    fraction: NDArray[np.float64]
    normal: NDArray[np.float64]
    central: NDArray[np.bool_]


def find_pieces(inclusions: ParticlePacking, shape: tuple[int, ...]) -> Pieces:
    """Pieces of all inclusions in the voxels of a grid of a shape over the box."""
    steps = np.asarray(inclusions.box.lengths) / np.asarray(shape)
    starts, normals, cuts = particle_cuts(inclusions)
    owner, count, voxel, inclusion, fraction, normal, central = _walk(
        (inclusions.centers, inclusions.radii),
        (np.asarray(shape), steps, np.asarray(inclusions.box.periodic)),
        (starts, np.ascontiguousarray(normals), cuts),
    )
    return Pieces(owner, voxel[:count], inclusion[:count], fraction[:count], normal[:count], central[:count])


@njit(cache=True)
def _walk(inclusions, grid, planes):  # type: ignore[no-untyped-def]
    """Fraction |ball n half-spaces n voxel| / |voxel| of every voxel that an inclusion reaches, by `_share`.

    A 2D grid is walked as one layer of a 3D one. Full voxels become ``owner``, the others a piece each, whose normal
    points from the centre of the inclusion to that of the voxel.
    """
    centers, radii = inclusions
    shape, steps, periodic = grid
    starts, normals, cuts = planes
    d = centers.shape[1]
    owner = np.full(np.prod(shape), -1, dtype=np.int64)
    count, room = 0, 1024
    voxel, inclusion = np.empty(room, dtype=np.int64), np.empty(room, dtype=np.int64)
    fraction, normal = np.empty(room), np.empty((room, d))
    central = np.empty(room, dtype=np.bool_)
    volume = np.prod(steps)
    first, last, index = np.zeros(3, dtype=np.int64), np.zeros(3, dtype=np.int64), np.zeros(3, dtype=np.int64)
    low, high, middle = np.empty(d), np.empty(d), np.empty(d)
    for row in range(radii.size):
        radius = radii[row]
        for a in range(d):
            first[a] = np.floor((centers[row, a] - radius) / steps[a])
            last[a] = np.floor((centers[row, a] + radius) / steps[a])
            if not periodic[a]:
                first[a], last[a] = max(first[a], 0), min(last[a], shape[a] - 1)
        own_normals, own_cuts = normals[starts[row] : starts[row + 1]], cuts[starts[row] : starts[row + 1]]
        for i in range(first[0], last[0] + 1):
            for j in range(first[1], last[1] + 1):
                for k in range(first[2], last[2] + 1):
                    index[0], index[1], index[2] = i, j, k
                    flat, square = 0, 0.0
                    for a in range(d):
                        low[a] = index[a] * steps[a] - centers[row, a]
                        high[a] = (index[a] + 1) * steps[a] - centers[row, a]
                        middle[a] = 0.5 * (low[a] + high[a])
                        square += middle[a] * middle[a]
                        flat = flat * shape[a] + index[a] % shape[a]
                    part = _share(radius, low, high, own_normals, own_cuts, volume)
                    if part <= GRAIN:
                        continue
                    if part >= 1.0 - GRAIN:
                        owner[flat] = row
                        continue
                    if count == room:
                        room *= 2
                        voxel, inclusion = _longer(voxel, room), _longer(inclusion, room)
                        fraction, central = _longer(fraction, room), _longer(central, room)
                        wider = np.empty((room, d))
                        wider[:count] = normal
                        normal = wider
                    voxel[count], inclusion[count], fraction[count] = flat, row, part
                    distance = np.sqrt(square)
                    for a in range(d):
                        normal[count, a] = middle[a] / distance if distance > 0.0 else (1.0 if a == 0 else 0.0)
                    inside = square < radius * radius
                    for m in range(own_cuts.size):
                        inside = inside and np.dot(own_normals[m], middle) <= own_cuts[m]
                    central[count] = inside
                    count += 1
    return owner, count, voxel, inclusion, fraction, normal, central


@njit(cache=True)
def _longer(values, room):  # type: ignore[no-untyped-def]
    longer = np.empty(room, dtype=values.dtype)
    longer[: values.size] = values
    return longer


@njit(cache=True)
def _share(radius, low, high, normals, cuts, volume):  # type: ignore[no-untyped-def]
    """Part of a voxel, given by its corners from the centre, that an inclusion within its half-spaces fills."""
    d = low.size
    nearest, farthest = 0.0, 0.0
    for a in range(d):
        near = max(low[a], -high[a], 0.0)
        far = max(high[a], -low[a])
        nearest, farthest = nearest + near * near, farthest + far * far
    if nearest >= radius * radius:
        return 0.0
    whole = farthest <= radius * radius
    planes, distances = np.empty((2 * d + cuts.size, d)), np.empty(2 * d + cuts.size)
    crossing = 2 * d
    for m in range(cuts.size):
        middle, reach = 0.0, 0.0
        for a in range(d):
            middle += 0.5 * (low[a] + high[a]) * normals[m, a]
            reach += 0.5 * (high[a] - low[a]) * abs(normals[m, a])
        if middle - reach >= cuts[m] - GRAIN * reach:
            return 0.0
        if middle + reach > cuts[m] + GRAIN * reach and _cap_meets(radius, cuts[m], normals[m], low, high):
            planes[crossing], distances[crossing] = normals[m], cuts[m]
            crossing += 1
    if crossing == 2 * d:
        return 1.0 if whole else min(ball_in_box(radius, low, high) / volume, 1.0)
    planes[: 2 * d] = 0.0
    for a in range(d):
        planes[2 * a, a], distances[2 * a] = 1.0, high[a]
        planes[2 * a + 1, a], distances[2 * a + 1] = -1.0, -low[a]
    planes, distances = planes[:crossing], distances[:crossing]
    if d == 2:
        return min(cut_disk_area(radius, planes, distances) / volume, 1.0)
    return min(cut_sphere_volume(radius, planes, distances) / volume, 1.0)


@njit(cache=True)
def _cap_meets(radius, cut, normal, low, high):  # type: ignore[no-untyped-def]
    """Whether a box may hold a part of the cap beyond a plane, which a ball about the cap's base encloses."""
    if cut >= radius:
        return False
    if cut <= 0.0:
        return True
    distance = 0.0
    for a in range(low.size):
        away = max(low[a] - cut * normal[a], cut * normal[a] - high[a], 0.0)
        distance += away * away
    return distance < (radius - cut) * (radius + cut)
