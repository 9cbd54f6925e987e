"""Advancing front: tangency, no overlap, unbiased sizes, refusals, linear cost."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from scipy.stats import kstest

from etc_engine.box import Box, parse_periodic
from etc_engine.errors import InputError, PackingError
from etc_engine.packing import PackingSpec, neighbor_pairs, pack, parse_radii
from etc_engine.packing.advancing_front import pack_advancing_front

WORDS = [
    "equal:0.03",
    "uniform:0.01:0.05",
    "gaussian:0.03:0.009",
    "lognormal:0.02:0.01",
    "bidisperse:0.01:0.1:0.02",
]


def wall_gaps(packing):
    """Relative gaps to the walls, shape (n, 4)."""
    r = packing.radii[:, None]
    return np.concatenate((packing.centers - r, packing.box.lengths - packing.centers - r), axis=1) / r


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(100, 10**6),
    word=st.sampled_from(WORDS),
    width=st.floats(0.6, 3.0),
    height=st.floats(0.6, 3.0),
)
def test_disks_are_tangent_and_do_not_overlap(seed, word, width, height):
    packing = pack_advancing_front(parse_radii(word), Box((width, height)), np.random.default_rng(seed))
    pairs = neighbor_pairs(packing, relative_gap=1e-6)
    mean = packing.radii[pairs.pairs].mean(axis=1)
    assert (pairs.gaps >= -1e-10 * mean).all()
    walls = wall_gaps(packing)
    assert (walls >= -1e-10).all()
    on_wall = np.abs(walls) < 1e-9
    assert on_wall.any(axis=0).all()
    # two tangencies for each disk when it was placed, one for the first pair
    assert pairs.count + on_wall.sum() >= 2 * packing.count - 3


@pytest.mark.parametrize("word", ["uniform:0.01:0.02", "lognormal:0.01:0.005"])
def test_sizes_are_an_unbiased_sample(word):
    radii = parse_radii(word)
    sizes = np.concatenate(
        [pack_advancing_front(radii, Box((1.0, 1.0)), np.random.default_rng(4000 + k)).radii for k in range(6)]
    )
    reference = radii.sample(200_000, np.random.default_rng(17))
    assert kstest(sizes, reference).pvalue > 1e-3


def test_the_same_generator_state_gives_the_same_bits():
    one, two = (
        pack_advancing_front(parse_radii("uniform:0.02:0.03"), Box((1.0, 2.0)), np.random.default_rng(88))
        for _ in range(2)
    )
    assert one.centers.tobytes() == two.centers.tobytes()
    assert one.radii.tobytes() == two.radii.tobytes()


def test_each_half_of_the_box_is_equally_dense():
    packing = pack_advancing_front(parse_radii("uniform:0.004:0.008"), Box((1.0, 1.0)), np.random.default_rng(25))
    for axis in (0, 1):
        lower = packing.measures[packing.centers[:, axis] < 0.5].sum() / packing.measures.sum()
        assert abs(lower - 0.5) < 0.01


@pytest.fixture(scope="module")
def ensemble():
    """25 packings of some 2400 disks, the box 50 mean diameters wide."""
    radii = parse_radii("uniform:0.01:0.02")
    return [pack_advancing_front(radii, Box((1.5, 1.5)), np.random.default_rng(6100 + k)) for k in range(25)]


def shell_of(points, width, shells=10):
    """Square shells about the centre, from the inside to the walls."""
    return np.minimum((np.abs(points / width - 0.5).max(axis=1) * 2.0 * shells).astype(int), shells - 1)


def test_the_bulk_is_homogeneous(ensemble):
    """Shells more than five mean diameters from a wall; out of the middle of the box the centre was 5 % denser."""
    side = (np.arange(300) + 0.5) / 300 * 1.5
    points = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    shells = shell_of(points, 1.5)
    covered = np.zeros(10)
    for packing in ensemble:
        distances, nearest = cKDTree(packing.centers).query(points, k=4)
        covered += np.bincount(shells, (distances < packing.radii[nearest]).any(axis=1), minlength=10)
    bulk = covered[:8] / np.bincount(shells, minlength=10)[:8] / len(ensemble)
    assert np.abs(bulk / bulk.mean() - 1.0).max() < 0.01


def test_the_centre_has_the_radii_of_the_distribution(ensemble):
    inner = np.concatenate([p.radii[shell_of(p.centers, 1.5) < 3] for p in ensemble])
    assert abs(inner.mean() / 0.015 - 1.0) < 3.0 * inner.std() / 0.015 / np.sqrt(inner.size)


def test_the_contacts_are_isotropic(ensemble):
    """Fabric of the bulk, sum of n n over contacts: its two diagonal values agree within 2 %."""
    squares = np.zeros(2)
    for packing in ensemble:
        pairs = neighbor_pairs(packing, relative_gap=1e-6).pairs
        inside = (shell_of(packing.centers, 1.5) < 8)[pairs].all(axis=1)
        branches = packing.centers[pairs[inside, 1]] - packing.centers[pairs[inside, 0]]
        squares += ((branches / np.linalg.norm(branches, axis=1, keepdims=True)) ** 2).sum(axis=0)
    assert squares[0] / squares[1] == pytest.approx(1.0, abs=0.02)


def test_few_disks_in_a_small_box_touch_all_walls():
    packing = pack_advancing_front(parse_radii("equal:0.24"), Box((1.0, 1.0)), np.random.default_rng(25))
    assert packing.count == 4
    assert (np.abs(wall_gaps(packing)) < 1e-9).any(axis=0).all()


@pytest.mark.parametrize(
    ("box", "word", "error", "message"),
    [
        (Box((1.0, 1.0), parse_periodic("x", 2)), "equal:0.01", InputError, "boxes with walls"),
        (Box((1.0, 1.0, 1.0)), "equal:0.01", InputError, "found 3D"),
        (Box((1.0, 0.5)), "equal:0.3", InputError, "wider than the box"),
        (Box((1.0, 1.0)), "equal:0.49", PackingError, "too small"),
    ],
)
def test_impossible_boxes_are_refused(box, word, error, message):
    with pytest.raises(error, match=message):
        pack_advancing_front(parse_radii(word), box, np.random.default_rng(25))


def test_pack_entry_thins_and_grows():
    box, radii = Box((1.0, 1.0)), parse_radii("uniform:0.01:0.02")
    thin = pack(PackingSpec("advancing-front", radii, box, density=0.65), np.random.default_rng(31))
    assert thin.density == pytest.approx(0.65, abs=0.5 * np.pi * 0.02**2)
    grown = pack(PackingSpec("advancing-front", radii, box, density=0.85), np.random.default_rng(31))
    assert grown.density == pytest.approx(0.85, rel=1e-14)
    strict = PackingSpec("advancing-front", radii, box, density=0.85, radius_growth=False)
    with pytest.raises(PackingError, match=r"own 0\.7"):
        pack(strict, np.random.default_rng(31))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"method": "pour"}, "unknown packing method 'pour'"),
        ({"count": 0}, "at least one particle"),
        ({"density": -0.1}, "density must be positive"),
        ({"growth_rate": 0.0}, "growth rate must be positive"),
    ],
)
def test_senseless_specifications_are_refused(change, message):
    settled = {"method": "advancing-front", "radii": parse_radii("equal:0.1"), "box": Box((1.0, 1.0))}
    with pytest.raises(InputError, match=message):
        PackingSpec(**(settled | change))


def test_sizes_within_a_factor_of_100_fill_the_box():
    wide = pack_advancing_front(parse_radii("uniform:1:100"), Box((6000.0, 6000.0)), np.random.default_rng(12))
    assert wide.density > 0.7
