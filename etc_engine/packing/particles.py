"""ParticlePacking: disks or spheres in a box, checked once and then immutable."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.box import Box, ball_measure
from etc_engine.errors import GeometryError, InputError


def _frozen(values: Floats) -> Floats:
    """An own, contiguous, read-only copy."""
    values = np.array(values, dtype=np.float64, order="C", copy=True)
    values.setflags(write=False)
    return values


LARGEST = 1e6
"""Radii above this, in edge lengths of the box, are mistakes."""


@dataclass(frozen=True, eq=False)
class ParticlePacking:
    """Disks (2D) or spheres (3D) in a box.

    Parameters
    ----------
    centers : ndarray, shape (n, d) [m]
        Particle centres, inside the box (periodic axes are wrapped into it).
    radii : ndarray, shape (n,) [m]
        Particle radii, positive.
    box : Box
        The box that holds them.
    columns : mapping of str to ndarray of n rows, optional
        What else is known of each particle, such as ``conductivity`` [W/(m K)], ``ids``, ``types`` and ``temperature``
        [K] of a file. No function reads them by itself: ``Medium(packing, packing.columns["conductivity"], ...)``.

    Raises
    ------
    GeometryError
        If there is no particle, a value is not finite, a radius is not positive or a centre lies
        outside a wall; the message names the first offending particle (numbered from 0).
    InputError
        If a column has another number of rows.

    Examples
    --------
    >>> packing = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    >>> packing.count, round(packing.density, 6)
    (2, 0.392699)
    """

    centers: Floats
    radii: Floats
    box: Box
    columns: Mapping[str, NDArray[Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        centers, radii = np.asarray(self.centers, dtype=np.float64), np.asarray(self.radii, dtype=np.float64)
        d = self.box.dimension
        if centers.size == 0 or radii.size == 0:
            raise GeometryError("the packing holds no particles: at least one is needed")
        if centers.ndim != 2 or centers.shape[1] != d or radii.shape != (centers.shape[0],):
            raise GeometryError(
                f"centers of shape (n, {d}) and radii of shape (n,) are needed in a {d}D box, "
                f"found {centers.shape} and {radii.shape}"
            )
        _refuse_first(~np.isfinite(centers).all(axis=1), "has a centre that is not finite", centers)
        _refuse_first(~np.isfinite(radii), "has a radius that is not finite", radii)
        _refuse_first(radii <= 0.0, "has a radius that is not positive", radii)
        beyond = LARGEST * max(self.box.lengths)
        _refuse_first(radii > beyond, f"has a radius beyond {LARGEST:g} times the box {self.box.lengths}", radii)
        centers = self.box.wrap(centers)
        outside = ((centers < 0.0) | (centers > np.asarray(self.box.lengths))).any(axis=1)
        _refuse_first(outside, f"has its centre outside the box {self.box.lengths}", centers)
        object.__setattr__(self, "centers", _frozen(centers))
        object.__setattr__(self, "radii", _frozen(radii))
        for name, values in self.columns.items():
            if np.shape(values)[:1] != radii.shape:
                raise InputError(f"column {name!r} needs {radii.size} rows, found shape {np.shape(values)}")

    def __repr__(self) -> str:
        """Number and kind of the particles, density and box."""
        kind = "disks" if self.dimension == 2 else "spheres"
        lengths = " x ".join(f"{length:g}" for length in self.box.lengths)
        walls = f"periodic along {self.box.periodic_axes}" if self.box.periodic_axes else "walls"
        more = f", columns {', '.join(self.columns)}" if self.columns else ""
        return f"<ParticlePacking: {self.count} {kind}, density {self.density:.4g}, box {lengths} m, {walls}{more}>"

    @property
    def count(self) -> int:
        """Number of particles."""
        return int(self.radii.size)

    @property
    def dimension(self) -> int:
        """2 for disks, 3 for spheres."""
        return self.box.dimension

    @property
    def measures(self) -> Floats:
        """Full area [m2] of each disk or volume [m3] of each sphere, shape (n,)."""
        return ball_measure(self.radii, self.dimension)

    @property
    def density(self) -> float:
        """Sum of the full particle areas (volumes) over the box's, overlaps counted twice."""
        return float(self.measures.sum() / self.box.volume)

    def select(self, keep: Flags | Ints) -> ParticlePacking:
        """The packing of the particles picked by a mask or by row numbers, in that order."""
        columns = {name: np.asarray(values)[keep] for name, values in self.columns.items()}
        return ParticlePacking(self.centers[keep], self.radii[keep], self.box, columns)

    def with_radii(self, radii: Floats) -> ParticlePacking:
        """The same centres with other radii."""
        return ParticlePacking(self.centers, radii, self.box, self.columns)


def particle_values(values: ArrayLike, count: int, name: str) -> Floats:
    """One value for all particles, or one for each, as a new array of shape (count,).

    Raises
    ------
    InputError
        If they are not as many, or not finite.
    """
    array = np.asarray(values, dtype=np.float64)
    if array.shape not in ((), (count,)) or not np.isfinite(array).all():
        raise InputError(f"the {name} must be one finite number or {count} of them, found shape {array.shape}")
    return np.broadcast_to(array, (count,)).copy()


def _refuse_first(bad: Flags | np.bool_, what: str, values: Floats) -> None:
    bad = np.asarray(bad)
    if bad.any():
        row = int(np.flatnonzero(bad)[0])
        others = int(bad.sum()) - 1
        more = f" (and {others} more)" if others else ""
        raise GeometryError(f"particle {row} {what}: found {values[row].tolist()}{more}")
