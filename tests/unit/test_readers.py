"""Particle files as people have them: every variant reads as the same particles, or is refused by name."""

from __future__ import annotations

import gzip
import io
import re
import sys

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.errors import InputError
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files import streams
from etc_engine.particle_files.csv_files import csv_rows
from etc_engine.particle_files.dumps import read_dump, read_trajectory
from etc_engine.particle_files.formats import CSV, count_frames, format_to_read, read_table, write_particles
from etc_engine.particle_files.parts import READERS
from etc_engine.particle_files.sample import Sample
from etc_engine.particle_files.table import ParticleTable

CENTERS = np.array([[0.25, 0.5, 0.125], [0.75, 0.5, 0.625]])
RADII = np.array([0.25, 0.125])
BOX = Box((1.0, 2.0, 1.0), (True, False, False))
FACES = ((0.0, 1.0), (0.0, 2.0), (0.0, 1.0))


def same(table: ParticleTable, *, box: Box = BOX) -> None:
    np.testing.assert_array_equal(table.packing.centers, CENTERS)
    np.testing.assert_array_equal(table.packing.radii, RADII)
    assert table.packing.box == box


TIMESTEP, NUMBER = "ITEM: TIMESTEP\n500\n", "ITEM: NUMBER OF ATOMS\n2\n"
BOUNDS = "ITEM: BOX BOUNDS pp ff ff\n0 1\n0 2\n0 1\n"
ATOMS = "ITEM: ATOMS id type x y z radius\n2 1 0.75 0.5 0.625 0.125\n1 1 0.25 0.5 0.125 0.25\n"
DUMPS = {
    "plain": TIMESTEP + NUMBER + BOUNDS + ATOMS,
    "other order": TIMESTEP + BOUNDS + NUMBER + ATOMS,
    "table first": TIMESTEP + NUMBER + ATOMS + BOUNDS,
    "units and time": "ITEM: UNITS\nsi\nITEM: TIME\n0.5\n" + TIMESTEP + NUMBER + BOUNDS + ATOMS,
    "byte order mark": "\ufeff" + TIMESTEP + NUMBER + BOUNDS + ATOMS,
    "windows": (TIMESTEP + NUMBER + BOUNDS + ATOMS).replace("\n", "\r\n"),
    "zero tilt": TIMESTEP + NUMBER + "ITEM: BOX BOUNDS xy xz yz pp ff ff\n0 1 0\n0 2 0\n0 1 0\n" + ATOMS,
    "text columns": TIMESTEP + NUMBER + BOUNDS + "ITEM: ATOMS id element x y z radius q\n"
    "2 C 0.75 0.5 0.625 0.125 nan(ind)\n1 O# 0.25 0.5 0.125 0.25 -nan\n",
    "doubled column": TIMESTEP + NUMBER + BOUNDS + "ITEM: ATOMS id type type x y z radius\n"
    "2 1 1 0.75 0.5 0.625 0.125\n1 1 1 0.25 0.5 0.125 0.25\n",
    "scaled": TIMESTEP + NUMBER + BOUNDS + "ITEM: ATOMS id xs ys zs diameter\n"
    "2 0.75 0.25 0.625 0.25\n1 0.25 0.25 0.125 0.5\n",
}


@pytest.mark.parametrize("text", DUMPS.values(), ids=DUMPS)
def test_variants_of_dumps(tmp_path, text):
    path = tmp_path / "a.dump"
    path.write_bytes(text.encode())
    same(read_table(path))


def test_compressed_files(tmp_path):
    data = DUMPS["plain"].encode()
    (tmp_path / "a.gz").write_bytes(gzip.compress(data))
    same(read_table(tmp_path / "a.gz"))
    (tmp_path / "cut.gz").write_bytes(gzip.compress(data)[:-12])
    with pytest.raises(InputError, match="cannot be read"):
        read_table(tmp_path / "cut.gz")
    zstandard = pytest.importorskip("zstandard", reason="the extra zst is not installed")
    (tmp_path / "a.zst").write_bytes(zstandard.ZstdCompressor().compress(data))
    same(read_table(tmp_path / "a.zst"))
    assert count_frames(tmp_path / "a.zst") == 1


def test_standard_input(monkeypatch):
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(DUMPS["plain"].encode())))
    same(read_table("-"))


def test_errors_name_standard_input(monkeypatch):
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"hello\n")))
    with pytest.raises(InputError, match="standard input is not in a known format"):
        read_table("-")


def test_netcdf_in_single_precision_has_a_step(tmp_path):
    import xarray

    write_particles(tmp_path / "a.nc", ParticleTable(ParticlePacking(CENTERS, RADII, BOX)))
    assert read_table(tmp_path / "a.nc").printed is None
    with xarray.open_dataset(tmp_path / "a.nc") as data:
        data.load().astype(np.float32).to_netcdf(tmp_path / "b.nc", engine="netcdf4")
    printed = read_table(tmp_path / "b.nc").printed
    assert printed.radius.step(RADII) == pytest.approx(2.0**-23 * RADII)


