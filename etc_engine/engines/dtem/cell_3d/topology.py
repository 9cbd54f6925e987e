"""Cells, facets, edges and vertices of a Laguerre diagram: who shares what, numbered globally and inside each cell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from etc_engine.arrays import Flags, Ints
from etc_engine.errors import GeometryError
from etc_engine.structure.laguerre_polygons import LaguerrePolygons

Integers = Ints

IMAGES = 16
"""Images of a vertex beside one cell, per axis, that a key has room for."""


@dataclass(frozen=True, eq=False)
class CellTopology:
    """Incidence of cells, facets, edges and vertices.

    Parameters
    ----------
    polygons : LaguerrePolygons
    side_starts : ndarray, shape (n + 1,)
        Sides ``side_starts[i] : side_starts[i + 1]`` close cell i.
    side_faces, side_ends : ndarray, shape (s,)
        Facet of a side, and whether the cell is the facet's first (0) or second (1).
    vertex_starts : ndarray, shape (n + 1,)
    vertices, vertex_images : ndarray, shapes (vc,), (vc, 3)
        Vertices of each cell, and their images beside its centre.
    edge_starts : ndarray, shape (n + 1,)
    edges : ndarray, shape (ec,)
        Edges of each cell.
    corner_vertices, corner_edges : ndarray, shape (2, c)
        For each end of a facet and each of its corners: the vertex, and the edge that begins there, as numbered
        inside the cell of that end.
    edge_of_corner : ndarray, shape (c,)
        Global edge from a corner to the next.
    forward : ndarray of bool, shape (c,)
        Whether the facet runs along that edge in its common orientation.
    edge_count : int
    """

    polygons: LaguerrePolygons
    side_starts: Integers
    side_faces: Integers
    side_ends: Integers
    vertex_starts: Integers
    vertices: Integers
    vertex_images: Integers
    edge_starts: Integers
    edges: Integers
    corner_vertices: Integers
    corner_edges: Integers
    edge_of_corner: Integers
    forward: Flags
    edge_count: int


def cell_topology(polygons: LaguerrePolygons, cells: int) -> CellTopology:
    """Number facets, edges and vertices inside each cell.

    Raises
    ------
    GeometryError
        If a cell is not closed: an edge of it does not lie between exactly two of its facets.
    """
    p = polygons
    face = np.repeat(np.arange(p.count), np.diff(p.starts))
    following = np.arange(1, len(p.corners) + 1)
    following[p.starts[1:] - 1] = p.starts[:-1]
    forward, edge_of_corner, edge_count = _edges(p, following)
    begins = np.where(forward[:, None], p.images, p.images[following])

    owner = np.stack((p.cells[face, 0], p.cells[face, 1]))
    inner = owner[1] >= 0
    shift = p.shifts[face]
    vertex_starts, vertices, vertex_images, corner_vertices = _number(
        owner, p.corners, np.stack((p.images, p.images - shift)), inner, cells
    )
    edge_starts, edges, _, corner_edges = _number(
        owner, edge_of_corner, np.stack((begins, begins - shift)), inner, cells
    )

    valid = np.stack((np.ones_like(inner), inner))
    which = edge_starts[np.where(valid, owner, 0)] + corner_edges
    uses = np.bincount(which[valid], minlength=len(edges))
    if np.any(uses != 2):
        cell = int(np.searchsorted(edge_starts, np.flatnonzero(uses != 2)[0], side="right")) - 1
        raise GeometryError(
            f"the Laguerre cell of sphere {cell} is not closed: an edge of it lies in {int(uses[uses != 2][0])} facets "
            f"instead of 2; move the sphere by more than 1e-6 of the mean spacing"
        )
    ends = np.concatenate((np.zeros(p.count, dtype=np.int64), np.ones(int((p.cells[:, 1] >= 0).sum()), dtype=np.int64)))
    faces = np.concatenate((np.arange(p.count), np.flatnonzero(p.cells[:, 1] >= 0)))
    of_cell = p.cells[faces, ends]
    order = np.lexsort((ends, faces, of_cell))
    side_starts = np.searchsorted(of_cell[order], np.arange(cells + 1))
    return CellTopology(
        p,
        side_starts.astype(np.int64),
        faces[order],
        ends[order],
        vertex_starts,
        vertices,
        vertex_images,
        edge_starts,
        edges,
        corner_vertices,
        corner_edges,
        edge_of_corner,
        forward,
        edge_count,
    )


def _edges(p: LaguerrePolygons, following: Integers) -> tuple[Flags, Integers, int]:
    """Orientation common to all facets, global edge of each corner, number of edges."""
    start, end = p.corners, p.corners[following]
    step = p.images[following] - p.images
    ahead = (step @ np.array([IMAGES**2, IMAGES, 1])) > 0
    forward = np.where(start == end, ahead, start < end)
    low, high = np.where(forward, start, end), np.where(forward, end, start)
    step = np.where(forward[:, None], step, -step)
    pairs = low * len(p.vertices) + high
    _, pair_number = np.unique(pairs, return_inverse=True)
    _, edge = np.unique(pair_number * IMAGES**3 + _packed(step), return_inverse=True)
    return forward, edge.astype(np.int64), int(edge.max()) + 1


def _packed(images: Integers) -> Integers:
    """Three small integers in one."""
    if np.abs(images).max(initial=0) >= IMAGES // 2:
        raise GeometryError(
            f"a Laguerre cell reaches over {int(np.abs(images).max())} box lengths, at most {IMAGES // 2 - 1} are "
            f"allowed; repeat the box"
        )
    return (images + IMAGES // 2) @ np.array([IMAGES**2, IMAGES, 1])


def _number(
    owner: Integers, number: Integers, images: Integers, inner: Flags, cells: int
) -> tuple[Integers, Integers, Integers, Integers]:
    """Where each cell starts, numbers and images of its members, and the place of each corner inside its cell."""
    most = int(number.max()) + 1
    key = (owner * most + number) * IMAGES**3 + _packed(images)
    members, place = np.unique(np.concatenate((key[0], key[1][inner])), return_inverse=True)
    image, rest = members % IMAGES**3, members // IMAGES**3
    member_images = np.column_stack((image // IMAGES**2, image // IMAGES % IMAGES, image % IMAGES)) - IMAGES // 2
    starts = np.searchsorted(rest // most, np.arange(cells + 1)).astype(np.int64)
    places = np.full(key.shape, -1, dtype=np.int64)
    places[0] = place[: key.shape[1]]
    places[1, inner] = place[key.shape[1] :]
    places -= np.where(places >= 0, starts[np.maximum(owner, 0)], 0)
    return starts, rest % most, member_images, places
