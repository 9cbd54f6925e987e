"""ParticleSystem: particles that store heat, ready to be marched in time, and how the unknowns are read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.errors import InputError
from etc_engine.medium.medium import Medium
from etc_engine.medium.sides import ContactSides
from etc_engine.medium.wall_nodes import WallNodes
from etc_engine.medium.walls import FixedTemperature, Insulated, WallCondition
from etc_engine.packing.particles import particle_values
from etc_engine.solvers.marching import HeatSystem

Source = ArrayLike | Callable[[float], ArrayLike]
"""Heat set free in all particles, in each, or a function of the time [W, in 2D W/m]."""
Flows = Callable[[float, Floats], Floats]
"""(t, unknowns) -> heat flow into the particle at each contact side."""


@dataclass(frozen=True, eq=False)
class HeatSource:
    """Heat set free at a time, and when its course has a kink.

    Parameters
    ----------
    rate : callable
        t -> heat [W, in 2D W/m].
    knots : tuple of float [s]
        Times at which no step may reach across.
    """

    rate: Callable[[float], Floats]
    knots: tuple[float, ...] = ()

    def __call__(self, t: float) -> Floats:
        """The heat at a time."""
        return self.rate(t)


@dataclass(frozen=True, eq=False)
class ParticleSystem:
    """A medium ready to be marched in time.

    Parameters
    ----------
    heat : HeatSystem
        Of the unknowns: free contact nodes, plates of walls, then the states by particle. Its heat rates are those
        into the particles from the walls 0, 1, ... of the box, and from the sources.
    medium : Medium
    nodes : WallNodes
        The unknown or the wall of each node.
    sides : ContactSides
        Of the contacts that may carry heat; insulated walls are left out. Their nodes count the particle contacts
        and then ``wall_contacts``.
    wall_contacts : ndarray of int
        Wall contacts of the network that take part.
    flows : callable
        (t, unknowns) -> heat flow into the particle at each contact side, shape (s,) [W, in 2D W/m]; equal and opposite
        on the two sides of a particle contact.
    modes : int
        Flux modes of a contact.
    """

    heat: HeatSystem
    medium: Medium
    nodes: WallNodes
    sides: ContactSides
    wall_contacts: Ints
    flows: Flows
    modes: int = 1

    @property
    def states(self) -> int:
        """States of a particle."""
        return self.nodes.states // self.medium.packing.count

    def initial(self, temperatures: ArrayLike | Callable[[Floats], ArrayLike]) -> Floats:
        """Unknowns of particles that are isothermal: a value, one for each, or a function of the centres (n, d).

        Raises
        ------
        InputError
            If they are not finite, or not one per particle.
        """
        centers = self.medium.packing.centers
        given = temperatures(centers) if callable(temperatures) else temperatures
        particles = particle_values(given, centers.shape[0], "initial temperature")
        start = np.full(self.heat.capacity.size, particles.mean())
        start[start.size - self.nodes.states :] = np.repeat(particles, self.states)
        return start

    def state_temperatures(self, unknowns: Floats) -> Floats:
        """Temperatures of the states of each particle, shape (n, states) [K]."""
        return unknowns[unknowns.size - self.nodes.states :].reshape(-1, self.states)

    def particle_temperatures(self, unknowns: Floats) -> Floats:
        """Mean temperature of each particle, shape (n,) [K]."""
        return np.asarray(self.state_temperatures(unknowns).mean(axis=1))

    @property
    def capacities(self) -> Floats:
        """Heat capacity of each particle, shape (n,) [J/K, in 2D J/(m K)]."""
        return np.asarray(self.state_temperatures(self.heat.capacity).sum(axis=1))

    def wall_temperatures(self, time: float, unknowns: Floats) -> Floats:
        """Temperature of each wall of the box [K]; NaN where an insulated or untouched one has none."""
        walls = np.full(len(self.nodes.conditions), np.nan)
        for wall, condition in enumerate(self.nodes.conditions):
            if isinstance(condition, FixedTemperature):
                walls[wall] = condition.temperature(time)
        plates = self.nodes.plates >= 0
        walls[plates] = unknowns[self.nodes.plates[plates]]
        return walls

    def node_temperatures(self, time: float, unknowns: Floats) -> Floats:
        """Temperature of every node, unknown or given."""
        known = np.append(unknowns, 0.0)[self.nodes.unknowns]
        return np.asarray(known + self.nodes.fixed @ self.nodes.temperatures(time))


def particle_sides(system: ParticleSystem, particle: int) -> slice:
    """Rows of one particle among the sides, and so among the flows.

    Raises
    ------
    InputError
        If there is no such particle.
    """
    count = system.medium.packing.count
    if not 0 <= particle < count:
        raise InputError(f"there is no particle {particle}: they are numbered from 0 to {count - 1}")
    return slice(int(system.sides.offsets[particle]), int(system.sides.offsets[particle + 1]))


def joined_walls(walls: Ints, conditions: tuple[WallCondition, ...]) -> Flags:
    """Wall contacts at walls that are not insulated, shape (w,)."""
    return np.array([not isinstance(c, Insulated) for c in conditions])[walls]


def particle_capacities(medium: Medium, given: Floats | None, *, cut: bool) -> Floats:
    """Heat capacity of each particle, shape (n,) [J/K, in 2D J/(m K)].

    Parameters
    ----------
    medium : Medium
    given : ndarray, shape (n,), optional
        Capacities that are known already.
    cut : bool
        Whether contacts of prescribed width cut the particles; geometric ones always do.

    Raises
    ------
    InputError
        If there are none given and the medium has no heat capacity.
    """
    if given is not None:
        return given
    if medium.heat_capacity is None:
        raise InputError("a transient needs the heat capacity of the particles: give the medium one")
    return np.asarray(medium.heat_capacity * medium.links.cut_measures(prescribed=cut))


def state_source(source: Source, count: int, states: int) -> HeatSource:
    """Heat set free in each state of each particle at a time."""

    def spread(values: ArrayLike) -> Floats:
        return np.repeat(particle_values(values, count, "source") / states, states)

    if callable(source):
        return HeatSource(lambda t: spread(source(t)), getattr(source, "knots", ()))
    constant = spread(source)
    return HeatSource(lambda _: constant)
