"""Steady conduction through a lattice: between walls, or with a mean gradient through a periodic box."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix, diags
from scipy.sparse.csgraph import connected_components

from etc_engine.engines.lattice.network import Conductances, Lattice
from etc_engine.solvers import SolveReport, build_preconditioner, solve_energy

FACTORISED = 1500
"""Graphs in space fill in: from this many unknowns on, multigrid is faster than a sparse factorisation."""

FREE = np.nan
"""Temperature of an adiabatic wall."""


@dataclass(frozen=True, eq=False)
class SteadyField:
    """A steady temperature field of a lattice.

    Parameters
    ----------
    lattice : Lattice
    conductances : Conductances
    gradient : ndarray, shape (3,) [K/m]
        Mean temperature gradient along the periodic axes.
    temperatures : ndarray, shape (n,) [K]
        Temperature of each node less that of the mean gradient; NaN where no path leads to.
    wall_temperatures : ndarray, shape (6,) [K]
        NaN for an adiabatic wall.
    energy : float [W K]
        Sum of H dT^2 over all links.
    report : SolveReport
    """

    lattice: Lattice
    conductances: Conductances
    gradient: NDArray[np.float64]
    temperatures: NDArray[np.float64]
    wall_temperatures: NDArray[np.float64]
    energy: float
    report: SolveReport

    @property
    def link_flows(self) -> NDArray[np.float64]:
        """Heat flow from i to j through every link, shape (m,) [W]."""
        i, j = self.lattice.pairs.T
        rise = self.lattice.branches @ self.gradient + self.temperatures[j] - self.temperatures[i]
        return np.where(self.conductances.links > 0.0, -self.conductances.links * np.nan_to_num(rise), 0.0)

    @property
    def wall_flows(self) -> NDArray[np.float64]:
        """Heat flow out of the body through every wall link, shape (w,) [W]; 0 at adiabatic walls."""
        rise = self.wall_temperatures[self.lattice.walls] - self.temperatures[self.lattice.wall_nodes]
        return -self.conductances.walls * np.nan_to_num(rise)


def laplacian(lattice: Lattice, conductances: Conductances, held: NDArray[np.bool_]) -> csr_matrix:
    """Conductance matrix K of a lattice, links to walls of prescribed temperature included on the diagonal.

    Parameters
    ----------
    lattice : Lattice
    conductances : Conductances
    held : ndarray of bool, shape (w,)
        Wall links that end at a prescribed temperature.

    Returns
    -------
    csr_matrix, shape (n, n) [W/K]
        Symmetric, positive semi-definite.
    """
    i, j = lattice.pairs.T
    n, H = lattice.count, conductances.links
    off = coo_matrix((np.concatenate((H, H)), (np.concatenate((i, j)), np.concatenate((j, i)))), (n, n)).tocsr()
    diagonal = np.asarray(off.sum(axis=1)).ravel()
    diagonal += np.bincount(lattice.wall_nodes[held], conductances.walls[held], minlength=n)
    return csr_matrix(diags(diagonal) - off)


def solve_between_walls(
    lattice: Lattice,
    conductances: Conductances,
    axis: int,
    *,
    temperatures: tuple[float, float] = (1.0, 0.0),
    tolerance: float = 1e-10,
) -> SteadyField:
    """Steady field between the two walls of an axis at given temperatures, all other walls adiabatic.

    Parameters
    ----------
    lattice : Lattice
    conductances : Conductances
    axis : int
        A walled axis.
    temperatures : tuple of float [K]
        Of the walls at 0 and at the far end.
    tolerance : float
        Relative error of the conductivity left by the iterative solver.

    Returns
    -------
    SteadyField

    Raises
    ------
    ConvergenceError

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.engines.lattice.network import laguerre_lattice, link_conductances
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> two = ParticlePacking([[0.25, 0.5, 0.5], [0.8, 0.5, 0.5]], [0.2, 0.1], Box((1.0, 1.0, 1.0)))
    >>> lattice = laguerre_lattice(two)
    >>> field = solve_between_walls(lattice, link_conductances(lattice, 2.0), 0)
    >>> field.temperatures.round(12), round(field.energy, 12)
    (array([0.75, 0.2 ]), 2.0)
    """
    walls = lattice.walls
    wall_temperatures = np.full(6, FREE)
    wall_temperatures[2 * axis : 2 * axis + 2] = (0.0, 1.0)
    held = walls // 2 == axis
    H = conductances.walls * held
    driven = np.where(walls == 2 * axis + 1, H, 0.0)
    rhs = np.bincount(lattice.wall_nodes, driven, minlength=lattice.count)
    u, energy, report = _solve(laplacian(lattice, conductances, held), rhs, float(driven.sum()), tolerance)
    low, high = temperatures
    return SteadyField(
        lattice,
        conductances,
        np.zeros(3),
        low + (high - low) * u,
        low + (high - low) * wall_temperatures,
        (high - low) ** 2 * energy,
        report,
    )


def solve_with_gradient(
    lattice: Lattice, conductances: Conductances, axis: int, *, tolerance: float = 1e-10
) -> SteadyField:
    """Periodic fluctuation about a unit mean gradient along a periodic axis, all walls adiabatic.

    Parameters
    ----------
    lattice, conductances, tolerance
        As in `solve_between_walls`.
    axis : int
        A periodic axis.

    Returns
    -------
    SteadyField

    Raises
    ------
    ConvergenceError
    """
    gradient = np.eye(3)[axis]
    H, rise = conductances.links, lattice.branches[:, axis]
    i, j = lattice.pairs.T
    n = lattice.count
    rhs = np.bincount(i, H * rise, minlength=n) - np.bincount(j, H * rise, minlength=n)
    held = np.zeros(lattice.walls.size, dtype=bool)
    u, energy, report = _solve(laplacian(lattice, conductances, held), rhs, float(H @ rise**2), tolerance)
    return SteadyField(lattice, conductances, gradient, u, np.full(6, FREE), energy, report)


@dataclass(frozen=True, eq=False)
class LatticeConductivity:
    """Effective conductivity of a lattice.

    Parameters
    ----------
    tensor : ndarray, shape (3, 3) [W/(m K)]
        Components that walls leave undefined are NaN.
    fields : tuple of SteadyField
        One for each axis.
    """

    tensor: NDArray[np.float64]
    fields: tuple[SteadyField, ...]

    @property
    def mean(self) -> float:
        """A third of the trace [W/(m K)]."""
        return float(np.trace(self.tensor) / 3.0)

    @property
    def iterations(self) -> int:
        """Most iterations of a load."""
        return max(field.report.iterations for field in self.fields)

    @property
    def relative_energy_error(self) -> float:
        """Largest relative error of a diagonal component left by the solver."""
        return max(field.report.relative_energy_error for field in self.fields)


def conductivity_tensor(
    lattice: Lattice, conductances: Conductances, *, tolerance: float = 1e-10
) -> LatticeConductivity:
    """Effective conductivity tensor of a lattice.

    Walls: k_aa = Q L_a / (A_a dT). Periodic: k_ab = (1/V) sum H dT_a dT_b over all links.

    Parameters
    ----------
    lattice, conductances, tolerance
        As in `solve_between_walls`.

    Returns
    -------
    LatticeConductivity

    Raises
    ------
    ConvergenceError

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.engines.lattice.network import laguerre_lattice, link_conductances
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> seeds = np.random.default_rng(5).random((50, 3))
    >>> lattice = laguerre_lattice(ParticlePacking(seeds, np.full(50, 0.01), Box((1, 1, 1), (True, True, True))))
    >>> conductivity_tensor(lattice, link_conductances(lattice, 3.0)).tensor.round(9) + 0.0
    array([[3., 0., 0.],
           [0., 3., 0.],
           [0., 0., 3.]])
    """
    box = lattice.packing.box
    tensor = np.full((3, 3), np.nan)
    fields = []
    for axis in range(3):
        if not box.periodic[axis]:
            field = solve_between_walls(lattice, conductances, axis, tolerance=tolerance)
            tensor[axis, axis] = field.energy * box.lengths[axis] / box.cross_section(axis)
        else:
            field = solve_with_gradient(lattice, conductances, axis, tolerance=tolerance)
            tensor[axis, axis] = field.energy / box.volume
        fields.append(field)
    for a in range(3):
        for b in range(a):
            if box.periodic[a] and box.periodic[b]:
                rise = fields[b].lattice.branches[:, b] + np.diff(fields[b].temperatures[lattice.pairs])[:, 0]
                tensor[a, b] = tensor[b, a] = -float(fields[a].link_flows @ np.nan_to_num(rise)) / box.volume
    return LatticeConductivity(tensor, tuple(fields))


def _solve(
    matrix: csr_matrix, rhs: NDArray, lift: float, tolerance: float
) -> tuple[NDArray[np.float64], float, SolveReport]:
    """Temperatures, energy and report; one node of every cluster that touches no held wall is set to 0.

    Nodes without any conductance, and clusters that nothing drives, drop out (NaN).
    """
    clusters, label = connected_components(matrix, directed=False)
    net = np.bincount(label, np.asarray(matrix.sum(axis=1)).ravel(), minlength=clusters)
    scale = np.bincount(label, matrix.diagonal(), minlength=clusters)
    drive = np.bincount(label, np.abs(rhs), minlength=clusters)
    floating = net <= 1e-12 * scale
    solved = ~(floating & (drive <= 1e-300))[label] & (matrix.diagonal() > 0.0)
    first = np.unique(label, return_index=True)[1]
    keep = solved.copy()
    keep[first[floating]] = False
    u = np.where(solved, 0.0, np.nan)
    rows = np.flatnonzero(keep)
    if rows.size == 0:
        return u, lift, SolveReport(0, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0)
    inner = matrix[rows][:, rows] if rows.size < rhs.size else matrix
    preconditioner = build_preconditioner(csr_matrix(inner), FACTORISED)
    b = np.ascontiguousarray(rhs[rows])
    u[rows], report = solve_energy(csr_matrix(inner), b, lift, preconditioner=preconditioner, tolerance=tolerance)
    v = u[rows]
    energy = lift - float(v @ (2.0 * b - inner @ v))
    return u, energy, report
