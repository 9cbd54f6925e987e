"""``homogenize`` on voxel images of labelled phases."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray


@pytest.fixture
def layers(tmp_path):
    """Three phases in layers across x."""
    labels = np.repeat(np.array([0, 1, 7], dtype=np.uint8), [4, 2, 2])[:, None, None] * np.ones(
        (1, 3, 5), dtype=np.uint8
    )
    np.save(tmp_path / "a.npy", labels)
    labels.T.tofile(tmp_path / "a.raw")
    return tmp_path


EXACT = [1 / (0.5 + 0.25 / 4 + 0.25 / 10), 4.0, 4.0]
PHASES = ("--phases", "0=1,1=4,7=10")


@pytest.mark.parametrize("words", [("a.npy",), ("a.raw", "--shape", "8,3,5")])
def test_layers_of_three_phases_are_exact(etc_engine, layers, words):
    done = etc_engine("homogenize", layers / words[0], *words[1:], *PHASES, "-o", layers / "h.nc", "--json")
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    assert np.diag(record["conductivity_tensor"]) == pytest.approx(EXACT, rel=1e-8)
    assert record["fractions"] == {"0": 0.5, "1": 0.25, "7": 0.25}
    assert record["relative_error_estimate"] < 1e-6
    with xarray.open_dataset(layers / "h.nc") as data:
        assert data["phase_conductivity"].sel(phase=7) == 10.0
        assert float(data["effective_conductivity"].sel(direction_i="x", direction_j="x")) == pytest.approx(EXACT[0])
    assert json.loads(etc_engine("info", layers / "h.nc", "--json").stdout)["kind"] == "homogenization"


def test_two_phases_by_matrix_and_inclusion(etc_engine, tmp_path):
    labels = np.kron(np.array([[0, 255], [255, 0]], dtype=np.uint8), np.ones((16, 16), dtype=np.uint8))
    np.save(tmp_path / "a.npy", labels)
    done = etc_engine("homogenize", tmp_path / "a.npy", "--matrix", 1, "--inclusion", 4, "--json")
    record = json.loads(done.stdout)
    k = record["conductivity_tensor"][0][0]
    assert abs(k / 2.0 - 1.0) < 2.0 * record["relative_error_estimate"]  # Dykhne: sqrt(1 x 4)
    low, high = record["conductivity_bounds"]
    assert low < k < high


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), "the image has the labels 0, 1, 7: give the conductivity of each, such as --phases 0=1,1=1,7=1"),
        (("--phases", "0=1,1=2"), "the conductivity of 7 is missing"),
        (("--phases", "0=1"), "the conductivity of 1, 7 is missing"),
        (("--phases", "0=1,1=2,7=3,8=1,12=5"), "the labels 0, 1, 7, but conductivities are given for 8, 12 too"),
        (("--phases", "0=1,1=2,7=nan"), "the conductivity of label 7 is nan: give a number"),
        (("--phases", "0=1,1=2,7=1e300"), "from 1e-100 to 1e+100"),
        (("--phases", "0:1"), "LABEL=CONDUCTIVITY"),
        ((*PHASES, "--matrix", 1), "give one of them"),
        ((*PHASES, "--engine", "lattice"), "solved by --engine voxel"),
        ((*PHASES, "--resolution", 32), "--resolution is not valid with a voxel image"),
        ((*PHASES, "--box", "1,1"), "--box needs 3 edge lengths"),
        ((*PHASES, "--box", "1e300,1,1e-300"), "1e+12 times the shortest"),
        ((*PHASES, "--shape", "a,b"), "two or three numbers of voxels"),
    ],
)
def test_words_that_do_not_fit_are_refused(etc_engine, layers, options, words):
    done = etc_engine("homogenize", layers / "a.npy", *options)
    assert done.returncode == 2
    assert words in done.stderr
    assert done.stderr.count("\n") == 1


def test_phases_are_for_images(etc_engine, tmp_path):
    (tmp_path / "a.csv").write_text("x,y,radius\n0.5,0.5,0.2\n")
    done = etc_engine("homogenize", tmp_path / "a.csv", "--box", "1,1", *PHASES)
    assert "--phases is only valid with voxel images" in done.stderr
    assert "--matrix is missing" in etc_engine("homogenize", tmp_path / "a.csv", "--box", "1,1").stderr


def test_a_flat_cell_reaches_its_limit(etc_engine, tmp_path):
    """Beyond some flatness the conductivity does not depend on it."""
    labels = np.zeros((8, 8), dtype=np.uint8)
    labels[2:6, 3:5] = 1
    np.save(tmp_path / "a.npy", labels)
    found = [
        json.loads(
            etc_engine("homogenize", tmp_path / "a.npy", "--phases", "0=1,1=2", "--box", f"{r},1", "--json").stdout
        )["conductivity_tensor"][0][0]
        for r in ("1e6", "1e9", "1e12")
    ]
    assert found == pytest.approx([found[0]] * 3, rel=1e-7)
