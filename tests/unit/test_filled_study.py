"""Sweeps with pores that conduct: what a study may say, the cells, the dataset and its comparison."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.comparison import evaluate_models, model_lines
from etc_engine.errors import StudyError
from etc_engine.medium.conduction import Conduction
from etc_engine.output.figures import draw_comparison
from etc_engine.packing import PackingSpec, parse_radii
from etc_engine.realization import RealizationSpec, Status, realize
from etc_engine.service.curve import curve_of
from etc_engine.study.sweep import Study, parse_study
from etc_engine.sweep.result_file import open_dataset

STUDY = """
schema = 2
name = "filled"
seed = 20263
[packing]
method = "lubachevsky-stillinger"
radii = "equal"
count = 12
box = [1.0, 1.0]
periodic = "xy"
density = [0.2, 0.4]
[particles]
conductivity = [5.0, 1.0]
[pores]
conductivity = 0.5
[conduction]
engine = "voxel"
tolerance = 1e-8
resolution = 32
[statistics]
realizations = 3
"""

OPTIONS = {"resolution": 24}
SPEC = RealizationSpec(
    PackingSpec(
        "lubachevsky-stillinger",
        parse_radii("equal"),
        Box((1.0, 1.0), (True, True)),
        count=10,
        density=0.3,
        radius_growth=False,
    ),
    conduction=tuple(Conduction("voxel", method, OPTIONS, 1e-8) for method in ("laminate", "binary")),
    values={"pore_conductivity": 0.5},
    axes={"particle_conductivity": (1.0, 5.0)},
)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            'engine = "voxel"',
            'method = "chord"',
            "conductivity: found 0.5, method 'chord' of engine 'dtem' does not model heat",
        ),
        ('engine = "voxel"', 'engine = "pipe"', "method 'chord' of engine 'pipe' does not model heat"),
        ('engine = "voxel"', 'engine = ["voxel"]', r"conduction.engine: found \['voxel'\], allowed"),
        ("resolution = 32", "resolution = 1", "conduction.resolution: found 1, allowed: a whole number of at least"),
        ("conductivity = [5.0, 1.0]", "conductivity = [-1.0]", r"particles.conductivity\[0\]: found -1.0"),
        ("conductivity = [5.0, 1.0]", "conductivity = [1.0, 1.0]", "1.0 is listed twice"),
        ("conductivity = 0.5", "conductivity = -0.5", "pores.conductivity: found -0.5"),
        ('periodic = "xy"', 'periodic = "x"', "a box with walls all around or with none"),
        ("[statistics]", "[contacts]\ncontact_resistance = 1.0\n[statistics]", "contact_resistance: has no effect"),
        ("[statistics]", '[contacts]\nrule = "bonded"\ncontact_angle = 5.0\n[statistics]', "contacts.rule: has no eff"),
        ("[statistics]", "[models]\npore_conductivity = 0.1\n[statistics]", "unknown key, write pores.conductivity"),
        ("resolution = 32", "resolution = 32\nparticles = 900", "conduction.particles: has no effect"),
        ("resolution = 32", "resolution = 32\nmodes = 3", "conduction.modes: has no effect with engine = 'voxel'"),
        ("resolution = 32", "resolution = 100000", "conduction.resolution: .* GB of memory"),
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
        ('engine = "voxel"', 'engine = "voxel"\nmethod = "chord"', "allowed with voxel: laminate, binary"),
        ("[pores]", "[composite]", "composite: unknown key, write .pores. conductivity"),
    ],
)
def test_what_a_study_may_not_say(old, new, words):
    assert old in STUDY
    with pytest.raises(StudyError, match=words):
        parse_study(STUDY.replace(old, new))


def test_pores_that_conduct_need_a_method_that_heeds_them():
    text = STUDY.replace('engine = "voxel"', 'engine = "pipe"').replace("resolution = 32\n", "")
    with pytest.raises(StudyError, match=r"pores.conductivity: found 0.5, method 'chord' of engine 'pipe' does not"):
        parse_study(text)
    assert parse_study(text.replace("conductivity = 0.5", "conductivity = 0.0")).values("pore_conductivity") == (0.0,)


def test_the_lattice_has_nodes_and_no_voxels_and_works_in_space():
    plane = STUDY.replace("voxel", "lattice").replace("resolution = 32", "particles = 900")
    with pytest.raises(StudyError, match=r"packing\.box: method 'laguerre' of engine 'lattice' works in 3D"):
        parse_study(plane)
    space = plane.replace("box = [1.0, 1.0]", "box = [1.0, 1.0, 1.0]").replace('"xy"', '"xyz"')
    assert parse_study(space).realization_spec(0.2).conduction[0].options["particles"] == 900
    with pytest.raises(StudyError, match=r"conduction\.resolution: has no effect with engine = 'lattice'"):
        parse_study(space.replace("particles = 900", "resolution = 32"))


def test_conductivities_are_a_dimension_and_the_default_method_is_the_engines():
    study = parse_study(STUDY)
    assert study.axes == {"particle_conductivity": (1.0, 5.0)}
    assert study.methods == ("laminate",)
    spec = study.realization_spec(0.4)
    assert spec.values == {"pore_conductivity": 0.5}
    assert spec.axes == {"particle_conductivity": (1.0, 5.0)}
    assert spec.conduction[0].options["resolution"] == 32
    assert spec.shape == (2, 1)


def cells_of(spec, seed):
    found = np.empty(spec.shape, dtype=object)
    found.ravel()[:] = realize(spec, np.random.default_rng(seed)).cells
    return found


def test_cells_are_ordered_and_do_not_depend_on_each_other():
    cells = cells_of(SPEC, 73)
    k = np.vectorize(lambda cell: np.trace(cell.conductivity) / 2)(cells)
    assert {cell.status for cell in cells.ravel()} == {Status.OK}
    assert (k[1] > k[0]).all()
    assert k[0] == pytest.approx([0.5 * 1.22] * 2, rel=0.03)  # square array of contrast 2, f = 0.3: 1.22229
    alone = cells_of(replace(SPEC, axes={"particle_conductivity": (5.0,)}), 73)
    np.testing.assert_array_equal(alone[0, 0].conductivity, cells[1, 0].conductivity)


def test_the_conductivity_scales_with_both_phases():
    """k(c k1, c k2) = c k(k1, k2): the two axes at once, and the diagonal of their product."""
    both = replace(SPEC, values={}, conduction=SPEC.conduction[:1])
    both = replace(both, axes={"particle_conductivity": (2.0, 4.0), "pore_conductivity": (0.5, 1.0)})
    k = np.vectorize(lambda cell: cell.conductivity[0, 0])(cells_of(both, 73))[..., 0]
    assert k[1, 1] == pytest.approx(2.0 * k[0, 0], rel=1e-7)
    assert k[0, 0] < k[0, 1] < k[1, 1]


def test_a_failure_is_in_its_cell():
    coarse = tuple(replace(one, options={"resolution": 8}) for one in SPEC.conduction)
    cells = cells_of(replace(SPEC, conduction=coarse), 73)
    assert {cell.status for cell in cells.ravel()} == {Status.ERROR}
    assert "voxels" in cells[0, 0].message


def test_a_sweep_compares_each_conductivity_with_models_of_its_own(etc_engine, tmp_path):
    (tmp_path / "study.toml").write_text(STUDY)
    out = tmp_path / "out.nc"
    assert etc_engine("sweep", tmp_path / "study.toml", "-o", out).returncode == 0
    data = open_dataset(out)
    assert data.conductivity.dims == ("density", "particle_conductivity", "realization", "direction_i", "direction_j")
    assert data.particle_conductivity.values.tolist() == [1.0, 5.0]
    assert data.particle_conductivity.attrs["units"] == "W m-1 K-1"
    assert float(data.pore_conductivity) == 0.5
    comparison = evaluate_models(data)
    assert comparison.attrs["particle_conductivity"] == [1.0, 5.0]
    assert comparison.attrs["bounds_bind"] == 1
    assert comparison.attrs["bound_broken"] == 0
    maxwell = comparison.model_conductivity.sel(model="maxwell", density=0.2)
    beta = (np.array([2.0, 10.0]) - 1.0) / (np.array([2.0, 10.0]) + 1.0)
    np.testing.assert_allclose(maxwell, 0.5 * (1.0 + 0.2 * beta) / (1.0 - 0.2 * beta), rtol=1e-5)
    panels = draw_comparison(comparison, model_lines(comparison)).axes
    assert [panel.get_title() for panel in panels] == ["particle conductivity 1", "particle conductivity 5"]
    for panel in panels:  # each names the lines of its own conductivity, about the data
        assert "Maxwell" in {text.get_text() for text in panel.texts}
        assert 0.3 < panel.get_ylim()[0] < float(comparison.conductivity_mean.min())
    curve = curve_of(data)
    assert [series["values"] for series in curve["series"]] == [{"particle_conductivity": k} for k in (1.0, 5.0)]
    lines = {model["name"]: model["curves"] for model in curve["models"]}
    low, high = (line[-1] for line in lines["maxwell"])
    at = {"model": "maxwell", "density": 0.4, "particle_conductivity": 1.0}
    assert low == pytest.approx(float(comparison.model_conductivity.sel(at)))
    assert high > low
    shown = etc_engine("compare", out, "-o", tmp_path / "figure.png")
    assert shown.returncode == 0
    assert "particles of 1, 5 W/(m K), pores of 0.5 W/(m K)" in shown.stdout
    assert "they hold for whole cells" in shown.stdout
    assert etc_engine("report", out, "-o", tmp_path / "report.html").returncode == 0
    assert "Pores of 0.5 W/(m K), particles of 1, 5 W/(m K)" in (tmp_path / "report.html").read_text()


def test_a_broken_bound_is_told(etc_engine, tmp_path):
    (tmp_path / "study.toml").write_text(STUDY)
    out = tmp_path / "out.nc"
    assert etc_engine("sweep", tmp_path / "study.toml", "-o", out).returncode == 0
    data = open_dataset(out)
    for name in ("conductivity", "conductivity_mean"):
        data[name] = data[name].where(data.particle_conductivity < 5.0, 4.0 * data[name])
    data.assign_attrs(checksum="").to_netcdf(tmp_path / "broken.nc")
    told = etc_engine("compare", tmp_path / "broken.nc")
    assert told.returncode == 3
    assert "particle_conductivity 5.0: " in told.stderr
    assert "breaks hashin_shtrikman_upper" in told.stderr


def test_the_lattice_engine_shares_one_lattice_among_the_conductivities():
    box = Box((1.0, 1.0, 1.0), (True, True, True))
    packing = replace(SPEC.packing, box=box, count=4, density=0.15)
    methods = tuple(Conduction("lattice", method, {"particles": 600}, 1e-8) for method in ("laguerre", "contact"))
    spec = replace(SPEC, packing=packing, conduction=methods, axes={"particle_conductivity": (0.5, 2.5)})
    cells = cells_of(spec, 74)
    assert {cell.status for cell in cells.ravel()} == {Status.OK}
    # no contrast: the matrix, exactly by facets and by the calibrated contacts
    for cell in cells[0]:
        np.testing.assert_allclose(np.diag(cell.conductivity), 0.5, rtol=1e-6)
    beta = 4.0 / 7.0  # Maxwell at contrast 5, a lower bound: f = 0.15
    maxwell = 0.5 * (1.0 + 2.0 * 0.15 * beta) / (1.0 - 0.15 * beta)
    assert np.trace(cells[1, 0].conductivity) / 3 == pytest.approx(maxwell, rel=0.03)
    alone = cells_of(replace(spec, axes={"particle_conductivity": (2.5,)}), 74)
    np.testing.assert_array_equal(alone[0, 0].conductivity, cells[1, 0].conductivity)


LATTICE = (
    STUDY.replace('engine = "voxel"', 'engine = "lattice"')
    .replace("resolution = 32", "particles = 400")
    .replace("[1.0, 1.0]", "[1.0, 1.0, 1.0]")
    .replace('"xy"', '"xyz"')
    .replace("[0.2, 0.4]", "[0.2]")
    .replace("count = 12", "count = 4")
)


@pytest.mark.parametrize(
    "text",
    [
        STUDY,
        STUDY.replace("conductivity = [5.0, 1.0]", "conductivity = 3.0"),
        STUDY.replace("conductivity = 0.5", "conductivity = [0.5, 0.6]"),
        LATTICE,
    ],
    ids=["conductivities", "one conductivity", "pores too", "lattice"],
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
