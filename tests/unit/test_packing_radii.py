"""Size distributions: words, refusals, and moments of samples against the exact ones."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.errors import InputError
from etc_engine.packing.radii import RadiusDistribution, parse_radii

WORDS = [
    "equal:0.3",
    "uniform:0.01:0.02",
    "gaussian:1:0.3",
    "lognormal:2:1",
    "bidisperse:1:1.4:0.3",
    "list:1:2:5",
]


@pytest.mark.parametrize("word", WORDS)
def test_sample_moments_agree_with_the_exact_ones(word):
    radii = parse_radii(word)
    sample = radii.sample(200_000, np.random.default_rng(9241))
    for order in (1, 2, 3):
        standard_error = np.std(sample**order) / np.sqrt(sample.size)
        assert abs(np.mean(sample**order) - radii.moment(order)) <= 5 * standard_error + 1e-15
    assert radii.smallest <= sample.min()
    assert sample.max() <= radii.largest


def test_lognormal_is_given_by_mean_and_sd_of_the_radius():
    sample = parse_radii("lognormal:2:0.5").sample(400_000, np.random.default_rng(77))
    assert np.std(sample) == pytest.approx(0.5, rel=0.01)


def test_equal_without_a_radius_is_a_shape():
    assert parse_radii("equal") == RadiusDistribution("equal", (1.0,), scalable=True)
    assert not parse_radii("equal:1").scalable


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("cauchy:1:2", "unknown size distribution"),
        ("uniform:0.02:0.01", "lower end above its upper end"),
        ("uniform:0.02", "1 numbers: expected uniform:a:b"),
        ("uniform:-1:2", "not positive"),
        ("uniform:a:b", "unreadable number"),
        ("uniform:1:inf", "not finite"),
        ("equal:0", "not positive"),
        ("equal:5e16", r"radius 5e\+16: expected 1e-15 to 1e\+15 metres"),
        ("equal:1e-320", "radius 9.*e-321: expected 1e-15"),
        ("gaussian:5e16:1", "expected 1e-15"),
        ("bidisperse:1:2e7:0.5", r"ratio 2e\+07: expected at most 1e\+06"),
        ("equal:1:2", "2 numbers: expected equal"),
        ("gaussian:1:0.5", "reaches radii of zero"),
        ("gaussian:1:-0.1", "standard deviation that is not positive"),
        ("lognormal:1:0", "standard deviation that is not positive"),
        ("bidisperse:1:2:1.5", r"expected a number in \[0, 1\]"),
        ("list", "0 numbers"),
        ("", "unknown size distribution"),
    ],
)
def test_nonsense_is_refused(word, message):
    with pytest.raises(InputError, match=message):
        parse_radii(word)
