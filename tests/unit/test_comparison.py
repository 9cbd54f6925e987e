"""Models beside a sweep: values, intervals, bounds, the closest model, and fitted constants."""

from __future__ import annotations

import numpy as np
import pytest
import xarray
from scipy import stats

from etc_engine.comparison import evaluate_models, fit_models, model_curve, phases
from etc_engine.comparison.simulation import simulated
from etc_engine.errors import InputError
from etc_engine.models import evaluate
from etc_engine.models.filled_polymers import agari_uno, lewis_nielsen
from etc_engine.sweep.statistics import interval

OVERLAP = """
schema = 2
name = "made"
seed = 20263
[packing]
radii = "uniform:0.01:0.02"
box = [1.0, 1.0]
density = [0.5, 0.6, 0.7, 0.8, 0.9]
[contacts]
rule = "overlap"
[particles]
conductivity = 2.0
[statistics]
realizations = 4
confidence = 0.9
"""
BONDED = OVERLAP.replace('rule = "overlap"', 'rule = "bonded"\ncontact_angle = [5.0, 10.0]')
CONDUCTING_PORES = OVERLAP + "[pores]\nconductivity = 0.2\n[conduction]\nengine = 'voxel'\n"


def noisy(density, angle, method, realization):
    rng = np.random.default_rng([20264, int(1000 * density), int(10 * (angle or 0.0)), realization])
    return tuple(0.6 * density * (1.0 + 0.1 * rng.normal(size=2)))


def constants(fits, model, **selection):
    (fit,) = [fit for fit in fits if fit.model == model and fit.selection == selection]
    return {p.name: p for p in fit.parameters}, fit


def test_a_binding_bound_may_be_reached_and_not_passed(made_sweep):
    bound = {f: evaluate("hashin_shtrikman_upper", k1=0.0, k2=2.0, fraction=f, dimension=2) for f in (0.5, 0.6, 0.7)}
    at = evaluate_models(made_sweep(OVERLAP, lambda f, *_: bound.get(f, 0.1)))
    assert at.attrs["bound_broken"] == 0
    assert at["inside_bounds"].all()
    beyond = evaluate_models(made_sweep(OVERLAP, lambda f, *_: 1.001 * bound[f] if f == 0.6 else 0.1))
    assert beyond.attrs["bound_broken"] == 1
    assert beyond["inside_bounds"].values.tolist() == [True, False, True, True, True]
    broken = beyond["bound_broken"].sel({"model": "hashin_shtrikman_upper"})
    assert broken.values.tolist() == [False, True, False, False, False]
    assert int(beyond["bound_broken"].sum()) == 1


@pytest.mark.parametrize(("excess", "broken"), [(1.005, 0), (1.02, 1)])
def test_a_method_that_estimates_no_error_breaks_no_bound_of_pores_that_conduct_by_little(made_sweep, excess, broken):
    """Disks of 2 W/(m K) in pores of 1.9: the bounds lie closer together than the methods are exact."""
    upper = {
        f: evaluate("hashin_shtrikman_upper", k1=1.9, k2=2.0, fraction=f, dimension=2)
        for f in (0.5, 0.6, 0.7, 0.8, 0.9)
    }
    dataset = made_sweep(OVERLAP + "[pores]\nconductivity = 1.9\n", lambda f, *_: excess * upper[f])
    assert np.isnan(dataset["model_error_estimate"]).all()
    assert evaluate_models(dataset).attrs["bound_broken"] == broken


def test_bonded_contacts_are_told_but_not_bound(made_sweep):
    result = evaluate_models(made_sweep(BONDED, lambda *_: 1.99))
    assert result.attrs["bounds_bind"] == 0
    assert result.attrs["bounds_unbound"].startswith("the contacts are bonds")
    assert result.attrs["bound_broken"] == 0
    assert not result["bound_broken"].any()
    assert not result["inside_bounds"].any()
    assert result["outside_bound"].sel({"model": "hashin_shtrikman_upper"}).all()


def test_a_single_realization_is_held_against_its_own_wiener_bound(made_sweep):
    def one_too_high(density, angle, method, realization):  # 2 f = 1.2 is the parallel bound at f = 0.6
        return (1.21, 0.1) if (density, realization) == (0.6, 2) else 0.1

    result = evaluate_models(made_sweep(OVERLAP, one_too_high))
    assert result["realizations_outside_bounds"].values.tolist() == [0, 1, 0, 0, 0]
    assert not result["outside_bound"].any()  # the means are far below
    assert result["inside_bounds"].values.tolist() == [True, False, True, True, True]
    assert result.attrs["bound_broken"] == 1


