"""The matrix r C + K of an implicit time step: solved by preconditioned conjugate gradients, heat balanced exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, diags_array
from scipy.sparse.csgraph import connected_components

from etc_engine.arrays import Floats
from etc_engine.errors import ConvergenceError, InputError
from etc_engine.solvers.amg_cg import EXACT_LEVEL, Preconditioner, build_preconditioner
from etc_engine.solvers.summation import dot

MOST_ITERATIONS = 500


@dataclass(frozen=True, eq=False)
class StepMatrix:
    """Symmetric positive definite matrix A = r C + K, ready to be solved at many steps.

    Parameters
    ----------
    matrix : csr_matrix, shape (n, n) [W/K]
    rate : float [1/s]
        The r that the matrix holds.
    preconditioner : Preconditioner
        Of this matrix or of one of another rate, which is as good up to the ratio of the two.
    exact : bool
        Whether the preconditioner is the inverse of this very matrix.
    components : ndarray of int, shape (n,)
        Connected component of each node.
    row_sums : ndarray, shape (components,) [W/K]
        1 . A 1 of each component.
    tolerance : float
        Largest error of the temperatures a solve leaves, relative to their largest magnitude.
    """

    matrix: csr_matrix
    rate: float
    preconditioner: Preconditioner
    exact: bool
    components: NDArray[np.int32]
    row_sums: Floats
    tolerance: float

    def solve(self, rhs: Floats, guess: Floats) -> tuple[Floats, int]:
        """Solution of A x = b from a starting guess, and the iterations it took.

        The residual of the answer sums to zero over every component, to round-off: what a component stores is what
        flows into it, whatever the tolerance. That is a Galerkin correction, which can only lower the energy error.
        """
        if self.exact:
            x, iterations = guess + self.preconditioner.apply(rhs - self.matrix @ guess), 1
        else:
            x, iterations = self._iterate(rhs, guess)
        residual = np.bincount(self.components, rhs - self.matrix @ x, minlength=self.row_sums.size)
        return x + (residual / self.row_sums)[self.components], iterations

    def _iterate(self, rhs: Floats, guess: Floats) -> tuple[Floats, int]:
        x = guess.copy()
        r = rhs - self.matrix @ x
        z = self.preconditioner.apply(r)
        p = z.copy()
        rho = dot(r, z)
        history = [_largest(z)]
        for iteration in range(MOST_ITERATIONS):
            if history[-1] <= self.tolerance * _largest(x):
                return x, iteration
            q = self.matrix @ p
            curvature = dot(p, q)
            if not (rho > 0.0 and curvature > 0.0):
                break
            x += (rho / curvature) * p
            r -= (rho / curvature) * q
            z = self.preconditioner.apply(r)
            history.append(_largest(z))
            rho_next = dot(r, z)
            p *= rho_next / rho
            p += z
            rho = rho_next
        raise ConvergenceError(
            f"conjugate gradients left a temperature error of {history[-1]:.2e} K after {len(history) - 1} iterations "
            f"of an implicit step (wanted {self.tolerance:.1e} relative); ask for a larger solver tolerance",
            history,
        )


def step_matrix(
    conductance: csr_matrix,
    capacity: Floats,
    rate: float,
    tolerance: float,
    like: StepMatrix | None = None,
    exact_level: int = EXACT_LEVEL,
) -> StepMatrix:
    """A = r C + K with a preconditioner of its own, or with that of ``like``, which has another rate.

    Raises
    ------
    InputError
        If some component of the network has a singular matrix: it stores nothing and is joined to no temperature.
    """
    matrix = csr_matrix(conductance + diags_array(rate * capacity))
    matrix.sort_indices()
    components = connected_components(conductance, directed=False)[1] if like is None else like.components
    row_sums = np.asarray(np.bincount(components, np.asarray(matrix.sum(axis=1)).ravel()), dtype=np.float64)
    # rows of K that sum to zero do so to round-off
    diagonals = np.bincount(components, matrix.diagonal(), minlength=row_sums.size)
    singular = row_sums <= 1e-13 * diagonals
    if singular.any():
        nodes = np.flatnonzero(singular[components])
        raise InputError(
            f"{nodes.size} node(s), the first of them {nodes[0]}, store no heat and are joined to nothing that has a "
            f"temperature: give them a heat capacity or leave them out"
        )
    preconditioner = build_preconditioner(matrix, exact_level) if like is None else like.preconditioner
    exact = like is None and preconditioner.levels == 1
    return StepMatrix(matrix, rate, preconditioner, exact, components, row_sums, tolerance)


def _largest(values: Floats) -> float:
    return float(np.abs(values).max(initial=0.0))
