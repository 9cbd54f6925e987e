"""Voxel images of labelled phases: the same array from every kind of file, and its conductivity."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.durable import apart
from etc_engine.engines.voxel.images import homogenize_image
from etc_engine.errors import InputError
from etc_engine.particle_files.images import is_image, read_image

LABELS = np.random.default_rng(88).integers(0, 3, (4, 5, 6))


def test_every_kind_of_file_holds_the_same_voxels(tmp_path):
    np.save(tmp_path / "a.npy", LABELS.astype(np.uint8))
    LABELS.T.astype("<u2").tofile(tmp_path / "a.raw")  # x runs fastest
    found = [read_image(tmp_path / "a.npy"), read_image(tmp_path / "a.raw", (4, 5, 6), "uint16")]
    try:
        import tifffile
    except ImportError:
        tifffile = None
    if tifffile is not None:
        tifffile.imwrite(tmp_path / "a.tif", LABELS.T.astype(np.uint8), photometric="minisblack")
        found.append(read_image(tmp_path / "a.tif"))
        assert is_image(tmp_path / "a.tif")
    for image in found:
        np.testing.assert_array_equal(image.labels, LABELS)
        assert image.phases == (0, 1, 2)
        assert sum(image.fractions) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (np.zeros((4, 4)), "holds one phase only"),
        (np.arange(400.0).reshape(20, 20), "400 different values: label its phases first"),
        (np.array([[0.5, 1.0]]), "label the grey levels first"),
        (np.zeros((2, 2, 2, 2)), "two or three axes"),
        (np.array(["a"]), "whole numbers|NumPy|two or three"),
    ],
)
def test_images_refused_by_name(tmp_path, values, words):
    np.save(tmp_path / "a.npy", values)
    with pytest.raises(InputError, match=words):
        read_image(tmp_path / "a.npy")


def test_raw_files_need_their_shape(tmp_path):
    LABELS.astype(np.uint8).tofile(tmp_path / "a.raw")
    with pytest.raises(InputError, match="give its shape"):
        read_image(tmp_path / "a.raw")
    with pytest.raises(InputError, match="has 120 bytes, 4 x 5 x 7 voxels of uint8 need 140"):
        read_image(tmp_path / "a.raw", (4, 5, 7))
    with pytest.raises(InputError, match="there is no file"):
        read_image(tmp_path / "none.raw", (4, 5, 6))


def test_layers_are_exact():
    """Series across three layers of different phases, parallel along them."""
    labels = np.repeat(np.array([0, 1, 7]), [4, 2, 2])[:, None] * np.ones((1, 6), dtype=int)
    solution, error = homogenize_image(labels, {0: 1.0, 1: 4.0, 7: 10.0}, (2.0, 1.0))
    assert np.diag(solution.tensor) == pytest.approx([1 / (0.5 + 0.25 / 4 + 0.25 / 10), 0.5 + 1.0 + 2.5], rel=1e-8)
    assert error < 1e-6


def test_a_checkerboard_conducts_the_geometric_mean():
    """Dykhne 1970: sqrt(k1 k2), to the error that is estimated."""
    n = 32
    labels = np.kron(np.array([[0, 1], [1, 0]]), np.ones((n, n), dtype=int))
    solution, error = homogenize_image(labels, {0: 1.0, 1: 4.0}, (1.0, 1.0))
    assert abs(solution.tensor[0, 0] / 2.0 - 1.0) < 2.0 * error < 0.1


def test_insulators_are_checked_on_a_finer_grid():
    labels = np.zeros((16, 16), dtype=int)
    labels[4:12, 4:12] = 1
    solution, error = homogenize_image(labels, {0: 1.0, 1: 0.0}, (1.0, 1.0))
    finer, _ = homogenize_image(np.kron(labels, np.ones((4, 4), dtype=int)), {0: 1.0, 1: 0.0}, (1.0, 1.0))
    assert abs(solution.tensor[0, 0] / finer.tensor[0, 0] - 1.0) < 2.0 * error < 0.1


def test_phases_without_a_conductivity_are_named():
    with pytest.raises(InputError, match="labels 0, 3: the conductivity of 3 is missing"):
        homogenize_image(np.array([[0, 3]]), {0: 1.0}, (1.0, 1.0))
    with pytest.raises(InputError, match="label 3 is -1: give a number"):
        homogenize_image(np.array([[0, 3]]), {0: 1.0, 3: -1.0}, (1.0, 1.0))


def test_a_damaged_tiff_that_keeps_the_reader_busy_is_given_up(tmp_path, monkeypatch):
    """One flipped bit: the offset of the second page leads into the voxels, and the library does not come back."""
    tifffile = pytest.importorskip("tifffile", reason="needs the extra 'images'")
    path = tmp_path / "a.tif"
    values = (np.arange(4 * 8 * 8).reshape(4, 8, 8) % 3).astype(np.uint8)
    tifffile.imwrite(path, values, photometric="minisblack", metadata=None)
    content = bytearray(path.read_bytes())
    begin = int.from_bytes(content[4:8], "little")
    second = begin + 2 + 12 * int.from_bytes(content[begin : begin + 2], "little")
    content[second] ^= 0x20
    path.write_bytes(content)
    monkeypatch.setattr(apart, "SECONDS", 2.0)
    with pytest.raises(InputError, match="read as TIFF: the reading library did not finish within 2"):
        read_image(path)


@pytest.mark.parametrize("boundary", ["periodic", "walls"])
@pytest.mark.parametrize("shape", [(2, 2), (8, 8), (2, 2, 2), (4, 4, 4)])
def test_blocks_that_touch_in_corners_or_edges_alone_conduct_nothing(shape, boundary):
    """A checkerboard of a conductor and an insulator; the scheme alone gives .5 .. .1, falling with log h."""
    blocks = (np.indices(shape) // (shape[0] // 2)).sum(axis=0) % 2
    solution, error = homogenize_image(blocks, {0: 0.0, 1: 1.0}, (1.0,) * len(shape), boundary=boundary)
    assert np.diag(solution.tensor).tolist() == [0.0] * len(shape)
    assert error == 0.0


def test_an_axis_along_which_faces_join_keeps_its_conductivity():
    """A layer of half the height beside blocks that touch it in corners: 1/2 along x, 0 along y."""
    image = np.zeros((4, 4), dtype=int)
    image[:, :2] = 1
    image[0, 2] = 1
    solution, _ = homogenize_image(image, {0: 0.0, 1: 1.0}, (1.0, 1.0))
    assert 0.5 <= solution.tensor[0, 0] < 0.6
    assert solution.tensor[1, 1] == 0.0
    assert solution.tensor[0, 1] == 0.0
