"""Properties that follow the local temperature: constant, linear (Kirchhoff) and radiating beds, heat balance."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.engines.dtem.facet_nonlinear import link_temperatures, solve_nonlinear
from etc_engine.engines.dtem.facet_steady import facet_conductivity, uniform_material
from etc_engine.errors import ConvergenceError, InputError
from etc_engine.laws.radiation import grey_exchange
from etc_engine.medium.facets import facet_links
from etc_engine.medium.rules import overlap_contacts
from etc_engine.packing.particles import ParticlePacking

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
    found = link_temperatures(LINKS, t, 2, (280.0, 420.0))
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
