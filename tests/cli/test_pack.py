from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.packing.files import read_csv


@pytest.fixture
def pack(etc_engine):
    return partial(etc_engine, "pack")


SMALL = ("--radii", "uniform:0.02:0.04", "--box", "1,1")


def test_a_packing_is_written_and_described(pack, tmp_path):
    path = tmp_path / "disks.csv"
    done = pack(*SMALL, "--seed", 77, "-o", path, "--json")
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    packing = read_csv(path, Box((1.0, 1.0))).packing
    assert record["particles"] == packing.count
    assert record["density"] == pytest.approx(packing.density, rel=1e-12)
    assert record["coordination"] == pytest.approx(2 * record["contacts"] / packing.count)
    assert record["seed"] == 77
    assert record["seconds"] > 0


def test_the_same_seed_gives_the_same_file(pack, tmp_path):
    files = [tmp_path / "a.csv", tmp_path / "b.csv", tmp_path / "c.csv"]
    for file, seed in zip(files, (78, 78, 79), strict=True):
        assert pack(*SMALL, "--seed", seed, "-o", file).returncode == 0
    assert files[0].read_bytes() == files[1].read_bytes() != files[2].read_bytes()


def test_a_seed_is_drawn_and_told_when_none_is_given(pack, tmp_path):
    first = json.loads(pack(*SMALL, "-o", tmp_path / "a.csv", "--json").stdout)
    again = json.loads(pack(*SMALL, "-o", tmp_path / "b.csv", "--seed", first["seed"], "--json").stdout)
    assert again["density"] == first["density"]


def test_the_file_reads_back_to_the_last_bit(pack, tmp_path):
    from etc_engine.packing import PackingSpec, parse_radii
    from etc_engine.packing import pack as pack_disks

    path = tmp_path / "a.csv"
    pack(*SMALL, "--seed", 80, "-o", path)
    spec = PackingSpec("advancing-front", parse_radii("uniform:0.02:0.04"), Box((1.0, 1.0)))
    packing = pack_disks(spec, np.random.default_rng(80))
    np.testing.assert_array_equal(read_csv(path, packing.box).packing.centers, packing.centers)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--radii", "uniform:0.1", "--box", "1,1"), "uniform"),
        (("--radii", "cubic:1", "--box", "1,1"), "cubic"),
        (("--radii", "uniform:-1:2", "--box", "1,1"), "radi"),
        (("--radii", "equal:2", "--box", "1,1"), "box"),
        ((*SMALL, "--method", "shaking"), "unknown packing method"),
        ((*SMALL, "--density", 0), "density"),
        ((*SMALL, "--seed", -3), "--seed"),
        ((*SMALL, "--periodic", "x"), "periodic"),
    ],
)
def test_bad_requests_are_refused_without_a_file(pack, tmp_path, arguments, words):
    done = pack(*arguments, "-o", tmp_path / "out.csv")
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert words in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_an_unwritable_place_is_refused(pack, tmp_path):
    done = pack(*SMALL, "-o", tmp_path / "nowhere" / "out.csv")
    assert done.returncode == 2
    assert "cannot write" in done.stderr
    assert list(Path(tmp_path).iterdir()) == []
