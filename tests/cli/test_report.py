"""The command ``report``: one page that needs nothing else, and what a browser makes of it."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from html import unescape
from html.parser import HTMLParser

import pytest

from etc_engine.sweep.packing import first_packing
from etc_engine.sweep.result_file import open_dataset, write_dataset

STUDY = """
schema = 2
name = "made <for> a & report"
seed = 20263
[packing]
radii = "uniform:0.03:0.05"
box = [1.0, 1.0]
density = [0.55, 0.6, 0.65, 0.7]
[contacts]
rule = "bonded"
contact_angle = [5.0, 10.0]
[conduction]
method = ["chord", "standard"]
[statistics]
realizations = 4
"""
BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
VOID = {"meta", "img", "br"}


def below(density, angle, method, realization):
    if density == 0.7 and realization == 3:
        return None
    return 0.3 * (density - 0.5) * (1.0 + (angle or 5.0) / 10.0) * (1.0 + 0.05 * realization)


@pytest.fixture
def result(made_sweep, tmp_path):
    path = tmp_path / "out.nc"
    write_dataset(made_sweep(STUDY, below), path)
    return path


class Page(HTMLParser):
    """Tags that are opened and closed in order, sections, cells of tables, and what is fetched."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.sections: list[str] = []
        self.sources: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        if tag == "section":
            self.sections.append(values["id"])
        self.sources += [values[key] for key in ("src", "href") if key in values]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_the_report_shows_the_packing_of_its_first_realization(etc_engine, tmp_path):
    (tmp_path / "study.toml").write_text(STUDY.replace("[0.55, 0.6, 0.65, 0.7]", "0.7").replace("= 4", "= 1"))
    assert etc_engine("sweep", tmp_path / "study.toml", "-o", tmp_path / "out.nc").returncode == 0
    dataset = open_dataset(tmp_path / "out.nc")
    packing, density = first_packing(dataset)
    assert density == float(dataset["packing_density"][0, 0])
    assert packing.count == int(dataset["particles"][0, 0])
    done = etc_engine("report", tmp_path / "out.nc", "-o", tmp_path / "report.html")
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert 'alt="the packing of the first realization, made again from its random stream"' in text
    assert ">contact half-angle [degree]<" in text and ">5, 10<" in text


def test_the_page_holds_everything_itself(result, tmp_path, etc_engine):
    page = tmp_path / "report.html"
    done = etc_engine("report", result, "-o", page)
    assert (done.returncode, done.stderr) == (0, "")
    text = page.read_text(encoding="utf-8")
    parsed = Page(text)
    assert parsed.sections == [
        "bed",
        "conductivity",
        "statistics",
        "models",
        "sensitivity",
        "realizations",
        "size",
        "histograms",
        "failures",
        "cost",
        "provenance",
    ]
    pictures = [source for source in parsed.sources if source.startswith("data:image/png;base64,")]
    assert len(pictures) == 3
    assert all(source.startswith("#") for source in parsed.sources if source not in pictures)
    assert "<script" not in text
    assert "http" not in re.sub(r"data:[^\"]*", "", text)
    assert "made &lt;for&gt; a &amp; report" in text
    words = unescape(text)
    assert STUDY in words  # the study file as it was
    mean = 0.3 * 0.1 * 1.5 * 1.075  # density 0.6, 5 degrees
    assert f"<td>{mean:.5g}</td>" in words
    assert '<td class="text">packing_failed</td><td>4</td><td class="text">made to fail</td>' in words


def test_other_boxes_show_the_system_size(made_sweep, result, tmp_path, etc_engine):
    large, other = tmp_path / "large.nc", tmp_path / "other.nc"
    write_dataset(made_sweep(STUDY.replace("[1.0, 1.0]", "[2.0, 2.0]"), below), large)
    write_dataset(made_sweep(STUDY.replace("[5.0, 10.0]", "[5.0, 15.0]"), below), other)
    assert etc_engine("report", result, large, "-o", tmp_path / "report.html").returncode == 0
    assert (tmp_path / "report.html").read_text(encoding="utf-8").count("data:image/png") == 4
    refused = etc_engine("report", result, other, "-o", tmp_path / "other.html")
    assert refused.returncode == 2
    assert "result 2 belongs to another study: contacts is" in refused.stderr
    assert not (tmp_path / "other.html").exists()


def test_a_broken_bound_is_marked_and_told_by_the_exit_status(made_sweep, tmp_path, etc_engine):
    text = STUDY.replace('rule = "bonded"\ncontact_angle = [5.0, 10.0]', 'rule = "overlap"')
    write_dataset(made_sweep(text, lambda density, *_: 0.9 if density == 0.6 else 0.1), tmp_path / "out.nc")
    assert etc_engine("report", tmp_path / "out.nc", "-o", tmp_path / "report.html").returncode == 3
    assert (tmp_path / "report.html").read_text(encoding="utf-8").count('<tr class="broken">') == 2  # two methods


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["missing.nc", "-o", "report.html"], "cannot read missing.nc"),
        (["out.nc", "-o", "none/report.html"], "cannot write none/report.html"),
        (["out.nc"], "Missing option '-o'"),
        (["-o", "report.html"], "Missing argument"),
    ],
)
def test_refusals_are_one_line_and_leave_nothing(result, tmp_path, monkeypatch, etc_engine, arguments, words):
    monkeypatch.chdir(tmp_path)
    done = etc_engine("report", *arguments)
    assert (done.returncode, done.stdout) == (2, "")
    assert len(done.stderr.splitlines()) == 1
    assert words in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["out.nc"]


@pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine")
@pytest.mark.parametrize("width", [1280, 700, 420])
def test_a_browser_shows_every_picture_and_nothing_hangs_over(result, tmp_path, etc_engine, width):
    """A probe appended to a copy of the page says what the browser made of it."""
    page, probed = tmp_path / "report.html", tmp_path / "probed.html"
    assert etc_engine("report", result, "-o", page).returncode == 0
    probe = """<script>onload = () => { document.title = JSON.stringify({
        pictures: [...document.images].map(i => [i.complete, i.naturalWidth, i.getBoundingClientRect().width]),
        tables: [...document.querySelectorAll("table")].map(t => t.rows.length),
        frames: [...document.images].map(i => i.parentElement.getBoundingClientRect().width),
        width: innerWidth, scroll: document.documentElement.scrollWidth}) }</script>"""
    probed.write_text(page.read_text(encoding="utf-8").replace("</body>", probe + "</body>"), encoding="utf-8")
    line = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]
    line += [f"--user-data-dir={tmp_path / 'profile'}", f"--window-size={width},900", "--virtual-time-budget=5000"]
    done = subprocess.run(
        [*line, "--dump-dom", probed.as_uri()], capture_output=True, text=True, check=True, timeout=90
    )
    title = re.search(r"<title>(.*?)</title>", done.stdout, re.DOTALL)
    assert title is not None
    seen = json.loads(unescape(title.group(1)))
    assert len(seen["pictures"]) == 3
    for complete, natural, shown in seen["pictures"]:
        assert complete
        assert natural > 800
        if seen["width"] > 560:
            assert 300 < shown <= seen["width"]
        else:  # 130 dots an inch, letters of 7 points at least: they scroll in their frame
            assert 130 * shown / natural * 7 / 72 > 10.5
    assert max(seen["frames"]) <= seen["width"]
    assert seen["width"] <= max(width, 500)  # Chromium without a screen has no narrower window
    assert min(seen["tables"]) >= 2
    assert seen["scroll"] <= seen["width"]