def test_units_become_metres(tmp_path):
    (tmp_path / "a.dump").write_text("ITEM: UNITS\ncgs\n" + DUMPS["plain"])
    table = read_table(tmp_path / "a.dump", sample=Sample(crop=((0.0, 1.0), (0.25, 2.0), (0.0, 1.0))))
    assert table.packing.box == Box((0.01, 0.0175, 0.01), (True, False, False))
    np.testing.assert_allclose(table.packing.radii, 0.01 * RADII)
    assert "converted to metres" in table.notes[0]
    (tmp_path / "b.dump").write_text("ITEM: UNITS\nfurlong\n" + DUMPS["plain"])
    with pytest.raises(InputError, match="units 'furlong' are unknown"):
        read_table(tmp_path / "b.dump")


def test_columns_beside_positions_and_radii(tmp_path):
    (tmp_path / "a.dump").write_text(
        TIMESTEP + NUMBER + BOUNDS + "ITEM: ATOMS id type x y z c_rad f_Temp[0] conductivity\n"
        "20 glass 0.75 0.5 0.625 0.125 300.5 2.5\n10 steel 0.25 0.5 0.125 0.25 400.5 16\n"
    )
    with pytest.raises(InputError, match="name the column of radii with --radius-column"):
        read_table(tmp_path / "a.dump")
    table = read_table(tmp_path / "a.dump", sample=Sample(radius_column="c_rad"))
    same(table)
    assert table.ids.tolist() == [10, 20]
    assert table.types.tolist() == ["steel", "glass"]
    assert table.temperature.tolist() == [400.5, 300.5]
    assert table.conductivity.tolist() == [16.0, 2.5]
    kept = read_table(tmp_path / "a.dump", sample=Sample(radius_column="c_rad", crop=((0.5, 1.0), FACES[1], FACES[2])))
    assert (kept.ids.tolist(), kept.types.tolist(), kept.origin) == ([20], ["glass"], (0.5, 0.0, 0.0))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("BOUNDS pp ff ff\n0 1\n", "BOUNDS xy xz yz pp ff ff\n0 1 0.5\n", r"needs 3 numbers per axis"),
        ("BOUNDS pp ff ff", "BOUNDS abc origin pp ff ff", "general triclinic box"),
        ("type x y z", "shapex shapey x y z", "superquadrics or ellipsoids"),
        ("2 1 0.75", "2.5 1 0.75", "id of a particle must be a whole number"),
        ("2 1 0.75", "2 1 inf", "centre that is not finite"),
        ("0.25\n", "0.25", "its last line has no end"),
        ("NUMBER OF ATOMS\n2", "NUMBER OF ATOMS\n3", "3 particles are announced, 2 found"),
        ("ITEM: ATOMS", "ITEM: ENTRIES", "is a dump of contacts"),
    ],
)
def test_dumps_refused_by_name(tmp_path, old, new, words):
    text = DUMPS["plain"]
    assert old in text
    (tmp_path / "a.dump").write_text(new.join(text.rsplit(old, 1)))
    with pytest.raises(InputError, match=words):
        read_table(tmp_path / "a.dump")


def frames(count: int, rows: int = 2) -> str:
    body = "".join(f"{k + 1} 1 0.5 {0.1 + k * 1e-4:.6f} 0.25 0.01 1.25 2.5\n" for k in range(rows))
    head = NUMBER.replace("2\n", f"{rows}\n") + BOUNDS + "ITEM: ATOMS id type x y z radius vx vy\n"
    return "".join(f"ITEM: TIMESTEP\n{k}\n{head}{body}" for k in range(count))


def test_a_cut_last_frame_matters_only_if_it_is_wanted(tmp_path):
    (tmp_path / "a.dump").write_text(frames(3)[:-9])
    assert read_dump(tmp_path / "a.dump", 0).packing.count == 2
    assert read_dump(tmp_path / "a.dump", 1).packing.count == 2
    with pytest.raises(InputError, match="frame 2 is cut short"):
        read_dump(tmp_path / "a.dump")


def test_frames_in_which_particles_come_and_go(tmp_path):
    (tmp_path / "a.dump").write_text(frames(1) + frames(1, 3).replace("TIMESTEP\n0", "TIMESTEP\n1"))
    with pytest.raises(InputError, match=r"particle 3 is not in both; 3 particles instead of 2.*all must stay"):
        read_trajectory(tmp_path / "a.dump")


