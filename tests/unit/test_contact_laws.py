"""Contact radius from load, and the resistance of rough contacts: published values and limits."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.errors import InputError
from etc_engine.laws.contact import (
    Elastic,
    effective_modulus,
    effective_radius,
    half_width_from_force,
    hertz_force,
    hertz_radius,
    line_force,
    mean_field_force,
    mean_field_line_force,
    mean_pressure,
    pair_modulus,
    radius_from_area,
    radius_from_force,
    reach_from_force,
    reach_from_overlap,
    softening_factor,
)
from etc_engine.laws.roughness import Roughness, area_resistance, micro_gap_conductance, solid_spot_conductance


def test_sphere_on_a_rigid_plane_published():
    """Sphere of 8 mm, E = 1000 N/mm2, nu = 0.3, 60 pi N on a rigid plane: a = 1.010 mm (FE benchmark)."""
    modulus = 1e9 / (1.0 - 0.3**2)
    radius = effective_radius(8e-3, np.inf)
    assert 1e3 * radius_from_force(60.0 * np.pi, radius, modulus) == pytest.approx(1.010, abs=5e-4)


def test_two_spheres_pressed_by_an_overlap_published():
    """Two spheres of 50 mm pressed by 4 mm: a = sqrt(R h/2) = 10 mm (code_aster V6.04.222)."""
    assert hertz_radius(4e-3, effective_radius(50e-3, 50e-3)) == pytest.approx(10e-3)


def test_overlap_force_and_radius_agree():
    rng = np.random.default_rng(71)
    delta, r1, r2 = rng.uniform(1e-7, 1e-5, 50), rng.uniform(1e-4, 1e-3, 50), rng.uniform(1e-4, 1e-3, 50)
    modulus = effective_modulus(Elastic(60e9, 0.24), Elastic(200e9, 0.3))
    radius = effective_radius(r1, r2)
    force = hertz_force(delta, radius, modulus)
    np.testing.assert_allclose(radius_from_force(force, radius, modulus), hertz_radius(delta, radius), rtol=1e-12)
    strip = line_force(delta, modulus)
    np.testing.assert_allclose(half_width_from_force(strip, radius, modulus), hertz_radius(delta, radius), rtol=1e-12)


def test_line_contact_published():
    """Maximum pressure of a line contact p0 = 2 F/(pi c) = sqrt(F E*/(pi R*)): Johnson (1985), equation 4.44."""
    force, modulus, radius = 3e5, 110e9, 0.01
    width = half_width_from_force(force, radius, modulus)
    assert 2.0 * force / (np.pi * width) == pytest.approx(np.sqrt(force * modulus / (np.pi * radius)), rel=1e-12)


def test_softened_run_gives_the_radius_of_the_true_material():
    """Force of the soft run, radius of the hard material: c/c_soft = (E_soft/E)^(1/3), area by its square."""
    radius, soft, hard = 2.5e-4, 1e8, 3e10
    delta = np.array([1e-7, 1e-6])
    true = radius_from_force(hertz_force(delta, radius, soft), radius, hard)
    np.testing.assert_allclose(true, hertz_radius(delta, radius) * softening_factor(soft, hard), rtol=1e-12)


@pytest.mark.parametrize("dimension", [2, 3])
def test_softened_overlap_keeps_the_force(dimension):
    """Force of the run by its own modulus, then the width of the true material under it."""
    radius, soft, hard = 2.5e-4, 1e8, 3e10
    delta = np.array([1e-7, 1e-6])
    force = hertz_force(delta, radius, soft) if dimension == 3 else line_force(delta, soft)
    expected = reach_from_force(force, radius, hard, dimension)
    np.testing.assert_allclose(reach_from_overlap(delta, radius, dimension, soft / hard), expected, rtol=1e-12)
    area = np.pi * expected**2 if dimension == 3 else 2.0 * expected
    np.testing.assert_allclose(mean_pressure(expected, radius, hard, dimension), force / area, rtol=1e-12)


def test_modulus_of_pairs():
    one, two = Elastic(60e9, 0.24), Elastic(200e9, 0.3)
    assert pair_modulus(60e9, 0.24, 200e9, 0.3) == pytest.approx(effective_modulus(one, two), rel=1e-14)


def test_lens_is_sqrt2_wider_than_hertz():
    """The rules never mix silently: the lens of the same overlap is sqrt(2) wider, to leading order."""
    r, delta = 1.0, 1e-6
    d = 2.0 * r - delta
    lens = np.sqrt(r**2 - (d / 2.0) ** 2)
    assert lens / hertz_radius(delta, effective_radius(r, r)) == pytest.approx(np.sqrt(2.0), rel=1e-5)


def test_no_contact_without_compression():
    assert hertz_radius([-1e-6, 0.0], 1e-3).tolist() == [0.0, 0.0]
    assert radius_from_force([-1.0, 0.0], 1e-3, 1e9).tolist() == [0.0, 0.0]
    assert half_width_from_force(-1.0, 1e-3, 1e9) == 0.0
    assert radius_from_area([0.0, np.pi]).tolist() == [0.0, 1.0]


def test_a_rigid_plane_and_one_elastic_side():
    rigid = Elastic(1e30, 0.3)
    assert effective_modulus(Elastic(70e9, 0.3), rigid) == pytest.approx(70e9 / 0.91)


def test_mean_field_force_of_lattices():
    """Simple cubic under an isotropic pressure p: each contact carries p (2 R)^2; square array p 2 R."""
    r, p = 0.5e-3, 1e6
    assert mean_field_force(p, r, np.pi / 6.0, 6.0) == pytest.approx(p * (2.0 * r) ** 2)
    assert mean_field_line_force(p, r, np.pi / 4.0, 4.0) == pytest.approx(p * 2.0 * r)


def test_mean_field_force_is_the_virial_of_equal_forces():
    """fcc: stress (1/V) sum F d n n over the contacts of a cell is p I."""
    r, p = 1.0, 2.0
    directions = np.array([(a, b, 0) for a in (1, -1) for b in (1, -1)], dtype=float) / np.sqrt(2.0)
    directions = np.concatenate([np.roll(directions, k, axis=1) for k in range(3)])
    force = mean_field_force(p, r, np.pi / (3.0 * np.sqrt(2.0)), 12.0)
    volume = (4.0 / 3.0) * np.pi * r**3 / (np.pi / (3.0 * np.sqrt(2.0)))
    stress = 0.5 * force * 2.0 * r * directions.T @ directions / volume
    np.testing.assert_allclose(stress, p * np.eye(3), atol=1e-12)


def test_roughness_limits():
    smooth, rough = Roughness(0.0, 0.1, hardness=4e9), Roughness(1e-6, 0.1, hardness=4e9)
    pressure = np.array([1e7, 1e8, 1e9])
    assert area_resistance(pressure, 2.4, smooth).tolist() == [0.0, 0.0, 0.0]
    assert np.isinf(solid_spot_conductance(pressure, 2.4, smooth)).all()
    vacuum = area_resistance(pressure, 2.4, rough)
    assert (np.diff(vacuum) < 0.0).all()
    np.testing.assert_allclose(vacuum[0] / vacuum[1], 10.0**0.95)
    gas = area_resistance(pressure, 2.4, rough, gas_conductivity=0.3)
    assert (gas < vacuum).all()
    far = area_resistance(pressure, 2.4, rough, gas_conductivity=0.3, jump=1e6)
    np.testing.assert_allclose(far, vacuum, rtol=1e-9)
    none = area_resistance(pressure, 2.4, rough, gas_conductivity=0.3, jump=np.inf)
    assert (none == vacuum).all()


def test_resistance_scales_with_the_height():
    pressure = 1e8
    one = area_resistance(pressure, 2.4, Roughness(1e-6, 0.1, hardness=4e9))
    two = area_resistance(pressure, 2.4, Roughness(2e-6, 0.1, hardness=4e9))
    assert two / one == pytest.approx(2.0)


def test_elastic_and_plastic_asperities_are_alike_where_their_pressures_are():
    """Mikic's elastic form has the same shape: with H = m E*/sqrt2 the ratio is 1.55/1.25 (P/H)^-0.01."""
    modulus, slope, p = 30e9, 0.15, 1e8
    hardness = slope * modulus / np.sqrt(2.0)
    plastic = solid_spot_conductance(p, 2.0, Roughness(1e-6, slope, hardness=hardness))
    elastic = solid_spot_conductance(p, 2.0, Roughness(1e-6, slope, modulus=modulus))
    assert elastic / plastic == pytest.approx(1.55 / 1.25 * (p / hardness) ** -0.01)
    assert micro_gap_conductance(p, 0.1, 0.0, Roughness(1e-6, slope, modulus=modulus)) == pytest.approx(
        micro_gap_conductance(p, 0.1, 0.0, Roughness(1e-6, slope, hardness=hardness))
    )


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Elastic(-1.0, 0.3), "Young's modulus"),
        (lambda: Elastic(1e9, 0.6), "Poisson's ratio"),
        (lambda: Roughness(-1e-6, 0.1, hardness=1e9), "height >= 0"),
        (lambda: Roughness(1e-6, 0.1), "either hardness"),
        (lambda: Roughness(1e-6, 0.1, hardness=1e9, modulus=1e9), "either hardness"),
        (lambda: mean_field_force(1e5, 1e-3, 0.6, 0.0), "coordination > 0"),
        (lambda: mean_field_line_force(-1e5, 1e-3, 0.6, 4.0), "pressure >= 0"),
    ],
)
def test_bad_input_is_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_grey_exchange():
    """T^3, black, mirrors, and the linear form against sigma (T_1^4 - T_2^4)."""
    from etc_engine.laws.radiation import STEFAN_BOLTZMANN, grey_exchange

    assert grey_exchange(600.0, 0.8, 0.8) / grey_exchange(300.0, 0.8, 0.8) == pytest.approx(8.0)
    assert grey_exchange(500.0, 1.0, 1.0) == pytest.approx(4.0 * STEFAN_BOLTZMANN * 500.0**3)
    assert grey_exchange(500.0, 0.7, 0.7) == pytest.approx(4.0 * STEFAN_BOLTZMANN * 500.0**3 / (2.0 / 0.7 - 1.0))
    assert grey_exchange(500.0, [0.0, 0.5], 0.9).tolist()[0] == 0.0
    exact = STEFAN_BOLTZMANN * (505.0**4 - 495.0**4) / 10.0
    assert grey_exchange(500.0, 1.0, 1.0) == pytest.approx(exact, rel=2e-4)
    for bad in ((-5.0, 0.5, 0.5), (500.0, 1.5, 0.5), (500.0, 0.5, -0.1)):
        with pytest.raises(InputError):
            grey_exchange(*bad)
