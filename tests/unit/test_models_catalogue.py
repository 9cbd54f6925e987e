"""The catalogue: complete records, and errors that say what was found, expected and to do."""

import ast
import math
import sys
from pathlib import Path

import numpy as np
import pytest

import etc_engine.models
from etc_engine.errors import InputError
from etc_engine.models import CATALOGUE, evaluate

REQUIRED = {
    "maxwell",
    "maxwell_inverse",
    "hashin_shtrikman_lower",
    "hashin_shtrikman_upper",
    "effective_medium",
    "differential",
    "third_order",
    "square_array",
    "hexagonal_array",
    "simple_cubic",
    "bcc",
    "fcc",
    "zehner_schluender",
    "series",
    "parallel",
    "lewis_nielsen",
    "agari_uno",
    "russell",
    "three_point_lower",
    "three_point_upper",
    "hasselman_johnson",
    "zbs_contact",
    "kunii_smith",
    "yagi_kunii",
    "krupiczka",
    "woodside_messmer",
    "hadley",
    "batchelor_obrien",
    "contact_mean_field",
    "kirkpatrick",
    "percolation_power_law",
    "zehner_bauer_schluender",
    "breitbach_barthels",
    "kunii_smith_radiation",
    "hsu_cubes",
    "hsu_square_cylinders",
    "hamilton_crosser",
}

GOOD = {"k1": 1.0, "k2": 10.0, "fraction": 0.3, "dimension": 2}


def test_every_promised_model_is_there():
    assert set(CATALOGUE) >= REQUIRED


@pytest.mark.parametrize("model", CATALOGUE.values(), ids=CATALOGUE)
def test_records_are_complete(model):
    assert model.kind in ("estimate", "lower bound", "upper bound", "exact")
    assert model.dimensions and set(model.dimensions) <= {2, 3}
    assert model.title and model.validity and model.limits
    assert any(year in model.reference for year in ("(18", "(19"))
    for item in model.inputs:
        assert item.meaning and item.unit


def test_rigorous_bounds():
    bounds = {name for name, model in CATALOGUE.items() if model.rigorous}
    assert bounds == {
        "series",
        "parallel",
        "hashin_shtrikman_lower",
        "hashin_shtrikman_upper",
        "three_point_lower",
        "three_point_upper",
    }


def test_the_catalogue_cannot_be_changed():
    with pytest.raises(TypeError):
        CATALOGUE["mine"] = CATALOGUE["maxwell"]


@pytest.mark.parametrize(
    ("name", "case", "words"),
    [
        ("maxwel", {}, ["'maxwel'", "did you mean maxwell"]),
        ("wiener_upper", {}, ["did you mean", "parallel"]),
        ("zbs", {}, ["did you mean zbs_contact"]),
        ("qqq", {}, ["there are: series"]),
        ("maxwell", {"fraction": 1.2}, ["fraction", "[0, 1]", "1.2"]),
        ("maxwell", {"fraction": np.array([0.5, -0.1])}, ["[0, 1]", "-0.1"]),
        ("maxwell", {"fraction": math.nan}, ["fraction", "nan"]),
        ("maxwell", {"fraction": "much"}, ["must be a number", "'much'"]),
        ("maxwell", {"k1": -1.0}, ["k1", "[0, inf]", "-1"]),
        ("maxwell", {"k2": math.nan}, ["k2", "nan"]),
        ("maxwell", {"dimension": 4}, ["dimension 2 or 3", "4"]),
        ("square_array", {"dimension": 3}, ["dimension 2", "3"]),
        ("bcc", {}, ["dimension 3", "2"]),
        ("square_array", {"fraction": 0.8}, ["[0, 0.785398)", "0.8"]),
        ("zehner_schluender", {"dimension": 3, "k1": 0.0}, ["k1", "(0, inf)", "0"]),
        ("lewis_nielsen", {"dimension": 3, "fraction": 0.7}, ["no value at 1 of 1", "maximum fraction"]),
        ("kirkpatrick", {}, ["also needs coordination", "coordination number z"]),
        ("kirkpatrick", {"coordination": 1.0}, ["coordination", "[2, inf)", "1"]),
        ("maxwell", {"zeta2": 0.1}, ["no parameter 'zeta2'", "none"]),
        ("third_order", {"zeta": 0.1}, ["no parameter 'zeta'", "zeta2"]),
        ("batchelor_obrien", {"dimension": 3}, ["no value at 1 of 1", "about 1000"]),
        ("hadley", {"dimension": 3}, ["[0.42, 1]", "0.3"]),
    ],
)
def test_bad_input_is_named(name, case, words):
    with pytest.raises(InputError) as caught:
        evaluate(name, **{**GOOD, **case})
    message = str(caught.value)
    assert "\n" not in message
    for word in words:
        assert word in message


def test_an_optional_parameter_left_at_none_is_left_out():
    assert evaluate("third_order", **GOOD, zeta2=None) == evaluate("third_order", **GOOD)


def test_models_import_only_numpy_scipy_and_errors():
    """The room is a leaf: it knows nothing of the engine, and labelled arrays by their behaviour alone."""
    allowed = ("numpy", "scipy", "etc_engine.errors", "etc_engine.arrays", "etc_engine.models")
    files = sorted(Path(etc_engine.models.__file__).parent.glob("*.py"))
    assert len(files) > 5
    for file in files:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) else []
            for name in names:
                assert name.split(".")[0] in sys.stdlib_module_names or name.startswith(allowed), (
                    file.name,
                    name,
                )
