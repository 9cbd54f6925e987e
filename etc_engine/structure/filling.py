"""Filling: how the particles sit between the walls of their box; a box is not always the sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from etc_engine.arrays import Floats, Ints
from etc_engine.packing.particles import ParticlePacking
from etc_engine.structure.union import solid_fraction

DEEP = 0.5
"""A wall that cuts off more than this part of a radius goes through particles that it should hold."""


@dataclass(frozen=True, eq=False)
class Filling:
    """Where the particles are in their box.

    Parameters
    ----------
    extent : ndarray, shape (d, 2) [m]
        Lowest and highest surface of a particle along each axis.
    free : ndarray, shape (2 d,) [m]
        Distance from each wall (0 and L along x, then along y, ...) to the nearest surface, negative where the wall
        is touched or cuts; NaN along periodic axes.
    deep_cuts : ndarray of int, shape (2 d,)
        Particles of which each wall cuts off more than half a radius.
    radii : (float, float) [m]
        Smallest and largest radius.
    """

    extent: Floats
    free: Floats
    deep_cuts: Ints
    radii: tuple[float, float]

    @property
    def fill_height(self) -> float | None:
        """Highest surface along the last axis, above the low face of the box [m]; None where that axis repeats."""
        return None if np.isnan(self.free[-1]) else float(self.extent[-1, 1])


def find_filling(packing: ParticlePacking) -> Filling:
    """Where the particles of a packing are in their box.

    Parameters
    ----------
    packing : ParticlePacking

    Returns
    -------
    Filling

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> bed = find_filling(ParticlePacking([[0.5, 0.5], [1.5, 0.5]], [0.5, 0.5], Box((2.0, 8.0))))
    >>> bed.free.tolist(), bed.fill_height
    ([0.0, 0.0, 0.0, 7.0], 1.0)
    """
    centers, radii = packing.centers, packing.radii[:, None]
    extent = np.stack([(centers - radii).min(axis=0), (centers + radii).max(axis=0)], axis=1)
    lengths, periodic = np.asarray(packing.box.lengths), np.repeat(packing.box.periodic, 2)
    free = np.stack([extent[:, 0], lengths - extent[:, 1]], axis=1).ravel()
    cut = np.stack([radii - centers, radii - (lengths - centers)], axis=2).reshape(packing.count, -1) > DEEP * radii
    ends = float(radii.min()), float(radii.max())
    return Filling(extent, np.where(periodic, np.nan, free), np.where(periodic, 0, cut.sum(axis=0)), ends)


def join_fillings(parts: Sequence[Filling]) -> Filling:
    """The filling of a packing whose particles are in several parts, each in the whole box."""
    lows, highs = zip(*(part.extent.T for part in parts), strict=True)
    return Filling(
        np.stack([np.min(lows, axis=0), np.max(highs, axis=0)], axis=1),
        np.min([part.free for part in parts], axis=0),
        np.sum([part.deep_cuts for part in parts], axis=0),
        (min(part.radii[0] for part in parts), max(part.radii[1] for part in parts)),
    )


def free_walls(filling: Filling) -> Ints:
    """Walls with room for one more layer of the largest particles in front of them."""
    return np.flatnonzero(filling.free > 2.0 * filling.radii[1])


@dataclass(frozen=True)
class Losses:
    """What full particles lose in their box, as parts of its volume (area).

    Parameters
    ----------
    cut_particles : int
        Particles that walls cut.
    cut : float
        Part outside the walls.
    overlap : float
        Part that several particles share, counted once less than they are.
    """

    cut_particles: int
    cut: float
    overlap: float


def find_losses(packing: ParticlePacking) -> Losses:
    """Volume fractions beyond the walls and counted twice: density = solid fraction + cut + overlap.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> half = ParticlePacking([[0.0, 0.5]], [0.25], Box((1.0, 1.0)))
    >>> losses = find_losses(half)
    >>> losses.cut_particles, round(losses.cut / half.density, 12), round(losses.overlap, 12)
    (1, 0.5, 0.0)
    """
    box, lengths = packing.box, np.asarray(packing.box.lengths)
    inside = np.minimum(packing.centers, lengths - packing.centers)
    rows = np.flatnonzero(((inside < packing.radii[:, None]) & ~np.asarray(box.periodic)).any(axis=1))
    cut = 0.0
    for row in rows.tolist():
        one = ParticlePacking(packing.centers[row : row + 1], packing.radii[row : row + 1], box)
        cut += one.density - solid_fraction(one)
    return Losses(rows.size, cut, max(packing.density - cut - solid_fraction(packing), 0.0))
