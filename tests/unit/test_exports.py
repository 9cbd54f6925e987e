"""Exports of the conductivity over temperature and pressure: parsed back, fits, refusals."""

from __future__ import annotations

import io
import json
import os
import re
import shutil
import subprocess

import numpy as np
import pytest
import xarray as xr

from etc_engine.errors import InputError
from etc_engine.output.exports import EXPORTS, curves_of, fit_curve
from etc_engine.output.exports.curves import Curve
from etc_engine.study.quantities import QUANTITIES

TEMPERATURE = np.array([300.0, 450.0, 600.0, 750.0, 900.0, 1050.0])
PRESSURE = np.array([1e3, 1e5])


def truth(t, p):
    """A bed whose radiation grows as T^3."""
    return (0.5 + 0.2 * np.log10(p / 1e3)) + 4e-10 * t**3


def sweep(pressures=PRESSURE, temperatures=TEMPERATURE, realizations=9, scatter=0.01):
    """Result of a sweep over temperature and pressure, made up: isotropic tensors with normal scatter."""
    rng = np.random.default_rng(83)
    dims = ("density", "pressure", "temperature", "realization")
    shape = (1, len(pressures), len(temperatures), realizations)
    mean = truth(np.asarray(temperatures)[None, None, :, None], np.asarray(pressures)[None, :, None, None])
    k = np.broadcast_to(mean, shape) * (1.0 + scatter * rng.standard_normal((*shape[:3], realizations)))
    tensor = np.full((*shape, 3, 3), np.nan)
    for i in range(3):
        tensor[..., i, i] = k
    return xr.Dataset(
        {
            "conductivity": ((*dims, "direction_i", "direction_j"), tensor),
            "conductivity_mean": ((*dims[:3], "direction_i", "direction_j"), tensor.mean(axis=3)),
            "count": (dims[:3], np.full(shape[:3], realizations)),
            "solid_fraction": (dims, np.full(shape, 0.6)),
            "status": (dims, np.zeros(shape, dtype=int)),
        },
        coords={
            "density": ("density", [0.6], QUANTITIES["density"].attributes(3)),
            "pressure": ("pressure", list(pressures), QUANTITIES["pressure"].attributes(3)),
            "temperature": ("temperature", list(temperatures), QUANTITIES["temperature"].attributes(3)),
        },
        attrs={
            "study_resolved": json.dumps({"name": "pebble bed"}),
            "confidence_level": 0.95,
            "source": "etc_engine 0",
            "commit": "abc",
            "study_digest": "0123",
        },
    )


def hit(text):
    """Minimal reader of MOOSE's input: nested blocks of ``name = value``; comments begin with #."""
    root: dict = {}
    stack = [root]
    for raw in text.splitlines():
        line = raw.split("#")[0].strip()
        if not line:
            continue
        if line == "[]":
            stack.pop()
            assert stack, "a block closed that was not open"
        elif match := re.fullmatch(r"\[(\w+)\]", line):
            stack.append(stack[-1].setdefault(match[1], {}))
        else:
            key, value = (part.strip() for part in line.split("=", 1))
            stack[-1][key] = value.strip("'")
    assert stack == [root], "a block is not closed"
    return root


def foam(text):
    """Minimal reader of an OpenFOAM dictionary: nested dictionaries of ``key value;``, comments begin with //."""
    words = re.findall(r"[{};]|[^\s{};]+", re.sub(r"//[^\n]*", "", text))
    root: dict = {}
    stack, entry = [root], []
    for word in words:
        if word == "{":
            stack.append(stack[-1].setdefault(entry[0], {}))
            entry = []
        elif word == "}":
            stack.pop()
        elif word == ";":
            stack[-1][entry[0]] = " ".join(entry[1:])
            entry = []
        else:
            entry.append(word)
    assert stack == [root] and not entry
    return root


def numbers(text):
    return np.array([float(word) for word in text.split()])


