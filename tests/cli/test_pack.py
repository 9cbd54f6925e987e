from __future__ import annotations

import json
import shlex
import sys
import time
from functools import partial
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.particle_files.csv_files import read_csv
from etc_engine.particle_files.formats import read_table


@pytest.fixture
def pack(etc_engine):
    return partial(etc_engine, "pack")


LS, RSA = "lubachevsky-stillinger", "random-sequential"
LS_2D = ("--method", LS, "--radii", "equal", "--box", "1,1", "--periodic", "xy")
LS_3D = ("--method", LS, "--radii", "equal", "--box", "1,1,1", "--periodic", "xyz")
SMALL = ("--radii", "uniform:0.02:0.04", "--box", "1,1")


def test_a_packing_is_written_and_described(pack, tmp_path):
    path = tmp_path / "disks.csv"
    done = pack(*SMALL, "--seed", 77, "-o", path, "--json")
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    packing = read_csv(path, Box((1.0, 1.0))).packing
    assert record["particles"] == packing.count
    assert record["density"] == pytest.approx(packing.density, rel=1e-12)
    assert record["coordination"] == pytest.approx(2 * record["contacts"] / packing.count)
    assert record["seed"] == 77
    assert record["seconds"] > 0


def test_the_same_seed_gives_the_same_file(pack, tmp_path):
    files = [tmp_path / "a.csv", tmp_path / "b.csv", tmp_path / "c.csv"]
    for file, seed in zip(files, (78, 78, 79), strict=True):
        assert pack(*SMALL, "--seed", seed, "-o", file).returncode == 0
    assert files[0].read_bytes() == files[1].read_bytes() != files[2].read_bytes()


def test_a_seed_is_drawn_and_told_when_none_is_given(pack, tmp_path):
    first = json.loads(pack(*SMALL, "-o", tmp_path / "a.csv", "--json").stdout)
    again = json.loads(pack(*SMALL, "-o", tmp_path / "b.csv", "--seed", first["seed"], "--json").stdout)
    assert again["density"] == first["density"]


