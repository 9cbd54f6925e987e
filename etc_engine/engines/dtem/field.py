"""Temperatures and heat flows of every particle and contact of a steady solution, dead ends included."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.engines.dtem.interior import temperatures_inside
from etc_engine.engines.dtem.methods import find_method
from etc_engine.engines.dtem.sphere_interior import temperatures_inside_spheres
from etc_engine.engines.dtem.steady import SteadySolution
from etc_engine.medium.field import ParticleField
from etc_engine.medium.links import fill_dead_ends
from etc_engine.medium.loads import driven_walls, wall_temperatures
from etc_engine.medium.sides import NO_CUTS, contact_sides, insulated_cuts


def recover_field(solution: SteadySolution, load: int = 0) -> ParticleField:
    """Mean particle temperatures and all contact temperatures of a steady solution.

    T_o = T_i - sum_j h_ij Q_j at any contact i that carries flux; a contact without flux takes
    T_i = T_o + sum_j h_ij Q_j, and what hangs on it is isothermal.

    Parameters
    ----------
    solution : SteadySolution
    load : int
        Column of the solution.

    Returns
    -------
    ParticleField

    References
    ----------
    Feng, Han, Li, Owen 2008, Eqs. 24 and 28, doi:10.1016/j.jcp.2008.01.031.
    """
    network, backbone, axis = solution.network, solution.backbone, solution.axes[load]
    packing = network.packing
    periodic = packing.box.periodic[axis]
    variant = find_method(solution.method, packing.dimension)
    cuts = insulated_cuts(network, driven_walls(network, solution.axes)) if variant.exact_cuts else NO_CUTS
    sides = contact_sides(network, cuts)
    rows = np.empty(solution.sides.nodes.size, dtype=np.int64)
    rows[solution.sides.of_contacts] = sides.of_contacts[backbone.contacts]
    rows[solution.sides.of_walls] = sides.of_walls[backbone.wall_contacts]
    flows = np.zeros((sides.nodes.size, solution.flows.shape[1]))
    flows[rows] = solution.flows[:, :, load]
    potentials = variant.potentials(sides, solution.medium.conductivity, flows)

    owner = sides.particles[rows]
    number = np.bincount(owner, minlength=packing.count)
    total = np.bincount(owner, solution.temperatures[:, load] - potentials[rows], minlength=packing.count)
    temperatures = np.full(packing.count, np.nan, dtype=np.float64)
    temperatures[number > 0] = total[number > 0] / number[number > 0]
    at_wall: Floats = np.full(network.walls.size, np.nan)
    jumps: Floats = np.zeros(network.count)
    if periodic:
        temperatures = np.asarray(temperatures + packing.centers[:, axis])
        jumps = (network.shifts[:, axis] * packing.box.lengths[axis]).astype(np.float64)
    else:
        driven = network.walls_of(axis)
        at_wall[driven] = wall_temperatures(network.walls[driven])
        hung = network.wall_particles[driven]
        alone = number[hung] == 0
        temperatures[hung[alone]] = at_wall[driven[alone]]
    fill_dead_ends(temperatures, network.pairs, jumps, potentials[sides.of_contacts])

    open_walls = np.flatnonzero(np.isnan(at_wall))
    at_wall[open_walls] = temperatures[network.wall_particles[open_walls]] + potentials[sides.of_walls[open_walls]]
    at_contact = temperatures[network.pairs[:, 0]] + potentials[sides.of_contacts[:, 0]]
    drops = variant.drops(sides, solution.medium.conductivity, flows)[sides.of_contacts]
    field = ParticleField(
        medium=solution.medium,
        axis=axis,
        sides=sides,
        particle_temperatures=temperatures,
        contact_temperatures=at_contact,
        wall_temperatures=at_wall,
        contact_flows=flows[sides.of_contacts[:, 1], 0],
        wall_flows=-flows[sides.of_walls, 0],
        face_temperatures=at_contact[:, None] - drops,
        flow_modes=flows,
    )
    inside = {2: temperatures_inside, 3: temperatures_inside_spheres}[packing.dimension]
    return replace(field, inside=partial(inside, field, solution.method))
