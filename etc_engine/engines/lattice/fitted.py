"""Seeds fitted to the interfaces of spherical inclusions: facets of the Laguerre lattice then lie on the spheres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.box import Box
from etc_engine.engines.lattice.calibration import pack_lattice
from etc_engine.errors import GeometryError
from etc_engine.medium.phases import PORE, find_owners
from etc_engine.packing.neighbors import neighbor_pairs
from etc_engine.packing.particles import ParticlePacking
from etc_engine.structure.laguerre import laguerre_facets
from etc_engine.structure.union import solid_fraction

OFFSET = 0.15
"""Distance of the two seeds of a pair from their interface, in seed spacings."""

NARROW = 0.3
"""... and, where another inclusion is near, in widths of the gap."""

NARROWEST = 0.02
"""Pairs move no closer to the interface than this, in seed spacings."""

CLEARANCE = 0.8
"""Seeds of the bulk keep this distance from an interface, in seed spacings."""

PATCH = 0.87
"""Area of interface to a pair, in squared seed spacings (a hexagonal arrangement)."""

FEWEST_PAIRS = 12
"""Pairs on a small sphere."""

SMALLEST = 0.4
"""Smallest radius that can be fitted, in seed spacings."""

WEIGHT = 0.01
"""Radius of all seeds, in seed spacings: equal weights."""

VOLUME = 1e-6
"""Relative error of the volume of the inclusions that is left by their tuning."""


@dataclass(frozen=True, eq=False)
class FittedSeeds:
    """Seeds of a Laguerre lattice and the inclusion that each belongs to.

    Parameters
    ----------
    packing : ParticlePacking
        Seeds of equal weight.
    owner : ndarray of int64, shape (n,)
        Row number of the inclusion, `etc_engine.medium.phases.PORE` for none.
    """

    packing: ParticlePacking
    owner: Ints


@dataclass(frozen=True, eq=False)
class _Pairs:
    """Directions and offsets of the seed pairs: inclusion, unit normal, offset, and whether the outer seed stays."""

    sphere: Ints
    normal: Floats
    offset: Floats
    outer: Flags


def fitted_seeds(
    packing: ParticlePacking,
    count: int,
    rng: np.random.Generator,
    box: Box | None = None,
    offset: float = OFFSET,
    narrow: float = NARROW,
) -> FittedSeeds:
    r"""About `count` seeds whose Laguerre facets follow the surfaces of spherical packing.

    Pairs of seeds mirror each other in the tangent planes of a sphere, at :math:`a' (1 \pm \delta / a')`; the facet
    between them is part of that plane. The polyhedron about the sphere would be too large, so its radius is tuned,

    .. math:: a' = a (1 - \kappa h^2 / a^2),

    with one kappa for all, until the inclusions' cells have the exact volume. Elsewhere seeds are the centres of a
    random packing, less those close to an interface.

    Parameters
    ----------
    packing : ParticlePacking
        The packing.
    count : int
        Number of seeds wanted; met within some per cent, but where spheres have less than a few seeds across, their
        surfaces take more.
    rng : numpy.random.Generator
    box : Box, optional
        The box of the lattice, where it has walls that the packing does not; the packing's by default.
    offset : float
        Distance of the seeds of a pair from the interface, in seed spacings; 0.15 is best for the conductivity, 0.4,
        near the middle of the cells, for a transient.
    narrow : float
        The same where another inclusion is near, in widths of the gap. The conductivity depends on it as far as the
        lattice does not resolve the gaps.

    Returns
    -------
    FittedSeeds

    Raises
    ------
    GeometryError
        If the box is not three-dimensional, an inclusion is too small for the number of seeds, or the volume cannot
        be met.

    Notes
    -----
    delta is the offset times the seed spacing h, less where the gap to another inclusion is narrow. Pairs on a part of
    a sphere within another inclusion are left out, and with them inclusions that others cover. Walls cut the
    inclusions off.

    Examples
    --------
    >>> sphere = ParticlePacking([[0.5, 0.5, 0.5]], [0.3], Box((1.0, 1.0, 1.0), (True, True, True)))
    >>> seeds = fitted_seeds(sphere, 300, np.random.default_rng(4))
    >>> inside = laguerre_facets(seeds.packing).volumes[seeds.owner == 0].sum()
    >>> bool(abs(inside / solid_fraction(sphere) - 1.0) < 1e-6)
    True
    """
    box = box or packing.box
    if box.dimension != 3:
        raise GeometryError(f"fitted seeds need a three-dimensional box, found {box.dimension} dimensions")
    h = _spacing(packing, count, box)
    small = int(np.argmin(packing.radii))
    if packing.radii[small] < SMALLEST * h:
        needed = int(np.ceil(box.volume * (SMALLEST / float(packing.radii[small])) ** 3))
        raise GeometryError(
            f"inclusion {small} of radius {packing.radii[small]:.4g} is too small for {count} lattice particles: "
            f"use at least {needed}"
        )
    pairs = _pairs_on_spheres(packing, h, (offset * h, narrow), rng)
    bulk = pack_lattice(count, box.lengths, rng, periodic=box.periodic, density=0.5, spread=0.0).centers
    bulk = bulk[_interface_distance(packing, bulk) > CLEARANCE * h]
    return _tuned(packing, pairs, bulk, h, box)


def _spacing(packing: ParticlePacking, count: int, box: Box) -> float:
    """Seed spacing for which pairs on the spheres and the seeds that make room for them come to `count` in all."""
    radii = packing.radii
    h = float((box.volume / count) ** (1.0 / 3.0))
    for _ in range(30):
        more = 4.0 * np.pi * float((radii**2).sum()) * (2.0 / PATCH - 2.0 * CLEARANCE) / h**2
        h = float((box.volume / max(count - more, 0.2 * count)) ** (1.0 / 3.0))
    return h


def _pairs_on_spheres(
    inclusions: ParticlePacking, h: float, offsets: tuple[float, float], rng: np.random.Generator
) -> _Pairs:
    """Pairs spread over every sphere, less those within another sphere or beyond a wall."""
    widest, narrow = offsets
    box, centers, radii = inclusions.box, inclusions.centers, inclusions.radii
    numbers = np.maximum(np.round(4.0 * np.pi * radii**2 / (PATCH * h * h)), FEWEST_PAIRS).astype(np.int64)
    sphere = np.repeat(np.arange(radii.size), numbers)
    normal = np.concatenate([_spread_directions(int(number), rng) for number in numbers])
    points = centers[sphere] + radii[sphere][:, None] * normal
    inside_box = np.asarray(
        (np.asarray(box.periodic) | ((points > 0.0) & (points < np.asarray(box.lengths)))).all(axis=1)
    )
    gap = _gap_to_others(inclusions, sphere, points, 2.0 * h)
    keep = inside_box & (gap > 0.0)
    sphere, normal, gap = sphere[keep], normal[keep], gap[keep]
    offset = np.minimum(np.minimum(widest, 0.5 * radii[sphere]), np.maximum(narrow * gap, NARROWEST * h))
    return _Pairs(sphere, normal, offset, gap > NARROWEST * h)


def _gap_to_others(inclusions: ParticlePacking, sphere: Ints, points: Floats, reach: float) -> Floats:
    """Distance from points on spheres to the nearest other sphere, at most `reach`; negative inside it."""
    box = inclusions.box
    lengths = np.asarray(box.lengths)
    near = neighbor_pairs(inclusions, gap=reach)
    gap = np.full(sphere.size, reach)
    first = np.searchsorted(sphere, np.arange(inclusions.count + 1))
    for (i, j), shift in zip(near.pairs.tolist(), near.shifts, strict=True):
        for own, other, step in ((i, j, shift), (j, i, -shift)):
            rows = slice(first[own], first[own + 1])
            away = points[rows] - (inclusions.centers[other] + step * lengths)
            gap[rows] = np.minimum(gap[rows], np.linalg.norm(away, axis=1) - inclusions.radii[other])
    return gap


def _spread_directions(number: int, rng: np.random.Generator) -> Floats:
    """Unit vectors evenly over the sphere: a Fibonacci spiral, turned at random."""
    k = np.arange(number) + 0.5
    z = 1.0 - 2.0 * k / number
    angle = np.pi * (1.0 + np.sqrt(5.0)) * k
    ring = np.sqrt(1.0 - z * z)
    turn, upper = np.linalg.qr(rng.standard_normal((3, 3)))
    return np.asarray(
        np.column_stack((ring * np.cos(angle), ring * np.sin(angle), z)) @ (turn * np.sign(np.diag(upper)))
    )


def _interface_distance(packing: ParticlePacking, points: Floats) -> Floats:
    """Distance of points to the nearest surface of a sphere; large for points far from all."""
    box = packing.box
    tree = cKDTree(box.wrap(points), boxsize=np.where(box.periodic, box.lengths, 0.0))
    h = float((box.volume / max(len(points), 1)) ** (1.0 / 3.0))
    distance = np.full(len(points), np.inf)
    for center, radius in zip(packing.centers, packing.radii, strict=True):
        rows = np.asarray(tree.query_ball_point(center, radius + 2.0 * h), dtype=np.int64)
        away = np.linalg.norm(box.minimum_image(points[rows] - center), axis=1)
        distance[rows] = np.minimum(distance[rows], np.abs(away - radius))
    return distance


def _assemble(packing: ParticlePacking, pairs: _Pairs, bulk: Floats, h: float, kappa: float, box: Box) -> FittedSeeds:
    """Seeds for a tuned radius."""
    a = packing.radii[pairs.sphere]
    tuned = a * (1.0 - kappa * (h / a) ** 2)
    middle = packing.centers[pairs.sphere]
    inner = middle + (tuned - pairs.offset)[:, None] * pairs.normal
    outer = (middle + (tuned + pairs.offset)[:, None] * pairs.normal)[pairs.outer]
    points = packing.box.wrap(np.concatenate((inner, outer, bulk)))
    owner = np.concatenate((pairs.sphere, np.full(len(outer), PORE), find_owners(packing, bulk)))
    kept = np.asarray((np.asarray(box.periodic) | ((points > 0.0) & (points < np.asarray(box.lengths)))).all(axis=1))
    return FittedSeeds(ParticlePacking(points[kept], np.full(int(kept.sum()), WEIGHT * h), box), owner[kept])


def _tuned(packing: ParticlePacking, pairs: _Pairs, bulk: Floats, h: float, box: Box) -> FittedSeeds:
    """Secant iteration on kappa until the inclusions' cells have the exact volume."""
    goal = solid_fraction(packing) * packing.box.volume

    def excess(kappa: float) -> tuple[float, FittedSeeds]:
        seeds = _assemble(packing, pairs, bulk, h, kappa, box)
        volumes = laguerre_facets(seeds.packing).volumes
        return float(volumes[seeds.owner != PORE].sum()) / goal - 1.0, seeds

    low, high = 0.06, 0.08
    error_low, error_high = excess(low)[0], 0.0
    for _ in range(12):
        error_high, made = excess(high)
        if abs(error_high) < VOLUME or error_high == error_low:
            break
        low, high, error_low = high, high - error_high * (high - low) / (error_high - error_low), error_high
    if abs(error_high) > 100.0 * VOLUME:
        raise GeometryError(
            f"the inclusions could not be fitted to their volume (error {error_high:.1e}): use more lattice particles"
        )
    return made
