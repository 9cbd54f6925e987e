from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray

TABLE_2 = Path(__file__).parents[1] / "published" / "data" / "feng2008_table2_particles.csv"


@pytest.mark.parametrize(("words", "expected"), [([], 0.27433), (["--method", "uniform"], 0.26378)])
def test_conductivity_of_the_twelve_particles(etc_engine, words, expected):
    done = etc_engine("solve", TABLE_2, "--box", "1,1", "--engine", "pipe", *words, "--json")
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    assert record["conductivity"] == pytest.approx(expected, abs=5e-6)
    assert (record["engine"], record["method"]) == ("pipe", words[1] if words else "chord")
    assert (record["unknowns"], record["contacts"]) == (12, 17)
    assert "model_error_estimate" not in record


def test_outputs(etc_engine, tmp_path):
    places = {"-o": tmp_path / "a.nc", "--vtk": tmp_path / "a.vtp", "--plot": tmp_path / "a.png"}
    pytest.importorskip("vtkmodules.vtkIOXML", reason="the extra vtk is not installed")
    outputs = [word for pair in places.items() for word in pair]
    done = etc_engine("solve", TABLE_2, "--box", "1,1", "--engine", "pipe", *outputs)
    assert done.returncode == 0, done.stderr
    assert all(path.stat().st_size > 1000 for path in places.values())


def test_netcdf_holds_the_flows_of_the_pipes(etc_engine, tmp_path):
    done = etc_engine("solve", TABLE_2, "--box", "1,1", "--engine", "pipe", "-o", tmp_path / "a.nc", "--json")
    with xarray.open_dataset(tmp_path / "a.nc") as data:
        assert (data.attrs["engine"], data.attrs["method"]) == ("pipe", "chord")
        net = np.zeros(12)
        flow, pairs = data.heat_flow.values, data.contact_particle.values
        np.add.at(net, pairs[:, 0], flow)
        np.add.at(net, pairs[:, 1], -flow)
        np.add.at(net, data.wall_particle.values, data.wall_heat_flow.values)
        assert np.abs(net).max() < 1e-12  # what flows into a particle flows out of it
        into_hot_wall = data.wall_heat_flow.where(data.wall == "x=0").sum()
        assert -float(into_hot_wall) == pytest.approx(json.loads(done.stdout)["conductivity"], rel=1e-10)


def test_picture_alone(etc_engine, tmp_path):
    done = etc_engine("solve", TABLE_2, "--box", "1,1", "--engine", "pipe", "--plot", tmp_path / "a.png")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--engine", "pipe", "--method", "round"], "engine pipe has no method 'round': expected one of"),
        (["--method", "pipe"], "--method pipe is now --engine pipe --method chord"),
        (["--method", "pipe", "--pipe-resistance", "uniform"], "is now --engine pipe --method uniform"),
        (["--pipe-resistance", "uniform"], "--pipe-resistance uniform is now --engine pipe --method uniform"),
        (["--engine", "pipe", "--modes", "3"], "modes has no effect with method chord of engine pipe"),
        (["--engine", "voxel"], "engine voxel resolves the pores: use etc-engine homogenize"),
    ],
)
def test_words_that_are_refused(etc_engine, words, message):
    done = etc_engine("solve", TABLE_2, "--box", "1,1", *words)
    assert (done.returncode, done.stdout) == (2, "")
    assert message in done.stderr
