"""The short form of `kills.py`: a handful of kills, nothing lost, nothing changed."""

from __future__ import annotations

import importlib.util
import secrets
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).with_name("kills.py")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="finds the ranks in /proc"),
]


@pytest.fixture(scope="module")
def kills():
    spec = importlib.util.spec_from_file_location("kills", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules["kills"] = module
    spec.loader.exec_module(module)
    return module


def test_nothing_finished_is_lost_or_changed(kills, tmp_path):
    ranks = 2 if kills.MPIEXEC.exists() else 1
    seed = secrets.randbits(32)  # other moments every time; a failure shows the seed
    tally = kills.kill_sweeps(tmp_path, 4, ranks, seed, unit_seconds=0.06)
    print(f"seed {seed}: {tally}")
    assert tally.kills == 4
    assert tally.completed >= 1
    assert (tally.lost, tally.changed) == (0, 0), f"seed {seed}: {tally}"
