"""Bodies that are not boxes: a ball carved out of a lattice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from etc_engine.arrays import Flags
from etc_engine.box import Box, ball_measure
from etc_engine.engines.lattice.calibration import pack_lattice
from etc_engine.engines.lattice.fitted import fitted_seeds
from etc_engine.engines.lattice.network import TRANSMISSIONS, Lattice, contact_lattice, laguerre_lattice
from etc_engine.errors import GeometryError, InputError
from etc_engine.packing.particles import ParticlePacking

SURFACE = 6
"""Number of the wall that a carved surface is."""

MIDDLE = 0.4
"""Depth of the outermost seeds, in seed spacings: near the middle of their cells, which store the heat."""

ROOM = 1.05
"""Edge of the box that a ball is carved out of, in diameters."""


def carve(lattice: Lattice, inside: Flags) -> Lattice:
    """The part of a lattice that some nodes make up; the links cut become links to a surface, at the cut facets.

    Parameters
    ----------
    lattice : Lattice
    inside : ndarray of bool, shape (n,)
        Nodes that stay.

    Returns
    -------
    Lattice
        Links to the surface have the wall number `SURFACE`.

    Raises
    ------
    GeometryError
        If no node stays.
    """
    if not inside.any():
        raise GeometryError("no node lies within the body: use more particles")
    number = np.cumsum(inside) - 1
    i, j = lattice.pairs.T
    both, first, second = inside[i] & inside[j], inside[i] & ~inside[j], ~inside[i] & inside[j]
    walls = inside[lattice.wall_particles]
    seen_from_j = lattice.crossings[second] - lattice.branches[second]
    cut = np.count_nonzero(first) + np.count_nonzero(second)
    return Lattice(
        lattice.packing.select(inside),
        number[lattice.pairs[both]],
        lattice.shifts[both],
        lattice.sections[both],
        lattice.segments[both],
        lattice.crossings[both],
        lattice.volumes[inside],
        np.concatenate((number[lattice.wall_particles[walls]], number[i[first]], number[j[second]])),
        np.concatenate((lattice.walls[walls], np.full(cut, SURFACE))),
        np.concatenate((lattice.wall_sections[walls], lattice.sections[first], lattice.sections[second])),
        np.concatenate((lattice.wall_segments[walls], lattice.segments[first, 0], lattice.segments[second, 1])),
        np.concatenate((lattice.wall_crossings[walls], lattice.crossings[first], seen_from_j)),
    )


def ball_lattice(
    radius: float, count: int, rng: np.random.Generator, *, transmission: str = "laguerre", coefficient: float = 1.0
) -> Lattice:
    """Lattice of a ball, centred in its box, whose surface is the wall `SURFACE`.

    Parameters
    ----------
    radius : float [m]
    count : int
        Number of nodes of the ball, met within some per cent.
    rng : numpy.random.Generator
    transmission : str
        ``laguerre``: seeds fitted to the surface, whose facets lie on it and whose cells have the exact volume;
        ``contact``: links that leave the ball are cut off at its surface.
    coefficient : float
        C_t of the contact lattice.

    Returns
    -------
    Lattice

    Raises
    ------
    InputError, GeometryError, PackingError

    Examples
    --------
    >>> ball = ball_lattice(0.05, 200, np.random.default_rng(9))
    >>> round(float(ball.volumes.sum() / ball_measure(0.05, 3)), 5)
    1.0
    """
    if not (np.isfinite(radius) and radius > 0.0):
        raise InputError(f"the radius of a ball must be positive and finite, found {radius:g}")
    if transmission not in TRANSMISSIONS:
        raise InputError(f"unknown transmission {transmission!r}: expected one of {', '.join(TRANSMISSIONS)}")
    edge = 2.0 * ROOM * radius
    box = Box((edge, edge, edge), (True, True, True))
    ball = ParticlePacking([[0.5 * edge] * 3], [radius], box)  # type: ignore[arg-type]
    filled = float(ball_measure(radius, 3)) / box.volume
    if transmission == "laguerre":
        seeds = fitted_seeds(ball, round(count / filled), rng, offset=MIDDLE)
        return carve(laguerre_lattice(seeds.packing), seeds.owner == 0)
    packing = pack_lattice(round(count / filled), box.lengths, rng)
    return _ball_of_contacts(contact_lattice(packing, transmission=coefficient), radius)


def _ball_of_contacts(lattice: Lattice, radius: float) -> Lattice:
    """Particles with their centres in the ball; links that leave it end where their branch vector meets the surface."""
    packing = lattice.packing
    away = packing.centers - 0.5 * np.asarray(packing.box.lengths)
    inside = np.linalg.norm(away, axis=1) < radius
    body = carve(lattice, inside)
    start, along = away[inside][body.wall_particles], body.wall_crossings
    along = along / np.linalg.norm(along, axis=1)[:, None]
    rise = (start * along).sum(axis=1)
    lengths = -rise + np.sqrt(rise**2 + radius**2 - (start**2).sum(axis=1))
    # a centre on the surface takes its temperature; a hundredth of the radius is close enough
    lengths = np.maximum(lengths, 0.01 * packing.radii[inside][body.wall_particles])
    return replace(
        body,
        volumes=body.volumes * (ball_measure(radius, 3) / body.volumes.sum()),
        wall_segments=lengths,
        wall_crossings=lengths[:, None] * along,
    )
