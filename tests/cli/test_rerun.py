"""`info`, `rerun` and `sweep --dry-run` on a result of the real engine."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys

import pytest

STUDY = """schema = 2
name = "again"
seed = 20261
[packing]
radii = "uniform:0.02:0.04"
box = [1.0, 1.0]
density = [0.65, 0.72]
[contacts]
rule = "bonded"
contact_angle = [2.5, 10.0]
[statistics]
realizations = 2
"""


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("again")
    (folder / "study.toml").write_text(STUDY)
    command = [sys.executable, "-m", "etc_engine", "sweep", str(folder / "study.toml"), "-o", str(folder / "out.nc")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=200)
    assert done.returncode == 0, done.stderr
    assert "4 units" in done.stdout
    return folder / "out.nc"


def test_info_tells_where_a_result_comes_from(etc_engine, result):
    lines = etc_engine("info", result).stdout.splitlines()
    words = {line.split()[0] for line in lines}
    assert {"name", "seed", "source", "commit", "command", "hosts", "started", "ended", "run", "study"} <= words
    assert 'study         packing.radii = "uniform:0.02:0.04"' in lines
    assert any(line.startswith("command       etc-engine sweep ") for line in lines)
    found = json.loads(etc_engine("info", result, "--json").stdout)
    assert found["seed"] == 20261
    assert found["units"] == 4
    assert sum(found["cells"].values()) == 8
    assert found["versions"]["numpy"][0].isdigit()
    assert found["study"]["statistics"]["confidence"] == 0.95  # a default, written out


def test_info_gives_the_study_back(etc_engine, result):
    assert etc_engine("info", result, "--study").stdout == STUDY


def test_a_realization_run_again_has_the_same_bits(etc_engine, result):
    done = etc_engine("rerun", result, "--density", 0.72, "--realization", 1)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines()[-1] == "all bits agree"
    found = json.loads(etc_engine("rerun", result, "--density", 0.65, "--realization", 0, "--json").stdout)
    assert found["same"] is True
    assert found["variables"]["conductivity"] is True


def test_a_changed_number_is_found(etc_engine, result, tmp_path):
    import xarray

    with xarray.open_dataset(result) as stored:
        dataset = stored.load()
    dataset["conductivity"][0, 0, 0, 0, 0] *= 1.0 + 2.3e-16
    dataset.assign_attrs(checksum="").to_netcdf(tmp_path / "changed.nc")
    done = etc_engine("rerun", tmp_path / "changed.nc", "--density", 0.65, "--realization", 0)
    assert done.returncode == 1
    assert done.stdout.splitlines()[-1] == "the bits differ"
    assert sum("DIFFERENT" in line for line in done.stdout.splitlines()) == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--density", "0.7", "--realization", "0"], "density 0.7 is not in the file, it has 0.65, 0.72"),
        (["--realization", "0"], "no density was given, it has 0.65, 0.72"),
        (["--density", "0.72", "--realization", "2"], "realization 2 is not in the file, which has 0 to 1"),
        (["--density", "0.72"], "Missing option '--realization'"),
    ],
)
def test_cells_that_are_not_there_are_refused(etc_engine, result, arguments, words):
    done = etc_engine("rerun", result, *arguments)
    assert done.returncode == 2
    assert words in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("command", ["info", "rerun"])
def test_other_files_are_refused(etc_engine, tmp_path, command):
    import xarray

    (tmp_path / "text.nc").write_text("no netCDF")
    xarray.Dataset({"a": 1.0}).to_netcdf(tmp_path / "other.nc")
    options = ["--realization", "0"] if command == "rerun" else []
    for name, words in (("none.nc", "cannot read"), ("text.nc", "cannot read"), ("other.nc", "not the result")):
        done = etc_engine(command, tmp_path / name, *options)
        assert done.returncode == 2
        assert words in done.stderr
        assert len(done.stderr.splitlines()) == 1, done.stderr


def test_a_dry_run_tells_units_time_and_memory_and_writes_nothing(etc_engine, result, tmp_path):
    study = result.with_name("study.toml")
    fresh = etc_engine("sweep", study, "-o", tmp_path / "new.nc", "--dry-run")
    assert fresh.returncode == 0, fresh.stderr
    lines = dict(line.split(maxsplit=1) for line in fresh.stdout.splitlines())
    assert lines["units"] == "4 with 8 cells, 0 of them finished"
    assert lines["found"] == "no output and no shards: the sweep starts fresh"
    assert float(lines["unit"].split()[0]) > 0.0
    assert lines["time"].startswith("about ")
    assert 20.0 < float(lines["memory"].split()[0]) < 5000.0
    assert list(tmp_path.iterdir()) == []
    unnamed = etc_engine("sweep", study, "--dry-run")
    assert unnamed.returncode == 0
    assert "no output is named" in unnamed.stdout
    assert "Missing option '-o'" in etc_engine("sweep", study).stderr
    again = etc_engine("sweep", study, "-o", result, "--dry-run")
    assert "the output is complete: --resume does nothing" in again.stdout
    study_text = study.read_text()
    other = tmp_path / "other.toml"
    other.write_text(study_text.replace("20261", "5"))
    assert "the output of another study" in etc_engine("sweep", other, "-o", result, "--dry-run").stdout


def test_a_dry_run_fails_where_a_density_is_out_of_reach(etc_engine, result, tmp_path):
    study, far = result.with_name("study.toml"), tmp_path / "far.toml"
    far.write_text(re.sub(r"density = .*", "density = [0.7, 0.95]", study.read_text()))
    done = etc_engine("sweep", far, "-o", tmp_path / "new.nc", "--dry-run")
    assert done.returncode == 2
    assert done.stdout == ""
    assert "density 0.95 is out of reach" in done.stderr
    assert "own 0.77" in done.stderr  # what the packer reaches
    assert not list(tmp_path.glob("new.nc*"))


@pytest.mark.parametrize("policy", [(), ("--overwrite",), ("--resume",)])
def test_a_sweep_onto_a_device_or_a_pipe_is_refused_before_it_computes(etc_engine, result, tmp_path, policy):
    os.mkfifo(tmp_path / "pipe")
    for place in ("/dev/null", tmp_path / "pipe"):
        done = etc_engine("sweep", result.with_name("study.toml"), "-o", place, *policy)
        assert done.returncode == 2
        assert done.stderr.splitlines() == [
            f"etc-engine: output {place} is a device or a pipe: expected the name of a netCDF file to write; "
            "--dry-run writes none"
        ]
    assert [path.name for path in tmp_path.iterdir()] == ["pipe"]
