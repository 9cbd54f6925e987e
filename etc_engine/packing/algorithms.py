"""The packing methods by their words: one specification, one call."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from etc_engine.box import Box
from etc_engine.errors import InputError
from etc_engine.packing.advancing_front import pack_advancing_front
from etc_engine.packing.density import set_density
from etc_engine.packing.particles import ParticlePacking
from etc_engine.packing.radii import RadiusDistribution

Progress = Callable[[float], None]
"""Called now and then with the fraction of the work that is done."""


@dataclass(frozen=True)
class PackingSpec:
    """What a packing is to be like.

    Parameters
    ----------
    method : str
        One of :data:`METHODS`.
    radii : RadiusDistribution
        Sizes of the particles; scaled where `count` and `density` are both given.
    box : Box
        The box to fill.
    count : int, optional
        Number of particles.
    density : float, optional
        Sum of the full particle areas (volumes) over the box's; the packer's own if omitted.
    growth_rate : float, optional
        Growth rate of the event-driven packer.
    radius_growth : bool
        Whether the advancing front may exceed its own density by letting the radii grow into overlap.

    Raises
    ------
    InputError
        If the method is unknown or a number makes no sense.
    """

    method: str
    radii: RadiusDistribution
    box: Box
    count: int | None = None
    density: float | None = None
    growth_rate: float | None = None
    radius_growth: bool = True

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise InputError(f"unknown packing method {self.method!r}: expected one of {', '.join(METHODS)}")
        if self.count is not None and self.count < 1:
            raise InputError(f"a packing needs at least one particle, found count {self.count}")
        if self.density is not None and not (np.isfinite(self.density) and self.density > 0.0):
            raise InputError(f"a density must be positive and finite, found {self.density}")
        if self.growth_rate is not None and not (np.isfinite(self.growth_rate) and self.growth_rate > 0.0):
            raise InputError(f"a growth rate must be positive and finite, found {self.growth_rate}")


def pack(spec: PackingSpec, rng: np.random.Generator, progress: Progress | None = None) -> ParticlePacking:
    """Make a packing.

    Parameters
    ----------
    spec : PackingSpec
        What it is to be like.
    rng : numpy.random.Generator
        The only source of randomness: the same generator state gives the same packing, bit for bit.
    progress : callable, optional
        Called now and then with the fraction done.

    Returns
    -------
    ParticlePacking

    Raises
    ------
    InputError
        If the request contradicts itself or the method.
    PackingError
        If the packer stopped short of its target.

    Examples
    --------
    >>> from etc_engine.packing.radii import parse_radii
    >>> spec = PackingSpec("advancing-front", parse_radii("uniform:0.02:0.04"), Box((1.0, 1.0)), density=0.6)
    >>> round(pack(spec, np.random.default_rng(11)).density, 2)
    0.6
    """
    return METHODS[spec.method](spec, rng, progress)


def _advancing_front(spec: PackingSpec, rng: np.random.Generator, _: Progress | None) -> ParticlePacking:
    if spec.count is not None:
        raise InputError("the advancing front fills the box: leave out the count, or use lubachevsky-stillinger")
    if spec.radii.scalable:
        raise InputError("the advancing front needs a radius: write equal:r")
    packing = pack_advancing_front(spec.radii, spec.box, rng)
    if spec.density is None:
        return packing
    return set_density(packing, spec.density, rng, growth_allowed=spec.radius_growth)


METHODS: dict[str, Callable[[PackingSpec, np.random.Generator, Progress | None], ParticlePacking]] = {
    "advancing-front": _advancing_front,
}
"""Packing methods by their words."""
