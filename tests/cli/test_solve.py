from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from etc_engine.cli import run

TABLE_2 = Path(__file__).parents[1] / "published" / "data" / "feng2008_table2_particles.csv"


def refused(done) -> str:
    """The one line of a refusal."""
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    lines = done.stderr.splitlines()
    assert len(lines) == 1
    assert "Traceback" not in lines[0]
    return lines[0]


@pytest.fixture
def disks(tmp_path):
    def write(*rows: str, header: str = "x,y,radius") -> Path:
        path = tmp_path / "disks.csv"
        path.write_text("\n".join([header, *rows]) + "\n")
        return path

    return write


def test_the_published_assembly_as_json():
    command = [sys.executable, "-m", "etc_engine", "solve", str(TABLE_2), "--box", "1,1", "--json", "--full"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert done.stderr == ""
    record = json.loads(done.stdout)
    assert record["conductivity"] == pytest.approx(0.278754, abs=5e-7)
    assert (record["particles"], record["contacts"], record["wall_contacts"], record["unknowns"]) == (12, 17, 4, 17)
    assert (record["percolates"], record["status"]) == (True, 0)
    assert record["method"] == "chord"
    assert record["relative_energy_error"] < 1e-10
    assert record["contact_temperatures"][0] == {"particles": [0, 1], "temperature": pytest.approx(0.7212, abs=1e-4)}
    assert len(record["contact_temperatures"]) == 17
    assert {"iterations", "seconds"} <= set(record)


@pytest.mark.parametrize(("method", "value"), [("standard", 0.26784), ("enhanced", 0.27562), ("arc", 0.2763014)])
def test_other_methods(etc_engine, method, value):
    done = etc_engine("solve", TABLE_2, "--box", "1,1", "--method", method, "--json")
    assert json.loads(done.stdout)["conductivity"] == pytest.approx(value, abs=6e-6)


def test_without_json_a_table_for_people(etc_engine):
    done = etc_engine("solve", TABLE_2, "--box", "1,1")
    assert done.returncode == 0
    assert "0.278754" in done.stdout
    assert "W/(m K)" in done.stdout


def test_conductivity_of_the_particles_by_option_and_by_column(etc_engine, disks):
    path = disks("0.25,0.5,0.25", "0.75,0.5,0.25")
    option = json.loads(
        etc_engine("solve", path, "--box", "1,1", "--contact-angle", 5, "--conductivity", 4, "--json").stdout
    )
    path = disks("0.25,0.5,0.25,4", "0.75,0.5,0.25,4", header="x,y,radius,conductivity")
    column = json.loads(etc_engine("solve", path, "--box", "1,1", "--contact-angle", 5, "--json").stdout)
    assert option["conductivity"] == pytest.approx(column["conductivity"], rel=1e-12)


def test_periodic_boxes_give_a_tensor(etc_engine, disks):
    path = disks("0.25,0.5,0.5")
    record = json.loads(
        etc_engine("solve", path, "--box", "1,1", "--periodic", "xy", "--contact-angle", 5, "--json").stdout
    )
    (kxx, kxy), (kyx, kyy) = record["conductivity_tensor"]
    assert kxx == record["conductivity"] == pytest.approx(kyy, rel=1e-12)
    assert abs(kxy) + abs(kyx) < 1e-14


def test_no_path_answers_zero_and_exits_well(etc_engine, disks):
    done = etc_engine("solve", disks("0.2,0.5,0.2"), "--box", "1,1", "--contact-angle", 5, "--json")
    record = json.loads(done.stdout)
    assert done.returncode == 0
    assert (record["conductivity"], record["percolates"], record["status"]) == (0.0, False, 1)


BAD_ROWS = [
    ("nan,0.5,0.1", "not finite"),
    ("0.5,0.5,inf", "not finite"),
    ("0.5,0.5,-0.1", "radius that is not positive"),
    ("0.5,0.5,0", "radius that is not positive"),
    ("1.5,0.5,0.1", "outside the box"),
    ("0.5,abc,0.1", "y is not a number: 'abc'"),
    ("0.5,0.5", "expected 3 values"),
]


@pytest.mark.parametrize(("row", "words"), BAD_ROWS)
def test_bad_rows_are_refused(etc_engine, disks, row, words):
    assert words in refused(etc_engine("solve", disks("0.2,0.2,0.1", row), "--box", "1,1", "--json"))


def test_files_that_are_not_there_or_not_tables_are_refused(etc_engine, disks, tmp_path):
    assert "there is no file" in refused(etc_engine("solve", tmp_path / "none.csv", "--box", "1,1"))
    assert "header" in refused(etc_engine("solve", disks("1,2,3", header="a,b,c"), "--box", "1,1"))
    assert "no particles" in refused(etc_engine("solve", disks(), "--box", "1,1"))
    assert "cannot be read" in refused(etc_engine("solve", tmp_path, "--box", "1,1"))
    binary = tmp_path / "binary.csv"
    binary.write_bytes(b"\xff\xfe\x00\x01")
    assert "it is binary" in refused(etc_engine("solve", binary, "--box", "1,1"))


def test_impossible_geometries_are_refused(etc_engine, disks):
    swallowed = disks("0.5,0.5,0.3", "0.55,0.5,0.1")
    assert "one lies inside the other" in refused(etc_engine("solve", swallowed, "--box", "1,1"))
    arcs = disks("0.5,0.5,0.2", "0.85,0.5,0.15", "0.7,0.8,0.16")
    line = refused(etc_engine("solve", arcs, "--box", "1,1", "--contact-angle", 60, "--bond-gap", 0.5))
    assert "contact arcs of particle 0 overlap" in line


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--contact-angle", 0), "between 1e-06 and 90 degrees"),
        (("--contact-angle", 90), "between 1e-06 and 90 degrees"),
        (("--contact-angle", "nan"), "between 1e-06 and 90 degrees"),
        (("--contact-angle", 5, "--bond-gap", -1), "bond gap"),
        (("--method", "spline"), "engine dtem has no method 'spline': expected one of chord"),
        (("--conductivity", 0), "conductivity must be positive"),
        (("--contact-resistance", -1), "contact resistance must be >= 0"),
        (("--area-resistance", -1), "contact resistance must be >= 0"),
        (("--contact-resistance", 1, "--area-resistance", 1), "--contact-resistance and --area-resistance both resist"),
        (("--box", "1"), "2 or 3 edge lengths"),
        (("--box", "1,-1"), "positive"),
        (("--box", "a,b"), "--box takes"),
        (("--periodic", "z"), "periodic axes 'z'"),
        (("--nonsense",), "No such option"),
    ],
)
def test_bad_options_are_refused(etc_engine, options, words):
    assert words in refused(etc_engine("solve", TABLE_2, "--box", "1,1", *options))


