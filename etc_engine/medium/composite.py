"""Composite: inclusions in a matrix, the geometry that the continuum engines start from, and their result."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from etc_engine.errors import GeometryError, InputError
from etc_engine.packing.neighbors import neighbor_pairs
from etc_engine.packing.particles import ParticlePacking
from etc_engine.structure.union import solid_fraction

MATRIX = -1
"""What `Composite.phase` answers for a point in the matrix."""

SPAN = 1e15
"""Largest ratio of two finite conductivities, ..."""

EXTREME = 1e100
"""... and the largest of one, or of its inverse [W/(m K)]."""

ROUNDING = 1e-9
"""Overlaps below this, in mean radii, are contacts."""


@dataclass(frozen=True, eq=False)
class Composite:
    """Disks or spheres of given conductivities in a conducting matrix.

    Parameters
    ----------
    inclusions : ParticlePacking
        The inclusions. Periodic axes repeat them, walls cut off what reaches over.
    matrix : float [W/(m K)]
        Conductivity of the matrix, finite and not negative.
    inclusion : float or array_like, shape (n,) [W/(m K)]
        Of all inclusions, or of each; not negative, infinite for a perfect conductor.

    Raises
    ------
    InputError
        If a conductivity is not allowed or nothing conducts.
    GeometryError
        If the inclusions leave no matrix.

    Notes
    -----
    Inclusions may overlap: their union counts once, and a point in several of them belongs to the one of the least
    power distance :math:`|x - c|^2 - R^2`, so that the radical plane through the rim of the overlap divides them.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> sphere = ParticlePacking([[0.5, 0.5, 0.5]], [0.4], Box((1.0, 1.0, 1.0), (True, True, True)))
    >>> composite = Composite(sphere, 0.2, 1.5)
    >>> composite.conductivity_at([[0.5, 0.5, 0.2], [0.0, 0.0, 0.0]])
    array([1.5, 0.2])
    >>> round(composite.volume_fraction, 6)
    0.268083
    """

    inclusions: ParticlePacking
    matrix: float
    inclusion: NDArray[np.float64]

    def __post_init__(self) -> None:
        values, matrix = np.array(self.inclusion, dtype=np.float64), float(self.matrix)
        if values.ndim and values.shape != (self.inclusions.count,):
            raise InputError(
                f"the conductivity of the inclusions must be one number or an array of shape "
                f"({self.inclusions.count},), found shape {values.shape}"
            )
        bad = ~(values >= 0.0)
        if bad.any():
            raise InputError(
                f"the conductivity of an inclusion must not be negative, found {values[bad].flat[0]:g}: "
                "0 insulates, inf conducts perfectly"
            )
        if not (np.isfinite(matrix) and matrix >= 0.0):
            raise InputError(f"the conductivity of the matrix must be finite and not negative, found {matrix:g}")
        if matrix == 0.0 and not values.any():
            raise InputError("neither the matrix nor an inclusion conducts: give at least one a conductivity above 0")
        _refuse_span(np.append(values.ravel(), matrix))
        object.__setattr__(self, "inclusion", np.broadcast_to(values, (self.inclusions.count,)))
        object.__setattr__(self, "matrix", matrix)
        if self.volume_fraction >= 1.0 - 1e-12:
            raise GeometryError("the inclusions fill the whole box and leave no matrix: use fewer or smaller ones")

    @property
    def dimension(self) -> int:
        """2 for disks, 3 for spheres."""
        return self.inclusions.dimension

    @cached_property
    def volume_fraction(self) -> float:
        """Exact volume (area) of the union of the inclusions inside the box, over the box's."""
        return solid_fraction(self.inclusions)

    @property
    def contrast(self) -> tuple[float, float]:
        """Least and largest conductivity of an inclusion over that of the matrix."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ratios = self.inclusion / self.matrix
        return float(np.nanmin(ratios)), float(np.nanmax(ratios))

    @property
    def overlapping(self) -> int:
        """Number of pairs of inclusions that overlap by more than rounding, periodic images included."""
        gaps = neighbor_pairs(self.inclusions).gaps
        return int((gaps < -ROUNDING * self.inclusions.radii.mean()).sum())

    def phase(self, points: ArrayLike) -> NDArray[np.int64]:
        """Row number of the inclusion that holds each point, `MATRIX` for none.

        Parameters
        ----------
        points : array_like, shape (m, d) [m]
            Inside the box, or anywhere along a periodic axis.

        Returns
        -------
        ndarray, shape (m,)
        """
        box = self.inclusions.box
        points = box.wrap(np.asarray(points, dtype=np.float64))
        # a cKDTree takes a length of 0 for an axis that does not repeat
        tree = cKDTree(points, boxsize=np.where(box.periodic, box.lengths, 0.0))
        found = tree.query_ball_point(self.inclusions.centers, self.inclusions.radii)
        rows = np.repeat(np.arange(self.inclusions.count), [len(inside) for inside in found])
        inside = np.concatenate([np.asarray(part, dtype=np.int64) for part in found])
        arms = box.minimum_image(points[inside] - self.inclusions.centers[rows])
        power = np.einsum("mk,mk->m", arms, arms) - self.inclusions.radii[rows] ** 2
        order = np.lexsort((rows, power, inside))
        held, first = np.unique(inside[order], return_index=True)
        owner = np.full(points.shape[0], MATRIX, dtype=np.int64)
        owner[held] = rows[order][first]
        return owner

    def conductivity_at(self, points: ArrayLike) -> NDArray[np.float64]:
        """Conductivity at each point, shape (m,) [W/(m K)]; points as in `phase`."""
        return np.append(self.inclusion, self.matrix)[self.phase(points)]


def _refuse_span(conductivities: NDArray[np.float64]) -> None:
    """Refuse conductivities too far from each other, or from 1, for double precision."""
    finite = conductivities[(conductivities > 0.0) & np.isfinite(conductivities)]
    least, largest = float(finite.min(initial=np.inf)), float(finite.max(initial=0.0))
    if least < 1.0 / EXTREME or largest > EXTREME or largest / least > SPAN:
        raise InputError(
            f"the conductivities reach from {least:g} to {largest:g} W/(m K): allowed are numbers from "
            f"{1.0 / EXTREME:g} to {EXTREME:g} within a factor of {SPAN:g}; give 0 or inf for what hardly or "
            "perfectly conducts"
        )


@dataclass(frozen=True, eq=False)
class Homogenized:
    """The effective conductivity of a composite.

    Parameters
    ----------
    tensor : ndarray, shape (d, d) [W/(m K)]
        With walls only the diagonal: along each axis between two isothermal walls, the others adiabatic.
    volume_fraction : float
        Of the inclusions, in the geometry that was solved.
    unknowns : int
        Nodes or voxels.
    iterations : int
        Most of a load.
    relative_error_estimate : float
        Of the conductivity; the engine says what it is made of.
    seconds : float
        Of the whole computation.
    """

    tensor: NDArray[np.float64]
    volume_fraction: float
    unknowns: int
    iterations: int
    relative_error_estimate: float
    seconds: float
