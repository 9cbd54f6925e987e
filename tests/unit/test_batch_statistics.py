"""Statistics over realizations against printed tables and exact cases."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from etc_engine.sweep.statistics import interval, student_t, summarize


@pytest.mark.parametrize(
    ("confidence", "count", "quantile"),
    [
        # NIST/SEMATECH e-Handbook of Statistical Methods, section 1.3.6.7.2, critical values of Student's t,
        # doi:10.18434/M32189; rows nu = 1, 4, 9, 30, 100, columns 0.95, 0.975, 0.995
        (0.90, 2, 6.314),
        (0.95, 2, 12.706),
        (0.95, 5, 2.776),
        (0.99, 5, 4.604),
        (0.90, 10, 1.833),
        (0.95, 10, 2.262),
        (0.95, 31, 2.042),
        (0.99, 101, 2.626),
    ],
)
def test_student_quantiles_of_the_table(confidence, count, quantile):
    assert student_t(confidence, count) == pytest.approx(quantile, abs=5e-4)


def test_nothing_to_say_is_nan():
    none = summarize(np.empty((0, 2)), 0.95)
    assert none.count == 0
    assert np.isnan(none.mean).all()
    one = summarize(np.array([[3.0, np.nan]]), 0.95)
    assert one.mean[0] == 3.0
    assert np.isnan(one.mean[1])
    assert np.isnan([one.std, one.sem, one.ci_low, one.ci_high]).all()


@settings(max_examples=50, deadline=None)
@given(arrays(np.float64, st.tuples(st.integers(2, 12), st.just(3)), elements=st.floats(-5.0, 5.0)))
def test_shift_and_scale(samples):
    base, moved = summarize(samples, 0.9), summarize(4.0 * samples + 1.0, 0.9)
    assert moved.mean == pytest.approx(4.0 * base.mean + 1.0, abs=1e-12)
    assert moved.std == pytest.approx(4.0 * base.std, abs=1e-12)
    assert moved.ci_high - moved.mean == pytest.approx(4.0 * (base.ci_high - base.mean), abs=1e-12)
    assert base.mean - base.ci_low == pytest.approx(base.ci_high - base.mean, abs=1e-12)


@pytest.mark.parametrize("count", [3, 6, 20])
def test_the_interval_covers_as_often_as_it_says(count):
    """20 000 normal samples: the coverage of a 90 % interval has a standard error of 0.2 %."""
    rng = np.random.Generator(np.random.PCG64(314159))
    summary = summarize(rng.normal(5.0, 2.0, (count, 20000)), 0.9)
    covered = np.mean((summary.ci_low <= 5.0) & (summary.ci_high >= 5.0))
    assert covered == pytest.approx(0.9, abs=0.01)


def test_an_interval_is_shown_in_one_short_line():
    shown = repr(interval(np.array([0.0, 1.0, 2.0, 3.0])))
    assert shown.startswith("Interval(1.5 [")
    assert "percolating 0.75" in shown
    assert len(shown) < 80
