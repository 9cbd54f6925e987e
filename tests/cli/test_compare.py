"""The command ``compare``: its table, figure, JSON object, exit statuses and refusals."""

from __future__ import annotations

import json
import struct
import subprocess
import sys

import pytest

from etc_engine.cli import run
from etc_engine.sweep.result_file import write_dataset

STUDY = """
schema = 2
name = "made"
seed = 20263
[packing]
radii = "uniform:0.03:0.05"
box = [1.0, 1.0]
density = [0.55, 0.6, 0.65, 0.7]
[contacts]
rule = "bonded"
contact_angle = [5.0, 10.0]
[statistics]
realizations = 3
"""
OVERLAP = STUDY.replace('rule = "bonded"\ncontact_angle = [5.0, 10.0]', 'rule = "overlap"')


def below(density, angle, method, realization):
    return 0.3 * (density - 0.5) * (1.0 + (angle or 5.0) / 10.0) * (1.0 + 0.05 * realization)


@pytest.fixture
def bonded(made_sweep, tmp_path):
    path = tmp_path / "bonded.nc"
    write_dataset(made_sweep(STUDY, below), path)
    return path


def png_size(path):
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    return struct.unpack(">II", data[16:24])


def test_table_of_every_cell_with_figure(bonded, tmp_path, capsys):
    figure = tmp_path / "figure.png"
    assert run(["compare", str(bonded), "-o", str(figure)]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    rows = [line.split() for line in out.splitlines() if line.split()[:1] in (["0.55"], ["0.6"], ["0.65"], ["0.7"])]
    assert [(row[0], row[1]) for row in rows] == [(d, a) for d in ("0.55", "0.6", "0.65", "0.7") for a in ("5", "10")]
    mean = 0.3 * 0.05 * 1.5 * 1.05  # first cell; its k are 1, 1.05 and 1.1 times the first
    half_width = 4.302652730 * 0.3 * 0.05 * 1.5 * 0.05 / 3**0.5  # Student's t of 2 degrees of freedom
    assert rows[0][2:7] == ["0.5500", "3", f"{mean:.4f}", "+-", f"{half_width:.4f}"]
    bound = 0.55 / 1.45
    assert rows[0][7:9] == [f"{bound:.4f}", f"{100 * (bound / mean - 1):+.1f}%"]
    assert "only a comparison here: the contacts are bonds" in out
    assert "0 because the pores insulate: hashin_shtrikman_lower, maxwell, differential" in out
    assert "fit of percolation_power_law (contact_angle 5), 4 densities: threshold 0.5" in out
    assert out.splitlines()[-1] == f"figure: {figure}"
    width, height = png_size(figure)
    assert width > 1000
    assert height > 700


def test_json_is_one_object_and_nothing_else(bonded, capsys):
    assert run(["compare", str(bonded), "--json"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    record = json.loads(out)
    assert len(record["cells"]) == 8
    assert record["figure"] is None
    assert (record["bounds_bind"], record["bound_broken"]) == (False, False)
    cell = record["cells"][-1]
    assert (cell["density"], cell["contact_angle"], cell["count"]) == (0.7, 10.0, 3)
    upper = cell["models"]["hashin_shtrikman_upper"]
    assert upper["conductivity"] == pytest.approx(0.7 / 1.3, rel=1e-14)
    assert upper["relative_difference"] == pytest.approx(0.7 / 1.3 / cell["conductivity_mean"] - 1.0, rel=1e-12)
    fit = next(f for f in record["fits"] if f["parameters"])
    assert {p["name"] for p in fit["parameters"]} == {"threshold", "exponent", "prefactor"}


def test_a_broken_bound_is_exit_status_3_for_overlapping_particles_only(made_sweep, tmp_path, capsys):
    def too_high(density, *_):
        return 0.9 if density == 0.65 else 0.1

    for text, status in ((OVERLAP, 3), (STUDY, 0)):
        path = tmp_path / f"{status}.nc"
        write_dataset(made_sweep(text, too_high), path)
        assert run(["compare", str(path)]) == status
        out, err = capsys.readouterr()
        row = next(line for line in out.splitlines() if line.split()[:1] == ["0.65"])
        assert "*0.4815" in row  # 0.65/1.35, the upper Hashin-Shtrikman bound
        assert out.count("*0.") == (1 if status == 3 else 2)  # once a contact angle
        assert ("bounds: they hold for overlapping particles, and are broken" in out) == (status == 3)
        told = "a rigorous bound is broken at density 0.65: 0.9 W/(m K) breaks hashin_shtrikman_upper = 0.481481"
        assert err.splitlines() == ([f"etc-engine: {told}"] if status == 3 else [])
        assert run(["compare", str(path), "--json"]) == status
        assert json.loads(capsys.readouterr().out)["bound_broken"] == (status == 3)


def test_a_real_sweep_is_compared(tmp_path, capsys):
    study, result, figure = tmp_path / "study.toml", tmp_path / "out.nc", tmp_path / "figure.svg"
    study.write_text(
        OVERLAP.replace("[0.55, 0.6, 0.65, 0.7]", "[0.85, 0.9]").replace("realizations = 3", "realizations = 2")
    )
    assert run(["sweep", str(study), "-o", str(result)]) == 0
    assert run(["compare", str(result), "-o", str(figure)]) == 0
    out = capsys.readouterr().out
    assert "no mean or realization breaks them" in out
    assert figure.read_text(encoding="utf-8").startswith("<?xml")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["missing.nc"], "cannot read missing.nc"),
        (["text.nc"], "cannot read text.nc"),
        (["other.nc"], "other.nc is not the result of a sweep"),
        (["half.nc"], "it has no count, status"),
        (["bonded.nc", "-o", "none/figure.png"], "cannot write none/figure.png"),
        (["bonded.nc", "-o", "figure.doc"], "a picture is written as .png"),
        (["bonded.nc", "-o", "figure"], "a picture is written as .png"),
        (["bonded.nc", "-o", "."], "a picture is written as .png"),
        ([], "Missing argument 'RESULT'"),
    ],
)
def test_refusals_are_one_line_and_leave_nothing(bonded, tmp_path, monkeypatch, capsys, arguments, words):
    import xarray

    (tmp_path / "text.nc").write_text("x,y,radius\n")
    xarray.Dataset({"a": ("x", [1.0])}).to_netcdf(tmp_path / "other.nc")
    with xarray.open_dataset(bonded) as data:
        data.drop_vars(["status", "count"]).assign_attrs(checksum="").to_netcdf(tmp_path / "half.nc")
    before = sorted(path.name for path in tmp_path.iterdir())
    monkeypatch.chdir(tmp_path)
    assert run(["compare", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert len(err.splitlines()) == 1, err
    assert words in err
    assert sorted(path.name for path in tmp_path.iterdir()) == before


def test_without_matplotlib_the_table_is_there_and_a_figure_is_refused(bonded):
    """None in the module table makes an import fail as if the package were not installed."""
    code = "import sys; sys.modules['matplotlib'] = None; from etc_engine.cli import main; main()"

    def compare(*arguments):
        line = [sys.executable, "-c", code, "compare", str(bonded), *arguments]
        return subprocess.run(line, capture_output=True, text=True, check=False, timeout=60)

    assert compare().returncode == 0
    refused = compare("-o", "figure.png")
    assert refused.returncode == 2
    assert len(refused.stderr.splitlines()) == 1
    assert "pictures need matplotlib" in refused.stderr


@pytest.mark.parametrize("place", [600, 6000, 12000, 20000])
def test_a_damaged_result_is_one_line(etc_engine, tmp_path, bonded, place):
    path = tmp_path / "bad.nc"
    data = bytearray(bonded.read_bytes())
    data[place : place + 4000] = b"\xff" * len(data[place : place + 4000])
    path.write_bytes(data)
    for command in ("compare", "info"):
        done = etc_engine(command, path)
        assert done.returncode in (0, 2)  # what was overwritten may be padding
        assert "unexpected" not in done.stderr


def test_compare_and_report_never_replace_their_input(etc_engine, tmp_path):
    path = tmp_path / "out.png"
    path.write_bytes(b"x")
    for command in ("compare", "report"):
        done = etc_engine(command, path, "-o", path)
        assert done.returncode == 2
        assert "is the input itself" in done.stderr


@pytest.mark.parametrize("words", [("compare",), ("report", "-o", "r.html"), ("export", "--to", "csv")])
def test_a_table_of_text_is_no_result(etc_engine, tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "two.csv").write_text("x,y\n1,2\n")
    done = etc_engine(words[0], "two.csv", *words[1:])
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "two.csv: it is no netCDF file; expected a result of this engine" in done.stderr