def test_the_file_reads_back_to_the_last_bit(pack, tmp_path):
    from etc_engine.packing import PackingSpec, parse_radii
    from etc_engine.packing import pack as pack_disks

    path = tmp_path / "a.csv"
    pack(*SMALL, "--seed", 80, "-o", path)
    spec = PackingSpec("advancing-front", parse_radii("uniform:0.02:0.04"), Box((1.0, 1.0)))
    packing = pack_disks(spec, np.random.default_rng(80))
    np.testing.assert_array_equal(read_csv(path, packing.box).packing.centers, packing.centers)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--radii", "uniform:0.1", "--box", "1,1"), "uniform"),
        (("--radii", "cubic:1", "--box", "1,1"), "cubic"),
        (("--radii", "uniform:-1:2", "--box", "1,1"), "radi"),
        (("--radii", "equal:2", "--box", "1,1"), "box"),
        ((*SMALL, "--method", "shaking"), "unknown packing method"),
        ((*SMALL, "--density", 0), "density"),
        ((*SMALL, "--seed", -3), "--seed"),
        ((*SMALL, "--periodic", "x"), "periodic"),
        ((*SMALL, "--count", 0), "at least one particle, found count 0"),
        ((*SMALL, "--density", "nan"), "positive and finite"),
        ((*SMALL, "--bond-gap", -1), "--bond-gap"),
        ((*SMALL, "--contact-gap", 1e-4), "--contact-gap 0.0001 is now --bond-gap 0.0001"),
        (("--radii", "equal:0.01", "--box", "1,1,1"), "the advancing front fills 2D boxes with walls"),
        ((*LS_2D, "--count", 500, "--density", 0.95), "disks fill at most 0.9069"),
        ((*LS_3D, "--count", 500, "--density", 0.75), "spheres fill at most 0.7405"),
        ((*LS_2D, "--count", 0, "--density", 0.5), "at least one particle"),
        ((*LS_2D, "--count", 2, "--density", 0.7), "under two diameters"),
        ((*LS_2D, "--count", 50, "--density", 0.5, "--growth-rate", -1), "growth rate must be positive"),
        (LS_2D, "needs a count, or a density and radii with a length"),
        (("--method", LS, "--radii", "equal:2", "--box", "1,1", "--density", 0.5), "under one diameter (4)"),
        (("--method", RSA, "--radii", "equal:2", "--box", "1,1"), "under one diameter (4)"),
        (("--method", RSA, "--radii", "equal:0.3", "--box", "1,1", "--periodic", "xy"), "under two diameters (1.2)"),
        (("--method", RSA, "--radii", "equal", "--box", "1,1", "--count", 500, "--density", 0.7), "near 0.5471"),
        (("--method", RSA, "--radii", "equal", "--box", "1,1,1", "--count", 500, "--density", 0.5), "near 0.3841"),
        (("--method", LS, "--radii", "equal", "--box", "1,0", "--count", 50, "--density", 0.5), "edge lengths"),
        (("--method", LS, "--radii", "equal", "--box", "1", "--count", 50, "--density", 0.5), "2 or 3 edge lengths"),
        ((*LS_2D, "--periodic", "xyz", "--count", 50, "--density", 0.5), "combination of the letters"),
    ],
)
def test_bad_requests_are_refused_without_a_file(pack, tmp_path, arguments, words):
    start = time.process_time()
    done = pack(*arguments, "-o", tmp_path / "out.csv")
    assert time.process_time() - start < 2.0  # nothing is packed; imports and compiled code are loaded at most
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert words in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_an_unwritable_place_is_refused(pack, tmp_path):
    done = pack(*SMALL, "-o", tmp_path / "nowhere" / "out.csv")
    assert done.returncode == 2
    assert "cannot write" in done.stderr
    assert list(Path(tmp_path).iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "count", "density"),
    [
        ((*LS_2D, "--count", 120, "--density", 0.7), 120, 0.7),
        (("--method", LS, "--radii", "uniform:1:2", "--box", "2,1", "--count", 90, "--density", 0.72), 90, 0.72),
        ((*LS_3D, "--count", 120, "--density", 0.45), 120, 0.45),
        (("--method", LS, "--radii", "lognormal:1:0.2", "--box", "1,2,1", "--count", 90, "--density", 0.4), 90, 0.4),
        (("--method", RSA, "--radii", "equal", "--box", "1,1", "--count", 90, "--density", 0.4), 90, 0.4),
        (("--method", RSA, "--radii", "gaussian:1:0.1", "--box", "1,1,1", "--periodic", "xyz", "--count", 90)
         + ("--density", 0.3), 90, 0.3),
        (("--radii", "uniform:1:2", "--box", "1,1", "--count", 200, "--density", 0.7), 200, 0.7),
    ],
)  # fmt: skip
def test_each_method_meets_count_and_density_without_overlap(pack, tmp_path, arguments, count, density):
    from etc_engine.packing.overlap import largest_overlap

    done = pack(*arguments, "--seed", 83, "-o", tmp_path / "a.nc", "--json")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    packing = read_table(tmp_path / "a.nc").packing
    assert packing.count == count
    assert packing.density == pytest.approx(density, rel=1e-9)
    assert largest_overlap(packing) < 1e-10
    record = json.loads(done.stdout)
    assert (record["particles"], record["density"]) == (count, packing.density)


