"""Sweeps over any dimensions in 2D and 3D: failures, older shards, labels, figures, report."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from etc_engine.comparison import evaluate_models, fit_models, model_lines, running_statistics
from etc_engine.errors import InputError, OutputError, StudyError
from etc_engine.models import evaluate
from etc_engine.output.figures import draw_comparison, png
from etc_engine.realization import Outcome, Realization, Status
from etc_engine.service.curve import curve_of
from etc_engine.study.quantities import QUANTITIES, SWEPT
from etc_engine.study.sweep import parse_study
from etc_engine.sweep.dataset import assemble
from etc_engine.sweep.plan import Unit, next_targets
from etc_engine.sweep.records import Record, decode, encode
from etc_engine.sweep.result_file import open_dataset
from etc_engine.sweep.table import tabulate

SPACE = """
schema = 2
name = "spheres"
seed = 20291
[packing]
method = "lubachevsky-stillinger"
radii = "equal"
count = 20
growth_rate = 2.0
box = [1.0, 1.0, 1.0]
periodic = "xyz"
density = [0.2, 0.72]
[particles]
conductivity = [2.0, 10.0]
[pores]
conductivity = [0.5, 1.0]
[conduction]
engine = "voxel"
method = ["laminate", "binary"]
resolution = 20
tolerance = 1e-6
[statistics]
realizations = 2
"""
PLANE = """
schema = 2
name = "disks"
seed = 20292
[packing]
radii = "uniform:0.01:0.02"
box = [1.0, 1.0]
density = [0.5, 0.6, 0.7, 0.8]
[particles]
conductivity = [1.0, 4.0]
[contacts]
rule = "bonded"
contact_angle = [5.0, 10.0]
contact_resistance = [0.0, 0.5, 2.0]
[conduction]
method = ["chord", "standard"]
[statistics]
realizations = 3
"""


def test_a_sweep_of_spheres_with_packings_that_fail_writes_its_result(etc_engine, tmp_path):
    """Spheres that grow so fast jam below 0.72: all cells of that density fail, the others have a conductivity."""
    (tmp_path / "study.toml").write_text(SPACE)
    out = tmp_path / "out.nc"
    done = etc_engine("sweep", tmp_path / "study.toml", "-o", out)
    assert done.returncode == 4, done.stderr
    data = open_dataset(out)
    dims = ("density", "particle_conductivity", "pore_conductivity", "method", "realization")
    assert data.status.dims == dims
    assert (data.status.sel(density=0.2) == Status.OK).all()
    assert (data.status.sel(density=0.72) == Status.PACKING_FAILED).all()
    assert data.conductivity.shape == (2, 2, 2, 2, 2, 3, 3)
    assert np.isnan(data.conductivity.sel(density=0.72)).all()
    assert np.isfinite(data.conductivity_mean.sel(density=0.2)).all()
    assert "packing_failed" not in str(data.message.sel(density=0.2).values)
    assert "volume" in data.density.attrs["comment"]
    assert "volume" in data.solid_fraction.attrs["long_name"]
    assert not any("area" in str(values.attrs) for values in data.variables.values())
    shown = etc_engine("compare", out, "-o", tmp_path / "figure.png", "--json")
    assert shown.returncode == 0, shown.stderr
    cell = json.loads(shown.stdout)["cells"][0]
    assert {"density", "particle_conductivity", "pore_conductivity", "method"} <= set(cell)
    assert etc_engine("report", out, "-o", tmp_path / "report.html").returncode == 0
    again = etc_engine("rerun", out, "--density", "0.2", "--realization", "1")
    assert again.returncode == 0, again.stdout + again.stderr
    assert etc_engine("rerun", out, "--density", "0.72", "--realization", "1").returncode == 0


def test_the_order_of_the_dimensions_is_that_of_the_table():
    study = parse_study(PLANE)
    assert list(study.axes) == ["contact_angle", "contact_resistance", "particle_conductivity"]
    assert SWEPT[0] == "density"
    assert SWEPT[-1] == "method"
    assert study.shape == (2, 3, 2, 2)
    for row in QUANTITIES.values():
        assert row.units, row
        assert row.long_name, row


def value(density, at, method, realization):
    scale = at["particle_conductivity"] / (1.0 + at["contact_resistance"] * at["particle_conductivity"])
    return (
        scale * (density - 0.4) * at["contact_angle"] * (1.0 + 0.01 * realization) * (1.1 if method == "chord" else 1)
    )


def test_statistics_models_fits_and_curves_are_cell_by_cell(made_sweep):
    data = made_sweep(PLANE, value)
    place = {"contact_angle": 10.0, "contact_resistance": 0.5, "particle_conductivity": 4.0}
    cell = data.sel(density=0.7, **place).sel({"method": "standard"})
    single = [value(0.7, place, "standard", r) for r in range(3)]
    mean = cell.conductivity_mean.sel(direction_i="x", direction_j="x")
    assert float(mean) == pytest.approx(np.mean(single), rel=1e-14)
    assert int(cell["count"]) == 3
    comparison = evaluate_models(data, ["parallel", "effective_medium"])
    model = comparison.model_conductivity.sel({"model": "parallel", **place, "density": 0.7, "method": "chord"})
    assert float(model) == pytest.approx(evaluate("parallel", k1=0.0, k2=4.0, fraction=0.7, dimension=2), rel=1e-12)
    fits = [fit for fit in fit_models(data) if fit.model == "percolation_power_law"]
    assert len(fits) == 24
    assert {"contact_angle", "contact_resistance", "particle_conductivity", "method"} == set(fits[0].selection)
    for fit in fits:
        assert {p.name: p.value for p in fit.parameters}["threshold"] == pytest.approx(0.4, abs=1e-5)
    curve = curve_of(data)
    assert len(curve["series"]) == 24
    assert curve["series"][0]["name"] == "5°, contact resistance 0, particle conductivity 1, chord"
    assert running_statistics(data)["mean"].shape == (4, 2, 3, 2, 2, 3)


def test_figures_of_many_dimensions_have_a_panel_per_combination(made_sweep):
    data = made_sweep(PLANE, value)
    comparison = evaluate_models(data)
    figure = draw_comparison(comparison, model_lines(comparison))
    png(figure)
    shown = [axes for axes in figure.axes if axes.get_visible()]
    assert len(shown) == 12  # resistances x conductivities x methods; a curve per half-angle
    assert shown[0].get_title() == "contact resistance 0, particle conductivity 1, method chord"
    text = PLANE.replace("[0.5, 0.6, 0.7, 0.8]", "0.7").replace("[5.0, 10.0]", "5.0").replace("[1.0, 4.0]", "1.0")

    def fixed(density, at, method, realization):
        return value(density, {"contact_angle": 5.0, "particle_conductivity": 1.0, **at}, method, realization)

    over = evaluate_models(made_sweep(text, fixed))
    figure = draw_comparison(over, model_lines(over))
    assert figure.axes[0].get_xlabel() == "thermal resistance of a contact [m K/W]"


def test_adaptive_rounds_follow_the_noisiest_cell_of_all():
    text = PLANE.replace("realizations = 3", "realizations = 8\nrelative_ci = 0.02").replace(
        "[0.5, 0.6, 0.7, 0.8]", "[0.5, 0.7]"
    )
    study = parse_study(text)
    rng = np.random.default_rng(5)
    records = []
    for density in study.densities:
        for r in range(8):
            cells = []
            for place in np.ndindex(*study.shape):
                noise = 0.3 if density == 0.7 and place == (1, 2, 0, 1) else 1e-4
                cells.append(Outcome(Status.OK, conductivity=np.eye(2) * (1.0 + noise * rng.normal())))
            records.append(Record(Unit(density, r), Realization(9, density, density, 0.1, tuple(cells)), 0, "n", 0, 1))
    calm, noisy = next_targets(study, (8, 8), tabulate(study, records))
    assert calm == 8
    assert noisy > 8


def failed_record(study, cell) -> Record:
    cells = (cell,) * int(np.prod(study.shape))
    return Record(Unit(0.2, 0), Realization(0, np.nan, np.nan, 0.1, cells), 0, "node", 1.0, 2.0)


def test_shards_of_an_older_version_load():
    """It wrote 2 x 2 tensors for failed cells of spheres, cells as lists of lists, and fewer fields."""
    study = parse_study(SPACE)
    line = json.loads(encode(failed_record(study, Outcome(Status.PACKING_FAILED, "too dense"))))
    for cell in line["result"]["cells"]:
        cell["conductivity"] = [[float("nan")] * 2] * 2
        del cell["snapshots"]
    line["result"]["cells"] = [line["result"]["cells"][:4], line["result"]["cells"][4:]]
    table = tabulate(study, [decode(json.dumps(line))])
    assert table.rows["conductivity"].shape == (1, 2, 2, 2, 3, 3)
    assert (table.rows["status"] == Status.PACKING_FAILED).all()
    data = assemble(study, table, {})
    assert np.isnan(data.conductivity).all()
    assert str(data.message.values[0, 1, 1, 1, 0]) == "too dense"


def test_records_of_another_version_are_refused_in_words():
    line = json.loads(encode(failed_record(parse_study(SPACE), Outcome(Status.ERROR, "no"))))
    line["result"]["cells"][0]["colour"] = "red"
    with pytest.raises(OutputError, match=r"another version of the engine .*colour.*--overwrite"):
        decode(json.dumps(line))


def test_shards_and_results_of_schema_1_are_refused_in_words(etc_engine, tmp_path, made_sweep):
    study, out = tmp_path / "study.toml", tmp_path / "out.nc"
    study.write_text(PLANE)
    folder = tmp_path / "out.nc.shards"
    folder.mkdir()
    (folder / "run-00000.shard").write_bytes(b"")
    (folder / "study.json").write_text(json.dumps({"digest": "0" * 64, "study": {"schema": 1, "conduction": {}}}))
    done = etc_engine("sweep", study, "-o", out, "--resume")
    assert done.returncode == 2
    assert "schema is 1 there and 2 here" in done.stderr
    data = made_sweep(PLANE, value)
    old = json.loads(data.attrs["study_resolved"]) | {"schema": 1}
    data.attrs["study_resolved"] = json.dumps(old)
    with pytest.raises(InputError, match="of schema 1, from an older version of the engine"):
        evaluate_models(data)


def test_a_study_of_schema_1_says_what_to_write():
    old = """
