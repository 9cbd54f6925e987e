"""The cells of a packing, made once and shared by every conductivity."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from etc_engine.box import Box
from etc_engine.engines.dtem.cell.edges import CellEdges, EdgeContacts, cell_edges, grid_edges, release_contacts
from etc_engine.engines.dtem.cell.frame import MOST_DEGREES, Frame, build_frame, edge_degrees
from etc_engine.engines.dtem.cell.rim_grid import CORNER, LONGEST, EdgeGrid
from etc_engine.errors import InputError
from etc_engine.structure.laguerre_2d import LaguerreCells, laguerre_cells

Floats = NDArray[np.float64]

DEGREE = 3
"""Polynomial degree of the edges unless another is asked for."""


@dataclass(frozen=True, eq=False)
class CellGeometry:
    """Cells and edges of disks in a box, with their contacts.

    Parameters
    ----------
    centers : ndarray, shape (n, 2) [m]
    radii : ndarray, shape (n,) [m]
    box : Box
    cells : LaguerreCells
    edges : CellEdges
    """

    centers: Floats
    radii: Floats
    box: Box
    cells: LaguerreCells
    edges: CellEdges

    @property
    def count(self) -> int:
        """Number of disks."""
        return int(self.radii.size)

    @property
    def wall_disks(self) -> NDArray[np.int64]:
        """Rows of the disks whose cells reach a wall."""
        return np.unique(self.cells.cells[self.cells.at_wall, 0])

    def driven_by(self, axes: tuple[int, ...]) -> CellGeometry:
        """The cells under a load, which drives the walls of walled axes only."""
        return self.with_walls(np.repeat([axis in axes and not self.box.periodic[axis] for axis in range(2)], 2))

    def with_walls(self, driven: NDArray[np.bool_]) -> CellGeometry:
        """The cells with contacts at the marked walls, shape (4,); elsewhere a prescribed one is no contact."""
        idle = self.cells.at_wall & (self.edges.corners > 0.0)
        idle[idle] = ~driven[-1 - self.cells.cells[idle, 1]]
        return replace(self, edges=release_contacts(self.edges, idle)) if idle.any() else self


@dataclass(frozen=True)
class Resolution:
    """How finely a cell is resolved.

    Parameters
    ----------
    degree : int
        Polynomial degree of the temperature on an edge, 1 to 5.
    corner : float
        Smallest interval at the ends of a contact, in half-widths of the contact.
    longest : float
        Longest interval, in radii of the smaller disk.

    Raises
    ------
    InputError
        If one of them is out of range.
    """

    degree: int = DEGREE
    corner: float = CORNER
    longest: float = LONGEST

    def __post_init__(self) -> None:
        if not (isinstance(self.degree, int) and 1 <= self.degree <= MOST_DEGREES):
            raise InputError(
                f"the degree of the cell element must be a whole number from 1 to {MOST_DEGREES}, found {self.degree}"
            )
        for name, value in (("corner", self.corner), ("longest", self.longest)):
            if not 1e-4 <= value <= 0.5:
                raise InputError(f"the {name} interval of the cell element must lie in 1e-4 .. 0.5, found {value}")


def cell_geometry(
    centers: Floats, radii: Floats, box: Box, contacts: EdgeContacts | None = None, cells: LaguerreCells | None = None
) -> CellGeometry:
    """Laguerre cells of disks and what happens on their edges.

    Parameters
    ----------
    centers : ndarray, shape (n, 2) [m]
    radii : ndarray, shape (n,) [m]
    box : Box
    contacts : EdgeContacts, optional
        Prescribed contacts, edge by edge of the cells; by default only overlaps conduct from solid to solid.
    cells : LaguerreCells, optional
        Of the same disks, if already known.

    Raises
    ------
    GeometryError
    """
    cells = cells or laguerre_cells(centers, radii, box)
    return CellGeometry(centers, radii, box, cells, cell_edges(cells, radii, contacts))


def divide(
    geometry: CellGeometry, solid: Floats, fluid: float, resolution: Resolution, *, storing: bool = False
) -> tuple[EdgeGrid, Frame]:
    """Rim grids for conductivities ``solid`` of the disks and ``fluid`` between them, and the unknowns."""
    pairs = geometry.cells.cells
    other = np.where(pairs[:, 1] < 0, pairs[:, 0], pairs[:, 1])
    ratio = fluid / np.maximum(solid[pairs[:, 0]], solid[other])
    edges = geometry.edges
    degrees = edge_degrees(edges.ends[:, 1] - edges.ends[:, 0], edges.smaller, resolution.degree)
    grid = grid_edges(edges, ratio, degrees, corner=resolution.corner, longest=resolution.longest)
    return grid, build_frame(geometry.cells, degrees, storing=storing)
