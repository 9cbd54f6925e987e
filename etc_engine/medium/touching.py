"""Who touches whom, without a width: what every contact rule starts from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from etc_engine.arrays import Floats, Ints
from etc_engine.errors import GeometryError, InputError
from etc_engine.packing.neighbors import neighbor_pairs
from etc_engine.packing.particles import ParticlePacking

# An overlap below this part of the mean radius is round-off of a tangency, not a contact.
ROUND_OFF_OVERLAP = 1e-10


@dataclass(frozen=True, eq=False)
class Neighbors:
    """Who touches whom, without a width.

    Parameters
    ----------
    packing : ParticlePacking
    pairs, shifts, wall_particles, walls : ndarray of int
        As in `ContactNetwork`.
    """

    packing: ParticlePacking
    pairs: Ints
    shifts: Ints
    wall_particles: Ints
    walls: Ints


def find_neighbors(packing: ParticlePacking, gap: float) -> Neighbors:
    """Particles and walls whose surfaces are at most a gap apart, in mean radii of a pair and radii at a wall.

    Raises
    ------
    GeometryError
        If a particle lies inside another, or its centre behind the plane of their common rim.
    """
    near = neighbor_pairs(packing, relative_gap=gap)
    refuse_swallowed(packing, near.pairs, near.gaps)
    wall_particles, walls, _ = wall_distances_within(packing, gap, 1.0)
    return Neighbors(packing, near.pairs, near.shifts, wall_particles, walls)


def refuse_swallowed(packing: ParticlePacking, pairs: Ints, gaps: Floats) -> None:
    """Refuse pairs of which one particle lies inside the other, or reaches over the other's centre plane.

    With the distance d of the centres: d <= abs(R_i - R_j), and d^2 <= abs(R_i^2 - R_j^2), where the half-angle
    of the overlap seen from the smaller particle reaches 90 degrees.

    Raises
    ------
    GeometryError
    """
    r_i, r_j = packing.radii[pairs].T
    distance = (r_i + r_j) + gaps
    for bad, what in (
        (distance <= np.abs(r_i - r_j), "one lies inside the other"),
        (distance**2 <= np.abs(r_i**2 - r_j**2), "the smaller one has its centre behind their common rim"),
    ):
        if bad.any():
            row = int(np.flatnonzero(bad)[0])
            i, j = pairs[row]
            raise GeometryError(
                f"particles {i} and {j}: {what} (radii {r_i[row]:.6g} and {r_j[row]:.6g}, centres "
                f"{distance[row]:.6g} apart); remove one of them"
            )


def closest_neighbors(packing: ParticlePacking, coordination: float) -> Neighbors:
    """The closest pairs up to a mean coordination number, as in `coordination_contacts`."""
    wanted = round(0.5 * coordination * packing.count) if np.isfinite(coordination) else 0
    if wanted < 1:
        raise InputError(f"the mean coordination number must be positive (at least one contact), found {coordination}")
    for reach in (0.0, 0.05, 0.2, 0.5, 1.0, 2.0):
        near = neighbor_pairs(packing, relative_gap=reach)
        if near.count >= wanted:
            relative = near.gaps / (0.5 * packing.radii[near.pairs].sum(axis=1))
            gap = float(np.partition(relative, wanted - 1)[wanted - 1])
            return find_neighbors(packing, max(gap, 0.0) * (1.0 + 1e-12))
    raise InputError(
        f"a mean coordination number of {coordination:g} is out of reach: only {near.count} pairs of "
        f"{packing.count} particles are closer than two mean radii, {wanted} are needed"
    )


def wall_distances_within(packing: ParticlePacking, gap: float, sign: float) -> tuple[Ints, Ints, Floats]:
    """Particles whose gap to a wall is at most ``sign * gap`` radii: (particle, wall, distance), wall by wall."""
    particles: list[Ints] = []
    walls: list[Ints] = []
    distances: list[Floats] = []
    for axis in range(packing.dimension):
        if packing.box.periodic[axis]:
            continue
        for end, distance in enumerate(
            (packing.centers[:, axis], packing.box.lengths[axis] - packing.centers[:, axis])
        ):
            rows = np.flatnonzero(distance - packing.radii <= sign * gap * packing.radii)
            particles.append(rows)
            walls.append(np.full(rows.size, 2 * axis + end))
            distances.append(distance[rows])
    empty = np.zeros(0, dtype=np.int64)
    return (
        np.concatenate([empty, *particles]),
        np.concatenate([empty, *walls]),
        np.concatenate([empty.astype(np.float64), *distances]),
    )
