"""Particle files that were damaged: thousands of mutations, each read as particles or refused in one line."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.errors import EtcError
from etc_engine.particle_files.formats import read_table
from etc_engine.particle_files.precision import doubtful_contacts
from etc_engine.particle_files.sample import Sample

FRAME = (
    "ITEM: UNITS\nsi\nITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n3\nITEM: BOX BOUNDS pp ff ss\n0 1\n0 2\n-0.5 0.5\n"
    "ITEM: ATOMS id type x y zs radius f_Temp[0]\n1 1 0.25 0.5 0.5 0.25 300\n3 2 0.75 0.51234 0.52 0.25 301\n"
    "2 2 0.123456 1.5 0.51 0.25 302.5\n"
)
SEEDS = {
    "dump": FRAME.format(step=0) + FRAME.format(step=100),
    "csv": '# by hand\nx,y,z,radius,name\n0.25,0.5,0.1,0.25,a\n0.75,0.5,0.2,0.25,"b, c"\n0.123456,1.5,0.3,0.1,\n',
    "yade": "#format id_x_y_z_r_matId\n0\t0.25\t0.5\t0.1\t0.25\t0\n1\t0.75\t0.5\t0.2\t0.25\t1\n",
    "xyz": '2\nLattice="1 0 0 0 2 0 0 0 1" Origin="0 0 0" pbc="T F F" Properties=species:S:1:pos:R:3:radius:R:1\n'
    "C 0.25 0.5 0.125 0.25\nO 0.75 0.5 0.625 0.125\n",
    "mercury": "2 0.5 0 0 0 1 2 1 \n0.25 0.5 0.125 0 0 0 0.25 0 0 0 0 0 0 0\n"
    "0.75 0.5 0.625 0 0 0 0.125 0 0 0 0 0 0 1\n",
}
WORDS = (
    *(
        "nan",
        "inf",
        "-1",
        "1e999",
        "1e-320",
        "99999999999999999999",
        "0x1p3",
        "",
        "ITEM:",
        "ITEM: ATOMS",
        ",",
        ";",
        "\t",
        '"',
    ),
    *(
        "\n",
        "\r",
        "\x00",
        "\ufeff",
        "½",
        "#",
        "=",
        ":",
        "2",
        "pp",
        "xy xz yz",
        "x",
        "id",
        "diameter",
        "Properties=",
        "%s",
    ),
)


def mutate(data: bytes, rng: np.random.Generator) -> bytes:
    """Some bytes cut out, doubled, flipped, swapped with another part, or replaced by an awkward word."""
    found = bytearray(data)
    for _ in range(rng.integers(1, 4)):
        start = int(rng.integers(0, len(found) + 1))
        end = min(len(found), start + int(rng.integers(0, 12)))
        kind = rng.integers(0, 6)
        if kind == 0:
            found[start:end] = WORDS[rng.integers(len(WORDS))].encode()
        elif kind == 1:
            found[start:end] = b""
        elif kind == 2:
            found[start:end] = bytes(found[start:end]) * int(rng.integers(2, 40))
        elif kind == 3:
            found[start:end] = rng.integers(0, 256, end - start, dtype=np.uint8).tobytes()
        elif kind == 4:
            found = found[: max(start, 1)]
        else:
            lines = bytes(found).splitlines(keepends=True)
            rng.shuffle(lines)
            found = bytearray(b"".join(lines))
    return bytes(found)


def read_mutated(folder: Path, count: int, seed: int) -> int:
    """Read so many mutations; how many were refused."""
    rng = np.random.default_rng(seed)
    names = list(SEEDS)
    refused = 0
    path = folder / "mutated"
    for k in range(count):
        data = mutate(SEEDS[names[k % len(names)]].encode(), rng)
        path.write_bytes(data)
        boxed = names[k % len(names)] in ("csv", "yade")
        whole = Sample(box=((0.0, 1.0), (0.0, 2.0), (-1.0, 1.0)) if boxed else None)
        samples = (whole, replace(whole, crop=((0.0, 0.5), (0.0, 1.0), (-1.0, 1.0))), replace(whole, dimension=3))
        try:
            table = read_table(path, sample=samples[int(rng.integers(3))])
            doubtful_contacts(table)
        except EtcError as error:
            assert str(error).strip()
            refused += 1
            continue
        packing = table.packing
        assert packing.count >= 1
        assert np.isfinite(packing.centers).all()
        assert np.isfinite(packing.radii).all()
    return refused


@pytest.mark.filterwarnings("error")
def test_some_hundred_mutations(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        refused = read_mutated(tmp_path, 400, 20261126)
    assert 100 < refused < 400  # most are refused, some are still good


@pytest.mark.slow
def test_three_thousand_mutations(tmp_path):
    assert 1000 < read_mutated(tmp_path, 3000, 614_021) < 3000


@pytest.mark.parametrize("text", SEEDS.values(), ids=SEEDS)
def test_the_seeds_themselves_are_good(tmp_path, text):
    (tmp_path / "a").write_text(text)
    box = Box((1.0, 2.0, 1.0)) if not text.startswith(("ITEM", "2")) else None
    assert read_table(tmp_path / "a", box).packing.dimension == 3
