"""Conductance of a contact from one particle's mean temperature to the other's."""

from __future__ import annotations

from etc_engine.arrays import Floats
from etc_engine.laws.by_dimension import self_resistance
from etc_engine.medium.conductivity import affine_conductivity
from etc_engine.medium.medium import Medium, check_conductors
from etc_engine.medium.sides import check_arcs, contact_sides


def contact_conductances(medium: Medium, law: str = "chord") -> tuple[Floats, Floats]:
    """Conductances of the contacts of a medium as resistances in series.

    C = 1/(h_ii/kappa_i + h_jj/kappa_j + R_c) between two particles, C = 1/(h_ii/kappa_i + R_c) at a wall.

    Parameters
    ----------
    medium : Medium
        With a contact network.
    law : str
        Which self-resistance h_ii a particle has, see `etc_engine.laws.by_dimension.self_resistance`.

    Returns
    -------
    contacts : ndarray, shape (m,) [W/K, in 2D W/(m K)]
        Heat flow per kelvin between the mean temperatures of two particles.
    walls : ndarray, shape (w,)
        Of each contact between a wall and a particle.

    Raises
    ------
    InputError
        If a conductivity is out of range or the law unknown.
    GeometryError
        If contacts of one particle overlap.

    References
    ----------
    Feng, Han, Owen 2009, Discrete thermal element modelling of heat conduction in particle systems:
    pipe-network model and transient analysis, Powder Technology (special issue), section 3.

    Examples
    --------
    >>> import numpy as np
    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.rules import bonded_contacts
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> pair = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    >>> contacts, walls = contact_conductances(Medium(pair, 1.0, bonded_contacts(pair, 0.1)))
    >>> bool(np.isclose(walls[0], 2.0 * contacts[0]))
    True
    """
    network, kappa, radii = medium.links, medium.conductivity, medium.packing.radii
    check_conductors(medium)
    check_arcs(contact_sides(network))
    own = self_resistance(network.angles, radii[network.pairs], medium.dimension, law)
    at_walls = self_resistance(network.wall_angles, radii[network.wall_particles], medium.dimension, law)
    between = (own / kappa[network.pairs]).sum(axis=1) + network.resistances
    return 1.0 / between, 1.0 / (at_walls / kappa[network.wall_particles] + network.wall_resistances)


def mean_field_conductivity(medium: Medium, law: str = "chord") -> float:
    """Mean conductivity over the axes if every particle follows the mean gradient [W/(m K)].

    k = (1/dV) sum_c C_c |b_c|^2 over the particle contacts; arguments and errors of `contact_conductances`.

    Notes
    -----
    An upper bound of the periodic pipe network, which joins particles at their mean temperatures through their
    self-resistances alone; an estimate, not a bound, for the discrete thermal element method.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.rules import bonded_contacts
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> disk = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0), (True, True)))
    >>> round(mean_field_conductivity(Medium(disk, 1.0, bonded_contacts(disk, 0.1))), 6)
    0.429587
    """
    return affine_conductivity(medium.box, medium.links.branches, contact_conductances(medium, law)[0])
