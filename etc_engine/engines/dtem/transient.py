"""Heat conduction in time through a contact network: the discrete thermal element method with storage.

Contacts are nodes without capacity, particles store heat at their mean temperature (or in d + 1 parts, which adds
their dipoles; see `etc_engine.engines.dtem.storage`):

    C dT/dt = f(t) - K T,     K = sum over the particles of their storing elements,

an index-1 differential-algebraic system that `etc_engine.solvers.marching.march` solves. At rest the means are those
of the steady method of the same name.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_matrix, diags_array

from etc_engine.engines.dtem.assembly import assemble
from etc_engine.engines.dtem.element import Elements
from etc_engine.engines.dtem.steady import make_material, per_particle
from etc_engine.engines.dtem.storage import readings_of_parts, stored_areas, storing_elements
from etc_engine.errors import InputError
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.sides import ContactSides, check_arcs, contact_sides
from etc_engine.medium.wall_nodes import FIRM, WallNodes, number_nodes
from etc_engine.medium.walls import Insulated, WallCondition, wall_conditions
from etc_engine.packing.particles import particle_values
from etc_engine.solvers.marching import HeatSystem

Source = ArrayLike | Callable[[float], ArrayLike]


@dataclass(frozen=True, eq=False)
class TransientSystem:
    """A contact network ready to be marched in time, and how its unknowns are read.

    Parameters
    ----------
    heat : HeatSystem
        Of the unknowns: free contact nodes, plates of walls, then the states by particle. Its heat rates are those
        into the particles from the walls 0, 1, ... of the box, and from the sources.
    network : ContactNetwork
    sides : ContactSides
        Of the contacts that may carry heat; insulated walls are left out. Their nodes count the particle contacts
        and then ``wall_contacts``.
    wall_contacts : ndarray of int
        Wall contacts of the network that take part.
    elements : Elements
    walls : WallNodes
        The unknown or the wall of each node of the elements.
    states : int
        Of a particle: 1, or d + 1 with dipoles.
    """

    heat: HeatSystem
    network: ContactNetwork
    sides: ContactSides
    wall_contacts: NDArray[np.int64]
    elements: Elements
    walls: WallNodes
    states: int

    def initial(self, temperatures: ArrayLike | Callable[[NDArray[np.float64]], ArrayLike]) -> NDArray[np.float64]:
        """Unknowns of particles that are isothermal: a value, one for each, or a function of the centres (n, d).

        Raises
        ------
        InputError
            If they are not finite or not as many as the particles.
        """
        centers = self.network.packing.centers
        given = temperatures(centers) if callable(temperatures) else temperatures
        particles = particle_values(given, centers.shape[0], "initial temperature")
        start = np.full(self.heat.capacity.size, particles.mean())
        start[start.size - self.states * particles.size :] = np.repeat(particles, self.states)
        return start

    def particle_temperatures(self, temperatures: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mean temperature of each particle, shape (n,) [K]."""
        return np.asarray(self._states(temperatures).mean(axis=1))

    def dipoles(self, temperatures: NDArray[np.float64]) -> NDArray[np.float64]:
        """Amplitudes D of each particle's linear part, shape (n, d) [K]; zero where there are no such states."""
        states, dimension = self._states(temperatures), self.network.packing.dimension
        if self.states == 1:
            return np.zeros((states.shape[0], dimension))
        return np.asarray(states @ readings_of_parts(dimension)[1:].T)

    def contact_temperatures(self, time: float, temperatures: NDArray[np.float64]) -> NDArray[np.float64]:
        """Node temperature of each particle contact, then of each wall contact that takes part [K]."""
        count = self.network.count + self.wall_contacts.size
        return self._nodes(time, temperatures)[: self.elements.modes * count : self.elements.modes]

    def _states(self, temperatures: NDArray[np.float64]) -> NDArray[np.float64]:
        return temperatures[temperatures.size - self.states * self.network.packing.count :].reshape(-1, self.states)

    def _nodes(self, time: float, temperatures: NDArray[np.float64]) -> NDArray[np.float64]:
        known = np.append(temperatures, 0.0)[self.walls.unknowns]
        return np.asarray(known + self.walls.fixed @ self.walls.temperatures(time))


def contact_flows(system: TransientSystem, time: float, temperatures: NDArray[np.float64]) -> NDArray[np.float64]:
    """Heat flow into the particle at each contact side, Q = A (T_c - T_o e), shape (s,) [W/m].

    Parameters
    ----------
    system : TransientSystem
    time : float [s]
    temperatures : ndarray, shape (n,) [K]
        Unknowns at that time, say of a `MarchState`.

    Returns
    -------
    ndarray
        By ``system.sides``; equal and opposite on the two sides of a particle contact.
    """
    rows = system._nodes(time, temperatures)[system.elements.nodes]
    flows = system.elements.apply(rows[:, None])[:, 0]
    contacts = system.elements.modes * (system.network.count + system.wall_contacts.size)
    return np.asarray(flows[system.elements.nodes < contacts][:: system.elements.modes])


def particle_sides(system: TransientSystem, particle: int) -> slice:
    """Rows of one particle among the sides, and so among the flows of `contact_flows`.

    Raises
    ------
    InputError
        If there is no such particle.
    """
    count = system.network.packing.count
    if not 0 <= particle < count:
        raise InputError(f"there is no particle {particle}: they are numbered from 0 to {count - 1}")
    return slice(int(system.sides.offsets[particle]), int(system.sides.offsets[particle + 1]))


