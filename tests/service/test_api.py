"""What the service answers, asked over HTTP as its users do."""

from __future__ import annotations

import gzip
import json
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from serving import STUDY, Service, ask, renamed, until

from etc_engine.box import Box
from etc_engine.comparison import simulated
from etc_engine.errors import InputError, OutputError
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.formats import FORMATS, write_particles
from etc_engine.particle_files.table import ParticleTable
from etc_engine.service import client
from etc_engine.sweep.dataset import differing_variables
from etc_engine.sweep.result_file import open_dataset

PARTICLES = b"x,y,radius\n0.25,0.5,0.26\n0.75,0.5,0.26\n"


@pytest.fixture(scope="module")
def real(tmp_path_factory):
    """A service with the real engine."""
    with Service(tmp_path_factory.mktemp("real") / "data", {"ranks": 2}) as running:
        yield running


@pytest.fixture(scope="module")
def finished(real):
    study = client.submit(real.server, STUDY)
    assert study["new"]
    return client.wait(real.server, study["id"], interval=0.05)


def test_a_study_ends_in_the_bits_of_the_command(real, finished, tmp_path, etc_engine):
    assert (finished["state"], finished["done"], finished["planned"]) == ("done", 6, 6), finished
    (tmp_path / "study.toml").write_text(STUDY)
    assert etc_engine("sweep", tmp_path / "study.toml", "-o", tmp_path / "out.nc").returncode == 0
    fetched = client.fetch(real.server, finished["id"], tmp_path / "fetched.nc")
    assert differing_variables(open_dataset(tmp_path / "out.nc"), fetched) == []
    assert "6 units (6 computed now" in finished["log"]
    assert "result.nc.shards" not in {path.name for path in real.data.glob("studies/*/*")}


def test_the_same_study_is_answered_from_the_result(real, finished):
    """Neither layout, order, comments nor JSON make it another study."""
    other = '# mine\nname = "served"\nschema = 2\nseed = 271828\n' + STUDY[STUDY.index("[packing]") :]
    for same in (STUDY, other, tomllib.loads(STUDY)):
        again = client.submit(real.server, same)
        assert (again["id"], again["new"], again["state"]) == (finished["id"], False, "done")
    assert client.submit(real.server, renamed("else"))["id"] != finished["id"]


def test_the_figure_has_the_numbers_of_the_result(real, finished):
    _, _, body = ask(f"{real.url}/api/studies/{finished['id']}/curve")
    curve = json.loads(body)
    assert curve["complete"]
    statistics = simulated(client.fetch(real.server, finished["id"]))
    assert curve["density"] == [0.55, 0.60]
    assert [one["values"] for one in curve["series"]] == [{"contact_angle": 5.0}, {"contact_angle": 10.0}]
    assert [one["name"] for one in curve["series"]] == ["5°", "10°"]
    for one in curve["series"]:
        cell = statistics.sel(one["values"])
        for key, name in (
            ("mean", "conductivity_mean"),
            ("low", "conductivity_ci_low"),
            ("high", "conductivity_ci_high"),
        ):
            np.testing.assert_array_equal(one[key], cell[name].values)
        assert one["count"] == [3, 3]
    assert {"maxwell", "hashin_shtrikman_upper"} <= {model["name"] for model in curve["models"]}


FILLED = """schema = 2
name = "filled"
seed = 271828
[packing]
method = "random-sequential"
radii = "equal"
box = [1.0, 1.0]
periodic = "xy"
count = 9
density = [0.1, 0.2]
[conduction]
engine = "voxel"
tolerance = 1e-6
resolution = 40
[particles]
conductivity = [2.0, 10.0]
[pores]
conductivity = 1.0
[statistics]
realizations = 2
"""


def test_pores_that_conduct_are_swept_over_conductivities(real):
    study = client.submit(real.server, FILLED)["id"]
    ended = client.wait(real.server, study, interval=0.05)
    assert ended["state"] == "done", ended
    curve = json.loads(ask(f"{real.url}/api/studies/{study}/curve")[2])
    statistics = simulated(client.fetch(real.server, study))
    assert [one["values"] for one in curve["series"]] == [{"particle_conductivity": k} for k in (2.0, 10.0)]
    for one in curve["series"]:
        np.testing.assert_array_equal(one["mean"], statistics["conductivity_mean"].sel(one["values"]).values)
    maxwell = next(model for model in curve["models"] if model["name"] == "maxwell")
    assert len(maxwell["curves"]) == 2
    for values, contrast in zip(maxwell["curves"], (2.0, 10.0), strict=True):
        beta, fraction = (contrast - 1.0) / (contrast + 1.0), curve["solid_fraction"][0]
        assert values[0] == pytest.approx((1.0 + beta * fraction) / (1.0 - beta * fraction), rel=1e-9)


