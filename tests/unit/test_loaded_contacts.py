"""Contact rules from load in 2D and 3D: widths, softened runs, walls of their own, roughness, refusals."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.errors import GeometryError, InputError
from etc_engine.laws.contact import mean_field_force, mean_field_line_force, radius_from_force
from etc_engine.laws.roughness import Roughness
from etc_engine.medium.loaded import (
    Stiffness,
    area_contacts,
    force_contacts,
    hertz_contacts,
    load_contacts,
    with_roughness,
)
from etc_engine.medium.rules import RULES, overlap_contacts
from etc_engine.medium.touching import find_neighbors
from etc_engine.packing.particles import ParticlePacking

CERAMIC = {"youngs_modulus": 90e9, "poisson_ratio": 0.24}


def pair(dimension, delta=1e-6, r1=5e-4, r2=3e-4):
    """Two particles that overlap by delta, away from the walls."""
    middle = [5e-3] * (dimension - 1)
    centers = [[4e-3, *middle], [4e-3 + r1 + r2 - delta, *middle]]
    return ParticlePacking(centers, [r1, r2], Box((1e-2,) * dimension))


def cube(dimension, n=3, radius=0.5e-3, periodic=True):
    """Square or simple cubic array of touching particles."""
    axes = np.meshgrid(*[np.arange(n)] * dimension, indexing="ij")
    centers = (np.stack(axes, axis=-1).reshape(-1, dimension) + 0.5) * 2.0 * radius
    return ParticlePacking(
        centers, np.full(len(centers), radius), Box((2 * n * radius,) * dimension, (periodic,) * dimension)
    )


def widths(network):
    return network.packing.radii[network.pairs] * np.sin(network.angles)


@pytest.mark.parametrize("dimension", [2, 3])
def test_hertz_from_the_overlap(dimension):
    """c = sqrt(R* delta) on both sides, sqrt(2) narrower than the lens."""
    network = hertz_contacts(pair(dimension))
    expected = np.sqrt(1.0 / (1.0 / 5e-4 + 1.0 / 3e-4) * 1e-6)
    np.testing.assert_allclose(widths(network), [[expected, expected]], rtol=1e-9)
    lens = widths(overlap_contacts(pair(dimension)))
    np.testing.assert_allclose(lens / expected, np.sqrt(2.0), rtol=2e-3)
    assert network.rule == "hertz" and network.coordination == 1.0


@pytest.mark.parametrize(("dimension", "power"), [(2, 1 / 2), (3, 1 / 3)])
def test_a_softened_run_gives_the_width_of_the_true_material(dimension, power):
    soft = hertz_contacts(pair(dimension), **CERAMIC, simulated_modulus=90e6)
    np.testing.assert_allclose(widths(soft) / widths(hertz_contacts(pair(dimension))), 1e-3**power, rtol=1e-9)


def test_walls_may_have_constants_of_their_own():
    """A soft wall takes more of the width: c ~ (E_run*/E*)^(1/3) at the wall."""
    one = ParticlePacking([[5e-3, 5e-3, 5e-4 - 1e-7]], [5e-4], Box((1e-2,) * 3))
    same = hertz_contacts(one, **CERAMIC, simulated_modulus=90e6)
    rubber = hertz_contacts(one, **CERAMIC, simulated_modulus=90e6, wall_youngs_modulus=1e9)
    assert same.walls.tolist() == [4] == rubber.walls.tolist()
    e = 90e9 / (1.0 - 0.24**2)
    wall = 1.0 / (1.0 / e + (1.0 - 0.24**2) / 1e9)
    ratio = np.sin(rubber.wall_angles) / np.sin(same.wall_angles)
    np.testing.assert_allclose(ratio, (0.5 * e / wall) ** (1.0 / 3.0), rtol=1e-9)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("periodic", [True, False])
def test_load_is_the_virial_of_equal_forces(dimension, periodic):
    packing = cube(dimension, periodic=periodic)
    network = load_contacts(packing, 1e6, **CERAMIC, bond_gap=1e-6)
    modulus = 0.5 * 90e9 / (1.0 - 0.24**2)
    if dimension == 3:
        force = mean_field_force(1e6, 0.5e-3, np.pi / 6.0, 6.0)
        expected = radius_from_force(force, 0.25e-3, modulus)
    else:
        force = mean_field_line_force(1e6, 0.5e-3, np.pi / 4.0, 4.0)
        expected = np.sqrt(4.0 * force * 0.25e-3 / (np.pi * modulus))
    np.testing.assert_allclose(widths(network), expected, rtol=1e-9)


def test_load_takes_the_closest_pairs_of_a_coordination():
    rng = np.random.default_rng(61)
    x = rng.uniform(0.0, 1.2e-3, (60, 3))
    packing = ParticlePacking(x, np.full(60, 1e-4), Box((1.2e-3,) * 3, (True,) * 3))
    network = load_contacts(packing, 1e5, **CERAMIC, coordination=4.0)
    assert network.coordination == pytest.approx(4.0) and network.rule == "load"


def test_forces_of_a_run():
    packing = pair(3)
    near = find_neighbors(packing, 1e-2)
    network = force_contacts(near, [2.0], Stiffness(**CERAMIC))
    expected = radius_from_force(2.0, 1.0 / (1.0 / 5e-4 + 1.0 / 3e-4), 0.5 * 90e9 / (1.0 - 0.24**2))
    np.testing.assert_allclose(widths(network), expected, rtol=1e-12)
    assert force_contacts(near, [-2.0], Stiffness(**CERAMIC)).count == 0
    hertz = hertz_contacts(packing)
    again = force_contacts(
        near,
        [4.0 / 3.0 * 0.5 * 90e9 / (1.0 - 0.24**2) * np.sqrt(1.0 / (1.0 / 5e-4 + 1.0 / 3e-4)) * 1e-6**1.5],
        Stiffness(**CERAMIC),
    )
    np.testing.assert_allclose(widths(again), widths(hertz), rtol=1e-9)


def test_areas_of_a_run():
    near = find_neighbors(pair(3), 1e-2)
    network = area_contacts(near, [np.pi * 1e-10])
    np.testing.assert_allclose(widths(network), 1e-5, rtol=1e-12)
    np.testing.assert_allclose(widths(area_contacts(near, [np.pi * 1e-10], softening=1e-3)), 1e-6, rtol=1e-12)
    with pytest.raises(InputError, match="two dimensions"):
        area_contacts(find_neighbors(pair(2), 1e-2), [1.0])


@pytest.mark.parametrize("dimension", [2, 3])
def test_roughness_is_an_area_resistance_under_the_pressure_of_each_contact(dimension):
    network = load_contacts(cube(dimension), 1e6, **CERAMIC)
    stiff, k = Stiffness(**CERAMIC), np.full(network.packing.count, 2.4)
    smooth = with_roughness(network, Roughness(0.0, 0.1, hardness=4e9), stiff, k)
    assert (smooth.resistances == 0.0).all()
    rough = with_roughness(network, Roughness(1e-6, 0.1, hardness=4e9), stiff, k)
    c = widths(network)[0, 0]
    if dimension == 3:
        spot, force = np.pi * c**2, mean_field_force(1e6, 0.5e-3, np.pi / 6.0, 6.0)
    else:
        spot, force = 2.0 * c, mean_field_line_force(1e6, 0.5e-3, np.pi / 4.0, 4.0)
    expected = 1.0 / (1.25 * 2.4 * 0.1 / 1e-6 * (force / spot / 4e9) ** 0.95) / spot
    np.testing.assert_allclose(rough.resistances, expected, rtol=1e-9)
    gas = with_roughness(network, Roughness(1e-6, 0.1, hardness=4e9), stiff, k, (0.3, 0.0))
    assert (gas.resistances < rough.resistances).all()


def test_units_drop_out():
    """Lengths and stresses in other units: the same half-angles."""
    metres = load_contacts(cube(3), 1e6, **CERAMIC)
    in_mm = ParticlePacking(cube(3).centers * 1e3, cube(3).radii * 1e3, Box((3.0,) * 3, (True,) * 3))
    millimetres = load_contacts(in_mm, 1.0, youngs_modulus=90e3, poisson_ratio=0.24)
    np.testing.assert_allclose(millimetres.angles, metres.angles, rtol=1e-10)


def test_the_rows_take_the_words_of_a_study():
    found = RULES["hertz"].contacts(pair(3), **CERAMIC, simulated_modulus=1e9)
    assert found.rule == "hertz"
    assert set(RULES["load"].keys) >= {"load", "youngs_modulus", "poisson_ratio", "bond_gap", "coordination"}


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: hertz_contacts(pair(3), simulated_modulus=1e9), InputError, "needs the youngs_modulus"),
        (lambda: load_contacts(cube(3), 0.0, **CERAMIC), InputError, "must be positive"),
        (lambda: load_contacts(pair(3, delta=-1e-4), 1e5, **CERAMIC), InputError, "nothing carries the load"),
        (lambda: load_contacts(cube(3), 1e5, youngs_modulus=-1.0, poisson_ratio=0.2), InputError, "Young's modulus"),
        (lambda: load_contacts(cube(3), 1e5, youngs_modulus=1.0, poisson_ratio=0.2), GeometryError, "as wide as"),
        (lambda: load_contacts(cube(3), 1e5, youngs_modulus=1e9, poisson_ratio=0.7), InputError, "Poisson's ratio"),
        (
            lambda: force_contacts(find_neighbors(pair(3), 1e-2), [1.0, 2.0], Stiffness(**CERAMIC)),
            InputError,
            "one force for each of 1 contacts",
        ),
        (
            lambda: force_contacts(find_neighbors(pair(3), 1e-2), [np.nan], Stiffness(**CERAMIC)),
            InputError,
            "not finite",
        ),
    ],
)
def test_refusals(make, error, message):
    with pytest.raises(error, match=message):
        make()