def transient_system(
    network: ContactNetwork,
    walls: Mapping[str, WallCondition],
    *,
    method: str = "chord",
    dipoles: bool = False,
    modes: int | None = None,
    conductivity: ArrayLike = 1.0,
    heat_capacity: ArrayLike = 1.0,
    contact_resistance: ArrayLike = 0.0,
    source: Source = 0.0,
) -> TransientSystem:
    """Storing elements of all particles, assembled, with the conditions at the walls of the box.

    Parameters
    ----------
    network : ContactNetwork
        Rattlers and dead ends take part: they keep or take up heat.
    walls : mapping of str to condition
        By the names of `etc_engine.medium.walls.WALLS`; a wall that is not named is insulated.
    method : str
        ``chord``, ``standard``, ``enhanced`` or ``arc``.
    dipoles : bool
        Whether the particles have dipole states, for earlier times.
    modes : int, optional
        Flux modes of a contact, with ``arc``.
    conductivity : float or array_like, shape (n,) [W/(m K)]
        Of all particles, or of each.
    heat_capacity : float or array_like, shape (n,) [J/(m3 K)]
        rho c of all particles, or of each.
    contact_resistance : float or array_like, shape (m + w,) [m K/W]
        As in `etc_engine.engines.dtem.steady.solve_steady`.
    source : float, array_like, shape (n,), or callable of t [W/m]
        Heat set free evenly in all particles, or in each, per unit thickness.

    Returns
    -------
    TransientSystem

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

    The heat balance of `march` is exact where its solver is (small systems) and with one flux mode a contact; with
    ``arc`` and an iterative solver it holds to the solver's tolerance.

    At rest the temperatures are those of `solve_steady`; of ``arc`` on the backbone alone, since here dead ends take
    fluxes of no sum from the contacts that hold them, which shifts the others by some 1e-5.

    Examples
    --------
    >>> from etc_engine import Box, ParticlePacking, bonded_contacts
    >>> from etc_engine.solvers.marching import march
    >>> from etc_engine.medium.walls import FixedTemperature
    >>> disk = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0)))
    >>> system = transient_system(bonded_contacts(disk, 0.2), {"left": FixedTemperature(1.0)})
    >>> *_, late = march(system.heat, system.initial(0.0), [0.0, 40.0], steps=200)
    >>> system.particle_temperatures(late.temperatures).round(6)
    array([1.])
    """
    conditions = wall_conditions(network.packing.box, walls)
    kept = np.array([not isinstance(c, Insulated) for c in conditions])[network.walls]
    everywhere = np.ones(network.count, dtype=np.bool_)
    reduced = network.select(everywhere, kept)
    whole = make_material(network, conductivity, contact_resistance)
    material = replace(whole, contact_resistance=whole.contact_resistance[np.concatenate([everywhere, kept])])
    density = per_particle(heat_capacity, network.packing.count, "heat capacity")
    sides = contact_sides(reduced)
    check_arcs(sides)
    elements = storing_elements(sides, material, method, dipoles=dipoles, modes=modes)
    states = network.packing.dimension + 1 if dipoles else 1
    capacities = np.repeat(density * stored_areas(network, method) / states, states)
    nodes = number_nodes(reduced, conditions, elements.modes, capacities.size)
    return TransientSystem(
        heat=_heat_system(elements, nodes, capacities, _source(source, density.size, states)),
        network=network,
        sides=sides,
        wall_contacts=np.flatnonzero(kept),
        elements=elements,
        walls=nodes,
        states=states,
    )


def _source(source: Source, count: int, states: int) -> Callable[[float], NDArray[np.float64]]:
    """Heat set free in each state [W/m]."""

    def spread(values: ArrayLike) -> NDArray[np.float64]:
        return np.repeat(particle_values(values, count, "source") / states, states)

    if callable(source):
        return lambda t: spread(source(t))
    constant = spread(source)
    return lambda _: constant


def _heat_system(
    elements: Elements,
    walls: WallNodes,
    capacities: NDArray[np.float64],
    source: Callable[[float], NDArray[np.float64]],
) -> HeatSystem:
    """Elements summed over shared nodes, the contacts of a plate folded into one."""
    lift = walls.fixed[elements.nodes].toarray()
    free = np.flatnonzero(walls.unknowns >= 0)
    system = assemble(elements, lift, walls.unknowns < 0)
    fold = csr_matrix((np.ones(free.size), (np.arange(free.size), walls.unknowns[free])), shape=(free.size, walls.size))
    plates = np.flatnonzero(walls.plates >= 0)
    exchange = np.zeros(walls.size)
    nodes = walls.plates[plates]
    exchange[nodes] = walls.exchange[plates]
    elements_alone = csr_matrix(fold.T @ system.matrix @ fold)
    matrix = csr_matrix(elements_alone + diags_array(exchange))
    matrix.sort_indices()
    behind = elements_alone[nodes]
    by_film = exchange[nodes] <= FIRM * elements_alone.diagonal()[nodes]
    links = np.asarray(fold.T @ system.rhs)  # conductances between unknowns and walls of given temperature
    own = lift.T @ elements.apply(lift)

    def load(t: float) -> NDArray[np.float64]:
        f = links @ walls.temperatures(t)
        f[walls.size - capacities.size :] += source(t)
        f[nodes] += walls.plate_heat(t)[plates]
        return np.asarray(f)

    def heat_rates(t: float, temperatures: NDArray[np.float64]) -> NDArray[np.float64]:
        rates = walls.plate_heat(t) + own @ walls.temperatures(t) - links.T @ temperatures
        through_film = rates[plates] - (exchange * temperatures)[nodes]
        into_elements = behind @ temperatures - (links @ walls.temperatures(t))[nodes]
        rates[plates] = np.where(by_film, through_film, into_elements)
        return np.append(rates, source(t).sum())

    capacity = np.concatenate([np.zeros(walls.size - capacities.size), capacities])
    return HeatSystem(capacity, matrix, load, heat_rates)