def test_the_report_is_a_page_that_may_run_nothing(real, finished):
    pytest.importorskip("matplotlib")
    status, headers, body = ask(f"{real.url}/api/studies/{finished['id']}/report.html")
    assert status == 200
    assert body.startswith(b"<!DOCTYPE html>")
    assert "sandbox" in headers["content-security-policy"]


def test_the_packing_of_a_study_is_a_picture(real, finished):
    pytest.importorskip("matplotlib")
    for _ in range(2):  # drawn, then kept
        status, headers, body = ask(f"{real.url}/api/studies/{finished['id']}/bed.png")
        assert (status, headers["content-type"]) == (200, "image/png")
        assert body.startswith(b"\x89PNG") and len(body) > 10_000
    kept = real.data / "studies" / finished["id"] / "bed.png"
    assert kept.read_bytes() == body


@pytest.mark.parametrize(
    ("options", "arguments"),
    [
        ({"box": "1,1"}, ["--box", "1,1"]),
        ({"box": "1,1", "contact_angle": 5}, ["--box", "1,1", "--contact-angle", "5"]),
        ({"box": "1,1", "engine": "pipe"}, ["--box", "1,1", "--engine", "pipe"]),
        (
            {"box": "1,1", "engine": "pipe", "method": "uniform"},
            ["--box", "1,1", "--engine", "pipe", "--method", "uniform"],
        ),
    ],
)
def test_a_single_solve_is_that_of_the_command(service, tmp_path, etc_engine, options, arguments):
    (tmp_path / "disks.csv").write_bytes(PARTICLES)
    printed = json.loads(etc_engine("solve", tmp_path / "disks.csv", *arguments, "--json").stdout)
    found = client.solve(service.server, PARTICLES, **options)
    keys = printed.keys() - {"seconds", "compile_seconds"}
    assert {key: found[key] for key in keys} == {key: printed[key] for key in keys}


def test_a_dump_brings_its_box(service):
    dump = (service.data.parents[0] / "x.dump").with_name("x")
    text = "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS ff ff pp\n0 1\n0 1\n-0.5 0.5\n"
    dump.write_text(text + "ITEM: ATOMS id x y z radius\n1 0.25 0.5 0 0.26\n2 0.75 0.5 0 0.26\n")
    found = client.solve(service.server, dump.read_bytes())
    assert found["conductivity"] == client.solve(service.server, PARTICLES, box="1,1")["conductivity"]


SPHERES = ((0.25, 0.5, 0.5, 0.26), (0.75, 0.5, 0.5, 0.26))


def as_bytes(kind: str, folder: Path) -> bytes:
    """Two spheres in a unit cube, in one of the formats."""
    rows = ["{:g} {:g} {:g} {:g}".format(*sphere) for sphere in SPHERES]
    if kind == "YADE text file":
        return ("#format x_y_z_r\n" + "\n".join(rows) + "\n").encode()
    if kind == "XYZ file":
        head = '2\nLattice="1 0 0 0 1 0 0 0 1" pbc="F F F" Properties=pos:R:3:radius:R:1\n'
        return (head + "\n".join(rows) + "\n").encode()
    if kind == "MercuryDPM data file":
        lines = ["{:g} {:g} {:g} 0 0 0 {:g} 0 0 0 0 0 0 0".format(*sphere) for sphere in SPHERES]
        return ("2 0 0 0 0 1 1 1\n" + "\n".join(lines) + "\n").encode()
    if kind == "VTK file (legacy)":
        points = "\n".join("{:g} {:g} {:g}".format(*sphere[:3]) for sphere in SPHERES)
        head = f"# vtk DataFile Version 3.0\nspheres\nASCII\nDATASET POLYDATA\nPOINTS 2 double\n{points}\n"
        return f"{head}POINT_DATA 2\nSCALARS radius double 1\nLOOKUP_TABLE default\n0.26\n0.26\n".encode()
    ending = next(row.endings[0] for row in FORMATS if row.name == kind)
    packing = ParticlePacking([one[:3] for one in SPHERES], [one[3] for one in SPHERES], Box((1.0, 1.0, 1.0)))
    write_particles(folder / f"spheres{ending}", ParticleTable(packing))
    return (folder / f"spheres{ending}").read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("kind", FORMATS, ids=lambda kind: kind.name)
