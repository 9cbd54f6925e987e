"""The ``materials`` command: the list, a record, values, and refused input."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from etc_engine.cli import run
from etc_engine.cli.materials import materials_command
from etc_engine.materials import CATALOGUE

pytest.importorskip("CoolProp")


def printed(*arguments: str) -> str:
    result = CliRunner().invoke(materials_command, list(arguments), catch_exceptions=False)
    assert result.exit_code == 0
    return result.stdout


def test_the_list_names_every_solid_its_range_and_source():
    text = printed()
    for solid in CATALOGUE.values():
        assert solid.name in text and solid.conductivity.source in text
    assert "helium" in text


def test_the_list_as_json():
    record = json.loads(printed("--json"))
    assert [item["material"] for item in record["solids"]] == list(CATALOGUE)
    assert all(p["source"] for item in record["solids"] for p in item["properties"])


def test_a_solid_at_a_temperature():
    record = json.loads(printed("SS316", "--temperature", "600", "--json"))
    assert record["conductivity"] == pytest.approx(-7.301e-6 * 600**2 + 0.02716 * 600 + 6.308)
    assert record["youngs_modulus"] == pytest.approx(174.29e9)


def test_a_gas_with_its_jump_length():
    record = json.loads(printed("helium", "--temperature", "300", "--pressure", "1e5", "--json"))
    assert record["conductivity"] == pytest.approx(0.1560, abs=5e-5)
    text = printed("helium", "--temperature", "300", "--pressure", "0", "--accommodation", "0.3", "--json")
    assert json.loads(text)["jump_length"] is None  # infinite in vacuum


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["kupfer"], "there is no material named"),
        (["copper", "--temperature", "3000"], "known from 200 to 1200 K"),
        (["copper", "--pressure", "1e5"], "only valid with a gas"),
        (["helium", "--pressure", "1e5"], "also need --temperature"),
        (["--temperature", "300"], "which material"),
    ],
)
def test_refusals_are_one_line_and_status_two(arguments, message, capfd):
    assert run(["materials", *arguments]) == 2
    error = capfd.readouterr().err
    assert message in error and error.count("\n") == 1
