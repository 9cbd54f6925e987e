"""Temperatures and heat flows of every particle and contact of a steady solution, dead ends included."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etc_engine.engines.dtem.methods import find_method
from etc_engine.engines.dtem.steady import SteadySolution, driven_walls
from etc_engine.medium.sides import NO_CUTS, ContactSides, contact_sides, insulated_cuts


@dataclass(frozen=True, eq=False)
class ParticleField:
    """Temperatures and heat flows of one load on a whole contact network.

    Parameters
    ----------
    sides : ContactSides
        All contact sides of the network.
    particle_temperatures : ndarray, shape (n,) [K]
        Mean temperature of each particle; NaN where no contacts lead to a spanning cluster or a driven wall.
        Along a periodic axis the particle's home image, mean gradient included.
    contact_temperatures : ndarray, shape (m,) [K]
        Node temperature of each particle contact, seen from its first particle.
    wall_temperatures : ndarray, shape (w,) [K]
        Node temperature of each wall contact.
    contact_flows : ndarray, shape (m,) [W/m]
        Heat flow from the first particle of each contact to the second.
    wall_flows : ndarray, shape (w,) [W/m]
        Heat flow from the particle into each wall.
    face_temperatures : ndarray, shape (m, 2) [K]
        Temperature of the face of each particle contact on either particle, T_node - R_c Q_into / 2, in the
        frame of the first particle. Equal where there is no contact resistance.
    flow_modes : ndarray, shape (s, M) [W/m]
        Flux modes into the particle at each side.
    """

    sides: ContactSides
    particle_temperatures: NDArray[np.float64]
    contact_temperatures: NDArray[np.float64]
    wall_temperatures: NDArray[np.float64]
    contact_flows: NDArray[np.float64]
    wall_flows: NDArray[np.float64]
    face_temperatures: NDArray[np.float64]
    flow_modes: NDArray[np.float64]


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
    potentials = variant.potentials(sides, solution.material, flows)

    owner = sides.particles[rows]
    number = np.bincount(owner, minlength=packing.count)
    total = np.bincount(owner, solution.temperatures[:, load] - potentials[rows], minlength=packing.count)
    temperatures = np.full(packing.count, np.nan, dtype=np.float64)
    temperatures[number > 0] = total[number > 0] / number[number > 0]
    at_wall: NDArray[np.float64] = np.full(network.walls.size, np.nan)
    jumps: NDArray[np.float64] = np.zeros(network.count)
    if periodic:
        temperatures = np.asarray(temperatures + packing.centers[:, axis])
        jumps = (network.shifts[:, axis] * packing.box.lengths[axis]).astype(np.float64)
    else:
        driven = network.walls_of(axis)
        at_wall[driven] = 1.0 - network.walls[driven] % 2
        hung = network.wall_particles[driven]
        alone = number[hung] == 0
        temperatures[hung[alone]] = at_wall[driven[alone]]
    fill_dead_ends(temperatures, sides.offsets, sides.nodes, network.pairs, jumps, potentials)

    open_walls = np.flatnonzero(np.isnan(at_wall))
    at_wall[open_walls] = temperatures[network.wall_particles[open_walls]] + potentials[sides.of_walls[open_walls]]
    at_contact = temperatures[network.pairs[:, 0]] + potentials[sides.of_contacts[:, 0]]
    drops = 0.5 * solution.material.contact_resistance[: network.count, None] * flows[sides.of_contacts, 0]
    return ParticleField(
        sides=sides,
        particle_temperatures=temperatures,
        contact_temperatures=at_contact,
        wall_temperatures=at_wall,
        contact_flows=flows[sides.of_contacts[:, 1], 0],
        wall_flows=-flows[sides.of_walls, 0],
        face_temperatures=at_contact[:, None] - drops,
        flow_modes=flows,
    )


@njit(cache=True)
def fill_dead_ends(
    temperatures: NDArray[np.float64],
    offsets: NDArray[np.int64],
    nodes: NDArray[np.int64],
    pairs: NDArray[np.int64],
    jumps: NDArray[np.float64],
    potentials: NDArray[np.float64],
) -> None:
    """Carry known temperatures, in place, to the particles without flux that hang on them."""
    n = temperatures.size
    queue = np.empty(n, dtype=np.int64)
    tail = 0
    for p in range(n):
        if not np.isnan(temperatures[p]):
            queue[tail] = p
            tail += 1
    head = 0
    while head < tail:
        p = queue[head]
        head += 1
        for side in range(offsets[p], offsets[p + 1]):
            contact = nodes[side]
            if contact >= pairs.shape[0]:
                continue
            is_first = pairs[contact, 0] == p
            other = pairs[contact, 1] if is_first else pairs[contact, 0]
            if np.isnan(temperatures[other]):
                jump = -jumps[contact] if is_first else jumps[contact]
                temperatures[other] = temperatures[p] + potentials[side] + jump
                queue[tail] = other
                tail += 1