def test_three_point_bounds_of_hard_disks_do_not_bind_others(made_sweep):
    upper = {f: evaluate("three_point_upper", k1=0.0, k2=2.0, fraction=f, dimension=2) for f in (0.5, 0.6, 0.7)}
    dataset = made_sweep(OVERLAP, lambda f, *_: 1.01 * upper.get(f, 0.1))
    result = evaluate_models(dataset, ["three_point_upper"])
    assert result["outside_bound"].sel({"model": "three_point_upper"}, drop=True).any()
    assert result.attrs["bound_broken"] == 0


@pytest.mark.parametrize("text", [OVERLAP, BONDED, BONDED + '[models]\nnames = ["maxwell_inverse"]\n'])
def test_values_are_the_catalogue_s_on_the_dimensions_of_the_sweep(made_sweep, text):
    dataset = made_sweep(text, noisy, solid=lambda density: 0.98 * density)
    result = evaluate_models(dataset)
    k = 0.5 * (
        dataset["conductivity_mean"].sel(direction_i="x", direction_j="x")
        + dataset["conductivity_mean"].sel(direction_i="y", direction_j="y")
    )
    assert result["model_conductivity"].dims == ("model", *k.dims)
    for name in result["model"].values:
        values = result["model_conductivity"].sel({"model": name})
        if name == "contact_mean_field":
            assert np.allclose(values, 0.5, rtol=1e-14)
        else:
            expected = evaluate(name, k1=0.0, k2=2.0, fraction=0.98 * dataset["density"], dimension=2)
            assert np.allclose(values, expected.broadcast_like(k).transpose(*k.dims), rtol=1e-14)
        difference = result["relative_difference"].sel({"model": name})
        assert np.allclose(difference, values / k - 1.0, rtol=0.0, atol=1e-13)


def test_the_interval_is_student_s_of_the_mean_of_the_diagonal(made_sweep):
    dataset = made_sweep(BONDED, noisy)
    result = simulated(dataset)
    for density in dataset["density"].values:
        for angle in dataset["contact_angle"].values:
            cell = result.sel(density=density, contact_angle=angle)
            samples = [np.mean(noisy(density, angle, "", r)) for r in range(4)]
            interval = stats.ttest_1samp(samples, 0.0).confidence_interval(0.9)
            assert float(cell["conductivity_ci_low"]) == pytest.approx(interval.low, rel=1e-12)
            assert float(cell["conductivity_ci_high"]) == pytest.approx(interval.high, rel=1e-12)
    components = dataset["conductivity_std"].sel(direction_i="x", direction_j="x")
    assert float(result["conductivity_sem"].mean()) < 0.9 * float(components.mean()) / np.sqrt(4.0)


def test_failed_and_single_realizations(made_sweep):
    def conduct(density, angle, method, realization):
        if density == 0.9 or (density == 0.8 and realization):
            return None
        return 0.0 if density == 0.5 else 0.3

    dataset = made_sweep(OVERLAP, conduct)
    result = evaluate_models(dataset)
    assert result["count"].values.tolist() == [4, 4, 4, 1, 0]
    assert result["conductivity_mean"].isnull().values.tolist() == [False] * 4 + [True]
    # four zeros bound the fraction that percolates, not the mean of those that would
    assert result["half_width"].isnull().values.tolist() == [True, False, False, True, True]
    assert result["percolating_fraction"].values[:2].tolist() == [0.0, 1.0]
    assert result["relative_difference"].isel(density=0).isnull().all()  # nothing is relative to 0
    assert result.attrs["bound_broken"] == 0
    assert np.isfinite(result["rms_relative_difference"]).all()  # over the densities that have a conductivity


def test_the_closest_model_is_the_one_the_sweep_was_made_from(made_sweep):
    """A model that is 0 is never the closest, though all others are too high by more than 100 %."""
    for name in ("effective_medium", "differential_inverse"):
        made = {f: evaluate(name, k1=0.0, k2=2.0, fraction=f, dimension=2) for f in (0.5, 0.6, 0.7, 0.8, 0.9)}
        result = evaluate_models(made_sweep(OVERLAP, lambda f, *_, made=made: made[f]))
        assert result.attrs["best_model"] == name
        assert float(result["rms_relative_difference"].sel({"model": name})) < 1e-14
    far = evaluate_models(made_sweep(OVERLAP, lambda *_: 1e-3))
    assert far.attrs["best_model"] not in ("maxwell", "differential", "hashin_shtrikman_lower")
    assert str(far["model_note"].sel({"model": "maxwell"}).item()) == "is 0: the pores insulate"


