"""Particle files of every format: what is written reads back to the last bit."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from etc_engine.box import Box
from etc_engine.durable import apart
from etc_engine.errors import EtcError, InputError
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files import netcdf
from etc_engine.particle_files.formats import format_to_read, format_to_write, read_table, write_particles
from etc_engine.particle_files.table import ParticleTable

ENDINGS = ("csv", "dump", "lammpstrj", "nc", "vtp")


def need(ending: str) -> None:
    if ending == "vtp":
        pytest.importorskip("vtkmodules", reason="the extra vtk is not installed")


@st.composite
def tables(draw) -> ParticleTable:
    """Particles of any size at any place of any box."""
    d = draw(st.sampled_from((2, 3)))
    scale = 10.0 ** draw(st.integers(-9, 6))
    lengths = tuple(scale * draw(st.floats(0.1, 10.0)) for _ in range(d))
    periodic = tuple(draw(st.booleans()) for _ in range(d))
    count = draw(st.integers(2, 6))
    rng = np.random.default_rng(draw(st.integers(100, 10**9)))
    centers = rng.random((count, d)) * lengths
    conductivity = rng.lognormal(0.0, 3.0, count) if draw(st.booleans()) else None
    return ParticleTable(ParticlePacking(centers, scale * rng.random(count), Box(lengths, periodic)), conductivity)


def assert_same(found: ParticleTable, given_: ParticleTable) -> None:
    assert found.packing.box == given_.packing.box
    np.testing.assert_array_equal(found.packing.centers, given_.packing.centers)
    np.testing.assert_array_equal(found.packing.radii, given_.packing.radii)
    assert (found.conductivity is None) == (given_.conductivity is None)
    if given_.conductivity is not None:
        np.testing.assert_array_equal(found.conductivity, given_.conductivity)


@pytest.mark.parametrize("ending", ENDINGS)
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(table=tables())
def test_what_is_written_reads_back_to_the_last_bit(tmp_path, ending, table):
    need(ending)
    path = tmp_path / f"packing.{ending}"
    write_particles(path, table)
    assert_same(read_table(path, table.packing.box if ending == "csv" else None), table)


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_file_is_known_by_its_content(tmp_path, ending):
    need(ending)
    path = tmp_path / f"packing.{ending}"
    write_particles(path, ParticleTable(ParticlePacking([[0.5, 0.5]], [0.1], Box((1.0, 1.0)))))
    renamed = path.rename(tmp_path / "packing")
    assert format_to_read(renamed) is format_to_write(path)


def test_an_unknown_ending_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"written as \.csv, \.dump, \.lammpstrj, \.nc, \.vtp: found"):
        format_to_write(tmp_path / "packing.txt")


def test_spheres_at_one_height_stay_spheres(tmp_path):
    flat = ParticleTable(ParticlePacking([[0.5, 0.5, 0.5]], [0.1], Box((1.0, 1.0, 1.0))))
    for ending in ("nc", "csv", "dump"):
        write_particles(tmp_path / f"a.{ending}", flat)
        assert_same(read_table(tmp_path / f"a.{ending}", flat.packing.box if ending == "csv" else None), flat)


def test_box_and_frame_of_every_format(tmp_path):
    table = ParticleTable(ParticlePacking([[0.5, 0.5]], [0.1], Box((1.0, 1.0))))
    for ending in ("csv", "nc"):
        write_particles(tmp_path / f"a.{ending}", table)
    with pytest.raises(InputError, match="--box is missing: give its edge lengths"):
        read_table(tmp_path / "a.csv")
    assert read_table(tmp_path / "a.nc", Box((2.0, 3.0))).packing.box == Box((2.0, 3.0))
    with pytest.raises(InputError, match="netCDF file, which holds one packing: leave the frame out"):
        read_table(tmp_path / "a.nc", frame=0)


@pytest.mark.parametrize(
    ("drop", "words"), [("box", "'box' and 'periodic' are missing"), ("radius", "found no radius")]
)
def test_netcdf_without_a_packing_is_refused(tmp_path, drop, words):
    from etc_engine.particle_files.netcdf import packing_dataset

    dataset = packing_dataset(ParticleTable(ParticlePacking([[0.5, 0.5]], [0.1], Box((1.0, 1.0)))))
    if drop in dataset:
        dataset = dataset.drop_vars(drop)
    else:
        del dataset.attrs[drop]
    dataset.to_netcdf(tmp_path / "a.nc", engine="netcdf4")
    with pytest.raises(InputError, match=words):
        read_table(tmp_path / "a.nc")


@pytest.mark.parametrize(
    "content",
    [b"\x89HDF\r\n\x1a\nrubbish", b"CDF\x01", b"<?xml version='1.0'?>\n<VTKFile", b"<VTKFile type='PolyData'/>"],
)
def test_broken_files_are_refused_in_one_line_and_silence(tmp_path, capfd, content):
    if b"VTK" in content:
        need("vtp")
    (tmp_path / "a").write_bytes(content)
    with pytest.raises(EtcError, match="cannot be read as"):
        read_table(tmp_path / "a")
    assert capfd.readouterr().err == ""


def test_formats_load_neither_xarray_nor_vtk_before_they_are_needed():
    code = (
        "import sys, etc_engine.particle_files.formats\nprint({'xarray', 'netCDF4', 'vtkmodules'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_a_netcdf_packing_that_keeps_the_reader_busy_is_given_up(tmp_path, monkeypatch):
    packing = ParticlePacking([[0.5, 0.5]], [0.2], Box((1.0, 1.0)))
    write_particles(tmp_path / "a.nc", ParticleTable(packing))
    monkeypatch.setattr(netcdf, "NETCDF", "while True: pass")
    monkeypatch.setattr(apart, "SECONDS", 0.5)
    with pytest.raises(InputError, match="did not finish"):
        read_table(tmp_path / "a.nc")
