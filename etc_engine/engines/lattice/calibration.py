"""Calibration of the contact lattice: the transmission coefficient that gives the body its own conductivity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from etc_engine.box import Box
from etc_engine.engines.lattice.network import COORDINATION, Lattice, contact_lattice, link_conductances
from etc_engine.engines.lattice.steady import conductivity_tensor
from etc_engine.packing.lubachevsky_stillinger import compress
from etc_engine.packing.particles import ParticlePacking

SPREAD = 0.3
"""Standard deviation of the radii over their mean in the packings of Haddad et al. 2021 ..."""

CUT = 2.0
"""... and the number of standard deviations at which their distribution ends."""


@dataclass(frozen=True)
class Calibration:
    """Transmission coefficient of a packing.

    Parameters
    ----------
    coefficient : float
        C_t, from the mean conductivity along the three axes.
    anisotropy : float
        Largest less smallest C_t of an axis, over the mean.
    mean_field : float
        Lower bound of C_t: every node at the temperature of the mean gradient.
    coordination : float
    """

    coefficient: float
    anisotropy: float
    mean_field: float
    coordination: float


def calibrate(
    packing: ParticlePacking, coordination: float = COORDINATION, *, attachment: str = "mirror", tolerance: float = 1e-8
) -> Calibration:
    """Transmission coefficient C_t for which the contact lattice of a packing conducts like its material.

    C_t = k / k(C_t = 1), with k the mean over the three axes; at least 3 V / sum pi R_m^2 d (mean field).

    Parameters
    ----------
    packing : ParticlePacking
        Spheres; each axis periodic or between walls.
    coordination, attachment
        As in `etc_engine.engines.lattice.network.contact_lattice`.
    tolerance : float
        Relative error of the conductivity left by the iterative solver.

    Returns
    -------
    Calibration

    Raises
    ------
    InputError, ConvergenceError

    Notes
    -----
    C_t depends on the coordination number and on the size distribution: calibrate each packing. The mean field bounds
    it from below because a linear temperature field is a trial field of the periodic cell, whose energy is the least.

    References
    ----------
    Haddad et al. 2021, eqs. 7-9, doi:10.1016/j.ijthermalsci.2020.106799.

    Examples
    --------
    >>> centers = (np.stack(np.meshgrid(*[np.arange(3)] * 3), axis=-1).reshape(-1, 3) + 0.5) / 3
    >>> cubic = ParticlePacking(centers, np.full(27, 1 / 6), Box((1.0, 1.0, 1.0), (True, True, True)))
    >>> found = calibrate(cubic, coordination=6.0)
    >>> round(found.coefficient * np.pi / 4, 9), round(found.mean_field * np.pi / 4, 9)
    (1.0, 1.0)
    """
    lattice = contact_lattice(packing, coordination, attachment=attachment)
    tensor = conductivity_tensor(lattice, link_conductances(lattice), tolerance=tolerance).tensor
    along = 1.0 / np.diag(tensor)
    coefficient = 3.0 / float(np.trace(tensor))
    return Calibration(coefficient, float(np.ptp(along)) / coefficient, mean_field(lattice), lattice.coordination)


def mean_field(lattice: Lattice) -> float:
    """Conductivity of the body over that of its lattice when every node follows the mean gradient: 3 V / sum S d."""
    passed = lattice.sections @ lattice.segments.sum(axis=1) + lattice.wall_sections @ lattice.wall_segments
    return float(3.0 * lattice.packing.box.volume / passed)


def pack_lattice(
    count: int,
    lengths: Sequence[float],
    rng: np.random.Generator,
    *,
    periodic: Sequence[bool] = (True, True, True),
    density: float = 0.64,
    spread: float = SPREAD,
) -> ParticlePacking:
    """Random packing to hang a lattice on: Gaussian radii cut at two standard deviations, by Lubachevsky-Stillinger.

    Parameters
    ----------
    count : int
        Number of particles.
    lengths : sequence of float [m]
        Edge lengths of the box.
    rng : numpy.random.Generator
    periodic : sequence of bool
        Periodic axes.
    density : float
        Sum of the sphere volumes over that of the box; 0.64 is close to jamming. A Laguerre lattice is as good at 0.5,
        which packs in half the time.
    spread : float
        Standard deviation of the radii over their mean, before the cut; 0 for equal spheres.

    Returns
    -------
    ParticlePacking

    Raises
    ------
    InputError, PackingError

    Examples
    --------
    >>> packing = pack_lattice(60, (1.0, 1.0, 1.0), np.random.default_rng(3), density=0.4)
    >>> packing.count, round(packing.density, 9)
    (60, 0.4)
    """
    deviates = np.empty(0)
    while deviates.size < count:
        drawn = rng.standard_normal(count)
        deviates = np.concatenate((deviates, drawn[np.abs(drawn) <= CUT]))
    radii = 1.0 + spread * deviates[:count]
    return compress(radii, Box(tuple(lengths), tuple(periodic)), rng, density=density).packing
