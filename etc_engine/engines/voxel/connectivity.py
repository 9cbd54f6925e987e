"""Along which axes the conducting voxels of an image join: through faces, for a common corner or edge has no area."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from etc_engine.arrays import Flags, Ints
from etc_engine.engines.voxel.conductivity import VoxelConductivity
from etc_engine.medium.backbone import joined_nodes


def conducting_voxels(image: VoxelConductivity, least: float) -> Flags:
    """Voxels whose conductivity exceeds a number in some direction, shape (n1, n2[, n3])."""
    conducts = (image.scalars > least).ravel()
    conducts[image.rows] = (image.principal > least).any(axis=1)
    return conducts.reshape(image.shape)


def joined_voxels(conducts: Flags, *, periodic: bool) -> tuple[int, ...]:
    """Axes along which voxels join through faces: around a periodic cell, or from wall to wall.

    Parameters
    ----------
    conducts : ndarray of bool, shape (n1, n2[, n3])
    periodic : bool
        Whether the cell repeats along every axis; otherwise walls bound it.

    Returns
    -------
    tuple of int

    Notes
    -----
    Clusters inside the cell by `scipy.ndimage.label`; over the border of a periodic cell by union-find with
    displacements, as of particles.

    Examples
    --------
    >>> joined_voxels(np.eye(4, dtype=bool), periodic=True)
    ()
    >>> joined_voxels(np.array([[True, True], [False, True]]), periodic=False)
    (0, 1)
    """
    d = conducts.ndim
    labels, count = ndimage.label(conducts)
    pairs, shifts, nodes, walls = [], [], [], []
    for axis in range(d):
        first, last = (np.take(labels, place, axis=axis).ravel() for place in (0, -1))
        if periodic:
            over = _links(np.column_stack((last, first)))
            pairs.append(over)
            shifts.append(np.broadcast_to(np.eye(d, dtype=np.int64)[axis], (len(over), d)))
        else:
            for side, face in enumerate((first, last)):
                touching = np.unique(face[face > 0]) - 1
                nodes.append(touching)
                walls.append(np.full(touching.size, 2 * axis + side))
    none = np.zeros(0, dtype=np.int64)
    linked = np.concatenate(pairs) if periodic else np.zeros((0, 2), dtype=np.int64)
    steps = np.concatenate(shifts) if periodic else np.zeros((0, d), dtype=np.int64)
    ends = (none, none) if periodic else (np.concatenate(nodes), np.concatenate(walls))
    return joined_nodes(count, (periodic,) * d, (linked, steps), ends)


def _links(pairs: Ints) -> Ints:
    """Different pairs of clusters that face each other, counted from 0."""
    return np.asarray(np.unique(pairs[(pairs > 0).all(axis=1)], axis=0) - 1, dtype=np.int64)