def test_models_with_parameters_and_models_without_a_value(made_sweep):
    dataset = made_sweep(CONDUCTING_PORES, noisy)
    result = evaluate_models(
        dataset, {"lewis_nielsen": {"shape_factor": 1.0, "maximum_fraction": 0.95}, "square_array": {}}
    )
    expected = lewis_nielsen(0.2, 2.0, dataset["density"].values, 1.0, 0.95, dimension=2)
    assert np.allclose(result["model_conductivity"].sel({"model": "lewis_nielsen"}), expected)
    array = result["model_conductivity"].sel({"model": "square_array"})
    assert array.isnull().values.tolist() == [False, False, False, True, True]  # touching at pi/4
    assert "must lie in [0, 0.785398)" in str(result["model_note"].sel({"model": "square_array"}).item())
    insulated = evaluate_models(made_sweep(OVERLAP, noisy), ["lewis_nielsen", "russell", "kirkpatrick"])
    assert insulated["model_conductivity"].sel({"model": ["lewis_nielsen", "russell"]}).isnull().all()
    # the coordination number of the sweep is 3.5
    values = insulated["model_conductivity"].sel({"model": "kirkpatrick"})
    expected = evaluate("kirkpatrick", k1=0.0, k2=2.0, fraction=dataset["density"], dimension=2, coordination=3.5)
    assert np.allclose(values, expected)
    notes = dict(zip(insulated["model"].values, insulated["model_note"].values, strict=True))
    assert "k1 of model lewis_nielsen" in notes["lewis_nielsen"]
    assert "dimension 3" in notes["russell"]
    assert notes["kirkpatrick"] == ""


def test_refusals(made_sweep):
    dataset = made_sweep(OVERLAP, noisy)
    with pytest.raises(InputError, match="no model named 'maxwel'; did you mean maxwell"):
        evaluate_models(dataset, ["maxwel"])
    with pytest.raises(InputError, match="no parameter 'shape'; its parameters are: maximum_fraction, shape_factor"):
        evaluate_models(dataset, {"lewis_nielsen": {"shape": 1.0}})
    with pytest.raises(InputError, match="not the result of a sweep: it has no status"):
        evaluate_models(dataset.drop_vars("status"))
    mixed = OVERLAP.replace(
        "conductivity = 2.0", "conductivity = 2.0\nmixture = { conductivity = 9.0, fraction = 0.5 }"
    )
    with pytest.raises(InputError, match=r"this study mixes 2 and 9 W/\(m K\)"):
        evaluate_models(made_sweep(mixed, noisy))
    with pytest.raises(InputError, match="no attribute study_resolved"):
        phases(xarray.Dataset())


def test_phases_come_from_the_study(made_sweep):
    filled, bonded = (phases(made_sweep(text, noisy)) for text in (CONDUCTING_PORES, BONDED))
    assert (float(filled.pores), float(filled.particles), filled.dimension, filled.bounds_bind) == (0.2, 2.0, 2, True)
    assert (float(bonded.pores), bonded.pores_conduct, bonded.bounds_bind) == (0.0, False, False)
    values, note = model_curve("maxwell", filled, xarray.DataArray([0.3, np.nan], dims="density"))
    assert values[0] == pytest.approx(evaluate("maxwell", k1=0.2, k2=2.0, fraction=0.3, dimension=2), rel=1e-14)
    assert np.isnan(values[1])
    assert note == ""


@pytest.mark.parametrize(("threshold", "exponent"), [(0.47, 1.3), (0.40, 1.7), (0.2, 2.5)])
def test_percolation_constants_are_recovered(made_sweep, threshold, exponent):
    def conduct(density, angle, method, realization):
        return 1.5 * (angle or 5.0) / 5.0 * (density - threshold) ** exponent

    for angle, prefactor in ((5.0, 1.5), (10.0, 3.0)):
        found, fit = constants(fit_models(made_sweep(BONDED, conduct)), "percolation_power_law", contact_angle=angle)
        assert fit.points == 5
        assert fit.rms_relative_residual < 1e-6
        assert found["threshold"].value == pytest.approx(threshold, abs=1e-5)
        assert found["exponent"].value == pytest.approx(exponent, rel=1e-4)
        assert found["prefactor"].value == pytest.approx(prefactor, rel=1e-4)


