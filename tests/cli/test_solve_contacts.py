"""``solve`` with the contact dump of a DEM code, ids in its output, and its record in words."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray

from etc_engine.medium.rules import overlap_contacts
from etc_engine.particle_files.formats import read_table

BOUNDS = "ITEM: BOX BOUNDS ff ff ff\n-1 1.6\n0 1\n0 1\n"
PARTICLES = (
    f"ITEM: TIMESTEP\n7\nITEM: NUMBER OF ATOMS\n3\n{BOUNDS}ITEM: ATOMS id type x y z radius\n"
    "30 1 -0.55 0.5 0.5 0.5\n10 1 0.35 0.5 0.5 0.5\n20 2 1.2 0.5 0.5 0.5\n"
)


@pytest.fixture
def files(tmp_path):
    """A chain of three spheres, and its contacts with the areas of their lenses and given forces."""
    (tmp_path / "p.dump").write_text(PARTICLES)
    table = read_table(tmp_path / "p.dump")
    network = overlap_contacts(table.packing)
    rows = []
    for (i, j), alpha in zip(network.pairs, network.angles[:, 0], strict=True):
        places = [*(table.packing.centers[i] + table.origin), *(table.packing.centers[j] + table.origin)]
        area = np.pi * (0.5 * np.sin(alpha)) ** 2
        rows.append(" ".join(map(repr, map(float, [*places, table.ids[i], table.ids[j], 0, 1e5, 2, 3, area, 0.0]))))
    names = " ".join(f"c_c[{k + 1}]" for k in range(14))
    head = f"ITEM: TIMESTEP\n7\nITEM: NUMBER OF ENTRIES\n{len(rows)}\n{BOUNDS}ITEM: ENTRIES {names}\n"
    (tmp_path / "c.dump").write_text(head + "\n".join(rows) + "\n")
    return tmp_path


def test_areas_of_lenses_give_the_conductivity_of_overlaps(etc_engine, files):
    overlaps = json.loads(etc_engine("solve", files / "p.dump", "--json").stdout)
    done = etc_engine("solve", files / "p.dump", "--contacts", files / "c.dump", "--json")
    assert json.loads(done.stdout)["conductivity"] == pytest.approx(overlaps["conductivity"], rel=1e-10)
    assert "2 contacts from" in done.stderr
    assert "as the run made it with its own stiffness" in done.stderr


def test_forces_take_elastic_constants(etc_engine, files):
    words = ("solve", files / "p.dump", "--contacts", files / "c.dump", "--contact-width", "force")
    assert "needs Young's modulus" in etc_engine(*words).stderr
    soft, hard = (
        json.loads(etc_engine(*words, "--youngs-modulus", e, "--poisson-ratio", 0.3, "--json").stdout)["conductivity"]
        for e in (1e7, 1e9)
    )
    assert soft > 2.0 * hard > 0.0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--contact-width", "area"), "--contact-width is only valid with --contacts"),
        (("--contacts", "c.dump", "--contact-angle", 5), "give one of them"),
        (("--contacts", "c.dump", "--rule", "overlap"), "give one of them"),
        (("--contacts", "p.dump"), "no dump of contacts"),
        (("--contacts", "c.dump", "--contact-columns", "id force"), "makes 6"),
    ],
)
def test_words_that_do_not_fit_are_refused(etc_engine, files, monkeypatch, options, words):
    monkeypatch.chdir(files)
    done = etc_engine("solve", "p.dump", *options)
    assert done.returncode == 2
    assert words in done.stderr


def test_ids_stay_with_the_particles(etc_engine, files):
    assert etc_engine("solve", files / "p.dump", "-o", files / "s.nc").returncode == 0
    with xarray.open_dataset(files / "s.nc") as data:
        assert data["particle"].values.tolist() == [10, 20, 30]
        assert float(data["x"].sel(particle=20)) + data.attrs["origin"][0] == pytest.approx(1.2)
    again = read_table(files / "s.nc")
    assert again.ids.tolist() == [10, 20, 30]


def test_the_record_is_short_and_in_words(etc_engine, files):
    record = json.loads(etc_engine("solve", files / "p.dump", "--json").stdout)
    assert (record["status"], record["status_name"]) == (0, "ok")
    assert "contact_temperatures" not in record
    full = json.loads(etc_engine("solve", files / "p.dump", "--json", "--full").stdout)
    assert len(full["contact_temperatures"]) == 2
    lines = etc_engine("solve", files / "p.dump", "--axis", "y").stdout.splitlines()
    assert any(line.split() == ["status", "not_percolating"] for line in lines)
    assert "homogenize FILE --engine voxel" in etc_engine("solve", files / "p.dump", "--engine", "voxel").stderr


def test_a_conductivity_that_depends_on_the_bond_gap_says_so(etc_engine, tmp_path):
    """A square lattice of disks with gaps from 0 to 0.02 mean radii."""
    radii = iter(0.05 * (1.0 - 0.01 * np.random.default_rng(20261).random(100)))
    rows = [f"{0.05 + 0.1 * i},{0.05 + 0.1 * j},{next(radii):.17g}" for i in range(10) for j in range(10)]
    (tmp_path / "p.csv").write_text("\n".join(["x,y,radius", *rows]))
    ask = ("solve", tmp_path / "p.csv", "--box", "1,1", "--contact-angle", 5, "--json", "--bond-gap")
    near, far = etc_engine(*ask, 0.012), etc_engine(*ask, 0.1)
    assert "pairs have gaps near --bond-gap 0.012: the conductivity is " in near.stderr
    half, asked, twice = (json.loads(etc_engine(*ask, gap).stdout)["conductivity"] for gap in (0.006, 0.012, 0.024))
    assert half < asked < twice
    assert f"{half:.4g} with half the gap, {asked:.4g} as asked, {twice:.4g} with twice the gap" in near.stderr
    assert "with half the gap" not in far.stderr
