"""Sweeps of composites: what a study may say, the cells of a realization, the dataset and its comparison."""

from dataclasses import replace

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.comparison import evaluate_models, model_lines
from etc_engine.errors import StudyError
from etc_engine.output.figures import draw_comparison
from etc_engine.packing import PackingSpec, parse_radii
from etc_engine.realization import CompositeSpec, ConductionSpec, ContactSpec, RealizationSpec, Status, realize
from etc_engine.service.curve import curve_of
from etc_engine.study.sweep import Study, parse_study
from etc_engine.sweep.dataset import open_dataset

STUDY = """
schema = 2
name = "composite"
seed = 20263
[packing]
method = "lubachevsky-stillinger"
radii = "equal"
count = 12
box = [1.0, 1.0]
periodic = "xy"
density = [0.2, 0.4]
[conduction]
engine = "voxel"
tolerance = 1e-8
[composite]
matrix_conductivity = 0.5
contrast = [10.0, 2.0]
resolution = 32
[statistics]
realizations = 3
"""

SPEC = RealizationSpec(
    PackingSpec(
        "lubachevsky-stillinger",
        parse_radii("equal"),
        Box((1.0, 1.0), (True, True)),
        count=10,
        density=0.3,
        radius_growth=False,
    ),
    ContactSpec(),
    ConductionSpec("voxel", ("laminate", "binary"), tolerance=1e-8),
    CompositeSpec(0.5, (2.0, 10.0), resolution=24),
)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[composite]\nmatrix_conductivity = 0.5\ncontrast = [10.0, 2.0]\nresolution = 32", "", "composite: missing"),
        ('engine = "voxel"', "", "composite: has no meaning with engine = 'dtem'"),
        ("resolution = 32", "resolution = 2", "composite.resolution: found 2, allowed: a whole number of at least 4"),
        ("contrast = [10.0, 2.0]", "contrast = [-1.0]", r"composite.contrast\[0\]: found -1.0"),
        ('periodic = "xy"', 'periodic = "x"', "a box with walls all around or with none"),
        ("tolerance", "contact_resistance = 1.0\ntolerance", "contact_resistance: has no meaning"),
        ("tolerance", "conductivity = 1.0\ntolerance", "composite.contrast gives that of the particles"),
        ("[statistics]", '[contacts]\nrule = "bonded"\ncontact_angle = 5.0\n[statistics]', "contacts: has no meaning"),
        ("[statistics]", "[models]\npore_conductivity = 0.1\n[statistics]", "composite.matrix_conductivity says it"),
        ("resolution = 32", "resolution = 32\nnodes = 900", "composite.nodes: has no meaning with engine = 'voxel'"),
        ("resolution = 32", "resolution = 100000", "composite.resolution: .* GB of memory"),
        (
            "resolution = 32",
            "resolution = 24",
            "found 24, too coarse for the smallest particle, of diameter 0.145673: allowed is at least 28",
        ),
        (
            'radii = "equal"\ncount = 12',
            'radii = "bidisperse:0.02:0.1:0.5"',
            "too coarse for the smallest particle, of diameter 0.04: allowed is at least 100",
        ),
        ('engine = "voxel"', 'engine = "lattice"', "engine 'lattice' works in 3D"),
        ('engine = "voxel"', 'engine = "voxel"\nmethod = "chord"', "allowed with voxel: laminate, binary"),
    ],
)
def test_what_a_composite_study_may_not_say(old, new, words):
    assert old in STUDY
    with pytest.raises(StudyError, match=words):
        parse_study(STUDY.replace(old, new))


def test_resolution_has_no_meaning_with_the_lattice():
    space = (
        STUDY.replace("box = [1.0, 1.0]", "box = [1.0, 1.0, 1.0]").replace('"xy"', '"xyz"').replace("voxel", "lattice")
    )
    with pytest.raises(StudyError, match=r"composite\.resolution: has no meaning with engine = 'lattice'"):
        parse_study(space)
    assert parse_study(space.replace("resolution = 32", "nodes = 900")).composite.nodes == 900


