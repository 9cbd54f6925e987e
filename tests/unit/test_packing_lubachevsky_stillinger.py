"""Event-driven packing: exact density, no overlap, conservation laws, refusals, reproducibility."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from etc_engine.box import Box
from etc_engine.errors import InputError, PackingError
from etc_engine.packing import PackingSpec, lubachevsky_stillinger, pack, parse_radii
from etc_engine.packing.hard_spheres import DONE, make_gas, run, start_lists
from etc_engine.packing.lubachevsky_stillinger import compress
from etc_engine.packing.overlap import largest_overlap

WORDS = ["equal", "uniform:1:3", "gaussian:1:0.2", "lognormal:1:0.3", "bidisperse:1:3:0.3", "list:1:2:3"]


def brute_force_overlap(packing):
    """Largest pair and wall overlap over mean diameter, by all pairs and all nearby images."""
    lengths, worst = np.array(packing.box.lengths), 0.0
    for axis, periodic in enumerate(packing.box.periodic):
        if not periodic:
            x = packing.centers[:, axis]
            worst = max(worst, ((packing.radii - np.minimum(x, lengths[axis] - x)) / packing.radii / 2).max())
    images = np.stack(np.meshgrid(*[(-1, 0, 1) if p else (0,) for p in packing.box.periodic]), -1)
    for shift in images.reshape(-1, packing.dimension):
        separation = packing.centers[:, None] - packing.centers + shift * lengths
        touch = packing.radii[:, None] + packing.radii
        overlap = 1.0 - np.sqrt((separation**2).sum(axis=-1)) / touch
        if not shift.any():
            np.fill_diagonal(overlap, 0.0)
        worst = max(worst, overlap.max())
    return worst


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(100, 10**6),
    dimension=st.sampled_from([2, 3]),
    count=st.integers(120, 200),
    word=st.sampled_from(WORDS),
    flags=st.tuples(st.booleans(), st.booleans(), st.booleans()),
    part=st.floats(0.3, 1.0),
)
def test_density_is_exact_and_nothing_overlaps(seed, dimension, count, word, flags, part):
    rng = np.random.default_rng(seed)
    box = Box((1.0, 1.3, 0.9)[:dimension], flags[:dimension])
    density = part * (0.62 if dimension == 2 else 0.34)  # walls and mixtures jam early in so small a box
    made = compress(parse_radii(word).sample(count, rng), box, rng, density=density, growth_rate=0.1)
    assert made.packing.count == count
    assert made.packing.density == pytest.approx(density, rel=1e-12)
    assert brute_force_overlap(made.packing) <= 1e-10
    assert largest_overlap(made.packing) == pytest.approx(brute_force_overlap(made.packing), abs=1e-13)


def test_sizes_keep_their_order_and_proportions():
    radii = parse_radii("uniform:1:2").sample(100, np.random.default_rng(61))
    made = compress(radii, Box((1.0, 1.0), (True, True)), np.random.default_rng(62), density=0.6)
    np.testing.assert_allclose(made.packing.radii / made.packing.radii[0], radii / radii[0], rtol=1e-14)


def test_the_same_seed_gives_the_same_bits():
    one, two = (
        compress(np.ones(150), Box((1.0, 1.0, 1.0), (True,) * 3), np.random.default_rng(71), density=0.5)
        for _ in range(2)
    )
    assert one.packing.centers.tobytes() == two.packing.centers.tobytes()
    assert one.collisions == two.collisions


@pytest.mark.parametrize("walls", [False, True])
def test_energy_and_momentum_without_growth(walls):
    box = Box((1.0, 1.0), (not walls, not walls))
    packing = compress(np.ones(200), box, np.random.default_rng(81), density=0.6).packing
    velocities = np.random.default_rng(82).standard_normal((200, 2))
    gas = make_gas(packing.centers, velocities, np.ones(200), box, packing.radii[0], 0.5, 30)
    before = gas.state[:, 3:5].copy()
    assert start_lists(gas, packing.radii[0], 0.0, 0.5)
    why, time, collisions, _, _ = run(gas, packing.radii[0], 0.0, 0.5, np.inf, 20_000)
    assert (why, collisions) == (DONE, 20_000)
    assert time > 0.0
    after = gas.state[:, 3:5]
    assert np.abs(after - before).max() > 0.1
    assert np.sum(after**2) == pytest.approx(np.sum(before**2), rel=1e-11)
    if not walls:
        np.testing.assert_allclose(after.sum(axis=0), before.sum(axis=0), atol=1e-10)


def test_two_particles_meet_when_the_closed_form_says():
    """Head-on: gap g closes at 2 v + 2 S rate, and both leave with u' = 2 growth - u."""
    box, radius, rate, speed = Box((10.0, 10.0)), 0.5, 0.1, 1.0
    gas = make_gas(
        np.array([[2.0, 5.0], [6.0, 5.0]]),
        np.array([[speed, 0.0], [-speed, 0.0]]),
        np.ones(2),
        box,
        2.0,
        0.5,
        4,
    )
    assert start_lists(gas, radius, rate, 0.5)
    why, time, *_ = run(gas, radius, rate, 0.5, np.inf, 1)
    assert why == DONE
    assert time == pytest.approx((4.0 - 2.0 * radius) / (2.0 * speed + 2.0 * rate), rel=1e-14)
    np.testing.assert_allclose(gas.state[:, 3], [-(speed + 2 * rate), speed + 2 * rate], rtol=1e-14)


