"""Heat flows through the contacts of a pipe network at a time of its march."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from etc_engine.engines.pipe.conductances import pipe_conductances
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.sides import ContactSides


def pipe_contact_flows(
    network: ContactNetwork,
    sides: ContactSides,
    particle_temperatures: NDArray[np.float64],
    wall_temperatures: NDArray[np.float64],
    *,
    resistance: str = "chord",
    conductivity: ArrayLike = 1.0,
    contact_resistance: ArrayLike = 0.0,
) -> NDArray[np.float64]:
    """Heat flow into the particle at each contact side, C (T_j - T_i), shape (s,) [W/m].

    Parameters
    ----------
    network : ContactNetwork
    sides : ContactSides
        Of all its contacts.
    particle_temperatures : ndarray, shape (n,) [K]
    wall_temperatures : ndarray, shape (walls,) [K]
        NaN where a wall is insulated: no heat flows there.
    resistance, conductivity, contact_resistance
        As in `etc_engine.engines.pipe.conductances.pipe_conductances`.

    Examples
    --------
    >>> from etc_engine import Box, ParticlePacking, bonded_contacts
    >>> from etc_engine.laws.disk import chord_resistance
    >>> from etc_engine.medium.sides import contact_sides
    >>> pair = bonded_contacts(ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0))), 0.1)
    >>> flows = pipe_contact_flows(pair, contact_sides(pair), np.array([1.0, 0.0]), np.full(4, np.nan))
    >>> flows.sum().item(), bool(np.isclose(2.0 * chord_resistance(0.1) * flows.max(), 1.0))
    (0.0, True)
    """
    between, at_wall = pipe_conductances(
        network, resistance=resistance, conductivity=conductivity, contact_resistance=contact_resistance
    )
    i, j = network.pairs.T
    flows = np.zeros(sides.nodes.size)
    heat = between * (particle_temperatures[j] - particle_temperatures[i])
    flows[sides.of_contacts] = np.stack([heat, -heat], axis=1)
    from_wall = at_wall * (wall_temperatures[network.walls] - particle_temperatures[network.wall_particles])
    flows[sides.of_walls] = np.nan_to_num(from_wall)
    return flows
