"""etc-engine transient with kind = "network": output, balance, resume after a kill, refusals."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import xarray

from etc_engine.engines.pipe.steady import pipe_conductivity
from etc_engine.medium.medium import medium_of
from etc_engine.output.figures.transient import draw_transient, pick_times
from etc_engine.output.series import series_dataset
from etc_engine.solvers.marching import SCHEMES
from etc_engine.study.transient import parse_study
from etc_engine.sweep.dataset import differing_variables
from etc_engine.transient.run import run_transient
from etc_engine.transient.states import read_states, state_folder, state_path, write_state

STUDY = """
schema = 2
kind = "network"
name = "bed heated from the left"
seed = 7
[packing]
radii = "uniform:0.03:0.05"
box = [1.0, 1.0]
[contacts]
rule = "bonded"
contact_angle = 10.0
bond_gap = 1e-3
contact_resistance = 0.1
[conduction]
engine = "pipe"
[particles]
heat_capacity = 2.0
initial = { value = 0.1, gradient = [0.0, 0.2] }
[walls]
left = { type = "fixed", value = 1.0 }
right = { type = "convective", coefficient = 1.5, value = { times = [0.0, 1.0], values = [0.0, 0.5] } }
bottom = { type = "flux", value = 0.05 }
top = { type = "insulated" }
[[source]]
particles = [3, 4, 4]
heat = 0.02
[time]
scheme = "bdf2"
steps = 4
times = [0.0, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0]
"""


def write(folder: Path, text: str = STUDY) -> Path:
    path = folder / "study.toml"
    path.write_text(text)
    return path


def test_series_opens_with_labels_and_balances(etc_engine, tmp_path):
    done = etc_engine("transient", write(tmp_path), "-o", tmp_path / "out.nc")
    assert done.returncode == 0, done.stderr
    assert "imbalance" in done.stderr
    with xarray.open_dataset(tmp_path / "out.nc") as data:
        assert data.temperature.dims == ("time", "particle")
        assert data.time.values.tolist() == [0.0, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0]
        assert data.time.dtype == np.float64
        assert data.wall.values.tolist() == ["left", "right", "bottom", "top"]
        assert data.attrs["study"] == STUDY
        assert json.loads(data.attrs["versions"])["numpy"] == np.__version__
        assert data.temperature.attrs["units"] == "K"
        # the heat the particles hold is what walls and sources gave
        rise = (data.temperature - data.temperature.isel(time=0)) @ data.heat_capacity
        gained = data.wall_heat.sum("wall") + data.source_heat
        np.testing.assert_allclose(rise, gained, atol=1e-13)
        np.testing.assert_allclose(data.stored_heat, gained, atol=1e-13)
        assert float(abs(data.heat_imbalance).max()) < 1e-13
        assert float(data.stored_heat[-1]) > 0.1
        np.testing.assert_allclose(data.source_heat, 0.06 * data.time, rtol=1e-12)
        np.testing.assert_allclose(data.wall_heat.sel(wall="bottom"), 0.05 * data.time, rtol=1e-12)
        assert not data.wall_heat.sel(wall="top").any()
        np.testing.assert_allclose(data.temperature[0], 0.1 + 0.2 * data.y)
    assert not state_folder(tmp_path / "out.nc").exists()


def test_late_heat_flow_is_the_steady_conductivity(tmp_path):
    changed = STUDY.replace("[0.0, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0]", "[0.0, 40.0, 80.0]").replace(
        "steps = 4", "steps = 80"
    )
    content = tomllib.loads(changed)
    content["walls"] = {"left": {"type": "fixed", "value": 1.0}, "right": {"type": "fixed", "value": 0.0}}
    content["source"] = []
    done = run_transient(parse_study(content), tmp_path)
    last = done.states[-1]
    steady = pipe_conductivity(medium_of(done.network.with_resistance(0.1)), axes=(0,)).tensor[0, 0]
    assert done.system.heat.rates(last.time, last.temperatures)[0] == pytest.approx(steady, rel=1e-8)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_run_from_states_gives_the_same_bits(tmp_path, scheme):
    control = "" if scheme == "adaptive" else "step = 0.004"
    text = STUDY.replace('scheme = "bdf2"\nsteps = 4', f'scheme = "{scheme}"\n{control}')
    study = parse_study(tomllib.loads(text))
    whole = run_transient(study, tmp_path, tmp_path / "out.nc")
    folder = state_folder(tmp_path / "out.nc")
    assert len(read_states(folder)) == 7
    for index in (4, 5, 6):
        state_path(folder, index).unlink()
    state_path(folder, 3).write_bytes(state_path(folder, 3).read_bytes()[:500])  # damaged by a crash
    again = run_transient(study, tmp_path, tmp_path / "out.nc", resume=True)
    assert again.resumed == 3
    for a, b in zip(whole.states, again.states, strict=True):
        assert a.temperatures.tobytes() == b.temperatures.tobytes()
        assert a.heat.tobytes() == b.heat.tobytes()
        assert (a.steps, a.iterations, a.stored) == (b.steps, b.iterations, b.stored)


def test_killed_in_the_middle_and_resumed_gives_the_same_bits(etc_engine, tmp_path):
    times = ", ".join(f"{0.05 * k:.2f}" for k in range(60))
    study = write(
        tmp_path, STUDY.replace("0.0, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0", times).replace("steps = 4", "steps = 400")
    )
    output, reference = tmp_path / "out.nc", tmp_path / "reference.nc"
    command = [sys.executable, "-m", "etc_engine", "transient", str(study), "-o", str(output)]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}
    running = subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 60.0
    while not state_path(state_folder(output), 5).exists():
        assert running.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.002)
    running.send_signal(signal.SIGKILL)
    running.wait()
    written = len(read_states(state_folder(output)))
    assert 6 <= written < 60
    assert not output.exists()
    refused = etc_engine("transient", study, "-o", output)
    assert refused.returncode == 2
    assert "--resume or --overwrite" in refused.stderr
    resumed = etc_engine("transient", study, "-o", output, "--resume")
    assert resumed.returncode == 0, resumed.stderr
    assert f"({written} of them from before)" in resumed.stderr
    assert etc_engine("transient", study, "-o", reference).returncode == 0
    with xarray.open_dataset(output) as a, xarray.open_dataset(reference) as b:
        assert differing_variables(a, b) == []
    assert etc_engine("transient", study, "-o", output, "--resume").stderr.strip().endswith("nothing is left to do")


def test_a_warning_signal_stops_early_and_says_so(tmp_path):
    study = write(tmp_path, STUDY.replace("steps = 4", "steps = 200000"))
    output = tmp_path / "out.nc"
    command = [sys.executable, "-m", "etc_engine", "transient", str(study), "-o", str(output)]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}
    running = subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 60.0
    while not state_path(state_folder(output), 0).exists():
        assert running.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.01)
    running.terminate()
    _, errors = running.communicate(timeout=60)
    assert running.returncode == 75
    assert "stopped early (SIGTERM): " in errors
    assert "continue with --resume" in errors


def test_another_study_does_not_go_on_from_these_states(etc_engine, tmp_path):
    study = parse_study(tomllib.loads(STUDY))
    run_transient(study, tmp_path, tmp_path / "out.nc")
    changed = write(tmp_path, STUDY.replace("heat_capacity = 2.0", "heat_capacity = 3.0"))
    done = etc_engine("transient", changed, "-o", tmp_path / "out.nc", "--resume")
    assert done.returncode == 2
    assert "belongs to another study" in done.stderr
    assert etc_engine("transient", changed, "-o", tmp_path / "out.nc", "--overwrite").returncode == 0


def test_particles_from_a_file_and_values_by_particle(etc_engine, tmp_path):
    (tmp_path / "disks.csv").write_text("x,y,radius,conductivity\n0.25,0.5,0.25,1.0\n0.75,0.5,0.25,2.0\n")
    text = """
