"""Disks and spheres by their dimension: measures, and self-resistances of contacts. The only place that asks for it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from etc_engine.laws import disk, sphere


def ball_measure(radii: NDArray[np.float64], dimension: int) -> NDArray[np.float64]:
    """Length, area or volume of balls in 1, 2 or 3 dimensions: 2 c, pi c^2, 4/3 pi c^3.

    Examples
    --------
    >>> ball_measure(np.array([1.0, 2.0]), 1)
    array([2., 4.])
    """
    return np.asarray((2.0, np.pi, 4.0 / 3.0 * np.pi)[dimension - 1] * radii**dimension)


def segment_measure(alpha: NDArray[np.float64], dimension: int) -> NDArray[np.float64]:
    """Part that a chord (plane) of half-angle alpha cuts off a ball of radius 1, in 2 or 3 dimensions.

    alpha - sin(alpha) cos(alpha) of a disk, pi/3 (1 - cos(alpha))^2 (2 + cos(alpha)) of a sphere.

    Examples
    --------
    >>> (segment_measure(np.array([0.5 * np.pi]), 3) / ball_measure(np.ones(1), 3)).round(12)
    array([0.5])
    """
    if dimension == 2:
        return np.asarray(alpha - np.sin(alpha) * np.cos(alpha))
    height = 2.0 * np.sin(0.5 * alpha) ** 2
    return np.asarray(np.pi / 3.0 * height**2 * (3.0 - height))


def self_resistance(
    alpha: NDArray[np.float64], radii: NDArray[np.float64], dimension: int, law: str
) -> NDArray[np.float64]:
    """Resistance kappa h_ii between a contact and the mean of its particle.

    Parameters
    ----------
    alpha : ndarray [rad]
        Half-angles of the contacts.
    radii : ndarray [m]
        Of their particles.
    dimension : int
    law : str
        A name of ``SELF_RESISTANCE`` of `etc_engine.laws.disk` or `etc_engine.laws.sphere`.

    Returns
    -------
    ndarray
        Dimensionless for disks, [1/m] for spheres.

    Raises
    ------
    InputError
        If there is no such law.
    """
    if dimension == 2:
        return disk.self_resistance(alpha, law)
    return sphere.self_resistance(alpha, law) / radii
