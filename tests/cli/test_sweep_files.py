"""Sweeps over packings in files: each file or frame is a realization."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray

PACK = ("pack", "--method", "random-sequential", "--radii", "equal:0.06", "--box", "1,1", "--periodic", "xy")
STUDY = """
schema = 2
name = "own beds"
seed = 5
[packing]
files = "beds/*.dump"
{packing}
[particles]
{particles}
[contacts]
rule = "bonded"
contact_angle = [5.0, 10.0]
bond_gap = {gap}
[statistics]
{statistics}
"""


@pytest.fixture
def beds(etc_engine, tmp_path):
    (tmp_path / "beds").mkdir()
    for seed in (11, 12, 13):
        path = tmp_path / "beds" / f"bed{seed}.dump"
        assert etc_engine(*PACK, "--density", 0.45, "--seed", seed, "-o", path).returncode == 0

    def write(packing: str = "", particles: str = "", statistics: str = "", gap: float = 1.0):
        path = tmp_path / "study.toml"
        path.write_text(STUDY.format(packing=packing, particles=particles, statistics=statistics, gap=gap))
        return path

    return write


def test_every_file_is_a_realization_with_the_conductivity_of_solve(etc_engine, beds, tmp_path):
    out = tmp_path / "out.nc"
    done = etc_engine("sweep", beds(), "-o", out)
    assert done.returncode == 0, done.stderr
    with xarray.open_dataset(out) as data:
        assert data["file"].values.tolist() == [f"beds/bed{seed}.dump" for seed in (11, 12, 13)]
        assert data["frame"].values.tolist() == [0, 0, 0]
        found = data["conductivity"].sel(contact_angle=5.0, direction_i="x", direction_j="x").values.ravel()
        np.testing.assert_allclose(data["packing_density"].values, 0.45, atol=0.02)
    words = ("--contact-angle", 5, "--bond-gap", 1.0, "--json")
    for k, seed in enumerate((11, 12, 13)):
        alone = json.loads(etc_engine("solve", tmp_path / "beds" / f"bed{seed}.dump", *words).stdout)
        assert found[k] == pytest.approx(alone["conductivity"], rel=1e-6)
    assert etc_engine("info", out).returncode == 0
    again = etc_engine("rerun", out, "--realization", 1)
    assert again.returncode == 0, again.stdout + again.stderr


def test_a_dry_run_lists_the_packings(etc_engine, beds, tmp_path):
    done = etc_engine("sweep", beds(statistics="realizations = 2"), "-o", tmp_path / "out.nc", "--dry-run")
    assert done.returncode == 0, done.stderr
    lines = [line.split(maxsplit=1)[1] for line in done.stdout.splitlines() if line.startswith("packing ")]
    assert lines == ["beds/bed11.dump, frame 0", "beds/bed12.dump, frame 0"]
    assert not (tmp_path / "out.nc").exists()


def test_resume_knows_files_by_their_content(etc_engine, beds, tmp_path):
    out = tmp_path / "out.nc"
    assert etc_engine("sweep", beds(), "-o", out).returncode == 0
    assert etc_engine("sweep", beds(), "-o", out, "--resume").returncode == 0
    (tmp_path / "beds" / "bed12.dump").write_bytes((tmp_path / "beds" / "bed13.dump").read_bytes())
    done = etc_engine("sweep", beds(), "-o", out, "--resume")
    assert done.returncode == 2
    assert "belongs to another study (packing.sources.1.sha256 is" in done.stderr


def test_a_crop_is_a_part_of_every_packing(etc_engine, beds, tmp_path):
    out = tmp_path / "out.nc"
    done = etc_engine("sweep", beds(packing='crop = ["", "0.2:0.8"]'), "-o", out)
    assert done.returncode == 0, done.stderr
    with xarray.open_dataset(out) as data:
        resolved = json.loads(data.attrs["study_resolved"])["packing"]
        assert resolved["box"] == [1.0, 0.6000000000000001]
        assert resolved["periodic"] == "x"
        k = float(
            data["conductivity"].sel(contact_angle=5.0, direction_i="x", direction_j="x", realization=0).squeeze()
        )
    words = ("--crop", ",0.2:0.8", "--contact-angle", 5, "--bond-gap", 1.0, "--json")
    alone = json.loads(etc_engine("solve", tmp_path / "beds" / "bed11.dump", *words).stdout)
    assert k == pytest.approx(alone["conductivity"], rel=1e-6)


def test_conductivities_by_type(etc_engine, beds, tmp_path):
    for seed in (11, 12, 13):
        path = tmp_path / "beds" / f"bed{seed}.dump"
        lines = path.read_text().splitlines()
        rows = [
            " ".join([w[0], "2" if k % 2 else "1", *w[2:]]) for k, w in enumerate(line.split() for line in lines[9:])
        ]
        path.write_text("\n".join([*lines[:9], *rows, ""]))
    values = {}
    for name, types in (("one", "1 = 2.0, 2 = 2.0"), ("two", "1 = 2.0, 2 = 4.0")):
        out = tmp_path / f"{name}.nc"
        done = etc_engine("sweep", beds(particles=f"types = {{ {types} }}"), "-o", out)
        assert done.returncode == 0, done.stderr
        with xarray.open_dataset(out) as data:
            values[name] = data["conductivity"].sel(direction_i="x", direction_j="x").values
    assert etc_engine("sweep", beds(particles="conductivity = 2.0"), "-o", tmp_path / "plain.nc").returncode == 0
    with xarray.open_dataset(tmp_path / "plain.nc") as data:
        plain = data["conductivity"].sel(direction_i="x", direction_j="x").values
    np.testing.assert_allclose(values["one"], plain, rtol=1e-12)
    assert (values["two"] > values["one"]).all()
    assert (values["two"] < 2.0 * values["one"]).all()
    missing = etc_engine("sweep", beds(particles="types = { 1 = 2.0 }"), "-o", tmp_path / "bad.nc")
    assert missing.returncode == 4
    assert "the conductivity of 2 is missing" in missing.stderr


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"packing": 'frames = "first"'}, "frames takes 'last', 'all'"),
        ({"packing": "frames = [3]"}, "there is no frame 3"),
        ({"packing": 'crop = ["1"]'}, "crop takes ranges"),
        ({"packing": 'crop = ["0:0.5"]'}, "a crop of a 2D box needs 2 ranges"),
        ({"packing": 'radii = "equal:1"'}, "packing.radii"),
        ({"statistics": "realizations = 4"}, "the files hold 3 packings"),
        ({"statistics": "realizations = 2\nrelative_ci = 0.1"}, "relative_ci"),
        ({"particles": "types = { 1 = 2.0 }\nconductivity = 3.0"}, "particles.conductivity: has no effect"),
        ({"particles": 'types = { 1 = "unobtainium" }'}, "unobtainium"),
    ],
)
def test_studies_refused_by_name(etc_engine, beds, tmp_path, words, said):
    done = etc_engine("sweep", beds(**words), "-o", tmp_path / "out.nc")
    assert done.returncode == 2
    assert said in done.stderr
    assert done.stderr.count("\n") == 1


def test_no_files_and_no_folder_are_named(etc_engine, beds, tmp_path):
    from etc_engine.errors import StudyError
    from etc_engine.study.sweep import parse_study

    study = beds()
    text = study.read_text()
    study.write_text(text.replace("beds/*", "none/*"))
    assert "no file matches 'none/*.dump'" in etc_engine("sweep", study, "-o", tmp_path / "out.nc").stderr
    with pytest.raises(StudyError, match="packings in files are read by the command sweep"):
        parse_study(text)


def test_a_sweep_says_what_its_files_do_not_decide(etc_engine, beds, tmp_path):
    """Bonds up to a gap that some pairs have to the printed digit."""
    for seed in (11, 12, 13):
        path = tmp_path / "beds" / f"bed{seed}.dump"
        lines = path.read_text().splitlines()
        rows = [" ".join([*line.split()[:2], *(f"{float(x):.3g}" for x in line.split()[2:])]) for line in lines[9:]]
        path.write_text("\n".join([*lines[:9], *rows, ""]))
    done = etc_engine("sweep", beds(), "-o", tmp_path / "out.nc")
    assert done.returncode == 0, done.stderr
    assert "beds/bed11.dump: the file prints too few digits" in done.stderr
    assert "taken for disks" in done.stderr