def test_every_format_that_is_read_is_solved(service, tmp_path, kind):
    if "VTK" in kind.name:
        pytest.importorskip("vtkmodules", reason="the extra vtk is not installed")
    particles = as_bytes(kind.name, tmp_path)
    box = {} if kind.brings_box else {"box": "1,1,1"}
    found = client.solve(service.server, particles, **box)
    assert found["particles"] == 2
    expected = b"x,y,z,radius\n0.25,0.5,0.5,0.26\n0.75,0.5,0.5,0.26\n"
    assert found["conductivity"] == client.solve(service.server, expected, box="1,1,1")["conductivity"]
    if kind.name == "dump":
        assert client.solve(service.server, gzip.compress(particles))["conductivity"] == found["conductivity"]


@pytest.mark.parametrize(
    ("particles", "options", "words"),
    [
        (PARTICLES, {}, "--box is missing"),
        (PARTICLES, {"box": "1,1", "method": "magic"}, "magic"),
        (b"x,y\n1,2\n", {"box": "1,1"}, "upload has neither a radius nor a diameter column"),
        (b"x,y,radius\n0.5,0.5,much\n", {"box": "1,1"}, "upload, line 2: radius is not a number: 'much'"),
        (b"\x89HDF\r\n\x1a\n", {}, "upload cannot be read as netCDF: it is damaged"),
        (b"", {"box": "1,1"}, "header"),
        (PARTICLES, {"box": "1,1", "contact_angle": "nan"}, "finite"),
        (PARTICLES, {"box": "; rm -rf"}, "box"),
        (PARTICLES, {"box": "1,1", "modes": "--help"}, "modes"),
    ],
)
def test_refused_particles(service, particles, options, words):
    with pytest.raises(InputError) as caught:
        client.solve(service.server, particles, **options)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
    assert str(service.data) not in str(caught.value)


@pytest.mark.parametrize(
    ("method", "path", "words"),
    [
        ("POST", "/api/solve?box=1,1&contact-angle=5", "did you mean 'contact_angle'"),
        ("POST", "/api/solve?box=1,1&box=2,2", "'box' is given twice"),
        ("POST", "/api/models/maxwell?k1=1", "unknown option 'k1' in the query, allowed: none here"),
        ("POST", "/api/studies?seed=7", "unknown option 'seed'"),
        ("GET", "/api/studies?stat=done", "did you mean 'state'"),
        ("GET", "/?x=1", "unknown option 'x'"),
    ],
)
def test_an_option_nobody_knows_is_not_ignored(service, method, path, words):
    status, _, body = ask(service.url + path, method, PARTICLES if method == "POST" else None)
    assert (status, words in json.loads(body)["error"]) == (422, True), body


def test_models_are_those_of_the_command(service, etc_engine):
    assert client.models(service.server) == json.loads(etc_engine("models", "--json").stdout)["models"]
    case = {"k1": 1.0, "k2": 10.0, "fraction": 0.3, "dimension": 2}
    words = [word for key, value in case.items() for word in (f"--{key}", str(value))]
    printed = json.loads(etc_engine("models", "maxwell", *words, "--json").stdout)
    assert client.evaluate(service.server, "maxwell", **case) == printed
    superconducting = client.evaluate(service.server, "simple_cubic", k1=1.0, k2=float("inf"), fraction=0.3)
    assert superconducting["conductivity"] == pytest.approx(2.3328845, abs=5.1e-8)  # the value of the command's test


