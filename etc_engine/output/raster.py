"""Which particle a pixel belongs to, and the temperature field sampled to an image."""

from __future__ import annotations

import numpy as np
from numba import njit

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.medium.field import ParticleField


def sample_image(field: ParticleField, pixels: int = 600) -> tuple[Floats, Ints]:
    """Temperatures on a regular grid of pixels over the box.

    Parameters
    ----------
    field : ParticleField
        Of disks whose inner temperatures are known.
    pixels : int
        Pixels along the longer edge of the box.

    Returns
    -------
    temperatures : ndarray, shape (ny, nx) [K]
        At pixel centres, first row at the bottom; NaN where it is not known: outside the particles, unless the field
        reaches into the pores.
    owners : ndarray of int, shape (ny, nx)
        Particle of each pixel, -1 outside. Where disks overlap their common chord separates them.
    """
    assert field.inside is not None
    packing = field.medium.packing
    lengths = np.asarray(packing.box.lengths)
    nx, ny = (max(round(float(pixels * length / lengths.max())), 1) for length in lengths)
    reach = packing.radii if field.reach is None else field.reach
    shape = (nx, ny, np.inf if field.reach is not None else 0.0)
    owners, offsets = _owners(packing.centers, packing.radii, reach, lengths, np.asarray(packing.box.periodic), *shape)
    rows, columns = np.nonzero(owners >= 0)
    temperatures = np.full(owners.shape, np.nan)
    particles = owners[rows, columns]
    temperatures[rows, columns] = field.inside(particles, offsets[rows, columns])
    axis = field.axis
    if packing.box.periodic[axis]:  # a pixel of an image of the particle lies whole boxes up the gradient
        centre = (columns + 0.5) / nx if axis == 0 else (rows + 0.5) / ny
        image = centre * lengths[axis] - offsets[rows, columns, axis] - packing.centers[particles, axis]
        temperatures[rows, columns] += np.rint(image / lengths[axis]) * lengths[axis]
    return temperatures, owners


@njit(cache=True)
def _owners(
    centers: Floats,
    radii: Floats,
    reach: Floats,
    lengths: Floats,
    periodic: Flags,
    nx: int,
    ny: int,
    farthest: float,
) -> tuple[Ints, Floats]:
    """Owner of each pixel by the smallest power below ``farthest``, and the pixel's place relative to its centre."""
    owners = np.full((ny, nx), -1, dtype=np.int64)
    offsets = np.zeros((ny, nx, 2))
    best = np.full((ny, nx), farthest)
    dx, dy = lengths[0] / nx, lengths[1] / ny
    for p in range(radii.size):
        r, far = radii[p], reach[p]
        reach_x, reach_y = (1 if periodic[0] else 0), (1 if periodic[1] else 0)
        for sx in range(-reach_x, reach_x + 1):
            for sy in range(-reach_y, reach_y + 1):
                x, y = centers[p, 0] + sx * lengths[0], centers[p, 1] + sy * lengths[1]
                for row in range(max(int((y - far) / dy), 0), min(int((y + far) / dy) + 1, ny)):
                    for column in range(max(int((x - far) / dx), 0), min(int((x + far) / dx) + 1, nx)):
                        u, v = (column + 0.5) * dx - x, (row + 0.5) * dy - y
                        power = u * u + v * v - r * r
                        if power < best[row, column]:
                            best[row, column] = power
                            owners[row, column] = p
                            offsets[row, column, 0] = u
                            offsets[row, column, 1] = v
    return owners, offsets
