"""What a pipe network says about particles and contacts."""

from __future__ import annotations

import numpy as np

from etc_engine.engines.pipe.steady import find_law
from etc_engine.laws.by_dimension import self_resistance
from etc_engine.medium.field import ParticleField
from etc_engine.medium.links import LinkSolution
from etc_engine.medium.loads import driven_walls, wall_temperatures
from etc_engine.medium.medium import Medium
from etc_engine.medium.sides import contact_sides


def pipe_field(medium: Medium, method: str, solution: LinkSolution, load: int = 0) -> ParticleField:
    """Temperatures and heat flows of every particle and contact.

    A contact is as much warmer than its particle as the heat that it brings in says, Q h_ii.

    Parameters
    ----------
    medium : Medium
    method : str
        As in `etc_engine.engines.pipe.steady.pipe_conductivity`.
    solution : LinkSolution
    load : int
        Column of the solution.

    Returns
    -------
    ParticleField
    """
    network, kappa = medium.links, medium.conductivity
    sides = contact_sides(network)
    into = np.zeros(sides.nodes.size)
    flows, wall_flows = solution.flows[:, load], solution.wall_flows[:, load]
    into[sides.of_contacts] = np.stack([-flows, flows], axis=1)
    into[sides.of_walls] = -wall_flows
    own = self_resistance(sides.alpha, sides.radii[sides.particles], medium.dimension, find_law(method))
    rises = own / kappa[sides.particles] * into
    temperatures = solution.temperatures[:, load]
    face = temperatures[network.pairs[:, 0]] + rises[sides.of_contacts[:, 0]]
    drops = 0.5 * network.resistances * flows
    contact = face - drops
    at_wall = temperatures[network.wall_particles] + rises[sides.of_walls]
    at_wall -= network.wall_resistances * wall_flows
    driven = driven_walls(network, solution.axes)
    at_wall[driven] = wall_temperatures(network.walls[driven])
    return ParticleField(
        medium=medium,
        axis=solution.axes[load],
        sides=sides,
        particle_temperatures=temperatures,
        contact_temperatures=contact,
        wall_temperatures=at_wall,
        contact_flows=flows,
        wall_flows=wall_flows,
        face_temperatures=contact[:, None] + drops[:, None] * np.array([1.0, -1.0]),
        flow_modes=into[:, None],
    )
