"""Damaged files of sweeps: refused or computed again, never another number and never a hang."""

from __future__ import annotations

import importlib.util
import shutil
from pathlib import Path

import numpy as np
import pytest

from etc_engine.durable import apart
from etc_engine.errors import OutputError
from etc_engine.sweep.dataset import differing_variables
from etc_engine.sweep.result_file import open_dataset

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

STUDY = """schema = 2
name = "damaged"
seed = 271828
[packing]
radii = "uniform:0.03:0.06"
box = [1.0, 1.0]
density = [0.55, 0.60]
[contacts]
rule = "bonded"
contact_angle = [5.0, 10.0]
[statistics]
realizations = 3
"""


@pytest.fixture(scope="module")
def sweep():
    spec = importlib.util.spec_from_file_location("stand_in", Path(__file__).parents[1] / "stand_in.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return lambda *arguments: module.main([str(word) for word in arguments])


def damaged(data: bytes, kind: int, rng: np.random.Generator) -> bytes:
    """One bit flipped, the end cut off, or 64 bytes replaced."""
    place = int(rng.integers(len(data)))
    if kind == 0:
        return data[:place] + bytes([data[place] ^ 1 << int(rng.integers(8))]) + data[place + 1 :]
    return data[:place] if kind == 1 else data[:place] + rng.bytes(min(64, len(data) - place)) + data[place + 64 :]


def test_damaged_results_are_refused_or_read_as_they_were(sweep, tmp_path, monkeypatch):
    monkeypatch.setattr(apart, "SECONDS", 15.0)
    (tmp_path / "study.toml").write_text(STUDY)
    assert sweep(tmp_path / "study.toml", "-o", tmp_path / "whole.nc") == 0
    whole, content = open_dataset(tmp_path / "whole.nc"), (tmp_path / "whole.nc").read_bytes()
    rng = np.random.default_rng(2026)
    refused = 0
    for attempt in range(120):
        (tmp_path / "damaged.nc").write_bytes(damaged(content, attempt % 3, rng))
        try:
            found = open_dataset(tmp_path / "damaged.nc")
        except OutputError as error:
            assert "come to an end" not in str(error)
            refused += 1
            continue
        assert differing_variables(whole, found) == []
        assert {name: str(value) for name, value in found.attrs.items()} == {
            name: str(value) for name, value in whole.attrs.items()
        }
    assert refused >= 100


def test_damaged_shards_are_computed_again(sweep, tmp_path):
    (tmp_path / "study.toml").write_text(STUDY)
    assert sweep(tmp_path / "study.toml", "-o", tmp_path / "whole.nc") == 0
    whole = open_dataset(tmp_path / "whole.nc")
    for part in ("1/2", "2/2"):
        sweep(tmp_path / "study.toml", "-o", tmp_path / "parts.nc", "--part", part)
    shards = sorted(tmp_path.glob("parts.nc.part-*/*.shard"))
    assert len(shards) == 2
    rng = np.random.default_rng(2027)
    for attempt in range(200):
        for folder in tmp_path.glob("again.nc*.shards"):
            shutil.rmtree(folder)
        (tmp_path / "again.nc").unlink(missing_ok=True)
        for folder in tmp_path.glob("parts.nc.part-*.shards"):
            shutil.copytree(folder, tmp_path / folder.name.replace("parts.nc", "again.nc"))
        chosen = shards[attempt % len(shards)]
        shard = tmp_path / chosen.parent.name.replace("parts.nc", "again.nc") / chosen.name
        shard.write_bytes(damaged(shard.read_bytes(), attempt % 3, rng))
        assert sweep(tmp_path / "study.toml", "-o", tmp_path / "again.nc", "--policy", "resume") == 0
        assert differing_variables(whole, open_dataset(tmp_path / "again.nc")) == []
