"""Transient conduction through a lattice: the heat system that `etc_engine.solvers.marching.march` takes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from etc_engine.arrays import Floats, Ints
from etc_engine.engines.lattice.body import SURFACE
from etc_engine.engines.lattice.network import Conductances, Lattice
from etc_engine.errors import InputError
from etc_engine.medium.links import laplacian
from etc_engine.medium.walls import Convective, FixedTemperature, HeatFlux, Insulated, WallCondition
from etc_engine.solvers.marching import HeatSystem


def heat_system(
    lattice: Lattice,
    conductances: Conductances,
    heat_capacity: ArrayLike,
    walls: Mapping[int, WallCondition],
    *,
    source: ArrayLike = 0.0,
) -> HeatSystem:
    """Heat system of a lattice, C_p dT_p/dt = sum_q W_{q -> p} + wall flows + s V_p, with C_p = rho c V_p.

    Parameters
    ----------
    lattice : Lattice
    conductances : Conductances
    heat_capacity : float or array_like, shape (n,) [J/(m3 K)]
        Density times specific heat of the body at each node.
    walls : mapping
        Condition of each wall by its number (`etc_engine.engines.lattice.body.SURFACE` for a carved
        surface); walls that are left out are insulated.
    source : float or array_like, shape (n,) [W/m3]
        Heat set free in the body.

    Returns
    -------
    HeatSystem
        Its heat flows are those into the body at the walls in the order of the mapping, and the sources' last.

    Raises
    ------
    InputError
        If a heat capacity is not positive, or a wall has no link.

    Notes
    -----
    A node stands for the volume V_p of the body, not for that of its particle: mass is conserved. The film of a
    convective wall lies in series with every wall link.

    References
    ----------
    Haddad et al. 2021, eqs. 4, 5 (corrected), doi:10.1016/j.ijthermalsci.2020.106799.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.engines.lattice.network import laguerre_lattice, link_conductances
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> from etc_engine.solvers.marching import march
    >>> one = laguerre_lattice(ParticlePacking([[0.5, 0.5, 0.5]], [0.2], Box((1.0, 1.0, 1.0))))
    >>> system = heat_system(one, link_conductances(one, 2.0), 10.0, {0: FixedTemperature(3.0)})
    >>> *_, late = march(system, np.zeros(1), [0.0, 100.0], scheme="backward-euler", steps=50)
    >>> round(float(late.temperatures[0]), 6), round(late.stored, 6)
    (3.0, 30.0)
    """
    n = lattice.count
    capacity = np.broadcast_to(np.asarray(heat_capacity, dtype=np.float64), (n,))
    if not (np.isfinite(capacity) & (capacity > 0.0)).all():
        raise InputError(f"heat capacities must be positive and finite, found {float(capacity.min()):g} J/(m3 K)")
    heat = np.broadcast_to(np.asarray(source, dtype=np.float64), (n,)) * lattice.volumes
    links = {wall: _wall_links(lattice, wall) for wall in walls}
    tied = conductances.walls.copy()
    held = np.zeros(lattice.walls.size, dtype=bool)
    for wall, condition in walls.items():
        rows = links[wall]
        if isinstance(condition, Convective):
            film = condition.coefficient * _areas(lattice, wall)
            tied[rows] = tied[rows] * film / (tied[rows] + film)
        held[rows] = isinstance(condition, FixedTemperature | Convective)
    matrix = laplacian(n, lattice.pairs, conductances.links, lattice.wall_particles[held], tied[held])

    def wall_flow(t: float, wall: int) -> tuple[Floats, Floats]:
        """Heat flow into each linked node: the part that is given, and what a kelvin of the node takes off it."""
        condition, rows = walls[wall], links[wall]
        if isinstance(condition, FixedTemperature | Convective):
            return tied[rows] * condition.temperature(t), tied[rows]
        if isinstance(condition, HeatFlux):
            return condition.flux(t) * _areas(lattice, wall), np.zeros(rows.size)
        return np.zeros(rows.size), np.zeros(rows.size)

    def load(t: float) -> Floats:
        total = heat.copy()
        for wall in walls:
            total += np.bincount(lattice.wall_particles[links[wall]], wall_flow(t, wall)[0], minlength=n)
        return total

    def heat_rates(t: float, temperatures: Floats) -> Floats:
        flows = []
        for wall in walls:
            given, taken = wall_flow(t, wall)
            flows.append(float((given - taken * temperatures[lattice.wall_particles[links[wall]]]).sum()))
        return np.array([*flows, float(heat.sum())])

    knots = {knot for c in walls.values() if not isinstance(c, Insulated) for knot in c.knots}
    return HeatSystem(lattice.volumes * capacity, matrix, load, heat_rates, knots=tuple(sorted(knots)))


def safe_step(lattice: Lattice, system: HeatSystem) -> float:
    """Largest explicit step that keeps every temperature between those of its neighbours [s].

    dt = min_p C_p / sum_q H_pq, wall links included; never above the critical step 2 / lambda_max.

    Parameters
    ----------
    lattice : Lattice
    system : HeatSystem
        From `heat_system`.

    Returns
    -------
    float [s]

    Notes
    -----
    A limit from the mean radius (Haddad et al. 2021, eq. 15) is twice the critical step of a polydisperse packing.
    """
    if lattice.count != system.capacity.size:
        raise InputError(f"the system has {system.capacity.size} nodes, the lattice {lattice.count}")
    diagonal = system.conductance.diagonal()
    linked = diagonal > 0.0
    return float((system.capacity[linked] / diagonal[linked]).min(initial=np.inf))


def _wall_links(lattice: Lattice, wall: int) -> Ints:
    rows = np.flatnonzero(lattice.walls == wall)
    if rows.size == 0:
        raise InputError(
            f"no node is linked to wall {wall}: walls are 0 .. 5 along the axes that do not repeat, "
            f"{SURFACE} for a carved surface"
        )
    return rows


def _areas(lattice: Lattice, wall: int) -> Floats:
    """Part of the area of a wall that belongs to each of its links [m2]."""
    sections = lattice.wall_sections[lattice.walls == wall]
    if wall == SURFACE:
        return sections
    return np.asarray(sections / sections.sum() * lattice.packing.box.cross_section(wall // 2))
