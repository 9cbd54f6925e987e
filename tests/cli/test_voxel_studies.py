"""The analyses of the studies that use voxels, each made small."""

from __future__ import annotations

import csv
import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

STUDIES = Path(__file__).parents[2] / "studies"


def analyse(name: str, *arguments: object) -> str:
    """What the analysis prints; it runs alone, with warnings as errors."""
    line = [sys.executable, "-W", "error", str(STUDIES / name / "analyse.py"), *map(str, arguments)]
    environment = os.environ | {"PYTHONPATH": str(STUDIES.parent)}
    done = subprocess.run(line, capture_output=True, text=True, check=False, timeout=200, env=environment)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_voxels_overestimate_a_body_of_overlapping_disks_and_chord_does_not(tmp_path):
    printed = analyse("dtem_fft", "--largest", 96, "--output", tmp_path)
    with (tmp_path / "table.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 12
    assert all(float(row["error"]) > 0.03 for row in rows)
    square = [float(r["error"]) for r in rows if r["geometry"] == "square" and r["voxels"] == "laminate"]
    assert square[0] > square[1] > square[2]
    chord, exact = (float(re.search(rf"{name} +(\d\.\d+)", printed)[1]) for name in ("chord", "exact"))
    assert abs(chord / exact - 1.0) < 2e-3
    assert (tmp_path / "figure.png").stat().st_size > 10_000


@pytest.mark.parametrize("kind", ["disks", "spheres"])
def test_a_small_sweep_of_random_composites_keeps_the_three_point_bounds(etc_engine, tmp_path, kind):
    text = (STUDIES / "random_composites" / f"{kind}.toml").read_text()
    for pattern, replacement in (
        (r"(?m)^count = .*", "count = 20"),
        (r"density = .*", "density = [0.1, 0.3]"),
        (r"conductivity = \[.*", "conductivity = [0.1, 10.0]"),
        (r"resolution = .*", f"resolution = {96 if kind == 'disks' else 24}"),
        (r"realizations = .*", "realizations = 3"),
    ):
        text, count = re.subn(pattern, replacement, text)
        assert count == 1, pattern
    study, out = tmp_path / "study.toml", tmp_path / "out.nc"
    study.write_text(text)
    assert etc_engine("sweep", study, "-o", out).returncode == 0
    printed = analyse("random_composites", out, out, tmp_path / "figure.png")
    assert f"{kind}: 4 of 4 means between the three-point bounds" in printed
    assert (tmp_path / "figure.png").stat().st_size > 10_000


def test_fft_and_lattice_agree_on_a_small_cell_of_epoxy_and_silica(monkeypatch, tmp_path):
    spec = importlib.util.spec_from_file_location("epoxy_silica_analyse", STUDIES / "epoxy_silica" / "analyse.py")
    study = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(study)
    monkeypatch.setattr(study, "FRACTIONS", (0.1,))
    data = study.extrapolate(study.sweep(1, 1, 52, 4000), 1)
    assert float(abs(data["lattice"] / data["voxel"] - 1.0).max()) < 0.02
    study.save(study.draw(data), tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 10_000
    rows = study.compare_points(32, 6000)
    assert [row["point"] for row in rows] == list(study.POINTS)
    assert all(abs(row["temperature_fft"] - row["temperature_lattice"]) < 0.2 for row in rows)
