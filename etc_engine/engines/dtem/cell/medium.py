"""The cell element on a medium: contacts of a network placed on Laguerre edges, conductivity, and fields."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from etc_engine.arrays import Floats, Ints
from etc_engine.engines.dtem.cell.bounds import conductivity_bounds
from etc_engine.engines.dtem.cell.conductivity import CALIBRATED_ERROR, cell_conductivity
from etc_engine.engines.dtem.cell.conductivity import error_estimate as estimate_error
from etc_engine.engines.dtem.cell.edges import EdgeContacts
from etc_engine.engines.dtem.cell.geometry import DEGREE, CellGeometry, Resolution, cell_geometry
from etc_engine.engines.dtem.cell.recovery import recover_cells, temperatures_inside
from etc_engine.engines.dtem.cell.steady import CellSolution
from etc_engine.errors import GeometryError
from etc_engine.medium.conduction import Conduction, Result, attempt
from etc_engine.medium.conductivity import EffectiveConductivity
from etc_engine.medium.field import ParticleField
from etc_engine.medium.medium import Medium, check_conductors
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.sides import contact_sides
from etc_engine.structure.laguerre_2d import LaguerreCells, laguerre_cells


def disk_conductivity(
    medium: Medium,
    *,
    degree: int = DEGREE,
    error_estimate: bool = False,
    bounds: bool = False,
    axes: tuple[int, ...] | None = None,
    tolerance: float = 1e-10,
    geometry: CellGeometry | None = None,
) -> EffectiveConductivity[CellSolution]:
    """Effective conductivity of disks and of the fluid between them, by the cell element.

    Parameters
    ----------
    medium : Medium
        Two-dimensional, with a contact network and pores that conduct.
    degree : int
        Polynomial degree of the temperature on the edges of cells, 1 to 5.
    error_estimate : bool
        Whether ``model_error`` is estimated, from two finer computations.
    bounds : bool
        Whether rigorous ``bounds`` are computed, by a conforming mesh: at most 400 disks.
    axes : tuple of int, optional
        Load axes; all by default.
    tolerance : float
        Relative error of the conductivity left by the solver.
    geometry : CellGeometry, optional
        Of the same network, if already known.

    Returns
    -------
    EffectiveConductivity
        Every axis is spanned, through the fluid. Where some disks conduct better and others worse than the fluid,
        ``model_error`` is at least the distance of the direct and the dual value.

    Raises
    ------
    InputError, GeometryError, ConvergenceError

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.medium import Pores
    >>> from etc_engine.medium.rules import bonded_contacts
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> disk = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0), (True, True)))
    >>> medium = Medium(disk, 1.0, bonded_contacts(disk, 0.1), Pores(0.1))
    >>> round(float(disk_conductivity(medium).tensor[0, 0]), 2)
    0.61
    """
    check_conductors(medium)
    geometry = geometry or medium_geometry(medium)
    solid, fluid = medium.conductivity, medium.pores.conductivity
    resolution = Resolution(degree)
    found = cell_conductivity(geometry, solid, fluid, axes, resolution=resolution, tolerance=tolerance)
    reports = [report for solution in found.solutions for report in solution.reports]
    result = EffectiveConductivity(
        found.tensor,
        tuple(None if np.isnan(k) else True for k in np.diag(found.tensor)),
        max(report.unknowns for report in reports),
        max(report.iterations for report in reports),
        max(report.relative_energy_error for report in reports),
        found.solutions,
        model_error=found.spread or np.nan,
    )
    if error_estimate:
        estimate = _estimate(geometry, medium, axes, resolution, tolerance)
        result = replace(result, model_error=max(estimate, found.spread))
    if bounds:
        between = conductivity_bounds(geometry, solid, fluid)
        pairs = np.column_stack((np.diag(between.lower), np.diag(between.upper)))
        result = replace(result, bounds=np.where(np.isnan(np.diag(found.tensor))[:, None], np.nan, pairs))
    return result


def _estimate(
    geometry: CellGeometry, medium: Medium, axes: tuple[int, ...] | None, resolution: Resolution, tolerance: float
) -> float:
    return estimate_error(
        geometry,
        medium.conductivity,
        medium.pores.conductivity,
        axes,
        resolution=resolution,
        tolerance=tolerance,
    )


def medium_geometry(medium: Medium, cells: LaguerreCells | None = None) -> CellGeometry:
    """Cells of a medium with the contacts of its network on their edges.

    Raises
    ------
    GeometryError
        If a disk has no cell of its own, or two bonded disks share no edge.
    """
    packing, network = medium.packing, medium.links
    cells = cells or laguerre_cells(packing.centers, packing.radii, packing.box)
    return cell_geometry(packing.centers, packing.radii, packing.box, edge_contacts(cells, network), cells)


def edge_contacts(cells: LaguerreCells, network: ContactNetwork) -> EdgeContacts:
    """Half-angles and resistances of a contact network, edge by edge.

    Parameters
    ----------
    cells : LaguerreCells
        Of the packing of the network.
    network : ContactNetwork

    Raises
    ------
    GeometryError
        If a bonded contact has no edge: a third disk lies between. (An overlap without an edge lies inside others.)
    """
    between, wall = ~cells.at_wall, cells.at_wall
    half_angles, resistances = np.zeros((cells.edge_count, 2)), np.zeros(cells.edge_count)
    shifts = cells.shifts[between]
    own = cells.cells[between, 0] == cells.cells[between, 1]
    back = own & ((shifts[:, 0] < 0) | ((shifts[:, 0] == 0) & (shifts[:, 1] < 0)))  # the network looks ahead
    shifts = np.where(back[:, None], -shifts, shifts)
    rows = _find_rows(np.column_stack((network.pairs, network.shifts)), np.column_stack((cells.cells[between], shifts)))
    _refuse_missing(network, rows)
    edge = np.flatnonzero(between)[rows[rows >= 0]]
    resistances[edge] = network.resistances[rows >= 0]
    at_wall = _find_rows(np.column_stack((network.wall_particles, -1 - network.walls)), cells.cells[wall])
    wall_edge = np.flatnonzero(wall)[at_wall[at_wall >= 0]]
    resistances[wall_edge] = network.wall_resistances[at_wall >= 0]
    if not network.geometric:
        half_angles[edge] = network.angles[rows >= 0]
        half_angles[wall_edge] = network.wall_angles[at_wall >= 0, None]
    return EdgeContacts(half_angles, np.zeros(cells.edge_count), resistances)


def _find_rows(wanted: Ints, table: Ints) -> Ints:
    """Row of the table equal to each wanted row, -1 if there is none; rows of the table are different."""
    _, names = np.unique(np.concatenate((table, wanted)), axis=0, return_inverse=True)
    names = names.ravel()
    places = np.full(int(names.max(initial=-1)) + 1, -1)
    places[names[: len(table)]] = np.arange(len(table))
    return np.asarray(places[names[len(table) :]])


def _refuse_missing(network: ContactNetwork, rows: Ints) -> None:
    missing = np.flatnonzero(rows < 0)
    if missing.size and not network.geometric:
        i, j = (int(v) for v in network.pairs[missing[0]])
        raise GeometryError(
            f"particles {i} and {j} are bonded but share no Laguerre edge: a third one lies between them; "
            f"use a smaller bond gap"
        )


def accuracy_remarks(method: str, result: EffectiveConductivity[CellSolution]) -> tuple[str, ...]:
    """A warning where disks that conduct better than the fluid and ones that conduct worse meet."""
    apart = np.nan_to_num(result.model_error)
    if apart <= 2.0 * CALIBRATED_ERROR:
        return ()
    return (
        f"method {method} is uncertain by about {100.0 * apart:.1f} % here: its finer computations, or its direct "
        f"and dual values, differ by as much; a higher degree helps, or the voxel engine",
    )


def solve_series(media: Sequence[Medium], conduction: Conduction) -> list[Result]:
    """Effective conductivity of media on one packing, one result per medium; cells are made once.

    Media with the same contacts share what happens on the edges too.
    """
    cells: dict[int, LaguerreCells] = {}
    geometries: dict[int, CellGeometry] = {}

    def alone(medium: Medium) -> EffectiveConductivity[CellSolution]:
        packing, network = medium.packing, medium.links
        if id(packing) not in cells:
            cells[id(packing)] = laguerre_cells(packing.centers, packing.radii, packing.box)
        if id(network) not in geometries:
            geometries[id(network)] = medium_geometry(medium, cells[id(packing)])
        return disk_conductivity(
            medium,
            axes=conduction.axes,
            tolerance=conduction.tolerance,
            geometry=geometries[id(network)],
            **conduction.options,
        )

    return [attempt(partial(alone, medium)) for medium in media]


def disk_field(medium: Medium, solution: CellSolution, load: int = 0) -> ParticleField:
    """Temperatures and heat flows of disks in a fluid: every Laguerre edge is a link, of no width where it is a gap.

    Parameters
    ----------
    medium : Medium
    solution : CellSolution
        Of the medium (not of its dual).
    load : int
        Column of the solution.
    """
    geometry = solution.model.geometry
    cells, field = geometry.cells, recover_cells(solution, load)
    links = disk_links(medium, solution)
    sides = contact_sides(links.links)
    between, wall = np.flatnonzero(~cells.at_wall), np.flatnonzero(cells.at_wall)
    flows = np.zeros((sides.nodes.size, 1))
    flows[sides.of_contacts[:, 0], 0] = -field.edge_flows[between]
    flows[sides.of_contacts[:, 1], 0] = field.edge_flows[between]
    flows[sides.of_walls, 0] = -field.edge_flows[wall]
    middles = _edge_temperatures(geometry, field.sides, field.edge, field.angles)
    corners = np.linalg.norm(cells.corners, axis=1)
    return ParticleField(
        medium=links,
        axis=solution.axes[load],
        sides=sides,
        particle_temperatures=field.disk_temperatures,
        contact_temperatures=middles[between],
        wall_temperatures=middles[wall],
        contact_flows=field.edge_flows[between],
        wall_flows=field.edge_flows[wall],
        face_temperatures=np.column_stack((middles[between], middles[between])),
        flow_modes=flows,
        inside=partial(temperatures_inside, field),
        reach=np.maximum.reduceat(corners, cells.starts[:-1]),
    )


def disk_links(medium: Medium, solution: CellSolution) -> Medium:
    """The medium with every Laguerre edge as a link."""
    return medium.with_network(edge_network(medium, solution.model.geometry))


def edge_network(medium: Medium, geometry: CellGeometry) -> ContactNetwork:
    """All Laguerre edges as links."""
    cells, edges = geometry.cells, geometry.edges
    between, wall = ~cells.at_wall, cells.at_wall
    pairs = cells.cells[between]
    reach = np.minimum(edges.corners[:, None] / geometry.radii[np.where(cells.cells < 0, 0, cells.cells)], 1.0)
    angles = np.where(edges.half_angles > 0.0, edges.half_angles, np.arcsin(reach))
    return ContactNetwork(
        medium.packing,
        pairs,
        cells.shifts[between],
        angles[between],
        edges.resistances[between],
        cells.cells[wall, 0],
        -1 - cells.cells[wall, 1],
        angles[wall, 0],
        edges.resistances[wall],
        medium.links.rule,
    )


def _edge_temperatures(geometry: CellGeometry, sides: Ints, edge: Floats, angles: Floats) -> Floats:
    """Temperature of each edge near the line of centres, seen from its first cell [K]."""
    cells = geometry.cells
    direction = geometry.edges.angles[cells.edges[sides]]
    away = np.abs(np.angle(np.exp(1j * (angles - direction))))
    away[~cells.forward[sides]] = np.inf
    order = np.lexsort((away, cells.edges[sides]))
    first = np.unique(cells.edges[sides][order], return_index=True)[1]
    return np.asarray(edge[order[first]])
