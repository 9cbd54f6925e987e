"""Heat conduction in time through a contact network: the discrete thermal element method with storage.

Contacts are nodes without capacity, particles store heat at their mean temperature (or in three thirds, which adds
their dipoles; see `etc_engine.dtem.storage`):

    C dT/dt = f(t) - K T,     K = sum over the particles of their storing elements,

an index-1 differential-algebraic system that `etc_engine.solvers.marching.march` solves. At rest the means are those
of the steady method of the same name.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_matrix, diags_array

from etc_engine.contacts import ContactNetwork
from etc_engine.dtem.assembly import assemble
from etc_engine.dtem.element import Elements
from etc_engine.dtem.sides import ContactSides, check_arcs, contact_sides
from etc_engine.dtem.steady import make_material
from etc_engine.dtem.storage import FROM_THIRDS, stored_areas, storing_elements
from etc_engine.errors import InputError
from etc_engine.solvers.marching import HeatSystem
from etc_engine.walls import WALLS, Convective, FixedTemperature, HeatFlux, Insulated, WallCondition

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
    unknowns : ndarray of int, shape (nodes,)
        Unknown of each node of the elements, -1 at a wall of given temperature.
    fixed : ndarray, shape (nodes, walls)
        1 where a node takes the temperature of a wall.
    wall_temperatures : callable
        t -> temperatures of the walls, shape (walls,), 0 where none is given.
    states : int
        Of a particle: 1, or 3 with dipoles.
    """

    heat: HeatSystem
    network: ContactNetwork
    sides: ContactSides
    wall_contacts: NDArray[np.int64]
    elements: Elements
    unknowns: NDArray[np.int64]
    fixed: csr_matrix
    wall_temperatures: Callable[[float], NDArray[np.float64]]
    states: int

    def initial(self, temperatures: ArrayLike | Callable[[NDArray[np.float64]], ArrayLike]) -> NDArray[np.float64]:
        """Unknowns of particles that are isothermal: a value, one for each, or a function of the centres (n, d).

        Raises
        ------
        InputError
            If they are not finite or not as many as the particles.
        """
        centers = self.network.packing.centers
        given = np.asarray(temperatures(centers) if callable(temperatures) else temperatures, dtype=np.float64)
        if given.shape not in ((), (centers.shape[0],)) or not np.isfinite(given).all():
            raise InputError(
                f"the initial temperature must be one finite number or {centers.shape[0]} of them, found shape {given.shape}"
            )
        particles = np.broadcast_to(given, centers.shape[:1])
        start = np.full(self.heat.capacity.size, particles.mean())
        start[start.size - self.states * particles.size :] = np.repeat(particles, self.states)
        return start

    def particle_temperatures(self, temperatures: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mean temperature of each particle, shape (n,) [K]."""
        return np.asarray(self._states(temperatures).mean(axis=1))

    def dipoles(self, temperatures: NDArray[np.float64]) -> NDArray[np.float64]:
        """Amplitudes D_c, D_s of each particle's linear part, shape (n, 2) [K]; zero where there are no such states."""
        states = self._states(temperatures)
        if self.states == 1:
            return np.zeros((states.shape[0], 2))
        return np.asarray(states @ FROM_THIRDS[1:].T)

    def contact_temperatures(self, time: float, temperatures: NDArray[np.float64]) -> NDArray[np.float64]:
        """Node temperature of each particle contact, then of each wall contact that takes part [K]."""
        count = self.network.count + self.wall_contacts.size
        return self._nodes(time, temperatures)[: self.elements.modes * count : self.elements.modes]

    def _states(self, temperatures: NDArray[np.float64]) -> NDArray[np.float64]:
        return temperatures[temperatures.size - self.states * self.network.packing.count :].reshape(-1, self.states)

    def _nodes(self, time: float, temperatures: NDArray[np.float64]) -> NDArray[np.float64]:
        known = np.append(temperatures, 0.0)[self.unknowns]
        return np.asarray(known + self.fixed @ self.wall_temperatures(time))


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
        Two-dimensional. Rattlers and dead ends take part: they keep or take up heat.
    walls : mapping of str to condition
        By the names of `etc_engine.walls.WALLS`; a wall that is not named is insulated.
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
        As in `etc_engine.dtem.steady.solve_steady`.
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
    A wall with a heat flux or a convective wall is a plate of uniform temperature without capacity. Its area is the face
    of the box. After a step of flux, T_i - T_o is good to 1 % of its final value from the Fourier number
    kappa t/(rho c R^2) = 0.3 .. 1.3, with dipoles 0.1 .. 0.3, depending on where the contacts lie.

    Examples
    --------
    >>> from etc_engine import Box, ParticlePacking, bonded_contacts
    >>> from etc_engine.solvers.marching import march
    >>> disk = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0)))
    >>> system = transient_system(bonded_contacts(disk, 0.2), {"left": FixedTemperature(1.0)})
    >>> *_, late = march(system.heat, system.initial(0.0), [0.0, 40.0], steps=200)
    >>> system.particle_temperatures(late.temperatures).round(6)
    array([1.])
    """
    if network.packing.dimension != 2:
        raise InputError("the discrete thermal element method is two-dimensional; the packing has 3 axes")
    conditions = _conditions(network, walls)
    active = np.array([not isinstance(c, Insulated) for c in conditions])
    kept = active[network.walls]
    reduced = network.select(np.ones(network.count, dtype=np.bool_), kept)
    material = make_material(network, conductivity, contact_resistance)
    material = type(material)(
        material.conductivity,
        material.contact_resistance[np.concatenate([np.ones(network.count, dtype=np.bool_), kept])],
    )
    density = make_material(network, heat_capacity, 0.0).conductivity
    sides = contact_sides(reduced)
    check_arcs(sides)
    elements = storing_elements(sides, material, method, dipoles=dipoles, modes=modes)
    states = 3 if dipoles else 1
    capacities = np.repeat(density * stored_areas(network, method) / states, states)
    share = _source(source, network.packing.count, states)
    heat, unknowns, fixed = _heat_system(network, reduced, conditions, elements, capacities, share)
    return TransientSystem(
        heat=heat,
        network=network,
        sides=sides,
        wall_contacts=np.flatnonzero(kept),
        elements=elements,
        unknowns=unknowns,
        fixed=fixed,
        wall_temperatures=lambda t: _given(conditions, t),
        states=states,
    )


def _conditions(network: ContactNetwork, walls: Mapping[str, WallCondition]) -> list[WallCondition]:
    """Condition of each wall of the box, those not named insulated."""
    box = network.packing.box
    names = WALLS[: 2 * network.packing.dimension]
    for name, condition in walls.items():
        if name not in names:
            raise InputError(f"unknown wall {name!r}: expected one of {', '.join(names)}")
        if box.periodic[names.index(name) // 2] and not isinstance(condition, Insulated):
            raise InputError(f"the box is periodic across the {name} wall: there is none to hold a condition")
        if isinstance(condition, HeatFlux) and not (network.walls == names.index(name)).any():
            raise InputError(f"no particle touches the {name} wall: its heat flux has nowhere to go; insulate it")
    return [walls.get(name, Insulated()) for name in names]


def _given(conditions: list[WallCondition], t: float) -> NDArray[np.float64]:
    """Prescribed wall temperatures, 0 where there is none."""
    return np.array([c.temperature(t) if isinstance(c, FixedTemperature) else 0.0 for c in conditions])


def _source(source: Source, count: int, states: int) -> Callable[[float], NDArray[np.float64]]:
    """Heat set free in each state [W/m]."""

    def spread(values: ArrayLike) -> NDArray[np.float64]:
        array = np.asarray(values, dtype=np.float64)
        if array.shape not in ((), (count,)) or not np.isfinite(array).all():
            raise InputError(f"the source must be one finite number or {count} of them, found shape {array.shape}")
        return np.repeat(np.broadcast_to(array, (count,)) / states, states)

    if callable(source):
        return lambda t: spread(source(t))
    constant = spread(source)
    return lambda t: constant


def _heat_system(
    network: ContactNetwork,
    reduced: ContactNetwork,
    conditions: list[WallCondition],
    elements: Elements,
    capacities: NDArray[np.float64],
    source: Callable[[float], NDArray[np.float64]],
) -> tuple[HeatSystem, NDArray[np.int64], csr_matrix]:
    """The system of the unknowns, the unknown of every node, and the wall of every node of given temperature."""
    m, modes, number = reduced.count, elements.modes, len(conditions)
    contact_nodes = modes * (m + reduced.walls.size)
    nodes = contact_nodes + capacities.size
    box = network.packing.box
    faces = np.array([box.lengths[1 - w // 2] for w in range(number)])
    held = np.array([isinstance(c, FixedTemperature) for c in conditions])
    plates = np.array([isinstance(c, HeatFlux | Convective) for c in conditions])
    plates[~np.isin(np.arange(number), reduced.walls)] = False  # a convective wall that touches nothing

    # a wall is isothermal: its higher flux modes are held at zero, and so is mode 0 unless it follows a plate
    prescribed = np.zeros((m + reduced.walls.size, modes), dtype=np.bool_)
    prescribed[m:] = True
    prescribed[m:, 0] = held[reduced.walls]
    prescribed = np.concatenate([prescribed.ravel(), np.zeros(capacities.size, dtype=np.bool_)])
    at_wall = modes * np.arange(m, m + reduced.walls.size)
    pattern = np.zeros((nodes, number))
    pattern[at_wall, reduced.walls] = held[reduced.walls]
    system = assemble(elements, pattern[elements.nodes], prescribed)

    # the contacts of a plate become one unknown, between the contacts and the particles
    unknowns = np.full(nodes, -1, dtype=np.int64)
    plate_of = np.full(nodes, -1, dtype=np.int64)
    plate_of[at_wall] = np.where(plates[reduced.walls], reduced.walls, -1)
    single = ~prescribed & (plate_of < 0)
    particles = np.arange(nodes) >= contact_nodes
    before = int((single & ~particles).sum())
    row_of_plate = before + np.cumsum(plates) - 1
    unknowns[single & ~particles] = np.arange(before)
    unknowns[particles] = before + plates.sum() + np.arange(capacities.size)
    joined = plate_of >= 0
    unknowns[joined] = row_of_plate[plate_of[joined]]
    size = before + int(plates.sum()) + capacities.size
    free = ~prescribed
    fold = csr_matrix((np.ones(free.sum()), (np.arange(free.sum()), unknowns[free])), shape=(free.sum(), size))
    ambient = np.zeros(size)
    for w in np.flatnonzero(plates):
        condition = conditions[w]
        ambient[row_of_plate[w]] = condition.coefficient * faces[w] if isinstance(condition, Convective) else 0.0
    matrix = csr_matrix(fold.T @ system.matrix @ fold + diags_array(ambient))
    matrix.sort_indices()
    links = fold.T @ system.rhs  # of the unknowns to the walls of given temperature, shape (size, walls)

    def plate_heat(t: float) -> NDArray[np.float64]:
        """Prescribed part of the heat into each plate [W/m]."""
        heat = np.zeros(number)
        for w in np.flatnonzero(plates):
            condition = conditions[w]
            if isinstance(condition, HeatFlux):
                heat[w] = faces[w] * condition.flux(t)
            elif isinstance(condition, Convective):
                heat[w] = ambient[row_of_plate[w]] * condition.temperature(t)
        return heat

    def load(t: float) -> NDArray[np.float64]:
        f = links @ _given(conditions, t)
        f[size - capacities.size :] += source(t)
        f[row_of_plate[plates]] += plate_heat(t)[plates]
        return np.asarray(f)

    def heat_rates(t: float, temperatures: NDArray[np.float64]) -> NDArray[np.float64]:
        rates = plate_heat(t) + wall_links @ _given(conditions, t) - links.T @ temperatures
        rates[plates] -= (ambient * temperatures)[row_of_plate[plates]]
        return np.append(rates, source(t).sum())

    wall_links = system.lift.T @ elements.apply(system.lift)
    capacity = np.concatenate([np.zeros(size - capacities.size), capacities])
    return HeatSystem(capacity, matrix, load, heat_rates), unknowns, csr_matrix(pattern)
