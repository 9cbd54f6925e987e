"""The command `sweep`: refusals in one line, resume, overwrite, lock, SIGTERM, exit statuses."""

from __future__ import annotations

import importlib.util
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import xarray

from etc_engine.sweep.dataset import differing_variables
from etc_engine.sweep.result_file import open_dataset
from etc_engine.sweep.shards import frame, unframe

STAND_IN = Path(__file__).parent.parent / "stand_in.py"
STUDY = """
schema = 2
name = "commands"
seed = 20261
[packing]
radii = "uniform:0.01:0.02"
box = [1.0, 1.0]
density = [0.65, 0.7]
[contacts]
rule = "bonded"
contact_angle = [2.5, 5.0]
[statistics]
realizations = 5
"""


def command(*arguments: object) -> list[str]:
    return [sys.executable, str(STAND_IN), *map(str, arguments)]


def process(*arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command(*arguments), capture_output=True, text=True, check=False, timeout=120)


@pytest.fixture
def stand_in(capsys):
    """The stand-in's command line inside this process, which saves the imports."""
    spec = importlib.util.spec_from_file_location("stand_in", STAND_IN)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)

    def call(*arguments: object) -> subprocess.CompletedProcess[str]:
        capsys.readouterr()
        status = module.main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return subprocess.CompletedProcess(arguments, status, captured.out, captured.err)

    return call


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(STUDY)
    return path


def interrupted(study: Path, output: Path, log: Path, number: int, seconds: float = 0.2) -> tuple[int, str]:
    """A sweep that gets a signal after three units, and how it ended."""
    running = subprocess.Popen(
        command(study, "-o", output, "--seconds", seconds, "--log", log), stderr=subprocess.PIPE, text=True
    )
    wait_for_lines(log, 3)
    running.send_signal(number)
    _, errors = running.communicate(timeout=60)
    return running.returncode, errors


def wait_for_lines(path: Path, count: int) -> None:
    deadline = time.monotonic() + 60.0
    while not path.exists() or len(path.read_text().splitlines()) < count:
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_the_file_is_what_the_schema_says(stand_in, study, tmp_path):
    output = tmp_path / "out.nc"
    done = stand_in(study, "-o", output)
    assert done.returncode == 0
    assert done.stdout.startswith(f"{output}: 10 units (10 computed now on 1 rank")
    with xarray.open_dataset(output) as data:
        assert dict(data.sizes) == {
            "density": 2,
            "contact_angle": 2,
            "realization": 5,
            "direction_i": 2,
            "direction_j": 2,
        }
        assert data["contact_angle"].attrs["units"] == "degree"
        assert "not a wetting angle" in data["contact_angle"].attrs["comment"]
        assert data["conductivity"].dims == (
            "density",
            "contact_angle",
            "realization",
            "direction_i",
            "direction_j",
        )
        assert data["status"].attrs["flag_meanings"].split() == [
            "ok",
            "not_percolating",
            "packing_failed",
            "not_converged",
            "error",
            "not_run",
        ]
        assert data["status"].attrs["flag_values"].tolist() == list(range(6))
        assert data.attrs["study"] == STUDY
        assert data.attrs["seed"] == 20261
        assert data["conductivity_ci_low"].attrs["confidence_level"] == 0.95
        kxx = data["conductivity"].sel(direction_i="x", direction_j="x")
        mean = data["conductivity_mean"].sel(direction_i="x", direction_j="x")
        assert abs(kxx.mean("realization") - mean).max() < 1e-15
        assert data["conductivity"].sel(direction_i="x", direction_j="y").isnull().all()
        for name, variable in data.variables.items():
            assert variable.attrs.get("long_name"), name


def test_failed_cells_stay_out_and_are_told(stand_in, study, tmp_path):
    study.write_text(STUDY.replace("realizations = 5", "realizations = 40"))
    done = stand_in(study, "-o", tmp_path / "out.nc", "--trouble")
    assert done.returncode == 4
    data = open_dataset(tmp_path / "out.nc")
    status, kxx = data["status"], data["conductivity"].sel(direction_i="x", direction_j="x")
    assert {0, 1, 3, 4} == set(status.values.ravel().tolist())
    assert kxx.where(status > 1).isnull().all()
    assert (kxx.where(status == 1, 0.0) == 0.0).all()
    assert (data["count"] == (status <= 1).sum("realization")).all()
    mean = data["conductivity_mean"].sel(direction_i="x", direction_j="x")
    assert abs(kxx.where(status <= 1).mean("realization") - mean).max() < 1e-14
    assert f"{int((status > 1).sum())} cells have no conductivity" in done.stderr
    assert set(data["message"].values[status.values == 3].tolist()) == {"stopped after 100 iterations"}
    assert all(m.startswith("ZeroDivisionError: a draw of") for m in data["message"].values[status.values == 4])
    assert (data["message"].values[status.values <= 1] == "").all()


