"""Plane domains: polygons and disks, their boundary pieces, normals, distances and quadrature."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.errors import GeometryError

TWO_PI = 2.0 * np.pi


class Domain(Protocol):
    """What the solvers ask of a domain; boundary piece i is walked by a fraction s in [0, 1]."""

    @property
    def edge_lengths(self) -> Floats: ...  # noqa: D102
    @property
    def corners(self) -> Floats: ...  # noqa: D102
    @property
    def area(self) -> float: ...  # noqa: D102
    @property
    def bounds(self) -> tuple[Floats, Floats]: ...  # noqa: D102
    def edge_points(self, edge: int, s: Floats) -> tuple[Floats, Floats]: ...  # noqa: D102
    def nearest_edge(self, points: Floats) -> Ints: ...  # noqa: D102
    def edge_distances(self, points: Floats) -> Floats: ...  # noqa: D102
    def normals_at(self, points: Floats, edges: Ints) -> Floats: ...  # noqa: D102
    def contains(self, points: Floats) -> Flags: ...  # noqa: D102
    def star_center(self) -> Floats | None: ...  # noqa: D102
    def quadrature(self, order: int) -> tuple[Floats, Floats]: ...  # noqa: D102


def circumscribed(domain: Domain) -> tuple[Floats, float]:
    """Centre of the bounding box and the largest distance [m] from it to the domain."""
    low, high = domain.bounds
    center = 0.5 * (low + high)
    if isinstance(domain, Disk):
        return center, domain.radius
    return center, float(np.linalg.norm(domain.corners - center, axis=1).max())


@dataclass(frozen=True, eq=False)
class Polygon:
    """A simple polygon; edge i runs from vertex i to vertex i + 1, either way round.

    Parameters
    ----------
    vertices : array_like, shape (n, 2) [m]
        The corners in order, the first not repeated at the end.

    Raises
    ------
    GeometryError
        If there are fewer than three vertices, a coordinate is not finite, two neighbours coincide, or
        two edges touch or cross.

    Examples
    --------
    >>> Polygon([(0, 0), (3, 0), (3, 3), (0, 3)]).area
    9.0
    """

    vertices: Floats

    def __post_init__(self) -> None:
        vertices = np.array(self.vertices, dtype=np.float64)
        if vertices.ndim != 2 or vertices.shape[1:] != (2,) or len(vertices) < 3:
            raise GeometryError(
                f"a polygon needs at least three vertices (x, y), found an array of shape {vertices.shape}"
            )
        if not np.isfinite(vertices).all():
            raise GeometryError(f"polygon vertices must be finite, found {vertices.tolist()}")
        vertices.setflags(write=False)
        object.__setattr__(self, "vertices", vertices)
        _refuse_improper(vertices)

    @cached_property
    def edges(self) -> Floats:
        """Edge vectors, shape (n, 2) [m]."""
        return np.roll(self.vertices, -1, axis=0) - self.vertices

    @cached_property
    def edge_lengths(self) -> Floats:
        """Edge lengths, shape (n,) [m]."""
        return np.asarray(np.linalg.norm(self.edges, axis=1))

    @property
    def corners(self) -> Floats:
        """The vertices: points where the outward normal jumps, shape (n, 2) [m]."""
        return self.vertices

    @cached_property
    def signed_area(self) -> float:
        """Area [m2], positive when the vertices run counter-clockwise."""
        x, y = (self.vertices - self.vertices[0]).T
        return float(0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum())

    @property
    def area(self) -> float:
        """Area [m2]."""
        return abs(self.signed_area)

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Lower and upper corner of the bounding box."""
        return self.vertices.min(axis=0), self.vertices.max(axis=0)

    @cached_property
    def normals(self) -> Floats:
        """Outward unit normal of each edge, shape (n, 2)."""
        turn = np.sign(self.signed_area)
        rotated = np.column_stack([self.edges[:, 1], -self.edges[:, 0]])
        return np.asarray(turn * rotated / self.edge_lengths[:, None])

    def edge_points(self, edge: int, s: Floats) -> tuple[Floats, Floats]:
        """Points at fractions s of an edge, and the outward normals there, each of shape (k, 2)."""
        points = self.vertices[edge] + np.asarray(s)[:, None] * self.edges[edge]
        return points, np.broadcast_to(self.normals[edge], points.shape).copy()

    def edge_distances(self, points: Floats) -> Floats:
        """Distance [m] of each point to each edge, shape (k, n)."""
        offset = np.asarray(points)[:, None, :] - self.vertices
        s = (offset * self.edges).sum(axis=2) / self.edge_lengths**2
        nearest = np.clip(s, 0.0, 1.0)[:, :, None] * self.edges
        return np.asarray(np.linalg.norm(offset - nearest, axis=2))

    def nearest_edge(self, points: Floats) -> Ints:
        """The edge closest to each point (the first of equals)."""
        return np.asarray(np.argmin(self.edge_distances(points), axis=1), dtype=np.int64)

    def normals_at(self, points: Floats, edges: Ints) -> Floats:  # noqa: ARG002
        """Outward normal at boundary points that belong to the given edges."""
        return np.asarray(self.normals[edges])

    def contains(self, points: Floats) -> Flags:
        """True for points strictly inside (even-odd rule; points on the boundary are undecided)."""
        x, y = np.asarray(points).T[:, :, None]
        (x1, y1), (dx, dy) = self.vertices.T, self.edges.T
        straddles = (y1 > y) != (y1 + dy > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = x < x1 + dx * (y - y1) / dy
        return np.asarray((straddles & crossing).sum(axis=1) % 2 == 1)

    def star_center(self) -> Floats | None:
        """The deepest point of the star kernel (it sees every edge from inside), None if there is none.

        The kernel is the intersection of the inner half planes n_i . x <= n_i . v_i; its deepest point
        is a linear program (largest inscribed circle).
        """
        from scipy.optimize import linprog

        offset = (self.normals * self.vertices).sum(axis=1)
        program = linprog(
            [0.0, 0.0, -1.0],
            A_ub=np.column_stack([self.normals, np.ones(len(offset))]),
            b_ub=offset,
            bounds=[(None, None), (None, None), (0.0, None)],
        )
        if not program.success or program.x is None or program.x[2] <= 1e-9 * self.edge_lengths.max():
            return None
        return np.asarray(program.x[:2])

    def triangles(self) -> Ints:
        """Triangulation by ear clipping: vertex numbers, shape (n - 2, 3)."""
        remaining = list(range(len(self.vertices)))
        if self.signed_area < 0.0:
            remaining.reverse()
        ears = []
        while len(remaining) > 3:
            ear = self._find_ear(remaining)
            ears.append((remaining[ear - 1], remaining[ear], remaining[(ear + 1) % len(remaining)]))
            del remaining[ear]
        return np.array([*ears, tuple(remaining)], dtype=np.int64)

    def _find_ear(self, ring: list[int]) -> int:
        """Position in the ring of the best-shaped corner that can be cut off."""
        best, quality = -1, -np.inf
        for position, corner in enumerate(ring):
            a, b, c = self.vertices[[ring[position - 1], corner, ring[(position + 1) % len(ring)]]]
            area = _cross(b - a, c - a)
            others = self.vertices[[v for v in ring if v not in (ring[position - 1], corner)]]
            inside = [_cross(q - p, others.T - p[:, None]) > 0.0 for p, q in ((a, b), (b, c), (c, a))]
            if area <= 0.0 or np.logical_and.reduce(inside).any():
                continue
            shape = area / max(np.dot(b - a, b - a), np.dot(c - b, c - b), np.dot(a - c, a - c))
            if shape > quality:
                best, quality = position, shape
        if best < 0:
            raise GeometryError("the polygon cannot be triangulated: check its vertices for slivers")
        return best

    def quadrature(self, order: int) -> tuple[Floats, Floats]:
        """Points (k, 2) and weights (k,) [m2]: Gauss of the given order on each triangle (Duffy's map)."""
        nodes, weights = np.polynomial.legendre.leggauss(order)
        s, w = 0.5 * (nodes + 1.0), 0.5 * weights
        u, v = (grid.ravel() for grid in np.meshgrid(s, s, indexing="ij"))
        points, measures = [], []
        for a, b, c in self.vertices[self.triangles()]:
            points.append(a + u[:, None] * (b - a) + (u * v)[:, None] * (c - b))
            measures.append(np.outer(w, w).ravel() * u * abs(_cross(b - a, c - a)))
        return np.vstack(points), np.concatenate(measures)


@dataclass(frozen=True, eq=False)
class Disk:
    """A disk whose circle is cut into arcs; arc i runs counter-clockwise from break i to break i + 1.

    Parameters
    ----------
    center : tuple of float [m]
        The centre.
    radius : float [m]
        The radius, positive.
    breaks : sequence of float [rad]
        Strictly increasing angles within one turn where boundary conditions may change; without breaks
        the circle is one piece.

    Raises
    ------
    GeometryError
        If the radius is not positive or the breaks do not increase within one turn.

    Examples
    --------
    >>> Disk((0.0, 0.0), 2.0, breaks=(0.0, 3.141592653589793)).edge_lengths.round(6)
    array([6.283185, 6.283185])
    """

    center: tuple[float, float]
    radius: float
    breaks: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        center = tuple(float(value) for value in self.center)
        if len(center) != 2 or not np.isfinite([*center, self.radius]).all() or self.radius <= 0.0:
            raise GeometryError(
                f"a disk needs a centre (x, y) and a positive radius, found {self.center} and {self.radius}"
            )
        breaks = tuple(float(angle) for angle in self.breaks)
        span = np.diff([*breaks, breaks[0] + TWO_PI]) if breaks else np.array([TWO_PI])
        if not (np.isfinite(span).all() and (span > 0.0).all()):
            raise GeometryError(f"the breaks of a disk must increase within one turn, found {breaks}")
        object.__setattr__(self, "center", center)
        object.__setattr__(self, "breaks", breaks)

    @cached_property
    def spans(self) -> tuple[Floats, Floats]:
        """First angle and opening angle of each arc [rad]."""
        first = np.array(self.breaks or (0.0,))
        return first, np.diff(np.append(first, first[0] + TWO_PI))

    @cached_property
    def edge_lengths(self) -> Floats:
        """Arc lengths, shape (n,) [m]."""
        return np.asarray(self.radius * self.spans[1])

    @property
    def corners(self) -> Floats:
        """No point of a circle is a corner: shape (0, 2)."""
        return np.empty((0, 2))

    @property
    def area(self) -> float:
        """Area [m2]."""
        return float(np.pi * self.radius**2)

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Lower and upper corner of the bounding box."""
        center = np.array(self.center)
        return center - self.radius, center + self.radius

    def edge_points(self, edge: int, s: Floats) -> tuple[Floats, Floats]:
        """Points at fractions s of an arc, and the outward normals there, each of shape (k, 2)."""
        first, opening = self.spans
        angle = first[edge] + np.asarray(s) * opening[edge]
        normals = np.column_stack([np.cos(angle), np.sin(angle)])
        return np.array(self.center) + self.radius * normals, normals

    def edge_distances(self, points: Floats) -> Floats:
        """Distance [m] of each point to the circle (one column)."""
        r = np.linalg.norm(np.asarray(points) - self.center, axis=1)
        return np.asarray(np.abs(r - self.radius)[:, None])

    def nearest_edge(self, points: Floats) -> Ints:
        """The arc that a point's angle falls into."""
        x, y = (np.asarray(points) - self.center).T
        first, _ = self.spans
        turn = np.mod(np.arctan2(y, x) - first[0], TWO_PI)
        return np.asarray(np.searchsorted(first - first[0], turn, side="right") - 1, dtype=np.int64)

    def normals_at(self, points: Floats, edges: Ints) -> Floats:  # noqa: ARG002
        """Outward normal at boundary points."""
        offset = np.asarray(points) - self.center
        return np.asarray(offset / np.linalg.norm(offset, axis=1, keepdims=True))

    def contains(self, points: Floats) -> Flags:
        """True for points strictly inside."""
        return np.asarray(np.linalg.norm(np.asarray(points) - self.center, axis=1) < self.radius)

    def star_center(self) -> Floats | None:
        """The centre: it sees the whole circle."""
        return np.array(self.center)

    def quadrature(self, order: int) -> tuple[Floats, Floats]:
        """Points (k, 2) and weights (k,) [m2]: Gauss in r^2, equal angles."""
        nodes, weights = np.polynomial.legendre.leggauss(order)
        r = self.radius * np.sqrt(0.5 * (nodes + 1.0))
        angle = TWO_PI * np.arange(4 * order) / (4 * order)
        ring = np.column_stack([np.cos(angle), np.sin(angle)])
        points = np.array(self.center) + (r[:, None, None] * ring).reshape(-1, 2)
        return points, np.repeat(0.5 * weights * self.area / len(angle), len(angle))


def boundary_quadrature(domain: Domain, order: int, panels: int = 16) -> tuple[Floats, Floats, Floats]:
    """Gauss points (k, 2), outward normals (k, 2) and weights (k,) [m] along the boundary.

    The boundary is cut into at least ``panels`` pieces of about equal length, shared over the edges.
    """
    nodes, weights = np.polynomial.legendre.leggauss(order)
    lengths = domain.edge_lengths
    points, normals, measures = [], [], []
    for edge, length in enumerate(lengths):
        count = int(np.ceil(panels * length / lengths.sum() - 1e-9))
        s = (np.arange(count)[:, None] + 0.5 * (nodes + 1.0)).ravel() / count
        at, outward = domain.edge_points(edge, s)
        points.append(at)
        normals.append(outward)
        measures.append(np.tile(0.5 * weights * length / count, count))
    return np.vstack(points), np.vstack(normals), np.concatenate(measures)


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[0] * b[1] - a[1] * b[0])


