"""How a body is discretized: nodes, radial basis, Trefftz functions or sources, in scaled coordinates."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from etc_engine.arrays import Floats, Ints
from etc_engine.engines.meshless import nodes as node_layouts
from etc_engine.engines.meshless.corners import corner_nodes, corner_sources, singular_corners
from etc_engine.engines.meshless.domain import circumscribed
from etc_engine.engines.meshless.fundamental_solutions import clearance_of_sources, factor_sources, offset_sources
from etc_engine.engines.meshless.nodes import BoundaryNodes, Spacing
from etc_engine.engines.meshless.problem import Dirichlet, HeatProblem
from etc_engine.engines.meshless.radial_basis import PolyharmonicSpline, RadialBasis
from etc_engine.engines.meshless.wedges import Wedge, corner_wedges
from etc_engine.errors import InputError

Method = Literal["trefftz", "mfs"]

#: Collocation points per unknown of the homogeneous part: 2 or more keeps time marching stable.
OVERSAMPLING = 2
#: Node spacings around a jump of prescribed temperatures in which the residual is not judged.
JUMP_MARGIN = 4.0
#: Sources of a corner: with more, those closest to it are told from it by round-off alone.
MOST_CORNER_SOURCES = 60


@dataclass(frozen=True, eq=False)
class Discretization:
    """Nodes and functions of a meshless solution; the defaults suit a smooth field on a compact body.

    Parameters
    ----------
    boundary : int or array_like, shape (k, 2) [m]
        Number of boundary nodes, or the nodes themselves.
    interior : int or array_like, shape (k, 2) [m]
        Number of interior nodes, or the nodes themselves.
    spacing : "chebyshev" or "uniform"
        Grading of generated nodes.
    basis : PolyharmonicSpline or ReverseBasis
        Radial basis of the particular part.
    functions : int, optional
        Number of Trefftz functions, or of sources for the method of fundamental solutions; half the boundary
        nodes by default, never more than the boundary nodes.
    corner_sources : int
        Fundamental solutions on a ray behind each corner with a singular field (re-entrant, or where the kind of
        condition changes), with either method; 0 does without. Boundary nodes of your own get none.
    source_offset : float
        Distance of the sources along the outward normals, in units of the domain radius.
    source_factor : float, optional
        Instead of the offset: sources at x + factor (x - centre).
    source_center : tuple of float, optional [m]
        Centre for ``source_factor``; the deepest point of the star kernel by default.
    length_scale : float, optional [m]
        Unit of length of the radial functions, by default the domain radius. It matters only for splines
        without polynomials.
    rank_tolerance : float
        Singular values of the boundary system below this part of the largest are cut off.
    residual_limit : float
        A boundary residual above this part of the temperature span is refused. Data that jumps along the boundary
        needs a larger one: no smooth field meets it.
    allow_unstable : bool
        Go on (with a warning) when the time step operator amplifies; refused otherwise.
    """

    boundary: int | Floats = 160
    interior: int | Floats = 480
    spacing: Spacing = "chebyshev"
    basis: RadialBasis = PolyharmonicSpline(2)  # noqa: RUF009 - frozen, so one instance may be shared
    functions: int | None = None
    corner_sources: int = 24
    source_offset: float = 0.6
    source_factor: float | None = None
    source_center: tuple[float, float] | None = None
    length_scale: float | None = None
    rank_tolerance: float = 1e-14
    residual_limit: float = 0.01
    allow_unstable: bool = False

    def __post_init__(self) -> None:
        if not 0.0 <= self.rank_tolerance < 1.0:
            raise InputError(f"the rank tolerance must lie in [0, 1), found {self.rank_tolerance}")
        for name in ("source_offset", "source_factor", "length_scale"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0.0):
                raise InputError(f"{name} must be positive and finite, found {value}")
        if self.functions is not None and self.functions < 1:
            raise InputError(f"at least one function is needed, found {self.functions}")
        if not 0 <= self.corner_sources <= MOST_CORNER_SOURCES:
            raise InputError(f"a corner takes 0 to {MOST_CORNER_SOURCES} sources, found {self.corner_sources}")


@dataclass(frozen=True, eq=False)
class Layout:
    """A discretized problem: everything that does not depend on lambda, in scaled coordinates.

    Positions are (x - center)/scale; ``b1`` and ``b2`` are the coefficients of B1 u + B2 du/dn = B3 in
    scaled coordinates (B2 = k/scale times its physical value). ``functions`` counts the Trefftz functions, ``sources``
    are the fundamental solutions of the method and, the last ``clustered`` of them, of the corners; the latter lie so
    close together that their rank says nothing. ``nearness`` is the distance of each collocation point from the next
    corner that has sources, in node spacings and at most 1. ``wedges`` are the singular harmonics of the interpolation.
    """

    problem: HeatProblem
    discretization: Discretization
    method: Method
    center: Floats
    scale: float
    radius: float
    collocation: BoundaryNodes
    check: BoundaryNodes
    nodes: Floats
    spacing: float
    functions: int
    sources: Floats
    clearance: Floats
    nearness: Floats
    clustered: int = 0
    wedges: tuple[Wedge, ...] = ()

    @property
    def columns(self) -> int:
        """Functions of the homogeneous part."""
        return self.functions + len(self.sources)

    def scaled(self, points: Floats) -> Floats:
        """Physical positions in scaled coordinates."""
        return (np.asarray(points, dtype=float) - self.center) / self.scale

    def boundary_coefficients(self, edges: Ints) -> tuple[Floats, Floats]:
        """(B1, B2) for boundary nodes of the given edges, B2 with conductivity and scale."""
        pairs = np.array([condition.coefficients() for condition in self.problem.boundary])
        return pairs[edges, 0], pairs[edges, 1] * self.problem.conductivity / self.scale

    def boundary_data(self, where: BoundaryNodes, t: float) -> Floats:
        """B3 at boundary nodes and a time."""
        data = np.empty(where.count)
        for edge, condition in enumerate(self.problem.boundary):
            mine = where.edges == edge
            if mine.any():
                data[mine] = condition.sample(where.points[mine], t)
        return data


def lay_out(problem: HeatProblem, discretization: Discretization, method: Method) -> Layout:
    """Place nodes and functions for a problem.

    Raises
    ------
    InputError
        If nodes are too few, coincide or lie elsewhere, or there are more functions than boundary nodes.
    GeometryError
        If sources do not lie outside the body.
    """
    if method not in ("trefftz", "mfs"):
        raise InputError(f"the method {method!r} is unknown: expected trefftz or mfs")
    domain = problem.domain
    center, radius = circumscribed(domain)
    collocation = _collocation_nodes(problem, discretization)
    interior = discretization.interior
    if isinstance(interior, int | np.integer):
        inside = node_layouts.interior_nodes(domain, int(interior), discretization.spacing)
    else:
        inside = node_layouts.checked_interior(domain, np.asarray(interior))
    vertices = domain.corners if isinstance(discretization.boundary, int | np.integer) else np.empty((0, 2))
    nodes = np.vstack([collocation.points, vertices, inside])
    spacing = node_layouts.refuse_duplicates(nodes)
    functions = discretization.functions or max(1, collocation.count // OVERSAMPLING)
    if functions > collocation.count:
        raise InputError(f"{functions} functions for {collocation.count} boundary nodes: expected at most one per node")
    sources = np.empty((0, 2))
    wedges: tuple[Wedge, ...] = ()
    clustered = 0
    nearness: Floats | None = None
    if method == "mfs":
        sources = _place_sources(problem, discretization, functions, radius)
    if isinstance(discretization.boundary, int | np.integer) and discretization.corner_sources:
        corners = singular_corners(domain, problem.boundary)
        behind = corner_sources(domain, problem.boundary, corners, discretization.corner_sources)
        sources, clustered = np.concatenate([sources, behind]), len(behind)
        scale = discretization.length_scale or radius
        wedges = tuple(w.scaled(center, scale) for w in corner_wedges(domain, problem.boundary, corners))
        spread = float(domain.edge_lengths.sum()) / collocation.count
        collocation = collocation.joined(corner_nodes(domain, corners, discretization.corner_sources))
        if corners.size:
            gaps = np.linalg.norm(collocation.points[:, None, :] - domain.corners[corners], axis=2).min(axis=1)
            nearness = np.minimum(1.0, gaps / spread)
    return Layout(
        problem=problem,
        discretization=discretization,
        method=method,
        center=center,
        scale=discretization.length_scale or radius,
        radius=radius,
        collocation=collocation,
        check=_check_nodes(problem, collocation),
        nodes=nodes,
        spacing=spacing,
        functions=functions if method == "trefftz" else 0,
        sources=sources,
        clearance=clearance_of_sources(domain, sources, radius),
        nearness=np.ones(collocation.count) if nearness is None else nearness,
        clustered=clustered,
        wedges=wedges if discretization.basis.polynomial_degree >= 0 else (),
    )


def _collocation_nodes(problem: HeatProblem, discretization: Discretization) -> BoundaryNodes:
    boundary = discretization.boundary
    if isinstance(boundary, int | np.integer):
        return node_layouts.boundary_nodes(problem.domain, int(boundary), discretization.spacing)
    fixed = np.array([isinstance(condition, Dirichlet) for condition in problem.boundary])
    collocation = node_layouts.boundary_nodes_at(problem.domain, np.asarray(boundary), fixed)
    missing = set(range(len(problem.boundary))) - set(collocation.edges.tolist())
    if missing:
        raise InputError(f"no boundary node belongs to edge {min(missing)}: its condition would be lost; add some")
    return collocation


def _check_nodes(problem: HeatProblem, collocation: BoundaryNodes) -> BoundaryNodes:
    """Points between the collocation points, where the boundary residual is measured."""
    return node_layouts.boundary_nodes(problem.domain, max(collocation.count + 7, 3 * len(problem.boundary)), "uniform")


def away_from(layout: Layout, vertices: list[int]) -> Layout:
    """The layout without the check points close to vertices where prescribed temperatures jump.

    No smooth field meets both temperatures there, so that a residual so close says nothing about the rest.
    """
    if not vertices:
        return layout
    check, domain = layout.check, layout.problem.domain
    margin = JUMP_MARGIN * float(domain.edge_lengths.sum()) / layout.collocation.count
    gaps = np.linalg.norm(check.points[:, None, :] - domain.corners[vertices], axis=2).min(axis=1)
    kept = gaps > min(margin, 0.25 * float(domain.edge_lengths.min()))
    return replace(layout, check=BoundaryNodes(check.points[kept], check.normals[kept], check.edges[kept]))


def _place_sources(problem: HeatProblem, discretization: Discretization, functions: int, radius: float) -> Floats:
    domain, boundary = problem.domain, discretization.boundary
    if isinstance(boundary, int | np.integer):
        least = 3 * len(problem.boundary)
        base = node_layouts.boundary_nodes(domain, max(functions, least), discretization.spacing)
        points, normals = base.points, base.normals
    else:
        base = _collocation_nodes(problem, discretization)
        chosen = np.linspace(0.0, base.count, functions, endpoint=False).astype(int)
        points, normals = base.points[chosen], base.normals[chosen]
    if discretization.source_factor is not None:
        center = discretization.source_center
        return factor_sources(
            domain, points, discretization.source_factor, None if center is None else np.array(center)
        )
    return offset_sources(domain, points, normals, discretization.source_offset * radius)
