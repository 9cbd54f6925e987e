"""Statistics of a packing's structure: contacts, rattlers, pair correlation, two-point probability."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.box import Box, ball_measure
from etc_engine.errors import InputError
from etc_engine.packing.neighbors import NeighborPairs, neighbor_pairs
from etc_engine.packing.particles import ParticlePacking

DIRECTIONS = 400
"""Directions over which the window of a walled box is averaged."""


@dataclass(frozen=True, eq=False)
class RadialFunction:
    """A function of distance, averaged over bins.

    Parameters
    ----------
    distances : ndarray, shape (bins,) [m]
        Middles of the bins.
    values : ndarray, shape (bins,)
    """

    distances: Floats
    values: Floats


def coordination_numbers(packing: ParticlePacking, contacts: NeighborPairs) -> Ints:
    """Number of contacts of each particle, shape (n,); a contact with its own image counts twice.

    Examples
    --------
    >>> packing = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    >>> coordination_numbers(packing, neighbor_pairs(packing)).tolist()
    [1, 1]
    """
    return np.bincount(contacts.pairs.ravel(), minlength=packing.count)


def find_rattlers(packing: ParticlePacking, contacts: NeighborPairs) -> Flags:
    """Particles that their neighbours cannot hold in place, shape (n,).

    A particle with fewer than d + 1 contacts is loose, and does not hold others: removed again and again until
    every particle left has d + 1 contacts with others that are left. Walls count as contacts.

    Examples
    --------
    >>> packing = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    >>> find_rattlers(packing, neighbor_pairs(packing)).tolist()
    [True, True]
    """
    needed = packing.dimension + 1
    held_by_walls = _wall_contacts(packing)
    kept = np.ones(packing.count, dtype=np.bool_)
    i, j = contacts.pairs.T
    while True:
        live = kept[i] & kept[j]
        held = np.bincount(contacts.pairs[live].ravel(), minlength=packing.count) + held_by_walls
        fewer = kept & (held >= needed)
        if fewer.sum() == kept.sum():
            return ~kept
        kept = fewer


def few_contacts(packing: ParticlePacking, contacts: NeighborPairs) -> Flags:
    """Particles with fewer than d + 1 contacts, walls counted, shape (n,).

    Nothing is removed on the way: a bonded or frictional packing, which `find_rattlers` may take apart altogether,
    keeps its other particles.

    Examples
    --------
    >>> row = [[0.1 + 0.2 * i, 0.1] for i in range(5)]
    >>> packing = ParticlePacking(row, [0.1] * 5, Box((1.0, 1.0)))
    >>> few_contacts(packing, neighbor_pairs(packing, relative_gap=1e-9)).tolist()
    [False, False, False, False, False]
    """
    return np.asarray(coordination_numbers(packing, contacts) + _wall_contacts(packing) < packing.dimension + 1)


def largest_cluster(packing: ParticlePacking, contacts: NeighborPairs) -> Flags:
    """Particles of the largest cluster of particles in contact, shape (n,).

    Examples
    --------
    >>> packing = ParticlePacking([[0.1, 0.5], [0.3, 0.5], [0.8, 0.5]], [0.1] * 3, Box((1.0, 1.0)))
    >>> largest_cluster(packing, neighbor_pairs(packing, relative_gap=1e-9)).tolist()
    [True, True, False]
    """
    links = coo_array((np.ones(contacts.count), contacts.pairs.T), shape=(packing.count, packing.count))
    _, labels = connected_components(links, directed=False)
    return np.asarray(labels == np.bincount(labels).argmax())


def _wall_contacts(packing: ParticlePacking) -> Ints:
    """Number of walls that each particle touches, shape (n,)."""
    touched = np.zeros(packing.count, dtype=np.int64)
    for axis, length in enumerate(packing.box.lengths):
        if not packing.box.periodic[axis]:
            position, reach = packing.centers[:, axis], packing.radii * (1.0 + 1e-6)
            touched += (position <= reach).astype(np.int64) + (length - position <= reach)
    return touched


def contact_directions(packing: ParticlePacking, contacts: NeighborPairs) -> Floats:
    """Unit vectors from particle i to its neighbour j, shape (m, d)."""
    i, j = contacts.pairs.T
    branch = packing.centers[j] + contacts.shifts * np.asarray(packing.box.lengths) - packing.centers[i]
    return np.asarray(branch / np.linalg.norm(branch, axis=1, keepdims=True))


def fabric_tensor(packing: ParticlePacking, contacts: NeighborPairs) -> Floats:
    r"""Contact-fabric tensor, shape (d, d).

    .. math:: F = \frac{1}{N_c} \sum_c n_c \otimes n_c

    Its trace is 1; it is the unit tensor over d where contacts have no preferred direction.

    Raises
    ------
    InputError
        If there is no contact.

    References
    ----------
    M. Satake, Fabric tensor in granular materials, in: Deformation and Failure of Granular Materials,
    Balkema, 1982, 63-68.

    Examples
    --------
    >>> packing = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    >>> fabric_tensor(packing, neighbor_pairs(packing)).tolist()
    [[1.0, 0.0], [0.0, 0.0]]
    """
    if contacts.count == 0:
        raise InputError("a fabric tensor needs at least one contact, found none: use a larger contact gap")
    n = contact_directions(packing, contacts)
    return np.asarray(n.T @ n / len(n))


def contact_half_angles(packing: ParticlePacking) -> Floats:
    r"""Half-angles of the contacts of overlapping particles, on both sides, shape (m, 2) [rad].

    .. math:: \cos\alpha_i = (d^2 + R_i^2 - R_j^2) / (2 d R_i)

    for particles at distance d; tangent particles have half-angle 0. Swallowed particles are left out.

    Examples
    --------
    >>> packing = ParticlePacking([[0.3, 0.5], [0.7, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    >>> np.degrees(contact_half_angles(packing)).round(4).tolist()
    [[36.8699, 36.8699]]
    """
    pairs = neighbor_pairs(packing)
    i, j = pairs.pairs.T
    radius_i, radius_j = packing.radii[i], packing.radii[j]
    distance = pairs.gaps + radius_i + radius_j
    cutting = distance > np.abs(radius_i - radius_j)
    distance, radius_i, radius_j = distance[cutting], radius_i[cutting], radius_j[cutting]
    excess = (radius_i - radius_j) * (radius_i + radius_j)
    cosines = np.column_stack(
        ((distance**2 + excess) / (2.0 * distance * radius_i), (distance**2 - excess) / (2.0 * distance * radius_j))
    )
    return np.arccos(np.clip(cosines, -1.0, 1.0))


def pair_correlation(packing: ParticlePacking, farthest: float, bins: int = 100) -> RadialFunction:
    r"""Pair correlation g(r) of the particle centres, 1 where there is no correlation.

    .. math:: g(r) = \frac{V}{N (N - 1) / 2} \frac{n(r)}{\int_{bin} w(s)\, S_d(s)\, ds}

    with n the number of pairs in the bin, S_d(s) = 2 pi s or 4 pi s^2, and w(s) the part of the box that
    keeps its partner inside when shifted by s: 1 if the box is periodic, averaged over directions if walled.

    Parameters
    ----------
    packing : ParticlePacking
    farthest : float
        Largest distance [m], not above half the shortest edge.
    bins : int

    Returns
    -------
    RadialFunction

    Raises
    ------
    InputError
        If there are fewer than two particles or the distance is not positive or too large for the box.

    Examples
    --------
    >>> packing = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.1, 0.1], Box((1.0, 1.0), (True, True)))
    >>> pair_correlation(packing, 0.4, 4).values.tolist()
    [0.0, 0.0, 0.0, 0.0]
    """
    box, d = packing.box, packing.dimension
    if packing.count < 2:
        raise InputError("a pair correlation needs at least two particles, found one")
    if not 0.0 < farthest <= 0.5 * min(box.lengths):
        raise InputError(f"the farthest distance must lie in (0, half the shortest edge], found {farthest:g}")
    points = packing.with_radii(np.full(packing.count, 1e-9 * farthest))
    distances = neighbor_pairs(points, gap=farthest, images=False).gaps + 2e-9 * farthest
    edges = np.linspace(0.0, farthest, bins + 1)
    counts, _ = np.histogram(distances, edges)
    # the volume of a shell is a difference of powers; the window varies slowly across it
    shells = ball_measure(1.0, d) * np.diff(edges**d)
    middles = 0.5 * (edges[1:] + edges[:-1])
    expected = 0.5 * packing.count * (packing.count - 1) * shells * _window(box, middles) / box.volume
    return RadialFunction(middles, np.asarray(counts / expected, dtype=np.float64))


def two_point_probability(
    packing: ParticlePacking, farthest: float, pixels: int = 1024, margin: float = 0.0
) -> RadialFunction:
    """Probability S2(r) that two points at distance r both lie in the solid.

    S2(0) is the solid fraction. S2 tends to its square where the medium is homogeneous: in periodic boxes, and between
    walls at some distance from them (``margin``), since particles stand in layers along a wall.

    The union of the particles is drawn on a grid whose autocorrelation, by fast Fourier transform, is averaged over
    all directions. Across walls only pairs of points inside the box count.

    Parameters
    ----------
    packing : ParticlePacking
    farthest : float
        Largest distance [m], not above half the shortest edge.
    pixels : int
        Grid points along the longest edge: the value is exact to about a pixel's share of the surface.
    margin : float
        Points closer to a wall than this are left out [m].

    Returns
    -------
    RadialFunction
        Distances from 0 in steps of a pixel, and S2 averaged over the shells around them.

    Raises
    ------
    InputError
        If the distance is not positive or too large for the box.

    References
    ----------
    S. Torquato, Random Heterogeneous Materials, Springer 2002, section 2.2.

    Examples
    --------
    >>> packing = ParticlePacking([[0.5, 0.5]], [0.3], Box((1.0, 1.0), (True, True)))
    >>> round(float(two_point_probability(packing, 0.1, 256).values[0]), 2)
    0.28
    """
    step = max(packing.box.lengths) / pixels
    shape = tuple(max(1, round(length / step)) for length in packing.box.lengths)
    solid, box = _inside(packing, _draw(packing, shape).astype(np.float64), margin)
    if not 0.0 < farthest <= 0.5 * min(box.lengths):
        raise InputError(f"the farthest distance must lie in (0, half the shortest edge], found {farthest:g}")
    shape = solid.shape
    padded = tuple(n if periodic else 2 * n for n, periodic in zip(shape, box.periodic, strict=True))
    spectrum = np.fft.rfftn(solid, padded, axes=range(len(shape)))
    overlaps = np.fft.irfftn(np.abs(spectrum) ** 2, padded, axes=range(len(shape)))
    square, weights = np.zeros(()), np.ones(())
    for axis, (n, size) in enumerate(zip(shape, padded, strict=True)):
        offset = np.fft.fftfreq(size, 1.0 / size) * box.lengths[axis] / n
        inside = np.ones(size) if box.periodic[axis] else np.maximum(0.0, 1.0 - np.abs(offset) / box.lengths[axis])
        square = np.add.outer(square, offset**2)
        weights = np.multiply.outer(weights, inside)
    shell = np.rint(np.sqrt(square) / step).astype(np.int64)
    near = shell <= int(farthest / step)
    sums = np.bincount(shell[near], overlaps[near])
    pairs = np.bincount(shell[near], weights[near]) * solid.size
    return RadialFunction(step * np.arange(sums.size, dtype=np.float64), np.asarray(sums / pairs, dtype=np.float64))


def _inside(packing: ParticlePacking, solid: Floats, margin: float) -> tuple[Floats, Box]:
    """The pixels that lie at least a margin from the walls, and the box that they fill."""
    box, cuts, lengths = packing.box, [], []
    for n, length, periodic in zip(solid.shape, box.lengths, box.periodic, strict=True):
        cut = 0 if periodic else int(np.ceil(margin / length * n - 1e-9))
        if 2 * cut >= n or margin < 0.0:
            raise InputError(f"a margin of {margin:g} m leaves nothing of the box {box.lengths}")
        cuts.append(slice(cut, n - cut))
        lengths.append(length * (n - 2 * cut) / n)
    return solid[tuple(cuts)], Box(tuple(lengths), box.periodic)


def _window(box: Box, distances: Floats) -> Floats:
    """Part of the box that stays inside when shifted by a distance, averaged over directions."""
    turn = (np.arange(DIRECTIONS) + 0.5) / DIRECTIONS
    if box.dimension == 2:
        directions = np.column_stack((np.cos(np.pi / 2 * turn), np.sin(np.pi / 2 * turn)))
    else:
        height = turn[:, None]
        around = np.pi / 2 * turn[None, :]
        level = np.sqrt(1.0 - height**2)
        grid = (level * np.cos(around), level * np.sin(around), height + 0.0 * around)
        directions = np.stack(grid, axis=-1).reshape(-1, 3)
    part = np.ones((distances.size, len(directions)))
    for axis, length in enumerate(box.lengths):
        if not box.periodic[axis]:
            part *= np.maximum(0.0, 1.0 - np.outer(distances, directions[:, axis]) / length)
    return np.asarray(part.mean(axis=1))


def _draw(packing: ParticlePacking, shape: tuple[int, ...]) -> Flags:
    """The union of the particles at the middles of a grid's cells."""
    full = np.array((*shape, *(1,) * (3 - len(shape))))
    lengths = np.array((*packing.box.lengths, *(1.0,) * (3 - len(shape))))
    periodic = np.array((*packing.box.periodic, *(False,) * (3 - len(shape))))
    centers = np.full((packing.count, 3), 0.5)
    centers[:, : len(shape)] = packing.centers
    solid = np.zeros(tuple(full), dtype=np.bool_)
    _fill_pixels(solid, centers, packing.radii, lengths, periodic)
    return solid.reshape(shape)


@njit(cache=True)
def _fill_pixels(solid, centers, radii, lengths, periodic):  # type: ignore[no-untyped-def]
    nx, ny, nz = solid.shape
    for i in range(radii.size):
        x, y, z, r = centers[i, 0], centers[i, 1], centers[i, 2], radii[i]
        for a in range(int(np.floor((x - r) / lengths[0] * nx)), int((x + r) / lengths[0] * nx) + 1):
            if not periodic[0] and not 0 <= a < nx:
                continue
            rest = r * r - ((a + 0.5) / nx * lengths[0] - x) ** 2
            for b in range(int(np.floor((y - r) / lengths[1] * ny)), int((y + r) / lengths[1] * ny) + 1):
                room = rest - ((b + 0.5) / ny * lengths[1] - y) ** 2
                if room < 0.0 or (not periodic[1] and not 0 <= b < ny):
                    continue
                half = np.sqrt(room)
                first = int(np.ceil((z - half) / lengths[2] * nz - 0.5))
                last = int(np.floor((z + half) / lengths[2] * nz - 0.5))
                if not periodic[2]:
                    first, last = max(first, 0), min(last, nz - 1)
                for c in range(first, last + 1):
                    solid[a % nx, b % ny, c % nz] = True
