r"""Heat conduction in time through the pipe network of a packing.

Every particle stores heat at its mean temperature, and every contact is a pipe between two of them:

    rho c V_i dT_i/dt = sum_c C_c (T_j - T_i) + C_w (T_wall - T_i) + source_i,

with V_i the area of the disk less what its contact chords cut off. A wall with a heat flux and a convective wall are
plates of infinite conductivity and no heat capacity: one node without capacity each, which its wall contacts share.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_matrix

from etc_engine.engines.dtem.storage import stored_areas
from etc_engine.engines.pipe.conductances import PIPE_RESISTANCES, pipe_conductances
from etc_engine.engines.pipe.steady import pipe_laplacian
from etc_engine.errors import InputError
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.wall_nodes import FIRM
from etc_engine.medium.walls import (
    WALLS,
    Convective,
    FixedTemperature,
    HeatFlux,
    WallCondition,
    wall_conditions,
)
from etc_engine.packing.particles import particle_values
from etc_engine.solvers.marching import HeatSystem

Source = ArrayLike | Callable[[float], ArrayLike]
Initial = ArrayLike | Callable[[NDArray[np.float64]], ArrayLike]


@dataclass(frozen=True, eq=False)
class PipeTransient:
    """A pipe network ready to be marched in time, and how its unknowns are read.

    Parameters
    ----------
    heat : HeatSystem
        Of the mean temperatures of all particles, then of the plates. Its heat rates are those into the particles
        from the walls 0, 1, ... of the box, and from the sources.
    network : ContactNetwork
    conditions : tuple of WallCondition
        At each wall of the box.
    plates : ndarray of int
        Wall of each plate.
    """

    heat: HeatSystem
    network: ContactNetwork
    conditions: tuple[WallCondition, ...]
    plates: NDArray[np.int64]

    def initial(self, temperatures: Initial) -> NDArray[np.float64]:
        """Unknowns at the start: a value, one for each particle, or a function of the centres, shape (n, d).

        Raises
        ------
        InputError
            If they are not finite or not as many as the particles.
        """
        centers = self.network.packing.centers
        given = np.asarray(temperatures(centers) if callable(temperatures) else temperatures, dtype=np.float64)
        particles = particle_values(given, centers.shape[0], "initial temperature")
        return np.concatenate([particles, np.full(self.plates.size, particles.mean())])

    def particle_temperatures(self, temperatures: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mean temperature of each particle, shape (n,) [K]."""
        return temperatures[: self.network.packing.count]

    def wall_temperatures(self, time: float, temperatures: NDArray[np.float64]) -> NDArray[np.float64]:
        """Temperature of each wall of the box [K]; NaN where an insulated or untouched one has none."""
        walls = np.array([c.temperature(time) if isinstance(c, FixedTemperature) else np.nan for c in self.conditions])
        walls[self.plates] = temperatures[self.network.packing.count :]
        return walls


