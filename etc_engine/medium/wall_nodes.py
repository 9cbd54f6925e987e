"""What the walls of a box make of the nodes of a transient: given temperatures, or plates that join contacts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from etc_engine.errors import InputError
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.walls import WALLS, Convective, FixedTemperature, HeatFlux, WallCondition

FIRM = 1e4
"""A film over so many times the conductance behind its plate tells the flow worse than what is behind does.

Both carry the same flow. Over the film it balances exactly, but to film * T * 1e-16; behind the plate it balances to
what an iterative solver left there.
"""


@dataclass(frozen=True, eq=False)
class WallNodes:
    """Nodes numbered as unknowns: free contact nodes, then a plate for each wall that has one, then the states.

    A wall with a heat flux and a convective wall are plates: one node without capacity for all their contacts.

    Parameters
    ----------
    conditions : tuple of condition
        Of the walls 0, 1, ... of the box.
    plates : ndarray of int, shape (walls,)
        Unknown of each wall's plate, -1 where it has none.
    faces : ndarray, shape (walls,) [m]
        Length of each wall, its area per unit thickness.
    exchange : ndarray, shape (walls,) [W/(m K)]
        Conductance to the ambient of a convective wall, 0 elsewhere.
    unknowns : ndarray of int, shape (nodes,)
        -1 where the temperature is given.
    fixed : csr_matrix, shape (nodes, walls)
        1 where a node takes the temperature of a wall.
    size : int
        Number of unknowns.
    """

    conditions: tuple[WallCondition, ...]
    plates: NDArray[np.int64]
    faces: NDArray[np.float64]
    exchange: NDArray[np.float64]
    unknowns: NDArray[np.int64]
    fixed: csr_matrix
    size: int

    def temperatures(self, t: float) -> NDArray[np.float64]:
        """Given wall temperatures, shape (walls,), 0 where there is none [K]."""
        return np.array([c.temperature(t) if isinstance(c, FixedTemperature) else 0.0 for c in self.conditions])

    def plate_heat(self, t: float) -> NDArray[np.float64]:
        """Given part of the heat into each plate, shape (walls,) [W/m]."""
        heat = np.zeros(len(self.conditions))
        for wall in np.flatnonzero(self.plates >= 0):
            condition = self.conditions[wall]
            if isinstance(condition, HeatFlux):
                heat[wall] = self.faces[wall] * condition.flux(t)
            elif isinstance(condition, Convective):
                heat[wall] = self.exchange[wall] * condition.temperature(t)
        return heat


def number_nodes(network: ContactNetwork, conditions: tuple[WallCondition, ...], modes: int, states: int) -> WallNodes:
    """Number the nodes of a network: modes of its contacts and wall contacts, then states.

    Parameters
    ----------
    network : ContactNetwork
        Without contacts at insulated walls.
    conditions : tuple of condition
    modes : int
        Flux modes of a contact. A wall is isothermal, so that it holds all but mode 0 of its contacts at zero.
    states : int
        States of all particles.

    Raises
    ------
    InputError
        If a heat flux meets no particle.
    """
    number, walls = len(conditions), network.walls
    held = np.array([isinstance(c, FixedTemperature) for c in conditions])
    touched = np.isin(np.arange(number), walls)
    for wall, condition in enumerate(conditions):
        if isinstance(condition, HeatFlux) and not touched[wall]:
            raise InputError(
                f"no particle touches the {WALLS[wall]} wall: its heat flux has nowhere to go; insulate it"
            )
    has_plate = np.array([isinstance(c, HeatFlux | Convective) for c in conditions]) & touched
    at_wall = modes * (network.count + np.arange(walls.size))  # mode 0 of each wall contact

    free = np.ones(modes * (network.count + walls.size), dtype=np.bool_)
    free[modes * network.count :] = False
    contacts = int(free.sum())
    plates = np.where(has_plate, contacts + np.cumsum(has_plate) - 1, -1)
    unknowns = np.where(free, np.cumsum(free) - 1, -1)
    unknowns[at_wall] = plates[walls]
    size = contacts + int(has_plate.sum()) + states
    nodes = unknowns.size + states
    here = held[walls]
    faces = np.array([network.packing.box.cross_section(wall // 2) for wall in range(number)])
    return WallNodes(
        conditions=conditions,
        plates=plates,
        faces=faces,
        exchange=faces * [c.coefficient if isinstance(c, Convective) else 0.0 for c in conditions],
        unknowns=np.concatenate([unknowns, size - states + np.arange(states)]),
        fixed=csr_matrix((np.ones(here.sum()), (at_wall[here], walls[here])), shape=(nodes, number)),
        size=size,
    )