def test_contrasts_are_the_second_axis_and_the_default_method_is_the_engines():
    study = parse_study(STUDY)
    assert study.variants == ("contrast", (2.0, 10.0))
    assert study.conduction.methods == ("laminate",)
    spec = study.realization_spec(0.4)
    assert spec.composite == CompositeSpec(0.5, (2.0, 10.0), 32)
    assert spec.variants == 2


def test_cells_are_ordered_by_contrast_and_method_and_do_not_depend_on_each_other():
    result = realize(SPEC, np.random.default_rng(73))
    k = np.array([[np.trace(cell.conductivity) / 2 for cell in row] for row in result.cells])
    assert {cell.status for row in result.cells for cell in row} == {Status.OK}
    assert (k[1] > k[0]).all()
    assert k[0] == pytest.approx([0.5 * 1.22] * 2, rel=0.03)  # square array of contrast 2, f = 0.3: 1.22229
    alone = replace(SPEC, composite=replace(SPEC.composite, contrasts=(10.0,)))
    again = realize(alone, np.random.default_rng(73)).cells[0][0]
    np.testing.assert_array_equal(again.conductivity, result.cells[1][0].conductivity)


def test_without_contrasts_the_particles_have_their_own_conductivity():
    own = replace(
        SPEC, conduction=replace(SPEC.conduction, conductivity=5.0), composite=CompositeSpec(0.5, (), resolution=24)
    )
    one, both = (realize(spec, np.random.default_rng(73)).cells for spec in (own, SPEC))
    assert len(one) == 1
    np.testing.assert_allclose(one[0][0].conductivity, both[1][0].conductivity, rtol=1e-12)


def test_a_failure_is_in_its_cell():
    coarse = replace(SPEC, composite=replace(SPEC.composite, resolution=8))
    cells = realize(coarse, np.random.default_rng(73)).cells
    assert {cell.status for row in cells for cell in row} == {Status.ERROR}
    assert "voxels" in cells[0][0].message


def test_a_sweep_compares_each_contrast_with_models_of_its_own(etc_engine, tmp_path):
    (tmp_path / "study.toml").write_text(STUDY)
    out = tmp_path / "out.nc"
    assert etc_engine("sweep", tmp_path / "study.toml", "-o", out).returncode == 0
    data = open_dataset(out)
    assert data.conductivity.dims == ("density", "contrast", "realization", "direction_i", "direction_j")
    assert data.contrast.values.tolist() == [2.0, 10.0]
    comparison = evaluate_models(data)
    assert comparison.attrs["particle_conductivity"] == [1.0, 5.0]
    assert comparison.attrs["bounds_bind"] == 1
    assert comparison.attrs["bound_broken"] == 0
    maxwell = comparison.model_conductivity.sel(model="maxwell", density=0.2)
    beta = (np.array([2.0, 10.0]) - 1.0) / (np.array([2.0, 10.0]) + 1.0)
    np.testing.assert_allclose(maxwell, 0.5 * (1.0 + 0.2 * beta) / (1.0 - 0.2 * beta), rtol=1e-5)
    panels = draw_comparison(comparison, model_lines(comparison)).axes
    assert [panel.get_title() for panel in panels] == ["contrast 2", "contrast 10"]
    for panel in panels:  # each names the lines of its own contrast, about the data
        assert "Maxwell" in {text.get_text() for text in panel.texts}
        assert 0.3 < panel.get_ylim()[0] < float(comparison.conductivity_mean.min())
    curve = curve_of(data)
    assert [series["contrast"] for series in curve["series"]] == [2.0, 10.0]
    lines = {model["name"]: model["curves"] for model in curve["models"]}
    low, high = (line[-1] for line in lines["maxwell"])
    assert low == pytest.approx(float(comparison.model_conductivity.sel(model="maxwell", density=0.4, contrast=2.0)))
    assert high > low
    shown = etc_engine("compare", out, "-o", tmp_path / "figure.png")
    assert shown.returncode == 0
    assert "a matrix of 0.5 W/(m K)" in shown.stdout
    assert "they bind composites" in shown.stdout
    assert etc_engine("report", out, "-o", tmp_path / "report.html").returncode == 0
    assert "Matrix of 0.5 W/(m K), particles of 1, 5 W/(m K)" in (tmp_path / "report.html").read_text()


