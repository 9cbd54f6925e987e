"""Which phase a node of a lattice belongs to, from a geometry, and the conductivity that follows."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from etc_engine.arrays import Floats, Ints
from etc_engine.box import Box
from etc_engine.errors import GeometryError, InputError
from etc_engine.medium.phases import PORE, find_owners
from etc_engine.packing.particles import ParticlePacking

Geometry = ParticlePacking | NDArray[np.integer] | Callable[[Floats], ArrayLike]
"""Spheres in a matrix, an array of voxels that fills the box, or a function of points of shape (m, 3)."""


def find_phases(points: ArrayLike, box: Box, geometry: Geometry) -> Ints:
    """Phase numbers of points.

    Parameters
    ----------
    points : array_like, shape (m, 3) [m]
        Inside the box.
    box : Box
    geometry : ParticlePacking, ndarray of int or callable
        A packing of spheres gives 0 in the pores and 1 in the spheres; an array, shape (nx, ny, nz),
        the value of the voxel that holds the point; a function is called with the points.

    Returns
    -------
    ndarray of int64, shape (m,)

    Raises
    ------
    InputError
        If an array has no three axes or is not of integers, or what a function returns does not fit.

    Examples
    --------
    >>> layers = np.arange(4).reshape(4, 1, 1) // 2
    >>> find_phases([[0.1, 0.5, 0.5], [0.9, 0.5, 0.5]], Box((1.0, 1.0, 1.0)), layers)
    array([0, 1])
    """
    points = np.asarray(points, dtype=np.float64)
    if isinstance(geometry, ParticlePacking):
        return np.asarray(find_owners(geometry, points) != PORE).astype(np.int64)
    if callable(geometry):
        found = np.asarray(geometry(points))
        if found.shape != (len(points),) or not _whole(found):
            raise InputError(
                f"the geometry must return one whole phase number for each of {len(points)} points, found shape "
                f"{found.shape} of {found.dtype}"
            )
        return found.astype(np.int64)
    voxels = np.asarray(geometry)
    if voxels.ndim != 3 or not _whole(voxels):
        raise InputError(
            f"voxels are a three-dimensional array of integers, found shape {voxels.shape}, {voxels.dtype}"
        )
    at = np.floor(points / np.asarray(box.lengths) * voxels.shape).astype(np.int64)
    at = np.clip(at, 0, np.asarray(voxels.shape) - 1)
    return voxels[tuple(at.T)].astype(np.int64)


def phase_conductivity(phase: Ints, conductivities: ArrayLike) -> Floats:
    """Conductivity of each node from the phases' conductivities.

    Parameters
    ----------
    phase : ndarray of int, shape (n,)
        Numbers from 0.
    conductivities : array_like, shape (p,) [W/(m K)]
        Of phase 0, 1, ...; positive.

    Returns
    -------
    ndarray, shape (n,) [W/(m K)]

    Raises
    ------
    InputError
        If a conductivity is not positive and finite, or a phase has none.
    GeometryError
        If no node belongs to a phase.

    Examples
    --------
    >>> phase_conductivity(np.array([0, 1, 1]), [0.195, 1.5])
    array([0.195, 1.5  , 1.5  ])
    """
    k = np.asarray(conductivities, dtype=np.float64)
    if k.ndim != 1 or not (np.isfinite(k) & (k > 0.0)).all():
        raise InputError(f"the conductivities of the phases must be positive and finite, found {k.tolist()}")
    strange = np.setdiff1d(phase, np.arange(k.size))
    if strange.size:
        raise InputError(f"phase {strange[0]} has no conductivity: {k.size} are given, for phases 0 to {k.size - 1}")
    empty = np.setdiff1d(np.arange(k.size), phase)
    if empty.size:
        raise GeometryError(
            f"phase {empty[0]} is empty: no lattice particle lies in it; use more particles or leave the phase out"
        )
    return np.asarray(k[phase])


def _whole(values: NDArray) -> bool:
    return bool(np.issubdtype(values.dtype, np.integer) or values.dtype == bool)
