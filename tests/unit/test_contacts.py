from __future__ import annotations

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.errors import GeometryError, InputError
from etc_engine.medium.rules import bonded_contacts, coordination_contacts, overlap_contacts, radius_contacts
from etc_engine.packing.particles import ParticlePacking

UNIT = Box((1.0, 1.0))


def test_overlap_angles_are_those_of_the_common_chord():
    packing = ParticlePacking([[0.3, 0.5], [0.62, 0.5]], [0.25, 0.1], UNIT)
    network = overlap_contacts(packing)
    half_chord = packing.radii * np.sin(network.angles[0])
    assert half_chord[0] == pytest.approx(half_chord[1], rel=1e-12)
    assert (packing.radii * np.cos(network.angles[0])).sum() == pytest.approx(0.32, rel=1e-12)


def test_wall_cuts_have_the_angle_of_their_distance():
    network = overlap_contacts(ParticlePacking([[0.1, 0.5], [0.5, 0.96]], [0.11, 0.05], UNIT))
    assert network.walls.tolist() == [0, 3]
    np.testing.assert_allclose(np.cos(network.wall_angles), [0.1 / 0.11, 0.04 / 0.05], rtol=1e-12)


def test_slight_overlaps_keep_their_digits():
    overlap = 1e-9
    network = overlap_contacts(ParticlePacking([[0.3, 0.5], [0.7, 0.5]], [0.2 + overlap / 2] * 2, UNIT))
    assert network.angles[0, 0] == pytest.approx(np.sqrt(overlap / 0.2), rel=1e-6)


def test_round_off_of_a_tangency_is_no_overlap_contact():
    packing = ParticlePacking([[0.2, 0.5], [0.6, 0.5]], [0.2 * (1 + 1e-14)] * 2, UNIT)
    network = overlap_contacts(packing)
    assert network.count == 0
    assert network.walls.size == 0
    assert bonded_contacts(packing, 0.1).count == 1


def test_bonds_reach_as_far_as_their_gap():
    packing = ParticlePacking([[0.2, 0.5], [0.6 + 1e-4, 0.5]], [0.2, 0.2], UNIT)
    assert bonded_contacts(packing, 0.1, bond_gap=4e-4).count == 0
    network = bonded_contacts(packing, 0.1, bond_gap=6e-4)
    assert network.count == 1
    np.testing.assert_array_equal(network.angles, [[0.1, 0.1]])


def test_other_half_angles_keep_the_contacts():
    network = bonded_contacts(ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], UNIT), 0.1)
    other = network.with_half_angle(0.2)
    assert other.pairs is network.pairs
    assert set(other.angles.ravel()) | set(other.wall_angles) == {0.2}


def test_coincident_centres_and_swallowed_disks_are_refused():
    with pytest.raises(GeometryError, match="particles 0 and 1: one lies inside the other"):
        overlap_contacts(ParticlePacking([[0.5, 0.5], [0.5, 0.5]], [0.1, 0.1], UNIT))
    with pytest.raises(GeometryError, match="one lies inside the other"):
        overlap_contacts(ParticlePacking([[0.5, 0.5], [0.55, 0.5]], [0.2, 0.1], UNIT))


def test_a_half_angle_of_90_degrees_is_refused():
    with pytest.raises(GeometryError, match=r"particle 1 overlaps particle 0 .* must be below 90"):
        overlap_contacts(ParticlePacking([[0.4, 0.5], [0.58, 0.5]], [0.2, 0.05], UNIT))


@pytest.mark.parametrize("angle", [0.0, -0.1, np.pi / 2, 2.0, np.nan])
def test_bonded_half_angles_out_of_range_are_refused(angle):
    with pytest.raises(InputError, match="between 1e-06 and 90 degrees"):
        bonded_contacts(ParticlePacking([[0.5, 0.5]], [0.1], UNIT), angle)


@pytest.mark.parametrize("gap", [-1e-9, np.nan, np.inf])
def test_bad_bond_gaps_are_refused(gap):
    with pytest.raises(InputError, match="bond gap"):
        bonded_contacts(ParticlePacking([[0.5, 0.5]], [0.1], UNIT), 0.1, gap)


@pytest.mark.parametrize("wanted", [2.0, 3.5, 4.0])
def test_closest_pairs_give_the_coordination_number_wanted(wanted):
    rng = np.random.default_rng(51)
    centers = rng.random((300, 2))
    packing = ParticlePacking(centers, rng.uniform(0.001, 0.003, 300), Box((1.0, 1.0), (True, True)))
    with pytest.raises(InputError, match="out of reach"):
        coordination_contacts(packing, 0.1, wanted)
    bigger = packing.with_radii(np.full(300, 0.016))  # of one size, none lies inside another
    network = coordination_contacts(bigger, 0.1, wanted)
    assert network.coordination == pytest.approx(wanted, abs=1.0 / 300)


@pytest.mark.parametrize("wanted", [0.0, -1.0, np.nan, np.inf])
def test_senseless_coordination_numbers_are_refused(wanted):
    with pytest.raises(InputError, match="coordination number must be positive"):
        coordination_contacts(ParticlePacking([[0.5, 0.5]], [0.1], UNIT), 0.1, wanted)


@pytest.mark.parametrize("degrees", [0.0, 1e-320, 9e-7, 90.0, float("nan")])
def test_half_angles_outside_their_range_are_refused(degrees):
    packing = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    with pytest.raises(InputError, match="between 1e-06 and 90 degrees"):
        bonded_contacts(packing, float(np.radians(degrees)))
    with pytest.raises(InputError):
        radius_contacts(packing, 0.25 * float(np.sin(np.radians(degrees))))
    assert bonded_contacts(packing, float(np.radians(1e-6))).count == 1
