"""Union area against closed forms and Monte Carlo."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from etc_engine.box import Box
from etc_engine.engines.voxel.fractions import ball_in_box
from etc_engine.errors import InputError
from etc_engine.packing.particles import ParticlePacking
from etc_engine.structure.cut_sphere import cut_sphere_volume
from etc_engine.structure.union import solid_fraction, union_area, union_volume


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


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.3])
@pytest.mark.parametrize(("d", "r", "s"), [(0.3, 0.2, 0.2), (0.3, 0.25, 0.1), (0.2, 0.25, 0.1), (0.349, 0.25, 0.1)])
def test_two_spheres(d, r, s, angle):
    step = d * np.array((np.cos(angle) * 0.8, np.sin(angle) * 0.8, 0.6))
    centers = [[0.4, 0.4, 0.4], [0.4, 0.4, 0.4] + step]
    common = np.pi * (r + s - d) ** 2 * (d * d + 2 * d * (r + s) - 3 * (r - s) ** 2) / (12 * d)
    expected = 4 / 3 * np.pi * (r**3 + s**3) - common
    assert union_volume(ParticlePacking(centers, [r, s], Box((1.0, 1.0, 1.0)))) == pytest.approx(expected, rel=1e-10)


def test_three_equal_spheres_by_inclusion_and_exclusion():
    """Unit spheres on an equilateral triangle of side 1; their common part is summed over its cross-sections.

    At height z the three disks of radius rho have their centres at 1 / sqrt(3) from the middle; their common part
    is an equilateral triangle with corners where two circles meet, and three circular segments on its sides.
    """
    nodes, weights = np.polynomial.legendre.leggauss(400)
    height = np.sqrt(2.0 / 3.0)  # of the two points that lie on all three spheres
    rho = np.sqrt(1.0 - (0.5 * height * (nodes + 1.0)) ** 2)
    corner = np.sqrt(rho**2 - 0.25) - 0.5 / np.sqrt(3.0)  # from the middle to where two circles meet
    side = np.sqrt(3.0) * corner
    opening = 2.0 * np.arcsin(side / (2.0 * rho))
    section = np.sqrt(3.0) / 4.0 * side**2 + 1.5 * rho**2 * (opening - np.sin(opening))
    common_to_three = height * np.sum(weights * section)
    common_to_two = np.pi * (4.0 + 1.0) * (2.0 - 1.0) ** 2 / 12.0
    expected = 4.0 * np.pi - 3.0 * common_to_two + common_to_three
    centers = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, np.sqrt(3.0) / 2.0, 0.0]]) + 2.0
    assert union_volume(ParticlePacking(centers, [1.0] * 3, Box((6.0,) * 3))) == pytest.approx(expected, rel=1e-10)


def test_sphere_in_walls_and_corners():
    box = Box((2.0, 1.0, 1.0))
    cap = np.pi * 0.2**2 * (3 * 0.3 - 0.2) / 3
    for center in ([1.0, 0.5, 0.1], [1.0, 0.9, 0.5], [0.1, 0.4, 0.5]):
        assert union_volume(ParticlePacking([center], [0.3], box)) == pytest.approx(
            4 / 3 * np.pi * 0.027 - cap, rel=1e-11
        )
    corner = ParticlePacking([[2.0, 1.0, 0.0]], [0.4], box)
    assert union_volume(corner) == pytest.approx(np.pi * 0.4**3 / 6, rel=1e-11)
    assert solid_fraction(ParticlePacking([[1.0, 0.5, 0.5]], [3.0], box)) == pytest.approx(1.0, rel=1e-11)
    twice = ParticlePacking([[1.0, 0.5, 0.5]] * 2 + [[1.02, 0.5, 0.5]], [0.3, 0.3, 0.1], box)
    assert union_volume(twice) == pytest.approx(4 / 3 * np.pi * 0.027, rel=1e-11)


def test_sphere_that_overlaps_its_own_images():
    packing = ParticlePacking([[0.1, 0.7, 0.3]], [0.55], Box((1.0, 1.0, 1.0), (True,) * 3))
    cap = np.pi * 0.05**2 * (3 * 0.55 - 0.05) / 3
    assert union_volume(packing) == pytest.approx(4 / 3 * np.pi * 0.55**3 - 6 * cap, rel=1e-11)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(100, 10**6), count=st.integers(2, 40), flags=st.tuples(*[st.booleans()] * 3))
def test_monte_carlo_agrees_in_space(seed, count, flags):
    rng = np.random.default_rng(seed)
    box = Box((1.3, 0.8, 1.0), flags)
    packing = ParticlePacking(rng.random((count, 3)) * box.lengths, 0.3 * rng.random(count) ** 2 + 0.05, box)
    points = rng.random((20_000, 3)) * box.lengths
    inside = np.zeros(len(points), dtype=bool)
    for center, radius in zip(packing.centers, packing.radii, strict=True):
        inside |= (box.minimum_image(points - center) ** 2).sum(axis=1) < radius**2
    fraction = solid_fraction(packing)
    standard_error = np.sqrt(fraction * (1 - fraction) / len(points)) + 1e-6
    assert abs(inside.mean() - fraction) < 5 * standard_error


def _half_spaces(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    normals = rng.normal(size=(count, 3))
    return normals / np.linalg.norm(normals, axis=1)[:, None], rng.uniform(-0.3, 1.2, count)


def test_a_plane_divides_a_cut_sphere_without_a_rest():
    rng = np.random.default_rng(20)
    for count in rng.integers(1, 9, 300):
        normals, cuts = _half_spaces(rng, int(count))
        whole = cut_sphere_volume(1.0, normals[1:], cuts[1:])
        halves = cut_sphere_volume(1.0, normals, cuts)
        normals[0], cuts[0] = -normals[0], -cuts[0]
        halves += cut_sphere_volume(1.0, normals, cuts)
        assert halves == pytest.approx(whole, abs=1e-12)


def test_cut_sphere_in_a_box_is_that_of_the_closed_form_for_boxes():
    rng = np.random.default_rng(21)
    axes = np.vstack((np.eye(3), -np.eye(3)))
    for _ in range(300):
        low = rng.uniform(-1.2, 0.9, 3)
        high = low + rng.uniform(0.01, 1.5, 3)
        turned = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        volume = cut_sphere_volume(1.0, axes @ turned, np.concatenate((high, -low)))
        assert volume == pytest.approx(ball_in_box(1.0, low, high), abs=1e-12)


@pytest.mark.parametrize("off", [0.0, 1e-14, 1e-10, 1e-6])
def test_planes_through_the_centre_and_nearly_so(off):
    axes = np.vstack((np.eye(3), -np.eye(3)))
    for place in np.ndindex(3, 3, 3):
        low = 0.4 * np.array(place) - 0.8 + off * np.array((1.0, -0.3, 0.7))
        high = low + 0.8
        volume = cut_sphere_volume(1.0, axes, np.concatenate((high, -low)))
        assert volume == pytest.approx(ball_in_box(1.0, low, high), abs=1e-12 if off == 0.0 else 2e-8)


def test_the_other_dimension_is_refused():
    with pytest.raises(InputError, match="2D box, found 3D"):
        union_area(ParticlePacking([[0.5, 0.5, 0.5]], [0.1], Box((1.0, 1.0, 1.0))))
    with pytest.raises(InputError, match="3D box, found 2D"):
        union_volume(ParticlePacking([[0.5, 0.5]], [0.1], Box((1.0, 1.0))))
