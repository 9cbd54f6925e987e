"""Facet links through the engine table: defaults, series, fields, transients."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine import (
    Box,
    Medium,
    ParticlePacking,
    Pores,
    bonded_contacts,
    effective_conductivity,
    march,
    overlap_contacts,
)
from etc_engine.engines.dtem.facet_medium import medium_links
from etc_engine.errors import InputError
from etc_engine.medium.conduction import Conduction
from etc_engine.medium.conductivity import conductivities
from etc_engine.medium.walls import FixedTemperature
from etc_engine.realization.engines import field_along, find_engine, linked_medium
from etc_engine.realization.transients import transient_system


def bed(periodic=(True, True, False), count=(3, 3, 4), seed=5):
    """Spheres at random places in the cells of a grid, radii 1 : 1.4."""
    rng = np.random.default_rng(seed)
    cells = np.stack(np.meshgrid(*map(range, count), indexing="ij"), axis=-1).reshape(-1, 3)
    centers = cells + 0.5 + rng.uniform(-0.1, 0.1, cells.shape)
    radii = rng.uniform(0.35, 0.5, len(cells)) - 0.1
    return ParticlePacking(centers, radii, Box(tuple(float(c) for c in count), periodic))


def test_default_method_of_spheres_in_a_fluid():
    medium = Medium(bed(), 20.0, pores=Pores(1.0))
    result = effective_conductivity(medium)
    assert result.spans == (True, True, True)
    again = effective_conductivity(medium, method="facets", axes=(2,))
    assert again.tensor[2, 2] == pytest.approx(result.tensor[2, 2], rel=1e-9)
    with pytest.raises(InputError, match="only valid with pores that conduct"):
        effective_conductivity(Medium(medium.packing, 20.0), method="facets")


def test_bonds_add_to_the_fluid():
    packing = bed()
    loose = effective_conductivity(Medium(packing, 20.0, pores=Pores(0.1))).tensor[2, 2]
    network = bonded_contacts(packing, 0.2, 0.5)
    bonded = effective_conductivity(Medium(packing, 20.0, network, Pores(0.1))).tensor[2, 2]
    blocked = effective_conductivity(Medium(packing, 20.0, network.with_resistance(1e9), Pores(0.1))).tensor[2, 2]
    assert blocked < loose < bonded


def test_a_series_of_media_matches_single_ones():
    packing = bed(count=(6, 6, 6))
    media = [
        Medium(packing, 3.0, pores=Pores(k, jump_length=j, radiation=0.05))
        for k in (0.1, 0.3, 0.9)
        for j in (0.0, 0.01, 0.1)
    ]
    engine = find_engine("dtem")
    curve = engine.conduct(media, Conduction("dtem", "facets"), 0)
    for row in (0, 4, 8):
        alone = effective_conductivity(media[row])
        np.testing.assert_allclose(curve[row].conductivity[2, 2], alone.tensor[2, 2], rtol=2e-4)
    full = engine.conduct(media, Conduction("dtem", "facets", {"material_curve": "full"}), 0)
    assert {outcome.solved_by for outcome in full} == {"full"}


def test_one_refused_medium_leaves_the_others():
    packing = bed()
    media = [Medium(packing, k, pores=Pores(1.0)) for k in (0.5, 5.0, 50.0)]
    outcomes = find_engine("dtem").conduct(media, Conduction("dtem", "facets"), 0)
    assert "at least as well as the pores" in outcomes[0].message
    assert outcomes[1].conductivity[2, 2] < outcomes[2].conductivity[2, 2]


def test_field_balances_and_lies_between_the_walls():
    medium = Medium(bed(), 20.0, pores=Pores(1.0))
    result = effective_conductivity(medium, axes=(2,))
    field = field_along(medium, result, engine="dtem", method="facets", axis=2)
    links = medium_links(medium)
    alone = linked_medium(medium, result, engine="dtem", method="facets", axis=2).links
    assert np.array_equal(alone.pairs, field.medium.links.pairs)
    assert np.array_equal(alone.wall_angles, field.medium.links.wall_angles)
    out = np.zeros(medium.packing.count)
    np.add.at(out, links.pairs[:, 0], field.contact_flows)
    np.add.at(out, links.pairs[:, 1], -field.contact_flows)
    np.add.at(out, links.wall_particles, field.wall_flows)
    flow = field.wall_flows[links.walls == 5].sum()
    assert np.abs(out).max() < 1e-7 * flow
    # so loose a bed is held at a rigorous bound, its heat flows are not
    own = conductivities(medium.box, (2,), result.solutions[0].energies)[0, 0]
    assert own < result.tensor[2, 2]
    assert flow == pytest.approx(own * 9.0 / 4.0, rel=1e-6)
    assert "miss rigorous bounds by 7.9 %" in find_engine("dtem").remarks("facets", result)[-1]
    for values in (field.particle_temperatures, field.contact_temperatures, field.wall_temperatures):
        assert values.min() >= 0.0
        assert values.max() <= 1.0
    assert np.all(np.diff(field.particle_temperatures.reshape(3, 3, 4), axis=2) < 0.0)


def test_field_of_a_gradient_has_the_branch_between_images():
    medium = Medium(bed((True, True, True)), 20.0, pores=Pores(1.0))
    result = effective_conductivity(medium)
    field = field_along(medium, result, engine="dtem", method="facets", axis=0)
    slope = np.polyfit(medium.packing.centers[:, 0], field.particle_temperatures, 1)[0]
    assert slope == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("dipoles", [False, True])
def test_a_bed_warms_up_to_the_steady_state(dipoles):
    packing = bed(count=(2, 2, 3))
    medium = Medium(packing, 20.0, pores=Pores(1.0, heat_capacity=0.5), heat_capacity=2.0)
    walls = {"bottom": FixedTemperature(1.0), "top": FixedTemperature(0.0)}
    named = {"front": walls["bottom"], "back": walls["top"]}
    system = transient_system(medium, named, dipoles=dipoles)
    stored = 2.0 * packing.measures.sum() + 0.5 * (packing.box.volume - packing.measures.sum())
    assert system.capacities.sum() == pytest.approx(stored, rel=1e-9)
    *_, late = march(system.heat, system.initial(0.0), [0.0, 60.0], steps=300)
    steady = effective_conductivity(medium, axes=(2,)).solutions[0].sphere_temperatures[:, 0]
    np.testing.assert_allclose(system.particle_temperatures(late.temperatures), steady, atol=2e-6)
    flows = system.flows(60.0, late.temperatures)
    pairs = flows[system.sides.of_contacts]
    np.testing.assert_allclose(pairs.sum(axis=1), 0.0, atol=1e-6)


def test_early_rate_of_a_bed_is_that_of_the_wall_film():
    """Heat that enters is heat that is stored."""
    packing = bed(count=(2, 2, 3))
    medium = Medium(packing, 20.0, pores=Pores(1.0, heat_capacity=0.5), heat_capacity=2.0)
    system = transient_system(medium, {"front": FixedTemperature(1.0)})
    states = list(march(system.heat, system.initial(0.0), np.linspace(0.0, 2.0, 9), steps=80))
    heat = [float((system.capacities * system.particle_temperatures(state.temperatures)).sum()) for state in states]
    assert np.all(np.diff(heat) > 0.0)
    assert heat[-1] < system.capacities.sum()


def test_spheres_cut_by_walls_at_any_depth_are_solved_and_reported():
    """A crop goes through spheres anywhere, up to their centres."""
    rng = np.random.default_rng(31)
    whole = bed((True, True, True), (4, 4, 4), seed=31)
    engine = find_engine("dtem")
    cut = 0
    for low in rng.uniform(0.0, 1.0, 6):
        inside = (whole.centers[:, 2] > low) & (whole.centers[:, 2] < low + 2.5)
        packing = ParticlePacking(
            whole.centers[inside] - [0.0, 0.0, low],
            whole.radii[inside] + 0.08,
            Box((4.0, 4.0, 2.5), (True, True, False)),
        )
        medium = Medium(packing, 30.0, overlap_contacts(packing), Pores(1.0))
        result = effective_conductivity(medium, axes=(2,))
        assert 1.0 < result.tensor[2, 2] < 30.0
        cut += any("cut so deep" in text for text in engine.remarks("facets", result))
    assert cut > 0


def test_loose_packings_are_reported():
    medium = Medium(bed(), 30.0, pores=Pores(1.0))
    remarks = find_engine("dtem").remarks("facets", effective_conductivity(medium, axes=(2,)))
    assert any("dense beds" in text for text in remarks)
