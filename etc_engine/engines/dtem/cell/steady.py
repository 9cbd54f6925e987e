"""Steady heat conduction through disks and the fluid between them: one walled axis, or periodic axes together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from etc_engine.arrays import read_only
from etc_engine.engines.dtem.cell.assembly import CellMaterials, CellSystem, assemble_cells
from etc_engine.engines.dtem.cell.frame import Frame
from etc_engine.engines.dtem.cell.geometry import CellGeometry, Resolution, divide
from etc_engine.engines.dtem.cell.rim_grid import EdgeGrid
from etc_engine.solvers import SolveReport, solve_loads

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CellModel:
    """Assembled cells that can be solved for any load.

    Parameters
    ----------
    geometry : CellGeometry
    materials : CellMaterials
    grid : EdgeGrid
    frame : Frame
    system : CellSystem
    """

    geometry: CellGeometry
    materials: CellMaterials
    grid: EdgeGrid
    frame: Frame
    system: CellSystem


@dataclass(frozen=True, eq=False)
class CellSolution:
    """Temperatures of the frames under one group of loads.

    Parameters
    ----------
    model : CellModel
    axes : tuple of int
        Load axes, one column each: walls at temperature 1 (low end) and 0 (far end), or a mean temperature gradient
        of 1 along a periodic axis.
    fluctuations : ndarray, shape (n, k) [K]
        Temperatures at the unknowns of the frames; with a mean gradient, what is left when it is taken away.
    energies : ndarray, shape (k, k) [W/m]
        sum_p t_pa . K_p t_pb.
    reports : tuple of SolveReport
        One per load.
    """

    model: CellModel
    axes: tuple[int, ...]
    fluctuations: Floats
    energies: Floats
    reports: tuple[SolveReport, ...]

    @property
    def periodic(self) -> bool:
        """Whether the loads are mean gradients along periodic axes."""
        return self.model.geometry.box.periodic[self.axes[0]]

    def wall_heat(self) -> tuple[float, float]:
        """Heat flow in at the low wall and out at the far wall of a walled load [W/m]."""
        reactions = self.model.system.matrix @ self.fluctuations[:, 0]
        low, far = (wall_unknowns(self.model, 2 * self.axes[0] + end) for end in range(2))
        return float(reactions[low].sum()), -float(reactions[far].sum())


def build_model(
    geometry: CellGeometry,
    solid: Floats,
    fluid: float,
    resolution: Resolution | None = None,
    *,
    storing: bool = False,
    like: CellModel | None = None,
) -> CellModel:
    """Reduce and assemble the cells for one set of conductivities.

    Parameters
    ----------
    geometry : CellGeometry
    solid : ndarray, shape (n,) [W/(m K)]
    fluid : float [W/(m K)]
    resolution : Resolution, optional
    storing : bool
        Whether the mean temperatures of the disks are unknowns too.
    like : CellModel, optional
        Of `common_part`: cells away from walls that have been assembled with the same conductivities.

    Returns
    -------
    CellModel
    """
    resolution = resolution or Resolution()
    grid, frame = divide(geometry, solid, fluid, resolution, storing=storing)
    materials = CellMaterials(read_only(geometry.radii), read_only(solid), float(fluid))
    only, base = (None, None) if like is None else (geometry.wall_disks, like.system)
    system = assemble_cells(geometry.cells, geometry.edges, grid, frame, materials, only=only, base=base)
    return CellModel(geometry, materials, grid, frame, system)


def common_part(geometry: CellGeometry, solid: Floats, fluid: float, resolution: Resolution | None = None) -> CellModel:
    """What models of one packing share whose contacts differ at walls only: all cells away from the walls."""
    grid, frame = divide(geometry, solid, fluid, resolution or Resolution())
    materials = CellMaterials(read_only(geometry.radii), read_only(solid), float(fluid))
    inner = np.setdiff1d(np.arange(geometry.count), geometry.wall_disks)
    system = assemble_cells(geometry.cells, geometry.edges, grid, frame, materials, only=inner)
    return CellModel(geometry, materials, grid, frame, system)


def wall_unknowns(model: CellModel, wall: int) -> NDArray[np.int64]:
    """Frame unknowns on a wall; wall ``2 * axis`` lies at 0, ``2 * axis + 1`` at the far end."""
    cells, frame = model.geometry.cells, model.frame
    rows = np.flatnonzero(cells.cells[cells.edges, 1] == -1 - wall)
    end = np.searchsorted(cells.starts, rows, side="right")
    following = np.where(rows + 1 == cells.starts[end], cells.starts[end - 1], rows + 1)
    edges = cells.edges[rows]
    own = [np.arange(frame.first[e], frame.first[e + 1]) for e in edges]
    return np.unique(np.concatenate((cells.vertices[rows], cells.vertices[following], *own)))


def solve_model(model: CellModel, axes: tuple[int, ...], *, tolerance: float = 1e-10) -> CellSolution:
    r"""Temperatures of the frames for one walled axis, or for periodic axes together.

    .. math:: K u_a = -g_a

    with one unknown held (periodic), or with the unknowns on the two walls of the axis at 1 and 0. Walls of other
    axes are insulated.

    Parameters
    ----------
    model : CellModel
    axes : tuple of int
        A single walled axis, or periodic axes only.
    tolerance : float
        Relative error of the conductivity left by the solver.

    Returns
    -------
    CellSolution

    Raises
    ------
    ConvergenceError
    """
    system, count = model.system, model.frame.count
    held = np.zeros(count, dtype=np.bool_)
    fluctuations = np.zeros((count, len(axes)))
    if model.geometry.box.periodic[axes[0]]:
        held[0] = True
        loads = system.loads[:, list(axes)]
        lift = system.gradient_energy[np.ix_(axes, axes)]
    else:
        held[wall_unknowns(model, 2 * axes[0] + 1)] = True
        low = wall_unknowns(model, 2 * axes[0])
        held[low], fluctuations[low, 0] = True, 1.0
        loads = system.matrix @ fluctuations
        lift = fluctuations.T @ loads
    free = np.flatnonzero(~held)
    reports: tuple[SolveReport, ...] = (SolveReport(0, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0),) * len(axes)
    if free.size:
        matrix = _free_part(system.matrix, held)
        rhs, lifts = -loads[free], np.diag(lift)
        u, reports = solve_loads(matrix, rhs, lifts, tolerance=tolerance, last_resort=free.size)
        fluctuations[free] = u
    lifted = fluctuations.T @ (system.matrix @ fluctuations)
    if model.geometry.box.periodic[axes[0]]:
        cross = fluctuations.T @ loads
        lifted = lift + cross + cross.T + lifted
    return CellSolution(model, axes, fluctuations, lifted, reports)


def _free_part(matrix: csr_matrix, held: NDArray[np.bool_]) -> csr_matrix:
    """Rows and columns of a matrix that are not held."""
    number = np.where(held, -1, np.cumsum(~held) - 1)
    data, indices, indptr = _select(matrix.data, matrix.indices, matrix.indptr, number)
    return csr_matrix((data, indices, indptr), shape=(indptr.size - 1,) * 2)


@njit(cache=True)
def _select(data, indices, indptr, number):  # type: ignore[no-untyped-def]
    """Entries whose row and column have a new number, in one pass without a second copy."""
    rows = 0
    for row in range(number.size):
        rows = max(rows, number[row] + 1)
    starts = np.zeros(rows + 1, dtype=indptr.dtype)
    for row in range(number.size):
        if number[row] >= 0:
            for entry in range(indptr[row], indptr[row + 1]):
                starts[number[row] + 1] += number[indices[entry]] >= 0
    for row in range(starts.size - 1):
        starts[row + 1] += starts[row]
    kept, columns = np.empty(starts[-1]), np.empty(starts[-1], dtype=indices.dtype)
    place = 0
    for row in range(number.size):
        if number[row] >= 0:
            for entry in range(indptr[row], indptr[row + 1]):
                if number[indices[entry]] >= 0:
                    kept[place], columns[place] = data[entry], number[indices[entry]]
                    place += 1
    return kept, columns, starts