@pytest.mark.parametrize(
    ("model", "inputs", "words"),
    [
        ("maxwel", {}, "did you mean maxwell"),
        ("maxwell", {"k1": 1.0, "k2": 2.0, "dimension": 2}, "also needs fraction"),
        ("maxwell", {"k1": 1.0, "k2": 2.0, "fraction": 2.0, "dimension": 2}, "[0, 1]"),
        ("maxwell", {"k1": 1.0, "k2": 2.0, "fraction": 0.2, "dimension": 2, "zeta2": 1.0}, "no parameter 'zeta2'"),
    ],
)
def test_refused_models(service, model, inputs, words):
    with pytest.raises(InputError) as caught:
        client.evaluate(service.server, model, **inputs)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("change", "field", "words"),
    [
        (("0.55, 0.60", "0.55, -0.60"), "packing.density", "-0.6"),
        (("realizations = 3", "realizations = 0"), "statistics.realizations", "at least 1"),
        (("uniform:0.03:0.06", "uniform:0.06"), "packing.radii", "uniform"),
        (('name = "served"', ""), "name", "missing"),
        (("[contacts]", "[contact]"), "contact", "did you mean 'contacts'"),
        (("realizations = 3", "realizations = 100000"), "statistics.realizations", "this service allows 100000"),
        (("box = [1.0, 1.0]", "box = [1e6, 1e6]"), "packing.box", "this service allows 1000000"),
        (("uniform:0.03:0.06", "equal:1e200"), "packing.radii", "expected 1e-15"),
        (("[packing]", "[packing"), "", "not valid TOML"),
        (("box = [1.0, 1.0]", "box = " + "[" * 5000), "", "not valid TOML"),
    ],
)
def test_a_refused_study_says_which_field(service, change, field, words):
    text = STUDY.replace(*change)
    for path in ("/api/studies", "/api/studies/check"):
        status, _, body = ask(service.url + path, "POST", text.encode(), content_type="application/toml")
        problem = json.loads(body)
        assert status == 422
        assert words in problem["error"]
        assert "\n" not in problem["error"]
        assert problem["field"] == field


@pytest.mark.parametrize(
    "body", [b"[1]", b"null", b"{", b'{"a": ' * 20000, b'{"name": "\\ud800"}', b'{"packing": {"box": [null]}}', b"\xff"]
)
def test_refused_json(service, body):
    status, _, answer = ask(f"{service.url}/api/studies", "POST", body, content_type="application/json")
    assert status in (413, 422)
    assert json.loads(answer)["error"]


@pytest.mark.parametrize(
    ("path", "body", "words"),
    [
        ("/api/studies", b'{"schema": 2, "schema": 2}', "study: the key 'schema' is given twice"),
        ("/api/studies", b'{"packing": {"count": 1, "count": 2}}', "study: the key 'count' is given twice"),
        ("/api/models/maxwell", b'{"k1": 1.0, "k1": 2.0}', "the key 'k1' is given twice"),
        ("/api/models/maxwell", b'{"k1": }', "the body is not valid JSON: Expecting value at character 7; expected"),
        ("/api/models/maxwell", b"[1]", "the body is not a JSON object"),
        ("/api/models/maxwell", b"", "expected"),
        ("/api/models/maxwell", b"\xff", "the body cannot be read as JSON; expected"),
        ("/api/studies/xyz/resume", b"", "study 'xyz': expected 16 hexadecimal digits"),
    ],
)
def test_what_is_no_good_json_is_told_plainly(service, path, body, words):
    status, _, answer = ask(service.url + path, "POST", body, content_type="application/json")
    assert (status, words in json.loads(answer)["error"]) == (400 if body == b"\xff" else 422, True), answer


def test_true_is_no_number_of_a_schema(service):
    for word, expected in (("true", 422), ("1", 422), ("2", 200)):
        text = STUDY.replace("schema = 2", f"schema = {word}")
        status, _, body = ask(f"{service.url}/api/studies/check", "POST", text.encode())
        assert status == expected, body
    assert json.loads(ask(f"{service.url}/api/studies/check", "POST", text.encode())[2])["name"] == "served"


def test_head_tells_what_get_would_bring(real, finished):
    for path in (
        "/",
        "/page/app.js",
        *(f"/api/studies/{finished['id']}/{part}" for part in ("result.nc", "study.toml")),
    ):
        status, headers, body = ask(real.url + path, "HEAD")
        assert (status, body) == (200, b"")
        assert int(headers["content-length"]) == len(ask(real.url + path)[2])


def test_a_check_tells_the_size_and_runs_nothing(service):
    before = len(client.studies(service.server))
    status, _, body = ask(f"{service.url}/api/studies/check", "POST", renamed("sized").encode())
    found = json.loads(body)
    assert (status, found["units"], found["cells"], found["known"]) == (200, 6, 12, False)
    assert 80 < found["particles"] < 100  # 0.6 of the box over the mean area, pi 0.0021
    assert len(client.studies(service.server)) == before


def test_unknown_studies_and_files_are_404(service):
    for path in ("/api/studies/0123456789abcdef", "/api/studies/0123456789abcdef/result.nc", "/api/nothing"):
        status, _, body = ask(service.url + path)
        assert status == 404
        assert json.loads(body)["error"]
    for path in (
        "/api/studies/..%2f..%2fqueue.sqlite/study.toml",
        "/api/studies/%2e%2e/study.toml",
        "/page/..%2fapp.py",
    ):
        assert ask(service.url + path)[0] in (404, 422)


