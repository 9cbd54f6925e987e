"""Lubachevsky-Stillinger packing: hard disks or spheres grow while they move and collide."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from etc_engine.arrays import Floats, Ints
from etc_engine.box import Box, ball_measure
from etc_engine.errors import InputError, PackingError
from etc_engine.packing.hard_spheres import DONE, EXCURSION, FULL, Gas, make_gas, run, start_lists
from etc_engine.packing.overlap import check_no_overlap
from etc_engine.packing.particles import ParticlePacking
from etc_engine.packing.random_sequential import insert_in_turn

DENSEST = {2: np.pi / np.sqrt(12.0), 3: np.pi / np.sqrt(18.0)}
"""Density of the closest packing of equal disks and spheres."""

START_DENSITY = {2: 0.35, 3: 0.20}
"""Density of the random sequential start, well below its saturation."""

GROWTH_RATE = {2: 0.05, 3: 0.03}
"""Default growth rate of the mean diameter over the thermal velocity sqrt(k T / m)."""

JAMMED = 1e6
"""Reduced pressure at which a packing counts as jammed: its density is then about d / 1e6 below jamming."""

STIFF = 300.0
"""Reduced pressure from which growth slows down, in inverse proportion to the pressure, ..."""

SLOWEST = 0.2
"""... down to this part of the growth rate: particles then find enough contacts to hold each other."""

BATCH = 8
"""Collisions that each particle takes part in, on average, between two synchronisations."""

BUDGET = 100_000
"""Collisions per particle after which a compression is given up."""


@dataclass(frozen=True, eq=False)
class Compression:
    """A packing and what the compression took.

    Parameters
    ----------
    packing : ParticlePacking
        The packing, without overlaps.
    pressure : float
        Reduced pressure P V / (N k T) from the collisions between particles of the last batch.
    collisions : int
        Number of collisions between particles.
    renewals : int
        Number of renewals of neighbour lists (what cell crossings are to a method with cells).
    """

    packing: ParticlePacking
    pressure: float
    collisions: int
    renewals: int


def compress(
    radii: Floats,
    box: Box,
    rng: np.random.Generator,
    *,
    density: float | None = None,
    growth_rate: float | None = None,
    jammed: float = JAMMED,
    progress: Callable[[float], None] | None = None,
) -> Compression:
    r"""Pack particles by event-driven dynamics with growing radii.

    Particles start at random, far apart, with Maxwellian velocities. All radii grow in proportion at a
    constant rate, and particles (equal masses) collide elastically at surfaces that move:

    .. math:: u' = 2 (\dot R_i + \dot R_j) - u

    for the normal relative velocity u. The heating by growth is taken out by rescaling the velocities.

    Parameters
    ----------
    radii : ndarray, shape (n,)
        Relative sizes; they are scaled so that the density is met exactly.
    box : Box
        Two- or three-dimensional, each axis walled or periodic.
    rng : numpy.random.Generator
        Source of the start and of the velocities.
    density : float, optional
        Requested sum of the full particle areas (volumes) over the box's; jamming if omitted.
    growth_rate : float, optional
        Growth rate of the mean diameter in units of sqrt(k T / m); 0.05 for disks, 0.03 for spheres if
        omitted; from a reduced pressure of 300 on, it slows down to a fifth. Slower growth gives denser,
        better connected and, for equal particles, more crystalline jammed packings.
    jammed : float
        Reduced pressure at which growth stops.
    progress : callable, optional
        Called with the fraction done.

    Returns
    -------
    Compression

    Raises
    ------
    InputError
        If the density is above the closest packing of equal particles, a particle is wider than the box, or a
        periodic box is under two diameters wide.
    PackingError
        If the packing jammed below the requested density, or the budget of collisions was used up; `reached`
        is the density reached.

    Notes
    -----
    The density of the packing returned equals the requested one to rounding, and no pair overlaps by more
    than 1e-10 of its mean diameter (checked on every packing). Clocks are set back to zero at every
    synchronisation, so that times do not lose digits. The cost is about 1 microsecond a collision.

    References
    ----------
    B. D. Lubachevsky, F. H. Stillinger, Geometric properties of random disk packings, J. Stat. Phys. 60
    (1990) 561-583, doi:10.1007/BF01025983. A. Donev, S. Torquato, F. H. Stillinger, Neighbor list collision-
    driven molecular dynamics simulation for nonspherical hard particles I, J. Comput. Phys. 202 (2005)
    737-764, doi:10.1016/j.jcp.2004.08.014 (neighbour lists).

    Examples
    --------
    >>> box = Box((1.0, 1.0), (True, True))
    >>> made = compress(np.ones(50), box, np.random.default_rng(8), density=0.7)
    >>> round(made.packing.density, 12)
    0.7
    """
    radii = np.asarray(radii, dtype=np.float64)
    d, unit = box.dimension, _unit_scale(radii, box)
    goal = _refuse_the_impossible(radii, box, density)
    if growth_rate is not None and not (np.isfinite(growth_rate) and growth_rate > 0.0):
        raise InputError(f"a growth rate must be positive and finite, found {growth_rate}")
    fastest = (GROWTH_RATE[d] if growth_rate is None else growth_rate) / (2.0 * radii.mean())
    start, centers = _random_start(radii, box, min(START_DENSITY[d], 0.9 * goal), rng)
    order = _spatial_order(centers, box)
    velocities = rng.standard_normal(centers.shape)

    def notify(scale: float, pressure: float) -> None:
        if progress is not None:
            reached = ((scale / unit) ** d - start) / (goal - start)
            part = reached if density is not None else np.log(pressure) / np.log(jammed)
            progress(float(np.clip(part, 0.0, 1.0)))

    first, last = unit * start ** (1.0 / d), unit * goal ** (1.0 / d)
    grown = _grow(centers[order], velocities, radii[order], box, first, last, fastest, jammed, notify)
    centers[order] = grown.centers
    packing = ParticlePacking(_inside(centers, box), radii * grown.scale, box)
    check_no_overlap(packing)
    _refuse_to_stop_short(packing, None if grown.arrived else density, grown.pressure, jammed)
    return Compression(packing, grown.pressure, grown.collisions, grown.renewals)


class _Grown(NamedTuple):
    """Where growth ended."""

    centers: Floats
    scale: float
    pressure: float
    collisions: int
    renewals: int
    arrived: bool


def _grow(
    centers: Floats,
    velocities: Floats,
    shapes: Floats,
    box: Box,
    scale: float,
    target: float,
    fastest: float,
    jammed: float,
    notify: Callable[[float, float], None],
) -> _Grown:
    """Grow radii ``shapes * scale`` until the scale is `target`, the packing jams or the budget is used up."""
    count, d = centers.shape
    excursion, room = _excursion(shapes * target, box), 24 if d == 2 else 60
    gas = make_gas(centers, velocities, shapes, box, target, excursion, room)
    pressure, collisions, renewals, arrived = 1.0, 0, 0, False
    batch = BATCH * count // 2 + 1
    while not arrived and pressure < jammed and 2 * collisions <= BUDGET * count:
        rate = fastest * max(SLOWEST, min(1.0, STIFF / pressure))
        energy = _cool(gas, box)
        why = FULL
        if start_lists(gas, scale, rate, excursion):
            why, time, hits, renewed, virial = run(gas, scale, rate, excursion, (target - scale) / rate, batch)
            collisions, renewals, scale = collisions + hits, renewals + renewed, scale + rate * time
            if why == DONE and hits:
                pressure = 1.0 + virial / (time * 0.5 * (energy + np.sum(gas.state[:, 3:6] ** 2)))
            arrived = why == DONE and hits < batch
            scale = target if arrived else scale
        if why == FULL:
            room *= 2
            state = gas.state
            gas = make_gas(state[:, :d], state[:, 3 : 3 + d], shapes, box, target, excursion, room)
        notify(scale, pressure)
    return _Grown(gas.state[:, :d], scale, float(pressure), int(collisions), int(renewals), arrived)


def _unit_scale(radii: Floats, box: Box) -> float:
    """Factor on the radii that makes the density 1."""
    return float((box.volume / ball_measure(radii, box.dimension).sum()) ** (1.0 / box.dimension))


def _refuse_the_impossible(radii: Floats, box: Box, density: float | None) -> float:
    """The density to grow to: the one requested, if it is possible, or the highest one conceivable."""
    equal = bool(np.ptp(radii) == 0.0)
    highest = DENSEST[box.dimension] if equal else 1.0
    if density is not None and not (np.isfinite(density) and density > 0.0):
        raise InputError(f"a density must be positive and finite, found {density}")
    if density is not None and density >= highest:
        kind = ("disks" if box.dimension == 2 else "spheres") if equal else "particles that do not overlap"
        raise InputError(f"density {density:g} is out of reach: {kind} fill at most {highest:.4f} of space")
    goal = highest if density is None else density
    widest = 2.0 * float(radii.max()) * _unit_scale(radii, box) * goal ** (1.0 / box.dimension)
    for axis, length in enumerate(box.lengths):
        needed, what = (2.0 * widest, "two diameters") if box.periodic[axis] else (widest, "one diameter")
        if length <= needed:
            raise InputError(
                f"the box is {length:g} long along {'xyz'[axis]}, under {what} ({needed:g}) of the largest "
                f"particle at density {goal:.4g}: use more particles or a longer box"
            )
    return goal


def _refuse_to_stop_short(packing: ParticlePacking, density: float | None, pressure: float, jammed: float) -> None:
    if density is None:
        return
    reached = packing.density
    if pressure >= jammed:
        reason = f"it jammed at density {reached:.6f} (reduced pressure {pressure:.2g})"
    else:
        reason = f"it reached {reached:.6f} within its budget of {BUDGET} collisions per particle"
    raise PackingError(
        f"density {density:g} was not reached: {reason}; ask for less, or use a lower growth rate",
        reached=reached,
    )


def _random_start(radii: Floats, box: Box, density: float, rng: np.random.Generator) -> tuple[float, Floats]:
    """Random places without overlap at the density, or at a lower one where walls leave too little room."""
    largest_first = np.argsort(-radii, kind="stable")
    centers = np.empty((radii.size, box.dimension))
    while True:
        scale = _unit_scale(radii, box) * density ** (1.0 / box.dimension)
        try:
            centers[largest_first] = insert_in_turn(radii[largest_first] * scale, box, rng)
        except PackingError:
            density *= 0.5
            if density < 1e-3:
                raise
            continue
        return density, centers


def _spatial_order(centers: Floats, box: Box) -> Ints:
    """Order of the particles along rows of blocks: neighbours in space are then near in memory."""
    blocks = np.floor(centers / (3.0 * (box.volume / len(centers)) ** (1.0 / box.dimension)))
    return np.lexsort(blocks.T)


def _excursion(radii: Floats, box: Box) -> float:
    """Size of the neighbour lists' balls: so small that only the nearest image can be hit within them."""
    widths = [length for length, periodic in zip(box.lengths, box.periodic, strict=True) if periodic]
    if not widths:
        return EXCURSION
    largest = float(radii.max())
    return min(EXCURSION, 0.99 * (min(widths) / 2.0 - 2.0 * largest) / (4.0 * largest))


def _cool(gas: Gas, box: Box) -> float:
    """Set all clocks to zero, positions into the box and the temperature to 1; returns sum of v**2."""
    d, count = box.dimension, len(gas.state)
    velocities = gas.state[:, 3 : 3 + d]
    if all(box.periodic) and count > 1:
        velocities -= velocities.mean(axis=0)
    velocities *= np.sqrt(d * count / np.sum(velocities**2))
    gas.state[:, :d] = box.wrap(gas.state[:, :d])
    gas.state[:, 6] = 0.0
    return float(np.sum(velocities**2))


def _inside(centers: Floats, box: Box) -> Floats:
    """Centres with the rounding error of walls taken off."""
    return np.where(box.periodic, centers, np.clip(centers, 0.0, box.lengths))
