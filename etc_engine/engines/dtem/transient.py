"""Heat conduction in time through a contact network: the discrete thermal element method with storage.

Contacts are nodes without capacity, particles store heat at their mean temperature (or in d + 1 parts, which adds
their dipoles; see `etc_engine.engines.dtem.storage`):

    C dT/dt = f(t) - K T,     K = sum over the particles of their storing elements,

an index-1 differential-algebraic system that `etc_engine.solvers.marching.march` solves. At rest the means are those
of the steady method of the same name.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.engines.dtem.assembly import assemble
from etc_engine.engines.dtem.storage import readings_of_parts, storing_elements
from etc_engine.medium.medium import Medium, check_conductors
from etc_engine.medium.sides import check_arcs, contact_sides
from etc_engine.medium.transient import ParticleSystem, Source, joined_walls, particle_capacities, state_source
from etc_engine.medium.wall_nodes import heat_system, number_nodes
from etc_engine.medium.walls import WallCondition, wall_conditions


def element_system(
    medium: Medium,
    walls: Mapping[str, WallCondition],
    *,
    method: str = "chord",
    dipoles: bool = False,
    modes: int | None = None,
    source: Source = 0.0,
    capacities: Floats | None = None,
) -> ParticleSystem:
    """Storing elements of all particles, assembled, with the conditions at the walls of the box.

    Parameters
    ----------
    medium : Medium
        With contacts and heat capacities. Rattlers and dead ends take part: they keep or take up heat.
    walls : mapping of str to condition
        By the names of `etc_engine.medium.walls.WALLS`; a wall that is not named is insulated.
    method : str
        ``chord``, ``standard``, ``enhanced`` or ``arc``.
    dipoles : bool
        Whether the particles have dipole states, for earlier times.
    modes : int, optional
        Flux modes of a contact, with ``arc``.
    source : float, array_like, shape (n,), or callable of t [W, in 2D W/m]
        Heat set free evenly in all particles, or in each.
    capacities : ndarray, shape (n,), optional [J/(m K)]
        Of the particles; rho c times what their contacts leave of them by default.

    Returns
    -------
    ParticleSystem
        With d + 1 states per particle with dipoles, otherwise 1.

    Raises
    ------
    GeometryError
        If contact arcs overlap, or are too wide for the method.
    InputError
        If a value or a wall is not understood, or a wall with a heat flux touches nothing.

    Notes
    -----
    A wall with a heat flux or a convective wall is a plate of uniform temperature without capacity. Its area is the
    face of the box. After a step of flux, T_i - T_o is good to 1 % of its final value from the Fourier number
    kappa t/(rho c R^2) = 0.35 .. 1.25, with dipoles 0.12 .. 0.41, depending on where the contacts lie.

    The heat balance of `march` is exact where its solver is (small systems) and with one flux mode per contact; with
    ``arc`` and an iterative solver it holds to the solver's tolerance.

    At rest the temperatures are those of `etc_engine.engines.dtem.steady.solve_steady`; of ``arc`` on the backbone
    alone, since here dead ends take fluxes of no sum from the contacts that hold them, which shifts the others by
    some 1e-5.

    Examples
    --------
    >>> from etc_engine import Box, ParticlePacking, bonded_contacts
    >>> from etc_engine.solvers.marching import march
    >>> from etc_engine.medium.walls import FixedTemperature
    >>> disk = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0)))
    >>> medium = Medium(disk, 1.0, bonded_contacts(disk, 0.2), heat_capacity=1.0)
    >>> system = element_system(medium, {"left": FixedTemperature(1.0)})
    >>> *_, late = march(system.heat, system.initial(0.0), [0.0, 40.0], steps=200)
    >>> system.particle_temperatures(late.temperatures).round(6)
    array([1.])
    """
    check_conductors(medium)
    network, n, states = medium.links, medium.packing.count, medium.dimension + 1 if dipoles else 1
    conditions = wall_conditions(medium.box, walls)
    kept = joined_walls(network.walls, conditions)
    reduced = network.select(np.ones(network.count, dtype=np.bool_), kept)
    sides = contact_sides(reduced)
    check_arcs(sides)
    elements = storing_elements(sides, medium.conductivity, method, dipoles=dipoles, modes=modes)
    stored = np.repeat(particle_capacities(medium, capacities, cut=method == "chord") / states, states)
    nodes = number_nodes(
        medium.box, reduced.walls, conditions, contacts=network.count, modes=elements.modes, states=stored.size
    )
    count = nodes.unknowns.size
    whole = assemble(elements, np.zeros((elements.nodes.size, 0)), np.zeros(count, dtype=np.bool_)).matrix
    system = heat_system(whole, nodes, stored, state_source(source, n, states))

    def flows(time: float, unknowns: Floats) -> Floats:
        """Q = A (T_c - T_o e)."""
        rows = made.node_temperatures(time, unknowns)[elements.nodes]
        at_contacts = elements.nodes < count - stored.size
        return np.ascontiguousarray(elements.apply(rows[:, None])[at_contacts, 0][:: elements.modes])

    made = ParticleSystem(system, medium, nodes, sides, np.flatnonzero(kept), flows, elements.modes)
    return made


def dipole_amplitudes(system: ParticleSystem, unknowns: Floats) -> Floats:
    """Amplitudes D of each particle's linear part, shape (n, d) [K]; zero where there are no such states."""
    states, dimension = system.state_temperatures(unknowns), system.medium.dimension
    if system.states == 1:
        return np.zeros((states.shape[0], dimension))
    return np.asarray(states @ readings_of_parts(dimension)[1:].T)


def contact_temperatures(system: ParticleSystem, time: float, unknowns: Floats) -> Floats:
    """Node temperature of each particle contact, then of each wall contact that takes part [K]."""
    nodes = system.node_temperatures(time, unknowns)
    return nodes[: nodes.size - system.nodes.states : system.modes]