schema = 2
kind = "network"
name = "two disks"
[packing]
files = "disks.csv"
box = [1.0, 1.0]
[contacts]
rule = "bonded"
contact_angle = 10.0
[particles]
heat_capacity = [1.0, 3.0]
initial = [5.0, 1.0]
[time]
scheme = "adaptive"
tolerance = 1e-6
times = [0.0, 200.0]
"""
    done = etc_engine("transient", write(tmp_path, text), "-o", tmp_path / "out.nc")
    assert done.returncode == 0, done.stderr
    with xarray.open_dataset(tmp_path / "out.nc") as data:
        assert float(data.heat_capacity[1] / data.heat_capacity[0]) == pytest.approx(3.0)
        np.testing.assert_allclose(data.temperature[-1], 2.0, atol=1e-4)


def test_picture_and_vtk_series(etc_engine, tmp_path):
    pytest.importorskip("vtkmodules.vtkIOXML", reason="the extra vtk is not installed")
    outputs = ["--vtk", tmp_path / "bed.pvd"]
    done = etc_engine("transient", write(tmp_path), "-o", tmp_path / "out.nc", *outputs)
    assert done.returncode == 0, done.stderr
    entries = ElementTree.parse(tmp_path / "bed.pvd").findall(".//DataSet")
    assert [float(entry.get("timestep")) for entry in entries] == [0.0, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0]
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    with xarray.open_dataset(tmp_path / "out.nc") as data:
        for k, entry in enumerate(entries):
            reader = vtkXMLPolyDataReader()
            reader.SetFileName(str(tmp_path / entry.get("file")))
            reader.Update()
            cells = reader.GetOutput().GetCellData()
            np.testing.assert_array_equal(vtk_to_numpy(cells.GetArray("temperature")), data.temperature[k])


def test_picture(etc_engine, tmp_path):
    done = etc_engine("transient", write(tmp_path), "-o", tmp_path / "out.nc", "--plot", tmp_path / "out.png")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out.png").stat().st_size > 20_000


def test_times_of_a_picture_share_the_way_evenly():
    means = 1.0 - np.exp(-np.linspace(0.0, 8.0, 81))
    shown = pick_times(means, 5)
    assert (shown[0], shown[-1]) == (0, 80)
    np.testing.assert_allclose(means[shown], np.linspace(0.0, means[-1], 5), atol=0.04)
    assert pick_times(np.ones(9), 4) == [0, 3, 5, 8]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('engine = "pipe"', 'engine = "magic"', "conduction.engine: found 'magic', allowed: dtem, pipe"),
        ('engine = "pipe"', 'engine = ["pipe"]', "conduction.engine: found ['pipe'], allowed: dtem or pipe"),
        ('engine = "pipe"', 'engine = "voxel"', "engine: found 'voxel', a transient takes dtem or pipe"),
        (
            'engine = "pipe"',
            'engine = "pipe"\nmethod = "arc"',
            "method: found 'arc', allowed with pipe: chord, uniform",
        ),
        ('engine = "pipe"', 'method = "pipe"', "method: found 'pipe', allowed with dtem: chord"),
        ("schema = 2", "schema = true", "schema: found true, allowed: 2"),
        ("steps = 4", "steps = 0", "time.steps"),
        ("steps = 4", "", "needs either step"),
        ("steps = 4", "steps = 4\nstep = 0.1", "not both"),
        ("steps = 4", "steps = 4\ntolerance = 1e-3", "tolerance: has no effect with scheme"),
        ('scheme = "bdf2"', 'scheme = "heun"', "found 'heun', allowed: explicit-euler"),
        ("heat_capacity = 2.0", "heat_capacity = -2.0", "particles.heat_capacity"),
        ("heat_capacity = 2.0", "heat_capacity = [1.0, 2.0]", "the heat capacity must be one number or an array"),
        ("seed = 7", "", "seed: [packing] draws random numbers"),
        ('radii = "uniform:0.03:0.05"', 'files = "none.csv"\nradii = "equal:0.1"', "packing.radii: unknown key"),
        ('type = "fixed", value = 1.0', 'type = "fixed"', "walls.left: value: missing, type = 'fixed' needs one"),
        ("coefficient = 1.5, ", "", "walls.right: coefficient: missing"),
        ("particles = [3, 4, 4]", "particles = [9999]", "there is no particle 9999"),
        ("times = [0.0, 1.0]", "times = [1.0, 0.0]", "right.value.times: they must increase"),
        ("contact_angle = 10.0", "contact_angle = [5.0, 10.0]", "contacts.contact_angle: a transient takes one value"),
        ('scheme = "bdf2"\nsteps = 4', 'scheme = "explicit-euler"\nsteps = 1', "exceeds the critical one"),
        ("0.1, 0.2, 0.3", "0.2, 0.1, 0.3", "they must increase"),
        ("0.1, 0.2, 0.3", "1e-320, 0.2, 0.3", "time.times: they must increase, by 1e-100 s at least"),
        ("0.1, 0.2, 0.3", "0.1, true, 0.3", "time.times[2]: found True, allowed: a list of output times"),
        ("heat_capacity = 2.0", "heat_capacity = 1e300", "particles.heat_capacity: found 1e+300, allowed: a positive"),
        ("heat_capacity = 2.0", "heat_capacity = '2'", "particles.heat_capacity: found '2', allowed"),
        ("heat_capacity = 2.0", "heat_capacity = []", "particles.heat_capacity"),
        ('engine = "pipe"', "dipoles = 'yes'", "conduction.dipoles: found 'yes', allowed: true or false"),
        ("particles = [3, 4, 4]", "particles = [3.0]", "source[0].particles[0]: found 3.0, allowed: a list of whole"),
        ("particles = [3, 4, 4]", "particles = []", "source[0].particles: found [], allowed: a list of whole"),
        ("heat = 0.02", "heat = 'much'", "source[0].heat: found 'much', allowed: a number of at most 1e100"),
        ("heat = 0.02", "heat = [1.0]", "source[0].heat: found [1.0], allowed: a number of at most 1e100"),
        ("value = 1.0", "valeu = 1.0", "walls.left.valeu: unknown key, did you mean 'value'? allowed: type, value"),
        ("times = [0.0, 1.0], values", "time = [0.0, 1.0], values", "walls.right.value.time: unknown key, did you"),
        ("values = [0.0, 0.5]", "values = [0.0, 'x']", "walls.right.value.values[1]: found 'x', allowed: a list"),
        ("gradient = [0.0, 0.2]", "gradient = [0.0]", "gradient: found [0.0], allowed: two or three numbers [K/m]"),
        ("gradient = [0.0, 0.2]", "gradient = [0.0, 0.2, 0.1]", "gradient: expected 2 numbers, found 3"),
        ('top = { type = "insulated" }', "top = 5", "walls.top: found 5, allowed: a table such as"),
        ('type = "insulated"', 'type = "insulated", value = 1.0', "walls.top: value: has no effect with type"),
        ('type = "insulated"', 'type = "insulated", coefficient = 1.0', "walls.top: coefficient: has no effect"),
        ("seed = 7", "seed = true", "seed: found True, allowed: a whole number"),
    ],
)
def test_refused_studies(etc_engine, tmp_path, old, new, message):
    assert old in STUDY
    done = etc_engine("transient", write(tmp_path, STUDY.replace(old, new, 1)), "-o", tmp_path / "out.nc")
    assert (done.returncode, done.stdout) == (2, "")
    assert message in done.stderr
    assert "function-" not in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["study.toml"]


def test_missing_files_and_misplaced_options(etc_engine, tmp_path):
    text = STUDY.replace('radii = "uniform:0.03:0.05"', 'files = "none.csv"')
    done = etc_engine("transient", write(tmp_path, text), "-o", tmp_path / "out.nc")
    assert "there is no file" in done.stderr
    done = etc_engine("transient", write(tmp_path), "-o", tmp_path / "out.nc", "--vtk", tmp_path / "a.vtp")
    assert "written to a .pvd file" in done.stderr
    done = etc_engine("transient", write(tmp_path), "-o", tmp_path / "out.nc", "--resume", "--overwrite")
    assert "choose one" in done.stderr


def test_the_uniform_pipe_is_another_system(tmp_path):
    study = parse_study(tomllib.loads(STUDY))
    uniform = parse_study(tomllib.loads(STUDY.replace('"pipe"', '"pipe"\nmethod = "uniform"')))
    chord, other = (run_transient(words, tmp_path).system for words in (study, uniform))
    assert other.heat.conductance.diagonal().max() < chord.heat.conductance.diagonal().max()


def test_a_state_comes_back_from_disk(tmp_path):
    study = parse_study(tomllib.loads(STUDY))
    state = run_transient(study, tmp_path).states[2]
    write_state(tmp_path, 0, state)
    (again,) = read_states(tmp_path)
    assert again.older.tobytes() == state.older.tobytes()
    assert (again.time, again.step) == (state.time, state.step)


DISKS = "x,y,radius\n0.25,0.5,0.25\n0.75,0.5,0.25\n"
PAIR = """
schema = 2
kind = "network"
name = "two disks"
[packing]
files = "disks.csv"
box = [1.0, 1.0]
[contacts]
rule = "bonded"
contact_angle = 10.0
[particles]
heat_capacity = 1.0
initial = 0.0
[walls]
left = { type = "fixed", value = 1.0 }
[time]
steps = 2
times = [0.0, 1.0, 2.0]
"""


@pytest.fixture
def pair(tmp_path):
    (tmp_path / "disks.csv").write_text(DISKS)
    return write(tmp_path, PAIR)


@pytest.mark.parametrize("name", ["disks.csv", "study.toml"])
def test_no_output_replaces_an_input(etc_engine, pair, name):
    done = etc_engine("transient", pair, "-o", pair.parent / name, "--overwrite")
    assert done.returncode == 2
    assert "is the input itself" in done.stderr
    assert (pair.read_text(), (pair.parent / "disks.csv").read_text()) == (PAIR, DISKS)


def test_a_complete_output_is_of_its_study_and_is_drawn_from(etc_engine, pair):
    output, picture = pair.parent / "out.nc", pair.parent / "out.png"
    assert etc_engine("transient", pair, "-o", output).returncode == 0
    before = output.read_bytes()
    done = etc_engine("transient", pair, "-o", output, "--resume", "--plot", picture)
    assert done.returncode == 0, done.stderr
    assert "drawn from it" in done.stderr
    assert picture.stat().st_size > 10_000
    pair.write_text(PAIR.replace("steps = 2", "steps = 3"))
    done = etc_engine("transient", pair, "-o", output, "--resume")
    assert done.returncode == 2
    assert "belongs to another study (time.steps is 2 there and 3 here)" in done.stderr
    assert output.read_bytes() == before


def test_frames_of_another_series_are_kept(etc_engine, pair):
    pytest.importorskip("vtkmodules.vtkIOXML", reason="the extra vtk is not installed")
    (pair.parent / "late").mkdir()
    old = [pair.parent / "late" / f"late-{k:05d}.vtp" for k in (0, 7)]
    for path in old:
        path.write_text("precious")
    command = ["transient", pair, "-o", pair.parent / "out.nc", "--vtk", pair.parent / "late.pvd"]
    done = etc_engine(*command)
    assert done.returncode == 2
    assert "holds .vtp files already" in done.stderr
    assert [path.read_text() for path in old] == ["precious"] * 2
    assert etc_engine(*command, "--overwrite").returncode == 0
    assert sorted(path.name for path in (pair.parent / "late").iterdir()) == [f"late-{k:05d}.vtp" for k in range(3)]


@pytest.mark.parametrize("method", ["pipe", "chord", "arc"])
@pytest.mark.parametrize("coefficient", [1e3, 1e6, 1e15])
def test_a_firm_convective_wall_keeps_the_digits_of_its_heat(pair, method, coefficient):
    """It tends to a wall of given temperature; over the film alone its heat would be a difference of equals."""
    word = {"engine": "pipe"} if method == "pipe" else {"method": method}
    content = tomllib.loads(PAIR) | {"conduction": word}
    wall = {"type": "convective", "coefficient": coefficient, "value": 1.0}
    soft = run_transient(parse_study(content | {"walls": {"left": wall}}), pair.parent).states[-1]
    firm = run_transient(parse_study(content), pair.parent).states[-1]
    assert abs(soft.imbalance) < 1e-12
    assert soft.heat.sum() == pytest.approx(firm.heat.sum(), rel=10.0 / coefficient, abs=1e-12)


@pytest.mark.parametrize("control", ["steps = 1_000_000_000_000", "step = 1e-12"])
def test_an_endless_run_is_refused(etc_engine, pair, control):
    pair.write_text(PAIR.replace("steps = 2", control))
    done = etc_engine("transient", pair, "-o", pair.parent / "out.nc")
    assert done.returncode == 2
    assert "2e+12 steps in total, allowed are 1e+09" in done.stderr


def test_numbers_beyond_double_precision_are_refused(etc_engine, pair):
    """Each value is within its bounds, what they come to is not; warnings are errors here."""
    (pair.parent / "disks.csv").write_text("x,y,radius\n0.25,0.5,1e-60\n0.75,0.5,1e-60\n")
    text = PAIR.replace("0.0, 1.0, 2.0", "0.0, 1e100").replace("heat_capacity = 1.0", "heat_capacity = 1e-100")
    text = text.replace("steps = 2", "steps = 2\nscheme = 'explicit-euler'")
    pair.write_text(text.replace("[walls]", "[[source]]\nheat = 1e100\n[walls]"))
    done = etc_engine("transient", pair, "-o", pair.parent / "out.nc")
    assert done.returncode == 2
    assert "finite" in done.stderr or "double precision" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_a_picture_of_a_flat_bed_holds_all_its_words(pair):
    """Of boxes of four to one and flatter the label of the colour bar was cut off."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    content = tomllib.loads(PAIR) | {"packing": {"files": "disks.csv", "box": [8.0, 1.0]}, "walls": {}}
    series = series_dataset(run_transient(parse_study(content), pair.parent))
    figure = draw_transient(series)
    FigureCanvasAgg(figure).draw()
    bars, curves = figure.subfigs
    label = bars.axes[-1].yaxis.label.get_window_extent()
    assert label.y0 >= bars.bbox.y0
    assert label.y1 <= bars.bbox.y1
    means = curves.axes[1]
    assert means.get_legend().get_window_extent().y0 >= means.get_window_extent().y1
