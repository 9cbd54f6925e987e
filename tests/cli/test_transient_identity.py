"""Transients of particles by id and type, and from the temperatures of their file."""

from __future__ import annotations

import numpy as np
import pytest
import xarray

DUMP = (
    "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n3\nITEM: BOX BOUNDS ff ff pp\n0 2.6\n0 1\n-0.5 0.5\n"
    "ITEM: ATOMS id type x y z radius f_Temp[0]\n"
    "30 1 0.45 0.5 0 0.5 310\n10 2 1.3 0.5 0 0.5 320\n20 2 2.15 0.5 0 0.5 330\n"
)
STUDY = """
schema = 2
kind = "network"
name = "by name"
packing = {{ files = "p.dump" }}
[particles]
heat_capacity = 1.0
initial = {initial}
{particles}
[[source]]
heat = 1.0
{source}
[time]
times = [0.0, 0.001]
steps = 2
"""


@pytest.fixture
def run(etc_engine, tmp_path):
    (tmp_path / "p.dump").write_text(DUMP)

    def call(source: str = "", initial: str = "0.0", particles: str = ""):
        (tmp_path / "t.toml").write_text(STUDY.format(source=source, initial=initial, particles=particles))
        return etc_engine("transient", tmp_path / "t.toml", "-o", tmp_path / "t.nc", "--overwrite"), tmp_path / "t.nc"

    return call


@pytest.mark.parametrize(
    ("source", "hottest"),
    [("ids = [20]", 20), ("ids = [10]", 10), ("particles = [2]", 30), ("types = [1]", 30), ('types = ["1"]', 30)],
)
def test_the_named_particle_is_heated(run, source, hottest):
    """Rows are sorted by id: row 2 is id 30."""
    done, out = run(source)
    assert done.returncode == 0, done.stderr
    with xarray.open_dataset(out) as data:
        assert data["particle"].values.tolist() == [10, 20, 30]
        last = data["temperature"].isel(time=-1)
        assert int(last["particle"][int(np.argmax(last.values))]) == hottest


def test_temperatures_of_the_file_are_the_start(run):
    done, out = run("ids = [10]", initial='"file"')
    assert done.returncode == 0, done.stderr
    with xarray.open_dataset(out) as data:
        assert data["temperature"].isel(time=0).sel(particle=[30, 10, 20]).values.tolist() == [310.0, 320.0, 330.0]


def test_conductivities_by_type(run):
    found = {}
    for name, words in (
        ("same", "types = { 1 = 1.0, 2 = 1.0 }"),
        ("plain", ""),
        ("more", "types = { 1 = 1.0, 2 = 9.0 }"),
    ):
        done, out = run("ids = [20]", particles=words)
        assert done.returncode == 0, done.stderr
        with xarray.open_dataset(out) as data:
            found[name] = data["temperature"].isel(time=-1).values
    np.testing.assert_array_equal(found["same"], found["plain"])
    assert found["more"][0] > found["plain"][0]  # more heat reaches id 10 beside it


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"source": "ids = [11]"}, "t.toml: source.0.ids: there is no particle with the id 11"),
        ({"source": 'types = ["3"]'}, "t.toml: source.0.types: no particle is of the type 3"),
        ({"source": "ids = [10]\nparticles = [0]"}, "both choose particles"),
        ({"particles": "types = { 1 = 1.0 }"}, "the particles have the type 2 too"),
        ({"particles": "types = { 1 = 1.0, 2 = 1.0 }\nconductivity = 2.0"}, "remove one of them"),
        ({"initial": '"warm"'}, "particles.initial"),
    ],
)
def test_names_that_are_not_there_are_refused(run, words, said):
    done, _ = run(**{"source": "ids = [10]", **words})
    assert done.returncode == 2
    assert said in done.stderr


def test_a_part_of_the_file(run, tmp_path):
    _, out = run("ids = [10]")
    text = (tmp_path / "t.toml").read_text()
    (tmp_path / "t.toml").write_text(text.replace('"p.dump"', '"p.dump", crop = ["0.9:2.6", ""]'))
    from etc_engine.cli import run as command

    assert command(["transient", str(tmp_path / "t.toml"), "-o", str(out), "--overwrite"]) == 0
    with xarray.open_dataset(out) as data:
        assert data["particle"].values.tolist() == [10, 20]
        np.testing.assert_allclose(data.attrs["box"], [1.7, 1.0])
