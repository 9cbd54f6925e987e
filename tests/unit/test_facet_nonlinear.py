"""Properties that follow the local temperature: constant, linear (Kirchhoff) and radiating beds, heat balance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.engines.dtem.between_walls import conductivity_between_walls
from etc_engine.engines.dtem.facet_nonlinear import axis_walls, link_temperatures, solve_nonlinear
from etc_engine.engines.dtem.facet_steady import facet_conductivity, uniform_material
from etc_engine.errors import ConvergenceError, InputError
from etc_engine.laws.radiation import grey_exchange
from etc_engine.materials import find_solid
from etc_engine.medium.conditions import Conditions, pores_at
from etc_engine.medium.facets import facet_links
from etc_engine.medium.local import LocalProperties, solid_law
from etc_engine.medium.medium import Medium, Pores
from etc_engine.medium.rules import overlap_contacts
from etc_engine.packing.particles import ParticlePacking
from etc_engine.realization import effective_conductivity

RADIUS = 0.5


def column(layers, periodic=False):
    """Face-centred layers of spheres between two walls normal to z, periodic across."""
    a = 2.002 * RADIUS * np.sqrt(2.0)
    cell = a * np.array([[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]])
    x = np.concatenate([cell + [0, 0, a * k] for k in range(layers)]) + 0.25 * a
    return ParticlePacking(x, np.full(len(x), RADIUS), Box((a, a, layers * a), (True, True, periodic)))


LINKS = facet_links(overlap_contacts(column(6)))


def test_constant_properties_are_the_linear_problem_in_two_steps():
    material = uniform_material(LINKS, 50.0, 1.0)
    found = solve_nonlinear(LINKS, lambda _t, _l: material, 2, (800.0, 300.0))
    linear = facet_conductivity(LINKS, material, axes=(2,)).tensor[2, 2]
    assert found.conductivity == pytest.approx(linear, rel=1e-9)
    assert found.iterations == 2 and abs(found.imbalance) < 1e-8


@pytest.mark.parametrize("slope", [-5e-4, 1e-3])
def test_conductivity_linear_in_temperature_is_kirchhoffs_mean(slope):
    """All conductivities scale with 1 + b (T - 550): the flow is that of the mean temperature, for any b."""

    def material_at(spheres, links):
        return uniform_material(LINKS, 50.0 * (1.0 + slope * (spheres - 550.0)), 1.0 + slope * (links - 550.0))

    found = solve_nonlinear(LINKS, material_at, 2, (300.0, 800.0))
    mean = facet_conductivity(LINKS, uniform_material(LINKS, 50.0, 1.0), axes=(2,)).tensor[2, 2]
    assert found.conductivity == pytest.approx(mean, rel=3e-3)
    assert found.change < 1e-6 and abs(found.imbalance) < 1e-8
    assert found.temperatures.min() > 300.0 and found.temperatures.max() < 800.0


def errors_over_layers(material_of, hot, cold, exact):
    """Relative errors of the conductivity of 3, 6 and 12 layers against that of a continuum."""
    found = []
    for layers in (3, 6, 12):
        links = facet_links(overlap_contacts(column(layers)))
        one = solve_nonlinear(links, material_of(links), 2, (hot, cold))
        found.append(one.conductivity / exact(links) - 1.0)
        assert one.change < 1e-6 and abs(one.imbalance) < 1e-9
    return np.array(found)


def test_kirchhoffs_transform_is_met_with_order_two():
    """k = k_0 (1 + b (T - T_0)): Q L/S = int k dT exactly; spheres of one temperature each err by 1/layers^2."""
    slope = 1.5e-3

    def material_of(links):
        return lambda spheres, between: uniform_material(
            links, 50.0 * (1.0 + slope * (spheres - 500.0)), 1.0 + slope * (between - 500.0)
        )

    def exact(links):
        mean = 1.0 + slope * (0.5 * (300.0 + 900.0) - 500.0)
        return mean * facet_conductivity(links, uniform_material(links, 50.0, 1.0), axes=(2,)).tensor[2, 2]

    errors = errors_over_layers(material_of, 900.0, 300.0, exact)
    assert abs(errors[2]) < 1e-3
    assert (np.abs(errors[:-1] / errors[1:]) > 3.0).all()


def test_radiation_to_the_third_power_is_met_with_order_two():
    """h_r = c T^3 between spheres that conduct well: Q L/S = int k dT = k(T_e), T_e^3 the mean of T^3."""
    hot, cold = 1200.0, 600.0

    def material_of(links):
        return lambda spheres, between: uniform_material(links, 1e6 + 0.0 * spheres, 0.0, radiation=1e-9 * between**3)

    def exact(links):
        cube = 1e-9 * (hot**4 - cold**4) / (4.0 * (hot - cold))
        return facet_conductivity(links, uniform_material(links, 1e6, 0.0, radiation=cube), axes=(2,)).tensor[2, 2]

    errors = errors_over_layers(material_of, hot, cold, exact)
    assert abs(errors[2]) < 2e-3
    assert (np.abs(errors[:-1] / errors[1:]) > 3.0).all()


def test_radiation_at_the_local_temperature():
    """h_r = 4 sigma T^3 e': the flow is that of the mean of T^3, not of the cube of the mean."""

    def material_at(_spheres, links):
        rates = np.array([float(grey_exchange(t, 0.9, 0.9)) for t in links])
        return uniform_material(LINKS, 1e4, 0.0, radiation=rates)

    hot, cold = 1400.0, 400.0
    found = solve_nonlinear(LINKS, material_at, 2, (hot, cold))
    effective = ((hot**4 - cold**4) / (4.0 * (hot - cold))) ** (1.0 / 3.0)
    rate = float(grey_exchange(effective, 0.9, 0.9))
    uniform = facet_conductivity(LINKS, uniform_material(LINKS, 1e4, 0.0, radiation=rate), axes=(2,)).tensor[2, 2]
    assert found.conductivity == pytest.approx(uniform, rel=0.03)  # six layers: 80 K between neighbours
    cube = float(grey_exchange(0.5 * (hot + cold), 0.9, 0.9))
    assert found.conductivity > 1.1 * uniform * cube / rate
    assert abs(found.imbalance) < 1e-8


