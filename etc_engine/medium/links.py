r"""Steady conduction through links between particles: a graph Laplacian of their temperatures.

Every particle is a node and every link c has a conductance C_c, so the heat that flows from i to j is C_c (T_i - T_j),

    sum_c C_c (T_i - T_j) = 0   for every particle i.

Between walls the links to them end at prescribed temperatures. In a periodic box a mean gradient e_a adds the branch
vector's component b_ca to the difference of the periodic fluctuation u, K u_a = -sum_c C_c b_ca (e_j - e_i).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.sparse import coo_matrix, csr_matrix, diags_array

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.medium.backbone import Backbone, find_backbone
from etc_engine.medium.loads import Links, driven_walls, first_of_clusters, link_loads
from etc_engine.solvers import SolveReport, build_preconditioner, solve_loads
from etc_engine.solvers.amg_cg import EXACT_LEVEL
from etc_engine.solvers.summation import inner


@dataclass(frozen=True, eq=False)
class LinkSolution:
    """Temperatures of the particles and heat flows through the links.

    Parameters
    ----------
    axes : tuple of int
        Load axes, one column k each: walls at temperature 1 (low end) and 0 (far end), or a mean
        temperature gradient of 1 along a periodic axis.
    walls : ndarray of int, shape (w,)
        Wall of each wall link.
    backbone : Backbone
        What takes part.
    temperatures : ndarray, shape (n, k) [K]
        Of each particle, dead ends included; NaN where no links lead to a spanning cluster or a driven wall. Along a
        periodic axis of the particle's home image, mean gradient included.
    flows : ndarray, shape (m, k) [W, in 2D W/m]
        Heat flow from the first particle of each link to the second.
    wall_flows : ndarray, shape (w, k) [W, in 2D W/m]
        Heat flow from the particle into each wall.
    energies : ndarray, shape (k, k)
        sum_c C_c dT_ca dT_cb over the links, walls included.
    reports : tuple of SolveReport
        One per load.
    """

    axes: tuple[int, ...]
    walls: Ints
    backbone: Backbone
    temperatures: Floats
    flows: Floats
    wall_flows: Floats
    energies: Floats
    reports: tuple[SolveReport, ...]

    def wall_heat(self) -> tuple[float, float]:
        """Heat flow into the particles at the low wall and out of them at the far wall."""
        low, far = (float(self.wall_flows[self.walls == 2 * self.axes[0] + end, 0].sum()) for end in (0, 1))
        return -low, far


def solve_links(
    links: Links,
    axes: tuple[int, ...],
    conductances: Floats,
    wall_conductances: Floats,
    *,
    tolerance: float = 1e-10,
    backbone: Backbone | None = None,
    exact_level: int = EXACT_LEVEL,
) -> LinkSolution:
    """Solve one walled axis, or periodic axes together.

    Parameters
    ----------
    links : Links
    axes : tuple of int
        A single walled axis, or periodic axes only.
    conductances : ndarray, shape (m,) [W/K, in 2D W/(m K)]
        0 where a link does not conduct.
    wall_conductances : ndarray, shape (w,)
    tolerance : float
        Relative error of the energies left by the solver.
    backbone : Backbone, optional
        Of the links that conduct, if already known.
    exact_level : int
        Largest system that is factorised.

    Raises
    ------
    ConvergenceError
    """
    n, box = links.packing.count, links.packing.box
    if backbone is None:
        backbone = find_backbone(links, axes, conductances > 0.0, wall_conductances > 0.0)
    C = np.where(backbone.contacts, conductances, 0.0)
    C_wall = np.where(backbone.wall_contacts, wall_conductances, 0.0)
    loads, (i, j) = link_loads(links, axes), links.pairs.T

    matrix = laplacian(n, links.pairs, C, links.wall_particles, C_wall)
    rhs = np.zeros((n, len(axes)))
    np.add.at(rhs, i, C[:, None] * loads.jumps)
    np.add.at(rhs, j, -C[:, None] * loads.jumps)
    np.add.at(rhs, links.wall_particles, C_wall[:, None] * loads.walls)
    lifts = (C[:, None] * loads.jumps**2).sum(axis=0) + (C_wall[:, None] * loads.walls**2).sum(axis=0)

    free = np.zeros(n, dtype=np.bool_)
    free[links.pairs[backbone.contacts]] = True
    free[links.wall_particles[backbone.wall_contacts]] = True
    temperatures = np.full((n, len(axes)), np.nan)
    temperatures[free] = 0.0
    if box.periodic[axes[0]]:
        inside = np.flatnonzero(free)
        free[inside[first_of_clusters(backbone.clusters[inside])]] = False
    system = csr_matrix(matrix[free][:, free])
    preconditioner = build_preconditioner(system, exact_level) if system.shape[0] else None
    temperatures[free], reports = solve_loads(
        system, rhs[free], lifts, preconditioner=preconditioner, tolerance=tolerance
    )
    if box.periodic[axes[0]]:
        temperatures += links.packing.centers[:, list(axes)]
    drops = np.where(backbone.contacts[:, None], temperatures[i] - temperatures[j] - loads.offsets, 0.0)
    wall_drops = temperatures[links.wall_particles] - loads.walls
    wall_drops = np.where(backbone.wall_contacts[:, None], wall_drops, 0.0)
    flows, wall_flows = C[:, None] * drops, C_wall[:, None] * wall_drops
    _warm_lone_particles(links, axes, temperatures, wall_conductances > 0.0)
    for load in range(len(axes)):
        column = np.ascontiguousarray(temperatures[:, load])
        fill_dead_ends(column, links.pairs[conductances > 0.0], loads.offsets[conductances > 0.0, load])
        temperatures[:, load] = column
    energies = inner(drops, flows) + inner(wall_drops, wall_flows)
    return LinkSolution(axes, links.walls, backbone, temperatures, flows, wall_flows, energies, reports)


def _warm_lone_particles(links: Links, axes: tuple[int, ...], temperatures: Floats, conducts: Flags) -> None:
    """Particles off the backbone that touch a driven wall take its temperature, in place."""
    alone = np.flatnonzero(driven_walls(links, axes) & conducts)
    alone = alone[np.isnan(temperatures[links.wall_particles[alone], 0])]
    temperatures[links.wall_particles[alone]] = link_loads(links, axes).walls[alone]


def laplacian(
    n: int,
    pairs: Ints,
    conductances: Floats,
    linked: Ints,
    ties: Floats,
) -> csr_matrix:
    """Graph Laplacian of n nodes, shape (n, n): links between them, and ties to prescribed temperatures.

    Parameters
    ----------
    n : int
    pairs : ndarray of int, shape (m, 2)
    conductances : ndarray, shape (m,)
    linked : ndarray of int, shape (l,)
        Node of each tie.
    ties : ndarray, shape (l,)
        Conductance of each tie, added on the diagonal.

    Notes
    -----
    Two links of one pair (across a periodic side) add up; a link of a particle with its own image drops out.

    Examples
    --------
    >>> laplacian(2, np.array([[0, 1]]), np.array([2.0]), np.array([0]), np.array([1.0])).toarray()
    array([[ 3., -2.],
           [-2.,  2.]])
    """
    rows, columns = pairs.T
    apart = rows != columns
    rows, columns, values = rows[apart], columns[apart], conductances[apart]
    between = coo_matrix((values, (rows, columns)), shape=(n, n))
    diagonal = np.bincount(rows, values, n) + np.bincount(columns, values, n) + np.bincount(linked, ties, n)
    return csr_matrix(diags_array(diagonal, dtype=np.float64) - between - between.T)


def fill_dead_ends(
    temperatures: Floats,
    pairs: Ints,
    offsets: Floats,
    rises: Floats | None = None,
) -> None:
    """Carry known temperatures, in place, to the particles without flux (NaN) that hang on them.

    Parameters
    ----------
    temperatures : ndarray, shape (n,) [K]
    pairs : ndarray of int, shape (m, 2)
    offsets : ndarray, shape (m,) [K]
        Rise of the mean gradient from the home image of j to the linked one.
    rises : ndarray, shape (m, 2) [K], optional
        Temperature of each link above its particle's mean, on either side; 0 by default.
    """
    rises = np.zeros(pairs.shape) if rises is None else np.ascontiguousarray(rises)
    if np.isnan(temperatures).any():
        _fill(temperatures, np.ascontiguousarray(pairs), np.ascontiguousarray(offsets), rises)


@njit(cache=True)
def _fill(
    temperatures: Floats,
    pairs: Ints,
    offsets: Floats,
    rises: Floats,
) -> None:
    """Breadth first over the links: T_other = T_p + rise at the link on p, less the offset of the image."""
    n, m = temperatures.size, pairs.shape[0]
    starts = np.zeros(n + 1, dtype=np.int64)
    for c in range(m):
        for side in range(2):
            starts[pairs[c, side] + 1] += 1
    starts = np.cumsum(starts)
    filled = starts[:-1].copy()
    of_particle = np.empty(2 * m, dtype=np.int64)
    for side in range(2):
        for c in range(m):
            p = pairs[c, side]
            of_particle[filled[p]] = 2 * c + side
            filled[p] += 1
    queue = np.empty(n, dtype=np.int64)
    tail = 0
    for p in range(n):
        if not np.isnan(temperatures[p]):
            queue[tail] = p
            tail += 1
    head = 0
    while head < tail:
        p = queue[head]
        head += 1
        for place in range(starts[p], starts[p + 1]):
            c, side = of_particle[place] // 2, of_particle[place] % 2
            other = pairs[c, 1 - side]
            if np.isnan(temperatures[other]):
                jump = -offsets[c] if side == 0 else offsets[c]
                temperatures[other] = temperatures[p] + rises[c, side] + jump
                queue[tail] = other
                tail += 1
