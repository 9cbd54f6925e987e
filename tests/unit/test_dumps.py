from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.errors import InputError
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import overlap_contacts
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.dumps import count_frames, read_dump, write_dump
from etc_engine.particle_files.sample import Sample
from etc_engine.particle_files.table import ParticleTable
from etc_engine.realization import effective_conductivity

BED = Path(__file__).parents[1] / "data" / "gravity_bed.dump"

LIGGGHTS = """ITEM: TIMESTEP
500
ITEM: NUMBER OF ATOMS
2
ITEM: BOX BOUNDS ff ss mm
-1 1
2 4
0 1
ITEM: ATOMS id xs ys zs diameter vx
2 0.75 0.5 0.2 0.5 0.0
1 0.25 0.5 0.9 0.5 0.0
"""


@pytest.fixture
def dump(tmp_path):
    def write(text: str) -> Path:
        path = tmp_path / "a.dump"
        path.write_text(text)
        return path

    return write


def test_a_real_lammps_bed_brings_its_box():
    assert count_frames(BED) == 2
    packing = read_dump(BED).packing
    assert packing.count == 300
    assert packing.box == Box((0.3, 0.6), (True, False))
    assert sorted(set(packing.radii)) == [0.005, 0.007]


def test_floating_grains_of_the_bed_are_normal():
    """Before the fall nothing touches enough to conduct; after it the bed wraps around x."""
    before = effective_conductivity(medium_of(overlap_contacts(read_dump(BED, 0).packing)), axes=(0,))
    after = effective_conductivity(medium_of(overlap_contacts(read_dump(BED, 1).packing)), axes=(0,))
    assert (before.tensor[0, 0], before.spans[0]) == (0.0, False)
    assert after.spans[0]
    assert after.tensor[0, 0] > 0.01
    floating = 300 - np.unique(overlap_contacts(read_dump(BED, 1).packing).pairs).size
    assert floating > 0


def test_scaled_positions_diameters_moved_boxes_and_order_of_ids(dump):
    packing = read_dump(dump(LIGGGHTS)).packing
    assert packing.box == Box((2.0, 2.0, 1.0))
    np.testing.assert_allclose(packing.centers, [[0.5, 1.0, 0.9], [1.5, 1.0, 0.2]])
    assert packing.radii.tolist() == [0.25, 0.25]


def test_the_box_decides_on_the_dimension(dump):
    """One layer in a 3D box is spheres; only a slab about z = 0 that is periodic along z holds disks."""
    layer = LIGGGHTS.replace("0.5 0.9 0.5", "0.5 0.2 0.5")
    table = read_dump(dump(layer))
    assert table.packing.dimension == 3
    assert any("taken for spheres" in note for note in table.notes)
    asked = read_dump(dump(layer), sample=Sample(dimension=2))
    assert (asked.packing.dimension, asked.notes) == (2, ())
    slab = layer.replace("ff ss mm", "ff ss pp").replace("0 1\nITEM: ATOMS", "-0.2 0.8\nITEM: ATOMS")
    table = read_dump(dump(slab))
    assert table.packing.dimension == 2
    assert any("taken for disks" in note for note in table.notes)
    assert read_dump(dump(slab), sample=Sample(dimension=3)).packing.dimension == 3
    with pytest.raises(InputError, match=r"heights from 0\.2 to 0\.9, so they are no disks"):
        read_dump(dump(LIGGGHTS), sample=Sample(dimension=2))


@pytest.mark.parametrize("dimension", [2, 3])
def test_round_trip_keeps_every_bit(tmp_path, dimension):
    rng = np.random.default_rng(41)
    box = Box((1.0, 2.0, 3.0)[:dimension], (True, False, True)[:dimension])
    packing = ParticlePacking(rng.random((50, dimension)) * box.lengths, rng.uniform(0.01, 0.1, 50), box)
    write_dump(tmp_path / "a.dump", ParticleTable(packing, rng.uniform(1, 2, 50)))
    back = read_dump(tmp_path / "a.dump")
    np.testing.assert_array_equal(back.packing.centers, packing.centers)
    np.testing.assert_array_equal(back.packing.radii, packing.radii)
    assert back.packing.box == box
    assert back.conductivity is not None


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("ITEM: TIMESTEP", "ITEM: STEP", "not a LAMMPS text dump"),
        ("0.75 0.5 0.2 0.5 0.0\n1 0.25 0.5 0.9 0.5 0.0\n", "0.75\n", "cut short or malformed"),
        ("diameter", "size", "neither a radius nor a diameter"),
        ("xs ys", "q ys", "no column of x positions"),
        (
            "BOUNDS ff ss mm\n-1 1\n2 4\n0 1",
            "BOUNDS xy xz yz ff ss mm\n-1 1 0.2\n2 4 0\n0 1 0",
            "tilted .triclinic. box .xy = 0.2",
        ),
        ("2 0.75", "2 abc", "x is not a number: 'abc'"),
        ("diameter vx", "diameter", "expected 5 values, found 6"),
        ("ATOMS\n2", "ATOMS\n0", "holds no particles|malformed|expected"),
    ],
)
def test_malformed_dumps_are_refused(dump, old, new, words):
    assert old in LIGGGHTS
    with pytest.raises(InputError, match=words):
        read_dump(dump(LIGGGHTS.replace(old, new)))


def test_frames_that_are_not_there_are_refused():
    with pytest.raises(InputError, match="holds 2 frames"):
        read_dump(BED, 2)
    with pytest.raises(InputError, match="no file"):
        read_dump(BED.with_name("none.dump"))
