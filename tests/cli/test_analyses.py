"""The analyses of the studies, each on a small real sweep of its own study file."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from etc_engine.sweep.result_file import write_dataset

STUDIES = Path(__file__).parents[2] / "studies"
# for each study: the text that makes it small, and words that its analysis prints
SMALL = {
    "density_angle": (
        {
            r"density = \[.*?\]": "density = [0.6, 0.65, 0.7]",
            "0.015:0.03": "0.03:0.05",
            "realizations = 8": "realizations = 4",
        },
        r"0\.700    4 +0\.\d{4} +\d\.\d\d %",
    ),
    "contact_angle_curve": (
        {"0.015:0.025": "0.03:0.05", "density = 0.75": "density = 0.7", "realizations = 8": "realizations = 2"},
        r"c\(arc\) - c\(standard\): -0\.11\d\d found, -0\.1137 expected",
    ),
    "percolation": (
        {
            "0.002:0.004": "0.01:0.02",
            r"density = \[.*?\]": "density = [0.6, 0.64, 0.68, 0.72, 0.75]",
            "realizations = 8": "realizations = 4",
        },
        r"exponent \d\.\d+ \+- \d+\.\d+ \(95 %\)",
    ),
    "sintering": (
        {
            "0.01:0.02": "0.03:0.05",
            r"density = \[.*?\]": "density = [0.82, 0.9, 1.0]",
            "realizations = 20": "realizations = 3",
        },
        r"every mean keeps the bound: True",
    ),
}


def analyse(name: str, *arguments: object) -> str:
    """What the analysis prints; it runs alone, with warnings as errors."""
    line = [sys.executable, "-W", "error", str(STUDIES / name / "analyse.py"), *map(str, arguments)]
    done = subprocess.run(line, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout


def smaller(name: str, changes: dict[str, str]) -> str:
    text = (STUDIES / name / "study.toml").read_text()
    for pattern, replacement in changes.items():
        text, count = re.subn(pattern, replacement, text)
        assert count == 1, pattern
    return text


@pytest.mark.parametrize("name", SMALL)
def test_an_analysis_reads_the_result_of_its_study(name, tmp_path, etc_engine):
    changes, words = SMALL[name]
    study, result, figure = tmp_path / "study.toml", tmp_path / "out.nc", tmp_path / "figure.png"
    study.write_text(smaller(name, changes))
    assert etc_engine("sweep", study, "-o", result).returncode in (0, 4)  # small packings may miss a density
    assert re.search(words, analyse(name, result, figure))
    assert figure.stat().st_size > 10_000


def test_the_mixture_is_read_over_its_fractions(tmp_path, etc_engine):
    text = smaller("mixture", {"0.01:0.02": "0.03:0.05", "realizations = 10": "realizations = 2"})
    study, result = tmp_path / "study.toml", tmp_path / "out.nc"
    study.write_text(re.sub(r"fraction = \[.*?\]", "fraction = [0.0, 0.5, 1.0]", text))
    assert etc_engine("sweep", study, "-o", result).returncode == 0
    printed = analyse("mixture", result, tmp_path / "figure.png")
    assert re.search(r"1\.00 +20\.0000 \+- 0\.0000 +20\.0000 \+- 0\.0000 +20\.0000", printed)


def test_analyses_import_nothing_of_the_engine_but_its_figures_and_the_names_of_models():
    for name in (*SMALL, "mixture"):
        imported = re.findall(r"(?:from|import) (etc_engine[\w.]*)", (STUDIES / name / "analyse.py").read_text())
        assert set(imported) <= {"etc_engine.output.figures.canvas", "etc_engine.models"}


def test_the_tutorial_draws_a_figure(made_sweep, tmp_path):
    text = re.sub(r"density = \[.*?\]", "density = [0.6, 0.7]", (STUDIES / "density_angle" / "study.toml").read_text())
    write_dataset(made_sweep(text, lambda f, a, _, r: (f - 0.5) * (a["contact_angle"] + r)), tmp_path / "out.nc")
    block = re.search(r"<!-- own figure -->\n```python\n(.*?)```", (STUDIES / "README.md").read_text(), re.S)
    line = [sys.executable, "-W", "error", "-c", block[1]]
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    done = subprocess.run(line, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "own.png").stat().st_size > 10_000
