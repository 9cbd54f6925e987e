"""The modified Helmholtz problem (laplacian - lambda^2) u = f with B1 u + B2 du/dn = B3 on the boundary."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import svd

from etc_engine.arrays import Floats
from etc_engine.engines.meshless.discretization import Layout
from etc_engine.engines.meshless.fundamental_solutions import fundamental_solutions
from etc_engine.engines.meshless.nodes import BoundaryNodes
from etc_engine.engines.meshless.particular import SourceInterpolation, particular_gradients, particular_values
from etc_engine.engines.meshless.trefftz import trefftz_functions
from etc_engine.errors import ConvergenceError

Field = NDArray


@dataclass(frozen=True, eq=False)
class BoundaryFit:
    """Truncated singular value decomposition of the row-scaled boundary system.

    Attributes
    ----------
    rank, condition : int, float
        Number of singular values kept, and largest over smallest singular value of the whole system.
    """

    row_scale: Floats
    left: Field
    inverse_values: Floats
    right: Field
    rank: int
    condition: float

    def solve(self, data: Field) -> Field:
        """Least-squares coefficients for boundary data of shape (k,) or (k, columns)."""
        scaled = (data.T / self.row_scale).T
        weights = self.left.conj().T @ scaled
        return np.asarray(self.right.conj().T @ (weights.T * self.inverse_values).T)


@dataclass(frozen=True, eq=False)
class HelmholtzOperator:
    """Particular and homogeneous functions for one lambda, and the fitted boundary system.

    A field is a coefficient vector (alpha, beta, c): radial functions, monomials, then Trefftz functions
    or sources. ``lam`` is lambda in scaled coordinates; ``particular_boundary`` gives B1 u + B2 du/dn of
    the particular functions at the collocation points.
    """

    layout: Layout
    lam: complex
    interpolation: SourceInterpolation
    particular_boundary: Field
    fit: BoundaryFit

    def solve(self, source: Field, data: Field) -> Field:
        """Coefficients of the solution for nodal values of f (scaled: scale^2 f) and boundary data B3."""
        particular = self.interpolation.coefficients(source)
        gap = data - self.particular_boundary @ particular
        return np.concatenate([particular, self.fit.solve(gap)])

    def value_rows(self, points: Floats) -> Field:
        """Rows that give u at scaled positions, shape (k, coefficients)."""
        return np.hstack(_values(self.layout, self.lam, points, self.interpolation))

    def gradient_rows(self, points: Floats) -> tuple[Field, Field]:
        """Rows that give du/dx and du/dy (per metre) at scaled positions."""
        x, y = (np.hstack(parts) for parts in _gradients(self.layout, self.lam, points, self.interpolation))
        return x / self.layout.scale, y / self.layout.scale

    def residual_rows(self, where: BoundaryNodes) -> Field:
        """Rows that give B1 u + B2 du/dn at boundary nodes."""
        return np.hstack(boundary_rows(self.layout, self.lam, where, self.interpolation))


def prepare_operator(layout: Layout, lam: complex, interpolation: SourceInterpolation) -> HelmholtzOperator:
    """Fit the boundary system of a layout for one lambda (scaled).

    Raises
    ------
    ConvergenceError
        If the boundary system holds values that are not finite or no singular value is usable.
    """
    particular, matrix = boundary_rows(layout, lam, layout.collocation, interpolation)
    b1, b2 = layout.boundary_coefficients(layout.collocation.edges)
    # a flux grows like r^(nu - 1) towards a corner: weighted by r it does not outweigh all other rows
    row_scale = np.abs(b1) + np.abs(b2) * (1.0 + abs(lam)) / layout.nearness
    matrix = matrix / row_scale[:, None]
    if not np.isfinite(matrix).all():
        raise ConvergenceError(
            f"the boundary functions overflow at lambda = {lam:.4g} (in units of 1/{layout.scale:g} m): use "
            "longer time steps or fewer functions"
        )
    left, values, right = svd(matrix, full_matrices=False, check_finite=False)
    kept = values > layout.discretization.rank_tolerance * values[0]
    rank = int(kept.sum())
    if rank == 0 or values[0] == 0.0:
        raise ConvergenceError("the boundary system has rank 0: the functions vanish at all boundary nodes")
    condition = float(values[0] / values[-1]) if values[-1] > 0.0 else np.inf
    fit = BoundaryFit(row_scale, left[:, kept], 1.0 / values[kept], right[kept], rank, condition)
    return HelmholtzOperator(layout, lam, interpolation, particular, fit)


def boundary_rows(
    layout: Layout, lam: complex, where: BoundaryNodes, interpolation: SourceInterpolation
) -> tuple[Field, Field]:
    """Rows of B1 u + B2 du/dn for the particular and for the homogeneous functions."""
    b1, b2 = layout.boundary_coefficients(where.edges)
    points = layout.scaled(where.points)
    values = _values(layout, lam, points, interpolation)
    (xp, xh), (yp, yh) = _gradients(layout, lam, points, interpolation)
    nx, ny = where.normals[:, :1], where.normals[:, 1:]
    normal = (nx * xp + ny * yp, nx * xh + ny * yh)
    particular, homogeneous = (b1[:, None] * v + b2[:, None] * d for v, d in zip(values, normal, strict=True))
    return particular, homogeneous


def _reach(layout: Layout) -> float:
    """Largest distance between two points of the body in scaled coordinates."""
    return 2.0 * layout.radius / layout.scale


def _values(layout: Layout, lam: complex, points: Floats, interpolation: SourceInterpolation) -> tuple[Field, Field]:
    particular = particular_values(interpolation, points, lam, _reach(layout))
    return particular, _homogeneous(layout, lam, points)[0]


def _gradients(
    layout: Layout, lam: complex, points: Floats, interpolation: SourceInterpolation
) -> tuple[tuple[Field, Field], tuple[Field, Field]]:
    xp, yp = particular_gradients(interpolation, points, lam, _reach(layout))
    _, xh, yh = _homogeneous(layout, lam, points)
    return (xp, xh), (yp, yh)


def _homogeneous(layout: Layout, lam: complex, points: Floats) -> tuple[Field, Field, Field]:
    """Values and gradients of the Trefftz functions, then of the fundamental solutions."""
    sources = layout.scaled(layout.sources)
    value, x, y = fundamental_solutions(points, sources, layout.clearance / layout.scale, lam)
    if not layout.functions:
        return value, x, y
    stretch = layout.radius / layout.scale  # Trefftz functions are scaled to one on the domain radius
    smooth, along_x, along_y = trefftz_functions(points / stretch, lam * stretch, layout.functions)
    return np.hstack([smooth, value]), np.hstack([along_x / stretch, x]), np.hstack([along_y / stretch, y])