def test_a_resistance_over_the_contact_area(etc_engine, tmp_path):
    """One disk between walls: r over the two chords of half-width sqrt(.52^2 - .5^2), and the disk."""
    one = tmp_path / "one.csv"
    one.write_text("x,y,radius\n0.5,0.5,0.52\n")
    done = etc_engine("solve", one, "--box", "1,1.2", "--area-resistance", 1e4, "--method", "exact", "--json")
    found = json.loads(done.stdout)
    reach = np.sqrt(0.52**2 - 0.5**2)
    assert found["conductivity"] == pytest.approx(reach / 1e4 / 1.2, rel=3e-4)
    assert found["model_error_estimate"] < 1e-6


@pytest.mark.parametrize(
    ("rows", "options", "words"),
    [
        ("0.5,0.5,1e308", ["--box", "1,1"], "has a radius beyond 1e+06 times the box"),
        ("0.5,0.5,0.1", ["--box", "1e200,1"], "must lie between 1e-100 and 1e100"),
        (
            "0.5,0.5,0.5",
            ["--box", "1,1", "--conductivity", "1e308"],
            "the conductivity of a particle is 1e+308: give a number",
        ),
        (
            "0.5,0.5,0.5",
            ["--box", "1,1", "--conductivity", "1e-300"],
            "the conductivity of a particle is 1e-300: give a number",
        ),
        (
            "0.5,0.5,0.5",
            ["--box", "1,1", "--contact-resistance", "1e200"],
            "contact resistance must be at most 1e+100",
        ),
    ],
)
def test_numbers_beyond_all_measure_are_refused(etc_engine, tmp_path, rows, options, words):
    (tmp_path / "disks.csv").write_text(f"x,y,radius\n{rows}\n")
    done = etc_engine("solve", tmp_path / "disks.csv", *options)
    assert done.returncode == 2
    assert words in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_pores_that_conduct_are_solved_by_cells(feng_particles, tmp_path, capsys):
    rows = np.column_stack((feng_particles.centers, feng_particles.radii))
    path, picture, data = tmp_path / "twelve.csv", tmp_path / "field.png", tmp_path / "field.nc"
    np.savetxt(path, rows, delimiter=",", header="x,y,radius", comments="", fmt="%.17g")
    words = ["solve", str(path), "--box", "1,1", "--pore-conductivity", "0.01"]
    assert run([*words, "--json", "--bounds", "--plot", str(picture), "-o", str(data)]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["method"] == "cell"
    assert record["pore_conductivity"] == 0.01
    assert abs(record["conductivity"] / 0.3104213 - 1.0) < 0.004  # own two-sided bounds
    assert record["conductivity_bounds"][0] < 0.3104213 < record["conductivity_bounds"][1]
    assert 0.0 < record["model_error_estimate"] < 0.008
    assert (record["contacts"], record["wall_contacts"]) == (17, 4)
    assert record["links"] > record["contacts"]
    assert picture.stat().st_size > 10_000
    assert run([*words, "--degree", "7"]) == 2
    assert "a whole number from 1 to 5" in capsys.readouterr().err
    assert run(["solve", str(path), "--box", "1,1", "--pore-conductivity", "-1"]) == 2
    assert "must be finite and not negative" in capsys.readouterr().err
