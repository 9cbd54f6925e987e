"""Dual reciprocity: a source is interpolated by radial functions whose particular solutions are known."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgWarning, lu_factor, lu_solve
from scipy.linalg.lapack import dgecon, zgecon
from scipy.spatial.distance import cdist

from etc_engine.arrays import Floats
from etc_engine.engines.meshless.polynomials import exponents, monomials, particular_monomials
from etc_engine.engines.meshless.radial_basis import RadialBasis
from etc_engine.engines.meshless.wedges import Wedge, wedge_harmonics
from etc_engine.errors import InputError

Field = NDArray


@dataclass(frozen=True, eq=False)
class SourceInterpolation:
    """Factorised interpolation f(x) = sum_i alpha_i phi(|x - x_i|) + sum_l beta_l b_l(x) at nodes x_i.

    The b_l are monomials and the singular harmonics of the wedges. The moment conditions sum_i alpha_i b_l(x_i) = 0
    close the system; nodes are in scaled coordinates.

    Attributes
    ----------
    condition : float
        Estimated condition number of the interpolation matrix (1-norm).
    """

    basis: RadialBasis
    nodes: Floats
    lam: complex
    factors: tuple[Field, NDArray[np.int32]]
    condition: float
    wedges: tuple[Wedge, ...] = ()

    @property
    def size(self) -> int:
        """Number of coefficients: nodes, monomials and singular harmonics."""
        singular = sum(wedge.exponents.size for wedge in self.wedges)
        return len(self.nodes) + len(exponents(self.basis.polynomial_degree)) + singular

    def coefficients(self, values: Field) -> Field:
        """Coefficients (alpha, beta) for nodal values of shape (n,) or (n, k)."""
        right = np.zeros((self.size, *values.shape[1:]), dtype=values.dtype)
        right[: len(self.nodes)] = values
        return np.asarray(lu_solve(self.factors, right, check_finite=False))

    def from_nodal_values(self, rows: Field) -> Field:
        """Rows that act on coefficients, turned into rows that act on nodal values: shape (k, n)."""
        transposed = lu_solve(self.factors, rows.T, trans=1, check_finite=False)
        return np.asarray(transposed[: len(self.nodes)].T)

    def gradient_rows(self, points: Floats) -> tuple[Field, Field]:
        """Rows of the interpolant's derivatives along x and y, each (k, size)."""
        slope = self.basis.slope_over_r(cdist(points, self.nodes), self.lam)
        _, along_x, along_y = _joined(monomials(points, self.basis.polynomial_degree), points, self.wedges, 1.0)
        x, y = (points[:, None, axis] - self.nodes[:, axis] for axis in (0, 1))
        return np.hstack([slope * x, along_x]), np.hstack([slope * y, along_y])


def interpolate_source(
    basis: RadialBasis, nodes: Floats, lam: complex = 0.0, wedges: tuple[Wedge, ...] = ()
) -> SourceInterpolation:
    """Factorise the interpolation matrix; lambda matters for the reverse basis only.

    Raises
    ------
    InputError
        If the nodes do not determine the polynomials (too few, or all on one curve of their degree), or the
        matrix is singular.
    """
    n = len(nodes)
    polynomial = monomials(nodes, basis.polynomial_degree)[0]
    terms = polynomial.shape[1]
    if terms and (n < terms or np.linalg.matrix_rank(polynomial) < terms):
        raise InputError(
            f"{n} nodes do not determine the {terms} polynomial terms of degree {basis.polynomial_degree}: "
            "add nodes off the line or curve they lie on, or lower the degree"
        )
    polynomial = np.hstack([polynomial, wedge_harmonics(nodes, wedges)[0]])
    terms = polynomial.shape[1]
    phi = basis.value(cdist(nodes, nodes), lam)
    matrix = np.zeros((n + terms, n + terms), dtype=phi.dtype)
    matrix[:n, :n] = phi
    matrix[:n, n:], matrix[n:, :n] = polynomial, polynomial.T
    norm = np.abs(matrix).sum(axis=0).max()
    with warnings.catch_warnings():  # an exact zero pivot is answered by the condition number below
        warnings.simplefilter("ignore", LinAlgWarning)
        factors = lu_factor(matrix, overwrite_a=True, check_finite=False)
    estimate = zgecon if np.iscomplexobj(matrix) else dgecon
    reciprocal, _ = estimate(factors[0], norm)
    if reciprocal == 0.0 or not np.isfinite(reciprocal):
        raise InputError(
            f"the interpolation matrix of {n} nodes is singular: spread the nodes or lower the spline's order"
        )
    return SourceInterpolation(basis, nodes, lam, factors, float(1.0 / reciprocal), wedges)


def particular_values(source: SourceInterpolation, points: Floats, lam: complex, reach: float) -> Field:
    """Values of the particular solutions (psi, polynomials, singular harmonics) at points, shape (k, size)."""
    basis, nodes = source.basis, source.nodes
    psi = basis.particular(cdist(points, nodes), lam, reach)
    tail = _joined(particular_monomials(points, lam, basis.polynomial_degree), points, source.wedges, -1.0 / lam**2)
    return np.hstack([psi, tail[0]])


def particular_gradients(
    source: SourceInterpolation, points: Floats, lam: complex, reach: float
) -> tuple[Field, Field]:
    """Derivatives of the particular solutions along x and y, each (k, size)."""
    basis, nodes = source.basis, source.nodes
    slope = basis.particular_slope_over_r(cdist(points, nodes), lam, reach)
    _, along_x, along_y = _joined(
        particular_monomials(points, lam, basis.polynomial_degree), points, source.wedges, -1.0 / lam**2
    )
    x, y = (points[:, None, axis] - nodes[:, axis] for axis in (0, 1))
    return np.hstack([slope * x, along_x]), np.hstack([slope * y, along_y])


def _joined(
    smooth: tuple[Field, Field, Field], points: Floats, wedges: tuple[Wedge, ...], factor: complex
) -> tuple[Field, Field, Field]:
    """Tables of the monomials followed by those of the singular harmonics times a factor."""
    singular = wedge_harmonics(points, wedges)
    value, along_x, along_y = (np.hstack([a, factor * b]) for a, b in zip(smooth, singular, strict=True))
    return value, along_x, along_y
