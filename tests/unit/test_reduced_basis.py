from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import eigh
from scipy.sparse import csr_matrix

from etc_engine.solvers import Member, TrialSpace, solve_family
from etc_engine.solvers.reduced_basis import farthest_first

SIZE = 30


def network(conductances):
    """Laplace matrix of a ring of SIZE + 2 nodes with chords."""
    n = SIZE + 2
    k = np.zeros((n, n))
    ends = [(i, (i + 1) % n) for i in range(n)] + [(i, (i + 7) % n) for i in range(n)]
    for (i, j), c in zip(ends, conductances, strict=True):
        k[np.ix_([i, j], [i, j])] += c * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return k


class Family:
    """Conductances c^p between two held nodes and the free ones: every member's energies are known directly."""

    def __init__(self, seed, parameters):
        rng = np.random.default_rng(seed)
        self.base = rng.uniform(0.3, 3.0, 2 * (SIZE + 2))
        self.parameters = parameters
        lift = np.zeros((SIZE + 2, 2))
        lift[0, 0] = lift[1, 1] = 1.0
        self.space = TrialSpace(lift, np.arange(-2, SIZE).clip(-1), SIZE, np.ones(SIZE))

    def whole(self, index):
        return network(self.base ** self.parameters[index])

    def energies(self, index):
        k = self.whole(index)
        return k[:2, :2] - k[:2, 2:] @ np.linalg.solve(k[2:, 2:], k[2:, :2])

    def member(self, index):
        k = self.whole(index)
        free = k[2:, 2:]

        def floor(other):
            return float(eigh(free, other.matrix().toarray(), eigvals_only=True)[0])

        return Member(lambda t: k @ t, lambda: csr_matrix(free), floor)

    def solve(self, tolerance=1e-8):
        return dict(solve_family(self.space, self.parameters, self.member, tolerance))


@settings(deadline=None, max_examples=15)
@given(st.integers(100, 10_000), st.floats(0.3, 3.0), st.sampled_from([1e-4, 1e-6, 1e-8]))
def test_energies_are_upper_bounds_within_a_proven_error(seed, spread, tolerance):
    family = Family(seed, np.linspace(1.0, 1.0 + spread, 9))
    for index, solution in family.solve(tolerance).items():
        exact = np.diag(family.energies(index))
        excess = np.diag(solution.energies) / exact - 1.0
        assert (excess > -1e-12).all()
        assert (excess <= tolerance).all()
        if solution.snapshots:
            assert solution.certified
            assert excess.max() <= solution.relative_energy_error + 1e-12


def test_a_single_snapshot_far_away_is_rejected():
    family = Family(211, [1.0, 9.0])
    strict, loose = family.solve(), family.solve(tolerance=1e9)
    assert [strict[i].snapshots for i in (0, 1)] == [0, 0]
    assert strict[1].energies == pytest.approx(family.energies(1), rel=1e-8)
    assert loose[1].snapshots == 1
    error = (np.diag(loose[1].energies) / np.diag(family.energies(1)) - 1.0).max()
    assert 1e-3 < error <= loose[1].relative_energy_error  # what the estimate has to keep out


def test_what_leaves_enters():
    family = Family(212, np.linspace(1.0, 2.0, 7))
    for index, solution in family.solve(tolerance=1e-3).items():
        t = np.vstack([np.eye(2), solution.u])
        assert np.abs((family.whole(index) @ t)[:2].sum(axis=0)).max() < 1e-5
        if solution.snapshots:  # the conserved vector is in the basis
            assert np.abs((family.whole(index) @ t)[:2].sum(axis=0)).max() < 1e-12


def test_a_member_that_does_not_exist_is_passed_over():
    family = Family(213, [1.0, 1.5, 2.0, 2.5, 3.0])
    found = dict(solve_family(family.space, family.parameters, lambda i: None if i in (2, 4) else family.member(i)))
    assert [i for i in sorted(found) if found[i] is None] == [2, 4]
    for index in (0, 1, 3):
        np.testing.assert_allclose(found[index].energies, family.energies(index), rtol=1e-7, atol=1e-8)


def test_every_parameter_is_visited_once():
    order = farthest_first([0.1, 0.1, 0.4, 3.0, 1.2, 2.9, 0.1])
    assert sorted(order) == list(range(7))
    assert farthest_first([2.0]) == [0]
