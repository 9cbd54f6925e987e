"""Walls of a transient: given temperatures, or plates that join contacts. One heat system for all engines on contacts.

A wall with a heat flux and a convective wall are plates: one node without capacity for all their contacts. The system
of all unknowns is C dT/dt = f(t) - K T, where wall contacts are folded into their plates and those at given
temperatures go to the right-hand side.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix, diags_array

from etc_engine.arrays import Floats, Ints
from etc_engine.box import Box
from etc_engine.errors import InputError
from etc_engine.medium.walls import WALLS, Convective, FixedTemperature, HeatFlux, Insulated, WallCondition
from etc_engine.solvers.marching import HeatSystem

STIFF_FILM = 1e4
"""Above this ratio of a film to the conductance behind its plate, the heat flow is read behind the plate.

Both carry the same flow. Over the film it balances exactly, except for rounding of film * T; behind the plate it
balances to what an iterative solver left there.
"""

Source = Callable[[float], Floats]
"""t -> heat set free in each state [W, in 2D W/m]."""


@dataclass(frozen=True, eq=False)
class WallNodes:
    """Nodes numbered as unknowns: free contact nodes, then a plate for each wall that has one, then the states.

    Parameters
    ----------
    conditions : tuple of condition
        Of the walls 0, 1, ... of the box.
    plates : ndarray of int, shape (walls,)
        Unknown of each wall's plate, -1 where it has none.
    faces : ndarray, shape (walls,) [m2, in 2D m]
        Area of each wall.
    exchange : ndarray, shape (walls,) [W/K, in 2D W/(m K)]
        Conductance to the ambient of a convective wall, 0 elsewhere.
    unknowns : ndarray of int, shape (nodes,)
        -1 where the temperature is given.
    fixed : csr_matrix, shape (nodes, walls)
        1 where a node takes the temperature of a wall.
    size : int
        Number of unknowns.
    states : int
        Number of states, the last of the unknowns.
    """

    conditions: tuple[WallCondition, ...]
    plates: Ints
    faces: Floats
    exchange: Floats
    unknowns: Ints
    fixed: csr_matrix
    size: int
    states: int

    def temperatures(self, t: float) -> Floats:
        """Given wall temperatures, shape (walls,), 0 where there is none [K]."""
        return np.array([c.temperature(t) if isinstance(c, FixedTemperature) else 0.0 for c in self.conditions])

    def plate_heat(self, t: float) -> Floats:
        """Given part of the heat into each plate, shape (walls,) [W/m]."""
        heat = np.zeros(len(self.conditions))
        for wall in np.flatnonzero(self.plates >= 0):
            condition = self.conditions[wall]
            if isinstance(condition, HeatFlux):
                heat[wall] = self.faces[wall] * condition.flux(t)
            elif isinstance(condition, Convective):
                heat[wall] = self.exchange[wall] * condition.temperature(t)
        return heat


def number_nodes(
    box: Box,
    walls: Ints,
    conditions: tuple[WallCondition, ...],
    *,
    contacts: int = 0,
    modes: int = 1,
    states: int,
) -> WallNodes:
    """Number the nodes of a network: modes of its contacts and of its wall contacts, then states.

    Parameters
    ----------
    box : Box
    walls : ndarray of int, shape (w,)
        Wall of each wall contact, none of them insulated.
    conditions : tuple of condition
        Of the walls 0, 1, ... of the box.
    contacts : int
        Number of particle contacts that are nodes.
    modes : int
        Flux modes of a contact. A wall is isothermal, so that it holds all but mode 0 of its contacts at zero.
    states : int
        States of all particles.

    Raises
    ------
    InputError
        If a heat flux meets no particle.
    """
    number = len(conditions)
    held = np.array([isinstance(c, FixedTemperature) for c in conditions])
    touched = np.isin(np.arange(number), walls)
    for wall, condition in enumerate(conditions):
        if isinstance(condition, HeatFlux) and not touched[wall]:
            raise InputError(
                f"no particle touches the {WALLS[wall]} wall: its heat flux has nowhere to go; insulate it"
            )
    has_plate = np.array([isinstance(c, HeatFlux | Convective) for c in conditions]) & touched
    at_wall = modes * (contacts + np.arange(walls.size))  # mode 0 of each wall contact
    free = modes * contacts
    plates = np.where(has_plate, free + np.cumsum(has_plate) - 1, -1)
    unknowns = np.full(modes * (contacts + walls.size), -1)
    unknowns[:free] = np.arange(free)
    unknowns[at_wall] = plates[walls]
    size = free + int(has_plate.sum()) + states
    here = held[walls]
    faces = np.array([box.cross_section(wall // 2) for wall in range(number)])
    return WallNodes(
        conditions=conditions,
        plates=plates,
        faces=faces,
        exchange=faces * [c.coefficient if isinstance(c, Convective) else 0.0 for c in conditions],
        unknowns=np.concatenate([unknowns, size - states + np.arange(states)]),
        fixed=csr_matrix((np.ones(here.sum()), (at_wall[here], walls[here])), shape=(unknowns.size + states, number)),
        size=size,
        states=states,
    )


def heat_system(matrix: csr_matrix, nodes: WallNodes, capacities: Floats, source: Source) -> HeatSystem:
    """Heat system of the unknowns; its heat flows are those into the particles at walls 0, 1, ... and from the sources.

    Parameters
    ----------
    matrix : csr_matrix, shape (nodes, nodes) [W/K, in 2D W/(m K)]
        Conductances between all nodes, as if none had a given temperature.
    nodes : WallNodes
    capacities : ndarray, shape (states,) [J/K, in 2D J/(m K)]
    source : callable
    """
    known = np.flatnonzero(nodes.unknowns >= 0)
    fold = csr_matrix((np.ones(known.size), (known, nodes.unknowns[known])), shape=(matrix.shape[0], nodes.size))
    alone = csr_matrix(fold.T @ matrix @ fold)
    plates = np.flatnonzero(nodes.plates >= 0)
    at = nodes.plates[plates]
    exchange = np.zeros(nodes.size)
    exchange[at] = nodes.exchange[plates]
    conductance = csr_matrix(alone + diags_array(exchange))
    conductance.sort_indices()
    behind = alone[at]
    by_film = exchange[at] <= STIFF_FILM * alone.diagonal()[at]
    links = -np.asarray((fold.T @ matrix @ nodes.fixed).todense())  # between unknowns and walls of given temperature
    own = np.asarray((nodes.fixed.T @ matrix @ nodes.fixed).todense())

    def load(t: float) -> Floats:
        f = links @ nodes.temperatures(t)
        f[nodes.size - nodes.states :] += source(t)
        f[at] += nodes.plate_heat(t)[plates]
        return np.asarray(f)

    def heat_rates(t: float, temperatures: Floats) -> Floats:
        rates = nodes.plate_heat(t) + own @ nodes.temperatures(t) - links.T @ temperatures
        through_film = rates[plates] - (exchange * temperatures)[at]
        into_particles = behind @ temperatures - (links @ nodes.temperatures(t))[at]
        rates[plates] = np.where(by_film, through_film, into_particles)
        return np.append(rates, source(t).sum())

    def source_load(t: float) -> Floats:
        return np.concatenate([np.zeros(nodes.size - nodes.states), source(t)])

    knots = {knot for condition in nodes.conditions if not isinstance(condition, Insulated) for knot in condition.knots}
    return HeatSystem(
        np.concatenate([np.zeros(nodes.size - nodes.states), capacities]),
        conductance,
        load,
        heat_rates,
        source_load,
        tuple(sorted({*knots, *getattr(source, "knots", ())})),
    )