def test_without_prescribed_angles_there_is_no_angle_dimension(stand_in, study, tmp_path):
    text = STUDY.replace('rule = "bonded"\ncontact_angle = [2.5, 5.0]', 'rule = "overlap"')
    study.write_text(text.replace("density = [0.65, 0.7]\n", ""))
    assert stand_in(study, "-o", tmp_path / "out.nc").returncode == 0
    data = open_dataset(tmp_path / "out.nc")
    assert data["conductivity_mean"].dims == ("density", "direction_i", "direction_j")
    assert data["density"].values == pytest.approx([0.8])  # the stand-in's own


def test_an_added_density_or_realization_changes_no_other_cell(stand_in, study, tmp_path):
    stand_in(study, "-o", tmp_path / "few.nc")
    study.write_text(STUDY.replace("[0.65, 0.7]", "[0.7, 0.6, 0.65, 0.75]").replace("= 5\n", "= 8\n"))
    stand_in(study, "-o", tmp_path / "many.nc")
    few, many = open_dataset(tmp_path / "few.nc"), open_dataset(tmp_path / "many.nc")
    part = many.sel(density=few["density"], realization=few["realization"])
    assert (part["conductivity"].values.tobytes()) == few["conductivity"].values.tobytes()
    assert (part["random_stream"].values == few["random_stream"].values).all()


def test_an_existing_output_is_refused_resumed_or_replaced(stand_in, study, tmp_path):
    output, log = tmp_path / "out.nc", tmp_path / "log"
    stand_in(study, "-o", output)
    before = output.read_bytes()
    refused = stand_in(study, "-o", output, "--log", log)
    assert refused.returncode == 2
    assert refused.stderr.splitlines() == [
        f"etc-engine: {output} exists: continue with --resume, or start anew with --overwrite"
    ]
    resumed = stand_in(study, "-o", output, "--log", log, "--policy", "resume")
    assert resumed.returncode == 0
    assert "10 units (0 computed now" in resumed.stdout
    assert output.read_bytes() == before
    assert not log.exists()
    replaced = stand_in(study, "-o", output, "--log", log, "--policy", "overwrite")
    assert replaced.returncode == 0
    assert len(log.read_text().splitlines()) == 10
    assert sorted(p.name for p in tmp_path.iterdir()) == ["log", "out.nc", "study.toml"]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_warning_signal_keeps_finished_units_and_resume_ends_in_the_same_bits(stand_in, study, tmp_path, number):
    output, log = tmp_path / "out.nc", tmp_path / "log"
    status, errors = interrupted(study, output, log, number)
    assert status == 75, errors
    assert f"stopped early ({signal.Signals(number).name})" in errors
    assert "--resume" in errors
    assert not output.exists()
    refused = stand_in(study, "-o", output)
    assert refused.returncode == 2
    assert "finished units" in refused.stderr
    resumed = stand_in(study, "-o", output, "--policy", "resume", "--log", log)
    assert resumed.returncode == 0, resumed.stderr
    assert "3 of 10 units are finished already" in resumed.stderr
    assert len(log.read_text().splitlines()) == 10  # no unit was computed twice
    stand_in(study, "-o", tmp_path / "whole.nc")
    assert differing_variables(open_dataset(output), open_dataset(tmp_path / "whole.nc")) == []
    assert not output.with_name("out.nc.shards").exists()


def test_another_study_is_not_mixed_in(stand_in, study, tmp_path):
    output = tmp_path / "out.nc"
    interrupted(study, output, tmp_path / "log", signal.SIGTERM)
    study.write_text(STUDY.replace("0.02", "0.03"))
    for _ in range(2):  # first the shards, then the finished file
        refused = stand_in(study, "-o", output, "--policy", "resume")
        assert refused.returncode == 2
        lines = refused.stderr.splitlines()
        assert len(lines) == 1
        assert "another study (packing.radii is 'uniform:0.01:0.02' there and 'uniform:0.01:0.03' here)" in lines[0]
        study.write_text(STUDY)
        assert stand_in(study, "-o", output, "--policy", "resume").returncode == 0
        study.write_text(STUDY.replace("0.02", "0.03"))


