"""ContactNetwork: who touches whom, in which direction and through how wide an arc.

The network is the shared currency of the engine: `dtem`, `pipe` and `lattice` start from one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from etc_engine.errors import InputError
from etc_engine.packing.particles import ParticlePacking


@dataclass(frozen=True, eq=False)
class ContactNetwork:
    """Contacts between particles, and between particles and walls.

    Parameters
    ----------
    packing : ParticlePacking
        The particles, n of them in d dimensions.
    pairs : ndarray of int, shape (m, 2)
        Row numbers (i, j), i <= j, of the particles in contact.
    shifts : ndarray of int, shape (m, d)
        The image of j that i touches: its centre lies at ``x_j + shift * lengths``.
    angles : ndarray, shape (m, 2) [rad]
        Half-angles of the contact arc on i and on j.
    wall_particles, walls : ndarray of int, shape (w,)
        Particle and wall of each wall contact; wall ``2 * axis`` lies at 0, ``2 * axis + 1`` at the far end.
    wall_angles : ndarray, shape (w,) [rad]
        Half-angle of the wall contact's arc.
    geometric : bool
        Whether the arcs are those that particles and walls cut out of each other, not prescribed ones.

    Notes
    -----
    Position angles follow from the branch vectors; they are not stored.
    """

    packing: ParticlePacking
    pairs: NDArray[np.int64]
    shifts: NDArray[np.int64]
    angles: NDArray[np.float64]
    wall_particles: NDArray[np.int64]
    walls: NDArray[np.int64]
    wall_angles: NDArray[np.float64]
    geometric: bool = False

    @property
    def count(self) -> int:
        """Number of contacts between particles."""
        return int(self.pairs.shape[0])

    @property
    def coordination(self) -> float:
        """Mean number of particle contacts per particle, 2 m / n; walls do not count."""
        return 2.0 * self.count / self.packing.count

    @cached_property
    def branches(self) -> NDArray[np.float64]:
        """Branch vectors from the centre of i to the touched image of j, shape (m, d) [m]."""
        centers = self.packing.centers
        lengths = np.asarray(self.packing.box.lengths)
        return centers[self.pairs[:, 1]] - centers[self.pairs[:, 0]] + self.shifts * lengths

    def walls_of(self, axis: int) -> NDArray[np.int64]:
        """Row numbers of the contacts with the two walls normal to an axis."""
        return np.flatnonzero(self.walls // 2 == axis)

    def with_half_angle(self, half_angle: float) -> ContactNetwork:
        """The same contacts, all with one half-angle [rad] on either side."""
        check_half_angle(half_angle)
        return replace(
            self,
            angles=np.full_like(self.angles, half_angle),
            wall_angles=np.full_like(self.wall_angles, half_angle),
            geometric=False,
        )

    def select(self, contacts: NDArray[np.bool_], wall_contacts: NDArray[np.bool_]) -> ContactNetwork:
        """The network of the marked contacts; the particles stay."""
        return replace(
            self,
            pairs=self.pairs[contacts],
            shifts=self.shifts[contacts],
            angles=self.angles[contacts],
            wall_particles=self.wall_particles[wall_contacts],
            walls=self.walls[wall_contacts],
            wall_angles=self.wall_angles[wall_contacts],
        )


def check_half_angle(half_angle: float) -> None:
    """Refuse a contact half-angle [rad] that does not lie between 0 and pi/2, both excluded.

    Raises
    ------
    InputError
    """
    if not (np.isfinite(half_angle) and 0.0 < half_angle < 0.5 * np.pi):
        raise InputError(
            f"the contact half-angle must lie between 0 and 90 degrees, both excluded, "
            f"found {np.degrees(half_angle):g} degrees"
        )
