from __future__ import annotations

import os
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

from etc_engine.box import Box
from etc_engine.cli import run
from etc_engine.packing.particles import ParticlePacking

# The same examples on every run; HYPOTHESIS_EXPLORE=1 looks for new ones.
settings.register_profile("repeatable", derandomize=not os.environ.get("HYPOTHESIS_EXPLORE"), deadline=None)
settings.load_profile("repeatable")

DATA = Path(__file__).parent / "published" / "data"


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """On several processes the tests of a file stay together, and those that share one Slurm."""
    if config.pluginmanager.hasplugin("xdist"):
        for item in items:
            group = "cluster" if item.path.parent.name == "cluster" else str(item.path)
            item.add_marker(pytest.mark.xdist_group(group))


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


@pytest.fixture(scope="session")
def made_sweep():
    """Builder of the dataset of a sweep whose conductivities are given, not computed.

    ``conduct(density, angle in degrees or None, method, realization)`` is the diagonal, one number per axis or one for
    all; None is a packing that failed. Of a study that varies more than the angle, the second argument is a mapping of
    all values. The solid fraction is ``solid(density)``.
    """
    from etc_engine.durable.provenance import this_run
    from etc_engine.realization import Outcome, Realization, Status
    from etc_engine.study.sweep import parse_study
    from etc_engine.sweep.attributes import global_attributes
    from etc_engine.sweep.dataset import assemble
    from etc_engine.sweep.plan import Unit
    from etc_engine.sweep.records import Record
    from etc_engine.sweep.table import tabulate

    def cell(value, dimension: int, mean_field: float) -> Outcome:
        if value is None:
            return Outcome(Status.PACKING_FAILED, "made to fail")
        tensor = np.full((dimension, dimension), np.nan)
        np.fill_diagonal(tensor, value)
        status = Status.OK if np.nanmax(tensor) > 0.0 else Status.NOT_PERCOLATING
        return Outcome(status, "", tensor, 30, 4, 3.5, 20, 6, 1e-11, 0.001, mean_field)

    def build(text: str, conduct, solid=lambda density: density, mean_field: float = 0.5):
        study = parse_study(text)
        several = [dict(zip(study.axes, values, strict=True)) for values in product(*study.axes.values())]
        angle = (study.quantities.get("contact_angle") or (None,))[0]
        plain = not set(study.axes) - {"contact_angle"}
        swept = [one.get("contact_angle", angle) for one in several] if plain else several
        d = study.box.dimension
        records = []
        for density in study.densities:
            for r in range(study.statistics.realizations):
                values = tuple(cell(conduct(density, one, m, r), d, mean_field) for one in swept for m in study.methods)
                result = Realization(100, density, solid(density), 0.01, values)
                unit = Unit(density, r)
                records.append(Record(unit, result, 0, "here", 0.0, 1.0))
        return assemble(
            study, tabulate(study, records), global_attributes(study, text, [this_run("made", 1, "")], ["here"])
        )

    return build
