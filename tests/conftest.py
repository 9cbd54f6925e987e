from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.cli import run
from etc_engine.packing.particles import ParticlePacking

DATA = Path(__file__).parent / "published" / "data"


@pytest.fixture(scope="session")
def feng_particles() -> ParticlePacking:
    """The 12-particle assembly of Feng et al. 2008, Table 2."""
    rows = np.loadtxt(DATA / "feng2008_table2_particles.csv", delimiter=",", skiprows=1)
    return ParticlePacking(rows[:, :2], rows[:, 2], Box((1.0, 1.0)))


@pytest.fixture(scope="session")
def hexagonal():
    """Builder of a periodic hexagonal packing of touching unit-diameter disks, nx x ny cells of two disks."""

    def build(nx: int = 1, ny: int = 1) -> ParticlePacking:
        height = np.sqrt(3.0)
        cells = np.array([(i, j * height) for i in range(nx) for j in range(ny)])
        centers = np.concatenate([cells, cells + [0.5, 0.5 * height]])
        return ParticlePacking(centers, np.full(len(centers), 0.5), Box((nx, ny * height), (True, True)))

    return build


@dataclass(frozen=True)
class Done:
    """How a command line ended."""

    returncode: int
    stdout: str
    stderr: str


@pytest.fixture
def etc_engine(capsys):
    """Run a command line inside this process: ``etc_engine("solve", path, "--box", "1,1")``."""

    def call(*arguments: object) -> Done:
        capsys.readouterr()
        status = run([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return Done(status, captured.out, captured.err)

    return call