def test_csv_holds_every_cell_with_its_interval():
    curves, source = curves_of(sweep(), {})
    text = EXPORTS["csv"](curves, source)
    rows = [line for line in text.splitlines() if not line.startswith("#")]
    assert rows[0].split(",")[:3] == ["density", "pressure [Pa]", "temperature [K]"]
    table = np.genfromtxt(io.StringIO("\n".join(rows[1:])), delimiter=",")
    assert table.shape == (12, 7)
    mean = table[:, 3]
    np.testing.assert_array_equal(mean, np.concatenate([curve.conductivity for curve in curves]))
    assert (table[:, 4] < mean).all() and (mean < table[:, 5]).all() and (table[:, 6] == 9).all()
    assert "intervals of 95 %" in text and "commit: abc" in text


def test_the_error_of_the_method_is_named_beside_the_intervals():
    data = sweep()
    assert "Estimated error" not in EXPORTS["csv"](*curves_of(data, {}))
    data["model_error_estimate"] = data["status"] * 0.0 + 0.043
    text = EXPORTS["csv"](*curves_of(data, {}))
    assert "# Estimated error of the method, not in the intervals: up to 4.3 %.\n" in text


def test_intervals_below_zero_are_counted_in_words():
    assert "below 0" not in EXPORTS["csv"](*curves_of(sweep(), {}))
    data = sweep(pressures=PRESSURE[:1], temperatures=TEMPERATURE[:1], realizations=2, scatter=0.0)
    data["conductivity"] *= np.array([0.1, 1.9])[:, None, None]
    for form, write in EXPORTS.items():
        assert "below 0: 1. Student's interval is symmetric" in write(*curves_of(data, {})), form


def test_csv_takes_units_from_the_result():
    """Every dimension with a unit has it in the header, whether it is varied or fixed."""
    resistance = QUANTITIES["contact_resistance"].attributes(2)
    data = sweep().assign_coords(contact_resistance=((), 2.0, resistance))
    header = next(line for line in EXPORTS["csv"](*curves_of(data, {})).splitlines() if not line.startswith("#"))
    assert header.split(",")[:4] == ["density", "pressure [Pa]", "contact_resistance [m K/W]", "temperature [K]"]


def test_moose_reads_back_as_a_table_and_a_polynomial():
    curves, source = curves_of(sweep(), {})
    parsed = hit(EXPORTS["moose"](curves, source))
    for i, curve in enumerate(curves):
        table = parsed["Functions"][f"pebble_bed_{i}_table"]
        assert table["type"] == "PiecewiseLinear"
        np.testing.assert_array_equal(numbers(table["x"]), curve.temperature)
        np.testing.assert_array_equal(numbers(table["y"]), curve.conductivity)
        expression = parsed["Functions"][f"pebble_bed_{i}_fit"]["expression"].replace("^", "**")
        values = np.array([eval(expression, {"t": t}) for t in curve.temperature])
        assert (np.abs(values - curve.conductivity) <= curve.half_width).all()
        material = parsed["Materials"][f"pebble_bed_{i}"]
        assert material["thermal_conductivity_temperature_function"] == f"pebble_bed_{i}_table"


def test_comsol_reads_back_as_a_spreadsheet():
    curves, source = curves_of(sweep(), {})
    text = EXPORTS["comsol"](curves, source)
    table = np.loadtxt(io.StringIO(text), comments="%")
    assert table.shape == (12, 5)
    np.testing.assert_array_equal(table[:6, 0], TEMPERATURE)
    np.testing.assert_array_equal(table[:6, 1], 1e3)
    np.testing.assert_array_equal(table[6:, 2], curves[1].conductivity)
    assert "% T p k k_low k_high" in text
    expression = re.findall(r"expression: \((.*)\)\[W", text)[0].replace("(T/1[K])", "T").replace("^", "**")
    assert eval(expression, {"T": 600.0}) == pytest.approx(float(truth(600.0, 1e3)), rel=0.02)


def test_openfoam_reads_back_as_eight_coefficients():
    curves, source = curves_of(sweep(), {"pressure": "1e5"})
    parsed = foam(EXPORTS["openfoam"](curves, source))
    assert parsed["FoamFile"]["class"] == "dictionary"
    coefficients = numbers(parsed["transport"]["kappaCoeffs<8>"].strip("()"))
    assert coefficients.size == 8
    values = np.polynomial.polynomial.polyval(TEMPERATURE, coefficients)
    assert (np.abs(values - curves[0].conductivity) <= curves[0].half_width).all()


