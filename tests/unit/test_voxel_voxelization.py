"""Voxels of disks and spheres: exact fractions, their images, overlaps, and what is too coarse."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import dblquad

from etc_engine.box import Box
from etc_engine.engines.voxel import voxelize
from etc_engine.engines.voxel.fractions import ball_in_box
from etc_engine.engines.voxel.voxelization import check_resolution
from etc_engine.errors import InputError
from etc_engine.medium.medium import Medium, Pores
from etc_engine.medium.phases import conductivity_at, count_overlaps, find_owners
from etc_engine.packing.particles import ParticlePacking

coordinates = st.floats(-1.2, 1.2)


def composite(centers, radii, box, inclusion=5.0) -> Medium:
    return Medium(ParticlePacking(centers, radii, box), inclusion, pores=Pores(1.0))


@given(st.lists(coordinates, min_size=3, max_size=3), st.lists(st.floats(0.01, 2.0), min_size=3, max_size=3))
@settings(max_examples=30)
def test_a_sphere_in_a_box_against_quadrature(low, edges):
    low, high = np.array(low), np.array(low) + np.array(edges)

    x, y = (low[a] + edges[a] * (np.arange(400) + 0.5) / 400 for a in (0, 1))
    reach = np.sqrt(np.maximum(0.0, 1.0 - x[:, None] ** 2 - y**2))
    column = np.maximum(0.0, np.minimum(high[2], reach) - np.maximum(low[2], -reach))
    assert ball_in_box(1.0, low, high) == pytest.approx(column.mean() * edges[0] * edges[1], abs=2e-4)


def test_a_sphere_in_a_box_to_many_digits():
    """A box whose corner lies inside, an edge outside: the integrand is smooth there."""
    low, high = np.array([0.3, 0.2, 0.0]), np.array([0.5, 0.6, 2.0])
    exact, _ = dblquad(lambda y, x: np.sqrt(1.0 - x * x - y * y), 0.3, 0.5, 0.2, 0.6, epsabs=1e-13)
    assert ball_in_box(1.0, low, high) == pytest.approx(exact, abs=1e-12)


@given(st.integers(0, 2**16), st.sampled_from([2, 3]))
@settings(max_examples=20)
def test_any_partition_of_space_holds_the_whole_ball(seed, d):
    planes = np.sort(np.concatenate(([-1.1, 1.1], np.random.default_rng(seed).uniform(-1.0, 1.0, 4))))
    cells = np.stack(np.meshgrid(*[np.arange(5)] * d), axis=-1).reshape(-1, d)
    total = sum(ball_in_box(1.0, planes[cell], planes[cell + 1]) for cell in cells)
    assert total == pytest.approx(np.pi if d == 2 else 4.0 / 3.0 * np.pi, abs=1e-12)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("periodic", [True, False])
def test_the_voxels_hold_the_exact_volume_of_overlapping_inclusions(d, periodic):
    rng = np.random.default_rng(21)
    box = Box((1.0, 1.3, 0.9)[:d], (periodic,) * d)
    made = composite(rng.random((15, d)) * box.lengths, rng.uniform(0.1, 0.2, 15), box)
    assert count_overlaps(made.packing) > 5
    image = voxelize(made, 20)
    assert image.volume_fraction == pytest.approx(made.solid_fraction, abs=1e-12)
    assert image.fractions.max() <= 1.0 + 1e-12
    assert image.conductivity.mean() == pytest.approx(image.conductivity.mean().T)


@pytest.mark.parametrize("d", [2, 3])
def test_binary_voxels_have_the_phase_of_their_centre(d):
    rng = np.random.default_rng(22)
    made = composite(
        rng.random((12, d)), rng.uniform(0.1, 0.25, 12), Box((1.0,) * d, (True,) * d), rng.random(12) + 2.0
    )
    image = voxelize(made, 16, "binary")
    points = (np.indices((16,) * d).reshape(d, -1).T + 0.5) / 16
    assert np.array_equal(image.conductivity.scalars.ravel(), conductivity_at(made, points))
    assert image.volume_fraction == (find_owners(made.packing, points) >= 0).mean()


def test_a_shift_by_whole_voxels_shifts_the_image():
    rng = np.random.default_rng(23)
    box = Box((1.0, 1.0, 1.0), (True,) * 3)
    centers, radii = rng.random((6, 3)), rng.uniform(0.12, 0.2, 6)
    one = voxelize(composite(centers, radii, box), 10).fractions
    other = voxelize(composite(centers + [0.3, 0.0, 0.5], radii, box), 10).fractions
    assert np.roll(one, (3, 0, 5), axis=(0, 1, 2)) == pytest.approx(other, abs=1e-9)


def test_laminates_lie_between_series_and_parallel_with_the_right_normal():
    box = Box((1.0, 1.0), (True, True))
    image = voxelize(composite([[0.5, 0.5]], [0.3], box, 9.0), 20)
    rows = image.conductivity.rows
    f = image.fractions.ravel()[rows]
    assert image.conductivity.principal[:, 0] == pytest.approx(1.0 / (f / 9.0 + 1.0 - f), rel=1e-12)
    assert image.conductivity.principal[:, 1] == pytest.approx(9.0 * f + 1.0 - f, rel=1e-12)
    outward = (np.array(np.unravel_index(rows, (20, 20))).T + 0.5) / 20 - 0.5
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    assert np.abs((image.conductivity.axes[:, :, 0] * outward).sum(axis=1)) == pytest.approx(1.0, abs=1e-12)
    gram = image.conductivity.axes.transpose(0, 2, 1) @ image.conductivity.axes
    assert gram == pytest.approx(np.broadcast_to(np.eye(2), gram.shape), abs=1e-12)


def test_a_gap_thinner_than_a_voxel_is_one_layer_between_two_inclusions():
    box = Box((1.0, 1.0, 1.0), (True,) * 3)
    made = composite([[0.25, 0.5, 0.5], [0.74, 0.5, 0.5]], [0.24, 0.24], box, 100.0)
    image = voxelize(made, 9)
    middle = np.ravel_multi_index((4, 4, 4), (9, 9, 9))
    at = int(np.flatnonzero(image.conductivity.rows == middle)[0])
    assert np.abs(image.conductivity.axes[at, :, 0]) == pytest.approx([1.0, 0.0, 0.0], abs=0.05)


def test_several_conductivities_meet_at_the_radical_plane():
    box = Box((1.0, 1.0), (False, False))
    made = composite([[0.4, 0.5], [0.6, 0.5]], [0.2, 0.2], box, np.array([3.0, 7.0]))
    scalars = voxelize(made, 10).conductivity.scalars
    assert scalars[4, 5] == 3.0
    assert scalars[5, 5] == 7.0


def test_what_is_too_coarse_or_unknown_is_refused():
    box = Box((1.0, 1.0), (True, True))
    made = composite([[0.5, 0.5]], [0.05], box)
    with pytest.raises(InputError, match=r"spans 3\.2 voxels and 4 are needed: take a resolution of at least 40"):
        check_resolution(made, 32)
    check_resolution(made, 40)
    with pytest.raises(InputError, match="unknown voxels"):
        voxelize(made, 40, "grey")
    with pytest.raises(InputError, match="at least 2 voxels"):
        voxelize(made, 1)
