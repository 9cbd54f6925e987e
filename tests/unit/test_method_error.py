"""The error of the method in comparisons: table, band, figure, and which model may be called the closest."""

from __future__ import annotations

import json

import numpy as np
import pytest

from etc_engine.comparison import evaluate_models, fit_models, model_lines
from etc_engine.comparison.closest import closest_words
from etc_engine.comparison.fits import Parameter
from etc_engine.models import evaluate
from etc_engine.output.figures import draw_comparison
from etc_engine.service.curve import curve_of
from etc_engine.sweep.result_file import open_dataset, write_dataset

FILLED = """
schema = 2
name = "made"
seed = 20263
[packing]
radii = "uniform:0.01:0.02"
box = [1.0, 1.0]
density = [0.3, 0.4, 0.5]
[particles]
conductivity = 40.0
[pores]
conductivity = 1.0
[conduction]
engine = "voxel"
[statistics]
realizations = 3
"""
BONDED = FILLED.replace("conductivity = 1.0\n", "conductivity = 0.0\n").replace(
    '[conduction]\nengine = "voxel"', '[contacts]\nrule = "bonded"\ncontact_angle = 5.0'
)
NAMES = ("maxwell", "differential", "effective_medium")


def near(model: str, factor: float):
    """Conductivity of a model times a factor, with a scatter of .1 %."""

    def conduct(density, angle, method, realization):
        k = evaluate(model, k1=1.0, k2=40.0, fraction=density, dimension=2)
        return float(factor * k * (1.0 + 1e-3 * (realization - 1)))

    return conduct


def swept(made_sweep, error: float, factor: float = 1.02):
    dataset = made_sweep(FILLED, near("differential", factor))
    dataset["model_error_estimate"][:] = error
    return dataset


def test_the_error_of_the_method_is_a_part_of_the_band(made_sweep):
    result = evaluate_models(swept(made_sweep, 0.2), NAMES)
    k = result["conductivity_mean"]
    # the estimate is relative, of every realization
    assert np.allclose(result["method_error"], 0.2 * k, rtol=1e-12)
    assert np.allclose(result["band_low"], result["conductivity_ci_low"] - result["method_error"], rtol=1e-12)
    assert np.allclose(result["band_high"], result["conductivity_ci_high"] + result["method_error"], rtol=1e-12)
    unknown = evaluate_models(swept(made_sweep, np.nan), NAMES)
    assert unknown["method_error"].isnull().all()
    assert np.allclose(unknown["band_high"], unknown["conductivity_ci_high"], rtol=1e-14)


@pytest.mark.parametrize(("error", "named"), [(0.001, "differential"), (np.nan, "differential"), (0.05, "")])
def test_a_model_inside_the_error_is_never_called_the_closest(made_sweep, error, named):
    """The simulation is 2 % above the differential medium, and 6 % or more from the others."""
    result = evaluate_models(swept(made_sweep, error), NAMES)
    assert result.attrs["best_model"] == named
    assert str(result["best_model"].item()) == named
    words = " ".join(closest_words(result))
    if named:
        assert words.startswith("closest model over the sweep: differential, rms relative difference 2.0 %")
    else:
        assert result.attrs["within_error"] == "differential"
        assert "no closest model is named: differential agree" in words


def test_a_model_is_not_the_closest_where_the_error_can_change_the_order(made_sweep):
    """Half-way between two models: both outside the error, the order of the two not known."""
    made = [
        np.array([evaluate(name, k1=1.0, k2=40.0, fraction=f, dimension=2) for f in (0.3, 0.4, 0.5)])
        for name in ("maxwell", "differential")
    ]
    between = dict(zip((0.3, 0.4, 0.5), 0.49 * made[0] + 0.51 * made[1], strict=True))
    dataset = made_sweep(FILLED, lambda f, *_: float(between[f]))
    dataset["model_error_estimate"][:] = 0.02
    result = evaluate_models(dataset, ("maxwell", "differential"))
    assert result.attrs["best_model"] == ""
    assert result.attrs["within_error"] == ""
    assert "change places" in closest_words(result)[0]


