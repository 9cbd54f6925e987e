"""Union area against closed forms and Monte Carlo."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from etc_engine.box import Box
from etc_engine.errors import InputError
from etc_engine.packing.particles import ParticlePacking
from etc_engine.packing.structure import solid_fraction, union_area


def lens(d, r, s):
    """Area common to two disks of radii r and s at distance d."""
    a = np.arccos((d * d + r * r - s * s) / (2 * d * r))
    b = np.arccos((d * d + s * s - r * r) / (2 * d * s))
    return r * r * (a - np.sin(2 * a) / 2) + s * s * (b - np.sin(2 * b) / 2)


def segment(distance, r):
    """Area of the part of a disk beyond a line."""
    alpha = np.arccos(distance / r)
    return r * r * (alpha - np.sin(2 * alpha) / 2)


@pytest.mark.parametrize(("d", "r", "s"), [(0.3, 0.2, 0.2), (0.3, 0.25, 0.1), (0.2, 0.25, 0.1), (0.349, 0.25, 0.1)])
def test_two_disks(d, r, s):
    angle = 0.7
    centers = [[0.5, 0.5], [0.5 + d * np.cos(angle), 0.5 + d * np.sin(angle)]]
    expected = np.pi * (r * r + s * s) - lens(d, r, s)
    assert union_area(ParticlePacking(centers, [r, s], Box((1.0, 1.0)))) == pytest.approx(expected, rel=1e-13)


def test_walls_and_corners():
    box = Box((2.0, 1.0))
    assert union_area(ParticlePacking([[1.0, 0.1]], [0.3], box)) == pytest.approx(
        np.pi * 0.09 - segment(0.1, 0.3), rel=1e-13
    )
    assert union_area(ParticlePacking([[2.0, 1.0]], [0.4], box)) == pytest.approx(np.pi * 0.04, rel=1e-13)
    assert solid_fraction(ParticlePacking([[1.0, 0.5]], [3.0], box)) == pytest.approx(1.0, rel=1e-13)


@pytest.mark.parametrize("centers", [[[0.5, 0.5], [0.55, 0.5]], [[0.5, 0.5], [0.5, 0.5]]])
@pytest.mark.parametrize("small", [0.1, 0.3])
def test_a_swallowed_disk_adds_nothing(centers, small):
    for radii in ([0.36, small], [small, 0.36]):
        area = union_area(ParticlePacking(centers, radii, Box((1.0, 1.0))))
        assert area == pytest.approx(np.pi * 0.36**2, rel=1e-13)
    twice = union_area(ParticlePacking([[0.5, 0.5]] * 3, [0.2] * 3, Box((1.0, 1.0))))
    assert twice == pytest.approx(np.pi * 0.04, rel=1e-13)


def test_a_disk_that_overlaps_its_own_image():
    packing = ParticlePacking([[0.9, 0.9]], [0.6], Box((1.0, 4.0), (True, True)))
    assert union_area(packing) == pytest.approx(np.pi * 0.36 - lens(1.0, 0.6, 0.6), rel=1e-13)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(100, 10**6), count=st.integers(2, 40), flags=st.tuples(st.booleans(), st.booleans()))
def test_monte_carlo_agrees(seed, count, flags):
    rng = np.random.default_rng(seed)
    box = Box((1.3, 0.8), flags)
    packing = ParticlePacking(rng.random((count, 2)) * box.lengths, 0.25 * rng.random(count) ** 2 + 0.01, box)
    points = rng.random((20_000, 2)) * box.lengths
    inside = np.zeros(len(points), dtype=bool)
    for center, radius in zip(packing.centers, packing.radii, strict=True):
        separation = box.minimum_image(points - center)
        inside |= (separation**2).sum(axis=1) < radius**2
    fraction = solid_fraction(packing)
    standard_error = np.sqrt(fraction * (1 - fraction) / len(points))
    assert abs(inside.mean() - fraction) < 5 * standard_error


def test_translation_and_order_do_not_matter():
    rng = np.random.default_rng(614)
    box = Box((1.0, 1.0), (True, True))
    centers, radii = rng.random((60, 2)), rng.uniform(0.02, 0.2, 60)
    area = union_area(ParticlePacking(centers, radii, box))
    order = rng.permutation(60)
    moved = ParticlePacking((centers + np.array((0.37, -0.81)))[order], radii[order], box)
    assert union_area(moved) == pytest.approx(area, rel=1e-12)


def test_three_dimensions_are_refused():
    with pytest.raises(InputError, match="2D box, found 3D"):
        union_area(ParticlePacking([[0.5, 0.5, 0.5]], [0.1], Box((1.0, 1.0, 1.0))))
