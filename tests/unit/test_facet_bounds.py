"""Facet links where spheres and fluid are nearly alike: the exact limit, and voxels as an independent method."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine import Box, Medium, Pores, bonded_contacts, effective_conductivity
from etc_engine.engines.dtem.facet_bounds import held_between_bounds
from etc_engine.engines.voxel import homogenize_voxel
from etc_engine.medium.conductivity import EffectiveConductivity
from etc_engine.medium.sample_warnings import excess_warnings
from etc_engine.models.bounds import hashin_shtrikman_lower, hashin_shtrikman_upper
from etc_engine.packing import ParticlePacking
from etc_engine.packing.lubachevsky_stillinger import compress


@pytest.fixture(scope="module")
def packings():
    rng = np.random.default_rng(2273)
    return [
        compress(rng.uniform(0.7, 1.0, 24), Box((1.0,) * 3, (flag,) * 3), rng, density=0.45).packing
        for flag in (True, False)
    ]


def facets(packing, conductivity, pores=1.0, network=None):
    return effective_conductivity(Medium(packing, conductivity, network, Pores(pores)), method="facets").tensor


@pytest.mark.parametrize("pores", [1.0, 0.9])
def test_spheres_like_the_fluid_make_no_difference(packings, pores):
    """Exact at equal conductivities; to first order k = k_f + f (k_s - k_f)."""
    for packing in packings:
        f = Medium(packing, 1.0).solid_fraction
        assert np.diag(facets(packing, pores, pores)) == pytest.approx(pores, rel=1e-12)
        for delta in (1e-3, 1e-2):
            k = np.diag(facets(packing, pores * (1.0 + delta), pores)) / pores
            assert np.abs(k - (1.0 + f * delta)).max() < 0.5 * delta**2


def test_off_the_diagonal_nothing_is_left_at_equal_conductivities(packings):
    np.testing.assert_allclose(facets(packings[0], 1.0), np.eye(3), atol=1e-12)


@pytest.mark.parametrize("contrast", [1.1, 1.3])
def test_voxels_agree_at_low_contrast(packings, contrast):
    """Without the bounds facet links are 1 % low here."""
    medium = Medium(packings[0], contrast, pores=Pores(1.0))
    voxel = homogenize_voxel(medium, resolution=32, estimate_error=False).tensor
    assert np.trace(facets(packings[0], contrast)) == pytest.approx(np.trace(voxel), rel=1e-3)


def test_a_mean_below_hashin_and_shtrikman_is_lifted_and_others_stay(packings):
    medium = Medium(packings[0], 1.5, pores=Pores(1.0))
    f = medium.solid_fraction
    low, high = hashin_shtrikman_lower(1.0, 1.5, f, dimension=3), hashin_shtrikman_upper(1.0, 1.5, f, dimension=3)

    def held(*along):
        return held_between_bounds(EffectiveConductivity(np.diag(along), (True,) * 3, 0, 0, 0.0, ()), medium).tensor

    np.testing.assert_allclose(held(*[0.98 * low] * 3), low * np.eye(3), rtol=1e-12)
    inside = [0.5 * (low + high)] * 3
    np.testing.assert_array_equal(held(*inside), np.diag(inside))
    lifted = np.diag(held(0.97 * low, 0.98 * low, 0.99 * low))
    m, harmonic = 1.0 + 0.5 * f, 1.0 / (f / 1.5 + 1.0 - f)
    assert (1.0 / (lifted - 1.0)).sum() == pytest.approx(1.0 / (harmonic - 1.0) + 2.0 / (m - 1.0), rel=1e-9)


def test_no_bound_is_used_where_none_holds(packings):
    """Radiation passes the pores beside conduction; bonds add solid that the fraction does not count."""
    packing = packings[0]
    glowing = effective_conductivity(Medium(packing, 1.0, pores=Pores(1.0, radiation=50.0)), method="facets")
    assert np.diag(glowing.tensor).min() > 1.0
    network = bonded_contacts(packing, 0.6, 0.1)
    bonded, loose = (np.trace(facets(packing, 1.3, 1.0, n)) for n in (network, None))
    assert bonded >= loose * (1.0 - 1e-9)


def test_the_warning_of_an_excess_names_what_can_be_wrong():
    """At equal conductivities a method that errs by .2 % says nothing of walls or contacts."""
    assert excess_warnings(1.002 * np.eye(3), np.ones(4), Pores(1.0)) == []
    assert excess_warnings(1.02 * np.eye(3), np.ones(4), Pores(1.0), error=0.03) == []
    (line,) = excess_warnings(1.02 * np.eye(3), np.ones(4), Pores(1.0))
    assert "exceeds that of the best conductor of the sample, 1: the method errs here" in line
    assert excess_warnings(1.02 * np.eye(3), np.ones(4), Pores(1.0, radiation=1.0)) == []
    (line,) = excess_warnings(1.02 * np.eye(3), np.ones(4))
    assert "walls or contacts go through particles" in line
    assert excess_warnings(0.9 * np.eye(3), np.ones(4)) == []


def test_a_simple_cubic_array_stays_where_it_was():
    """Far from equal conductivities no bound is near."""
    one = ParticlePacking([[0.5] * 3], [0.49], Box((1.0,) * 3, (True,) * 3))
    medium = Medium(one, 20.0, pores=Pores(1.0))
    result = effective_conductivity(medium, method="facets")
    assert held_between_bounds(result, medium) is result