def test_a_model_that_knows_more_is_named_with_what_it_knows(made_sweep):
    dataset = made_sweep(BONDED, lambda f, *_: 0.21 * f, mean_field=0.09)
    result = evaluate_models(dataset)
    assert result.attrs["best_model"] == "contact_mean_field"
    assert result.attrs["best_plain_model"] not in ("", "contact_mean_field")
    first, second = closest_words(result)
    assert "contact_mean_field (it knows the contacts of every packing)" in first
    assert second.startswith("closest of the models that know the solid fraction alone: ")


def test_table_json_figure_and_report_show_the_error(made_sweep, tmp_path, etc_engine):
    dataset = swept(made_sweep, 0.05)
    path, page = tmp_path / "out.nc", tmp_path / "page.html"
    write_dataset(dataset, path)
    done = etc_engine("compare", path)
    assert done.returncode == 0
    rows = [line.split() for line in done.stdout.splitlines() if line.startswith("      0.")]
    k = [float(row[3]) for row in rows]
    assert len(rows) == 3
    assert [float(row[6]) for row in rows] == pytest.approx(0.05 * np.array(k), rel=1e-2)
    assert "no closest model is named" in done.stdout
    record = json.loads(etc_engine("compare", path, "--json").stdout)
    assert record["best_model"] is None
    assert record["within_error"] == ["differential"]
    assert record["cells"][0]["method_error"] == pytest.approx(0.05 * record["cells"][0]["conductivity_mean"])
    assert etc_engine("report", path, "-o", page).returncode == 0
    assert "method error [%]" in page.read_text()
    assert "<td>5.00</td>" in page.read_text()
    curve = curve_of(open_dataset(path))
    assert curve["method_error"] == pytest.approx(0.05)
    assert (curve["best_model"], curve["within_error"]) == ("", ["differential"])
    comparison = evaluate_models(dataset)
    figure = draw_comparison(comparison, model_lines(comparison))
    narrow, wide = (band.get_paths()[0].vertices[:, 1] for band in figure.axes[0].collections[:2])
    assert wide.max() == pytest.approx(float(comparison["band_high"].max()))
    assert narrow.max() < wide.max()


def test_a_fit_that_the_densities_do_not_determine_says_so(made_sweep, tmp_path, etc_engine):
    """k = (f - .35)^1.5 with a scatter of 8 %: the threshold is a long way below the densities."""
    rng = np.random.default_rng(20266)
    text = BONDED.replace("[0.3, 0.4, 0.5]", "[0.6, 0.65, 0.7, 0.75, 0.8]")
    dataset = made_sweep(text, lambda f, *_: float((f - 0.35) ** 1.5 * (1.0 + 0.08 * rng.normal())))
    fit = fit_models(dataset)[0]
    threshold = fit.parameters[0]
    assert not threshold.determined
    assert fit.constants == "threshold and exponent and prefactor not determined by these densities"
    path = tmp_path / "out.nc"
    write_dataset(dataset, path)
    told = etc_engine("compare", path).stdout
    assert fit.constants in told
    assert f"{threshold.value:.4g}" not in told
    record = json.loads(etc_engine("compare", path, "--json").stdout)
    assert record["fits"][0]["parameters"][0]["determined"] is False
    assert etc_engine("report", path, "-o", tmp_path / "page.html").returncode == 0
    assert fit.constants in (tmp_path / "page.html").read_text()


@pytest.mark.parametrize(
    ("low", "high", "determined"),
    [(1.251, 1.356, True), (-0.81, 1.54, False), (np.nan, np.nan, False), (0.9, 1.7, True), (0.3, 2.3, False)],
)
def test_a_constant_is_determined_by_an_interval_narrower_than_itself(low, high, determined):
    assert Parameter("exponent", 1.303, low, high).determined is determined
