"""Structure statistics: lattices with known answers, ideal gases, closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from etc_engine.box import Box
from etc_engine.errors import InputError
from etc_engine.packing import PackingSpec, ParticlePacking, neighbor_pairs, pack, parse_radii
from etc_engine.packing.hard_spheres import make_gas, run, start_lists
from etc_engine.packing.lubachevsky_stillinger import compress
from etc_engine.structure.statistics import (
    contact_directions,
    contact_half_angles,
    coordination_numbers,
    fabric_tensor,
    few_contacts,
    find_rattlers,
    largest_cluster,
    pair_correlation,
    two_point_probability,
)
from etc_engine.structure.union import solid_fraction


@pytest.fixture(scope="module")
def hexagonal():
    """12 x 8 tangent disks on the triangular lattice, periodic."""
    x, y = np.meshgrid(np.arange(12), np.arange(8))
    centers = np.column_stack(((x + 0.5 * (y % 2)).ravel(), (y * np.sqrt(3) / 2).ravel()))
    return ParticlePacking(centers, np.full(96, 0.5), Box((12.0, 8 * np.sqrt(3) / 2), (True, True)))


def test_hexagonal_lattice(hexagonal):
    contacts = neighbor_pairs(hexagonal, relative_gap=1e-9)
    np.testing.assert_array_equal(coordination_numbers(hexagonal, contacts), 6)
    np.testing.assert_allclose(fabric_tensor(hexagonal, contacts), np.eye(2) / 2, atol=1e-12)
    assert not find_rattlers(hexagonal, contacts).any()
    angles = np.degrees(np.arctan2(*contact_directions(hexagonal, contacts).T[::-1])) % 180
    np.testing.assert_allclose(np.sort(np.unique(np.rint(angles % 180))), [0, 60, 120])


def test_half_angles_of_the_overlapping_lattice(hexagonal):
    grown = hexagonal.with_radii(np.full(96, 0.5 / np.cos(np.radians(10.0))))
    np.testing.assert_allclose(np.degrees(contact_half_angles(grown)), 10.0, rtol=1e-12)
    assert contact_half_angles(grown).shape == (3 * 96, 2)


def test_rattlers_come_off_one_after_another():
    """A rhombus of disks, a chain on one end of it, a free disk: each loses its hold in turn."""
    s = np.sqrt(3) / 2
    core = np.array([[5.0, 5.0], [6.0, 5.0], [5.5, 5 + s], [5.5, 5 - s]])
    chain = np.array([[7.0, 5.0], [8.0, 5.0]])
    packing = ParticlePacking(np.vstack((core, chain, [[2.0, 2.0]])), np.full(7, 0.5), Box((20.0, 20.0)))
    contacts = neighbor_pairs(packing, relative_gap=1e-9)
    assert find_rattlers(packing, contacts).all()
    walled = ParticlePacking([[0.5, 0.5], [1.5, 0.5]], [0.5, 0.5], Box((2.0, 1.0)))
    assert not find_rattlers(walled, neighbor_pairs(walled)).any()


def test_jammed_disks_are_isostatic_without_rattlers():
    """Frictionless disks hold each other with Z = 2 d contacts each: counting of forces, no fit."""
    rng = np.random.default_rng(811)
    radii = np.where(rng.random(200) < 0.5, 1.0, 1.4)
    box = Box((1.0, 1.0), (True, True))
    jammed = compress(radii, box, rng, growth_rate=0.01, jammed=1e7).packing
    contacts = neighbor_pairs(jammed, relative_gap=1e-5)
    rattlers = find_rattlers(jammed, contacts)
    assert 0.0 < rattlers.mean() < 0.15
    backbone = ~rattlers[contacts.pairs].any(axis=1)
    assert 2.0 * backbone.sum() / (~rattlers).sum() == pytest.approx(4.0, abs=0.1)


@pytest.mark.parametrize(
    "box", [Box((1.0, 0.8), (True, True)), Box((1.0, 0.8)), Box((0.9, 1.0, 0.8)), Box((0.9, 1.0, 0.8), (True,) * 3)]
)
def test_pair_correlation_of_an_ideal_gas_is_one(box):
    rng = np.random.default_rng(821)
    g = []
    for _ in range(30):
        centers = rng.random((1000, box.dimension)) * box.lengths
        g.append(pair_correlation(ParticlePacking(centers, np.full(1000, 1e-4), box), 0.3, 10).values)
    standard_error = np.std(g, axis=0, ddof=1) / np.sqrt(len(g))
    assert (np.abs(np.mean(g, axis=0) - 1.0) < 4.5 * standard_error).all()
    assert standard_error[-1] < 0.01


def test_pair_correlation_extrapolates_to_the_contact_value():
    """Carnahan-Starling at solid fraction 0.3: chi = 2.48, after an equilibration without growth."""
    box, count = Box((1.0, 1.0, 1.0), (True,) * 3), 8000
    rng = np.random.default_rng(823)
    start = compress(np.ones(count), box, rng, density=0.3, growth_rate=0.2).packing
    radius = float(start.radii[0])
    gas = make_gas(start.centers, rng.standard_normal((count, 3)), np.ones(count), box, radius, 0.5, 60)
    assert start_lists(gas, radius, 0.0, 0.5)
    run(gas, radius, 0.0, 0.5, np.inf, 15 * count)
    fluid = ParticlePacking(gas.state[:, :3], start.radii, box)
    g = pair_correlation(fluid, 2.8 * radius, 56)
    near = g.distances > 2.0 * radius
    fit = np.polyfit(g.distances[near] / (2.0 * radius) - 1.0, g.values[near], 2)
    assert np.polyval(fit, 0.0) == pytest.approx((1.0 - 0.15) / 0.7**3, rel=0.04)
    assert (g.values[g.distances < 1.94 * radius] == 0.0).all()


@settings(max_examples=10, deadline=None)
@given(radius=st.floats(0.1, 0.3))
def test_two_point_probability_of_one_periodic_disk(radius):
    """Inside one disk and none of its images: the lens of two disks at distance r (r + 2 R < 1)."""
    packing = ParticlePacking([[0.3, 0.6]], [radius], Box((1.0, 1.0), (True, True)))
    s2 = two_point_probability(packing, 0.9 * min(2 * radius, 1 - 2 * radius) / 2, 1000)
    r = s2.distances / (2 * radius)
    lens = 2 * radius**2 * (np.arccos(r) - r * np.sqrt(1 - r * r))
    np.testing.assert_allclose(s2.values, lens, atol=2e-3)


@pytest.mark.parametrize("flags", [(True, True), (False, False), (False, True)])
def test_two_point_probability_tends_to_the_square(flags):
    rng = np.random.default_rng(831)
    box = Box((1.0, 0.8), flags)
    packing = ParticlePacking(rng.random((3000, 2)) * box.lengths, np.full(3000, 0.01), box)
    phi = solid_fraction(packing)
    s2 = two_point_probability(packing, 0.3, 1500)
    assert s2.values[0] == pytest.approx(phi, abs=2e-3)
    assert s2.values[s2.distances > 0.05].mean() == pytest.approx(phi**2, abs=0.01)


def test_two_point_probability_of_a_sphere_starts_at_its_share():
    packing = ParticlePacking([[0.5, 0.5, 0.5]], [0.4], Box((1.0, 1.0, 1.0)))
    assert two_point_probability(packing, 0.1, 100).values[0] == pytest.approx(4 / 3 * np.pi * 0.4**3, rel=2e-3)


def test_senseless_requests_are_refused(hexagonal):
    with pytest.raises(InputError, match="half the shortest edge"):
        pair_correlation(hexagonal, 5.0)
    with pytest.raises(InputError, match="half the shortest edge"):
        two_point_probability(hexagonal, 0.0)
    alone = ParticlePacking([[0.5, 0.5]], [0.1], Box((1.0, 1.0)))
    with pytest.raises(InputError, match="at least two particles"):
        pair_correlation(alone, 0.2)
    with pytest.raises(InputError, match="at least one contact"):
        fabric_tensor(alone, neighbor_pairs(alone))


def test_a_connected_packing_of_few_contacts_is_not_all_rattlers():
    spec = PackingSpec("advancing-front", parse_radii("uniform:0.01:0.02"), Box((1.0, 1.0)))
    packing = pack(spec, np.random.default_rng(20261))
    contacts = neighbor_pairs(packing, relative_gap=1e-6)
    assert largest_cluster(packing, contacts).mean() > 0.95
    numbers = coordination_numbers(packing, contacts)
    few = few_contacts(packing, contacts)
    assert 0.0 < few.mean() < 0.3
    assert not few[numbers >= 3].any()


def test_two_point_probability_off_the_walls_tends_to_the_square():
    spec = PackingSpec("advancing-front", parse_radii("uniform:0.01:0.02"), Box((1.5, 1.5)))
    packing = pack(spec, np.random.default_rng(20261))
    whole = two_point_probability(packing, 0.3, 1200)
    inside = two_point_probability(packing, 0.3, 1200, margin=0.06)
    far = inside.distances > 0.2
    limit, wrong = inside.values[0] ** 2, whole.values[0] ** 2
    assert abs(inside.values[far].mean() / limit - 1.0) < 0.003
    assert abs(whole.values[far].mean() / wrong - 1.0) > 0.003  # what the figure drew
    with pytest.raises(InputError, match="leaves nothing"):
        two_point_probability(packing, 0.1, 100, margin=0.8)