def test_a_packer_that_stops_short_says_what_it_reached(pack, tmp_path):
    """Disks of two sizes jam near 0.84, far below the bound of the crystal."""
    walls = ("--method", LS, "--radii", "bidisperse:1:1.4:0.5", "--box", "1,1", "--count", 60, "--density", 0.9)
    done = pack(*walls, "--seed", 85, "-o", tmp_path / "a.csv")
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert "was not reached: it jammed at density 0." in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("ending", ["csv", "dump", "lammpstrj", "nc", "vtp"])
def test_solve_takes_every_format_that_pack_writes(etc_engine, tmp_path, ending):
    if ending == "vtp":
        pytest.importorskip("vtkmodules", reason="the extra vtk is not installed")
    path = tmp_path / f"disks.{ending}"
    assert etc_engine("pack", *SMALL, "--density", 0.9, "--seed", 81, "-o", path).returncode == 0
    own = ("--box", "1,1") if ending == "csv" else ()
    record = json.loads(etc_engine("solve", path, *own, "--json").stdout)
    etc_engine("pack", *SMALL, "--density", 0.9, "--seed", 81, "-o", tmp_path / "same.csv")
    same = json.loads(etc_engine("solve", tmp_path / "same.csv", "--box", "1,1", "--json").stdout)
    assert record["conductivity"] == same["conductivity"] > 0.0
    if not own:
        again = etc_engine("solve", path, "--box", "1,1", "--json")
        assert json.loads(again.stdout)["conductivity"] == same["conductivity"]


def test_netcdf_tells_how_to_make_the_packing_again(etc_engine, tmp_path, monkeypatch):
    import xarray

    monkeypatch.chdir(tmp_path)
    assert etc_engine("pack", *LS_2D, "--count", 60, "--density", 0.6, "-o", "a.nc").returncode == 0
    with xarray.open_dataset("a.nc") as dataset:
        first = dataset.load()
    assert (first.attrs["method"], first.attrs["radii"], first.attrs["periodic"]) == (LS, "equal", "xy")
    Path("a.nc").unlink()
    program, *arguments = shlex.split(first.attrs["command"])
    assert program == "etc-engine"
    assert etc_engine(*arguments).returncode == 0
    with xarray.open_dataset("a.nc") as again:
        xarray.testing.assert_identical(again.load(), first)


def test_an_unknown_ending_is_refused_before_the_work(pack, tmp_path):
    done = pack(*SMALL, "-o", tmp_path / "out.txt")
    assert done.returncode == 2
    assert "packings are written as .csv, .dump, .lammpstrj, .nc, .vtp" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_picture_shows_the_structure(pack, tmp_path):
    done = pack(*SMALL, "--density", 0.85, "--seed", 84, "-o", tmp_path / "a.csv", "--plot", tmp_path / "a.png")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.png").read_bytes()[:4] == b"\x89PNG"


def test_a_long_packing_shows_a_bar_on_a_terminal_only(pack, tmp_path, monkeypatch):
    from etc_engine.cli import progress

    arguments = (*LS_2D, "--count", 300, "--density", 0.75, "--seed", 86, "-o", tmp_path / "a.csv", "--json")
    assert pack(*arguments).stderr == ""
    monkeypatch.setattr(progress, "BAR_DELAY", 0.0)
    monkeypatch.setattr(sys, "stderr", Terminal())
    done = pack(*arguments)
    assert json.loads(done.stdout)["density"] == pytest.approx(0.75)
    shown = sys.stderr.getvalue()
    assert "packing:" in shown
    assert "%|" in shown


class Terminal(StringIO):
    """What stderr is to a program on a terminal."""

    def isatty(self) -> bool:
        return True


def test_vtk_files_without_vtk_are_refused_before_the_work(pack, tmp_path, monkeypatch):
    from etc_engine.particle_files import vtp

    monkeypatch.setattr(vtp, "find_spec", lambda _: None)
    done = pack(*SMALL, "-o", tmp_path / "a.vtp")
    assert done.returncode == 2
    assert "install it with pip install '.[vtk]'" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_grown_radii_are_said(pack, tmp_path):
    done = pack("--radii", "equal:0.05", "--box", "1,1", "--density", 0.95, "--seed", 81, "-o", tmp_path / "a.csv")
    assert done.returncode == 0
    assert "radii were grown" in done.stderr
    assert pack(*SMALL, "--density", 0.7, "--seed", 81, "-o", tmp_path / "b.csv").stderr == ""
