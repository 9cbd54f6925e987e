"""Which method makes which system: one line a method."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from etc_engine.engines.dtem.storage import stored_areas
from etc_engine.engines.dtem.transient import transient_system
from etc_engine.engines.pipe.conductances import PIPE_RESISTANCES
from etc_engine.engines.pipe.transient import pipe_transient
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.walls import WallCondition
from etc_engine.solvers.marching import HeatSystem


class ParticleSystem(Protocol):
    """What a method gives: a system to march, and the particles' mean temperatures in it.

    The heat rates of ``heat`` are those into the particles from the walls 0, 1, ... of the box, and from the sources.
    """

    @property
    def heat(self) -> HeatSystem:
        """The system of all unknowns."""

    def initial(self, temperatures: ArrayLike | Callable[[NDArray[np.float64]], ArrayLike]) -> NDArray[np.float64]:
        """Unknowns of particles of given temperatures."""

    def particle_temperatures(self, temperatures: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mean temperatures of the particles out of all unknowns, shape (n,)."""


@dataclass(frozen=True, eq=False)
class Physics:
    """What a study says about the particles, besides their contacts.

    Parameters
    ----------
    conductivity, heat_capacity : float or ndarray, shape (n,) [W/(m K)], [J/(m3 K)]
    contact_resistance : float [m K/W]
    walls : mapping of str to WallCondition
    source : callable
        t -> heat set free in each particle, shape (n,) [W/m].
    pipe_resistance : str
        With ``pipe``.
    dipoles : bool
        With the discrete thermal elements.
    """

    conductivity: ArrayLike
    heat_capacity: ArrayLike
    contact_resistance: float
    walls: Mapping[str, WallCondition]
    source: Callable[[float], NDArray[np.float64]]
    pipe_resistance: str = "chord"
    dipoles: bool = False


def _pipe(network: ContactNetwork, physics: Physics) -> ParticleSystem:
    return pipe_transient(
        network,
        physics.walls,
        resistance=physics.pipe_resistance,
        conductivity=physics.conductivity,
        heat_capacity=physics.heat_capacity,
        contact_resistance=physics.contact_resistance,
        source=physics.source,
    )


def _elements(network: ContactNetwork, physics: Physics, *, method: str) -> ParticleSystem:
    return transient_system(
        network,
        physics.walls,
        method=method,
        dipoles=physics.dipoles,
        conductivity=physics.conductivity,
        heat_capacity=physics.heat_capacity,
        contact_resistance=physics.contact_resistance,
        source=physics.source,
    )


def storing_area(network: ContactNetwork, method: str, physics: Physics) -> NDArray[np.float64]:
    """Area in which a method stores heat, of each particle, shape (n,) [m2]."""
    return stored_areas(network, PIPE_RESISTANCES[physics.pipe_resistance] if method == "pipe" else method)


SYSTEMS: Mapping[str, Callable[[ContactNetwork, Physics], ParticleSystem]] = {
    "pipe": _pipe,
    "chord": partial(_elements, method="chord"),
    "standard": partial(_elements, method="standard"),
    "enhanced": partial(_elements, method="enhanced"),
    "arc": partial(_elements, method="arc"),
}
"""The system of a contact network, by the word of its method."""
