"""Nodes on the boundary and inside a body: uniform, or denser towards boundary and corners."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.engines.meshless.domain import Domain, Polygon
from etc_engine.errors import GeometryError, InputError

Spacing = Literal["uniform", "chebyshev"]

CANDIDATES_PER_NODE = 24
#: Spacing at the boundary over the spacing at the deepest point, Chebyshev-like grading.
FINEST = 0.25


@dataclass(frozen=True, eq=False)
class BoundaryNodes:
    """Points on the boundary with the edge each belongs to and the outward normal there.

    Parameters
    ----------
    points : ndarray, shape (k, 2) [m]
        Positions on the boundary.
    normals : ndarray, shape (k, 2)
        Outward unit normals.
    edges : ndarray, shape (k,)
        Edge numbers.
    """

    points: Floats
    normals: Floats
    edges: Ints

    @property
    def count(self) -> int:
        """Number of points."""
        return len(self.points)

    def joined(self, other: BoundaryNodes) -> BoundaryNodes:
        """These nodes and then the others."""
        return BoundaryNodes(
            np.concatenate([self.points, other.points]),
            np.concatenate([self.normals, other.normals]),
            np.concatenate([self.edges, other.edges]),
        )


def boundary_nodes(domain: Domain, count: int, spacing: Spacing = "chebyshev") -> BoundaryNodes:
    """About ``count`` nodes shared over the edges by length; no node sits on a corner.

    ``uniform`` puts them at midpoints of equal pieces, ``chebyshev`` at Chebyshev points of each edge of a
    polygon (on a disk, both are uniform). An edge gets three nodes at least.

    Examples
    --------
    >>> boundary_nodes(Polygon([(0, 0), (1, 0), (1, 1), (0, 1)]), 16, "uniform").points[:4, 0]
    array([0.125, 0.375, 0.625, 0.875])
    """
    lengths = domain.edge_lengths
    _check_spacing(spacing)
    if count < 3 * len(lengths):
        raise InputError(
            f"{count} boundary nodes are too few for {len(lengths)} edges: give at least {3 * len(lengths)}"
        )
    shares = np.maximum(3, np.rint(count * lengths / lengths.sum()).astype(int))
    pieces = []
    for edge, share in enumerate(shares):
        s = (np.arange(share) + 0.5) / share
        if spacing == "chebyshev" and len(domain.corners):
            s = 0.5 * (1.0 - np.cos(np.pi * s))
        points, normals = domain.edge_points(edge, s)
        pieces.append((points, normals, np.full(share, edge)))
    return BoundaryNodes(*(np.concatenate([piece[i] for piece in pieces]) for i in range(3)))


def boundary_nodes_at(domain: Domain, points: Floats, dirichlet: Flags) -> BoundaryNodes:
    """Boundary nodes at the user's own points, corners allowed.

    A point on a corner belongs to the edge with prescribed temperature if there is one, else to the
    first of the two.

    Raises
    ------
    InputError
        If a point does not lie on the boundary.
    """
    points = _as_points(points, "boundary nodes")
    low, high = domain.bounds
    size = float(np.linalg.norm(high - low))
    distances = domain.edge_distances(points)
    gap = distances.min(axis=1)
    if (gap > 1e-6 * size).any():
        first = int(np.argmax(gap > 1e-6 * size))
        raise InputError(
            f"boundary node {first} at {points[first].tolist()} is {gap[first]:.3g} m away from the boundary"
        )
    if isinstance(domain, Polygon):
        edges = np.argmin(np.where(distances <= 1e-9 * size, np.where(dirichlet, 0.0, 1.0), 2.0 + distances), axis=1)
    else:
        edges = domain.nearest_edge(points)
    return BoundaryNodes(points, domain.normals_at(points, edges), edges.astype(np.int64))


def interior_nodes(domain: Domain, count: int, spacing: Spacing = "chebyshev") -> Floats:
    """About (uniform) or exactly (chebyshev) ``count`` nodes strictly inside, shape (k, 2) [m].

    ``uniform`` is a square lattice; ``chebyshev`` spreads nodes with a local distance that shrinks towards
    the boundary like the square root of the depth, as Chebyshev points do: each node in turn is the candidate
    farthest from the nodes before it, measured in local distances. Both are deterministic.
    """
    _check_spacing(spacing)
    if count < 1:
        raise InputError(f"at least one interior node is needed, found {count}")
    if spacing == "uniform":
        step = np.sqrt(domain.area / count)
        return _lattice(domain, step, margin=0.35 * step)
    candidates = _lattice(domain, np.sqrt(domain.area / (CANDIDATES_PER_NODE * count)), margin=0.0)
    depth = domain.edge_distances(candidates).min(axis=1)
    local = FINEST + (1.0 - FINEST) * np.sqrt(depth / depth.max())
    inside = depth > 0.3 * FINEST * np.sqrt(domain.area / count)
    return _spread(candidates[inside], local[inside], depth[inside], count)


def _lattice(domain: Domain, step: float, margin: float) -> Floats:
    low, high = domain.bounds
    axes = []
    for a, b in zip(low, high, strict=True):
        cells = max(1, round((b - a) / step))
        axes.append(a + (np.arange(cells) + 0.5) * (b - a) / cells)
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    grid = grid[domain.contains(grid)]
    grid = grid[domain.edge_distances(grid).min(axis=1) > max(margin, 1e-6 * step)] if len(grid) else grid
    if len(grid) == 0:
        raise GeometryError(f"no node of a lattice with spacing {step:g} m falls inside the body: ask for more nodes")
    return np.asarray(grid)


def _spread(candidates: Floats, local: Floats, depth: Floats, count: int) -> Floats:
    """Farthest-point selection in the metric |x - y| / local(y), started at the deepest candidate."""
    if len(candidates) < count:
        raise GeometryError(f"{count} interior nodes do not fit into the body: ask for fewer")
    chosen = np.empty(count, dtype=np.int64)
    chosen[0] = int(np.argmax(depth))
    x, y = np.ascontiguousarray(candidates.T / np.ptp(candidates, axis=0).max())
    weight = 1.0 / local**2
    gap = np.full(len(candidates), np.inf)
    for k in range(1, count):
        last = chosen[k - 1]
        np.minimum(gap, ((x - x[last]) ** 2 + (y - y[last]) ** 2) * weight, out=gap)
        # ties (symmetric bodies) go by the order of the candidates, whatever the unit of length
        chosen[k] = int(np.argmax(np.round(gap, 10)))
    return np.asarray(candidates[chosen])


def checked_interior(domain: Domain, points: Floats) -> Floats:
    """The user's interior nodes, refused when one lies outside the body."""
    points = _as_points(points, "interior nodes")
    outside = ~domain.contains(points)
    if outside.any():
        first = int(np.argmax(outside))
        raise InputError(f"interior node {first} at {points[first].tolist()} lies outside the body")
    return points


def refuse_duplicates(points: Floats) -> float:
    """Mean distance [m] from a node to its nearest neighbour.

    Raises
    ------
    InputError
        If two nodes coincide: the interpolation matrix would be singular.
    """
    distance, neighbour = (np.asarray(found) for found in cKDTree(points).query(points, k=2))
    gap = distance[:, 1]
    if gap.min() <= 1e-9 * gap.mean():
        first = int(np.argmin(gap))
        raise InputError(
            f"nodes {first} and {int(neighbour[first, 1])} coincide at {points[first].tolist()}: "
            "interpolation needs distinct nodes"
        )
    return float(gap.mean())


def _as_points(points: Floats, what: str) -> Floats:
    points = np.asarray(points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 2 or len(points) == 0 or not np.isfinite(points).all():
        raise InputError(f"{what} must be finite positions of shape (k, 2), found shape {points.shape}")
    return points


def _check_spacing(spacing: str) -> None:
    if spacing not in ("uniform", "chebyshev"):
        raise InputError(f"the node spacing {spacing!r} is unknown: expected uniform or chebyshev")
