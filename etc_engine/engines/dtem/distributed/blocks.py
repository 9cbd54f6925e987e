"""Blocks of a box, one per rank, and the particles of each with copies of those that they may touch.

The box is cut along x into slabs of equal numbers of particles, each slab along y, each of these along z; how many
cuts an axis gets keeps the blocks as near to cubes as it can. Copies come with their periodic images, so that a part
has walls and no periods.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from etc_engine.arrays import Floats, Ints
from etc_engine.box import Box
from etc_engine.errors import GeometryError, InputError
from etc_engine.packing.particles import LARGEST, ParticlePacking
from etc_engine.ranks import Ranks, together

BINS = 4096
"""Bins along an axis among which cuts are placed."""
SLACK = 1.0 + 1e-9
"""Factor on distances within which copies are taken: a contact that rounding decides is seen by both ranks."""


@dataclass(frozen=True, eq=False)
class Part:
    """The particles of one rank, and copies of those of others.

    Parameters
    ----------
    box : Box
        The whole one.
    packing : ParticlePacking
        Own particles first, then copies, in a box with walls of its own: those of the whole box where it has them and
        they are near, others too far away to be touched.
    corner : ndarray, shape (d,) [m]
        Low corner of its box in the whole one.
    conductivity : ndarray, shape (n,) [W/(m K)]
    own : int
        How many are not copies.
    firsts : ndarray of int, shape (ranks,)
        Number of the first particle of each rank among all of them.
    total : int
        Particles of all ranks.
    farthest : int
        Largest component of an image on any rank.
    numbers : ndarray of int, shape (n,)
        Number of each particle, or of the one that it copies.
    owners : ndarray of int, shape (n,)
        Rank of each.
    images : ndarray of int, shape (n, d)
        Periodic image of a copy, in box lengths; 0 of own particles.
    sent : tuple of ndarray of int
        Rows of which each rank holds copies, in the order of its copies.
    """

    box: Box
    packing: ParticlePacking
    corner: Floats
    conductivity: Floats
    own: int
    firsts: Ints
    total: int
    farthest: int
    numbers: Ints
    owners: Ints
    images: Ints
    sent: tuple[Ints, ...]

    def with_copies(self, own: np.ndarray, ranks: Ranks) -> np.ndarray:
        """Values of own particles, followed by those of the copies, which their ranks give."""
        return np.concatenate([own, *ranks.exchange([own[rows] for rows in self.sent])])


def make_part(
    box: Box, centers: Floats, radii: Floats, conductivity: Floats, gap: float, ranks: Ranks, margin: float = 0.0
) -> Part:
    """Give every particle to the rank of its block, and copies to the ranks near it.

    Parameters
    ----------
    box : Box
    centers : ndarray, shape (n, d) [m]
        In the box, of any particles, each on one rank.
    radii : ndarray, shape (n,) [m]
    conductivity : ndarray, shape (n,) [W/(m K)]
    gap : float
        Largest gap of a contact, in mean radii of the pair.
    ranks : Ranks
    margin : float [m]
        How much farther than contacts reach copies are taken.

    Raises
    ------
    GeometryError
        If a particle is not one of the box.
    InputError
        If there are more ranks than blocks with particles.
    """
    centers = box.wrap(centers)
    together(ranks, lambda: _check(box, centers, radii))
    owner = _owners(centers, ranks)
    rows = np.column_stack([centers, radii, conductivity])
    held = np.concatenate(ranks.exchange([rows[owner == rank] for rank in range(ranks.size)]))
    counts = ranks.share(len(held))
    if min(counts) == 0:
        raise InputError(
            f"{ranks.size} ranks are too many for {sum(counts)} particles: {counts.count(0)} of their blocks hold none"
        )
    return _with_copies(box, held, np.concatenate([[0], np.cumsum(counts)]), gap, ranks, margin)


def _check(box: Box, centers: Floats, radii: Floats) -> None:
    """Refuse radii and centres that are not of a packing in the box."""
    outside = ((centers < 0.0) | (centers > np.asarray(box.lengths))).any(axis=1)
    for bad, what in (
        (~(radii > 0.0), "a radius that is not positive"),
        (radii > LARGEST * max(box.lengths), f"a radius beyond {LARGEST:g} times the box {box.lengths}"),
        (outside, f"a centre outside the box {box.lengths}"),
    ):
        if bad.any():
            row = np.flatnonzero(bad)[0]
            raise GeometryError(
                f"a particle has {what}: found the centre {centers[row].tolist()} and the radius {radii[row]:g}"
            )


def _grid(extent: Floats, size: int) -> tuple[int, ...]:
    """Blocks along each axis, ``size`` in all, of the least surface, for centres of a given extent along each axis."""
    lengths = np.maximum(extent, 1e-12 * extent.max() or 1.0)
    return min(_factors(size, lengths.size), key=lambda shape: float((shape / lengths).sum()))


def _factors(size: int, axes: int) -> Iterator[tuple[int, ...]]:
    if axes == 1:
        yield (size,)
        return
    for n in range(1, size + 1):
        if size % n == 0:
            yield from ((n, *rest) for rest in _factors(size // n, axes - 1))


def _owners(centers: Floats, ranks: Ranks) -> Ints:
    """Rank of each particle: cuts axis by axis at equal numbers of particles."""
    ends = np.array(ranks.share((centers.min(axis=0, initial=np.inf), centers.max(axis=0, initial=-np.inf))))
    lows, highs = ends[:, 0].min(axis=0), ends[:, 1].max(axis=0)
    grid, owner = _grid(highs - lows, ranks.size), np.zeros(len(centers), dtype=np.int64)
    for axis, pieces in enumerate(grid):
        x, low, high = centers[:, axis], lows[axis], highs[axis]
        place = np.minimum(((x - low) * (BINS / max(high - low, 1e-300))).astype(np.int64), BINS - 1)
        blocks = int(np.prod(grid[:axis], dtype=np.int64))
        counts = np.bincount(owner * BINS + place, minlength=blocks * BINS)
        behind = np.cumsum(np.asarray(ranks.add_up(counts)).reshape(blocks, BINS), axis=1)
        # a bin belongs to the piece in which its middle particle is
        middle = behind - 0.5 * np.diff(behind, axis=1, prepend=0)
        piece = np.minimum((pieces * middle / np.maximum(behind[:, -1:], 1)).astype(np.int64), pieces - 1)
        owner = owner * pieces + piece[owner, place]
    return owner


def _with_copies(box: Box, held: Floats, firsts: Ints, gap: float, ranks: Ranks, margin: float) -> Part:
    d, numbers = box.dimension, np.arange(*firsts[ranks.rank : ranks.rank + 2])
    centers, radii = held[:, :d], held[:, d]
    low, high = centers.min(axis=0), centers.max(axis=0)
    blocks = ranks.share((low, high, float(radii.max())))
    widest = max(block[2] for block in blocks)
    lengths = np.asarray(box.lengths)
    most = np.where(
        box.periodic, 1 + ((2.0 * widest * (1.0 + 0.5 * gap) + margin) / lengths).astype(np.int64), 0
    ).tolist()
    shifts = [np.array(shift) for shift in product(*(range(-n, n + 1) for n in most))]
    sent: list[Ints] = []
    copies: list[tuple[Floats, Ints, Ints]] = []
    for rank, (block_low, block_high, largest) in enumerate(blocks):
        reach = (largest + radii) * (1.0 + 0.5 * gap) * SLACK + margin
        farthest = (largest + radii.max()) * (1.0 + 0.5 * gap) * SLACK + margin
        rows, images = [np.zeros(0, dtype=np.int64)], [np.zeros((0, d), dtype=np.int64)]
        for shift in shifts:
            moved = shift * lengths
            if rank == ranks.rank and not shift.any():
                continue
            if ((low + moved > block_high + farthest) | (high + moved < block_low - farthest)).any():
                continue
            places = centers + moved
            near = (places >= block_low - reach[:, None]) & (places <= block_high + reach[:, None])
            found = np.flatnonzero(near.all(axis=1))
            rows.append(found)
            images.append(np.broadcast_to(shift, (found.size, d)))
        chosen, image = np.concatenate(rows), np.concatenate(images)
        sent.append(chosen)
        values = held[chosen]
        values[:, :d] += image * lengths
        copies.append((values, numbers[chosen], image))
    received = ranks.exchange(copies)
    every = np.concatenate([held, *(values for values, _, _ in received)])
    owners = np.repeat(np.arange(ranks.size), [len(values) for values, _, _ in received])
    packing, corner = _local_packing(box, every[:, :d], every[:, d], gap)
    return Part(
        box=box,
        packing=packing,
        corner=corner,
        conductivity=every[:, d + 1],
        own=len(held),
        firsts=firsts[:-1],
        total=int(firsts[-1]),
        farthest=max(most),
        numbers=np.concatenate([numbers, *(found for _, found, _ in received)]),
        owners=np.concatenate([np.full(len(held), ranks.rank), owners]),
        images=np.concatenate([np.zeros((len(held), d), dtype=np.int64), *(image for _, _, image in received)]),
        sent=tuple(sent),
    )


def _local_packing(box: Box, centers: Floats, radii: Floats, gap: float) -> tuple[ParticlePacking, Floats]:
    """A packing in a box with walls: those of the whole box that are near, and others beyond every contact; its corner.

    A particle that touches a wall of the whole box is nearer to it than ``away``, so that its box has the wall.
    """
    away = 3.0 * (1.0 + gap) * float(radii.max())
    low, high = centers.min(axis=0) - away, centers.max(axis=0) + away
    walled, lengths = ~np.array(box.periodic), np.asarray(box.lengths)
    low = np.where(walled, np.maximum(low, 0.0), low)
    high = np.where(walled, np.minimum(high, lengths), high)
    return ParticlePacking(centers - low, radii, Box(tuple((high - low).tolist()))), low
