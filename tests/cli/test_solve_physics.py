"""``solve`` with contacts from load, materials and gases: what is recorded, what is refused."""

from __future__ import annotations

import json

import numpy as np
import pytest

from etc_engine.cli import run
from etc_engine.cli.solve_outputs import print_table
from etc_engine.realization import find_engine

pytest.importorskip("CoolProp")
ELASTIC = ["--youngs-modulus", "90e9", "--poisson-ratio", "0.24"]


@pytest.fixture
def bed(tmp_path):
    """Simple cubic array of slightly overlapping spheres, as CSV."""
    r, n = 0.5e-3, 3
    grid = (np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3) + 0.5) * 2.0 * r * 0.9999
    file = tmp_path / "bed.csv"
    rows = "\n".join(",".join(repr(float(v)) for v in (*x, r)) for x in grid)
    file.write_text("x,y,z,radius\n" + rows + "\n")
    return [str(file), "--box", ",".join([repr(2.0 * r * n * 0.9999)] * 3), "--periodic", "xyz", "--engine", "pipe"]


def solved(capfd, *arguments):
    assert run(["solve", *arguments, "--json"]) == 0
    return json.loads(capfd.readouterr().out)


def test_hertz_is_sqrt2_narrower_than_the_lens(bed, capfd):
    """Small contacts conduct in proportion to their radius."""
    lens = solved(capfd, *bed)
    hertz = solved(capfd, *bed, "--rule", "hertz")
    assert (lens["contact_rule"], hertz["contact_rule"]) == ("overlap", "hertz")
    assert lens["contacts"] == hertz["contacts"] == 81
    assert lens["conductivity"] / hertz["conductivity"] == pytest.approx(np.sqrt(2.0), rel=0.01)


def test_softened_run_and_load(bed, capfd):
    hertz = solved(capfd, *bed, "--rule", "hertz")
    soft = solved(capfd, *bed, "--rule", "hertz", *ELASTIC, "--simulated-modulus", "90e6")
    assert soft["conductivity"] / hertz["conductivity"] == pytest.approx(0.1, rel=0.02)
    load = solved(capfd, *bed, "--load", "1e6", *ELASTIC)
    assert load["contact_rule"] == "load" and load["load"] == 1e6 and load["youngs_modulus"] == 90e9
    more = solved(capfd, *bed, "--load", "8e6", *ELASTIC)
    assert more["conductivity"] / load["conductivity"] == pytest.approx(2.0, rel=0.01)  # c ~ F^(1/3)


def test_the_closest_pairs_give_the_coordination_number(bed, capfd):
    """Three contacts of 27 spheres each way: 81 make a coordination number of 6."""
    closest = solved(capfd, *bed, "--rule", "coordination", "--contact-angle", "5", "--coordination", "6")
    assert (closest["contact_rule"], closest["contacts"], closest["coordination"]) == ("coordination", 81, 6.0)


def test_rough_contacts_conduct_less(bed, capfd):
    smooth = solved(capfd, *bed, "--load", "1e6", *ELASTIC)
    rough = solved(capfd, *bed, "--load", "1e6", *ELASTIC, "--roughness", "1e-6,0.1,4e9")
    assert rough["conductivity"] < smooth["conductivity"]


def test_a_material_at_its_temperature(bed, capfd):
    one = solved(capfd, *bed)
    steel = solved(capfd, *bed, "--material", "SS316", "--temperature", "600")
    assert steel["conductivity"] / one["conductivity"] == pytest.approx(19.9756, rel=1e-4)
    assert steel["particle_conductivity"] == pytest.approx(19.9756, rel=1e-4)
    assert one["particle_conductivity"] == 1.0


def test_what_touches_is_judged_by_the_rule(tmp_path, capfd):
    """Spheres a thousandth of a radius apart: the load and the closest pairs bridge the gap, Hertz does not."""
    file = tmp_path / "apart.csv"
    file.write_text("x,y,z,radius\n0.25,0.25,0.25,0.24975\n0.75,0.25,0.25,0.24975\n")
    words = [str(file), "--box", "1,0.5,0.5"]
    for options in (
        ["--load", "1e6", *ELASTIC, "--bond-gap", "0.01"],
        ["--rule", "coordination", "--contact-angle", "5", "--coordination", "1"],
    ):
        assert run(["solve", *words, *options, "--json"]) == 0
        done = capfd.readouterr()
        assert json.loads(done.out)["contacts"] == 1
        assert "touches the driven wall" not in done.err
    assert run(["solve", *words, "--rule", "hertz"]) == 0
    error = capfd.readouterr().err
    assert "no particles overlap" in error and "--rule bonded or load instead of hertz" in error
    assert "nothing touches the driven wall" in error


def test_contacts_asked_for_and_not_found_are_told_in_a_gas_too(tmp_path, capfd):
    """Spheres a tenth of a radius apart: bonds are asked for, the gas alone conducts; without bonds nothing is said."""
    file = tmp_path / "apart.csv"
    file.write_text("x,y,z,radius\n0.25,0.25,0.25,0.2375\n0.75,0.25,0.25,0.2375\n")
    words = ["solve", str(file), "--box", "1,0.5,0.5", "--periodic", "xyz", "--pore-conductivity", "0.1", "--json"]
    assert run([*words, "--contact-angle", "5"]) == 0
    done = capfd.readouterr()
    assert json.loads(done.out)["contacts"] == 0
    assert "no surfaces are within 1e-06 mean radii, so heat crosses the pores alone" in done.err
    assert run(words) == 0
    assert "no surfaces" not in capfd.readouterr().err
    assert "Rays past neighbours are left out" in " ".join(help_of(capfd).split())


