"""Steady conduction through one packing on many ranks: elements are local, matrix and solver are distributed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix

from etc_engine.arrays import Floats, Ints
from etc_engine.engines.dtem.assembly import LinearSystem, assemble
from etc_engine.engines.dtem.distributed.model_error import distributed_error
from etc_engine.engines.dtem.distributed.nodes import Nodes
from etc_engine.engines.dtem.distributed.spanning import distributed_backbone, pinned_nodes
from etc_engine.engines.dtem.element import Elements
from etc_engine.engines.dtem.methods import find_method
from etc_engine.medium.backbone import Backbone
from etc_engine.medium.loads import wall_temperatures
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.sides import ContactSides, check_arcs, contact_sides
from etc_engine.ranks import Ranks, together
from etc_engine.solvers import SolveReport
from etc_engine.solvers.petsc import solve_on_ranks
from etc_engine.solvers.summation import inner


@dataclass(frozen=True, eq=False)
class PartialSolution:
    """What a rank holds of a solution; energies and wall heat are those of all ranks.

    Parameters
    ----------
    backbone : Backbone
        Of the contacts of this rank.
    energies : ndarray, shape (k, k)
    reports : tuple of SolveReport
        One per load.
    walls : (float, float)
        Heat flow in at the low wall and out at the far wall.
    model_errors : tuple of float
        Estimated relative error of the method, one per load.
    """

    backbone: Backbone
    energies: Floats
    reports: tuple[SolveReport, ...]
    walls: tuple[float, float]
    model_errors: tuple[float, ...]

    def wall_heat(self) -> tuple[float, float]:
        """Heat flow into the particles at the low wall and out of them at the far wall [W, in 2D W/m]."""
        return self.walls


def solve_part(
    nodes: Nodes, axes: tuple[int, ...], ranks: Ranks, *, method: str = "chord", tolerance: float = 1e-10
) -> PartialSolution:
    """Solve one load group on all ranks; equations and loads as of `etc_engine.engines.dtem.steady.solve_steady`.

    Parameters
    ----------
    nodes : Nodes
        Contacts of this rank.
    axes : tuple of int
        A single walled axis, or periodic axes only.
    ranks : Ranks
    method : str
        One whose element depends on its own contacts alone.
    tolerance : float
        Relative error of the conductivity left by the solver.

    Raises
    ------
    InputError, GeometryError, ConvergenceError
        On every rank.
    """
    backbone = distributed_backbone(nodes, axes, ranks)
    held = np.zeros(nodes.count, dtype=np.bool_)
    held[: nodes.own] = True
    held[nodes.of_contacts[backbone.contacts]] = False  # nodes outside the backbone are no unknowns
    if nodes.part.box.periodic[axes[0]]:
        held[pinned_nodes(nodes, backbone, ranks)] = True
    held = nodes.with_others(held[: nodes.own], ranks)
    sides, elements, system = together(ranks, lambda: _own_system(nodes, backbone, axes, held, method))
    u, reports = _solve(nodes, system, held, ranks, tolerance)
    temperatures = system.element_temperatures(elements, u)
    flows = elements.apply(temperatures)
    energies = np.asarray(ranks.add_up(inner(temperatures, flows)))
    at_wall = sides.nodes >= nodes.count
    ends = [flows[at_wall & (temperatures[:, 0] == end), 0].sum() for end in (1.0, 0.0)]
    heat = np.asarray(ranks.add_up(np.array(ends)))
    errors = tuple(
        distributed_error(nodes, backbone, sides, flows[:, load], float(energies[load, load]), ranks)
        for load in range(len(axes))
    )
    return PartialSolution(backbone, energies, reports, (float(heat[0]), -float(heat[1])), errors)


def _own_system(
    nodes: Nodes, backbone: Backbone, axes: tuple[int, ...], held: np.ndarray, method: str
) -> tuple[ContactSides, Elements, LinearSystem]:
    """Sides, elements and equations of the own particles; the nodes of other ranks are among their unknowns."""
    part, network = nodes.part, nodes.network
    axis = axes[0]
    periodic = part.box.periodic[axis]
    driven = (network.walls // 2 == axis) & (not periodic)
    every = _own_sides(nodes, network.select(np.ones_like(backbone.contacts), driven), nodes.of_contacts)
    check_arcs(every)
    reduced = network.select(backbone.contacts, backbone.wall_contacts)
    sides = _own_sides(nodes, reduced, nodes.of_contacts[backbone.contacts])
    lift = np.zeros((sides.nodes.size, len(axes)))
    if periodic:
        lift[:] = sides.arms[:, list(axes)]
    else:
        lift[:, 0] = np.concatenate([np.zeros(nodes.count), wall_temperatures(reduced.walls)])[sides.nodes]
    elements = find_method(method, part.box.dimension).elements(sides, part.conductivity[: part.own], 1)
    prescribed = np.concatenate([held, np.ones(reduced.walls.size, dtype=np.bool_)])
    return sides, elements, assemble(elements, lift, prescribed)


def _own_sides(nodes: Nodes, network: ContactNetwork, of_contacts: Ints) -> ContactSides:
    """The contacts as the own particles see them; wall contacts are nodes beyond all others."""
    own = nodes.part.own
    sides = contact_sides(network)
    count = int(sides.offsets[own])
    names = np.concatenate([of_contacts, nodes.count + np.arange(network.walls.size)])
    none = np.zeros(0, dtype=np.int64)
    return ContactSides(
        offsets=sides.offsets[: own + 1],
        nodes=names[sides.nodes[:count]],
        arms=sides.arms[:count],
        alpha=sides.alpha[:count],
        lumped_resistances=sides.resistances[:count],
        area_resistances=np.zeros(count),
        reaches=sides.reaches[:count],
        radii=sides.radii[:own],
        of_contacts=none.reshape(0, 2),
        of_walls=none,
    )


def _solve(
    nodes: Nodes, system: LinearSystem, held: np.ndarray, ranks: Ranks, tolerance: float
) -> tuple[Floats, tuple[SolveReport, ...]]:
    """Temperatures at all unknowns of this rank, those of other ranks included, shape (f, k)."""
    free = ~held
    size = int(free[: nodes.own].sum())
    counts = ranks.share(size)
    numbers = np.where(free[: nodes.own], sum(counts[: ranks.rank]) + np.cumsum(free[: nodes.own]) - 1, -1)
    numbers = nodes.with_others(numbers, ranks)[free]  # of each unknown: the own ones come first
    matrix, rhs = _whole_rows(nodes, system, free, numbers, counts, ranks)
    lift_energies = np.asarray(ranks.add_up(system.lift_energies))
    own, reports = solve_on_ranks(matrix, rhs, lift_energies, ranks, tolerance=tolerance)
    at_nodes = np.zeros((nodes.own, rhs.shape[1]))
    at_nodes[free[: nodes.own]] = own
    return nodes.with_others(at_nodes, ranks)[free], reports


def _whole_rows(
    nodes: Nodes, system: LinearSystem, free: np.ndarray, numbers: Ints, counts: list[int], ranks: Ranks
) -> tuple[csr_matrix, Floats]:
    """Rows of the own unknowns, with what the elements of other ranks add to them; columns are numbers of all ranks."""
    first, size, total = sum(counts[: ranks.rank]), counts[ranks.rank], sum(counts)
    place = np.where(free, np.cumsum(free) - 1, -1)
    sent = []
    for taken in nodes.taken:
        theirs = place[taken]
        theirs = theirs[theirs >= 0]
        block = system.matrix[theirs].tocoo()
        names = numbers[theirs]
        sent.append((names[block.row], numbers[block.col], block.data, names, system.rhs[theirs]))
    mine = system.matrix[:size].tocoo()
    rows, columns, values = [mine.row.astype(np.int64)], [numbers[mine.col]], [mine.data]
    rhs = system.rhs[:size].copy()
    for row, column, value, names, heat in ranks.exchange(sent):
        rows.append(row - first)
        columns.append(column)
        values.append(value)
        np.add.at(rhs, names - first, heat)
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    return csr_matrix(coo_matrix(entries, shape=(size, total))), rhs