def test_reading_the_last_frame_takes_the_memory_of_one(tmp_path):
    """Peak of NumPy's and Python's own allocations: of the last of 40 frames, within 20 % of that frame alone."""
    import tracemalloc

    def peak(name: str) -> int:
        tracemalloc.start()
        read_dump(tmp_path / name)
        found = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return found

    (tmp_path / "one.dump").write_text(frames(1, 4000))
    (tmp_path / "many.dump").write_text(frames(40, 4000))
    peak("one.dump")  # what the first call imports
    one, many = peak("one.dump"), peak("many.dump")
    assert many < 1.2 * one


TABLES = {
    "plain": "x,y,z,radius\n0.25,0.5,0.125,0.25\n0.75,0.5,0.625,0.125\n",
    "comments and blank lines": "# by hand\n\nx,y,z,radius\n# 1\n0.25,0.5,0.125,0.25\n\n0.75,0.5,0.625,0.125\n\n",
    "header in a comment": "# x,y,z,radius\n0.25,0.5,0.125,0.25\n0.75,0.5,0.625,0.125\n",
    "order, case and other columns": "ID,Radius,Z,name,Y,X\n1,0.25,0.125,a,0.5,0.25\n2,0.125,0.625,b,0.5,0.75\n",
    "diameter": "x,y,z,diameter\n0.25,0.5,0.125,0.5\n0.75,0.5,0.625,0.25\n",
    "tabs": "x\ty\tz\tradius\n0.25\t0.5\t0.125\t0.25\n0.75\t0.5\t0.625\t0.125\n",
    "semicolons": "x;y;z;radius\n0.25;0.5;0.125;0.25\n0.75;0.5;0.625;0.125\n",
    "blanks": "x y z r\n0.25 0.5  0.125 0.25\n 0.75 0.5 0.625 0.125\n",
    "quoted": '"x","y","z","radius","name"\n0.25,0.5,0.125,0.25,"a, b"\n0.75,0.5,0.625,0.125,"c"\n',
    "ParaView": '"radius","Points:0","Points:1","Points:2"\n0.25,0.25,0.5,0.125\n0.125,0.75,0.5,0.625\n',
    "byte order mark, windows": "\ufeffx,y,z,radius\r\n0.25,0.5,0.125,0.25\r\n0.75,0.5,0.625,0.125\r\n",
    "no last line end": "x,y,z,radius\n0.25,0.5,0.125,0.25\n0.75,0.5,0.625,0.125",
    "YADE": "#format x_y_z_r\n0.25\t0.5\t0.125\t0.25\n0.75\t0.5\t0.625\t0.125\n",
    "YADE with materials": "#format id_x_y_z_r_matId\n# note\n0 0.25 0.5 0.125 0.25 1\n1 0.75 0.5 0.625 0.125 0\n",
}


@pytest.mark.parametrize("text", TABLES.values(), ids=TABLES)
def test_variants_of_tables(tmp_path, text):
    path = tmp_path / "a.txt"
    path.write_bytes(text.encode())
    same(read_table(path, BOX))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x;y;radius\n0,25;0,5;0,25\n", "write decimals with a point"),
        ("0.25,0.5,0.25\n0.75,0.5,0.25\n", "a header such as 'x,y,radius' must come first"),
        ("x,y,radius\n0.25,0.5\n", "line 2: expected 3 values, found 2"),
        ("x,y,x,radius\n0.25,0.5,1,1\n", "column 'x' appears twice"),
        ("a,b,c\n1,2,3\n", "not in a known format: its first line 'a,b,c'"),
        ("LAMMPS data file\n\n2 atoms\n", "not in a known format: its first line 'LAMMPS data file'"),
        ("xs,ys,radius\n0.25,0.5,1\n", "not in a known format"),
        ("x,y,mass\n0.25,0.5,1\n", "neither a radius nor a diameter"),
        ("", "is empty"),
    ],
)
def test_tables_refused_by_name(tmp_path, text, words):
    (tmp_path / "a.txt").write_text(text)
    with pytest.raises(InputError, match=words):
        read_table(tmp_path / "a.txt", Box((1.0, 1.0)))


