"""Simulated coverage of the intervals of a mean conductivity near percolation, for fixed and for adaptive sweeps.

Samples are normal with a spread of 10 % where they percolate, with probability p. The standard error of a coverage of
0.95 over 4000 runs is 0.0034, over 1000 runs 0.007.
"""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.errors import InputError
from etc_engine.sweep.plan import needed_realizations
from etc_engine.sweep.statistics import Interval, interval, wilson

LEVEL, SPREAD = 0.95, 0.1


def draw(rng: np.random.Generator, count: int, p: float) -> np.ndarray:
    return (1.0 + SPREAD * rng.standard_normal(count)) * (rng.random(count) < p)


def adaptive_run(rng: np.random.Generator, start: int, relative: float, p: float, cap: int) -> tuple[np.ndarray, int]:
    samples, n = draw(rng, cap, p), start
    while (target := needed_realizations(samples[:n], n, relative, LEVEL, cap)) > n:
        n = target
    return samples[:n], n


def coverage(found: list[Interval], p: float) -> tuple[float, float, float]:
    """Of the fraction, of the percolating mean, and of the mean in the runs that saw a zero."""
    seen = [f for f in found if f.percolating_fraction < 1.0]
    return (
        float(np.mean([f.fraction_low <= p <= f.fraction_high for f in found])),
        float(np.mean([f.percolating_low <= 1.0 <= f.percolating_high for f in found])),
        float(np.mean([f.low <= p <= f.high for f in seen])),
    )


@pytest.mark.parametrize("count", [20, 50])
@pytest.mark.parametrize("p", [0.5, 0.8, 0.9, 0.95])
def test_intervals_of_a_fixed_number_cover(count, p):
    rng = np.random.Generator(np.random.PCG64([271828, count, round(100 * p)]))
    assert min(coverage([interval(draw(rng, count, p), LEVEL) for _ in range(2000)], p)) >= 0.93


@pytest.mark.parametrize(("start", "relative", "cap"), [(5, 0.05, 400), (20, 0.05, 200)])
@pytest.mark.parametrize("p", [0.5, 0.8, 0.9, 0.95])
def test_intervals_of_an_adaptive_sweep_cover_and_its_mean_is_not_biased(start, relative, cap, p):
    rng = np.random.Generator(np.random.PCG64([314159, start, round(100 * p)]))
    runs = [adaptive_run(rng, start, relative, p, cap)[0] for _ in range(1000)]
    seen = [samples for samples in runs if (samples == 0.0).any()]
    found = [interval(samples, LEVEL) for samples in seen]
    assert np.mean([f.low <= p <= f.high for f in found]) >= 0.93
    assert np.mean([f.percolating_low <= 1.0 <= f.percolating_high for f in found]) >= 0.93
    error = np.std([f.mean for f in found]) / np.sqrt(len(found))
    assert abs(np.mean([f.mean for f in found]) / p - 1.0) < 0.005 + 2.0 * error / p


@pytest.mark.parametrize(("start", "least"), [(5, 0.93), (2, 0.92)])
@pytest.mark.parametrize("relative", [0.03, 0.05, 0.08])
def test_cells_that_always_percolate_are_covered_by_an_adaptive_sweep(start, least, relative):
    rng = np.random.Generator(np.random.PCG64([161803, start, round(100 * relative)]))
    found = [interval(adaptive_run(rng, start, relative, 1.0, 400)[0], LEVEL) for _ in range(4000)]
    assert np.mean([f.low <= 1.0 <= f.high for f in found]) >= least - 0.0034


def test_a_run_that_saw_a_zero_does_not_stop_on_a_lucky_stretch():
    """Twenty equal samples and one zero: the spread of the percolating ones is nothing, the fraction is not known."""
    assert needed_realizations([0.0] + [1.0] * 20, 21, 0.02, LEVEL, 1000) > 21


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    # Newcombe 1998, Table I, method 4, 95 %, doi:10.1002/(SICI)1097-0258(19980430)17:8<857::AID-SIM777>3.0.CO;2-E
    [(81, 263, 0.2535, 0.3682), (15, 148, 0.0598, 0.1644), (0, 20, 0.0, 0.2005), (1, 29, 0.0018, 0.1963)],
)
def test_wilson_interval_of_the_table(successes, trials, low, high):
    assert wilson(successes, trials, 0.95) == pytest.approx((low, high), abs=5e-5)
    mirrored = wilson(trials - successes, trials, 0.95)
    assert mirrored == pytest.approx((1.0 - high, 1.0 - low), abs=5e-5)


def test_without_a_zero_the_interval_is_students():
    found = interval([1.0, 2.0, 3.0])
    assert (found.low, found.high) == (found.percolating_low, found.percolating_high)
    assert found.high == pytest.approx(4.484, abs=5e-4)
    assert (found.percolating_fraction, found.fraction_high) == (1.0, 1.0)
    assert found.fraction_low == pytest.approx(0.31, abs=0.01)


def test_the_interval_scales_and_stays_positive():
    one, many = interval([0.0, 0.0, 1.0, 2.0, 1.5]), interval([0.0, 0.0, 10.0, 20.0, 15.0])
    assert (many.low, many.high) == pytest.approx((10.0 * one.low, 10.0 * one.high))
    assert one.low >= 0.0
    assert one.high - one.mean != pytest.approx(one.mean - one.low, rel=1e-3)


def test_too_few_samples_say_so_by_nan():
    none, blocked, single = interval([]), interval([0.0, 0.0, 0.0]), interval([0.0, 1.0])
    assert np.isnan(none.mean)
    assert (blocked.mean, blocked.low, blocked.percolating_fraction) == (0.0, 0.0, 0.0)
    assert np.isnan([blocked.high, blocked.percolating_mean, single.high, single.percolating_high]).all()
    assert single.low == 0.0


@pytest.mark.parametrize(("samples", "level"), [([-1.0, 1.0], 0.95), ([np.nan], 0.95), ([[1.0]], 0.95), ([1.0], 1.0)])
def test_what_is_no_sample_is_refused(samples, level):
    with pytest.raises(InputError, match="found"):
        interval(samples, level)
