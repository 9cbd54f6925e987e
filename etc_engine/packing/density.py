"""Bring a packing to a requested density: vacancies below the density of the packing, radius growth above."""

from __future__ import annotations

import numpy as np

from etc_engine.errors import InputError, PackingError
from etc_engine.packing.particles import ParticlePacking


def set_density(
    packing: ParticlePacking, density: float, rng: np.random.Generator, *, growth_allowed: bool = True
) -> ParticlePacking:
    """A packing of the requested density, made from one of another density.

    Parameters
    ----------
    packing : ParticlePacking
        The packing to start from.
    density : float
        Requested sum of the full particle areas (volumes) over the box's, positive.
    rng : numpy.random.Generator
        Chooses the particles that are removed.
    growth_allowed : bool
        Whether the radii may grow uniformly, so that particles overlap, to reach a higher density.

    Returns
    -------
    ParticlePacking
        Below: particles removed in random order, the rest in their old order, stopped where the density comes
        closest to the requested one (within half the largest particle's share; read it from `.density`).
        Above: all radii multiplied by the same factor, which meets the density to rounding.

    Raises
    ------
    InputError
        If the density is not positive and finite.
    PackingError
        If a higher density is requested and growth is not allowed; `reached` is the packing's own density.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> packing = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    >>> set_density(packing, 0.2, np.random.default_rng(3)).count
    1
    """
    if not (np.isfinite(density) and density > 0.0):
        raise InputError(f"a density must be positive and finite, found {density}")
    own = packing.density
    if density > own * (1.0 + 1e-12):
        if not growth_allowed:
            raise PackingError(
                f"density {density:.6g} is above the packing's own {own:.6g}, and its radii may not grow: "
                f"ask for {own:.6g} or less, or use another packer",
                reached=own,
            )
        return packing.with_radii(packing.radii * (density / own) ** (1.0 / packing.dimension))
    removed = rng.permutation(packing.count)
    shares = packing.measures[removed] / packing.box.volume
    left = own - np.concatenate(([0.0], np.cumsum(shares[:-1])))  # density after 0, 1, 2, ... vacancies
    vacancies = int(np.argmin(np.abs(left - density)))
    return packing.select(np.sort(removed[vacancies:])) if vacancies else packing
