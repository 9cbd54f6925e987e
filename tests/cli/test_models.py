"""The ``models`` command: the list, a record, a value, and refused input."""

from __future__ import annotations

import json
import math

import pytest
from click.testing import CliRunner

from etc_engine.cli import run
from etc_engine.cli.models import models_command
from etc_engine.errors import InputError
from etc_engine.models import CATALOGUE, evaluate

MAXWELL = ["maxwell", "--k1", "1", "--k2", "10", "--fraction", "0.3", "--dimension", "2"]


def printed(*arguments: str) -> str:
    result = CliRunner().invoke(models_command, list(arguments), catch_exceptions=False)
    assert result.exit_code == 0
    return result.stdout


def test_the_list_names_dimension_inputs_and_reference_of_every_model():
    lines = printed().splitlines()
    for model in CATALOGUE.values():
        row = next(i for i, line in enumerate(lines) if line.split()[0] == model.name)
        for dimension in model.dimensions:
            assert f"{dimension}D" in lines[row]
        for item in model.inputs:
            assert item.name in lines[row]
        assert model.reference in lines[row + 1]


def test_the_list_as_json():
    records = json.loads(printed("--json"))["models"]
    assert [record["model"] for record in records] == list(CATALOGUE)
    assert all(record["inputs"] and record["reference"] and record["dimensions"] for record in records)


def test_evaluating_prints_one_json_object():
    record = json.loads(printed(*MAXWELL, "--json"))
    assert record["model"] == "maxwell"
    beta = 9.0 / 11.0
    assert record["conductivity"] == pytest.approx((1 + 0.3 * beta) / (1 - 0.3 * beta), rel=1e-14)
    assert (record["k1"], record["k2"], record["fraction"], record["dimension"]) == (1.0, 10.0, 0.3, 2)
    assert record["parameters"] == {}


def test_evaluating_in_words():
    assert printed(*MAXWELL).startswith("1.65060241 W/(m K)")


def test_a_record_in_words():
    text = printed("zbs_contact")
    assert "contact_fraction" in text
    assert "default 0.0077" in text
    assert "Int. Chem. Eng. 18, 189 (1978)" in text
    assert json.loads(printed("zbs_contact", "--json"))["dimensions"] == [3]


def test_further_parameters():
    case = ["third_order", "--k1", "1", "--k2", "10", "--fraction", "0.3", "--dimension", "3", "--set", "zeta2=0.2"]
    record = json.loads(printed(*case, "--json"))
    assert record["parameters"] == {"zeta2": 0.2}
    expected = evaluate("third_order", k1=1.0, k2=10.0, fraction=0.3, dimension=3, zeta2=0.2)
    assert record["conductivity"] == float(expected)


def test_insulating_pores_and_superconducting_particles():
    pores = ["hashin_shtrikman_upper", "--k1", "0", "--k2", "1", "--fraction", "0.8", "--dimension", "2", "--json"]
    assert json.loads(printed(*pores))["conductivity"] == pytest.approx(2 / 3, rel=1e-14)
    spheres = ["simple_cubic", "--k1", "1", "--k2", "inf", "--fraction", "0.3", "--json"]
    assert json.loads(printed(*spheres))["conductivity"] == pytest.approx(2.3328845, abs=5.1e-8)


def test_an_input_the_model_does_not_use_may_be_left_out():
    case = ["contact_mean_field", "--fraction", "0.8", "--dimension", "2", "--json"]
    for setting in ("coordination=4", "conductance_distance2=1.2", "radius_moment=1"):
        case += ["--set", setting]
    assert json.loads(printed(*case))["conductivity"] == pytest.approx(0.8 * 4 * 0.3 / math.pi, rel=1e-14)


REFUSED = [
    (["maxwel"], "did you mean maxwell"),
    (["--k1", "1"], "which model?"),
    ([*MAXWELL[:5], "--dimension", "2"], "also needs --fraction"),
    ([*MAXWELL[:7]], "also needs --dimension"),
    ([*MAXWELL, "--set", "zeta2"], "NAME=VALUE"),
    ([*MAXWELL, "--set", "zeta2=much"], "NAME=VALUE"),
    ([*MAXWELL, "--set", "zeta2=0.1"], "no parameter 'zeta2'"),
    (["third_order", *MAXWELL[1:], "--set", "zeta2=0.1", "--set", "zeta2=0.2"], "given twice"),
    (["maxwell", "--k1", "1", "--k2", "nan", "--fraction", "0.3", "--dimension", "2"], "found nan"),
    (["maxwell", "--k1", "1", "--k2", "2", "--fraction", "1.3", "--dimension", "2"], "must lie in [0, 1]"),
    (["bcc", *MAXWELL[1:]], "holds for dimension 3"),
]


@pytest.mark.parametrize(("arguments", "words"), REFUSED)
def test_refused_input_is_an_input_error(arguments, words):
    with pytest.raises(InputError, match=r".") as caught:
        CliRunner().invoke(models_command, arguments, catch_exceptions=False)
    assert words in str(caught.value)


@pytest.mark.parametrize(("arguments", "words"), REFUSED)
def test_refused_input_is_one_line_and_status_2(arguments, words, capsys):
    assert run(["models", *arguments]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert words in captured.err
