"""Contact rules from load: widths by Hertz, from overlaps, from a mean-field pressure, from forces or areas of a run.

Spheres touch in a disk of radius c, disks in a strip of half-width c; sin alpha_i = c/R_i on either side. Walls may
have separate elastic constants; without them those of the particles are used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from etc_engine.arrays import Floats
from etc_engine.errors import GeometryError, InputError
from etc_engine.laws.contact import (
    effective_radius,
    mean_pressure,
    pair_modulus,
    radius_from_area,
    reach_from_force,
    reach_from_overlap,
)
from etc_engine.laws.roughness import Roughness, area_resistance
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.touching import (
    ROUND_OFF_OVERLAP,
    Neighbors,
    closest_neighbors,
    find_neighbors,
    wall_distances_within,
)
from etc_engine.packing.neighbors import neighbor_pairs
from etc_engine.packing.particles import ParticlePacking


@dataclass(frozen=True, eq=False)
class Stiffness:
    """Elastic constants of particles and walls.

    Parameters
    ----------
    youngs_modulus : float or ndarray, shape (n,) [Pa]
        Of all particles, or of each.
    poisson_ratio : float or ndarray, shape (n,) [-]
    wall_youngs_modulus, wall_poisson_ratio : float, optional
        Of the walls; those of the touching particle where left out.

    Raises
    ------
    InputError
        If a modulus is not positive (infinite is rigid), or a Poisson ratio is not in (-1, 0.5].
    """

    youngs_modulus: ArrayLike
    poisson_ratio: ArrayLike
    wall_youngs_modulus: float | None = None
    wall_poisson_ratio: float | None = None

    def __post_init__(self) -> None:
        moduli = np.atleast_1d(np.asarray(self.youngs_modulus, dtype=np.float64))
        ratios = np.atleast_1d(np.asarray(self.poisson_ratio, dtype=np.float64))
        if self.wall_youngs_modulus is not None:
            moduli = np.append(moduli, self.wall_youngs_modulus)
        if self.wall_poisson_ratio is not None:
            ratios = np.append(ratios, self.wall_poisson_ratio)
        if not (moduli > 0.0).all():
            raise InputError(f"Young's modulus must be positive [Pa], found {moduli[~(moduli > 0.0)][0]:g}")
        good = (ratios > -1.0) & (ratios <= 0.5)
        if not good.all():
            raise InputError(f"Poisson's ratio must lie in (-1, 0.5], found {ratios[~good][0]:g}")

    def moduli(self, near: Neighbors) -> Floats:
        """Effective modulus E* of every pair, then of every wall contact, shape (m + w,) [Pa]."""
        n = near.packing.count
        e = np.broadcast_to(np.asarray(self.youngs_modulus, dtype=np.float64), (n,))
        nu = np.broadcast_to(np.asarray(self.poisson_ratio, dtype=np.float64), (n,))
        i, j = near.pairs.T
        at = near.wall_particles
        wall_e = e[at] if self.wall_youngs_modulus is None else np.full(at.size, self.wall_youngs_modulus)
        wall_nu = nu[at] if self.wall_poisson_ratio is None else np.full(at.size, self.wall_poisson_ratio)
        return np.concatenate([pair_modulus(e[i], nu[i], e[j], nu[j]), pair_modulus(e[at], nu[at], wall_e, wall_nu)])


def effective_radii(near: Neighbors) -> Floats:
    """Effective radius R* of every pair, then of every wall contact, shape (m + w,) [m]."""
    radii = near.packing.radii
    pairs = effective_radius(radii[near.pairs[:, 0]], radii[near.pairs[:, 1]])
    return np.concatenate([pairs, radii[near.wall_particles]])


def hertz_contacts(
    packing: ParticlePacking,
    youngs_modulus: ArrayLike | None = None,
    poisson_ratio: ArrayLike | None = None,
    *,
    wall_youngs_modulus: float | None = None,
    wall_poisson_ratio: float | None = None,
    simulated_modulus: float | None = None,
) -> ContactNetwork:
    r"""Contacts of overlapping particles, as wide as Hertz's law makes them: c = sqrt(R* delta).

    Parameters
    ----------
    packing : ParticlePacking
        Positions of a DEM run.
    youngs_modulus, poisson_ratio : float or array_like, optional
        Of the material, as in `Stiffness`; only needed where the run was softened.
    wall_youngs_modulus, wall_poisson_ratio : float, optional
    simulated_modulus : float, optional [Pa]
        Young's modulus that the run used for all its contacts, with the Poisson ratio of the material. Its forces
        are kept, and the width is that of the true material under them.

    Returns
    -------
    ContactNetwork

    Raises
    ------
    InputError
        If a softened run comes without the constants of the material.
    GeometryError
        If a contact is as wide as a particle.

    Notes
    -----
    Overlaps below 1e-10 of the mean radius count as touching points, which conduct nothing.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> spheres = ParticlePacking([[0.3, 0.5, 0.5], [0.698, 0.5, 0.5]], [0.2, 0.2], Box((1.0, 1.0, 1.0)))
    >>> float((0.2 * np.sin(hertz_contacts(spheres).angles[0, 0])).round(6))
    0.014142
    """
    near, overlaps = _overlapping(packing)
    softening: ArrayLike = 1.0
    if simulated_modulus is not None:
        if youngs_modulus is None or poisson_ratio is None:
            raise InputError(
                "a softened run (simulated_modulus) needs the youngs_modulus and the poisson_ratio of the material"
            )
        stiffness = Stiffness(youngs_modulus, poisson_ratio, wall_youngs_modulus, wall_poisson_ratio)
        soft = Stiffness(simulated_modulus, stiffness.poisson_ratio)
        softening = soft.moduli(near) / stiffness.moduli(near)
    widths = reach_from_overlap(overlaps, effective_radii(near), packing.dimension, softening)
    return _network(near, widths, "hertz")


def load_contacts(
    packing: ParticlePacking,
    load: float,
    youngs_modulus: ArrayLike,
    poisson_ratio: ArrayLike,
    *,
    wall_youngs_modulus: float | None = None,
    wall_poisson_ratio: float | None = None,
    bond_gap: float = 1e-6,
    coordination: float | None = None,
) -> ContactNetwork:
    r"""Contacts of particles that nearly touch, all under the mean force of a bed at a pressure.

    .. math:: F = \frac{d\, p V}{\sum_c \ell_c}

    with the branch length l_c of every contact (centre to wall at walls): the virial of equal forces. For equal
    touching spheres it is :math:`4 \pi p R^2/(\phi Z)`.

    Parameters
    ----------
    packing : ParticlePacking
    load : float [Pa]
        Mean stress p carried by the contacts (force per length over length in 2D).
    youngs_modulus, poisson_ratio, wall_youngs_modulus, wall_poisson_ratio
        As in `Stiffness`.
    bond_gap : float
        Largest gap of a contact, in mean radii of the pair.
    coordination : float, optional
        Instead of the gap: the mean coordination number, met by the closest pairs.

    Returns
    -------
    ContactNetwork

    Raises
    ------
    InputError
        If the load is not positive, or nothing touches.

    Notes
    -----
    An estimate: the forces of a real bed are spread about their mean.
    """
    if not (np.isfinite(load) and load > 0.0):
        raise InputError(f"the load of a bed must be positive and finite [Pa], found {load:g}")
    stiffness = Stiffness(youngs_modulus, poisson_ratio, wall_youngs_modulus, wall_poisson_ratio)
    near = find_neighbors(packing, bond_gap) if coordination is None else closest_neighbors(packing, coordination)
    if not len(near.pairs):
        raise InputError(
            f"no particles are closer than a gap of {bond_gap:g} mean radii: nothing carries the load; raise bond_gap, "
            "or give a coordination number"
        )
    lengths = np.asarray(packing.box.lengths)
    centers = packing.centers
    branches = centers[near.pairs[:, 1]] - centers[near.pairs[:, 0]] + near.shifts * lengths
    arms = float(np.linalg.norm(branches, axis=1).sum() + packing.radii[near.wall_particles].sum())
    force = packing.dimension * load * float(np.prod(lengths)) / arms
    widths = reach_from_force(force, effective_radii(near), stiffness.moduli(near), packing.dimension)
    return _network(near, widths, "load")


def force_contacts(near: Neighbors, forces: ArrayLike, stiffness: Stiffness) -> ContactNetwork:
    """Contacts as wide as the normal forces of a run press them.

    Parameters
    ----------
    near : Neighbors
        Who touches whom.
    forces : array_like, shape (m + w,) [N, in 2D N/m]
        Compressive normal force of every pair, then of every wall contact; a tensile one (negative) opens the contact.
    stiffness : Stiffness

    Returns
    -------
    ContactNetwork
    """
    values = _per_contact(near, forces, "force")
    widths = reach_from_force(values, effective_radii(near), stiffness.moduli(near), near.packing.dimension)
    return _network(near, widths, "force")


def area_contacts(near: Neighbors, areas: ArrayLike, softening: float = 1.0) -> ContactNetwork:
    """Contacts of the areas that a run gives.

    Parameters
    ----------
    near : Neighbors
        Who touches whom; spheres.
    areas : array_like, shape (m + w,) [m2]
        Contact area of every pair, then of every wall contact.
    softening : float [-]
        Modulus E* of the run over that of the material; areas scale by its power 2/3.

    Returns
    -------
    ContactNetwork
    """
    if near.packing.dimension != 3:
        raise InputError("contact areas are for spheres, found a packing in two dimensions")
    widths = radius_from_area(_per_contact(near, areas, "area")) * float(np.cbrt(softening))
    return _network(near, widths, "area")


def with_roughness(
    network: ContactNetwork,
    roughness: Roughness,
    stiffness: Stiffness,
    conductivity: Floats,
    gas: tuple[float, float] = (0.0, 0.0),
) -> ContactNetwork:
    """The same contacts with the area resistance of rough surfaces under the mean pressure of each.

    Parameters
    ----------
    network : ContactNetwork
        Of a rule from load: the pressures follow from its widths.
    roughness : Roughness
    stiffness : Stiffness
    conductivity : ndarray, shape (n,) [W/(m K)]
        Of each particle; walls are taken as the particle they touch.
    gas : (float, float)
        Conductivity [W/(m K)] of the gas in the micro-gap and the sum of both jump lengths [m].

    Returns
    -------
    ContactNetwork
    """
    near = Neighbors(network.packing, network.pairs, network.shifts, network.wall_particles, network.walls)
    radii = near.packing.radii
    reach = np.concatenate(
        [
            (radii[near.pairs] * np.sin(network.angles)).min(axis=1, initial=np.inf),
            radii[near.wall_particles] * np.sin(network.wall_angles),
        ]
    )
    pressure = mean_pressure(reach, effective_radii(near), stiffness.moduli(near), near.packing.dimension)
    k_i, k_j = conductivity[near.pairs[:, 0]], conductivity[near.pairs[:, 1]]
    harmonic = np.concatenate([2.0 * k_i * k_j / (k_i + k_j), conductivity[near.wall_particles]])
    open_contact = pressure > 0.0
    resistance = np.zeros(pressure.size)
    resistance[open_contact] = area_resistance(pressure[open_contact], harmonic[open_contact], roughness, *gas)
    return network.with_area_resistance(resistance)


def _overlapping(packing: ParticlePacking) -> tuple[Neighbors, Floats]:
    """Pairs and walls that overlap, and by how much [m]."""
    near = neighbor_pairs(packing)
    mean = 0.5 * packing.radii[near.pairs].sum(axis=1)
    touching = near.gaps < -ROUND_OFF_OVERLAP * mean
    at, walls, distances = wall_distances_within(packing, ROUND_OFF_OVERLAP, -1.0)
    found = Neighbors(packing, near.pairs[touching], near.shifts[touching], at, walls)
    return found, np.concatenate([-near.gaps[touching], packing.radii[at] - distances])


def _per_contact(near: Neighbors, values: ArrayLike, name: str) -> Floats:
    array = np.asarray(values, dtype=np.float64)
    size = len(near.pairs) + near.walls.size
    if array.shape != (size,):
        raise InputError(f"there must be one {name} for each of {size} contacts, found shape {array.shape}")
    if not np.isfinite(array).all():
        raise InputError(f"a contact {name} is not finite")
    return array


def _network(near: Neighbors, widths: Floats, rule: str) -> ContactNetwork:
    """Contacts of given half-widths, those without a width left out."""
    m = len(near.pairs)
    radii = near.packing.radii
    closed, at_wall = widths[:m] > 0.0, widths[m:] > 0.0
    pairs, wall_particles = near.pairs[closed], near.wall_particles[at_wall]
    sines = widths[:m][closed, None] / radii[pairs]
    wall_sines = widths[m:][at_wall] / radii[wall_particles]
    widest = max(sines.max(initial=0.0), wall_sines.max(initial=0.0))
    if widest >= 1.0:
        raise GeometryError(
            f"a contact of rule {rule} is {widest:.3g} times as wide as its particle: Hertz's law is only valid with "
            "contacts much smaller than the particles; check the units, the load and the modulus"
        )
    none, none_at_walls = np.zeros(len(pairs)), np.zeros(len(wall_particles))
    return ContactNetwork(
        near.packing,
        pairs,
        near.shifts[closed],
        np.arcsin(sines),
        none,
        wall_particles,
        near.walls[at_wall],
        np.arcsin(wall_sines),
        none_at_walls,
        rule,
    )
