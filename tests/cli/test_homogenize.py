from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

from etc_engine.box import Box
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.formats import write_particles
from etc_engine.particle_files.table import ParticleTable

RADIUS_3D = float(np.cbrt(0.75 * 0.3 / np.pi))


@pytest.fixture
def table(tmp_path):
    def write(*rows: str, header: str = "x,y,z,radius"):
        path = tmp_path / "inclusions.csv"
        path.write_text("\n".join([header, *rows]) + "\n")
        return path

    return write


@pytest.fixture
def sphere(table):
    return table(f"0.1,0.6,0.9,{RADIUS_3D!r}")


def refused(done) -> str:
    """The one line of a refusal."""
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    lines = done.stderr.splitlines()
    assert len(lines) == 1
    assert "Traceback" not in lines[0]
    return lines[0]


def test_a_simple_cubic_array_as_json(sphere):
    """The exact value, 1.7967699, from a sphere that reaches over three sides of its cell."""
    line = [sys.executable, "-m", "etc_engine", "homogenize", sphere, "--box", "1,1,1", "--matrix", "1"]
    done = subprocess.run(
        [*line, "--inclusion", "7.7", "--resolution", "48", "--json"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    record = json.loads(done.stdout)
    tensor = np.array(record["conductivity_tensor"])
    assert tensor == pytest.approx(1.7967699 * np.eye(3), abs=6e-4)
    assert np.abs(tensor[0, 0] / 1.7967699 - 1.0) < record["relative_error_estimate"] < 0.01
    assert record["volume_fraction"] == pytest.approx(0.3, abs=1e-12)
    assert record["conductivity_bounds"][0] < tensor[0, 0] < record["conductivity_bounds"][1]
    assert {"iterations", "seconds", "unknowns"} <= set(record)
    assert (record["engine"], record["dimension"], record["inclusions"]) == ("voxel", 3, 1)


def test_disks_with_a_column_of_conductivities(etc_engine, table):
    path = table("0.3,0.3,0.2,5", "0.7,0.7,0.15,0.2", header="x,y,radius,conductivity")
    common = ("homogenize", path, "--box", "1,1", "--matrix", "1")
    own = json.loads(etc_engine(*common, "--json").stdout)
    both = etc_engine(*common, "--inclusion", "77", "--json")
    given = json.loads(both.stdout)
    assert both.stderr.splitlines() == [
        f"etc-engine: note: --inclusion is not used: {path} has a column 'conductivity'"
    ]
    assert own["conductivity_tensor"] == given["conductivity_tensor"]
    assert "conductivity_bounds" not in own
    (kxx, kxy), (kyx, _) = own["conductivity_tensor"]
    assert kxy == kyx != 0.0
    assert kxx > 1.0


def test_walls_leave_only_the_diagonal(etc_engine, table, tmp_path):
    path = table("0.5,0.5,0.3", header="x,y,radius")
    options = ("--matrix", "1", "--inclusion", "9", "--resolution", "32", "--json")
    walled = json.loads(etc_engine("homogenize", path, "--box", "1,1", "--boundary", "walls", *options).stdout)
    free = json.loads(etc_engine("homogenize", path, "--box", "1,1", *options).stdout)
    assert "conductivity_tensor" not in walled  # components off the diagonal do not exist between walls
    assert walled["conductivity_per_axis"]["x"] == pytest.approx(free["conductivity_tensor"][0][0], rel=1e-7)
    assert free["conductivity_per_axis"] == {axis: free["conductivity_tensor"][i][i] for i, axis in enumerate("xy")}
    text = etc_engine("homogenize", path, "--box", "1,1", "--boundary", "walls", *options[:-1], "-o", tmp_path / "o.nc")
    assert "nan" not in text.stdout
    assert f"conductivity per axis   x {walled['conductivity_per_axis']['x']:.8g}, y " in text.stdout
    for words in ((), ("--json",)):
        told = etc_engine("info", tmp_path / "o.nc", *words)
        assert told.returncode == 0
        assert "nan" not in told.stdout.lower()


def test_what_walls_cut_and_particles_share_is_printed(etc_engine, table):
    """Half of one disk, and the lens of two others, in closed form."""
    path = table("0,0.25,0.2", "0.4,0.7,0.2", "0.6,0.7,0.2", header="x,y,radius")
    common = ("homogenize", path, "--box", "1,1", "--matrix", 1, "--inclusion", 3, "--resolution", 32)
    done = etc_engine(*common, "--boundary", "walls", "--json")
    record = json.loads(done.stdout)
    lens = 2.0 * 0.04 * np.arccos(0.5) - 0.1 * np.sqrt(4 * 0.04 - 0.04)
    assert record["full_volume_fraction"] == pytest.approx(0.12 * np.pi, rel=1e-12)
    assert record["cut_volume_fraction"] == pytest.approx(0.02 * np.pi, rel=1e-12)
    assert record["overlap_volume_fraction"] == pytest.approx(lens, rel=1e-9)
    assert record["volume_fraction"] == pytest.approx(0.10 * np.pi - lens, rel=1e-9)
    assert record["cut_inclusions"] == 1
    assert (
        "warning: walls cut 1 inclusion: it loses 0.06283 of the box, so that the full fraction of 0.377 becomes 0.3142"
        in done.stderr
    )
    text = etc_engine(*common).stdout
    assert "overlap volume fraction" in text
    assert "cut volume fraction     0\n" in text


def test_a_packing_brings_its_own_box(etc_engine, tmp_path):
    pair = [[0.0, 0.0, 0.3], [0.0, 0.0, 1.3]]
    packing = ParticlePacking(pair, [RADIUS_3D] * 2, Box((1.0, 1.0, 2.0), (True,) * 3))
    for name in ("p.nc", "p.dump"):
        path = tmp_path / name
        write_particles(path, ParticleTable(packing))
        done = etc_engine("homogenize", path, "--matrix", 1, "--inclusion", 7.7, "--resolution", 24, "--json")
        record = json.loads(done.stdout)
        assert record["boundary"] == "periodic"
        assert record["conductivity_tensor"][2][2] == pytest.approx(1.7967699, rel=2e-3)
    words = ("--box", "1,1,1", "--periodic", "", "--matrix", 1, "--inclusion", 2)
    assert "outside the box" in refused(etc_engine("homogenize", path, *words))


def test_both_engines_agree(etc_engine, sphere):
    common = ("homogenize", sphere, "--box", "1,1,1", "--matrix", 1, "--inclusion", 7.7, "--json")
    found = [
        json.loads(etc_engine(*common, *options).stdout)
        for options in (("--resolution", 32), ("--engine", "lattice", "--particles", 1500, "--seed", 5))
    ]
    voxel, lattice = (record["conductivity_tensor"][0][0] for record in found)
    assert lattice == pytest.approx(voxel, rel=5e-3)
    assert found[1]["engine"] == "lattice"


def test_overlapping_inclusions_are_counted_once_with_a_warning(etc_engine, table):
    path = table("0.4,0.5,0.2", "0.6,0.5,0.2", header="x,y,radius")
    done = etc_engine("homogenize", path, "--box", "1,1", "--matrix", 1, "--inclusion", 3, "--json")
    record = json.loads(done.stdout)
    lens = 2.0 * 0.04 * np.arccos(0.5) - 0.1 * np.sqrt(4 * 0.04 - 0.04)
    assert record["volume_fraction"] == pytest.approx(2 * np.pi * 0.04 - lens, abs=1e-12)
    assert record["overlaps"] == 1
    assert "1 pair of inclusions overlaps: its union counts once\n" in done.stderr
    path = table("0.4,0.5,0.2,3", "0.6,0.5,0.2,4", header="x,y,radius,conductivity")
    done = etc_engine("homogenize", path, "--box", "1,1", "--matrix", 1)
    assert "divided by the radical plane where their conductivities differ" in done.stderr


def test_insulators_and_perfect_conductors_are_solved_by_cg_and_refused_by_eyre_milton(etc_engine, table):
    path = table(f"0.2,0.3,{float(np.sqrt(0.3 / np.pi))!r}", header="x,y,radius")
    common = ("homogenize", path, "--box", "1,1", "--matrix", 1, "--inclusion")
    hole, metal = (
        json.loads(etc_engine(*common, word, "--json").stdout)["conductivity_tensor"][0][0] for word in ("0", "inf")
    )
    assert metal == pytest.approx(1.86018831, rel=2e-3)
    assert hole == pytest.approx(1.0 / 1.86018831, rel=2e-3)
    for word in ("0", "inf"):
        line = refused(etc_engine(*common, word, "--solver", "eyre-milton"))
        assert "does not converge" in line
        assert "use conjugate gradients (cg)" in line


def test_outputs(etc_engine, sphere, tmp_path):
    out, picture = tmp_path / "out.nc", tmp_path / "section.png"
    done = etc_engine(
        *("homogenize", sphere, "--box", "1,1,1", "--matrix", 0.2, "--inclusion", 1.5, "--resolution", 16),
        *("-o", out, "--plot", picture),
    )
    assert done.returncode == 0, done.stderr
    assert "W/(m K)" in done.stdout
    with xr.open_dataset(out) as data:
        k = float(data["effective_conductivity"].sel(direction_i="x", direction_j="x"))
        assert f"{k:.8g}" in done.stdout
        assert float(data["radius"][0]) == RADIUS_3D
        assert data.attrs["matrix_conductivity"] == 0.2
        assert data["effective_conductivity"].attrs["units"] == "W m-1 K-1"
    assert picture.read_bytes()[:4] == b"\x89PNG"


BAD = [
    (("--inclusion", 7.7, "--resolution", 3), "too coarse: the smallest inclusion"),
    ((), "conductivity of the inclusions is missing"),
    (("--inclusion", -1), "is -1: give a number"),
    (("--inclusion", 0, "--matrix", 0), "neither the particles nor the pores conduct"),
    (("--inclusion", 2, "--engine", "fem"), "unknown engine 'fem'"),
    (("--inclusion", 2, "--particles", 100), "--particles is not valid with --engine voxel"),
    (("--inclusion", 2, "--engine", "lattice", "--resolution", 32), "--resolution is not valid with --engine lattice"),
    (("--inclusion", 2, "--box", "1,1"), "a 2D box needs"),
    (("--inclusion", 2, "--box", "1,-1,1"), "positive"),
    (("--inclusion", 2, "--frame", 0), "holds one packing: leave the frame out"),
    (("--inclusion", 2, "--plot", "p.bmp"), "a picture is written as"),
    (("--inclusion", 2, "--resolution", 0), "resolution: found 0, allowed: a whole number of at least 2"),
    (("--inclusion", 2, "--resolution", 1000000), "needs about 1.68e+11 GB of memory"),
    (("--inclusion", 1e90, "--matrix", 1e-90), "within a factor of 1e+15"),
    (("--inclusion", 1e20), "give 0 or inf"),
    (
        ("--inclusion", 2, "--engine", "lattice", "--particles", 0),
        "particles: found 0, allowed: a whole number",
    ),
    (("--inclusion", "inf", "--plot", "p.png"), "--plot needs finite conductivities"),
    (("--inclusion", 2, "-o", "/nowhere/out.nc"), "cannot write"),
]


@pytest.mark.parametrize(("options", "words"), BAD)
def test_bad_options_are_refused(etc_engine, sphere, options, words):
    line = refused(etc_engine("homogenize", sphere, "--box", "1,1,1", "--matrix", 1, *options))
    assert words in line


def test_bad_geometries_are_refused(etc_engine, table, tmp_path):
    def line(*rows, header="x,y,radius", options=()):
        return refused(
            etc_engine(
                *("homogenize", table(*rows, header=header), "--box", "1,1"),
                *("--matrix", 1, "--inclusion", 2),
                *options,
            )
        )

    assert "holds no particles" in line()
    assert "leave no pores" in line("0.5,0.5,0.9")
    assert "outside the box" in line("1.4,0.5,0.1", options=("--boundary", "walls"))
    assert "radius that is not positive" in line("0.4,0.5,0")
    assert "engine lattice works in 3D, found a medium in 2D" in line("0.4,0.5,0.2", options=("--engine", "lattice"))
    assert "there is no file" in refused(etc_engine("homogenize", tmp_path / "none.csv", "--matrix", 1))
    path = table("0.4,0.5,0.2", header="x,y,radius")
    assert "--box is missing" in refused(etc_engine("homogenize", path, "--matrix", 1, "--inclusion", 2))


def test_perfect_conductors_that_join_across_the_cell_are_refused(etc_engine, table):
    path = table("0.25,0.5,0.26", "0.75,0.5,0.26", header="x,y,radius")
    done = etc_engine("homogenize", path, "--box", "1,1", "--matrix", 1, "--inclusion", "inf")
    assert done.returncode == 2
    assert "join across the cell along x" in done.stderr.splitlines()[-1]


def test_centres_outside_the_box_are_wrapped_with_a_note(etc_engine, table):
    path = table("1.4,0.5,0.2", "0.8,-0.1,0.1", header="x,y,radius")
    done = etc_engine("homogenize", path, "--box", "1,1", "--matrix", 1, "--inclusion", 3)
    assert done.stderr.splitlines() == ["etc-engine: note: 2 centres lay outside the box and were wrapped into it"]
    bounds = next(line for line in done.stdout.splitlines() if line.startswith("conductivity bounds"))
    assert "(series) to" in bounds
    assert bounds.endswith("(parallel) W/(m K)")
