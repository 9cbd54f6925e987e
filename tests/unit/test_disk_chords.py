"""Modes of close contacts in method ``chord`` of disks."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.engines.dtem.conductivity import element_conductivity
from etc_engine.laws.disk import chord_resistance, mutual_resistance
from etc_engine.laws.disk_chords import closeness, lune_resistance, resistance_matrices, segment_conductance
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import bonded_contacts, overlap_contacts
from etc_engine.packing import PackingSpec, pack
from etc_engine.packing.particles import ParticlePacking
from etc_engine.packing.radii import parse_radii


def matrix(theta, alpha, cutting=None):
    theta, alpha = np.asarray(theta, dtype=float), np.broadcast_to(np.asarray(alpha, dtype=float), len(theta)).copy()
    arms = np.stack([np.cos(theta), np.sin(theta)], axis=1)
    return resistance_matrices(np.array([0, theta.size]), arms, alpha, "chord", cutting).reshape(theta.size, -1)


def test_contacts_that_stand_apart_keep_the_resistances_of_uniform_arcs():
    theta, alpha = np.array([0.0, 2.0, 4.1]), np.array([0.1, 0.2, 0.15])
    expected = mutual_resistance(theta[:, None] - theta + np.eye(3), alpha[:, None], alpha)
    np.fill_diagonal(expected, chord_resistance(alpha))
    np.testing.assert_allclose(matrix(theta, alpha), expected, rtol=1e-12)


def test_it_turns_and_mirrors_with_the_contacts():
    theta, alpha = np.array([0.0, 0.9, 1.9, 3.4, 4.5]), np.array([0.3, 0.4, 0.45, 0.5, 0.35])
    h = matrix(theta, alpha)
    np.testing.assert_allclose(h, h.T, rtol=1e-14)
    np.testing.assert_allclose(matrix(theta + 1.234, alpha), h, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(matrix(-theta, alpha), h, rtol=1e-12, atol=1e-14)
    order = np.array([3, 0, 4, 1, 2])
    np.testing.assert_allclose(matrix(theta[order], alpha[order]), h[np.ix_(order, order)], rtol=1e-12, atol=1e-14)


def test_contacts_without_heat_cut_nothing():
    """A contact that does not cut changes nothing between the others."""
    theta, cutting = np.arange(6) * np.pi / 3.0, np.array([True, True, True, True, True, False])
    np.testing.assert_allclose(matrix(theta, 0.45, cutting)[:5, :5], matrix(theta[:5], 0.45), rtol=1e-12)


@pytest.mark.parametrize("degrees", [30.0, 40.0, 44.0])
def test_square_lattice_of_wide_contacts(degrees):
    """Four contacts: the exact element agrees where w is 1, and the old resistances were 2.7 to 20 % off."""
    disk = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0), (True, True)))
    medium = medium_of(bonded_contacts(disk, np.radians(degrees)))
    chord, exact = (element_conductivity(medium, method=method) for method in ("chord", "exact"))
    error = abs(chord.tensor[0, 0] / exact.tensor[0, 0] - 1.0)
    assert error < min(1e-2 if degrees > 40.0 else 1e-3, chord.model_error)


def test_weight_rises_with_the_crowding():
    theta, offsets = np.arange(6) * np.pi / 3.0, np.array([0, 6])
    weights = [
        float(closeness(offsets, theta, np.full(6, np.radians(degrees)), np.ones(6, dtype=bool))[0])
        for degrees in (5.0, 10.0, 15.0, 18.0, 20.0, 25.0)
    ]
    assert (np.diff(weights) > 0.0).all()
    assert weights[1] < 1e-5
    assert weights[2] < 0.03
    assert weights[4] > 0.99


def test_segment_and_lune_in_their_limits():
    """L = 2a/3 - 2a^3/45 of a flat segment; r = ln(2/a)/pi of a narrow chord."""
    assert segment_conductance(1e-4) == pytest.approx(2e-4 / 3.0, rel=1e-6)
    assert lune_resistance(1e-5) == pytest.approx(np.log(2e5) / np.pi, rel=1e-6)
    a = 0.3  # the series of tanh: 2a/3 - 2a^3/45 + ...; a thin segment conducts a little less than its area
    assert segment_conductance(a) == pytest.approx(2.0 * a / 3.0 - 2.0 * a**3 / 45.0, rel=1e-3)


@pytest.mark.parametrize("seed", [71, 72, 73])
@pytest.mark.parametrize("growth", [1.003, 1.01, 1.02])
def test_random_overlapping_packings_stay_within_a_fifth_of_a_percent(seed, growth):
    packed = pack(
        PackingSpec("advancing-front", parse_radii("uniform:0.03:0.06"), Box((1.0, 1.0))), np.random.default_rng(seed)
    )
    medium = medium_of(overlap_contacts(ParticlePacking(packed.centers, packed.radii * growth, packed.box)))
    chord, exact = (element_conductivity(medium, method=method, axes=(0,)) for method in ("chord", "exact"))
    assert abs(chord.tensor[0, 0] / exact.tensor[0, 0] - 1.0) < min(2e-3, chord.model_error)
