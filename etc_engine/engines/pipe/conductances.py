r"""Conductance of a contact as two pipes in series, from one particle's mean temperature to the other's."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from etc_engine.engines.dtem.steady import make_material
from etc_engine.errors import InputError
from etc_engine.laws.by_dimension import law_of, length_scales
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.sides import check_arcs, contact_sides

PIPE_RESISTANCES = {"chord": "chord", "uniform": "standard", "standard": "standard", "enhanced": "enhanced"}
"""Words for the resistance of a pipe, and the method whose self-resistance h_ii it is."""


def pipe_conductances(
    network: ContactNetwork,
    *,
    resistance: str = "chord",
    conductivity: ArrayLike = 1.0,
    contact_resistance: ArrayLike = 0.0,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Conductances of the contacts of a network.

    C = 1/(h_ii + h_jj + R_c) between two particles, C = 1/(h_ii + R_c) at a wall.

    Parameters
    ----------
    network : ContactNetwork
        Of disks or spheres.
    resistance : str
        ``chord`` or ``uniform``: which h_ii a pipe has.
    conductivity : float or array_like, shape (n,) [W/(m K)]
        Of all particles, or of each.
    contact_resistance : float or array_like, shape (m + w,) [m K/W]
        Total resistance of a contact per unit thickness; of all, or of each particle contact and then each
        wall contact.

    Returns
    -------
    contacts : ndarray, shape (m,) [W/(m K)]
        Heat flow per unit thickness and kelvin between the mean temperatures of two particles.
    walls : ndarray, shape (w,) [W/(m K)]
        Likewise between a wall and a particle.

    Raises
    ------
    InputError
        If an argument is not understood.
    GeometryError
        If contact arcs of one particle overlap.

    References
    ----------
    Feng, Han, Owen 2009, Discrete thermal element modelling of heat conduction in particle systems:
    pipe-network model and transient analysis, Powder Technology (special issue), section 3.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.rules import bonded_contacts
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> pair = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    >>> contacts, walls = pipe_conductances(bonded_contacts(pair, 0.1))
    >>> bool(np.isclose(walls[0], 2.0 * contacts[0]))
    True
    """
    if resistance not in PIPE_RESISTANCES:
        raise InputError(f"unknown pipe resistance {resistance!r}: expected chord or uniform")
    material = make_material(network, conductivity, contact_resistance)
    check_arcs(contact_sides(network))
    dimension = network.packing.dimension
    own = law_of(dimension).self_resistances[PIPE_RESISTANCES[resistance]]
    m, kappa = network.count, material.conductivity * length_scales(network.packing.radii, dimension)
    between = (own(network.angles) / kappa[network.pairs]).sum(axis=1) + material.contact_resistance[:m]
    at_wall = own(network.wall_angles) / kappa[network.wall_particles] + material.contact_resistance[m:]
    return 1.0 / between, 1.0 / at_wall
