"""Spheres through the command line: pack, solve, sweep, transient."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr

from etc_engine.box import Box
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.dumps import write_trajectory
from etc_engine.particle_files.trajectory import Trajectory

SWEEP = """
schema = 2
name = "spheres"
seed = 20263
[packing]
method = "lubachevsky-stillinger"
radii = "equal:0.14"
box = [1.0, 1.0, 1.0]
periodic = "xyz"
density = [0.60, 0.72]
[contacts]
rule = "bonded"
bond_gap = 0.05
contact_angle = [2.0, 5.0, 8.0, 11.0]
[conduction]
method = ["chord", "standard"]
[statistics]
realizations = 2
"""

TRANSIENT = """
schema = 2
kind = "network"
name = "elements"
seed = 7
[packing]
method = "lubachevsky-stillinger"
radii = "uniform:0.1:0.14"
box = [1.0, 1.0, 1.0]
density = 0.5
[contacts]
rule = "bonded"
contact_angle = 8
bond_gap = 0.1
[conduction]
method = "chord"
dipoles = true
[particles]
heat_capacity = 2.0
initial = { value = 0.1, gradient = [0.0, 0.0, 0.2] }
[walls]
left = { type = "fixed", value = 1.0 }
bottom = { type = "flux", value = 0.05 }
back = { type = "convective", coefficient = 1.5, value = 0.0 }
[time]
steps = 20
times = [0.0, 0.1, 2.0]
"""

MOVING = """
schema = 2
kind = "network"
name = "shaken bed"
[packing]
files = "bed.dump"
[conduction]
engine = "ENGINE"
[particles]
conductivity = 2.0
heat_capacity = 3.0
initial = 0.0
[walls]
front = { type = "fixed", value = 1.0 }
back = { type = "convective", value = 0.0, coefficient = 5.0 }
[motion]
timestep = 0.001
[time]
steps = 2
"""


def test_pack_and_solve_spheres_with_every_file(etc_engine, tmp_path):
    bed = tmp_path / "bed.csv"
    done = etc_engine(
        *("pack", "--method", "lubachevsky-stillinger", "--radii", "uniform:0.1:0.14", "--box", "1,1,1"),
        *("--density", "0.5", "--seed", "11", "-o", bed, "--json"),
    )
    assert done.returncode == 0, done.stderr
    files = ["-o", tmp_path / "bed.nc", "--plot", tmp_path / "bed.png", "--vtk", tmp_path / "bed.vtp"]
    given = ["solve", bed, "--box", "1,1,1", "--contact-angle", "6", "--bond-gap", "0.1", "--axis", "all", "--json"]
    done = etc_engine(*given, *files)
    assert done.returncode == 0, done.stderr
    chord = json.loads(done.stdout)
    assert set(chord["conductivity_per_axis"]) == {"x", "y", "z"}
    assert 0.0 < chord["model_error_estimate"] < 0.01
    with xr.open_dataset(tmp_path / "bed.nc") as data:
        assert data["z"].attrs["units"] == "m"
        assert data["heat_flow"].attrs["units"] == "W"
        assert data["temperature"].dims == ("particle",)
    assert all((tmp_path / name).stat().st_size > 1000 for name in ("bed.png", "bed.vtp"))
    exact = json.loads(etc_engine(*given, "--method", "exact").stdout)
    off = abs(chord["conductivity"] / exact["conductivity"] - 1.0)
    assert off < chord["model_error_estimate"] + exact["model_error_estimate"]
    for method in ("chord", "uniform", "holm", "root-area"):
        done = etc_engine(*given, "--engine", "pipe", "--method", method)
        assert done.returncode == 0, done.stderr
    by_area = json.loads(done.stdout)["conductivity"]
    small = json.loads(etc_engine(*given, "--engine", "pipe", "--method", "holm").stdout)["conductivity"]
    assert by_area == pytest.approx(np.sqrt(np.pi) * small, rel=1e-8)


def test_contacts_of_one_radius(etc_engine, tmp_path):
    pair = tmp_path / "pair.csv"
    pair.write_text("x,y,z,radius\n0.2,1,1,0.2\n0.7,1,1,0.3\n")
    given = (
        "solve",
        pair,
        "--box",
        "1,2,2",
        "--contact-radius",
        "0.02",
        "--json",
        "--engine",
        "pipe",
        "--method",
        "holm",
    )
    done = etc_engine(*given)
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["contact_rule"] == "radius"
    # a wall passes 4 kappa c, a contact 2 kappa c
    assert result["conductivity"] == pytest.approx(1.0 / 4.0 / (2.0 / (4.0 * 0.02) + 1.0 / (2.0 * 0.02)), rel=1e-9)
    done = etc_engine("solve", pair, "--box", "1,2,2", "--contact-radius", "0.25")
    assert done.returncode == 2
    assert "below the smallest particle's radius 0.2 m, found 0.25 m" in done.stderr


def test_a_crop_through_spheres_is_solved_and_told(etc_engine, tmp_path):
    """Layers of a cubic array, cropped through the middle of two of them and between layers."""
    centers = np.stack(np.meshgrid(*[np.arange(6)] * 3, indexing="ij"), axis=-1).reshape(-1, 3) + 0.5
    bed = tmp_path / "bed.csv"
    np.savetxt(bed, np.c_[centers, np.full(216, 0.505)], delimiter=",", header="x,y,z,radius", comments="")
    given = ("solve", bed, "--box", "6,6,6", "--periodic", "xy", "--axis", "z", "--json")
    through = etc_engine(*given, "--crop", ",,0.45:5.55")
    assert through.returncode == 0, through.stderr
    assert "through the middle of 72 particles; their cut is taken at 75 degrees" in through.stderr
    between = etc_engine(*given, "--crop", ",,1:5")
    assert between.returncode == 0, between.stderr
    k = [json.loads(done.stdout)["conductivity"] for done in (through, between)]
    assert k[0] == pytest.approx(k[1], rel=0.03)


def test_a_sweep_of_spheres_records_a_packing_that_fails(etc_engine, tmp_path):
    (tmp_path / "study.toml").write_text(SWEEP)
    done = etc_engine("sweep", tmp_path / "study.toml", "-o", tmp_path / "out.nc")
    assert done.returncode == 4, done.stderr
    with xr.open_dataset(tmp_path / "out.nc") as data:
        k = data["conductivity"].sel({"density": 0.60, "method": "chord"})
        assert k.sizes["direction_i"] == 3
        for axis in "xyz":
            diagonal = k.sel(direction_i=axis, direction_j=axis).transpose("contact_angle", "realization")
            assert (diagonal >= 0.0).all()
            assert (np.diff(diagonal.values, axis=0) >= 0.0).all()
            assert diagonal.max() > 0.01
        failed = data.sel(density=0.72)
        assert (failed["status"] == 2).all()
        assert failed["conductivity"].isnull().all()


def test_a_transient_of_spheres_balances_its_heat(etc_engine, tmp_path):
    (tmp_path / "study.toml").write_text(TRANSIENT)
    done = etc_engine(
        *("transient", tmp_path / "study.toml", "-o", tmp_path / "out.nc"),
        *("--plot", tmp_path / "out.png", "--vtk", tmp_path / "out.pvd"),
    )
    assert done.returncode == 0, done.stderr
    assert " J, imbalance" in done.stderr
    with xr.open_dataset(tmp_path / "out.nc") as data:
        rise = (data.temperature - data.temperature.isel(time=0)) @ data.heat_capacity
        np.testing.assert_allclose(rise, data.wall_heat.sum("wall") + data.source_heat, rtol=1e-9, atol=1e-10)
        assert data["wall_heat"].attrs["units"] == "J"
        assert data["wall"].values.tolist() == ["left", "right", "bottom", "top", "front", "back"]
        np.testing.assert_allclose(data["temperature"].isel(time=0), 0.1 + 0.2 * data["z"], atol=1e-12)
    assert len(list((tmp_path / "out").glob("*.vtp"))) == 3


@pytest.mark.parametrize("engine", ["pipe", "dtem"])
def test_a_moving_bed_of_spheres_keeps_its_heat(etc_engine, tmp_path, engine):
    rng = np.random.default_rng(58)
    grid = (np.stack(np.meshgrid(*[np.arange(3)] * 3), -1).reshape(-1, 3) + 0.5) / 3
    box = Box((1.0, 1.0, 1.0), (True, True, False))
    radii = rng.uniform(0.167, 0.175, 27)
    packings = [ParticlePacking(grid + rng.uniform(-0.004, 0.004, (27, 3)), radii, box) for _ in range(5)]
    write_trajectory(
        tmp_path / "bed.dump", Trajectory(0.01 * np.arange(5.0), packings, np.arange(1, 28)), timestep=0.001
    )
    (tmp_path / "study.toml").write_text(MOVING.replace("ENGINE", engine))
    done = etc_engine("transient", tmp_path / "study.toml", "-o", tmp_path / "out.nc")
    assert done.returncode == 0, done.stderr
    with xr.open_dataset(tmp_path / "out.nc") as data:
        assert data["z"].dims == ("time", "particle")
        heat = data["wall_heat"].sum("wall") + data["source_heat"]
        np.testing.assert_allclose(data["stored_heat"], heat, atol=1e-12)
        assert float(data["wall_heat_flow"].sel(wall="front")[-1]) > 0.0
        assert int(data["opened_contacts"].sum() + data["closed_contacts"].sum()) > 0
