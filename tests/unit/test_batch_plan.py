"""Seeds, order and targets of the work units."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from etc_engine.sweep.plan import (
    GROWTH_LIMIT,
    LEAST,
    Unit,
    density_bits,
    needed_realizations,
    stream_fingerprint,
    unit_rng,
    units_to_run,
)
from etc_engine.sweep.statistics import half_width

densities = st.floats(1e-3, 2.0)


@settings(max_examples=50, deadline=None)
@given(densities)
def test_bits_give_the_density_back(density):
    assert struct.unpack(">d", struct.pack(">II", *density_bits(density))) == (density,)


def test_a_stream_is_keyed_by_seed_density_and_realization():
    units = [Unit(d, r) for d in (None, 0.7, np.nextafter(0.7, 1.0)) for r in range(3)]
    seen = {stream_fingerprint(seed, unit) for seed in (20261, 20262, 2**62) for unit in units}
    assert len(seen) == 27
    again = unit_rng(20261, Unit(0.7, 2)).random(4)
    assert (again == unit_rng(20261, Unit(0.7, 2)).random(4)).all()


def test_the_stream_is_the_documented_one():
    """What the comment of `random_stream` says, by hand."""
    high, low = struct.unpack(">II", struct.pack(">d", 0.7))
    sequence = np.random.SeedSequence(20261, spawn_key=(high, low, 5))
    expected = np.random.Generator(np.random.PCG64(sequence)).random(8)
    assert (unit_rng(20261, Unit(0.7, 5)).random(8) == expected).all()


def test_streams_of_neighbours_are_not_correlated():
    draws = np.array([unit_rng(77, Unit(0.7, r)).standard_normal(400) for r in range(40)])
    correlation = np.corrcoef(draws)[np.triu_indices(40, 1)]
    # 780 sample correlations of 400 independent pairs: sd 1/sqrt(400); 4.5 sd is passed once in 190 such tests
    assert np.abs(correlation).max() < 4.5 / math.sqrt(400)


def test_largest_units_come_first_and_finished_ones_not_at_all():
    none = np.empty((0, 2), np.int64)
    finished = np.array([[1, 1], [1, 7]])  # one beyond the target, of a former run
    assert units_to_run((0.6, 0.8), (2, 3), finished).tolist() == [[1, 0], [1, 2], [0, 0], [0, 1]]
    assert units_to_run((None,), (2,), none).tolist() == [[0, 0], [0, 1]]
    assert units_to_run((0.6, 0.8), (2, 2), np.argwhere(np.ones((2, 2)))).size == 0


samples = st.lists(st.floats(0.1, 10.0), min_size=2, max_size=20)


@settings(max_examples=100, deadline=None)
@given(samples, st.floats(0.001, 0.2), st.integers(20, 200))
def test_a_cell_is_settled_exactly_when_its_interval_is_narrow_enough(values, relative, cap):
    n = len(values)
    target = needed_realizations(values, n, relative, 0.95, cap)
    settled = half_width(np.array(values), 0.95) <= relative * np.mean(values)
    if n >= cap or (settled and n >= LEAST):
        assert target == n
    elif settled:
        assert n < target <= LEAST
    else:
        assert n < target <= min(cap, GROWTH_LIMIT * n)


@pytest.mark.parametrize(
    ("values", "realized", "target"),
    [
        ([], 5, 5),
        ([1.0], 5, 10),
        ([0.0, 0.0], 2, 8),
        ([0.0, 1.0], 2, 8),
        ([1.0, 1.0], 2, 6),
        ([1.0] * 6, 6, 6),
        ([0.0] * 20, 20, 20),
    ],
)
def test_cells_with_little_to_go_on(values, realized, target):
    assert needed_realizations(values, realized, 0.01, 0.95, 100) == target