def test_a_second_process_on_the_same_output_is_refused(stand_in, study, tmp_path):
    output, log = tmp_path / "out.nc", tmp_path / "log"
    running = subprocess.Popen(command(study, "-o", output, "--seconds", 0.3, "--log", log))
    try:
        wait_for_lines(log, 1)
        for policy in ("fresh", "resume", "overwrite"):
            second = stand_in(study, "-o", output, "--policy", policy)
            assert second.returncode == 2
            assert f"process {running.pid} on" in second.stderr
            assert len(second.stderr.splitlines()) == 1
    finally:
        assert running.wait(timeout=60) == 0
    assert len(log.read_text().splitlines()) == 10


def test_a_full_disk_stops_resumably(stand_in, study, tmp_path):
    """A limit on the size of files stands in for the end of the disk."""
    output, log = tmp_path / "out.nc", tmp_path / "log"
    stopped = process(study, "-o", output, "--log", log, "--file-limit", 3000)
    assert stopped.returncode == 75
    assert "cannot write shard" in stopped.stderr
    assert "continue with --resume" in stopped.stderr
    resumed = process(study, "-o", output, "--policy", "resume", "--log", log, "--file-limit", 20000)
    assert resumed.returncode == 75  # the shards fit, the dataset does not
    assert f"cannot write {output}" in resumed.stderr
    assert not output.exists()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["log", "out.nc.shards", "study.toml"]
    assert stand_in(study, "-o", output, "--policy", "resume", "--log", log).returncode == 0
    stand_in(study, "-o", tmp_path / "whole.nc")
    assert differing_variables(open_dataset(output), open_dataset(tmp_path / "whole.nc")) == []
    assert len(log.read_text().splitlines()) == 11  # one unit had no room and was computed twice


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["missing.toml", "-o", "out.nc"], "missing.toml: cannot be read"),
        (["study.toml", "-o", "none/out.nc"], "no folder"),
        (["study.toml", "-o", "."], "is a folder"),
        (["study.toml", "-o", "/proc/out.nc"], "cannot write in /proc"),
        (["study.toml"], "Missing option '-o'"),
        (["study.toml", "-o", "out.nc", "--resume", "--overwrite"], "exclude each other"),
    ],
)
def test_refusals_are_one_line_and_leave_nothing(etc_engine, study, tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    done = etc_engine("sweep", *arguments)
    assert done.returncode == 2
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1, done.stderr
    assert words in done.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["study.toml"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_may_not_be_written_is_refused(stand_in, study, tmp_path):
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o500)
    done = stand_in(study, "-o", closed / "out.nc")
    assert done.returncode == 2
    assert "cannot write in" in done.stderr


def test_a_density_the_packer_does_not_reach_is_a_record(etc_engine, study, tmp_path):
    study.write_text(STUDY.replace("[0.65, 0.7]", "[0.5, 0.9]").replace("0.01:0.02", "0.03:0.06").replace("= 5", "= 2"))
    done = etc_engine("sweep", study, "-o", tmp_path / "out.nc")
    assert done.returncode == 4
    assert "4 packing_failed" in done.stdout
    data = open_dataset(tmp_path / "out.nc").sel(density=0.9)
    assert (data["status"] == 2).all()
    assert data["conductivity_mean"].isnull().all()
    assert (data["count"] == 0).all()
    assert all("density 0.9 is above the packing's own" in text for text in data["message"].values.ravel())


def test_units_of_another_version_are_told_on_resume(stand_in, study, tmp_path):
    output = tmp_path / "out.nc"
    interrupted(study, output, tmp_path / "log", signal.SIGTERM)
    (run,) = output.with_name("out.nc.shards").glob("*.run")
    run.write_bytes(frame((unframe(run.read_bytes()) or "").replace('"engine": "', '"engine": "0.0.1 then ')))
    resumed = stand_in(study, "-o", output, "--policy", "resume")
    assert resumed.returncode == 0
    assert "finished units come from etc_engine 0.0.1 then" in resumed.stderr
    assert len(json.loads(open_dataset(output).attrs["runs"])) == 2


def test_a_dry_run_says_of_a_damaged_record_what_the_run_says(etc_engine, stand_in, study, tmp_path):
    output = tmp_path / "out.nc"
    interrupted(study, output, tmp_path / "log", signal.SIGTERM)
    (run,) = output.with_name("out.nc.shards").glob("*.run")
    run.write_bytes(run.read_bytes()[:-40])
    dry = etc_engine("sweep", study, "-o", output, "--dry-run")
    assert (dry.returncode, run.exists()) == (0, True)
    assert "found     shards whose --resume is refused:" in dry.stdout
    refused = etc_engine("sweep", study, "-o", output, "--resume")
    assert refused.returncode == 2
    assert refused.stderr.strip().removeprefix("etc-engine: ") in dry.stdout
