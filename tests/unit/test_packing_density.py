"""Density control by vacancies and radius growth."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.errors import InputError, PackingError
from etc_engine.packing.advancing_front import pack_advancing_front
from etc_engine.packing.density import set_density
from etc_engine.packing.radii import parse_radii


@pytest.fixture(scope="module")
def packing():
    return pack_advancing_front(parse_radii("uniform:0.02:0.04"), Box((1.0, 1.0)), np.random.default_rng(311))


@pytest.mark.parametrize("density", [0.7, 0.5, 0.2])
def test_vacancies_come_within_half_a_particle(packing, density):
    thinned = set_density(packing, density, np.random.default_rng(5))
    assert abs(thinned.density - density) <= 0.5 * packing.measures.max() / packing.box.volume
    rows = [int(np.flatnonzero((packing.centers == center).all(axis=1))[0]) for center in thinned.centers]
    assert rows == sorted(set(rows))
    np.testing.assert_array_equal(packing.radii[rows], thinned.radii)


def test_vacancies_leave_the_sizes_unbiased(packing):
    means = [set_density(packing, 0.4, np.random.default_rng(900 + k)).radii.mean() for k in range(200)]
    standard_error = np.std(means) / np.sqrt(len(means))
    assert abs(np.mean(means) - packing.radii.mean()) < 4 * standard_error


def test_growth_meets_the_density_with_one_factor(packing):
    grown = set_density(packing, 0.9, np.random.default_rng(5))
    assert grown.density == pytest.approx(0.9, rel=1e-14)
    np.testing.assert_allclose(grown.radii / packing.radii, np.sqrt(0.9 / packing.density), rtol=1e-14)


def test_growth_is_refused_with_the_own_density(packing):
    with pytest.raises(PackingError, match=r"above the packing's own 0\.7") as refusal:
        set_density(packing, 0.9, np.random.default_rng(5), growth_allowed=False)
    assert refusal.value.reached == packing.density


@pytest.mark.parametrize("density", [0.0, -1.0, np.nan])
def test_a_senseless_density_is_refused(packing, density):
    with pytest.raises(InputError, match="must be positive and finite"):
        set_density(packing, density, np.random.default_rng(5))
