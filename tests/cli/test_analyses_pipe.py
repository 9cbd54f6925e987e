"""The studies of the pipe network, in small."""

from __future__ import annotations

import csv
import subprocess
import sys
from pathlib import Path

import pytest

STUDIES = Path(__file__).parents[2] / "studies"


def analyse(name: str, *arguments: object) -> str:
    line = [sys.executable, "-W", "error", str(STUDIES / name / "analyse.py"), *map(str, arguments)]
    done = subprocess.run(line, capture_output=True, text=True, check=False, timeout=200)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
def test_feng2009(tmp_path):
    printed = analyse("feng2009", "--realizations", 1, "--output", tmp_path)
    assert "pipe, uniform   12 unknowns  k = 0.263778" in printed
    assert "pipe, chord     12 unknowns  k = 0.274327" in printed
    assert (tmp_path / "errors.png").stat().st_size > 10_000
    with (tmp_path / "random.csv").open() as file:
        rows = {(r["density"], r["half_angle_degree"], r["method"]): r for r in csv.DictReader(file)}
    with (STUDIES / "feng2009" / "random.csv").open() as file:
        kept = {(r["density"], r["half_angle_degree"], r["method"]): r for r in csv.DictReader(file)}
    assert rows.keys() == kept.keys()
    for key, row in rows.items():  # the first realization is one of those of the table
        assert float(kept[key]["error_min"]) <= float(row["error_mean_percent"]) <= float(kept[key]["error_max"])


@pytest.mark.slow
def test_diffusivity(tmp_path):
    analyse("diffusivity", "--largest", 64, "--disks", 800, "--output", tmp_path)
    assert (tmp_path / "figure.png").stat().st_size > 10_000
    with (tmp_path / "table.csv").open() as file:
        small, larger = csv.DictReader(file)
    assert abs(float(larger["difference_percent"])) < 0.7 * abs(float(small["difference_percent"]))