def help_of(capfd):
    assert run(["solve", "--help"]) == 0
    return capfd.readouterr().out


def test_the_help_names_every_method(capfd):
    assert run(["solve", "--help"]) == 0
    words = capfd.readouterr().out.replace(",", " ").replace(".", " ").split()
    for engine in ("dtem", "pipe"):
        assert set(find_engine(engine).methods) <= set(words)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--rule", "hertz", "--bond-gap", "0.1"], "--bond-gap has no effect with the contact rule hertz"),
        (["--rule", "hertzian"], "unknown contact rule"),
        (["--rule", "load"], "also needs --load"),
        (["--rule", "overlap", "--youngs-modulus", "1e9"], "has no effect with the contact rule overlap"),
        (["--rule", "hertz", "--simulated-modulus", "1e8"], "also needs --youngs-modulus"),
        (["--load", "1e6", "--youngs-modulus", "90e9"], "also needs --poisson-ratio"),
        (["--rule", "coordination", "--contact-angle", "5"], "also needs --coordination"),
        (["--rule", "coordination", "--coordination", "6"], "also needs --contact-angle"),
        (["--rule", "hertz", "--coordination", "6"], "--coordination has no effect with the contact rule hertz"),
        (["--roughness", "1e-6"], "takes height, slope and hardness"),
        (["--gas", "helium", "--pressure", "1e5"], "needs a temperature"),
        (["--gas", "helium", "--pressure", "1e5", "--temperature", "300", "--pore-conductivity", "1"], "leave one"),
        (["--pressure", "1e5"], "a pressure needs a gas"),
        (["--emissivity", "0.8"], "needs a temperature"),
        (["--temperature", "-5"], "--temperature is a positive number of kelvins, found -5"),
        (["--temperature", "nan"], "--temperature is a positive number of kelvins, found nan"),
        (["--material", "copper"], "needs --temperature"),
        (["--material", "copper", "--temperature", "300", "--conductivity", "5"], "leave one of them out"),
    ],
)
def test_refusals_are_one_line(bed, options, message, capfd):
    assert run(["solve", *bed, *options]) == 2
    error = capfd.readouterr().err
    assert message in error and error.count("\n") == 1


def test_walls_of_two_temperatures(tmp_path, capfd):
    """Properties at the local temperature: the wall's mean for a small difference, more radiation for a large one."""
    r, n = 0.5e-3, 3
    grid = (np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3) + 0.5) * 2.0 * r
    file = tmp_path / "bed.csv"
    file.write_text("x,y,z,radius\n" + "\n".join(",".join(repr(float(v)) for v in (*x, r)) for x in grid) + "\n")
    bed = [str(file), "--box", ",".join([repr(2.0 * r * n)] * 3), "--periodic", "xy", "--axis", "z"]
    gas = ["--gas", "helium", "--pressure", "1e5", "--emissivity", "0.8", "--material", "alumina"]
    near = solved(capfd, *bed, *gas, "--wall-temperatures", "601:599")
    assert near["conductivity_between_walls"] == pytest.approx(near["conductivity"], rel=1e-4)
    assert abs(near["heat_imbalance"]) < 1e-7
    far = solved(capfd, *bed, *gas, "--wall-temperatures", "300:900")
    assert far["conductivity"] == pytest.approx(near["conductivity"], rel=1e-9)
    assert far["heat_flow"] == pytest.approx(far["conductivity_between_walls"] * 600.0 * 2.0 * r * n, rel=1e-9)
    assert far["conductivity_between_walls"] != pytest.approx(near["conductivity"], rel=1e-4)
    assert far["nonlinear_iterations"] > 2
    walled = [*bed[:3], "--axis", "all"]
    every = solved(capfd, *walled, *gas, "--wall-temperatures", "300:900")
    assert set(every["conductivity_between_walls_per_axis"]) == {"x", "y", "z"}
    assert every["conductivity_between_walls_per_axis"]["y"] == pytest.approx(every["conductivity_between_walls"])
    rare = ["--gas", "helium", "--pressure", "100", "--material", "alumina", "--temperature", "600"]
    assert run(["solve", *bed, *rare]) == 0
    assert "the gas is no continuum" in capfd.readouterr().err
    partly = solved(capfd, *bed[:-2], "--axis", "all", *gas, "--wall-temperatures", "300:900")
    assert set(partly["conductivity_between_walls_per_axis"]) == {"z"}
    assert partly["conductivity_between_walls"] == pytest.approx(far["conductivity_between_walls"], rel=1e-9)


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        (["--wall-temperatures", "900"], "two temperatures"),
        (["--wall-temperatures", "900:600"], "need method facets (spheres"),
        (["--wall-temperatures", "900:600", "--plot", "field.png"], "no field at the local temperature is written"),
    ],
)
def test_what_walls_need(bed, capfd, extra, message):
    assert run(["solve", *bed, *extra]) == 2
    assert message in capfd.readouterr().err


def test_the_text_separates_every_name_from_its_value(bed, capfd):
    assert run(["solve", *bed, "--contact-resistance", "0.1"]) == 0
    assert "\ncontact resistance      0.1\n" in capfd.readouterr().out
    assert solved(capfd, *bed, "--contact-resistance", "0.1")["contact_resistance"] == 0.1
    assert "contact_resistance" not in solved(capfd, *bed)
    print_table({"conductivity_between_walls_per_axis": {"x": 1.0}, "particles": 3})
    assert capfd.readouterr().out.splitlines() == [
        "conductivity between walls per axis x 1 W/(m K)",
        "particles                           3",
    ]