def test_filled_polymer_constants_are_recovered(made_sweep):
    curves = {
        "lewis_nielsen": ({"shape_factor": 1.4, "maximum_fraction": 0.97}, lewis_nielsen, {"dimension": 2}),
        "agari_uno": ({"matrix_factor": 1.1, "chain_factor": 0.8}, agari_uno, {}),
    }
    for name, (made, function, extra) in curves.items():
        dataset = made_sweep(
            CONDUCTING_PORES, lambda f, *_, m=made, g=function, e=extra: g(0.2, 2.0, f, *m.values(), **e)
        )
        found, _ = constants(fit_models(dataset), name)
        assert {key: p.value for key, p in found.items()} == pytest.approx(made, rel=1e-5)


def test_the_interval_of_a_constant_covers_the_truth_as_often_as_it_says(made_sweep):
    """Agari-Uno is linear in log k, so that the 90 % interval is exact for normal errors: 90 % +- 3 sd of 300."""
    rng, hits, trials = np.random.default_rng(20265), 0, 100
    for _ in range(trials):
        k = {f: agari_uno(0.2, 2.0, f, 1.1, 0.8) * np.exp(0.05 * rng.normal()) for f in (0.5, 0.6, 0.7, 0.8, 0.9)}
        text = CONDUCTING_PORES.replace("realizations = 4", "realizations = 1")
        found, _ = constants(fit_models(made_sweep(text, lambda f, *_, k=k: k[f])), "agari_uno")
        hits += found["chain_factor"].low <= 0.8 <= found["chain_factor"].high
    assert 81 <= hits <= 99


def test_points_weigh_by_their_standard_error(made_sweep):
    """One density of ten times the scatter: the weighted fit of log k = a + b f, by numpy's polyfit."""
    text = CONDUCTING_PORES.replace("realizations = 4", "realizations = 8")

    def scattered(density, angle, method, realization):
        rng = np.random.default_rng([20268, int(1000 * density), realization])
        return agari_uno(0.2, 2.0, density, 1.1, 0.8) * (1.0 + (0.1 if density == 0.7 else 0.01) * rng.normal())

    dataset = made_sweep(text, scattered)
    statistics = simulated(dataset)
    f, k = statistics["density"].values, statistics["conductivity_mean"].values
    # log k = f C2 log k2 + (1 - f) log(C1 k1) is a line in f: its values at f = 0 and 1 give the constants
    slope, start = np.polyfit(f, np.log(k), 1, w=k / statistics["conductivity_sem"].values)
    found, _ = constants(fit_models(dataset), "agari_uno")
    assert found["matrix_factor"].value == pytest.approx(np.exp(start) / 0.2, rel=1e-6)
    assert found["chain_factor"].value == pytest.approx((slope + start) / np.log(2.0), rel=1e-6)


def test_why_there_is_no_fit(made_sweep):
    few = OVERLAP.replace("[0.5, 0.6, 0.7, 0.8, 0.9]", "[0.6, 0.7]")
    (fit,) = fit_models(made_sweep(few, noisy))
    assert (fit.points, fit.parameters) == (2, ())
    assert "4 densities" in fit.note
    notes = {fit.model: fit.note for fit in fit_models(made_sweep(OVERLAP, noisy))}
    assert notes["lewis_nielsen"] == notes["agari_uno"] == "needs pores that conduct"
    convex = {fit.model: fit for fit in fit_models(made_sweep(OVERLAP, lambda f, *_: np.exp(60.0 * (f - 0.9))))}
    assert "end of its range" in convex["percolation_power_law"].note
    assert convex["percolation_power_law"].parameters == ()


def test_cells_that_do_not_always_percolate_have_skewed_intervals_and_their_fraction(made_sweep):
    """Three of four realizations conduct: dataset, comparison and `interval` say the same."""
    dataset = made_sweep(OVERLAP, lambda *place: 0.0 if place[3] == 1 else 0.3 + 0.01 * place[3])
    expected = interval([0.3, 0.0, 0.32, 0.33], dataset.attrs["confidence_level"])
    result = evaluate_models(dataset)
    cell = dataset.isel(density=0, direction_i=0)
    assert float(cell["percolating_fraction"]) == float(result["percolating_fraction"][0]) == 0.75
    assert float(cell["conductivity_mean_percolating"]) == pytest.approx(expected.percolating_mean)
    for bounds in (cell.isel(direction_j=0), result.isel(density=0)):
        assert float(bounds["conductivity_ci_low"]) == pytest.approx(expected.low)
        assert float(bounds["conductivity_ci_high"]) == pytest.approx(expected.high)
    assert expected.high - expected.mean < expected.mean - expected.low