def test_turning_the_walls_around_turns_the_field_around():
    material = uniform_material(LINKS, 50.0, 1.0)
    up = solve_nonlinear(LINKS, lambda _t, _l: material, 2, (300.0, 800.0))
    down = solve_nonlinear(LINKS, lambda _t, _l: material, 2, (800.0, 300.0))
    np.testing.assert_allclose(up.temperatures + down.temperatures, 1100.0, atol=1e-5)
    assert up.heat_flow == pytest.approx(down.heat_flow)


def test_links_have_the_mean_temperature_of_their_ends():
    t = np.linspace(300.0, 400.0, LINKS.packing.count)
    found = link_temperatures(LINKS, t, axis_walls(LINKS, 2, (280.0, 420.0)))
    i, j = LINKS.pairs[0]
    assert found[0] == pytest.approx(0.5 * (t[i] + t[j]))
    low = int(np.flatnonzero(LINKS.walls == 4)[0])
    assert found[LINKS.count + low] == pytest.approx(0.5 * (280.0 + t[LINKS.wall_particles[low]]))


def test_refusals():
    material = uniform_material(LINKS, 50.0, 1.0)
    with pytest.raises(InputError, match="periodic"):
        solve_nonlinear(LINKS, lambda _t, _l: material, 0, (800.0, 300.0))
    with pytest.raises(InputError, match="different absolute temperatures"):
        solve_nonlinear(LINKS, lambda _t, _l: material, 2, (300.0, 300.0))

    def jumping(spheres, _links):
        return uniform_material(LINKS, np.where(spheres > 550.0, 1.0, 500.0) + 5e-3 * spheres, 0.1)

    with pytest.raises(ConvergenceError, match="still changes"):
        solve_nonlinear(LINKS, jumping, 2, (300.0, 800.0), most=2)


def test_pores_between_their_temperatures():
    """Radiation is a cubic: exact. A gas: to 1e-7; no value depends on what was asked before."""
    t = np.array([305.0, 771.3, 1234.5])
    glow = LocalProperties(LINKS.packing, Conditions(emissivity=0.8, temperature=300.0), lambda x: x).pores(t)[3]
    np.testing.assert_allclose(glow, [float(grey_exchange(float(x), 0.8, 0.8)) for x in t], rtol=1e-13)
    pytest.importorskip("CoolProp")
    gas = Conditions(300.0, "helium", 1e4, 0.4)
    one = LocalProperties(LINKS.packing, gas, lambda x: x)
    whole = one.pores(t)
    for k, x in enumerate(t):
        pores = pores_at(replace(gas, temperature=float(x)), LINKS.packing)
        expected = [pores.conductivity, pores.in_open_pores, pores.jump_length, 0.0]
        np.testing.assert_allclose(whole[:, k], expected, rtol=1e-7)
    fresh = LocalProperties(LINKS.packing, gas, lambda x: x)
    assert [fresh.pores(t[k : k + 1]).tobytes() for k in (2, 0, 1)] == [whole[:, k].tobytes() for k in (2, 0, 1)]
    with pytest.raises(InputError, match="must be absolute"):
        one.pores(np.array([-5.0]))


def test_every_walled_axis_of_a_medium():
    """A cube of walls along y and z, periodic along x, of a packing alike along both."""
    a = 2.002 * RADIUS * np.sqrt(2.0)
    cell = a * np.array([[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]]) + 0.25 * a
    x = np.concatenate([cell + [0, a * i, a * j] for i in range(2) for j in range(2)])
    packing = ParticlePacking(x, np.full(len(x), RADIUS), Box((a, 2 * a, 2 * a), (True, False, False)))
    alumina = find_solid("alumina").conductivity
    solid = solid_law(np.ones(packing.count), [(np.ones(packing.count, dtype=bool), alumina)])
    local = LocalProperties(packing, Conditions(700.0, emissivity=0.8), solid, 0.2, (900.0, 500.0))
    medium = Medium(packing, float(alumina.at(700.0)), overlap_contacts(packing), Pores(0.2), local=local)
    result, by_axis = conductivity_between_walls(medium)
    assert sorted(by_axis) == [1, 2]
    k = np.diag(result.tensor)
    assert np.isnan(k[0]) and k[1] == pytest.approx(k[2], rel=1e-9)
    assert result.heat_imbalance < 1e-9
    whole = effective_conductivity(medium, method="facets")
    np.testing.assert_array_equal(whole.tensor, result.tensor)
    with pytest.raises(InputError, match="periodic along x"):
        conductivity_between_walls(medium, axes=(0,))
    with pytest.raises(InputError, match="not model properties at the local temperature"):
        effective_conductivity(medium, method="cell")


def test_a_range_is_held_for_half_a_kelvin_only():
    titanate = find_solid("Li2TiO3").conductivity
    law = solid_law(np.ones(3), [(np.array([True, True, False]), titanate)])
    found = law(np.array([titanate.high + 0.4, titanate.low, 5000.0]))
    np.testing.assert_array_equal(found, [titanate.at(titanate.high), titanate.at(titanate.low), 1.0])
    with pytest.raises(InputError, match="conductivity of"):
        law(np.array([titanate.high + 0.6, titanate.low, 300.0]))