def test_full_neighbor_lists_get_more_room(monkeypatch):
    """Lists of two neighbours are too short at once; the packing is made all the same."""
    rooms = []

    def short_at_first(*arguments):
        rooms.append(arguments[-1])
        return make_gas(*arguments[:-1], arguments[-1] // 12)

    monkeypatch.setattr(lubachevsky_stillinger, "make_gas", short_at_first)
    made = compress(np.ones(100), Box((1.0, 1.0), (True, True)), np.random.default_rng(91), density=0.7)
    assert len(rooms) > 1
    assert rooms == [24 * 2**k for k in range(len(rooms))]
    assert made.packing.density == pytest.approx(0.7, rel=1e-12)


def test_jamming_below_the_target_says_what_was_reached():
    with pytest.raises(PackingError, match=r"it jammed at density 0\.8") as refusal:
        compress(
            np.ones(300),
            Box((1.0, 1.0), (True, True)),
            np.random.default_rng(93),
            density=0.9,
            growth_rate=0.2,
        )
    assert 0.80 < refusal.value.reached < 0.9


@pytest.mark.parametrize(
    ("count", "box", "density", "message"),
    [
        (100, Box((1.0, 1.0)), 0.92, "disks fill at most 0.9069"),
        (100, Box((1.0, 1.0, 1.0)), 0.75, "spheres fill at most 0.7405"),
        (2, Box((1.0, 1.0), (True, True)), 0.7, "under two diameters"),
        (1, Box((1.0, 0.5)), 0.7, "under one diameter"),
        (100, Box((1.0, 1.0)), -0.1, "must be positive"),
    ],
)
def test_impossible_requests_are_refused_at_once(count, box, density, message):
    with pytest.raises(InputError, match=message):
        compress(np.ones(count), box, np.random.default_rng(95), density=density)


def test_pack_scales_the_radii_to_count_density_and_box():
    spec = PackingSpec(
        "lubachevsky-stillinger",
        parse_radii("uniform:0.1:0.2"),
        Box((2.0, 1.0), (True, True)),
        200,
        0.75,
        0.1,
    )
    packing = pack(spec, np.random.default_rng(97))
    assert (packing.count, packing.density) == (200, pytest.approx(0.75, rel=1e-12))


def test_count_follows_from_density_and_radii():
    spec = PackingSpec("lubachevsky-stillinger", parse_radii("equal:0.05"), Box((1.0, 1.0)), density=0.6)
    packing = pack(spec, np.random.default_rng(99))
    assert packing.count == round(0.6 / (np.pi * 0.05**2))
    assert packing.density == pytest.approx(0.6, rel=1e-12)
    with pytest.raises(InputError, match="needs a count"):
        pack(
            PackingSpec("lubachevsky-stillinger", parse_radii("equal"), Box((1.0, 1.0))),
            np.random.default_rng(5),
        )


def test_progress_rises_to_one():
    seen = []
    compress(np.ones(100), Box((1.0, 1.0)), np.random.default_rng(101), density=0.7, progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
