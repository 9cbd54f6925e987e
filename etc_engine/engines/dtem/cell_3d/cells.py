"""Matrices of all Laguerre cells over the unknowns of the frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etc_engine.box import Box
from etc_engine.engines.dtem.cell_3d.elimination import cell_energy, eliminate
from etc_engine.engines.dtem.cell_3d.face_mesh import shape_functions, triangle_rule
from etc_engine.engines.dtem.cell_3d.plan import CellPlan, Fineness, plan_cells
from etc_engine.engines.dtem.cell_3d.shell import radial_moments
from etc_engine.engines.dtem.cell_3d.sphere_energy import green_table
from etc_engine.engines.dtem.cell_3d.topology import CellTopology
from etc_engine.errors import InputError
from etc_engine.laws.sphere_dents import resistance_matrices

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

SMALLEST_BUBBLE = 0.02
"""Facets below this part of the smaller sphere's squared radius carry no bubbles."""


@dataclass(frozen=True)
class Frame:
    """What the temperature on the facets may be.

    Parameters
    ----------
    edge_degree : int
        Degree of the polynomial on an edge, 1 to 5.
    face_degree : int
        Degree of the Laplacian inside a facet, -1 (harmonic) to 4.
    """

    edge_degree: int = 1
    face_degree: int = 1

    def __post_init__(self) -> None:
        if not (1 <= self.edge_degree <= 5 and -1 <= self.face_degree <= 4):
            raise InputError(
                f"a frame has edges of degree 1 to 5 and facets of degree -1 to 4, found {self.edge_degree}/"
                f"{self.face_degree}"
            )


@dataclass(frozen=True, eq=False)
class CellMaterials:
    """Conductivities of spheres and fluid, and resistances of contacts.

    Parameters
    ----------
    spheres : ndarray, shape (n,) [W/(m K)]
    fluid : float [W/(m K)]
    contact_radii : ndarray, shape (facets,) [m]
        0 where the spheres do not touch.
    contact_resistances : ndarray, shape (facets,) [K/W]
        Of each contact itself: half of it on each side, all of it on the sphere at a wall.
    """

    spheres: Floats
    fluid: float
    contact_radii: Floats
    contact_resistances: Floats


@dataclass(frozen=True, eq=False)
class CellSystem:
    """Energy of every cell over its unknowns.

    Parameters
    ----------
    topology : CellTopology
    plan : CellPlan
    matrices : ndarray
        Lower triangles of all cells, row by row, one after the other [W/K].
    starts : ndarray, shape (n + 1,)
        Unknowns ``starts[i] : starts[i + 1]`` of the lists below belong to cell i.
    unknowns : ndarray, shape (u,)
        Number of each unknown of each cell: vertices first, then edge bubbles, then facets. The first unknown of a
        facet is the temperature of its middle (of its contact disk, if it has one), the others are bubbles.
    arms : ndarray, shape (u, 3) [m]
        Field of unit gradient in each direction that is zero at the cell's centre.
    blocks : ndarray, shape (size + 1,)
        Where the unknowns of each vertex, edge and facet start; ``blocks[vertices]`` is the first edge.
    means : ndarray, shape (u,)
        Mean temperature of each sphere, over the cell's unknowns.
    rim_nodes : ndarray, shape (n,)
        Nodes on each sphere.
    """

    topology: CellTopology
    plan: CellPlan
    matrices: Floats
    starts: Integers
    unknowns: Integers
    arms: Floats
    blocks: Integers
    means: Floats
    rim_nodes: Integers

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.blocks[-1])

    @property
    def is_temperature(self) -> NDArray[np.bool_]:
        """Unknowns that are temperatures of points or disks, vertices and middles; the others are bubbles."""
        marks = np.zeros(self.size, dtype=np.bool_)
        marks[: self.vertices] = True
        facets = self.vertices + self.topology.edge_count
        start, count = self.blocks[facets:-1], np.diff(self.blocks[facets:])
        marks[start[count > 0]] = True
        return marks

    @property
    def vertices(self) -> int:
        """Number of vertices, the first unknowns."""
        return len(self.topology.polygons.vertices)


def powers_up_to(degree: int) -> Integers:
    """Powers (a, b) with a + b <= degree, lowest first.

    Examples
    --------
    >>> powers_up_to(1).tolist()
    [[0, 0], [1, 0], [0, 1]]
    """
    rows = [(total - b, b) for total in range(degree + 1) for b in range(total + 1)]
    return np.array(rows, dtype=np.int64).reshape(-1, 2)


