"""Particle files from strangers: whatever is in them, the readers answer particles or one InputError."""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from etc_engine.box import Box
from etc_engine.errors import EtcError
from etc_engine.particle_files.formats import CSV, DUMP, format_to_read, read_table

NUMBERS = [
    "0.25",
    "0.5",
    "-1",
    "1e-300",
    "1e300",
    "1e999",
    "nan",
    "inf",
    "-inf",
    "0x1",
    "1_0",
    "",
    " ",
    "½",
    "1,2",
    '"',
    "#",
    "\x00",
]
word = st.sampled_from(NUMBERS) | st.text(max_size=6)
row = st.lists(word, max_size=5)
CSV_SEED = b"x,y,radius\n0.25,0.5,0.25\n0.75,0.5,0.25\n"
DUMP_SEED = (
    b"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS ff pp pp\n0 1\n0 1\n-0.5 0.5\n"
    b"ITEM: ATOMS id x y z radius\n1 0.25 0.5 0 0.25\n2 0.75 0.5 0 0.25\n"
)


@st.composite
def damaged(draw: st.DrawFn, seed: bytes) -> bytes:
    """A good file with some bytes cut out, doubled or replaced."""
    data = bytearray(seed)
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(data)))
        end = min(len(data), start + draw(st.integers(0, 12)))
        new = draw(
            st.binary(max_size=6)
            | st.sampled_from([number.encode() for number in NUMBERS])
            | st.just(bytes(data[start:end]) * 2)
        )
        data[start:end] = new
    return bytes(data)


def read(data: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("error")  # a warning would reach the user as noise
        path = Path(folder) / "upload"
        path.write_bytes(data)
        kind = format_to_read(path)
        if kind not in (CSV, DUMP):
            return
        try:
            table = read_table(path, None if kind is DUMP else Box((1.0, 1.0)))
        except EtcError as error:
            assert str(error)
            return
        packing = table.packing
        assert packing.count >= 1
        assert np.isfinite(packing.centers).all()
        assert np.isfinite(packing.radii).all()
        assert (packing.radii > 0.0).all()


@settings(max_examples=300)
@given(damaged(CSV_SEED))
@example(b"")
@example(b"\xef\xbb\xbfx,y,radius\n")
@example(b"x,y,radius\n" + b"1e999,0.5,0.1\n")
@example(b"x,y,radius\r\r\n0.5,0.5,0.1")
@example(b"x,y,radius\n0.25,0.5,0.25\n0.\xc2")  # found by this test: cut inside a letter
@example(b'x,y,radius\n"' + 200_000 * b"1")
def test_damaged_csv(data):
    read(data)


@settings(max_examples=150)
@given(st.lists(row, max_size=4), st.sampled_from([",", ";", "\t"]), st.sampled_from(["\n", "\r\n", "\r"]))
def test_tables_of_anything(rows, separator, ending):
    read(("x,y,radius" + ending + ending.join(separator.join(row) for row in rows)).encode("utf-8", "surrogatepass"))


@settings(max_examples=300)
@given(damaged(DUMP_SEED))
@example(DUMP_SEED.replace(b"\n2\nITEM: BOX", b"\n-2\nITEM: BOX"))
@example(DUMP_SEED.replace(b"\n2\nITEM: BOX", b"\n99999999999999\nITEM: BOX"))
@example(DUMP_SEED.replace(b"0 1\n0 1", b"nan 1\n0 inf"))
@example(DUMP_SEED.replace(b"id x y z", b"id x x z"))
@example(DUMP_SEED.replace(b"pp\n0 1\n0 1", b"pp\n 1\n0 1"))  # found by this test: one number for two
def test_damaged_dumps(data):
    read(data)


@settings(max_examples=100)
@given(st.binary(max_size=200))
def test_any_bytes(data):
    read(data)