def test_cancel_resume_and_remove(tmp_path):
    environment = {"ETC_TEST_SECONDS": "0.6"}
    with Service(tmp_path / "data", slow=True, environment=environment) as service:
        server = service.server
        running, waiting = client.submit(server, STUDY)["id"], client.submit(server, renamed("second"))["id"]
        until(lambda: client.status(server, running)["done"] >= 1)
        assert client.status(server, waiting)["state"] == "queued"
        with pytest.raises(InputError, match="its result is there when it is done"):
            client.fetch(server, running)
        status, _, body = ask(f"{service.url}/api/studies/{running}", "DELETE")
        assert (status, "cancel it first" in json.loads(body)["error"]) == (409, True)
        curve = until(lambda: json.loads(ask(f"{service.url}/api/studies/{running}/curve")[2]).get("series"))
        assert curve[0]["count"] != [3, 3]  # some realizations only
        client.cancel(server, waiting)
        assert client.status(server, waiting)["state"] == "cancelled"
        client.cancel(server, running)
        stopped = client.wait(server, running, interval=0.05)
        assert (stopped["state"], stopped["reason"]) == ("cancelled", "cancelled")
        assert 1 <= stopped["done"] < 6
        assert "stopped early (SIGTERM)" in stopped["log"]
        with pytest.raises(InputError, match="only one that waits or runs"):
            client.cancel(server, running)
        client.resume(server, running)
        assert client.submit(server, renamed("second"))["state"] == "queued"  # handing it in again goes on too
        done = client.wait(server, running, interval=0.05)
        assert (done["state"], done["done"]) == ("done", 6)
        assert "units are finished already" in done["log"]
        assert client.wait(server, waiting, interval=0.05)["state"] == "done"
        assert ask(f"{service.url}/api/studies/{waiting}", "DELETE")[0] == 204
        assert not (service.data / "studies" / waiting).exists()
        assert [study["id"] for study in client.studies(server)] == [running]


def test_a_time_limit_ends_a_study_and_says_so(tmp_path):
    options = {"limits": {"study_seconds": 1.5}}
    with Service(tmp_path / "data", options, {"ETC_TEST_SECONDS": "2"}, slow=True) as service:
        study = client.submit(service.server, STUDY)["id"]
        ended = client.wait(service.server, study, interval=0.1)
        assert ended["state"] == "failed"
        assert "time limit of this service, 1.5 s" in ended["reason"]


@pytest.mark.parametrize(
    ("limits", "words"),
    [({"solve_seconds": 0.05, "memory_bytes": 2**40}, "longer than 0.05 s"), ({"memory_bytes": 20 * 2**20}, "memory")],
)
def test_time_and_memory_limits_of_a_single_solve(tmp_path, limits, words):
    with Service(tmp_path / "data", {"limits": limits}) as service:
        with pytest.raises(InputError) as caught:
            client.solve(service.server, PARTICLES, box="1,1")
        assert words in str(caught.value)


def test_a_refused_batch_fails_with_its_own_words(tmp_path):
    with Service(tmp_path / "data", slow=True) as service:
        folder = service.data / "studies"
        study = json.loads(ask(f"{service.url}/api/studies/check", "POST", STUDY.encode())[2])["id"]
        (folder / study / "result.nc").mkdir(parents=True)  # nobody can write a file there
        client.submit(service.server, STUDY)
        ended = client.wait(service.server, study, interval=0.05)
        assert ended["state"] == "failed"
        assert "is a folder" in ended["reason"]


def test_a_batch_that_always_dies_is_given_up_and_says_so(tmp_path):
    deadly = [sys.executable, "-c", "import os; os.kill(os.getpid(), 9)"]
    with Service(tmp_path / "data", {"engine": deadly}) as service:
        ended = client.wait(service.server, client.submit(service.server, STUDY)["id"], interval=0.05)
        assert (ended["state"], ended["reason"]) == ("failed", "its batch ended with status -9, see the log")
        assert ended["log"].count("== start") == 3


def test_the_client_names_what_is_not_there():
    with pytest.raises(OutputError, match=r"does not answer .*is the service running there"):
        client.status(client.Server("http://127.0.0.1:9"), "0123456789abcdef")
    with pytest.raises(InputError, match="expected an address"):
        client.Server("ftp://x")
