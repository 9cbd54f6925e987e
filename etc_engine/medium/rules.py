"""Contact rules: which particles touch, and through how wide a contact. A rule is one function."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from etc_engine.errors import GeometryError, InputError
from etc_engine.medium.loaded import hertz_contacts, load_contacts
from etc_engine.medium.network import ContactNetwork, check_half_angle
from etc_engine.medium.touching import (
    ROUND_OFF_OVERLAP,
    Neighbors,
    closest_neighbors,
    find_neighbors,
    wall_distances_within,
)
from etc_engine.packing.neighbors import neighbor_pairs
from etc_engine.packing.particles import ParticlePacking


def overlap_contacts(packing: ParticlePacking) -> ContactNetwork:
    """Contacts of overlapping particles and of particles that reach over a wall; geometry sets the arcs.

    cos alpha_i = (d^2 + R_i^2 - R_j^2)/(2 d R_i), and with i and j exchanged; at a wall cos alpha = distance/R.

    Parameters
    ----------
    packing : ParticlePacking
        Overlapping disks or spheres.

    Returns
    -------
    ContactNetwork

    Raises
    ------
    GeometryError
        If two centres coincide, a particle lies inside another, or an arc reaches a half-angle of 90 degrees.

    Notes
    -----
    Overlaps below 1e-10 of the mean radius count as touching points, which conduct nothing.

    References
    ----------
    Feng, Han, Li, Owen 2008, section 3.4, doi:10.1016/j.jcp.2008.01.031.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> packing = ParticlePacking([[0.3, 0.5], [0.7, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    >>> overlap_contacts(packing).angles.round(4)
    array([[0.6435, 0.6435]])
    """
    near = neighbor_pairs(packing)
    radii = packing.radii
    touching = near.gaps < -ROUND_OFF_OVERLAP * 0.5 * radii[near.pairs].sum(axis=1)
    pairs, shifts = near.pairs[touching], near.shifts[touching]
    r_i, r_j = radii[pairs[:, 0]], radii[pairs[:, 1]]
    distance = (r_i + r_j) + near.gaps[touching]
    swallowed = distance <= np.abs(r_i - r_j)
    if swallowed.any():
        i, j = pairs[np.flatnonzero(swallowed)[0]]
        raise GeometryError(
            f"particles {i} and {j}: one lies inside the other (radii {radii[i]:.6g} and {radii[j]:.6g}, centres "
            f"{distance[swallowed][0]:.6g} apart); remove one of them"
        )
    angles = np.stack([_chord_angle(r_i, r_j, distance), _chord_angle(r_j, r_i, distance)], axis=1)
    wide = angles >= 0.5 * np.pi
    if wide.any():
        row, side = (int(v[0]) for v in np.nonzero(wide))
        raise GeometryError(
            f"particle {pairs[row, side]} overlaps particle {pairs[row, 1 - side]} so far that the contact half-angle "
            f"is {np.degrees(angles[row, side]):.2f} degrees; it must be below 90"
        )
    return perfect_contacts(packing, (pairs, shifts, angles), overlap_walls(packing), "overlap")


def overlap_walls(packing: ParticlePacking) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Contacts that walls cut out of particles: (particle, wall, half-angle), cos alpha = distance/R."""
    particles, walls, distances = wall_distances_within(packing, ROUND_OFF_OVERLAP, -1.0)
    radii = packing.radii[particles]
    angles = 2.0 * np.arcsin(np.sqrt(np.clip((radii - distances) / (2.0 * radii), 0.0, 1.0)))
    return particles, walls, angles


def bonded_contacts(packing: ParticlePacking, half_angle: float, bond_gap: float = 1e-6) -> ContactNetwork:
    """Cemented contacts: every pair closer than a gap is bonded through an arc of prescribed half-angle.

    Parameters
    ----------
    packing : ParticlePacking
        Touching, or nearly touching, particles.
    half_angle : float [rad]
        Half-angle of every contact arc, 0 < half_angle < pi/2.
    bond_gap : float
        Largest bonded gap between two surfaces, in mean radii of the pair (at walls: in radii).

    Returns
    -------
    ContactNetwork

    Raises
    ------
    InputError
        If the half-angle or the gap is out of range.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> packing = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    >>> network = bonded_contacts(packing, 0.1)
    >>> network.count, network.walls.tolist()
    (1, [0, 1])
    """
    if not (np.isfinite(bond_gap) and bond_gap >= 0.0):
        raise InputError(f"the bond gap must be a number of mean radii >= 0, found {bond_gap}")
    return _bonded(find_neighbors(packing, bond_gap), half_angle, "bonded")


def radius_contacts(packing: ParticlePacking, contact_radius: float, bond_gap: float = 1e-6) -> ContactNetwork:
    """Bonded contacts of one radius c on particles of all sizes: sin alpha = c/R.

    Parameters
    ----------
    packing : ParticlePacking
    contact_radius : float [m]
        Radius of every contact disk (of disks: half the width of the chord), below that of the smallest particle.
    bond_gap : float
        As in `bonded_contacts`.

    Returns
    -------
    ContactNetwork

    Raises
    ------
    InputError
        If the radius or the gap is out of range.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> packing = ParticlePacking([[0.2, 0.5], [0.7, 0.5]], [0.2, 0.3], Box((1.0, 1.0)))
    >>> radius_contacts(packing, 0.1).angles.round(4)
    array([[0.5236, 0.3398]])
    """
    smallest = float(packing.radii.min())
    if not 0.0 < contact_radius < smallest:
        raise InputError(
            f"the contact radius must be positive and below the smallest particle's radius {smallest:g} m, found "
            f"{contact_radius:g} m"
        )
    network = bonded_contacts(packing, 0.1, bond_gap)
    angles = np.arcsin(contact_radius / packing.radii)
    check_half_angle(float(angles.min()))
    return replace(network, angles=angles[network.pairs], wall_angles=angles[network.wall_particles], rule="radius")


def coordination_contacts(packing: ParticlePacking, half_angle: float, coordination: float) -> ContactNetwork:
    """Bonded contacts of the closest pairs, up to a mean coordination number.

    The bond gap is the relative gap of the (Z n / 2)-th closest pair.

    Parameters
    ----------
    packing : ParticlePacking
    half_angle : float [rad]
        Half-angle of every contact arc.
    coordination : float
        Mean coordination number Z wanted, met to the nearest contact.

    Returns
    -------
    ContactNetwork
        Walls are bonded within the same gap.

    Raises
    ------
    InputError
        If Z is not positive, or there are not as many pairs within two mean radii.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> packing = ParticlePacking([[0.2, 0.5], [0.5, 0.5], [0.9, 0.5]], [0.1] * 3, Box((1.0, 1.0)))
    >>> coordination_contacts(packing, 0.1, 2 / 3).pairs.tolist()
    [[0, 1]]
    """
    return _bonded(closest_neighbors(packing, coordination), half_angle, "coordination")


BONDS = "the contacts are bonds, wider than the shape of the particles makes them"
FORCES = "the width of the contacts follows from forces, not from the shape of the particles"


@dataclass(frozen=True)
class Rule:
    """A contact rule by its word.

    Parameters
    ----------
    contacts : callable
        (packing, **values) -> ContactNetwork.
    keys : mapping of str to str
        Key of a study -> argument of the function, angles in radians.
    optional : tuple of str
        Keys that may be left out.
    dimensions : tuple of int
    local : bool
        Whether a contact depends on its two particles alone, no farther apart than overlap or ``bond_gap`` says.
    radii_may_grow : bool
        Whether packers may let particles overlap to reach a density: the rule takes its contacts from overlaps.
    geometric : bool
        Whether the shape of overlapping particles alone makes the contacts, so that other radii make other contacts.
    roughness : bool
        Whether the force of a contact is known, from which the resistance of rough surfaces follows.
    unbound : str
        Why rigorous bounds of two phases do not bind what the rule makes; empty if they do.
    """

    contacts: Callable[..., ContactNetwork]
    keys: Mapping[str, str]
    optional: tuple[str, ...] = ()
    dimensions: tuple[int, ...] = (2, 3)
    radii_may_grow: bool = False
    local: bool = False
    geometric: bool = False
    roughness: bool = False
    unbound: str = BONDS

    @property
    def takes_gap(self) -> bool:
        """Whether the rule joins particles across a gap that a study gives."""
        return "bond_gap" in self.keys

    @property
    def needs(self) -> tuple[str, ...]:
        """Keys that a study has to give."""
        return tuple(key for key in self.keys if key not in self.optional)


WALL = ("wall_youngs_modulus", "wall_poisson_ratio")
ELASTIC = {name: name for name in ("youngs_modulus", "poisson_ratio", *WALL)}
"""Elastic constants of the particles and of the walls, as a study and as a rule spells them."""

RULES: Mapping[str, Rule] = {
    "overlap": Rule(overlap_contacts, {}, radii_may_grow=True, local=True, geometric=True, unbound=""),
    "bonded": Rule(bonded_contacts, {"contact_angle": "half_angle", "bond_gap": "bond_gap"}, local=True),
    "radius": Rule(radius_contacts, {"contact_radius": "contact_radius", "bond_gap": "bond_gap"}, local=True),
    "coordination": Rule(coordination_contacts, {"contact_angle": "half_angle", "coordination": "coordination"}),
    "hertz": Rule(
        hertz_contacts,
        {**ELASTIC, "simulated_modulus": "simulated_modulus"},
        (*ELASTIC, "simulated_modulus"),
        radii_may_grow=True,
        roughness=True,
        unbound=FORCES,
    ),
    "load": Rule(
        load_contacts,
        {"load": "load", **ELASTIC, "bond_gap": "bond_gap", "coordination": "coordination"},
        (*WALL, "coordination"),
        roughness=True,
        unbound=FORCES,
    ),
}


def find_rule(word: str) -> Rule:
    """The rule of that word.

    Raises
    ------
    InputError
        If there is none.
    """
    if word not in RULES:
        raise InputError(f"unknown contact rule {word!r}: expected {', '.join(RULES)}")
    return RULES[word]


def _bonded(near: Neighbors, half_angle: float, rule: str) -> ContactNetwork:
    """Contacts of one half-angle between all neighbours."""
    check_half_angle(half_angle)
    links = near.pairs, near.shifts, np.full(near.pairs.shape, float(half_angle))
    at_walls = near.wall_particles, near.walls, np.full(near.walls.size, float(half_angle))
    return perfect_contacts(near.packing, links, at_walls, rule)


def perfect_contacts(
    packing: ParticlePacking,
    links: tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]],
    at_walls: tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]],
    rule: str,
) -> ContactNetwork:
    """A network of perfect contacts: (pairs, shifts, angles) and (particles, walls, angles)."""
    none, none_at_walls = np.zeros(len(links[0])), np.zeros(len(at_walls[0]))
    return ContactNetwork(packing, *links, none, *at_walls, none_at_walls, rule)


def _chord_angle(
    radius: NDArray[np.float64], other: NDArray[np.float64], distance: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Half-angle of the common chord seen from the disk of the first radius.

    1 - cos alpha = (R_j - (d - R_i)) (R_j + (d - R_i)) / (2 d R_i), which keeps its digits for a slight overlap.
    """
    versine = (other - (distance - radius)) * (other + (distance - radius)) / (2.0 * distance * radius)
    return 2.0 * np.arcsin(np.sqrt(np.clip(0.5 * versine, 0.0, 1.0)))
