r"""Heat conduction in time through the pipe network of a packing.

Every particle stores heat at its mean temperature, and every contact is a pipe between two of them:

    rho c V_i dT_i/dt = sum_c C_c (T_j - T_i) + C_w (T_wall - T_i) + source_i,

with V_i the measure of the particle less what its contacts cut off.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.engines.pipe.steady import find_law
from etc_engine.medium.conductances import contact_conductances
from etc_engine.medium.links import laplacian
from etc_engine.medium.medium import Medium
from etc_engine.medium.sides import contact_sides
from etc_engine.medium.transient import ParticleSystem, Source, joined_walls, particle_capacities, state_source
from etc_engine.medium.wall_nodes import heat_system, number_nodes
from etc_engine.medium.walls import WallCondition, wall_conditions


def pipe_system(
    medium: Medium,
    walls: Mapping[str, WallCondition],
    *,
    method: str = "chord",
    source: Source = 0.0,
    capacities: Floats | None = None,
) -> ParticleSystem:
    """Pipe network of a packing with storage, and the conditions at the walls of its box.

    Parameters
    ----------
    medium : Medium
        With contacts and heat capacities. All particles take part; one without contacts keeps its heat.
    walls : mapping of str to condition
        By the names of `etc_engine.medium.walls.WALLS`; a wall that is not named is insulated.
    method : str
        As in `etc_engine.engines.pipe.steady.pipe_conductivity`.
    source : float, array_like, shape (n,), or callable of t [W, in 2D W/m]
        Heat set free in each particle.
    capacities : ndarray, shape (n,), optional [J/K, in 2D J/(m K)]
        Of the particles; rho c times what their contacts leave of them by default.

    Returns
    -------
    ParticleSystem

    Raises
    ------
    InputError
        If a value or a wall is not understood, or a wall with a heat flux touches nothing.
    GeometryError
        If contacts of one particle overlap.

    Notes
    -----
    A particle heats up as a whole: times below R^2 rho c / kappa are out of reach.

    References
    ----------
    Feng, Han, Owen 2009, Discrete thermal element modelling of heat conduction in particle systems:
    pipe-network model and transient analysis, Powder Technology (special issue).

    Examples
    --------
    >>> from etc_engine import Box, ParticlePacking, bonded_contacts
    >>> from etc_engine.medium.walls import FixedTemperature
    >>> from etc_engine.solvers.marching import march
    >>> disks = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    >>> medium = Medium(disks, 1.0, bonded_contacts(disks, 0.2), heat_capacity=1.0)
    >>> pipes = pipe_system(medium, {"left": FixedTemperature(1.0)}, source=[0.0, 0.1])
    >>> *_, late = march(pipes.heat, pipes.initial(0.0), [0.0, 40.0], steps=200)
    >>> bool(pipes.particle_temperatures(late.temperatures)[1] > 1.0), round(float(late.heat[-1]), 9)
    (True, 4.0)
    """
    network, n = medium.links, medium.packing.count
    conditions = wall_conditions(medium.box, walls)
    law = find_law(method)
    between, at_walls = contact_conductances(medium, law)
    kept = joined_walls(network.walls, conditions)
    reduced, at_walls = network.select(np.ones(network.count, dtype=np.bool_), kept), at_walls[kept]
    stored = particle_capacities(medium, capacities, cut=law == "chord")
    w = reduced.walls.size
    nodes = number_nodes(medium.box, reduced.walls, conditions, states=n)
    ends = np.stack([np.arange(w), w + reduced.wall_particles], axis=1)
    whole = laplacian(
        w + n,
        np.concatenate([w + network.pairs, ends]),
        np.concatenate([between, at_walls]),
        np.zeros(0, dtype=np.int64),
        np.zeros(0),
    )
    system = heat_system(whole, nodes, stored, state_source(source, n, 1))
    sides = contact_sides(reduced)

    def flows(time: float, unknowns: Floats) -> Floats:
        """C (T_j - T_i) into i."""
        temperatures = made.node_temperatures(time, unknowns)
        particles = temperatures[w:]
        i, j = network.pairs.T
        heat = between * (particles[j] - particles[i])
        into = np.zeros(sides.nodes.size)
        into[sides.of_contacts] = np.stack([heat, -heat], axis=1)
        into[sides.of_walls] = at_walls * (temperatures[:w] - particles[reduced.wall_particles])
        return into

    made = ParticleSystem(system, medium, nodes, sides, np.flatnonzero(kept), flows)
    return made
