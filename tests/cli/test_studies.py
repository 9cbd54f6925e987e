"""The study files are valid, and what studies/README.md says about joining results works."""

from __future__ import annotations

import importlib.util
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
import xarray

from etc_engine.study.sweep import read_study
from etc_engine.study.transient import parse_study as parse_network_study

ROOT = Path(__file__).parents[2]
STAND_IN = ROOT / "tests" / "stand_in.py"
STUDY = """
schema = 2
name = "joined"
seed = {seed}
[packing]
radii = "uniform:0.01:0.02"
box = [1.0, 1.0]
density = {density}
[contacts]
rule = "bonded"
contact_angle = [2.5, 5.0]
[statistics]
realizations = {realizations}
"""


FILES = sorted(ROOT.glob("studies/*/*.toml"))
SWEEPS = [path for path in FILES if "\nkind = " not in path.read_text()]
NETWORKS = [path for path in FILES if '\nkind = "network"' in path.read_text()]
"""The others are meshless, see test_transient.py."""


@pytest.mark.parametrize("path", SWEEPS, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_a_study_file_is_valid(path):
    study, _ = read_study(path)
    assert study.resolved()["schema"] == 2


@pytest.mark.parametrize("path", NETWORKS, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_a_transient_study_file_is_valid(path):
    assert parse_network_study(tomllib.loads(path.read_text())).name.startswith(path.parent.name)


@pytest.fixture
def sweep(tmp_path):
    spec = importlib.util.spec_from_file_location("stand_in", STAND_IN)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)

    def call(name: str, **values: object) -> None:
        study = tmp_path / f"{name}.toml"
        study.write_text(STUDY.format(**values))
        assert module.main([str(study), "-o", str(tmp_path / f"{name}.nc")]) == 0

    return call


def code_block(marker: str) -> str:
    text = (ROOT / "studies" / "README.md").read_text()
    return re.search(rf"<!-- {marker} -->\n```python\n(.*?)```", text, re.S)[1]


def test_more_densities(sweep, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    sweep("a", seed=61, density=[0.6, 0.7], realizations=3)
    sweep("b", seed=61, density=[0.65], realizations=3)
    sweep("all", seed=61, density=[0.6, 0.65, 0.7], realizations=3)
    exec(code_block("more densities"), {})
    with xarray.open_dataset("whole.nc") as joined, xarray.open_dataset("all.nc") as at_once:
        for name in joined.data_vars:
            np.testing.assert_array_equal(joined[name].values, at_once[name].values)


def test_more_realizations(sweep, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    sweep("a", seed=61, density=[0.6, 0.7], realizations=3)
    sweep("c", seed=67, density=[0.6, 0.7], realizations=4)
    exec(code_block("more realizations"), {})
    with xarray.open_dataset("more.nc") as joined:
        assert joined.sizes["realization"] == 7
        assert (joined["count"] == 7).all()
        kxx = joined["conductivity"].sel(direction_i="x", direction_j="x")
        mean = joined["conductivity_mean"].sel(direction_i="x", direction_j="x")
        np.testing.assert_allclose(mean.values, kxx.values.mean(axis=2), rtol=1e-14)
