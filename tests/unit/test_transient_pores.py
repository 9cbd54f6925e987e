"""Transient studies of a packing with a fluid in its pores: disks by cells, spheres by facet links."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
import pytest

from etc_engine.engines.dtem.between_walls import conductivity_between_walls
from etc_engine.errors import StudyError
from etc_engine.materials import find_solid
from etc_engine.output.series import series_dataset
from etc_engine.realization import effective_conductivity
from etc_engine.study.transient import parse_study
from etc_engine.transient.run import run_transient

SPHERES = {
    "schema": 2,
    "kind": "network",
    "name": "spheres in a gas",
    "seed": 11,
    "packing": {
        "method": "lubachevsky-stillinger",
        "radii": "equal",
        "count": 24,
        "density": 0.5,
        "box": [1.0, 1.0, 1.0],
        "periodic": "xy",
    },
    "particles": {"conductivity": 20.0, "heat_capacity": 2.0, "initial": 0.0},
    "pores": {"conductivity": 1.0, "heat_capacity": 0.5},
    "walls": {"front": {"type": "fixed", "value": 1.0}, "back": {"type": "fixed", "value": 0.0}},
    "time": {"scheme": "bdf2", "steps": 20, "times": [0.0, 0.1, 1.0, 8.0]},
}

ROUGH = {"height": 1e-6, "slope": 0.1, "hardness": 4e9}
HERTZ = {"rule": "hertz", "youngs_modulus": 6e10, "poisson_ratio": 0.25}


def study_of(**changes):
    content = copy.deepcopy(SPHERES)
    for place, value in changes.items():
        table, _, key = place.partition("__")
        content[table] = {**content.get(table, {}), key: value} if key else value
    return parse_study(content)


def test_spheres_in_a_gas_end_at_the_steady_state(tmp_path):
    transient = run_transient(study_of(), tmp_path)
    data = series_dataset(transient)
    assert data.attrs["method"] == "facets"
    medium = transient.system.medium
    stored = 2.0 * medium.packing.measures.sum() + 0.5 * (1.0 - medium.packing.measures.sum())
    assert transient.system.capacities.sum() == pytest.approx(stored, rel=1e-9)
    steady = effective_conductivity(medium, method="facets", axes=(2,)).solutions[0].sphere_temperatures[:, 0]
    late = transient.system.particle_temperatures(transient.states[-1].temperatures)
    np.testing.assert_allclose(late, steady, atol=1e-4)


@pytest.mark.parametrize("rule", ["overlap", "hertz"])
def test_a_transient_packs_for_a_contact_rule_as_a_sweep_does(rule, tmp_path):
    """Both rules take contacts from overlaps, so radii grow to the density, which touching disks cannot reach."""
    packing = {"method": "advancing-front", "radii": "equal:0.1", "density": 0.9, "box": [1.0, 1.0]}
    disks = study_of(
        packing=packing,
        contacts={"rule": rule},
        pores={},
        conduction={"engine": "pipe"},
        walls={"left": {"type": "fixed", "value": 1.0}},
        time={"scheme": "bdf2", "steps": 1, "times": [0.0, 0.1]},
    )
    found = run_transient(disks, tmp_path).network.packing
    assert found.density == pytest.approx(0.9, abs=1e-9)


def test_without_pores_the_method_is_that_of_the_contacts():
    study = study_of(pores__conductivity=0.0, pores__heat_capacity=0.0)
    assert study.conduction.method_for(3, False) == "chord"
    assert study.conduction.method_for(2, True) == "cell"


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"conduction__method": "chord"}, "allowed where the pores conduct: "),
        ({"conduction__engine": "pipe"}, "does not model heat through the pores"),
        ({"pores__conductivity": -1.0}, "pores.conductivity"),
        ({"pores__conductivity": 0.0}, "only if they conduct"),
        ({"pores__conductivity": 0.0, "pores__heat_capacity": 0.0, "conduction__method": "facets"}, "do not conduct"),
        ({"contacts__contact_angle": 5.0}, r"contacts\.contact_angle: has no effect with rule = 'overlap'"),
        ({"contacts__load": 1e5}, r"contacts\.load: has no effect with rule = 'overlap'"),
        ({"contacts": {"rule": "bonded", "contact_angle": 5.0, "coordination": 4.0}}, "coordination: has no effect"),
        ({"contacts": {**HERTZ, "roughness": ROUGH}}, r"contacts\.roughness: a transient does not compute"),
        ({"contacts": {**HERTZ, "youngs_modulus": [1e9, 2e9]}}, r"youngs_modulus: a transient takes one value"),
    ],
)
def test_what_does_not_fit_is_refused(changes, words):
    with pytest.raises(StudyError, match=words):
        study_of(**changes)


LOCAL = {
    "packing__box": [2e-3, 2e-3, 2e-3],
    "particles": {"material": "alumina", "heat_capacity": 3e6, "initial": 600.0},
    "pores": {"gas": "helium", "pressure": 1e5, "accommodation": 0.4},
    "radiation": {"emissivity": 0.8},
    "conduction": {"nonlinear": True},
    "walls": {"front": {"type": "fixed", "value": 1000.0}, "back": {"type": "fixed", "value": 500.0}},
    "time": {"scheme": "bdf2", "steps": 5, "times": [0.0, 0.5, 5.0, 500.0]},
}


def test_properties_at_the_local_temperature_end_at_the_steady_nonlinear_state(tmp_path):
    """Alumina in helium between walls of 1000 and 500 K, with radiation; heat balances at every time."""
    pytest.importorskip("CoolProp")
    transient = run_transient(study_of(**LOCAL), tmp_path)
    medium, last = transient.system.medium, transient.states[-1]
    assert medium.local is not None
    steady = replace(medium, local=replace(medium.local, walls=(1000.0, 500.0)))
    by_axis = conductivity_between_walls(steady, axes=(2,))[1][2]
    late = transient.system.particle_temperatures(last.temperatures)
    np.testing.assert_allclose(late, by_axis.temperatures, atol=1e-4)
    data = series_dataset(transient)
    assert data.attrs["method"] == "facets"
    front = data["wall_heat_flow"].sel(wall="front").values
    assert front[-1] == pytest.approx(by_axis.heat_flow, rel=1e-6)
    stored = [abs(state.stored) for state in transient.states[1:]]
    assert (np.abs([state.imbalance for state in transient.states[1:]]) < 1e-11 * np.array(stored)).all()
    flows = transient.system.flows(last.time, last.temperatures)
    at_front = transient.system.sides.of_walls[
        transient.system.medium.network.walls[transient.system.wall_contacts] == 4
    ]
    assert flows[at_front].sum() == pytest.approx(by_axis.heat_flow, rel=1e-6)


def test_a_material_at_one_temperature_is_its_number(tmp_path):
    """The same bits as the conductivity, the gas and the radiation by hand."""
    pytest.importorskip("CoolProp")
    changes = {**LOCAL, "conduction": {"temperature": 700.0}}
    named = run_transient(study_of(**changes), tmp_path)
    number = float(find_solid("alumina").conductivity.at(700.0))
    by_number = {**changes, "particles": {"conductivity": number, "heat_capacity": 3e6, "initial": 600.0}}
    by_hand = run_transient(study_of(**by_number), tmp_path)
    assert named.states[-1].temperatures.tobytes() == by_hand.states[-1].temperatures.tobytes()
    local = run_transient(study_of(**LOCAL), tmp_path)
    assert not np.allclose(local.states[-1].temperatures, named.states[-1].temperatures, rtol=1e-3)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"conduction__temperature": 600.0}, r"conduction\.temperature: has no effect with nonlinear = true"),
        ({"conduction": {}}, "a gas needs a temperature"),
        ({"conduction": {}, "pores": {"conductivity": 0.2}, "radiation": {}}, r"conduction\.temperature: missing"),
        ({"time__scheme": "crank-nicolson"}, "allowed with nonlinear = true: backward-euler, bdf2"),
        ({"conduction": {"nonlinear": True, "engine": "pipe"}}, "does not model heat through the pores"),
        ({"conduction": {"nonlinear": True, "method": "cell"}}, "method facets"),
        ({"pores__conductivity": 0.1}, "conductivity: has no effect with gas"),
        ({"particles__conductivity": 0.1}, r"particles\.conductivity: has no effect with material"),
        (
            {"particles": {"conductivity": 2.0, "heat_capacity": 1.0, "initial": 1.0}, "pores": {}, "radiation": {}},
            "no property depends on the temperature",
        ),
    ],
)
def test_what_local_properties_do_not_fit_is_refused(changes, words):
    with pytest.raises(StudyError, match=words):
        study_of(**{**LOCAL, **changes})


def test_local_properties_take_absolute_temperatures(tmp_path):
    with pytest.raises(StudyError, match="absolute temperatures"):
        run_transient(study_of(**{**LOCAL, "particles__initial": -3.0}), tmp_path)
