from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray

TABLE_2 = Path(__file__).parents[1] / "published" / "data" / "feng2008_table2_particles.csv"


@pytest.mark.parametrize(("words", "expected"), [([], 0.27433), (["--pipe-resistance", "uniform"], 0.26378)])
def test_conductivity_of_the_twelve_particles(etc_engine, words, expected):
    done = etc_engine("solve", TABLE_2, "--box", "1,1", "--method", "pipe", *words, "--json")
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    assert record["conductivity"] == pytest.approx(expected, abs=5e-6)
    assert (record["method"], record["unknowns"], len(record["contact_temperatures"])) == ("pipe", 12, 17)
    assert record["pipe_resistance"] == (words[1] if words else "chord")
    assert "model_error_estimate" not in record


def test_outputs(etc_engine, tmp_path):
    places = {"-o": tmp_path / "a.nc", "--vtk": tmp_path / "a.vtp", "--plot": tmp_path / "a.png"}
    pytest.importorskip("vtkmodules.vtkIOXML", reason="the extra vtk is not installed")
    outputs = [word for pair in places.items() for word in pair]
    done = etc_engine("solve", TABLE_2, "--box", "1,1", "--method", "pipe", *outputs)
    assert done.returncode == 0, done.stderr
    assert all(path.stat().st_size > 1000 for path in places.values())


def test_netcdf_holds_the_flows_of_the_pipes(etc_engine, tmp_path):
    done = etc_engine("solve", TABLE_2, "--box", "1,1", "--method", "pipe", "-o", tmp_path / "a.nc", "--json")
    with xarray.open_dataset(tmp_path / "a.nc") as data:
        assert (data.attrs["method"], data.attrs["pipe_resistance"]) == ("pipe", "chord")
        net = np.zeros(12)
        flow, pairs = data.heat_flow.values, data.contact_particle.values
        np.add.at(net, pairs[:, 0], flow)
        np.add.at(net, pairs[:, 1], -flow)
        np.add.at(net, data.wall_particle.values, data.wall_heat_flow.values)
        assert np.abs(net).max() < 1e-12  # what flows into a particle flows out of it
        into_hot_wall = data.wall_heat_flow.where(data.wall == "x=0").sum()
        assert -float(into_hot_wall) == pytest.approx(json.loads(done.stdout)["conductivity"], rel=1e-10)


def test_picture_alone(etc_engine, tmp_path):
    done = etc_engine("solve", TABLE_2, "--box", "1,1", "--method", "pipe", "--plot", tmp_path / "a.png")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--method", "pipe", "--pipe-resistance", "round"], "unknown pipe resistance 'round'"),
        (["--method", "chord", "--pipe-resistance", "chord"], "--pipe-resistance goes with --method pipe"),
        (["--method", "pipe", "--modes", "3"], "--modes goes with --method exact or arc"),
    ],
)
def test_words_that_are_refused(etc_engine, words, message):
    done = etc_engine("solve", TABLE_2, "--box", "1,1", *words)
    assert (done.returncode, done.stdout) == (2, "")
    assert message in done.stderr
