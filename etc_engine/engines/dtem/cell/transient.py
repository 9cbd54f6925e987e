"""Heat conduction in time through disks and fluid by the cell element.

The unknowns of the frames have no capacity. Every cell stores its heat, of the disk and of the fluid around it, at the
mean temperature of the disk. At rest the temperatures are those of the steady cell element.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.sparse import csr_matrix

from etc_engine.arrays import Floats, Ints
from etc_engine.engines.dtem.cell.conductivity import ALIKE
from etc_engine.engines.dtem.cell.geometry import DEGREE, CellGeometry, Resolution
from etc_engine.engines.dtem.cell.medium import edge_network, medium_geometry
from etc_engine.engines.dtem.cell.recovery import recover_values
from etc_engine.engines.dtem.cell.steady import CellModel, build_model, wall_unknowns
from etc_engine.errors import InputError
from etc_engine.medium.medium import Medium, check_conductors
from etc_engine.medium.sides import contact_sides
from etc_engine.medium.transient import ParticleSystem, Source, joined_walls, particle_capacities, state_source
from etc_engine.medium.wall_nodes import heat_system, number_nodes
from etc_engine.medium.walls import Insulated, WallCondition, wall_conditions


def cell_system(
    medium: Medium,
    walls: Mapping[str, WallCondition],
    *,
    method: str = "cell",
    degree: int = DEGREE,
    source: Source = 0.0,
    capacities: Floats | None = None,
    **_: object,
) -> ParticleSystem:
    """Cells that store heat, assembled, with the conditions at the walls of the box.

    Parameters
    ----------
    medium : Medium
        Two-dimensional, with contacts, heat capacities, and pores that conduct (and may store heat).
    walls : mapping of str to condition
        By the names of `etc_engine.medium.walls.WALLS`; a wall that is not named is insulated. The whole face of a wall
        has one temperature.
    method : str
        ``cell``.
    degree : int
        Polynomial degree of the temperature on the edges of cells.
    source : float, array_like, shape (n,), or callable of t [W/m]
        Heat set free evenly in all disks, or in each.
    capacities : ndarray, shape (n,), optional [J/(m K)]
        Of the disks; rho c times what their contacts leave of them by default. That of the fluid is added.

    Returns
    -------
    ParticleSystem
        With one state per disk. Its medium has a link for every Laguerre edge.

    Raises
    ------
    InputError, GeometryError
        Also if disks conduct worse than the fluid: their cells are only good at steady state, by duality.

    Notes
    -----
    A disk that warms evenly lags behind the mean of its rim by Q/(8 pi k_s) for a heat flow Q into it; earlier
    times, t << R^2/a, are not resolved. The fluid stores its heat at the temperature of the disk inside it.
    """
    check_conductors(medium)
    solid, fluid = medium.conductivity, medium.pores.conductivity
    if float(solid.min()) * ALIKE < fluid:
        raise InputError(
            f"a transient by method {method} needs disks that conduct at least as well as the pores, found "
            f"{solid.min():g} in {fluid:g}"
        )
    conditions = wall_conditions(medium.box, walls)
    joined = np.array([not isinstance(c, Insulated) for c in conditions])
    geometry = medium_geometry(medium).with_walls(joined)
    model = build_model(geometry, solid, fluid, Resolution(degree), storing=True)
    n = geometry.count
    fold, driven = _fold(model, np.flatnonzero(joined))
    nodes = number_nodes(medium.box, driven, conditions, contacts=fold.shape[1] - driven.size - n, states=n)
    stored = particle_capacities(medium, capacities, cut=False) + medium.pores.heat_capacity * fluid_areas(geometry)
    matrix = csr_matrix(fold.T @ model.system.matrix @ fold)
    system = heat_system(matrix, nodes, stored, state_source(source, n, 1))
    network = edge_network(medium, geometry)
    kept = joined_walls(network.walls, conditions)
    sides = contact_sides(network.select(np.ones(network.count, dtype=np.bool_), kept))
    between, wall = np.flatnonzero(~geometry.cells.at_wall), np.flatnonzero(geometry.cells.at_wall)[kept]

    def flows(time: float, unknowns: Floats) -> Floats:
        """Heat into the cell of each side, across its edge."""
        values = fold @ made.node_temperatures(time, unknowns)
        edge_flows = recover_values(model, values[model.frame.unknowns], np.zeros(n)).edge_flows
        out = np.empty(sides.nodes.size)
        out[sides.of_contacts[:, 0]] = -edge_flows[between]
        out[sides.of_contacts[:, 1]] = edge_flows[between]
        out[sides.of_walls] = -edge_flows[wall]
        return out

    made = ParticleSystem(system, medium.with_network(network), nodes, sides, np.flatnonzero(kept), flows)
    return made


def _fold(model: CellModel, joined: Ints) -> tuple[csr_matrix, Ints]:
    """Frame unknowns from nodes: free unknowns, one node per joined wall, disks. Returns it and the walls.

    Where two such walls meet, the first one has the corner.
    """
    count, n = model.frame.count, model.geometry.count
    owner = np.full(count, -1)
    for place, wall in enumerate(joined):
        unknowns = wall_unknowns(model, int(wall))
        free = owner[unknowns] < 0
        owner[unknowns[free]] = place
    inner = (owner < 0) & (np.arange(count) < count - n)
    number = int(inner.sum())
    column = np.where(owner >= 0, number + owner, 0)
    column[inner] = np.arange(number)
    column[count - n :] = number + joined.size + np.arange(n)
    shape = (count, number + joined.size + n)
    return csr_matrix((np.ones(count), (np.arange(count), column)), shape=shape), joined


def fluid_areas(geometry: CellGeometry) -> Floats:
    """Area of the fluid in each cell, shape (n,) [m2]: the cell less what the edges leave of the disk."""
    cells, edges = geometry.cells, geometry.edges
    following = np.arange(1, cells.edges.size + 1)
    following[cells.starts[1:] - 1] = cells.starts[:-1]
    x, y = cells.corners.T
    twice = np.add.reduceat(x * y[following] - x[following] * y, cells.starts[:-1])
    # a chord over the half-width b at the distance h cuts R^2 (alpha - sin(alpha) cos(alpha)) off the disk
    own = np.where(cells.forward, 0, 1)
    owner = np.repeat(np.arange(geometry.count), np.diff(cells.starts))
    inside = np.minimum(edges.distances[cells.edges, own] / geometry.radii[owner], 1.0)
    alpha = np.arccos(inside)
    cut = geometry.radii[owner] ** 2 * (alpha - np.sin(alpha) * inside)
    disk = np.pi * geometry.radii**2 - np.add.reduceat(cut, cells.starts[:-1])
    return np.maximum(0.5 * twice - disk, 0.0)
