from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray

from etc_engine.engines.dtem.field import recover_field
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import overlap_contacts
from etc_engine.output.raster import sample_image
from etc_engine.realization import effective_conductivity

TABLE_2 = Path(__file__).parents[1] / "published" / "data" / "feng2008_table2_particles.csv"
BED = Path(__file__).parents[1] / "data" / "gravity_bed.dump"


def test_netcdf_of_a_single_solve_opens_with_labels(etc_engine, tmp_path):
    done = etc_engine("solve", TABLE_2, "--box", "1,1", "-o", tmp_path / "a.nc", "--json", "--full")
    with xarray.open_dataset(tmp_path / "a.nc") as data:
        assert dict(data.sizes) == {"particle": 12, "contact": 17, "side": 2, "wall_contact": 7}
        temperatures = [entry["temperature"] for entry in json.loads(done.stdout)["contact_temperatures"]]
        np.testing.assert_array_equal(data.contact_temperature, temperatures)
        assert data.attrs["conductivity"] == json.loads(done.stdout)["conductivity"]
        into_hot_wall = data.wall_heat_flow.where(data.wall == "x=0").sum()
        assert -float(into_hot_wall) == pytest.approx(data.attrs["conductivity"], rel=1e-10)
        assert data.temperature.attrs["units"] == "K"


def test_vtk_holds_disks_and_contacts(etc_engine, tmp_path):
    readers = pytest.importorskip("vtkmodules.vtkIOXML", reason="the extra vtk is not installed")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    assert etc_engine("solve", TABLE_2, "--box", "1,1", "--vtk", tmp_path / "a.vtp").returncode == 0
    reader = readers.vtkXMLPolyDataReader()
    reader.SetFileName(str(tmp_path / "a.vtp"))
    reader.Update()
    data = reader.GetOutput()
    assert data.GetNumberOfLines() == 17
    assert data.GetNumberOfPolys() == 12 * 36 * 6
    cells = data.GetCellData()
    particle = vtk_to_numpy(cells.GetArray("particle"))
    assert np.count_nonzero(particle == -1) == 17
    mean = vtk_to_numpy(cells.GetArray("mean_temperature"))
    solution = effective_conductivity(medium_of(overlap_contacts(_table_2())), axes=(0,)).solutions[0]
    field = recover_field(solution)
    np.testing.assert_array_equal(mean[particle == 3], field.particle_temperatures[3])
    np.testing.assert_array_equal(vtk_to_numpy(cells.GetArray("heat_flow"))[:17], field.contact_flows)
    temperature = vtk_to_numpy(data.GetPointData().GetArray("temperature"))
    assert np.nanmin(temperature) > -0.01
    assert np.nanmax(temperature) < 1.01


def _table_2():
    from etc_engine.box import Box
    from etc_engine.particle_files.csv_files import read_csv

    return read_csv(TABLE_2, Box((1.0, 1.0))).packing


def test_image_fills_the_particles_and_their_union():
    packing = _table_2()
    solution = effective_conductivity(medium_of(overlap_contacts(packing)), axes=(0,)).solutions[0]
    image, owners = sample_image(recover_field(solution), 500)
    from etc_engine.structure.union import union_area

    assert np.mean(owners >= 0) == pytest.approx(union_area(packing), abs=2e-3)
    assert np.isfinite(image[owners >= 0]).all()
    assert np.isnan(image[owners < 0]).all()
    _, column = np.unravel_index(np.nanargmax(image), image.shape)
    assert column < 5  # hottest at the hot wall


def test_periodic_image_follows_the_gradient(hexagonal):
    from etc_engine.medium.rules import bonded_contacts

    packing = hexagonal(2, 2)
    solution = effective_conductivity(medium_of(bonded_contacts(packing, 0.15))).solutions[0]
    image, _ = sample_image(recover_field(solution), 400)
    x = (np.arange(image.shape[1]) + 0.5) / image.shape[1] * packing.box.lengths[0]
    deviation = image - x
    assert np.nanmax(deviation) - np.nanmin(deviation) < 0.8  # less than a particle, not a box