def build_cells(
    topology: CellTopology,
    spheres: tuple[Floats, Floats],
    box: Box,
    materials: CellMaterials,
    frame: Frame,
    fineness: Fineness,
) -> CellSystem:
    """Matrices of all cells.

    Parameters
    ----------
    topology : CellTopology
    spheres : tuple of ndarray
        Centres, shape (n, 3) [m], and radii, shape (n,) [m].
    box : Box
    materials : CellMaterials
    frame : Frame
    fineness : Fineness

    Returns
    -------
    CellSystem

    Raises
    ------
    InputError
        If a conductivity is not positive.
    GeometryError
        See `plan_cells`.
    """
    _check_materials(materials)
    radii = spheres[1]
    contrast = float(materials.spheres.max()) / materials.fluid
    plan = plan_cells(topology, spheres, box, materials.contact_radii, contrast, fineness)
    polygons = topology.polygons
    powers = powers_up_to(frame.face_degree)
    on_edges = np.minimum(frame.edge_degree, 2 * plan.pieces) - 1
    first, second = polygons.cells[:, 0], polygons.cells[:, 1]
    smaller = np.minimum(radii[first], radii[np.where(second < 0, first, second)])
    around = np.add.reduceat(plan.pieces[topology.edge_of_corner], polygons.starts[:-1])
    inner = around * (3 * np.diff(plan.level_starts) - 2)  # middles, which carry the right-hand sides of bubbles
    on_faces = np.where(plan.areas >= SMALLEST_BUBBLE * smaller**2, np.minimum(len(powers), inner), 0)
    counts = np.concatenate((np.ones(len(polygons.vertices), dtype=np.int64), on_edges, on_faces))
    blocks = np.concatenate(([0], np.cumsum(counts)))

    resistances = _contact_matrices(topology, plan, radii, materials)
    points, weights = triangle_rule()
    rule = (np.array([shape_functions(xi, eta) for xi, eta in points]), weights)
    t, p = topology, plan
    arguments = (
        (
            *(t.side_starts, t.side_faces, t.side_ends, polygons.starts, t.edge_of_corner),
            *(t.vertex_starts, t.edge_starts, t.edges, t.corner_vertices, t.corner_edges, t.forward),
        ),
        (p.corners, p.axes, p.heights, p.disks),
        (p.pieces, p.centers, p.level_starts, p.levels, p.circles, p.contacts),
        (on_edges, on_faces, powers),
    )
    tables = (radial_moments(fineness.radial_degree), rule, green_table())
    matrices, unknowns, means, arms, nodes = [], [], [], [], np.zeros(len(radii), dtype=np.int64)
    for cell in range(len(radii)):
        media = (radii[cell], materials.spheres[cell], materials.fluid, resistances[cell])
        matrix, inside, weights, nodes[cell], columns, middles = cell_energy(cell, *arguments, media, tables)
        own = _unknowns(cell, topology, blocks)
        left, mean = eliminate(matrix, inside, weights, definite=not len(resistances[cell]))
        matrices.append(left[np.tril_indices(len(left))])
        unknowns.append(own)
        means.append(mean)
        faces = topology.side_faces[topology.side_starts[cell] : topology.side_starts[cell + 1]]
        own_arms, own_vertices = np.zeros((len(own), 3)), slice(*topology.vertex_starts[cell : cell + 2])
        own_arms[: own_vertices.stop - own_vertices.start] = plan.arms[own_vertices]
        with_middle = on_faces[faces] > 0
        own_arms[columns[with_middle]] = middles[with_middle]
        arms.append(own_arms)
    starts = np.concatenate(([0], np.cumsum([len(own) for own in unknowns]))).astype(np.int64)
    return CellSystem(
        topology,
        plan,
        np.concatenate(matrices),
        starts,
        np.concatenate(unknowns),
        np.concatenate(arms),
        blocks,
        np.concatenate(means),
        nodes,
    )


def _contact_matrices(topology: CellTopology, plan: CellPlan, radii: Floats, materials: CellMaterials) -> list[Floats]:
    """Temperatures of the contact disks of every sphere by unit flows through them [K/W], contact resistance included.

    Exact for equilibrium disks, with the dents of other contacts, as method `chord` of spheres in vacuum.
    """
    faces, ends = topology.side_faces, topology.side_ends
    sides = np.flatnonzero(plan.contacts[faces])
    cell = np.repeat(np.arange(len(radii)), np.diff(topology.side_starts))[sides]
    arms = plan.axes[faces[sides], 0] * np.where(ends[sides] == 0, 1.0, -1.0)[:, None]
    alpha = np.arcsin(np.minimum(materials.contact_radii[faces[sides]] / radii[cell], 1.0))
    offsets = np.searchsorted(cell, np.arange(len(radii) + 1)).astype(np.int64)
    packed = resistance_matrices(offsets, arms, alpha, "chord")
    at_wall = topology.polygons.cells[faces[sides], 1] < 0
    bond = materials.contact_resistances[faces[sides]] * np.where(at_wall, 1.0, 0.5)
    matrices, start = [], 0
    for p, count in enumerate(np.diff(offsets)):
        own = packed[start : start + count**2].reshape(count, count) / (materials.spheres[p] * radii[p])
        matrices.append(own + np.diag(bond[offsets[p] : offsets[p + 1]]))
        start += count**2
    return matrices


def _check_materials(materials: CellMaterials) -> None:
    if not (np.isfinite(materials.fluid) and materials.fluid > 0.0):
        raise InputError(f"the cell element needs a fluid that conducts, found {materials.fluid} W/(m K)")
    if not (np.isfinite(materials.spheres) & (materials.spheres > 0.0)).all():
        bad = int(np.argmin(np.where(np.isfinite(materials.spheres), materials.spheres, -np.inf)))
        raise InputError(
            f"the cell element needs spheres that conduct, found {materials.spheres[bad]} W/(m K) for sphere {bad}"
        )


def _unknowns(cell: int, topology: CellTopology, blocks: Integers) -> Integers:
    """Unknowns of one cell: its vertices, the bubbles of its edges, the bubbles of its facets."""
    t = topology
    vertices = len(t.polygons.vertices)
    own = np.concatenate(
        (
            vertices + t.edges[t.edge_starts[cell] : t.edge_starts[cell + 1]],
            vertices + t.edge_count + t.side_faces[t.side_starts[cell] : t.side_starts[cell + 1]],
        )
    )
    low, count = blocks[own], blocks[own + 1] - blocks[own]
    bubbles = np.repeat(low - np.concatenate(([0], np.cumsum(count)[:-1])), count) + np.arange(count.sum())
    return np.concatenate((t.vertices[t.vertex_starts[cell] : t.vertex_starts[cell + 1]], bubbles))
