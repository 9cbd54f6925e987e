"""Composite: what it refuses, which inclusion holds a point, exact volume fractions."""

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.errors import GeometryError, InputError
from etc_engine.medium.composite import MATRIX, Composite
from etc_engine.packing.particles import ParticlePacking


def disks(centers, radii, periodic=(True, True), lengths=(1.0, 1.0)):
    return ParticlePacking(centers, radii, Box(lengths, periodic))


@pytest.mark.parametrize(
    ("matrix", "inclusion", "words"),
    [
        (-1.0, 1.0, "matrix must be finite and not negative, found -1"),
        (np.nan, 1.0, "matrix must be finite"),
        (np.inf, 1.0, "matrix must be finite"),
        (1.0, -2.0, "inclusion must not be negative, found -2"),
        (1.0, np.nan, "inclusion must not be negative, found nan"),
        (1.0, [1.0, 2.0, 3.0], r"shape \(2,\), found shape \(3,\)"),
        (0.0, 0.0, "neither the matrix nor an inclusion conducts"),
    ],
)
def test_conductivities_that_make_no_composite_are_refused(matrix, inclusion, words):
    with pytest.raises(InputError, match=words):
        Composite(disks([[0.2, 0.2], [0.7, 0.7]], [0.1, 0.1]), matrix, inclusion)


def test_inclusions_that_leave_no_matrix_are_refused():
    with pytest.raises(GeometryError, match="leave no matrix"):
        Composite(disks([[0.5, 0.5]], [0.8]), 1.0, 2.0)


def test_a_point_belongs_to_the_inclusion_that_holds_it_through_periodic_faces():
    composite = Composite(disks([[0.05, 0.5], [0.5, 0.5]], [0.1, 0.2]), 1.0, [3.0, 5.0])
    points = np.array([[0.97, 0.5], [-0.03, 0.5], [0.94, 0.5], [0.5, 0.69], [0.5, 0.71]])
    assert composite.phase(points).tolist() == [0, 0, MATRIX, 1, MATRIX]
    assert composite.conductivity_at(points).tolist() == [3.0, 3.0, 1.0, 5.0, 1.0]


def test_walls_repeat_nothing():
    composite = Composite(disks([[0.05, 0.5]], [0.1], (False, True)), 1.0, 3.0)
    assert composite.phase([[0.97, 0.5], [0.1, 0.5]]).tolist() == [MATRIX, 0]


def test_the_radical_line_divides_an_overlap():
    composite = Composite(disks([[0.3, 0.5], [0.6, 0.5]], [0.2, 0.15]), 1.0, [3.0, 5.0])
    radical = 0.3 + (0.3**2 + 0.2**2 - 0.15**2) / (2 * 0.3)
    points = np.array([[radical - 1e-6, 0.5], [radical + 1e-6, 0.5]])
    assert composite.phase(points).tolist() == [0, 1]
    assert composite.overlapping == 1


def test_volume_fraction_counts_overlaps_once():
    rng = np.random.default_rng(97)
    composite = Composite(disks(rng.random((40, 2)), rng.uniform(0.05, 0.15, 40)), 1.0, 2.0)
    sampled = (composite.phase(rng.random((200_000, 2))) != MATRIX).mean()
    spread = np.sqrt(composite.volume_fraction * (1.0 - composite.volume_fraction) / 200_000)
    assert abs(sampled - composite.volume_fraction) < 5.0 * spread


def test_contrast_is_the_range_of_ratios():
    pair = disks([[0.2, 0.2], [0.7, 0.7]], [0.1, 0.1])
    assert Composite(pair, 2.0, [1.0, 8.0]).contrast == (0.5, 4.0)
    assert Composite(pair, 0.0, 1.0).contrast == (np.inf, np.inf)
