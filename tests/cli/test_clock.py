"""The time of a command leaves compilation out and shows it apart."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time

import click
import numpy as np
import pytest
from numba import njit

from etc_engine.cli.clock import Clock

PARTICLES = "x,y,radius\n0.25,0.5,0.25\n0.75,0.5,0.25\n"


@pytest.fixture
def context():
    with click.Context(click.Command("made")) as entered:
        yield entered


def compiled():
    """A kernel that calls another one; nothing of them is on the disk."""

    @njit
    def inner(x):
        return np.sort(x)[0] + np.cumsum(x)[-1]

    @njit
    def outer(x):
        return inner(x) + np.argsort(x)[0]

    return outer


def test_compilation_is_measured_once_and_taken_out(context):
    clock, begun = Clock(), time.perf_counter()
    compiled()(np.arange(3.0))
    whole = time.perf_counter() - begun
    time.sleep(0.2)
    found = clock.record()
    assert 0.1 < found["compile_seconds"] <= whole
    assert found["seconds"] >= 0.2
    assert sum(found.values()) >= whole + 0.2


def test_without_compilation_there_is_only_the_time(context):
    assert set(Clock().record()) == {"seconds"}


def test_the_clock_stops_listening_with_its_command():
    with click.Context(click.Command("made")):
        clock = Clock()
    compiled()(np.arange(3.0))
    assert set(clock.record()) == {"seconds"}


@pytest.mark.slow
def test_solve_shows_compilation_of_a_first_run_alone(tmp_path):
    (tmp_path / "disks.csv").write_text(PARTICLES)
    words = [sys.executable, "-m", "etc_engine", "solve", "disks.csv", "--box", "1,1", "--axis", "x", "--json"]
    empty = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    runs = [subprocess.run(words, cwd=tmp_path, env=empty, capture_output=True, text=True, check=True) for _ in "12"]
    first, second = (json.loads(run.stdout) for run in runs)
    assert first["compile_seconds"] > 1.0
    assert first["seconds"] < first["compile_seconds"]
    assert "compile_seconds" not in second
    assert first["conductivity"] == second["conductivity"]