def test_a_broken_bound_is_told(etc_engine, tmp_path):
    (tmp_path / "study.toml").write_text(STUDY)
    out = tmp_path / "out.nc"
    assert etc_engine("sweep", tmp_path / "study.toml", "-o", out).returncode == 0
    data = open_dataset(out)
    for name in ("conductivity", "conductivity_mean"):
        data[name] = data[name].where(data.contrast < 5.0, 4.0 * data[name])
    data.to_netcdf(tmp_path / "broken.nc")
    told = etc_engine("compare", tmp_path / "broken.nc")
    assert told.returncode == 3
    assert "contrast 10.0: " in told.stderr
    assert "breaks hashin_shtrikman_upper" in told.stderr


def test_the_lattice_engine_shares_one_lattice_among_the_contrasts():
    box = Box((1.0, 1.0, 1.0), (True, True, True))
    packing = replace(SPEC.packing, box=box, count=4, density=0.15)
    spec = replace(
        SPEC,
        packing=packing,
        conduction=ConductionSpec("lattice", ("laguerre", "contact"), tolerance=1e-8),
        composite=CompositeSpec(0.5, (1.0, 5.0), nodes=600),
    )
    result = realize(spec, np.random.default_rng(74))
    plain, filled = result.cells
    assert {cell.status for row in result.cells for cell in row} == {Status.OK}
    # no contrast: the matrix, exactly by facets and by the calibrated contacts
    for cell in plain:
        np.testing.assert_allclose(np.diag(cell.conductivity), 0.5, rtol=1e-6)
    beta = 4.0 / 7.0  # Maxwell at contrast 5, a lower bound: f = 0.15
    maxwell = 0.5 * (1.0 + 2.0 * 0.15 * beta) / (1.0 - 0.15 * beta)
    assert np.trace(filled[0].conductivity) / 3 == pytest.approx(maxwell, rel=0.03)
    alone = replace(spec, composite=replace(spec.composite, contrasts=(5.0,)))
    again = realize(alone, np.random.default_rng(74)).cells[0][0]
    np.testing.assert_array_equal(again.conductivity, filled[0].conductivity)


LATTICE = (
    STUDY.replace('engine = "voxel"', 'engine = "lattice"')
    .replace("resolution = 32", "nodes = 400")
    .replace("[1.0, 1.0]", "[1.0, 1.0, 1.0]")
    .replace('"xy"', '"xyz"')
    .replace("[0.2, 0.4]", "[0.2]")
    .replace("count = 12", "count = 4")
)


@pytest.mark.parametrize(
    "text",
    [
        STUDY,
        STUDY.replace("contrast = [10.0, 2.0]", "contrast = 3.0"),
        STUDY.replace("contrast = [10.0, 2.0]\n", "").replace("tolerance = 1e-8", "conductivity = 3.0"),
        LATTICE,
    ],
    ids=["contrasts", "one contrast", "own conductivity", "lattice"],
)
def test_a_result_tells_how_to_make_it_again(etc_engine, tmp_path, text):
    study = parse_study(text)
    again = Study.model_validate(study.resolved())
    assert again.resolved() == study.resolved()
    assert again.digest() == study.digest()
    (tmp_path / "study.toml").write_text(text.replace("realizations = 3", "realizations = 1"))
    out = tmp_path / "out.nc"
    assert etc_engine("sweep", tmp_path / "study.toml", "-o", out).returncode == 0
    done = etc_engine("rerun", out, "--density", "0.2", "--realization", "0")
    assert done.returncode == 0, done.stderr
    assert etc_engine("info", out).returncode == 0
