"""Random sequential insertion: uniform places, walls, saturation, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import kstest

from etc_engine.box import Box
from etc_engine.errors import InputError, PackingError
from etc_engine.packing import PackingSpec, pack, parse_radii
from etc_engine.packing.overlap import largest_overlap
from etc_engine.packing.random_sequential import insert_randomly


@pytest.mark.parametrize("word", ["equal:0.03", "uniform:0.01:0.05", "lognormal:0.02:0.01"])
@pytest.mark.parametrize("box", [Box((1.0, 1.2)), Box((1.0, 1.2), (True, True)), Box((0.5, 0.5, 0.5))])
def test_particles_lie_apart_and_inside(word, box):
    rng = np.random.default_rng(211)
    made = insert_randomly(parse_radii(word).sample(150, rng), box, rng)
    assert largest_overlap(made.packing) == 0.0


def test_dilute_places_are_uniform():
    centers = np.concatenate(
        [
            insert_randomly(
                np.full(20, 0.01), Box((1.0, 1.0), (True, True)), np.random.default_rng(300 + k)
            ).packing.centers
            for k in range(100)
        ]
    )
    for axis in (0, 1):
        assert kstest(centers[:, axis], "uniform").pvalue > 1e-3


def test_a_saturated_packing_has_no_place_left():
    """Not one of 2e5 points of a fine grid is free: an independent check of the proof by voxels."""
    box, radius = Box((1.0, 1.0), (True, True)), 0.04
    made = insert_randomly(np.full(400, radius), box, np.random.default_rng(221))
    assert made.saturated
    axis = (np.arange(450) + 0.5) / 450
    points = np.stack(np.meshgrid(axis, axis), -1).reshape(-1, 2)
    nearest = np.full(len(points), np.inf)
    for center in made.packing.centers:
        nearest = np.minimum(nearest, (box.minimum_image(points - center) ** 2).sum(axis=1))
    assert (nearest < (2 * radius) ** 2).all()


def test_saturation_is_reported_with_what_was_reached():
    box = Box((1.0, 1.0))
    with pytest.raises(PackingError, match=r"saturated at density 0\.5") as refusal:
        pack(PackingSpec("random-sequential", parse_radii("equal"), box, 500, 0.6), np.random.default_rng(231))
    assert 0.5 < refusal.value.reached < 0.6


def test_pack_meets_count_and_density():
    spec = PackingSpec("random-sequential", parse_radii("uniform:1:3"), Box((1.0, 1.0, 1.0)), 300, 0.25)
    packing = pack(spec, np.random.default_rng(241))
    assert (packing.count, packing.density) == (300, pytest.approx(0.25, rel=1e-12))


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        (PackingSpec("random-sequential", parse_radii("equal"), Box((1.0, 1.0)), 50, 0.8), "out of reach"),
        (PackingSpec("random-sequential", parse_radii("equal"), Box((1.0, 1.0))), "needs a count"),
        (PackingSpec("random-sequential", parse_radii("equal:0.6"), Box((1.0, 1.0))), "under one diameter"),
        (
            PackingSpec("random-sequential", parse_radii("equal:0.3"), Box((1.0, 1.0), (True, True))),
            "under two diameters",
        ),
    ],
)
def test_impossible_requests_are_refused_at_once(spec, message):
    with pytest.raises(InputError, match=message):
        pack(spec, np.random.default_rng(251))
