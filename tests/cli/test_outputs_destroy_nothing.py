"""Outputs destroy nothing: links, devices, modes, results and inputs."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray

TABLE_2 = Path(__file__).parents[1] / "published" / "data" / "feng2008_table2_particles.csv"
STUDIES = Path(__file__).parents[2] / "studies"
PACK = ("pack", "--radii", "uniform:0.05:0.1", "--box", "1,1", "--seed", 91)
SOLVE = ("solve", TABLE_2, "--box", "1,1")


@pytest.fixture
def sweep_result(tmp_path) -> Path:
    """A file with the marks of a finished sweep."""
    path = tmp_path / "out.nc"
    xarray.Dataset({"a": ("b", np.arange(3.0))}, attrs={"study_digest": "f00"}).to_netcdf(path, engine="netcdf4")
    return path


@pytest.mark.parametrize("command", [PACK, SOLVE])
def test_the_result_of_a_sweep_is_kept(etc_engine, sweep_result, command):
    before = sweep_result.read_bytes()
    done = etc_engine(*command, "-o", sweep_result)
    assert done.returncode == 2
    assert "is the result of a sweep or a transient: it would be lost" in done.stderr
    assert sweep_result.read_bytes() == before


@pytest.mark.parametrize("command", [PACK, SOLVE])
def test_a_link_is_written_through_and_the_mode_stays(etc_engine, tmp_path, command):
    place, link = tmp_path / "place.nc", tmp_path / "link.nc"
    place.write_bytes(b"")
    place.chmod(0o640)
    link.symlink_to(place)
    assert etc_engine(*command, "-o", link).returncode == 0
    assert link.is_symlink()
    assert place.read_bytes()[:4] == b"\x89HDF"
    assert stat.S_IMODE(place.stat().st_mode) == 0o640
    assert {path.name for path in tmp_path.iterdir()} == {"place.nc", "link.nc"}


@pytest.mark.parametrize("command", [PACK, SOLVE])
def test_devices_and_pipes_are_refused_and_stay(etc_engine, tmp_path, command):
    pipe = tmp_path / "pipe.nc"
    os.mkfifo(pipe)
    done = etc_engine(*command, "-o", pipe)
    assert (done.returncode, "it is a device or a pipe" in done.stderr) == (2, True)
    assert stat.S_ISFIFO(pipe.stat().st_mode)


@pytest.mark.parametrize(
    "command",
    [
        SOLVE,
        ("homogenize", TABLE_2, "--box", "1,1", "--matrix", 1, "--inclusion", 2),
        ("sweep", STUDIES / "density_angle/study.toml"),
        ("transient", STUDIES / "feng2009/transient.toml"),
    ],
)
def test_netcdf_under_the_name_of_another_format_is_refused(etc_engine, tmp_path, command):
    done = etc_engine(*command, "-o", tmp_path / "out.csv")
    assert (done.returncode, done.stderr) == (
        2,
        "etc-engine: the output is written as netCDF: name it out.nc, found 'out.csv'\n",
    )
    assert list(tmp_path.iterdir()) == []


def test_a_name_with_wildcards_leaves_the_files_of_others(etc_engine, tmp_path):
    other = tmp_path / ".z1.nc.1234.tmp"
    other.write_text("of another output")
    for command in (PACK, SOLVE):
        assert etc_engine(*command, "-o", tmp_path / "z?.nc").returncode == 0
    assert other.read_text() == "of another output"


def test_a_packing_goes_to_stdout_and_comes_from_stdin(etc_engine, tmp_path):
    done = etc_engine(*PACK, "-o", "-")
    assert done.stdout.startswith("x,y,radius\n")
    assert "particles" in done.stderr
    assert etc_engine(*PACK, "-o", tmp_path / "a.csv").returncode == 0
    assert (tmp_path / "a.csv").read_text() == done.stdout
    refused = etc_engine(*PACK, "-o", "-", "--json")
    assert (refused.returncode, "give one of them" in refused.stderr) == (2, True)
    words = ["-m", "etc_engine", "solve", "/dev/stdin", "--box", "1,1", "--contact-angle", "5", "--json"]
    piped = subprocess.run([sys.executable, *words], input=done.stdout, capture_output=True, text=True, check=True)
    filed = etc_engine("solve", tmp_path / "a.csv", *words[4:])
    assert piped.stdout.split('"seconds"')[0] == filed.stdout.split('"seconds"')[0]


def test_a_killed_pack_leaves_nothing(tmp_path):
    """While it packs there is no file yet; what a kill in the moment of writing leaves is removed by the next run."""
    words = [
        "pack",
        "--method",
        "lubachevsky-stillinger",
        "--radii",
        "equal:0.02",
        "--box",
        "20,20",
        "--density",
        "0.85",
    ]
    with subprocess.Popen(
        [sys.executable, "-m", "etc_engine", *words, "--seed", "5", "-o", "bed.csv"],
        cwd=tmp_path,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as running:
        time.sleep(2.5)
        running.kill()
    assert list(tmp_path.iterdir()) == []
