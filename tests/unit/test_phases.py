"""Media whose pores are resolved: what is refused, which particle holds a point, exact solid fractions."""

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.errors import GeometryError, InputError
from etc_engine.medium.medium import Medium, Pores
from etc_engine.medium.phases import PORE, check_phases, conductivity_at, contrast, count_overlaps, find_owners
from etc_engine.packing.particles import ParticlePacking


def disks(centers, radii, periodic=(True, True), lengths=(1.0, 1.0)):
    return ParticlePacking(centers, radii, Box(lengths, periodic))


@pytest.mark.parametrize(
    ("matrix", "inclusion", "words"),
    [
        (-1.0, 1.0, "pores must be finite and not negative, found -1"),
        (np.nan, 1.0, "pores must be finite"),
        (np.inf, 1.0, "pores must be finite"),
        (1.0, -2.0, "particle is -2: give a number"),
        (1.0, np.nan, "particle is nan: give a number"),
        (1.0, [1.0, 2.0, 3.0], r"shape \(2,\), found \(3,\)"),
        (0.0, 0.0, "neither the particles nor the pores conduct"),
    ],
)
def test_conductivities_that_make_no_medium_are_refused(matrix, inclusion, words):
    with pytest.raises(InputError, match=words):
        check_phases(Medium(disks([[0.2, 0.2], [0.7, 0.7]], [0.1, 0.1]), inclusion, pores=Pores(matrix)))


def test_inclusions_that_leave_no_matrix_are_refused():
    with pytest.raises(GeometryError, match="leave no pores"):
        check_phases(Medium(disks([[0.5, 0.5]], [0.8]), 2.0, pores=Pores(1.0)))


def test_a_point_belongs_to_the_inclusion_that_holds_it_through_periodic_faces():
    medium = Medium(disks([[0.05, 0.5], [0.5, 0.5]], [0.1, 0.2]), [3.0, 5.0], pores=Pores(1.0))
    points = np.array([[0.97, 0.5], [-0.03, 0.5], [0.94, 0.5], [0.5, 0.69], [0.5, 0.71]])
    assert find_owners(medium.packing, points).tolist() == [0, 0, PORE, 1, PORE]
    assert conductivity_at(medium, points).tolist() == [3.0, 3.0, 1.0, 5.0, 1.0]


def test_walls_repeat_nothing():
    medium = Medium(disks([[0.05, 0.5]], [0.1], (False, True)), 3.0, pores=Pores(1.0))
    assert find_owners(medium.packing, [[0.97, 0.5], [0.1, 0.5]]).tolist() == [PORE, 0]


def test_the_radical_line_divides_an_overlap():
    medium = Medium(disks([[0.3, 0.5], [0.6, 0.5]], [0.2, 0.15]), [3.0, 5.0], pores=Pores(1.0))
    radical = 0.3 + (0.3**2 + 0.2**2 - 0.15**2) / (2 * 0.3)
    points = np.array([[radical - 1e-6, 0.5], [radical + 1e-6, 0.5]])
    assert find_owners(medium.packing, points).tolist() == [0, 1]
    assert count_overlaps(medium.packing) == 1


def test_volume_fraction_counts_overlaps_once():
    rng = np.random.default_rng(97)
    medium = Medium(disks(rng.random((40, 2)), rng.uniform(0.05, 0.15, 40)), 2.0, pores=Pores(1.0))
    sampled = (find_owners(medium.packing, rng.random((200_000, 2))) != PORE).mean()
    spread = np.sqrt(medium.solid_fraction * (1.0 - medium.solid_fraction) / 200_000)
    assert abs(sampled - medium.solid_fraction) < 5.0 * spread


def test_contrast_is_the_range_of_ratios():
    pair = disks([[0.2, 0.2], [0.7, 0.7]], [0.1, 0.1])
    assert contrast(Medium(pair, [1.0, 8.0], pores=Pores(2.0))) == (0.5, 4.0)
    assert contrast(Medium(pair, 1.0, pores=Pores(0.0))) == (np.inf, np.inf)