schema = 1
name = "old"
seed = 1
[packing]
radii = "equal:0.05"
box = [1.0, 1.0]
[conduction]
engine = "voxel"
conductivity = 2.0
[composite]
matrix_conductivity = 1.0
contrast = [2.0]
[statistics]
realizations = 1
"""
    with pytest.raises(StudyError) as raised:
        parse_study(old, "old.toml")
    message = str(raised.value)
    assert message.startswith("old.toml: schema: found 1, allowed: 2; write schema = 2, and ")
    assert "particles.conductivity for conduction.conductivity" in message
    assert "pores.conductivity for composite.matrix_conductivity" in message
    assert "\n" not in message


def test_a_number_is_no_dimension_and_a_list_of_one_is(made_sweep):
    text = PLANE.replace("[1.0, 4.0]", "4.0").replace("[0.0, 0.5, 2.0]", "[0.5]")
    at = {"particle_conductivity": 4.0}
    data = made_sweep(text, lambda density, found, m, r: value(density, {**at, **found}, m, r))
    assert "particle_conductivity" not in data.dims
    assert float(data.particle_conductivity) == 4.0
    assert data.sizes["contact_resistance"] == 1
    one, several = parse_study(text), parse_study(text.replace("4.0", "[4.0]"))
    assert replace(one.realization_spec(0.5), axes={}, values={}) == replace(
        several.realization_spec(0.5), axes={}, values={}
    )
