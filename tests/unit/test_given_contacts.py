"""Contacts that a DEM code found: widths from area and force, and the same network as from overlaps."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.errors import GeometryError, InputError
from etc_engine.laws.contact import Elastic
from etc_engine.medium.given_contacts import given_contacts, reach_of_contacts
from etc_engine.medium.medium import Medium
from etc_engine.medium.rules import overlap_contacts
from etc_engine.packing.particles import ParticlePacking
from etc_engine.realization import effective_conductivity


def chain() -> ParticlePacking:
    """Three spheres in a row that overlap each other, walls and, across y, nothing."""
    x = np.array([0.45, 1.35, 2.2])
    return ParticlePacking(np.stack([x, [0.5] * 3, [0.5] * 3], axis=1), [0.5] * 3, Box((2.6, 2.0, 2.0)))


def test_the_area_of_the_lens_gives_the_network_of_overlaps():
    packing = chain()
    network = overlap_contacts(packing)
    area = np.pi * (packing.radii[network.pairs[:, 0]] * np.sin(network.angles[:, 0])) ** 2
    rows = network.pairs[::-1, ::-1]  # in any order
    given = given_contacts(packing, rows, reach_of_contacts(packing, rows, area=area[::-1]))
    np.testing.assert_array_equal(given.pairs, network.pairs)
    np.testing.assert_allclose(given.angles, network.angles, rtol=1e-12)
    np.testing.assert_array_equal(given.wall_angles, network.wall_angles)
    whole, other = (effective_conductivity(Medium(packing, 1.0, links), axes=(0,)) for links in (network, given))
    assert other.tensor[0, 0] == pytest.approx(whole.tensor[0, 0], rel=1e-10)


def test_a_force_makes_the_contact_of_hertz():
    """Johnson 1985, 4.22: c^3 = 3 F R*/(4 E*); the tangential part of the force does not count."""
    packing = ParticlePacking([[0.5, 0.5, 0.5], [0.5, 0.5, 1.4]], [0.5, 0.5], Box((1.0, 1.0, 2.0)))
    material = Elastic(1e9, 0.3)
    modulus = 1e9 / (1 - 0.3**2) / 2
    rows = np.array([[0, 1]])
    reach = reach_of_contacts(packing, rows, force=np.array([[7.0, 0.0, -3.0]]), material=material)
    assert reach[0] == pytest.approx((3 * 3.0 * 0.25 / (4 * modulus)) ** (1 / 3), rel=1e-12)
    assert reach_of_contacts(packing, rows, force=np.array([3.0]), material=material)[0] == pytest.approx(reach[0])


def test_contacts_across_a_periodic_face():
    packing = ParticlePacking([[0.05, 0.5], [0.95, 0.5]], [0.06, 0.06], Box((1.0, 1.0), (True, True)))
    network = given_contacts(packing, np.array([[1, 0]]), np.array([0.01]))
    assert network.shifts.tolist() == [[-1, 0]]
    assert abs(network.branches[0, 0]) == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("rows", "reach", "words"),
    [
        ([[0, 3]], [0.1], "name the rows 0 to 3 of 3"),
        ([[0, 1]], [0.6], "as wide as their radii"),
        ([[0, 1], [1, 0]], [0.1, 0.1], "given twice"),
        ([[0, 1]], [np.nan], "must be a number"),
    ],
)
def test_contacts_that_cannot_be(rows, reach, words):
    with pytest.raises((InputError, GeometryError), match=words):
        given_contacts(chain(), np.array(rows), np.array(reach))


def test_what_is_missing_is_named():
    packing, rows = chain(), np.array([[0, 1]])
    with pytest.raises(InputError, match="needs Young's modulus"):
        reach_of_contacts(packing, rows, force=np.array([1.0]))
    with pytest.raises(InputError, match="give one of them"):
        reach_of_contacts(packing, rows)
