"""The box that holds a packing: edge lengths, periodic axes, minimum image."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from etc_engine.arrays import Floats, Ints
from etc_engine.errors import InputError

AXES = "xyz"


def ball_measure(radii: ArrayLike, dimension: int) -> Floats:
    """Length, area or volume of balls in 1, 2 or 3 dimensions: 2 R, pi R^2, 4/3 pi R^3.

    Examples
    --------
    >>> ball_measure([1.0, 2.0], 1), round(float(ball_measure(1.0, 3)), 6)
    (array([2., 4.]), 4.18879)
    """
    return np.asarray((2.0, np.pi, 4.0 / 3.0 * np.pi)[dimension - 1] * np.asarray(radii) ** dimension)


def ball_radius(measure: ArrayLike, dimension: int) -> Floats:
    """Radius of balls of a length, area or volume, the inverse of `ball_measure`.

    Examples
    --------
    >>> round(float(ball_radius(ball_measure(0.3, 3), 3)), 12)
    0.3
    """
    return np.asarray((np.asarray(measure) / ball_measure(1.0, dimension)) ** (1.0 / dimension))


@dataclass(frozen=True)
class Box:
    """A rectangular box with one corner at the origin, walled or periodic along each axis.

    Parameters
    ----------
    lengths : tuple of float
        Edge lengths [m], two or three of them.
    periodic : tuple of bool, optional
        True for each axis along which the box repeats; walls everywhere by default.

    Raises
    ------
    InputError
        If a length is not positive and finite, or the number of axes is not 2 or 3.

    Examples
    --------
    >>> Box((2.0, 1.0), (True, False)).minimum_image(np.array([1.5, 0.9]))
    array([-0.5,  0.9])
    """

    lengths: tuple[float, ...]
    periodic: tuple[bool, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "lengths", tuple(float(length) for length in self.lengths))
        periodic = tuple(bool(flag) for flag in self.periodic) or (False,) * len(self.lengths)
        object.__setattr__(self, "periodic", periodic)
        if len(self.lengths) not in (2, 3):
            raise InputError(f"a box has 2 or 3 edge lengths, found {len(self.lengths)}: {self.lengths}")
        if len(self.periodic) != len(self.lengths):
            raise InputError(
                f"a box of {len(self.lengths)} axes needs as many periodic flags, found {len(self.periodic)}"
            )
        if not all(np.isfinite(length) and length > 0.0 for length in self.lengths):
            raise InputError(f"the edge lengths of a box must be positive and finite, found {self.lengths}")
        if not all(1e-100 <= length <= 1e100 for length in self.lengths):
            raise InputError(f"the edge lengths of a box must lie between 1e-100 and 1e100, found {self.lengths}")

    @property
    def dimension(self) -> int:
        """Number of axes, 2 or 3."""
        return len(self.lengths)

    @property
    def volume(self) -> float:
        """Area [m2] in two dimensions, volume [m3] in three."""
        return float(np.prod(self.lengths))

    @property
    def periodic_axes(self) -> str:
        """The periodic axes as a word: ``""``, ``"x"``, ``"xy"``, ..."""
        return "".join(AXES[axis] for axis, flag in enumerate(self.periodic) if flag)

    def cross_section(self, axis: int) -> float:
        """Length (2D) or area (3D) of the face normal to an axis."""
        return self.volume / self.lengths[axis]

    def image_shift(self, separation: Floats) -> Ints:
        """Integer box shifts s for which ``separation + s * lengths`` is shortest; zero across walls."""
        lengths = np.asarray(self.lengths)
        shift = -np.rint(np.asarray(separation) / lengths).astype(np.int64)
        return np.where(np.asarray(self.periodic), shift, 0)

    def minimum_image(self, separation: Floats) -> Floats:
        """Shortest periodic image of separation vectors, shape (..., d)."""
        separation = np.asarray(separation, dtype=np.float64)
        return separation + self.image_shift(separation) * np.asarray(self.lengths)

    def wrap(self, points: Floats) -> Floats:
        """Points brought into [0, length) along the periodic axes, untouched along the others."""
        points = np.asarray(points, dtype=np.float64)
        lengths = np.asarray(self.lengths)
        inside = points - np.floor(points / lengths) * lengths
        inside = np.where(inside >= lengths, 0.0, inside)  # -1e-17 rounds up to the length itself
        return np.where(np.asarray(self.periodic), inside, points)


def parse_periodic(axes: str, dimension: int) -> tuple[bool, ...]:
    """Periodic flags from a word of axis names: ``"xy"`` in 2D is (True, True), ``""`` is all walls."""
    allowed = AXES[:dimension]
    if any(axis not in allowed for axis in axes) or len(set(axes)) != len(axes):
        raise InputError(
            f"periodic axes {axes!r} are not understood: expected a combination of the letters {allowed!r}"
        )
    return tuple(axis in axes for axis in allowed)
