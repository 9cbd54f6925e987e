"""Studies with a solid, a gas, a temperature and loaded contacts by value."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest

from etc_engine import Box, Medium, ParticlePacking, effective_conductivity
from etc_engine.comparison import evaluate_models, model_lines
from etc_engine.comparison.sensitivity import sensitivities
from etc_engine.comparison.simulation import simulated
from etc_engine.engines.dtem.between_walls import conductivity_between_walls
from etc_engine.errors import InputError, StudyError
from etc_engine.materials import find_solid, gas_state, jump_length
from etc_engine.medium.conditions import Conditions, pores_at
from etc_engine.medium.local import LocalProperties, solid_law
from etc_engine.medium.rules import RULES, find_rule
from etc_engine.models import evaluate
from etc_engine.output.figures import draw_bed, draw_over_temperature
from etc_engine.packing import pack
from etc_engine.particle_files.formats import read_table
from etc_engine.realization.realize import realize
from etc_engine.service.curve import curve_of
from etc_engine.study.conditions import derived_conductivities
from etc_engine.study.sweep import parse_study, study_of
from etc_engine.sweep.dataset import assemble
from etc_engine.sweep.packing import first_packing
from etc_engine.sweep.table import tabulate

BED = """
schema = 2
name = "bed"
seed = 5
[packing]
method = "lubachevsky-stillinger"
radii = "equal"
count = 8
box = [2e-3, 2e-3, 2e-3]
periodic = "xyz"
density = 0.5
[particles]
material = "alumina"
[contacts]
rule = "load"
load = 2e4
youngs_modulus = 370e9
poisson_ratio = 0.22
coordination = 4.0
[pores]
gas = "helium"
pressure = [1e3, 1e5]
[radiation]
emissivity = 0.6
[conduction]
temperature = [400.0, 800.0]
material_curve = "full"
[statistics]
realizations = 1
"""
DISKS = """
schema = 2
name = "disks"
seed = 6
[packing]
radii = "uniform:0.01:0.02"
box = [0.3, 0.3]
density = 0.85
[contacts]
rule = "hertz"
[statistics]
realizations = 1
"""


def test_every_temperature_and_pressure_is_that_of_a_medium_by_hand():
    pytest.importorskip("CoolProp")
    study = parse_study(BED)
    assert study.methods == ("facets",)
    assert list(study.axes) == ["pressure", "temperature"]
    spec = study.realization_spec(0.5)
    found = realize(spec, np.random.default_rng(3))
    values = np.array([np.trace(outcome.conductivity) / 3.0 for outcome in found.cells]).reshape(2, 2)
    packing = pack(spec.packing, np.random.default_rng(3))
    network = find_rule("load").contacts(packing, load=2e4, youngs_modulus=370e9, poisson_ratio=0.22, coordination=4.0)
    solid = find_solid("alumina")
    by_hand = [
        effective_conductivity(
            Medium(
                packing,
                float(solid.conductivity.at(t)),
                network,
                pores_at(Conditions(t, "helium", p, None, solid.atomic_mass, 0.6), packing),
            ),
            material_curve="full",
        ).mean
        for p in (1e3, 1e5)
        for t in (400.0, 800.0)
    ]
    np.testing.assert_allclose(values.ravel(), by_hand, rtol=1e-9)
    assert (values[1] > values[0]).all()


def test_the_result_holds_the_conductivities_that_follow():
    pytest.importorskip("CoolProp")
    study = parse_study(BED)
    data = assemble(study, tabulate(study, []), {})
    assert data["particle_conductivity"].dims == ("temperature",)
    assert data["pore_conductivity"].dims == ("pressure", "temperature")
    solid = find_solid("alumina").conductivity
    np.testing.assert_array_equal(data["particle_conductivity"], [solid.at(400.0), solid.at(800.0)])
    derived = derived_conductivities(study)["pore_conductivity"][1]
    np.testing.assert_allclose(derived[1], [0.1902, 0.3078], rtol=0.01)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("temperature = [400.0, 800.0]\n", "", "a gas needs a temperature"),
        ("pressure = [1e3, 1e5]\n", "", "a gas needs a pressure"),
        ('gas = "helium"\n', "", "a pressure needs a gas"),
        ('gas = "helium"', 'gas = "phlogiston"', "pores.gas: "),
        ('"alumina"', '"phlogiston"', "particles.material: there is no material named 'phlogiston'"),
        ("[400.0, 800.0]", "[400.0, 9000.0]", "9000"),
        ('gas = "helium"', 'gas = "helium"\nconductivity = 0.1', "pores.conductivity: has no effect with gas"),
        ('"alumina"', '"alumina"\nconductivity = 3.0', "particles.conductivity: has no effect with material"),
        ("youngs_modulus = 370e9\n", "", "rule = 'load' needs youngs_modulus"),
        ("load = 2e4\n", "", "rule = 'load' needs load"),
        ('material_curve = "full"', 'method = "chord"', "does not model heat through the pores"),
        ('material_curve = "full"', 'engine = "voxel"', "models neither a rarefied gas nor radiation"),
        ("emissivity = 0.6", "emissivity = 1.6", "a number from 0 to 1"),
        (
            "coordination = 4.0",
            "coordination = 4.0\nroughness = { height = 1e-6 }",
            "contacts.roughness.slope: missing",
        ),
    ],
)
def test_what_is_missing_or_out_of_range_is_refused_in_one_line(old, new, message):
    pytest.importorskip("CoolProp")
    assert old in BED
    text = BED.replace(old, new)
    if "voxel" in new:
        text = text[: text.index("[contacts]")] + text[text.index("[pores]") :]
    with pytest.raises(StudyError) as caught:
        parse_study(text)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_temperature_alone_means_nothing():
    with pytest.raises(StudyError, match="has no effect without a material, a gas or radiation"):
        parse_study(DISKS + "[conduction]\ntemperature = 300.0\n")


def test_overlaps_conduct_through_hertz_widths_of_a_softened_run():
    """Sides of a contact of disks: half-width by R E/E_sim; a stiffer solid conducts less."""
    soft = parse_study(DISKS)
    text = DISKS.replace('"hertz"', '"hertz"\nyoungs_modulus = 1e11\npoisson_ratio = 0.3\nsimulated_modulus = 1e8')
    stiff = parse_study(text)
    means = []
    for study in (soft, stiff):
        (outcome,) = realize(study.realization_spec(0.85), np.random.default_rng(1)).cells
        means.append(np.trace(outcome.conductivity))
    assert 0.0 < means[1] < 0.7 * means[0]
    with pytest.raises(StudyError, match="simulated_modulus needs youngs_modulus"):
        parse_study(DISKS.replace('"hertz"', '"hertz"\nsimulated_modulus = 1e8'))


def test_rough_contacts_conduct_less():
    text = DISKS.replace('"hertz"', '"hertz"\nyoungs_modulus = 1e11\npoisson_ratio = 0.3')
    rough = text.replace(
        "[statistics]", "roughness = { height = [1e-7, 1e-6], slope = 0.1, hardness = 4e9 }\n[statistics]"
    )
    (smooth,) = realize(parse_study(text).realization_spec(0.85), np.random.default_rng(1)).cells
    found = realize(parse_study(rough).realization_spec(0.85), np.random.default_rng(1)).cells
    traces = [np.trace(outcome.conductivity) for outcome in (smooth, *found)]
    assert traces[0] > traces[1] > traces[2] > 0.0


def test_bed_models_take_their_inputs_from_the_result(made_sweep):
    """100 spheres of density 0.5 in (2 mm)^3; helium of the given accommodation."""
    pytest.importorskip("CoolProp")
    text = BED.replace('gas = "helium"', 'gas = "helium"\naccommodation = 0.4')
    data = made_sweep(text, lambda *_: 1.0)
    comparison = evaluate_models(data)
    diameter = (6.0 * 0.5 * 8e-9 / (100 * np.pi)) ** (1.0 / 3.0)
    gas = gas_state("helium", 800.0, 1e3)
    expected = evaluate(
        "zehner_bauer_schluender",
        k1=gas.conductivity,
        k2=float(find_solid("alumina").conductivity.at(800.0)),
        fraction=0.5,
        dimension=3,
        diameter=diameter,
        temperature=800.0,
        emissivity=0.6,
        jump_length=jump_length(gas, 0.4),
    )
    found = comparison["model_conductivity"].sel(model="zehner_bauer_schluender", pressure=1e3, temperature=800.0)
    assert found.values.item() == pytest.approx(float(expected), rel=1e-12)
    assert comparison["input_diameter"].values.item() == pytest.approx(diameter, rel=1e-12)
    assert not comparison.attrs["bounds_bind"]
    assert comparison.attrs["bounds_unbound"].startswith("radiation crosses the pores")
    lines = model_lines(comparison)["model_conductivity"]
    at = lines.sel(model="zehner_bauer_schluender", pressure=1e3, temperature=800.0)
    assert at.values.ravel()[0] == pytest.approx(float(expected), rel=1e-12)


def test_the_slope_of_a_power_law_is_its_exponent(made_sweep):
    pytest.importorskip("CoolProp")
    data = made_sweep(BED, lambda _, values, *__: 1e-3 * values["pressure"] ** 0.25 * values["temperature"] ** 1.5)
    found = sensitivities(simulated(data))
    np.testing.assert_allclose(found["pressure"], 0.25, rtol=1e-9)
    np.testing.assert_allclose(found["temperature"], 1.5, rtol=1e-9)
    assert list(found) == ["pressure", "temperature"]
    np.testing.assert_allclose(found["temperature"]["temperature"], [np.sqrt(400.0 * 800.0)])


def test_a_solid_as_a_table_of_the_user():
    pytest.importorskip("CoolProp")
    own = "{ temperature = [300.0, 900.0], conductivity = [2.0, 8.0], source = 'our lab' }"
    study = parse_study(BED.replace('"alumina"', own))
    np.testing.assert_allclose(derived_conductivities(study)["particle_conductivity"][1], [3.0, 7.0])
    assert parse_study(BED.replace('"alumina"', own)).digest() == study.digest()
    with pytest.raises(StudyError, match=r"particles.material: .*needs a column 'conductivity'"):
        parse_study(BED.replace('"alumina"', "{ temperature = [300.0, 900.0] }"))
    with pytest.raises(StudyError, match=r"particles.material: .*from 300 to 700 K"):
        parse_study(BED.replace('"alumina"', own.replace("900.0", "700.0")))


def test_a_mixture_of_gases():
    pytest.importorskip("CoolProp")
    study = parse_study(BED.replace('"helium"', "{ helium = 0.5, argon = 0.5 }"))
    pure = [derived_conductivities(parse_study(BED.replace("helium", gas))) for gas in ("helium", "argon")]
    low, high = sorted(one["pore_conductivity"][1][1, 0] for one in pure)
    assert low < derived_conductivities(study)["pore_conductivity"][1][1, 0] < high
    with pytest.raises(StudyError, match=r"must add up to 1, found 0\.9"):
        parse_study(BED.replace('"helium"', "{ helium = 0.5, argon = 0.4 }"))


WALLS = BED.replace('"xyz"', '"xy"').replace(
    'material_curve = "full"', "nonlinear = true\ntemperature_difference = [2.0, 200.0]"
)


def test_between_walls_the_properties_follow_the_temperature():
    """Each cell is that of a medium by hand; along axes without walls there is none."""
    pytest.importorskip("CoolProp")
    study = parse_study(WALLS.replace("[400.0, 800.0]", "600.0").replace("[1e3, 1e5]", "1e5"))
    assert list(study.axes) == ["temperature_difference"]
    spec = study.realization_spec(0.5)
    found = realize(spec, np.random.default_rng(3))
    packing = pack(spec.packing, np.random.default_rng(3))
    network = find_rule("load").contacts(packing, load=2e4, youngs_modulus=370e9, poisson_ratio=0.22, coordination=4.0)
    solid = find_solid("alumina")
    conditions = Conditions(600.0, "helium", 1e5, None, solid.atomic_mass, 0.6)
    law = solid_law(np.ones(packing.count), [(np.ones(packing.count, dtype=bool), solid.conductivity)])
    medium = Medium(packing, float(solid.conductivity.at(600.0)), network, pores_at(conditions, packing))
    for difference, outcome in zip((2.0, 200.0), found.cells, strict=True):
        local = LocalProperties(packing, conditions, law, 0.0, (600.0 + difference / 2.0, 600.0 - difference / 2.0))
        by_hand, _ = conductivity_between_walls(replace(medium, local=local))
        np.testing.assert_allclose(outcome.conductivity, by_hand.tensor, rtol=1e-12)
        assert np.isnan(outcome.conductivity[:2, :2]).all()
        assert outcome.heat_imbalance < 1e-9
    linear = effective_conductivity(medium, axes=(2,), method="facets").tensor[2, 2]
    near, far = (outcome.conductivity[2, 2] for outcome in found.cells)
    assert near == pytest.approx(linear, rel=1e-5)
    assert far != pytest.approx(linear, rel=1e-3)


def test_the_result_between_walls_has_its_heat_balance_and_its_means(made_sweep):
    pytest.importorskip("CoolProp")
    data = made_sweep(WALLS, lambda *_: [np.nan, np.nan, 2.0])
    assert "heat_imbalance" in data and data["conductivity"].sizes["temperature_difference"] == 2
    assert data["temperature_difference"].attrs["units"] == "K"
    assert (simulated(data)["conductivity_mean"] == 2.0).all()
    assert "heat_imbalance" not in made_sweep(BED, lambda *_: 1.0)
    comparison = evaluate_models(data)
    assert not comparison.attrs["bounds_bind"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"xy"', '"xyz"', "conduction.nonlinear: the temperature varies between two walls"),
        ("temperature_difference = [2.0, 200.0]\n", "", "conduction.temperature_difference: missing"),
        ("[2.0, 200.0]", "[2.0, 800.0]", "the cold wall would be at 0 K"),
        ("[2.0, 200.0]", "[2.0, 700.0]", "particles.material: at the wall of 50 K"),
        ("nonlinear = true\n", "", "conduction.temperature_difference: has no effect with nonlinear = 'false'"),
        ("nonlinear = true\n", 'method = "cell"\nnonlinear = true\n', "conduction.method: method 'cell'"),
    ],
)
def test_what_walls_of_two_temperatures_need(old, new, message):
    pytest.importorskip("CoolProp")
    assert old in WALLS
    with pytest.raises(StudyError) as caught:
        parse_study(WALLS.replace(old, new))
    assert message in str(caught.value)


BINARY = """
schema = 2
name = "binary bed"
seed = 5
[packing]
files = "bed.dump"
[particles]
types = { 1 = "alumina", 2 = "SS316", 3 = 5.0 }
[contacts]
rule = "bonded"
contact_angle = 3.0
bond_gap = 0.03
[pores]
gas = "helium"
pressure = [1e3, 1e5]
accommodation = 0.4
[radiation]
emissivity = 0.7
[conduction]
temperature = 600.0
"""


def written_binary(path, types=(1, 1, 1, 1, 2, 3, 3, 3)):
    """Four large spheres on a face-centred lattice, small ones of a third of the radius between them."""
    a, large = 4e-3, float(0.99 * 4e-3 / (2.0 * np.sqrt(2.0)))
    x = a * (np.array([[0, 0, 0], [1, 1, 0], [1, 0, 1], [0, 1, 1]]) / 2.0 + 0.25)
    holes = a * (np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]) / 2.0 + 0.25)
    head = f"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n8\nITEM: BOX BOUNDS pp pp pp\n{3 * f'0 {a!r}{chr(10)}'}"
    rows = [
        f"{k + 1} {types[k]} {p[0]!r} {p[1]!r} {p[2]!r} {large if k < 4 else large / 3.0!r}"
        for k, p in enumerate(np.concatenate([x, np.mod(holes, a)]).tolist())
    ]
    path.write_text(head + "ITEM: ATOMS id type x y z radius\n" + "\n".join(rows) + "\n")
    return path


def test_a_binary_bed_of_three_materials_in_gas(tmp_path):
    """Two sizes, two solids by name and one by number, at two pressures: each against a medium made by hand."""
    pytest.importorskip("CoolProp")
    file = written_binary(tmp_path / "bed.dump")
    study = study_of(tomllib.loads(BINARY), "bed.toml", tmp_path)
    assert study.methods == ("facets",) and list(study.axes) == ["pressure"]
    spec = study.for_realization(study.realization_spec(None), 0)
    found = [float(np.trace(cell.conductivity)) / 3.0 for cell in realize(spec, np.random.default_rng(1)).cells]
    packing = read_table(file).packing
    assert len(set(packing.radii.tolist())) == 2
    kappa = [float(find_solid(name).conductivity.at(600.0)) for name in ("alumina", "SS316")]
    each = np.array([kappa[0]] * 4 + [kappa[1]] + [5.0] * 3)
    network = find_rule("bonded").contacts(packing, half_angle=np.radians(3.0), bond_gap=0.03)
    assert network.count == 24
    for pressure, value in zip((1e3, 1e5), found, strict=True):
        pores = pores_at(Conditions(600.0, "helium", pressure, 0.4, emissivity=0.7), packing)
        by_hand = effective_conductivity(Medium(packing, each, network, pores), method="facets").mean
        assert value == pytest.approx(by_hand, rel=1e-12)
    assert found[1] > 1.2 * found[0]
    written_binary(file, types=(2, 2, 2, 2, 1, 3, 3, 3))  # the other solid in the large spheres
    study = study_of(tomllib.loads(BINARY), "bed.toml", tmp_path)
    spec = study.for_realization(study.realization_spec(None), 0)
    other = [float(np.trace(cell.conductivity)) / 3.0 for cell in realize(spec, np.random.default_rng(1)).cells]
    assert (other[1] > found[1]) == (kappa[1] > kappa[0])


def test_rules_say_what_they_are():
    """What other rooms ask of a rule stands in its row."""
    assert [word for word, rule in RULES.items() if rule.geometric] == ["overlap"]
    assert [word for word, rule in RULES.items() if rule.roughness] == ["hertz", "load"]
    assert [word for word, rule in RULES.items() if rule.takes_gap] == ["bonded", "radius", "load"]
    assert [word for word, rule in RULES.items() if not rule.unbound] == ["overlap"]
    crowded = DISKS.replace('"hertz"', '"coordination"\ncontact_angle = 5.0\ncoordination = 4.0')
    with pytest.raises(StudyError, match=r"allowed below 1 with rule = 'coordination'"):
        parse_study(crowded.replace("density = 0.85", "density = 1.1"))


def test_a_bed_is_drawn_over_the_temperature_at_each_pressure(made_sweep):
    """On the page of the service, and in the report: packing, conditions, k(T) with the model of a bed."""
    pytest.importorskip("CoolProp")
    data = made_sweep(BED, lambda _, values, *__: 1e-3 * values["pressure"] ** 0.25 * values["temperature"])
    curve = curve_of(data)
    assert curve["along"] == {"name": "temperature", "title": "temperature [K]", "values": [400.0, 800.0]}
    assert [series["values"] for series in curve["series"]] == [{"pressure": 1e3}, {"pressure": 1e5}]
    np.testing.assert_allclose(curve["series"][1]["mean"], [1e-3 * 1e5**0.25 * t for t in (400.0, 800.0)])
    comparison = evaluate_models(data)
    model = next(one for one in curve["models"] if one["name"] == "zehner_bauer_schluender")
    assert model["at"] == [400.0, 800.0]
    expected = comparison["model_conductivity"].sel(model="zehner_bauer_schluender").isel(density=0)
    np.testing.assert_allclose(model["curves"], expected.transpose("pressure", "temperature"))
    figure = draw_over_temperature(comparison)
    assert figure is not None
    axes = figure.axes[0]
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["1000 Pa", "1e+05 Pa"]
    solid = [line.get_ydata() for line in axes.lines if line.get_linestyle() == "-"]
    np.testing.assert_allclose(solid, comparison["conductivity_mean"].isel(density=0))
    assert draw_over_temperature(comparison.isel(temperature=[0])) is None
    with pytest.raises(InputError, match="makes another packing"):  # the conductivities are made up, so are packings
        first_packing(data)


@pytest.mark.parametrize("radii", [[0.2, 0.2], [0.2, 0.1]])
def test_the_view_of_a_bed(radii):
    """Spheres where they are, a scale of radii where they differ; a disk packing is drawn in its box."""
    spheres = ParticlePacking([[0.3, 0.3, 0.3], [0.7, 0.7, 0.7]], radii, Box((1.0, 1.0, 1.0), (True, False, True)))
    figure = draw_bed(spheres)
    image = figure.axes[0].images[0].get_array()
    assert 0.02 < float((image[..., 3] > 0.0).mean()) < 0.5
    assert len(figure.axes) == (2 if radii[0] != radii[1] else 1)
    disks = ParticlePacking([[0.3, 0.3], [0.7, 0.7]], radii, Box((1.0, 1.0)))
    assert "2 disks" in draw_bed(disks).axes[0].get_title()
