"""The hierarchy and the cycle of the multigrid preconditioner against the matrices that define them."""

import numpy as np
import pytest
from scipy.sparse import block_diag, csr_matrix, diags_array, identity, kron

from etc_engine.errors import ConvergenceError
from etc_engine.solvers import aggregation
from etc_engine.solvers.aggregation import aggregation_hierarchy
from etc_engine.solvers.amg_cg import EXACT_LEVEL, build_preconditioner, solve_energy, solve_loads


def grid(edge: int, weak: float = 1.0) -> csr_matrix:
    """Five-point matrix of a square with walls, with weaker entries in one direction."""
    line = diags_array([-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(edge, edge))
    matrix = csr_matrix(kron(line, identity(edge)) + weak * kron(identity(edge), line))
    matrix.sort_indices()
    return matrix


def csr(arrays, shape) -> csr_matrix:
    indptr, indices, data = arrays
    return csr_matrix((data, indices, indptr), shape=shape)


@pytest.mark.parametrize("weak", [1.0, 0.01])
def test_hierarchy_follows_its_formulas(weak):
    matrix = grid(80, weak)
    cycle = aggregation_hierarchy(matrix)
    assert len(cycle) > 2
    current, near_kernel = matrix, np.ones(matrix.shape[0])
    for number, level in enumerate(cycle.levels):
        fine, coarse = current.shape[0], level.coarse.size
        assert abs(csr(level.matrix, current.shape) - current).max() < 1e-14 * abs(current).max()
        dense = number > 0 and current.nnz > aggregation.DENSE * fine
        aggregates, count = aggregation._aggregates(current, aggregation.WEAK if dense else aggregation.STRENGTH)
        assert count == coarse
        inside = np.flatnonzero(aggregates >= 0)
        tentative = csr_matrix((near_kernel[inside], (inside, aggregates[inside])), shape=(fine, count))
        norms = np.sqrt(np.asarray(tentative.power(2).sum(axis=0)).ravel())
        tentative = tentative @ diags_array(1.0 / norms)
        rows = np.asarray(abs(current).sum(axis=1)).ravel()
        smoothed = tentative - diags_array(aggregation.DAMPING / rows) @ current @ tentative
        prolongator = csr(level.prolongator, smoothed.shape)
        assert abs(prolongator - smoothed).max() < 1e-14, number
        current, near_kernel = csr_matrix(prolongator.T @ current @ prolongator), norms
        current.sort_indices()


def test_cycle_is_two_sweeps_around_the_exact_coarse_correction(monkeypatch):
    monkeypatch.setattr(aggregation, "COARSEST", 300)
    matrix = grid(30)
    cycle = aggregation_hierarchy(matrix)
    (level,) = cycle.levels
    dense, size = matrix.toarray(), matrix.shape[0]
    prolongator = csr(level.prolongator, (size, level.coarse.size)).toarray()
    before, after = np.linalg.inv(np.tril(dense)), np.linalg.inv(np.triu(dense))
    correction = prolongator @ np.linalg.inv(prolongator.T @ dense @ prolongator) @ prolongator.T
    one = np.eye(size)
    error = (one - after @ dense) @ (one - correction @ dense) @ (one - before @ dense)
    inverse = (one - error) @ np.linalg.inv(dense)
    applied = np.column_stack([cycle.apply(column) for column in one])
    np.testing.assert_allclose(applied, inverse, atol=1e-13)
    np.testing.assert_allclose(applied, applied.T, atol=1e-13)
    assert np.linalg.eigvalsh(applied).min() > 0.0


def test_applying_leaves_the_residual_and_earlier_corrections_alone():
    cycle = aggregation_hierarchy(grid(40))
    first = np.random.default_rng(5).normal(size=1600)
    kept = first.copy()
    correction = cycle.apply(first)
    found = correction.copy()
    cycle.apply(-2.0 * first)
    np.testing.assert_array_equal(first, kept)
    np.testing.assert_array_equal(correction, found)


def test_long_indices_and_columns_out_of_order_give_the_same_bits():
    matrix = grid(50)
    load = np.random.default_rng(3).normal(size=2500)
    expected = aggregation_hierarchy(matrix).apply(load)
    long = matrix.copy()
    long.indices, long.indptr = long.indices.astype(np.int64), long.indptr.astype(np.int64)
    np.testing.assert_array_equal(aggregation_hierarchy(long).apply(load), expected)
    turned = csr_matrix(matrix.shape)
    turned.indptr = matrix.indptr.copy()
    backwards = np.concatenate(
        [np.arange(a, b)[::-1] for a, b in zip(matrix.indptr[:-1], matrix.indptr[1:], strict=True)]
    )
    turned.indices, turned.data = matrix.indices[backwards], matrix.data[backwards]
    turned.has_sorted_indices = False
    np.testing.assert_array_equal(aggregation_hierarchy(turned).apply(load), expected)


def test_unknowns_that_join_no_aggregate_and_matrices_without_aggregates():
    alone = csr_matrix(diags_array(np.arange(1.0, 701.0)))
    mixed = csr_matrix(block_diag((grid(40), alone, grid(3))))
    load = np.random.default_rng(4).normal(size=mixed.shape[0])
    for matrix, b in ((mixed, load), (alone, load[:700])):
        u, report = solve_energy(matrix, b, 1e3, preconditioner=build_preconditioner(matrix, 0), tolerance=1e-12)
        np.testing.assert_allclose(matrix @ u, b, atol=2e-5)
        assert report.relative_energy_error <= 1e-12


def test_a_matrix_that_is_not_positive_definite_is_reported():
    matrix = grid(40).copy()
    matrix[10, 10] = 0.0
    with pytest.raises(ConvergenceError, match="not positive definite"):
        solve_energy(matrix, np.ones(1600), 1e3, preconditioner=build_preconditioner(matrix, 0))


def test_a_matrix_on_which_multigrid_stalls_is_factorised():
    """A square of 160 x 160 conductors, each with a conductivity of its own between 1e-6 and 1e6."""
    edge = 160
    conductance = 10.0 ** np.random.default_rng(8).uniform(-6.0, 6.0, edge * edge)
    number = np.arange(edge * edge).reshape(edge, edge)
    pairs = np.vstack(
        [
            np.column_stack((number[:, :-1].ravel(), number[:, 1:].ravel())),
            np.column_stack((number[:-1].ravel(), number[1:].ravel())),
        ]
    )
    series = 1.0 / (1.0 / conductance[pairs[:, 0]] + 1.0 / conductance[pairs[:, 1]])
    incidence = csr_matrix(
        (np.tile([1.0, -1.0], len(pairs)), (np.repeat(np.arange(len(pairs)), 2), pairs.ravel())),
        shape=(len(pairs), edge * edge),
    )
    held = np.zeros(edge * edge)
    held[:edge] = held[-edge:] = conductance[:edge]
    matrix = csr_matrix(incidence.T @ diags_array(series) @ incidence + diags_array(held))
    matrix.sort_indices()
    load = np.where(np.arange(edge * edge) < edge, held, 0.0)[:, None]
    lift = np.array([held[:edge].sum()])
    assert matrix.shape[0] > EXACT_LEVEL
    with pytest.raises(ConvergenceError):
        solve_loads(matrix, load, lift, last_resort=EXACT_LEVEL)
    u, (report,) = solve_loads(matrix, load, lift)
    assert report.levels == 1
    flows = held * (np.where(np.arange(edge * edge) < edge, 1.0, 0.0) - u[:, 0])
    assert flows[:edge].sum() == pytest.approx(-flows[-edge:].sum(), rel=1e-6)
    assert -1e-9 <= u.min() <= u.max() <= 1.0 + 1e-9
