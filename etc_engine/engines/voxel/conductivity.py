"""VoxelConductivity: a conductivity for every voxel, a tensor where an interface crosses it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from etc_engine.arrays import Floats, Ints
from etc_engine.errors import InputError


@dataclass(frozen=True, eq=False)
class VoxelConductivity:
    """Conductivity of every voxel of a cell.

    Parameters
    ----------
    scalars : ndarray, shape (n1, n2[, n3]) [W/(m K)]
        Of the isotropic voxels; infinite for perfect conductors.
    rows : ndarray, shape (m,)
        Flat numbers of the anisotropic voxels.
    principal : ndarray, shape (m, d) [W/(m K)]
        Principal conductivities of those.
    axes : ndarray, shape (m, d, d)
        Their principal axes, the columns of orthogonal matrices.
    """

    scalars: Floats
    rows: Ints
    principal: Floats
    axes: Floats

    @property
    def shape(self) -> tuple[int, ...]:
        """Voxels along each axis."""
        return self.scalars.shape

    @cached_property
    def tensors(self) -> Floats:
        """Of the anisotropic voxels, where they are finite, shape (m, d, d)."""
        return np.ascontiguousarray(np.einsum("mai,mi,mbi->mab", self.axes, self.principal, self.axes))

    def of(self, function: Callable[[Floats], Floats]) -> VoxelConductivity:
        """A function of the conductivity, of a tensor through its principal values."""
        return VoxelConductivity(function(self.scalars), self.rows, function(self.principal), self.axes)

    def extremes(self) -> tuple[float, float]:
        """Least and largest conductivity in any direction, of any voxel."""
        isotropic = np.ones(self.scalars.size, dtype=bool)
        isotropic[self.rows] = False
        parts = [part for part in (self.scalars.ravel()[isotropic], self.principal) if part.size]
        return float(min(part.min() for part in parts)), float(max(part.max() for part in parts))

    def mean(self) -> Floats:
        """Mean over the voxels, shape (d, d)."""
        isotropic = np.ones(self.scalars.size, dtype=bool)
        isotropic[self.rows] = False
        total = self.scalars.ravel()[isotropic].sum() * np.eye(self.scalars.ndim) + self.tensors.sum(axis=0)
        return total / self.scalars.size

    def apply(self, field: Floats) -> Floats:
        """Product with a vector field, shape (d, n1, n2[, n3])."""
        product = np.empty_like(field)
        d = field.shape[0]
        _apply(self.scalars.ravel(), self.rows, self.tensors, field.reshape(d, -1), product.reshape(d, -1))
        return product


def voxel_conductivity(values: ArrayLike | VoxelConductivity) -> VoxelConductivity:
    """Conductivities of an image, one number or one tensor per voxel, checked.

    Parameters
    ----------
    values : array_like, shape (n1, n2[, n3]) or (n1, n2[, n3], d, d) [W/(m K)]
        Not negative; tensors symmetric.

    Returns
    -------
    VoxelConductivity

    Raises
    ------
    InputError
        If the shape or a value is not allowed.

    Examples
    --------
    >>> voxel_conductivity([[1.0, 2.0], [2.0, 1.0]]).extremes()
    (1.0, 2.0)
    """
    if isinstance(values, VoxelConductivity):
        return values
    try:
        values = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError("the conductivities of voxels must be numbers in an array of equal rows") from None
    if np.isnan(values).any():
        raise InputError("the conductivity of a voxel must be a number, found NaN")
    d = values.ndim - 2
    if d in (2, 3) and values.shape[-2:] == (d, d):
        tensors = values.reshape(-1, d, d)
        if not np.isfinite(tensors).all():
            raise InputError("the conductivity tensors of voxels must be finite")
        if np.abs(tensors - tensors.transpose(0, 2, 1)).max() > 1e-10 * np.abs(tensors).max():
            raise InputError("the conductivity tensors of voxels must be symmetric")
        principal, axes = np.linalg.eigh(tensors)
        if principal.min() < -1e-12 * np.abs(tensors).max():
            raise InputError(
                f"the conductivity tensors of voxels must not be negative, found the eigenvalue {principal.min():g}"
            )
        return VoxelConductivity(
            np.zeros(values.shape[:-2]), np.arange(tensors.shape[0]), np.maximum(principal, 0.0), axes
        )
    if values.ndim not in (2, 3) or values.size == 0:
        raise InputError(
            "an image has the shape (n1, n2) or (n1, n2, n3), or with a tensor per voxel (n1, n2, 2, 2) or "
            f"(n1, n2, n3, 3, 3): found {values.shape}"
        )
    if values.min() < 0.0:
        raise InputError(f"the conductivity of a voxel must not be negative, found {values.min():g}")
    d = values.ndim
    return VoxelConductivity(values, np.zeros(0, dtype=np.int64), np.zeros((0, d)), np.zeros((0, d, d)))


@njit(cache=True)
def _apply(scalars, rows, tensors, field, product):  # type: ignore[no-untyped-def]
    d = field.shape[0]
    for a in range(d):
        for i in range(scalars.size):
            product[a, i] = scalars[i] * field[a, i]
    for m in range(rows.size):
        i = rows[m]
        for a in range(d):
            total = 0.0
            for b in range(d):
                total += tensors[m, a, b] * field[b, i]
            product[a, i] = total