def _refuse_improper(vertices: Floats) -> None:
    """Refuse coincident neighbours, edges folded back on themselves, and edges that touch or cross."""
    n = len(vertices)
    edges = np.roll(vertices, -1, axis=0) - vertices
    lengths = np.linalg.norm(edges, axis=1)
    size = lengths.max()
    if (lengths <= 1e-12 * size).any():
        first = int(np.flatnonzero(lengths <= 1e-12 * size)[0])
        raise GeometryError(
            f"polygon vertices {first} and {(first + 1) % n} coincide at {vertices[first].tolist()}: "
            "list each corner once, without closing the ring"
        )
    for i in range(n):
        j = (i + 1) % n
        sine, cosine = _cross(edges[i], edges[j]), np.dot(edges[i], edges[j])
        if cosine < 0.0 and abs(sine) <= 1e-12 * lengths[i] * lengths[j]:
            raise GeometryError(f"polygon edge {j} folds back on edge {i} at vertex {j}: found a corner of angle 0")
        for k in range(i + 2, n if i else n - 1):
            if _segments_meet(vertices[i], edges[i], vertices[k], edges[k]):
                raise GeometryError(
                    f"polygon edges {i} and {k} touch or cross: list the vertices of a simple polygon in turn"
                )


def _segments_meet(p: Floats, d: Floats, q: Floats, e: Floats) -> bool:
    """True if the segments p + s d and q + t e (s, t in [0, 1]) have a common point."""
    margin = 1e-12 * np.linalg.norm(d) * np.linalg.norm(e)
    sides = [float(_cross(d, q - p)), float(_cross(d, q + e - p))]
    others = [float(_cross(e, p - q)), float(_cross(e, p + d - q))]
    if max(map(abs, sides)) <= margin:  # parallel on one line: compare the intervals along it
        s = sorted(float(np.dot(point - p, d) / np.dot(d, d)) for point in (q, q + e))
        return s[0] <= 1.0 and s[1] >= 0.0
    apart = min(sides) > margin or max(sides) < -margin or min(others) > margin or max(others) < -margin
    return not apart
