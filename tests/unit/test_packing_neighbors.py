"""Neighbour pairs against a brute-force search over all images."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from etc_engine.box import Box
from etc_engine.errors import InputError
from etc_engine.packing.neighbors import neighbor_pairs
from etc_engine.packing.particles import ParticlePacking


def brute_force(packing, gap, relative_gap, span=4):
    """Every (i, j, shift) within reach, in sorted order, with its gap."""
    lengths = np.array(packing.box.lengths)
    images = [range(-span, span + 1) if flag else (0,) for flag in packing.box.periodic]
    rows = []
    for i in range(packing.count):
        for j in range(i, packing.count):
            for shift in itertools.product(*images):
                if i == j and not shift > (0,) * packing.dimension:
                    continue
                touch = packing.radii[i] + packing.radii[j]
                distance = np.linalg.norm(packing.centers[j] + shift * lengths - packing.centers[i])
                if distance - touch <= gap + relative_gap * touch / 2:
                    rows.append((i, j, shift, distance - touch))
    return rows


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(100, 10**6),
    dimension=st.sampled_from([2, 3]),
    count=st.integers(1, 25),
    size_ratio=st.sampled_from([1.0, 3.0, 100.0]),
    largest=st.floats(0.05, 0.7),
    gap=st.sampled_from([0.0, 0.05, 0.3]),
    relative_gap=st.sampled_from([0.0, 0.4]),
)
def test_pairs_equal_brute_force(seed, dimension, count, size_ratio, largest, gap, relative_gap):
    rng = np.random.default_rng(seed)
    box = Box(tuple(rng.uniform(0.5, 2.0, dimension)), tuple(rng.random(dimension) < 0.6))
    radii = largest * size_ratio ** -rng.random(count)
    packing = ParticlePacking(rng.random((count, dimension)) * box.lengths, radii, box)
    found = neighbor_pairs(packing, gap, relative_gap)
    expected = brute_force(packing, gap, relative_gap)
    assert [(*p, *s) for p, s in zip(found.pairs.tolist(), found.shifts.tolist(), strict=True)] == [
        (i, j, *s) for i, j, s, _ in expected
    ]
    np.testing.assert_allclose(found.gaps, [row[3] for row in expected], rtol=0, atol=1e-14)


def test_hexagonal_lattice_has_six_neighbors_each():
    columns, rows = 12, 8
    x, y = np.meshgrid(np.arange(columns), np.arange(rows))
    centers = np.column_stack(((x + 0.5 * (y % 2)).ravel(), (y * np.sqrt(3) / 2).ravel()))
    box = Box((columns, rows * np.sqrt(3) / 2), (True, True))
    found = neighbor_pairs(ParticlePacking(centers, np.full(x.size, 0.5), box), relative_gap=1e-9)
    assert found.count == 3 * x.size
    np.testing.assert_array_equal(np.bincount(found.pairs.ravel()), 6)


def test_particle_touches_its_own_image_once():
    packing = ParticlePacking([[0.3, 0.4]], [0.5], Box((1.0, 5.0), (True, False)))
    found = neighbor_pairs(packing)
    assert (found.pairs.tolist(), found.shifts.tolist()) == ([[0, 0]], [[1, 0]])
    assert neighbor_pairs(packing, images=False).count == 0


def test_no_pairs_has_the_right_shapes():
    found = neighbor_pairs(ParticlePacking([[0.3, 0.4, 0.2]], [0.1], Box((1.0, 1.0, 1.0))))
    assert (found.pairs.shape, found.shifts.shape, found.gaps.shape) == ((0, 2), (0, 3), (0,))


@pytest.mark.parametrize("reach", [{"gap": -1.0}, {"relative_gap": np.nan}, {"gap": np.inf}])
def test_a_senseless_reach_is_refused(reach):
    with pytest.raises(InputError, match="must be finite and not negative"):
        neighbor_pairs(ParticlePacking([[0.3, 0.4]], [0.1], Box((1.0, 1.0))), **reach)
