"""``info`` on every file that the engine writes, and on those of others that it reads."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

TABLE_2 = Path(__file__).parents[1] / "published" / "data" / "feng2008_table2_particles.csv"
BED = Path(__file__).parents[1] / "data" / "gravity_bed.dump"
PACK = ("pack", "--radii", "uniform:0.05:0.1", "--box", "1,1", "--seed", 93)
TRANSIENT = f"""
schema = 2
kind = "network"
name = "warming"
[packing]
files = "{TABLE_2}"
box = [1.0, 1.0]
[particles]
heat_capacity = 1.0
initial = 0.0
[walls]
left = {{ type = "fixed", value = 1.0 }}
[time]
scheme = "bdf2"
times = [0.0, 0.1]
steps = 2
"""


def info(etc_engine, path: Path) -> dict:
    text = etc_engine("info", path)
    assert (text.returncode, text.stderr) == (0, "")
    assert text.stdout.startswith("kind ")
    return json.loads(etc_engine("info", path, "--json").stdout)


@pytest.mark.parametrize("ending", ["csv", "dump", "nc", "vtp"])
def test_packings(etc_engine, tmp_path, ending):
    if ending == "vtp":
        pytest.importorskip("vtkmodules", reason="the extra vtk is not installed")
    path = tmp_path / f"a.{ending}"
    assert etc_engine(*PACK, "-o", path).returncode == 0
    found = info(etc_engine, path)
    if ending == "nc":
        assert (found["kind"], found["seed"]) == ("packing", "93")
    else:
        assert found["kind"].startswith("particles (")
        assert 0.05 <= found["radii"][0] < found["radii"][1] <= 0.1
        assert found["particles"] > 20


def test_a_dump_of_several_frames(etc_engine):
    found = info(etc_engine, BED)
    assert (found["frames"], found["particles"], found["periodic"]) == (2, 300, "xz")
    assert found["significant_digits"] == 17
    assert found["columns"] == ["ids", "types"]
    assert found["types"] == ["1", "2"]


def test_single_solve_and_homogenization(etc_engine, tmp_path):
    assert etc_engine("solve", TABLE_2, "--box", "1,1", "-o", tmp_path / "s.nc").returncode == 0
    found = info(etc_engine, tmp_path / "s.nc")
    assert found["kind"] == "single solve"
    assert found["conductivity"] == pytest.approx(0.2787540, rel=1e-6)
    assert "temperature" in found["variables"]
    (tmp_path / "d.csv").write_text("x,y,radius\n0.5,0.5,0.3\n")
    words = ("--box", "1,1", "--matrix", 1, "--inclusion", 2, "--resolution", 16, "-o", tmp_path / "h.nc")
    assert etc_engine("homogenize", tmp_path / "d.csv", *words).returncode == 0
    assert info(etc_engine, tmp_path / "h.nc")["kind"] == "homogenization"
    refused = etc_engine("info", tmp_path / "h.nc", "--study")
    assert (refused.returncode, "without a study file" in refused.stderr) == (2, True)


def test_a_transient(etc_engine, tmp_path):
    (tmp_path / "t.toml").write_text(TRANSIENT)
    done = etc_engine("transient", tmp_path / "t.toml", "-o", tmp_path / "t.nc")
    assert done.returncode == 0, done.stderr
    found = info(etc_engine, tmp_path / "t.nc")
    assert found["kind"] == "transient of a network"
    assert found["times"] == [0.0, 0.1]
    assert found["study"]["name"] == "warming"
    assert etc_engine("info", tmp_path / "t.nc", "--study").stdout == TRANSIENT


def test_what_is_of_no_kind_is_refused(etc_engine, tmp_path):
    (tmp_path / "a.txt").write_text("hello\n")
    done = etc_engine("info", tmp_path / "a.txt")
    assert (done.returncode, "not in a known format" in done.stderr) == (2, True)
    assert "no file of that name" in etc_engine("info", tmp_path / "none").stderr


def test_a_picture_is_named_binary_without_its_bytes(etc_engine, tmp_path):
    (tmp_path / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(range(256)))
    done = etc_engine("info", tmp_path / "a.png")
    assert done.returncode == 2
    assert "not in a known format: it is binary" in done.stderr
    assert done.stderr.rstrip("\n").isprintable()
    assert "x89" not in done.stderr


def test_particles_that_cannot_be_used_are_counted(etc_engine, tmp_path):
    path = tmp_path / "disks.csv"
    path.write_text("x,y,radius\n0.1,0.2,0.1\n0.25,0.5,nan\n0.75,0.5,-1\n0.3,inf,0.1\n0.9,0.8,0.3\n")
    found = json.loads(etc_engine("info", path, "--json").stdout)
    assert found["particles"] == 5
    assert found["unusable"].startswith("3 of 5, first particle 1: ")
    assert found["radii"] == [0.1, 0.3]
    assert found["centres"] == {"x": [0.1, 0.9], "y": [0.2, 0.8]}
    path.write_text("x,y,radius\n0.25,0.5,nan\n")
    done = etc_engine("info", path)
    assert done.returncode == 2
    assert "no particle has a finite centre and a finite, positive radius" in done.stderr
