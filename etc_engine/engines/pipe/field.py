"""What a pipe network says about contacts, in the terms of the discrete thermal element method."""

from __future__ import annotations

import numpy as np

from etc_engine.engines.dtem.field import ParticleField
from etc_engine.engines.dtem.steady import driven_walls
from etc_engine.engines.pipe.conductances import PIPE_RESISTANCES
from etc_engine.engines.pipe.steady import PipeSolution
from etc_engine.laws.by_dimension import law_of, length_scales
from etc_engine.medium.sides import contact_sides


def pipe_field(solution: PipeSolution, load: int = 0) -> ParticleField:
    """Temperatures and heat flows of every particle and contact, as those of the discrete thermal element method.

    A contact is as much warmer than its particle as the heat it brings in, Q h_ii, says.

    Parameters
    ----------
    solution : PipeSolution
    load : int
        Column of the solution.

    Returns
    -------
    ParticleField
    """
    network, material, m = solution.network, solution.material, solution.network.count
    sides = contact_sides(network)
    own = law_of(sides.dimension).self_resistances[PIPE_RESISTANCES[solution.resistance]]
    scales = material.conductivity * length_scales(sides.radii, sides.dimension)
    into = np.zeros(sides.nodes.size)
    flows, wall_flows = solution.contact_flows[:, load], solution.wall_flows[:, load]
    into[sides.of_contacts] = np.stack([-flows, flows], axis=1)
    into[sides.of_walls] = -wall_flows
    rises = own(sides.alpha) / scales[sides.particles] * into
    temperatures = solution.temperatures[:, load]
    face = temperatures[network.pairs[:, 0]] + rises[sides.of_contacts[:, 0]]
    drops = 0.5 * material.contact_resistance[:m] * flows
    contact = face - drops
    at_wall = temperatures[network.wall_particles] + rises[sides.of_walls]
    at_wall -= material.contact_resistance[m:] * wall_flows
    driven = driven_walls(network, solution.axes)
    at_wall[driven] = 1.0 - network.walls[driven] % 2
    return ParticleField(
        sides=sides,
        particle_temperatures=temperatures,
        contact_temperatures=contact,
        wall_temperatures=at_wall,
        contact_flows=flows,
        wall_flows=wall_flows,
        face_temperatures=contact[:, None] + drops[:, None] * np.array([1.0, -1.0]),
        flow_modes=into[:, None],
    )
