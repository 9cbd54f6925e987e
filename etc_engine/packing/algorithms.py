"""The packing methods by their words: one specification, one call."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.box import Box, ball_measure
from etc_engine.errors import InputError, PackingError
from etc_engine.packing.advancing_front import enough_radii, pack_advancing_front, pack_given_disks
from etc_engine.packing.density import set_density
from etc_engine.packing.lubachevsky_stillinger import compress
from etc_engine.packing.particles import ParticlePacking
from etc_engine.packing.radii import RadiusDistribution
from etc_engine.packing.random_sequential import SATURATION, insert_randomly, refuse_wide_particles

Progress = Callable[[float], None]
"""Called now and then with the fraction of the work that is done."""


MOST_PARTICLES = 1e9
"""More would take a terabyte."""


@dataclass(frozen=True)
class PackingSpec:
    """Specification of a packing.

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
        Whether the radii may grow into overlap where the density asked for exceeds that of the advancing front.

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
        Method, radii, box, and number of particles or density.
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
    _refuse_too_many(spec)
    return METHODS[spec.method](spec, rng, progress)


def _refuse_too_many(spec: PackingSpec) -> None:
    """Refuse more particles than any machine holds: most likely a radius or an edge in another unit."""
    count: float
    if spec.count is not None:
        count, cure = spec.count, "ask for fewer"
    elif spec.radii.scalable:
        return
    else:
        count = (spec.density or 1.0) * spec.box.volume / spec.radii.mean_measure(spec.box.dimension)
        cure = f"use larger radii than {spec.radii.mean:g} m or a smaller box"
    if count > MOST_PARTICLES:
        raise InputError(f"the packing would have about {count:.3g} particles, above {MOST_PARTICLES:g}: {cure}")


def _scaled_sizes(spec: PackingSpec, rng: np.random.Generator) -> Floats:
    """Radii for the count and density of the specification, scaled to meet the density exactly."""
    count = spec.count
    if count is None and (spec.density is None or spec.radii.scalable):
        raise InputError(
            f"{spec.method} needs a count, or a density and radii with a length (equal:r, uniform:a:b, ...)"
        )
    d = spec.box.dimension
    if count is None:
        count = max(1, round(cast(float, spec.density) * spec.box.volume / spec.radii.mean_measure(d)))
    sizes = spec.radii.sample(count, rng)
    if spec.count is None:
        refuse_wide_particles(sizes, spec.box)  # lengths are meant: one disk wider than the box is no packing
    if spec.density is None:
        return sizes
    measures = ball_measure(sizes, d)
    scale = (spec.density * spec.box.volume / float(measures.sum())) ** (1.0 / d)
    return np.asarray(sizes * scale)


def _advancing_front(spec: PackingSpec, rng: np.random.Generator, _: Progress | None) -> ParticlePacking:
    if spec.radii.scalable and (spec.count is None or spec.density is None):
        raise InputError("the advancing front needs a radius (equal:r), or both a count and a density")
    if spec.count is not None and spec.density is not None:
        return _given_disks(spec, rng)
    packing = pack_advancing_front(spec.radii, spec.box, rng)
    if spec.count is not None:
        if spec.count > packing.count:
            raise PackingError(
                f"{spec.count} disks were asked for and the box holds {packing.count}: use a smaller count or radius",
                reached=packing.density,
            )
        return packing.select(np.sort(rng.permutation(packing.count)[: spec.count]))
    if spec.density is None:
        return packing
    return set_density(packing, spec.density, rng, growth_allowed=spec.radius_growth)


def _given_disks(spec: PackingSpec, rng: np.random.Generator) -> ParticlePacking:
    """Exactly `count` disks at exactly `density`, grown into overlap where the front is not so dense."""
    sizes = _scaled_sizes(spec, rng)
    factor = 1.0
    for _ in range(5):
        spare = RadiusDistribution("list", tuple(sizes * factor))
        try:
            packing = pack_given_disks(sizes * factor, spare, spec.box, rng)
        except PackingError as refusal:
            if not spec.radius_growth or refusal.reached is None:
                raise
            factor *= min(0.98, (0.97 * refusal.reached / (cast(float, spec.density) * factor**2)) ** 0.5)
            continue
        return packing.with_radii(packing.radii / factor)
    raise PackingError(f"{spec.count} disks could not be placed in the box {spec.box.lengths}")


def _lubachevsky_stillinger(spec: PackingSpec, rng: np.random.Generator, progress: Progress | None) -> ParticlePacking:
    sizes = _scaled_sizes(spec, rng)
    return compress(sizes, spec.box, rng, density=spec.density, growth_rate=spec.growth_rate, progress=progress).packing


def _random_sequential(spec: PackingSpec, rng: np.random.Generator, progress: Progress | None) -> ParticlePacking:
    if spec.count is None and spec.density is None and not spec.radii.scalable:
        return insert_randomly(enough_radii(spec.radii, spec.box, rng), spec.box, rng, progress).packing
    sizes = np.sort(_scaled_sizes(spec, rng))[::-1]  # the largest first: small ones still find room later
    saturation = SATURATION[spec.box.dimension]
    if spec.density is not None and np.ptp(sizes) == 0.0 and spec.density > 1.15 * saturation:
        raise InputError(
            f"density {spec.density:g} is out of reach: random sequential insertion of equal particles "
            f"saturates near {saturation:g}; ask for less, or use lubachevsky-stillinger"
        )
    insertion = insert_randomly(sizes, spec.box, rng, progress)
    packing = insertion.packing
    if packing.count < sizes.size:
        raise PackingError(
            f"random sequential insertion saturated at density {packing.density:.6f} with {packing.count} of "
            f"{sizes.size} particles; large boxes of equal particles saturate near "
            f"{saturation:g}: ask for less, or use lubachevsky-stillinger",
            reached=packing.density,
        )
    return packing


METHODS: dict[str, Callable[[PackingSpec, np.random.Generator, Progress | None], ParticlePacking]] = {
    "advancing-front": _advancing_front,
    "lubachevsky-stillinger": _lubachevsky_stillinger,
    "random-sequential": _random_sequential,
}
"""Packing methods by their words."""
