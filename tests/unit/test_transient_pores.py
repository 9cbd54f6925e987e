"""Transient studies of a packing with a fluid in its pores: disks by cells, spheres by facet links."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from etc_engine.errors import StudyError
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
        ({"conduction__engine": "pipe"}, "takes no heat through the pores"),
        ({"pores__conductivity": -1.0}, "pores.conductivity"),
        ({"pores__conductivity": 0.0}, "only if they conduct"),
        ({"pores__conductivity": 0.0, "pores__heat_capacity": 0.0, "conduction__method": "facets"}, "do not conduct"),
        ({"contacts__contact_angle": 5.0}, r"contacts\.contact_angle: has no meaning with rule = 'overlap'"),
        ({"contacts__load": 1e5}, r"contacts\.load: has no meaning with rule = 'overlap'"),
        ({"contacts": {"rule": "bonded", "contact_angle": 5.0, "coordination": 4.0}}, "coordination: has no meaning"),
        ({"contacts": {**HERTZ, "roughness": ROUGH}}, r"contacts\.roughness: a transient does not compute"),
        ({"contacts": {**HERTZ, "youngs_modulus": [1e9, 2e9]}}, r"youngs_modulus: a transient takes one value"),
    ],
)
def test_what_does_not_fit_is_refused(changes, words):
    with pytest.raises(StudyError, match=words):
        study_of(**changes)