def test_pictures_are_drawn_and_large_ones_simplified(etc_engine, tmp_path):
    assert etc_engine("solve", TABLE_2, "--box", "1,1", "--plot", tmp_path / "a.png").returncode == 0
    assert (tmp_path / "a.png").read_bytes()[:4] == b"\x89PNG"
    assert etc_engine("solve", BED, "--plot", tmp_path / "b.svg").returncode == 0
    drawing = (tmp_path / "b.svg").read_text()
    assert "<svg" in drawing
    assert "LineCollection" in drawing  # the heat flows
    assert "data:image/png" in drawing  # the inner temperatures


def test_dump_brings_its_box_and_frames(etc_engine):
    record = json.loads(etc_engine("solve", BED, "--json").stdout)
    assert record["particles"] == 300
    assert record["percolates"]
    first = json.loads(etc_engine("solve", BED, "--frame", 0, "--json").stdout)
    assert first["status"] == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((BED, "--box", "0.1,0.1"), "has its centre outside the box"),
        ((BED, "--frame", 9), "there is no frame 9"),
        ((TABLE_2,), "--box is missing"),
        ((TABLE_2, "--box", "1,1", "--frame", 0), "holds one packing: leave the frame out"),
        ((TABLE_2, "--box", "1,1", "--vtk", "a.vtk"), ".vtp"),
        ((TABLE_2, "--box", "1,1", "--plot", "a.xyz"), "a.xyz"),
        ((TABLE_2, "--box", "1,1", "-o", "nowhere/a.nc"), "cannot write"),
    ],
)
def test_bad_outputs_are_refused_and_leave_nothing(etc_engine, tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    done = etc_engine("solve", *arguments)
    assert done.returncode == 2
    assert words in done.stderr
    assert done.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_close_arcs_are_warned_of(etc_engine, tmp_path):
    path = tmp_path / "disks.csv"
    height = 3**0.5
    path.write_text(f"x,y,radius\n0,0,0.5\n0.5,{height / 2},0.5\n")
    done = etc_engine("solve", path, "--box", f"1,{height}", "--periodic", "xy", "--contact-angle", 20, "--json")
    assert done.returncode == 0
    assert "method exact" in done.stderr
    assert json.loads(done.stdout)["conductivity"] == pytest.approx(0.92121, rel=3e-4)  # the exact value


@pytest.mark.parametrize("option", ["-o", "--plot"])
def test_an_output_never_replaces_its_input(etc_engine, tmp_path, option):
    name = tmp_path / ("disks.png" if option == "--plot" else "disks.csv")
    name.write_text("x,y,radius\n0.25,0.5,0.25\n0.75,0.5,0.25\n")
    before = name.read_bytes()
    done = etc_engine("solve", name, "--box", "1,1", "--contact-angle", 5, option, name)
    assert done.returncode == 2
    assert "is the input itself" in done.stderr
    assert name.read_bytes() == before


def test_nothing_in_contact_is_said(etc_engine, tmp_path):
    path = tmp_path / "disks.csv"
    path.write_text("x,y,radius\n0.25,0.5,0.2\n0.75,0.5,0.2\n")
    done = etc_engine("solve", path, "--box", "1,1", "--json")
    assert done.returncode == 0
    assert json.loads(done.stdout)["conductivity"] == 0.0
    assert "no particles overlap" in done.stderr
    assert "0.5 mean radii" in done.stderr
    assert "--bond-gap" in etc_engine("solve", path, "--box", "1,1", "--contact-angle", 5).stderr


def test_a_bond_gap_without_bonds_is_refused(etc_engine):
    done = etc_engine("solve", TABLE_2, "--box", "1,1", "--bond-gap", 0.1)
    assert done.returncode == 2
    assert "is only valid with --contact-angle" in done.stderr
