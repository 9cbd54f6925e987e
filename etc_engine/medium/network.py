"""ContactNetwork: who touches whom, in which direction, through how wide a contact and against which resistance.

The network is the shared currency of the engines that work on contacts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.box import ball_measure
from etc_engine.errors import InputError
from etc_engine.laws.by_dimension import law_of
from etc_engine.packing.particles import ParticlePacking

LARGEST = 1e100
"""Of a resistance: products of a few of them stay finite."""

NARROWEST = float(np.radians(1e-6)) * (1.0 - 1e-12)
"""Smallest contact half-angle that is prescribed [rad]: on a particle of 1 mm the contact is narrower than an atom, and
below it the method ``exact`` loses digits."""


@dataclass(frozen=True, eq=False)
class ContactNetwork:
    """Links between particles, and between particles and walls.

    Parameters
    ----------
    packing : ParticlePacking
        The particles, n of them in d dimensions.
    pairs : ndarray of int, shape (m, 2)
        Row numbers (i, j), i <= j, of the linked particles.
    shifts : ndarray of int, shape (m, d)
        The image of j that i touches: its centre lies at ``x_j + shift * lengths``.
    angles : ndarray, shape (m, 2) [rad]
        Half-angle of the contact on i and on j; 0 on a link without a contact, a gap.
    lumped_resistances : ndarray, shape (m,) [K/W, in 2D m K/W]
        Resistance of each contact as one number, in series with what the particles resist.
    wall_particles, walls : ndarray of int, shape (w,)
        Particle and wall of each wall contact; wall ``2 * axis`` lies at 0, ``2 * axis + 1`` at the far end.
    wall_angles : ndarray, shape (w,) [rad]
        Half-angle of each wall contact.
    wall_lumped_resistances : ndarray, shape (w,) [K/W, in 2D m K/W]
        Likewise of each wall contact.
    rule : str
        Name of the contact rule that made it, a key of `etc_engine.medium.rules.RULES`.
    area_resistances : ndarray, shape (m + w,), optional [m2 K/W]
        Resistance of a unit of contact area, of each particle contact and then each wall contact; none by default.

    Notes
    -----
    Directions follow from the branch vectors; they are not stored.
    """

    packing: ParticlePacking
    pairs: Ints
    shifts: Ints
    angles: Floats
    lumped_resistances: Floats
    wall_particles: Ints
    walls: Ints
    wall_angles: Floats
    wall_lumped_resistances: Floats
    rule: str
    area_resistances: Floats | None = None

    def __repr__(self) -> str:
        """Links between particles and with walls, and the rule that made them."""
        return (
            f"<ContactNetwork: {self.count} links of {self.packing.count} particles, {self.walls.size} with walls, "
            f"rule {self.rule}>"
        )

    @property
    def count(self) -> int:
        """Number of links between particles."""
        return int(self.pairs.shape[0])

    @property
    def geometric(self) -> bool:
        """Whether the contacts are those that particles and walls cut out of each other, not prescribed ones."""
        return self.rule == "overlap"

    @property
    def coordination(self) -> float:
        """Mean number of particle contacts per particle, 2 m / n; walls and gaps do not count."""
        return 2.0 * int(np.count_nonzero(self.angles[:, 0])) / self.packing.count

    @cached_property
    def branches(self) -> Floats:
        """Branch vectors from the centre of i to the touched image of j, shape (m, d) [m]."""
        centers = self.packing.centers
        lengths = np.asarray(self.packing.box.lengths)
        return centers[self.pairs[:, 1]] - centers[self.pairs[:, 0]] + self.shifts * lengths

    @cached_property
    def reaches(self) -> Floats:
        """Half-width (radius) of every particle contact and then every wall contact, shape (m + w,) [m].

        R sin(alpha); where both sides of a contact have one, the smaller counts.
        """
        radii = self.packing.radii
        between = (radii[self.pairs] * np.sin(self.angles)).min(axis=1, initial=np.inf)
        return np.concatenate([between, radii[self.wall_particles] * np.sin(self.wall_angles)])

    @cached_property
    def _totals(self) -> Floats:
        lumped = np.concatenate([self.lumped_resistances, self.wall_lumped_resistances])
        if self.area_resistances is None:
            return lumped
        return lumped + over_area(self.area_resistances, self.reaches, self.packing.dimension)

    @property
    def resistances(self) -> Floats:
        """Whole resistance of each particle contact, that over its area included, shape (m,) [K/W, in 2D m K/W]."""
        return self._totals[: self.count]

    @property
    def wall_resistances(self) -> Floats:
        """Whole resistance of each wall contact, that over its area included, shape (w,) [K/W, in 2D m K/W]."""
        return self._totals[self.count :]

    def walls_of(self, axis: int) -> Ints:
        """Row numbers of the contacts with the two walls normal to an axis."""
        return np.flatnonzero(self.walls // 2 == axis)

    def with_half_angle(self, half_angle: float) -> ContactNetwork:
        """The same contacts, all with one half-angle [rad] on either side."""
        check_half_angle(half_angle)
        return replace(
            self,
            angles=np.full_like(self.angles, half_angle),
            wall_angles=np.full_like(self.wall_angles, half_angle),
            rule="bonded" if self.geometric else self.rule,
        )

    def with_resistance(self, resistance: ArrayLike) -> ContactNetwork:
        """The same contacts with given resistances, each as one number; that over the contact area stays.

        Parameters
        ----------
        resistance : float or array_like, shape (m + w,) [K/W, in 2D m K/W]
            Of all contacts, or of each particle contact and then each wall contact.

        Raises
        ------
        InputError
            If a resistance is negative or not finite, or there is not one per contact.
        """
        values = _resistances(resistance, self.count + self.walls.size)
        return replace(self, lumped_resistances=values[: self.count], wall_lumped_resistances=values[self.count :])

    def with_area_resistance(self, area_resistance: ArrayLike) -> ContactNetwork:
        """The same contacts with a given resistance of a unit of contact area, in series with what they had.

        Parameters
        ----------
        area_resistance : float or array_like, shape (m + w,) [m2 K/W]
            Of all contacts, or of each particle contact and then each wall contact.

        Raises
        ------
        InputError
            As `with_resistance`; and if a contact that resists has no area.

        Notes
        -----
        The temperature jumps by r q, q the local heat flux. Method ``exact`` of disks resolves q over the contact; all
        other methods take the jump as uniform, so that the contact resists r/A. The area A of a contact is the chord
        2 R sin(alpha) of a disk per unit thickness and the disk pi (R sin(alpha))^2 of a sphere; where both sides of a
        contact have one, the smaller counts.
        """
        values = _resistances(area_resistance, self.count + self.walls.size)
        _resistances(over_area(values, self.reaches, self.packing.dimension), values.size)
        return replace(self, area_resistances=values if values.any() else None)

    def cut_measures(self, *, prescribed: bool = False) -> Floats:
        """Area (volume) of each particle less what its contacts cut off, shape (n,) [m2, in 3D m3].

        V = |ball| - sum_i of the segments (caps) beyond the contacts, walls of all kinds included; they are taken for
        disjoint, as contacts must be.

        Parameters
        ----------
        prescribed : bool
            Whether contacts of prescribed width cut too; geometric ones always do.
        """
        packing = self.packing
        if not (self.geometric or prescribed):
            return packing.measures
        owner = np.concatenate([self.pairs[:, 0], self.pairs[:, 1], self.wall_particles])
        alpha = np.concatenate([self.angles[:, 0], self.angles[:, 1], self.wall_angles])
        cut = np.bincount(owner, law_of(packing.dimension).cut(alpha), minlength=packing.count)
        return np.asarray(packing.measures - packing.radii**packing.dimension * cut)

    def select(self, contacts: Flags, wall_contacts: Flags) -> ContactNetwork:
        """The network of the marked links; the particles stay."""
        return replace(
            self,
            pairs=self.pairs[contacts],
            shifts=self.shifts[contacts],
            angles=self.angles[contacts],
            lumped_resistances=self.lumped_resistances[contacts],
            wall_particles=self.wall_particles[wall_contacts],
            walls=self.walls[wall_contacts],
            wall_angles=self.wall_angles[wall_contacts],
            wall_lumped_resistances=self.wall_lumped_resistances[wall_contacts],
            area_resistances=None
            if self.area_resistances is None
            else self.area_resistances[np.concatenate([contacts, wall_contacts])],
        )


def over_area(area_resistances: Floats, reaches: Floats, dimension: int) -> Floats:
    """Resistance r/A of contacts of half-width (radius) c, 0 where r is 0, shape (s,) [K/W, in 2D m K/W]."""
    resists = area_resistances > 0.0
    total = np.zeros_like(area_resistances)
    with np.errstate(divide="ignore"):
        total[resists] = area_resistances[resists] / ball_measure(reaches[resists], dimension - 1)
    return total


def _resistances(values: ArrayLike, size: int) -> Floats:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim and array.shape != (size,):
        raise InputError(
            f"the contact resistance must be one number or an array of shape ({size},), found {array.shape}"
        )
    bad = ~((array >= 0.0) & (array <= LARGEST))
    if bad.any():
        found = array[bad].flat[0]
        if np.isfinite(found) and found > 0.0:
            raise InputError(f"the contact resistance must be at most {LARGEST:g}, found {found:g}")
        raise InputError(f"the contact resistance must be >= 0 and finite, found {found:g}")
    return np.broadcast_to(array, (size,)).copy()


def check_half_angle(half_angle: float) -> None:
    """Refuse a contact half-angle [rad] below `NARROWEST`, or not below pi/2.

    Raises
    ------
    InputError
    """
    if not (np.isfinite(half_angle) and NARROWEST <= half_angle < 0.5 * np.pi):
        raise InputError(
            f"the contact half-angle must lie between {np.degrees(NARROWEST):g} and 90 degrees, 90 excluded, "
            f"found {np.degrees(half_angle):g} degrees"
        )
