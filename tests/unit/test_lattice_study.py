"""The scripts of studies/haddad2021 run, at sizes of a few seconds, and draw what they say."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

STUDY = Path(__file__).parents[2] / "studies" / "haddad2021"
# script: arguments, words that it prints, files that it writes
SMALL = {
    "calibration": (["--largest", "1000", "--realizations", "2"], r"1000  mirror 0\.[78]\d+", ["calibration"]),
    "transient": (["--largest", "500"], r"Laguerre: largest error \d\.\d+ %", ["slab", "ball"]),
    "halo": (["--particles", "1500"], r"no halo: largest deviation \d\.\de-1[0-9]", ["halo"]),
    "inclusion": (["--particles", "1000", "--contact", "1000"], r"C: T 33\.[45]\d+", ["inclusion"]),
    "composite": (["--particles", "1000", "--fractions", "0.05,0.1"], r"f = 0\.1: 41 spheres", ["composite"]),
}


@pytest.mark.parametrize("name", SMALL)
def test_a_script_runs(name, tmp_path):
    arguments, words, pictures = SMALL[name]
    line = [sys.executable, "-W", "error", str(STUDY / f"{name}.py"), *arguments, "--output", str(tmp_path)]
    done = subprocess.run(line, capture_output=True, text=True, check=False, timeout=200)
    assert done.returncode == 0, done.stderr
    assert re.search(words, done.stdout), done.stdout
    for picture in pictures:
        assert (tmp_path / f"{picture}.png").stat().st_size > 10_000
        table = (tmp_path / f"{picture}.csv").read_text().splitlines()
        assert len({row.count(",") for row in table}) == 1
        assert len(table) > 1


def test_every_script_is_tried():
    assert {path.stem for path in STUDY.glob("*.py")} == set(SMALL)