@pytest.mark.skipif(shutil.which("foamDictionary") is None, reason="OpenFOAM is not installed")
def test_openfoam_itself_reads_it(tmp_path):
    curves, source = curves_of(sweep(), {"pressure": "1e5"})
    file = tmp_path / "bedTransport"
    file.write_text(EXPORTS["openfoam"](curves, source))
    places = {"WM_PROJECT_DIR": "/usr/share/openfoam", **os.environ}  # where Debian keeps etc/controlDict
    command = ["foamDictionary", "-entry", "transport/kappaCoeffs<8>", "-value", str(file)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=places)
    found = numbers(done.stdout.strip().strip("()"))
    np.testing.assert_allclose(found[: fit_curve(curves[0]).order + 1], fit_curve(curves[0]).coefficients, rtol=1e-5)


def test_the_order_is_the_lowest_the_intervals_allow():
    t = np.linspace(300.0, 1200.0, 10)
    cubic = 0.5 + 4e-10 * t**3
    orders = [fit_curve(Curve(t, cubic, np.full(10, half), np.full(10, 9), {})).order for half in (1.0, 0.05, 1e-9)]
    assert orders == [0, 2, 3]
    exact = fit_curve(Curve(t, cubic, np.full(10, 1e-9), np.full(10, 9), {}))
    np.testing.assert_allclose(exact.coefficients, [0.5, 0.0, 0.0, 4e-10], atol=1e-9)
    assert exact.within and exact.residual < 1e-9


def test_a_fit_that_misses_an_interval_says_so():
    t = np.linspace(300.0, 1200.0, 6)
    jagged = np.array([1.0, 2.0, 1.0, 2.0, 1.0, 2.0])
    fit = fit_curve(Curve(t, jagged, np.full(6, 1e-6), np.full(6, 3), {}))
    assert not fit.within and "BEYOND" in fit.lines[0]


def test_single_realizations_have_no_interval():
    curves, source = curves_of(sweep(realizations=1, scatter=0.0), {"pressure": "1000"})
    assert fit_curve(curves[0]).within  # to 0.1 %
    csv = EXPORTS["csv"](curves, source)
    assert csv.splitlines()[-1].endswith(",,,1")
    assert "k_low" not in EXPORTS["comsol"](curves, source)


def test_without_temperature_the_value_is_a_constant():
    data = sweep().isel(temperature=0, pressure=0, drop=True)
    curves, source = curves_of(data, {})
    assert "kappa " in EXPORTS["openfoam"](curves, source)
    material = hit(EXPORTS["moose"](curves, source))["Materials"]["pebble_bed"]
    assert float(material["prop_values"]) == curves[0].conductivity[0]
    with pytest.raises(InputError, match="needs an argument"):
        EXPORTS["comsol"](curves, source)


def test_cells_without_a_conductivity_stay_out():
    data = sweep()
    data["conductivity_mean"][0, 0, 2] = np.nan
    curves, _ = curves_of(data, {})
    assert 600.0 not in curves[0].temperature and 600.0 in curves[1].temperature


@pytest.mark.parametrize(
    ("at", "form", "message"),
    [
        ({}, "openfoam", "holds one curve, this result has 2"),
        ({"pressure": "7"}, "csv", "has no value 7"),
        ({"pressure": "much"}, "csv", "takes a number"),
        ({"angle": "7"}, "csv", "has no dimension 'angle'"),
    ],
)
def test_refusals(at, form, message):
    with pytest.raises(InputError, match=message):
        EXPORTS[form](*curves_of(sweep(), at))


def test_the_command_writes_whole_files_and_refuses_in_one_line(tmp_path, capfd):
    from etc_engine.cli import run

    data = sweep()
    data.to_netcdf(tmp_path / "out.nc")
    out = tmp_path / "bed.i"
    assert run(["export", str(tmp_path / "out.nc"), "--to", "moose", "-o", str(out)]) == 0
    assert hit(out.read_text())["Materials"]
    capfd.readouterr()
    assert run(["export", str(tmp_path / "out.nc"), "--to", "csv"]) == 0
    assert "conductivity [W/(m K)]" in capfd.readouterr().out
    assert run(["export", str(tmp_path / "out.nc"), "--to", "openfoam"]) == 2
    assert capfd.readouterr().err.count("\n") == 1
    assert run(["export", str(tmp_path / "out.nc"), "--to", "csv", "--at", "pressure"]) == 2
