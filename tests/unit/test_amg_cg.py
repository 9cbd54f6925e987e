from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_matrix, diags_array, eye_array, kron
from scipy.sparse.linalg import spsolve

from etc_engine.errors import ConvergenceError
from etc_engine.solvers import Limits, build_preconditioner, solve_energy
from etc_engine.solvers.amg_cg import radau_factor


def grid_laplacian(n: int, seed: int) -> csr_matrix:
    """Five-point Laplacian between two fixed sides, with random bond conductances."""
    rng = np.random.default_rng(seed)
    line = diags_array([1.0, -1.0], offsets=[0, -1], shape=(n + 1, n))
    across = kron(line, eye_array(n))
    along = kron(eye_array(n), diags_array([1.0, -1.0], offsets=[0, 1], shape=(n - 1, n)))
    matrix = 0.0
    for difference in (across, along):
        bonds = diags_array(rng.uniform(0.2, 2.0, difference.shape[0]))
        matrix = matrix + difference.T @ bonds @ difference
    return csr_matrix(matrix)


@pytest.mark.parametrize("exact_level", [1_000_000, 100])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-8, 1e-11])
def test_energy_error_is_estimated_from_above_and_below_tolerance(exact_level, tolerance):
    matrix = grid_laplacian(60, 77)
    rhs = np.random.default_rng(78).normal(size=matrix.shape[0])
    exact = spsolve(matrix.tocsc(), rhs)
    energy = 3.0 * float(rhs @ exact)  # any reference above b.u makes a positive energy
    u, report = solve_energy(
        matrix,
        rhs,
        energy,
        preconditioner=build_preconditioner(matrix, exact_level),
        tolerance=tolerance,
        limits=Limits(balance_tolerance=1.0),
    )
    error = float((u - exact) @ (matrix @ (u - exact))) / (energy - float(rhs @ exact))
    assert error <= 1.01 * report.relative_energy_error + 1e-15
    assert report.relative_energy_error <= tolerance
    if exact_level == 100:
        assert report.levels > 2
        assert 30 * error > report.relative_energy_error  # the estimate is not wildly pessimistic


def test_radau_factor_bounds_the_error_at_every_step():
    """Plain CG on a small system: g_k rho_k stays above the true error and g_0 is 1/mu."""
    matrix = grid_laplacian(12, 79).toarray()
    rhs = np.ones(matrix.shape[0])
    exact = np.linalg.solve(matrix, rhs)
    u, r = np.zeros_like(rhs), rhs.copy()
    p, rho = r.copy(), float(rhs @ rhs)
    steps, ratios = [], []
    for _ in range(25):
        q = matrix @ p
        steps.append(rho / float(p @ q))
        u, r = u + steps[-1] * p, r - steps[-1] * q
        ratios.append(float(r @ r) / rho)
        rho *= ratios[-1]
        p = r + ratios[-1] * p
        error = float((u - exact) @ matrix @ (u - exact))
        if len(steps) >= 6:  # before that the smallest Ritz value is still more than twice the eigenvalue
            assert error <= radau_factor(steps, ratios) * rho


def test_multigrid_is_repeatable_to_the_bit():
    matrix = grid_laplacian(50, 80)
    rhs = np.linspace(-1, 2, matrix.shape[0])
    solutions = []
    for seed in (5, 6):
        np.random.seed(seed)  # noqa: NPY002 - the global state is what must not matter
        solutions.append(solve_energy(matrix, rhs, 1e6, preconditioner=build_preconditioner(matrix, 100))[0])
    np.testing.assert_array_equal(*solutions)


def test_starting_guess_saves_iterations_and_keeps_the_answer():
    matrix = grid_laplacian(50, 81)
    rhs = np.ones(matrix.shape[0])
    preconditioner = build_preconditioner(matrix, 100)
    energy = 2.0 * float(rhs @ spsolve(matrix.tocsc(), rhs))
    u, cold = solve_energy(matrix, rhs, energy, preconditioner=preconditioner)
    v, warm = solve_energy(matrix, rhs, energy, preconditioner=preconditioner, initial=u * (1 + 1e-6))
    assert warm.iterations < cold.iterations
    np.testing.assert_allclose(u, v, rtol=1e-4)


def test_running_out_of_iterations_raises_with_the_history():
    matrix = grid_laplacian(50, 82)
    with pytest.raises(ConvergenceError, match="stopped after 2 iterations") as caught:
        solve_energy(
            matrix,
            np.ones(matrix.shape[0]),
            1e5,
            preconditioner=build_preconditioner(matrix, 100),
            tolerance=1e-14,
            limits=Limits(max_iterations=2),
        )
    assert len(caught.value.residuals) == 3


def test_indefinite_matrix_raises():
    matrix = csr_matrix(np.diag([1.0, -1.0, 2.0]))
    with pytest.raises(ConvergenceError, match="not positive definite"):
        solve_energy(matrix, np.array([1.0, 5.0, 1.0]), 10.0)


def test_heat_balances_to_round_off_and_the_correction_lowers_the_error():
    matrix = grid_laplacian(60, 83)
    rhs = np.random.default_rng(84).normal(size=matrix.shape[0])
    exact = spsolve(matrix.tocsc(), rhs)
    energy = 2.0 * float(rhs @ exact)
    u, report = solve_energy(
        matrix,
        rhs,
        energy,
        preconditioner=build_preconditioner(matrix, 100),
        tolerance=1e-6,
        limits=Limits(balance_tolerance=1.0),
    )
    assert abs((rhs - matrix @ u).sum()) < 1e-11 * energy
    assert report.imbalance < 1e-11
    error = float((u - exact) @ (matrix @ (u - exact)))
    for shift in (-1e-3, 1e-3):  # the best of all uniform shifts
        other = u - exact + shift
        assert float(other @ (matrix @ other)) > error
