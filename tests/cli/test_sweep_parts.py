"""Parts of a sweep, joined by a run of the whole, and the end of starts that finish nothing."""

from __future__ import annotations

import importlib.util
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from etc_engine.study.sweep import parse_study
from etc_engine.sweep.dataset import differing_variables
from etc_engine.sweep.parts import Part
from etc_engine.sweep.plan import units_to_run
from etc_engine.sweep.result_file import open_dataset
from etc_engine.sweep.shards import frame, unframe

STAND_IN = Path(__file__).parent.parent / "stand_in.py"
STUDY = """
schema = 2
name = "parts"
seed = 20261
[packing]
radii = "uniform:0.01:0.02"
box = [1.0, 1.0]
density = [0.65, 0.75, 0.7]
[contacts]
rule = "bonded"
contact_angle = [2.5, 5.0]
[statistics]
realizations = 5
"""
ADAPTIVE = STUDY.replace("= 5\n", "= 4\nrelative_ci = 0.02\nmax_realizations = 40\n")


@pytest.fixture
def stand_in(capsys):
    """The stand-in's command line inside this process: status, stdout and stderr."""
    spec = importlib.util.spec_from_file_location("stand_in", STAND_IN)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)

    def call(*arguments: object) -> tuple[int, str, str]:
        capsys.readouterr()
        status = module.main([str(argument) for argument in arguments])
        return status, *capsys.readouterr()

    return call


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(STUDY)
    return path


@pytest.mark.parametrize("text", [STUDY, ADAPTIVE], ids=["fixed", "adaptive"])
@pytest.mark.parametrize("count", [1, 2, 3, 20])
def test_parts_are_disjoint_and_together_the_whole(text, count):
    whole = parse_study(text)
    units = units_to_run(whole.densities, (7, 7, 7) if "relative_ci" in text else (5, 5, 5), np.empty((0, 2), int))
    parts = [Part(k + 1, count).select(whole, units) for k in range(count)]
    assert sorted(map(tuple, np.concatenate(parts))) == sorted(map(tuple, units))
    if text == STUDY:
        assert max(map(len, parts)) - min(map(len, parts)) <= 1


@pytest.mark.parametrize("text", [STUDY, ADAPTIVE], ids=["fixed", "adaptive"])
def test_joined_parts_have_the_bits_of_one_run(stand_in, study, tmp_path, text):
    study.write_text(text)
    output, log = tmp_path / "out.nc", tmp_path / "log"
    stand_in(study, "-o", tmp_path / "whole.nc")
    for k in (2, 4, 1, 3):
        status, printed, errors = stand_in(study, "-o", output, "--policy", "resume", "--part", f"{k}/4", "--log", log)
        assert status == 0, errors
        assert f"units of part {k} of 4 are finished" in printed
    assert not output.exists()
    units = len(log.read_text().splitlines())
    assert stand_in(study, "-o", output)[0] == 2  # finished units are not started anew by accident
    status, printed, errors = stand_in(study, "-o", output, "--policy", "resume", "--log", log)
    assert status == 0, errors
    assert f"{units} units (0 computed now" in printed
    assert len(log.read_text().splitlines()) == units
    assert differing_variables(open_dataset(output), open_dataset(tmp_path / "whole.nc")) == []
    assert sorted(path.name for path in tmp_path.iterdir()) == ["log", "out.nc", "study.toml", "whole.nc"]
    again = stand_in(study, "-o", output, "--policy", "resume", "--part", "2/4", "--log", log)
    assert again[0] == 0
    assert len(log.read_text().splitlines()) == units  # the whole is there: a part has nothing to do


def test_the_whole_computes_the_parts_that_are_missing(stand_in, study, tmp_path):
    output = tmp_path / "out.nc"
    stand_in(study, "-o", tmp_path / "whole.nc")
    stand_in(study, "-o", output, "--part", "2/3")
    status, printed, errors = stand_in(study, "-o", output, "--policy", "resume")
    assert status == 0, errors
    assert "15 units (10 computed now" in printed
    assert "5 of 15 units are finished already" in errors
    assert differing_variables(open_dataset(output), open_dataset(tmp_path / "whole.nc")) == []


def test_a_part_that_runs_is_not_taken_up(stand_in, study, tmp_path):
    output, log = tmp_path / "out.nc", tmp_path / "log"
    command = [sys.executable, str(STAND_IN), study, "-o", output, "--part", "1/2", "--seconds", "0.5", "--log", log]
    running = subprocess.Popen([str(word) for word in command], stderr=subprocess.DEVNULL)
    try:
        while not log.exists():
            assert running.poll() is None
        status, _, errors = stand_in(study, "-o", output, "--policy", "resume")
        assert status == 2
        assert f"process {running.pid} on" in errors
    finally:
        running.send_signal(signal.SIGTERM)
        assert running.wait(timeout=60) == 75
    assert stand_in(study, "-o", output, "--policy", "resume")[0] == 0


def test_parts_of_another_study_are_refused_and_dropped_by_overwrite(stand_in, study, tmp_path):
    output = tmp_path / "out.nc"
    stand_in(study, "-o", output, "--part", "2/3")
    study.write_text(STUDY.replace("20261", "20262"))
    status, _, errors = stand_in(study, "-o", output, "--policy", "resume")
    assert (status, "another study (seed is 20261 there and 20262 here)" in errors) == (2, True), errors
    status, printed, errors = stand_in(study, "-o", output, "--policy", "overwrite")
    assert (status, "15 units (15 computed now" in printed) == (0, True), errors
    assert not list(tmp_path.glob("*.shards"))
    status, _, errors = stand_in(study, "-o", output, "--policy", "overwrite", "--part", "1/2")
    assert (status, "a part does not replace it" in errors) == (2, True), errors


@pytest.mark.parametrize("part", ["0/3", "4/3", "3", "a/b", "-1/2", "1/0"])
def test_a_part_is_k_of_n(etc_engine, study, tmp_path, part):
    done = etc_engine("sweep", study, "-o", tmp_path / "out.nc", "--part", part)
    assert done.returncode == 2
    assert "expected K/N" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["study.toml"]


def test_a_batch_job_that_finishes_nothing_ends(stand_in, study, tmp_path, monkeypatch):
    """On a full disk every start ends with status 75, on which the script queues the job again."""
    monkeypatch.setenv("SLURM_JOB_ID", "17")
    study.write_text(STUDY.replace("[2.5, 5.0]", f"{[2.5 + 0.25 * i for i in range(20)]}"))
    output = tmp_path / "out.nc"
    words = [sys.executable, str(STAND_IN), study, "-o", output, "--policy", "resume", "--file-limit", "2500"]
    full = [str(word) for word in words]  # a record takes more than that
    done = subprocess.run(full, capture_output=True, text=True, check=False)
    assert (done.returncode, "cannot write shard" in done.stderr) == (75, True), done.stderr
    (run,) = output.with_name("out.nc.shards").glob("*.run")
    for restart in range(1, 5):
        name = f"{run.stem}{restart}"
        record = (unframe(run.read_bytes()) or "").replace(run.stem, name)
        run.with_name(f"{name}.run").write_bytes(frame(record))
    status, _, errors = stand_in(study, "-o", output, "--policy", "resume")
    assert status == 2  # which no script takes for a reason to start again
    assert "the last 5 starts of this job (slurm 17) finished no unit" in errors
    monkeypatch.setenv("SLURM_JOB_ID", "18")  # handed in again
    assert subprocess.run(full, capture_output=True, check=False).returncode == 75
    assert stand_in(study, "-o", output, "--policy", "resume")[0] == 0