def test_binary_is_no_format_i_know(tmp_path):
    (tmp_path / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n\x00\x00")
    with pytest.raises(InputError, match="not in a known format"):
        read_table(tmp_path / "a.png")
    with pytest.raises(InputError, match="cannot be read"):
        read_table(tmp_path)


XYZ = (
    '2\nLattice="1 0 0 0 2 0 0 0 1" Origin="0 0 0" pbc="T F F" Properties=species:S:1:pos:R:3:radius:R:1:v:R:2\n'
    "C 0.25 0.5 0.125 0.25 0 0\nO 0.75 0.5 0.625 0.125 0 0\n"
)


def test_extended_xyz(tmp_path):
    path = tmp_path / "a.xyz"
    path.write_text(XYZ.replace("0.25 0.5 0.125 0.25", "0.25 0.5 0.5 0.25") + XYZ)
    table = read_table(path)
    same(table)
    assert table.types.tolist() == ["C", "O"]
    assert count_frames(path) == 2
    assert read_table(path, frame=0).packing.centers[0, 2] == 0.5
    path.write_text(XYZ.replace(' pbc="T F F"', ""))
    assert read_table(path).packing.box.periodic == (True,) * 3
    for old, new, words in (
        ("1 0 0 0 2", "1 0.1 0 0 2", "tilted box"),
        (":radius:R:1", ":mass:R:1", "neither a radius"),
        ("1 0 0 0 2 0", "1 0 0 0 2", "nine numbers"),
        ("2\nLatt", "3\nLatt", "cut short"),
    ):
        path.write_text(XYZ.replace(old, new))
        with pytest.raises(InputError, match=words):
            read_table(path)


def test_mercury(tmp_path):
    path = tmp_path / "a.data"
    rows = "0.25 0.5 0.125 0 0 0 0.25 0 0 0 0 0 0 0\n0.75 0.5 0.625 0 0 0 0.125 0 0 0 0 0 0 1\n"
    path.write_text(f"2 0.5 0 0 0 1 2 1 \n{rows}" * 2)
    same(read_table(path, sample=Sample(periodic="x")))
    table = read_table(path, frame=0)
    assert table.packing.box.periodic == (False,) * 3
    assert "which axes are periodic" in table.notes[0]
    path.write_text("1 0.5 0 0 1 2\n0.25 0.5 0 0 0.25 0 0 0\n")
    disk = read_table(path).packing
    assert (disk.dimension, disk.centers.tolist(), disk.radii.tolist()) == (2, [[0.25, 0.5]], [0.25])


def test_vtk_of_others(tmp_path):
    pytest.importorskip("vtkmodules", reason="the extra vtk is not installed")
    path = tmp_path / "a.vtk"
    path.write_text(
        "# vtk DataFile Version 2.0\nby a DEM code\nASCII\nDATASET POLYDATA\n"
        "POINTS 2 float\n0.25 0.5 0.125 0.75 0.5 0.625\n"
        "VERTICES 2 4\n1 0\n1 1\nPOINT_DATA 2\nSCALARS id int 1\nLOOKUP_TABLE default\n7 8\n"
        "SCALARS radius float 1\nLOOKUP_TABLE default\n0.25 0.125\n"
    )
    with pytest.raises(InputError, match="--box is missing"):
        read_table(path)
    table = read_table(path, BOX)
    same(table)
    assert table.ids.tolist() == [7, 8]
    assert table.printed is not None  # single precision
    foreign = tmp_path / "a.vtp"
    write_particles(foreign, ParticleTable(ParticlePacking(CENTERS, RADII, BOX)))
    same(read_table(foreign))
    foreign.write_bytes(re.sub(b"<FieldData>.*</FieldData>", b"", foreign.read_bytes(), flags=re.DOTALL))
    with pytest.raises(InputError, match="--box is missing"):
        read_table(foreign)
    same(read_table(foreign, BOX))


def test_every_format_is_told_by_its_content(tmp_path):
    for name, text in {"dump": DUMPS["plain"], "XYZ file": XYZ, "YADE text file": TABLES["YADE"]}.items():
        (tmp_path / "a").write_text(text)
        assert format_to_read(tmp_path / "a").name == name


@pytest.mark.parametrize("size", [1, 7, 40, 1000])
def test_tables_in_blocks_of_any_size_have_the_same_rows_and_line_numbers(tmp_path, monkeypatch, size):
    """Blocks end within lines, at their ends, and among comments; parts of a file are read by the same reader."""
    path = tmp_path / "bed.csv"
    lines = [f"\t{k / 7!r}, {k / 3!r} ,0.1  " if k % 5 else "# x,y,radius\r\n\r" for k in range(1, 60)]
    path.write_text("# made by hand\n\n x,y,radius \n" + "\n".join(lines), encoding="utf-8", newline="")
    whole = csv_rows(path)
    monkeypatch.setattr(streams, "BLOCK", size)
    assert np.array_equal(csv_rows(path).positions, whole.positions)
    parts = [READERS[CSV.name](path, Sample(), []).read(part, 4).positions for part in range(4)]
    assert np.array_equal(np.concatenate(parts), whole.positions)
    assert whole.positions.tolist() == [[k / 7, k / 3] for k in range(1, 60) if k % 5]
    path.write_text(path.read_text(encoding="utf-8").replace(repr(44 / 7), "x"), encoding="utf-8", newline="")
    bad = next(n for n, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1) if line.startswith("\tx"))
    with pytest.raises(InputError, match=f"line {bad}: x is not a number: 'x'"):
        csv_rows(path)
