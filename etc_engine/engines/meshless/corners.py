r"""Corners with a singular field: fundamental solutions clustered behind them, and boundary nodes to fit them.

At a corner of inner angle omega the temperature behaves like r^nu, with nu = pi/omega between edges of one kind of
condition and nu = pi/(2 omega) where the kind changes. For nu < 1 no smooth function follows it. Sources outside the
body at the distances

    d_j = d_0 exp(-s (sqrt n - sqrt j)),   j = 1 .. n,

along a ray do, with an error that falls like exp(-c sqrt n).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etc_engine.arrays import Floats, Ints
from etc_engine.engines.meshless.domain import Domain, Polygon
from etc_engine.engines.meshless.nodes import BoundaryNodes
from etc_engine.engines.meshless.problem import BoundaryCondition, Dirichlet

#: d_1 / d_0, which sets s: the field within so short a way carries no heat that matters.
NEAREST = 1e-5
#: d_0 over the shorter of the two edges.
REACH = 0.5
#: Boundary nodes of each edge per source.
NODES_PER_SOURCE = 2
#: A leading exponent above this is smooth enough for functions without a corner.
SMOOTH = 1.0 - 1e-9


def singular_corners(domain: Domain, boundary: Sequence[BoundaryCondition]) -> Ints:
    """Vertices of a polygon where nu < 1: re-entrant corners, and changes of the kind of condition.

    Examples
    --------
    >>> ell = Polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])
    >>> singular_corners(ell, [Dirichlet(0.0)] * 6).tolist()
    [3]
    """
    if not isinstance(domain, Polygon):
        return np.empty(0, dtype=np.int64)
    held = np.array([isinstance(condition, Dirichlet) for condition in boundary])
    factor = np.where(held == np.roll(held, 1), 1.0, 0.5)
    return np.flatnonzero(factor * np.pi / _openings(domain) < SMOOTH)


def corner_sources(domain: Domain, boundary: Sequence[BoundaryCondition], corners: Ints, count: int) -> Floats:
    """Sources behind the corners, shape (<= 2 corners x count, 2) [m], except those close to another part of the body.

    Between prescribed temperatures the leading mode is even about the bisector, and one ray of sources serves; the
    others take two.
    """
    if not isinstance(domain, Polygon) or not corners.size:
        return np.empty((0, 2))
    distances, outside = _distances(count), 2.0 * np.pi - _openings(domain)
    turn = np.sign(domain.signed_area)
    held = [isinstance(condition, Dirichlet) for condition in boundary]
    placed, own = [np.empty((0, 2))], [np.empty(0, dtype=np.int64)]
    for corner in corners:
        reach = REACH * min(domain.edge_lengths[corner], domain.edge_lengths[corner - 1])
        along = domain.edges[corner]
        first = np.arctan2(along[1], along[0])
        for part in (0.5,) if held[corner] and held[corner - 1] else (1.0 / 3.0, 2.0 / 3.0):
            angle = first - turn * part * outside[corner]
            ray = np.array([np.cos(angle), np.sin(angle)])
            placed.append(domain.vertices[corner] + reach * distances[:, None] * ray)
            own.append(np.full(count, corner))
    sources, of = np.concatenate(placed), np.concatenate(own)
    clearance = domain.edge_distances(sources)
    adjacent = np.minimum(*clearance[np.arange(of.size), [of, of - 1]])
    crowded = clearance.min(axis=1) < 0.9 * adjacent
    return np.asarray(sources[~domain.contains(sources) & ~crowded])


def corner_nodes(domain: Domain, corners: Ints, count: int) -> BoundaryNodes:
    """Boundary nodes on both edges of each corner, as close to it as its sources."""
    points, normals, edges = [np.empty((0, 2))], [np.empty((0, 2))], [np.empty(0, dtype=np.int64)]
    if isinstance(domain, Polygon):
        s = _distances(NODES_PER_SOURCE * count)
        number = len(domain.vertices)
        for corner in corners:
            reach = REACH * min(domain.edge_lengths[corner], domain.edge_lengths[corner - 1])
            for edge, forwards in ((int(corner), True), ((int(corner) - 1) % number, False)):
                part = reach * s / domain.edge_lengths[edge]
                at, outward = domain.edge_points(edge, part if forwards else 1.0 - part)
                points.append(at)
                normals.append(outward)
                edges.append(np.full(s.size, edge))
    return BoundaryNodes(np.concatenate(points), np.concatenate(normals), np.concatenate(edges))


def _distances(count: int) -> Floats:
    """d_j / d_0."""
    if count == 1:
        return np.ones(1)
    share = (np.sqrt(count) - np.sqrt(np.arange(1.0, count + 1.0))) / (np.sqrt(count) - 1.0)
    return np.asarray(NEAREST**share)


def _openings(domain: Polygon) -> Floats:
    """Inner angle at each vertex [rad]."""
    turn = np.sign(domain.signed_area)
    after, before = domain.edges, -np.roll(domain.edges, 1, axis=0)
    angle = np.arctan2(before[:, 1], before[:, 0]) - np.arctan2(after[:, 1], after[:, 0])
    return np.asarray(np.mod(turn * angle, 2.0 * np.pi))
