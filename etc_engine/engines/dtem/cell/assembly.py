r"""Assembly of the cells: one sparse matrix on all frames, and the loads of mean temperature gradients.

In cell p the temperature on the frame is t_p = P_p u + j_p, where j_p,a = (x - x_p)_a for a unit mean gradient along a
(zero for walls). With E_ab = sum_p t_pa K_p t_pb,

.. math:: E_{ab} = c_{ab} + u_a \cdot g_b + g_a \cdot u_b + u_a \cdot K u_b, \qquad
    c_{ab} = \sum_p j_{pa} K_p j_{pb}, \quad g_a = \sum_p P_p^T K_p j_{pa}.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from etc_engine.engines.dtem.cell.edges import CellEdges
from etc_engine.engines.dtem.cell.element import reduce_cell, workspace
from etc_engine.engines.dtem.cell.frame import Frame
from etc_engine.engines.dtem.cell.rim_grid import EdgeGrid
from etc_engine.structure.laguerre_2d import LaguerreCells

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class CellMaterials(NamedTuple):
    """What cells are made of.

    Attributes
    ----------
    radii : ndarray, shape (n,) [m]
    solid : ndarray, shape (n,) [W/(m K)]
        Conductivity of each disk.
    fluid : float [W/(m K)]
        Conductivity of the fluid between them.
    """

    radii: Floats
    solid: Floats
    fluid: float


@dataclass(frozen=True, eq=False)
class CellSystem:
    """Assembled cells.

    Parameters
    ----------
    matrix : csr_matrix, shape (n, n)
        On all frame unknowns; a uniform temperature gives no flow.
    loads : ndarray, shape (n, 2) [W/m]
        g of a unit mean gradient along x and y.
    gradient_energy : ndarray, shape (2, 2) [W/m]
        c of these.
    rim_nodes : int
        Rim nodes of all cells.
    """

    matrix: csr_matrix
    loads: Floats
    gradient_energy: Floats
    rim_nodes: int


def assemble_cells(
    cells: LaguerreCells,
    edges: CellEdges,
    grid: EdgeGrid,
    frame: Frame,
    materials: CellMaterials,
    *,
    only: Ints | None = None,
    base: CellSystem | None = None,
) -> CellSystem:
    """Reduce cells to their frames and add them to the sparse matrix.

    Parameters
    ----------
    cells, edges, grid, frame, materials
    only : ndarray of int64, optional
        Rows of the cells that are added; all by default.
    base : CellSystem, optional
        System of the same frame to which they are added, itself left as it is.

    Notes
    -----
    Cells are added in their order, so that two assemblies agree bit for bit.
    """
    if base is None:
        indptr, indices = _pattern(frame, cells.starts.size - 1)
        data = np.zeros(indices.size)
        loads, energy = np.zeros((frame.count, 2)), np.zeros((2, 2))
    else:
        indptr, indices, data = base.matrix.indptr, base.matrix.indices, base.matrix.data.copy()
        loads, energy = base.loads.copy(), base.gradient_energy.copy()
    rows = np.arange(cells.starts.size - 1) if only is None else only
    nodes = rim_nodes(cells, grid)
    work = workspace(int(nodes.max()), int(np.diff(cells.starts).max()), int(np.diff(frame.starts).max()))
    _assemble(
        rows,
        (cells.starts, cells.edges, cells.forward),
        edges,
        grid,
        (frame.starts, frame.unknowns, frame.positions, frame.degrees, frame.storing),
        materials,
        work,
        (indptr, indices, data, loads, energy),
    )
    matrix = csr_matrix((data, indices, indptr), shape=(frame.count, frame.count))
    return CellSystem(matrix, loads, energy, int(nodes.sum()))


def rim_nodes(cells: LaguerreCells, grid: EdgeGrid) -> Ints:
    """Number of rim nodes of each cell, shape (n,)."""
    intervals = np.diff(grid.starts) - 1
    return np.add.reduceat(intervals[cells.edges], cells.starts[:-1])


def _pattern(frame: Frame, count: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Rows and sorted columns of the sparse matrix: unknowns that share a cell."""
    member = csr_matrix(
        (np.ones(frame.unknowns.size, dtype=np.int8), frame.unknowns.astype(np.int32), frame.starts),
        shape=(count, frame.count),
    )
    pattern = csr_matrix(member.T @ member)
    pattern.sort_indices()
    return pattern.indptr, pattern.indices


@njit(cache=True)
def _assemble(rows, cells, edges, grid, frame, materials, work, system):  # type: ignore[no-untyped-def]
    starts, unknowns, positions, degrees, storing = frame
    indptr, indices, data, loads, energy = system
    matrix = work[2]
    for i in rows:
        _, inner, size = reduce_cell(i, cells, edges, grid, degrees, storing, materials, work)
        mine = unknowns[starts[i] : starts[i + 1]]
        places = positions[starts[i] : starts[i + 1]]
        for a in range(inner, size):
            for b in range(inner, a):
                matrix[a, b] = matrix[b, a]
        for a in range(size - inner):
            row = mine[a]
            for b in range(size - inner):
                value = matrix[inner + a, inner + b]
                low, high = indptr[row], indptr[row + 1] - 1
                while low < high:
                    middle = (low + high) // 2
                    if indices[middle] < mine[b]:
                        low = middle + 1
                    else:
                        high = middle
                data[low] += value
                for axis in range(2):
                    loads[row, axis] += value * places[b, axis]
                    for other in range(2):
                        energy[axis, other] += places[a, axis] * value * places[b, other]