def pipe_transient(
    network: ContactNetwork,
    walls: Mapping[str, WallCondition],
    *,
    resistance: str = "chord",
    conductivity: ArrayLike = 1.0,
    heat_capacity: ArrayLike = 1.0,
    contact_resistance: ArrayLike = 0.0,
    source: Source = 0.0,
) -> PipeTransient:
    """Pipe network of a packing with storage, and the conditions at the walls of its box.

    Parameters
    ----------
    network : ContactNetwork
        All particles take part; one without contacts keeps its heat.
    walls : mapping of str to condition
        By the names of `etc_engine.medium.walls.WALLS`; a wall that is not named is insulated.
    resistance, conductivity, contact_resistance
        As in `etc_engine.engines.pipe.conductances.pipe_conductances`.
    heat_capacity : float or array_like, shape (n,) [J/(m3 K)]
        rho c of all particles, or of each.
    source : float, array_like, shape (n,), or callable of t [W/m]
        Heat set free in each particle, per unit thickness.

    Returns
    -------
    PipeTransient

    Raises
    ------
    InputError
        If a value or a wall is not understood, or a wall with a heat flux touches nothing.
    GeometryError
        If contact arcs of one particle overlap.

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
    >>> from etc_engine.solvers.marching import march
    >>> disks = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    >>> pipes = pipe_transient(bonded_contacts(disks, 0.2), {"left": FixedTemperature(1.0)}, source=[0.0, 0.1])
    >>> *_, late = march(pipes.heat, pipes.initial(0.0), [0.0, 40.0], steps=200)
    >>> bool(pipes.particle_temperatures(late.temperatures)[1] > 1.0), round(float(late.heat[-1]), 9)
    (True, 4.0)
    """
    packing, n = network.packing, network.packing.count
    conditions = wall_conditions(packing.box, walls)
    between, at_wall = pipe_conductances(
        network, resistance=resistance, conductivity=conductivity, contact_resistance=contact_resistance
    )
    density = particle_values(heat_capacity, n, "heat capacity")
    if not (density > 0.0).all():
        raise InputError(f"the heat capacity must be positive, found {density.min():g}")
    capacity = density * stored_areas(network, PIPE_RESISTANCES[resistance])

    touched = np.isin(np.arange(len(conditions)), network.walls)
    for wall, condition in enumerate(conditions):
        if isinstance(condition, HeatFlux) and not touched[wall]:
            raise InputError(
                f"no particle touches the {WALLS[wall]} wall: its heat flux has nowhere to go; insulate it"
            )
    plates = np.flatnonzero(touched & [isinstance(c, HeatFlux | Convective) for c in conditions])
    fixed = np.array([isinstance(c, FixedTemperature) for c in conditions])[network.walls]
    on_plate = np.isin(network.walls, plates)
    faces = np.array([packing.box.cross_section(wall // 2) for wall in range(len(conditions))])
    films = np.array([_film(conditions[wall], faces[wall]) for wall in plates])
    plate_node = n + np.searchsorted(plates, network.walls[on_plate])
    matrix = pipe_laplacian(
        n + plates.size,
        np.concatenate([network.pairs, np.stack([network.wall_particles[on_plate], plate_node], axis=1)]),
        np.concatenate([between, at_wall[on_plate]]),
        np.concatenate([network.wall_particles[fixed], n + np.arange(plates.size)]),
        np.concatenate([at_wall[fixed], films]),
    )
    links = csr_matrix(
        (at_wall[fixed], (network.wall_particles[fixed], network.walls[fixed])), shape=(n, len(conditions))
    )
    heat = _heat_system(
        np.concatenate([capacity, np.zeros(plates.size)]),
        matrix,
        links,
        conditions,
        plates,
        films,
        faces,
        _source(source, n),
    )
    return PipeTransient(heat, network, conditions, plates)


def _film(condition: WallCondition, face: float) -> float:
    """Conductance between a plate and its ambient [W/(m K)]."""
    return condition.coefficient * face if isinstance(condition, Convective) else 0.0


def _heat_system(
    capacity: NDArray[np.float64],
    matrix: csr_matrix,
    links: csr_matrix,
    conditions: tuple[WallCondition, ...],
    plates: NDArray[np.int64],
    films: NDArray[np.float64],
    faces: NDArray[np.float64],
    source: Callable[[float], NDArray[np.float64]],
) -> HeatSystem:
    """Loads and heat flows of the walls; ``links`` join particles to walls of given temperature."""
    n = links.shape[0]
    totals = np.asarray(links.sum(axis=0)).ravel()
    joined = csr_matrix(-matrix[n:, :n])
    joints = np.asarray(joined.sum(axis=1)).ravel()
    by_film = films <= FIRM * joints

    def given(t: float) -> NDArray[np.float64]:
        return np.array([c.temperature(t) if isinstance(c, FixedTemperature) else 0.0 for c in conditions])

    def into_plates(t: float) -> NDArray[np.float64]:
        heat = np.zeros(plates.size)
        for k, wall in enumerate(plates):
            condition = conditions[wall]
            if isinstance(condition, HeatFlux):
                heat[k] = faces[wall] * condition.flux(t)
            elif isinstance(condition, Convective):
                heat[k] = films[k] * condition.temperature(t)
        return heat

    def load(t: float) -> NDArray[np.float64]:
        return np.concatenate([links @ given(t) + source(t), into_plates(t)])

    def heat_rates(t: float, temperatures: NDArray[np.float64]) -> NDArray[np.float64]:
        rates = totals * given(t) - links.T @ temperatures[:n]
        through_film = into_plates(t) - films * temperatures[n:]
        rates[plates] = np.where(by_film, through_film, joints * temperatures[n:] - joined @ temperatures[:n])
        return np.append(rates, source(t).sum())

    return HeatSystem(capacity, matrix, load, heat_rates)


def _source(source: Source, count: int) -> Callable[[float], NDArray[np.float64]]:
    """Heat set free in each particle at a time [W/m]."""
    if callable(source):
        history = source
        return lambda t: particle_values(history(t), count, "source")
    constant = particle_values(source, count, "source")
    return lambda _: constant
