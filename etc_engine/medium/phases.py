"""Which phase of a medium lies at a point, for the engines that resolve the pores."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.errors import GeometryError, InputError
from etc_engine.medium.backbone import joined_nodes
from etc_engine.medium.medium import Medium
from etc_engine.packing.neighbors import neighbor_pairs
from etc_engine.packing.particles import ParticlePacking

PORE = -1
"""Owner of a point in the pores."""

SPAN = 1e15
"""Largest ratio of two finite conductivities, ..."""

EXTREME = 1e100
"""... and the largest of one, or of its inverse [W/(m K)]."""

ROUNDING = 1e-9
"""Overlaps below this, in mean radii, are contacts."""


def find_owners(packing: ParticlePacking, points: ArrayLike) -> Ints:
    """Row number of the particle that holds each point, `PORE` for none.

    Parameters
    ----------
    packing : ParticlePacking
    points : array_like, shape (m, d) [m]
        Inside the box, or anywhere along a periodic axis.

    Returns
    -------
    ndarray, shape (m,)

    Notes
    -----
    A point in several particles belongs to the one of the least power distance :math:`|x - c|^2 - R^2`, so that the
    radical plane through the rim of an overlap divides them.
    """
    box = packing.box
    points = box.wrap(np.asarray(points, dtype=np.float64))
    # a cKDTree takes a length of 0 for an axis that does not repeat
    tree = cKDTree(points, boxsize=np.where(box.periodic, box.lengths, 0.0))
    found = tree.query_ball_point(packing.centers, packing.radii)
    rows = np.repeat(np.arange(packing.count), [len(inside) for inside in found])
    inside = np.concatenate([np.asarray(part, dtype=np.int64) for part in found])
    arms = box.minimum_image(points[inside] - packing.centers[rows])
    power = np.einsum("mk,mk->m", arms, arms) - packing.radii[rows] ** 2
    order = np.lexsort((rows, power, inside))
    held, first = np.unique(inside[order], return_index=True)
    owner = np.full(points.shape[0], PORE, dtype=np.int64)
    owner[held] = rows[order][first]
    return owner


def conductivity_at(medium: Medium, points: ArrayLike) -> Floats:
    """Conductivity at each point, shape (m,) [W/(m K)]; points as in `find_owners`.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.medium import Pores
    >>> sphere = ParticlePacking([[0.5, 0.5, 0.5]], [0.4], Box((1.0, 1.0, 1.0), (True, True, True)))
    >>> medium = Medium(sphere, 1.5, pores=Pores(0.2))
    >>> conductivity_at(medium, [[0.5, 0.5, 0.2], [0.0, 0.0, 0.0]])
    array([1.5, 0.2])
    """
    return of_owners(medium, find_owners(medium.packing, points))


def of_owners(medium: Medium, owners: Ints) -> Floats:
    """Conductivity of the particle, or of the pores, that each number of `find_owners` names [W/(m K)]."""
    return np.append(medium.conductivity, medium.pores.conductivity)[owners]


def contrast(medium: Medium) -> tuple[float, float]:
    """Least and largest conductivity of a particle over that of the pores."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = medium.conductivity / medium.pores.conductivity
    return float(np.nanmin(ratios)), float(np.nanmax(ratios))


def count_overlaps(packing: ParticlePacking) -> int:
    """Number of pairs of particles that overlap by more than rounding, periodic images included."""
    return int((neighbor_pairs(packing).gaps < -ROUNDING * packing.radii.mean()).sum())


def overlapping_axes(packing: ParticlePacking, members: Flags, periodic: tuple[bool, ...]) -> tuple[int, ...]:
    """Axes along which some particles overlap all the way: around the box, or from wall to wall.

    Parameters
    ----------
    packing : ParticlePacking
    members : ndarray of bool, shape (n,)
        The particles that count.
    periodic : tuple of bool
        Axes around which the box repeats; where the packing repeats and this does not, walls cut the particles.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> row = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.26], Box((1.0, 1.0), (True, True)))
    >>> every = np.ones(2, dtype=bool)
    >>> overlapping_axes(row, every, (True, True)), overlapping_axes(row, every, (False, False))
    ((0,), ())
    """
    box, slack = packing.box, ROUNDING * packing.radii.mean()
    found = neighbor_pairs(packing)
    cut = np.asarray(box.periodic) & ~np.asarray(periodic)
    overlap = members[found.pairs].all(axis=1) & (found.gaps < -slack) & (found.shifts[:, cut] == 0).all(axis=1)
    depth = np.stack((packing.centers, np.asarray(box.lengths) - packing.centers), axis=2)
    reaching = (depth < packing.radii[:, None, None] - slack) & members[:, None, None]
    nodes, walls = np.nonzero(reaching.reshape(packing.count, -1))
    return joined_nodes(packing.count, periodic, (found.pairs[overlap], found.shifts[overlap]), (nodes, walls))


def without_cut_axes(tensor: Floats, medium: Medium, boundary: str) -> Floats:
    """A tensor with exact zeros where pores that insulate cut the conducting particles from each other.

    Parameters
    ----------
    tensor : ndarray, shape (d, d) [W/(m K)]
    medium : Medium
    boundary : str
        ``periodic`` or ``walls``.

    Returns
    -------
    ndarray, shape (d, d) [W/(m K)]
        The same where the pores conduct. Particles that touch at a point conduct nothing.
    """
    if medium.pores.conductivity > 0.0:
        return tensor
    d = medium.dimension
    joined = overlapping_axes(medium.packing, medium.conductivity > 0.0, (boundary == "periodic",) * d)
    cut = np.setdiff1d(np.arange(d), joined)
    found = tensor.copy()
    found[cut, :] = np.where(np.isnan(found[cut, :]), np.nan, 0.0)
    found[:, cut] = np.where(np.isnan(found[:, cut]), np.nan, 0.0)
    return found


def check_phases(medium: Medium) -> None:
    """Refuse a medium whose pores cannot be resolved.

    Raises
    ------
    InputError
        If nothing conducts, or the conductivities lie too far from each other, or from 1, for double precision.
    GeometryError
        If the particles leave no pores.
    """
    conductivities = np.append(medium.conductivity, medium.pores.conductivity)
    if not conductivities.any():
        raise InputError("neither the particles nor the pores conduct: give at least one a conductivity above 0")
    finite = conductivities[(conductivities > 0.0) & np.isfinite(conductivities)]
    least, largest = float(finite.min(initial=np.inf)), float(finite.max(initial=0.0))
    if least < 1.0 / EXTREME or largest > EXTREME or largest / least > SPAN:
        raise InputError(
            f"the conductivities reach from {least:g} to {largest:g} W/(m K): allowed are numbers from "
            f"{1.0 / EXTREME:g} to {EXTREME:g} within a factor of {SPAN:g}; give 0 or inf for what hardly or "
            "perfectly conducts"
        )
    if medium.solid_fraction >= 1.0 - 1e-12:
        raise GeometryError("the particles fill the whole box and leave no pores: use fewer or smaller ones")
