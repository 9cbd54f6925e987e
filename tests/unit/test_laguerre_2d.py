"""Laguerre cells of disks: area, neighbours, walls, degenerate vertices, refusals."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.errors import GeometryError
from etc_engine.structure.laguerre_2d import laguerre_cells


def areas(cells):
    """Shoelace area of each cell."""
    out = []
    for a, b in zip(cells.starts[:-1], cells.starts[1:], strict=True):
        x, y = cells.corners[a:b].T
        out.append(0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    return np.array(out)


def random_disks(seed, side, ratio=3.0):
    """Disks of unlike radii near the sites of a square lattice, none overlapping."""
    rng = np.random.default_rng(seed)
    sites = (np.mgrid[:side, :side].reshape(2, -1).T + 0.5 + rng.uniform(-0.25, 0.25, (side * side, 2))) / side
    return sites, 0.25 * rng.uniform(1.0, ratio, side * side) / side / ratio


@pytest.mark.parametrize("periodic", [(True, True), (False, True), (False, False)])
def test_cells_fill_the_box_and_hold_the_points_of_least_power(periodic):
    box = Box((1.0, 0.8), periodic)
    centers, radii = random_disks(7, 8)
    centers = centers * box.lengths
    cells = laguerre_cells(centers, radii, box)
    area = areas(cells)
    assert area.sum() == pytest.approx(box.volume, rel=1e-12)
    points = np.random.default_rng(8).random((20000, 2)) * box.lengths
    apart = box.minimum_image(points[:, None] - centers)
    owner = np.argmin((apart**2).sum(axis=-1) - radii**2, axis=1)
    share = np.bincount(owner, minlength=64) / 20000 * box.volume
    assert np.abs(share - area).max() < 5.0 * np.sqrt(area.max() / 20000)


def test_sides_of_an_edge_agree_and_vertices_close_the_map():
    box = Box((1.0, 1.0), (True, True))
    centers, radii = random_disks(9, 17)
    cells = laguerre_cells(centers, radii, box)
    assert np.array_equal(np.bincount(cells.edges), np.full(cells.edge_count, 2))
    assert cells.vertex_count - cells.edge_count + 17 * 17 == 0  # Euler, torus
    back = cells.corners[~cells.forward]
    ahead = np.flatnonzero(cells.forward)
    where = centers[np.searchsorted(cells.starts, ahead, side="right") - 1] + cells.corners[ahead]
    assert back.shape == where.shape
    lengths = cells.ends[:, 1] - cells.ends[:, 0]
    assert (lengths > 0.0).all()
    i, j = cells.cells.T
    branch = centers[j] + cells.shifts * np.asarray(box.lengths) - centers[i]
    power = (cells.distances[:, 0] ** 2 - radii[i] ** 2) - (cells.distances[:, 1] ** 2 - radii[j] ** 2)
    assert np.abs(power).max() < 1e-13
    assert np.allclose(cells.distances.sum(axis=1), np.linalg.norm(branch, axis=1), rtol=1e-13)


def test_square_lattice_merges_its_fourfold_vertices():
    k = 6
    centers = (np.mgrid[:k, :k].reshape(2, -1).T + 0.5) / k
    cells = laguerre_cells(centers, np.full(k * k, 0.5 / k), Box((1.0, 1.0), (True, True)))
    assert (cells.edge_count, cells.vertex_count) == (2 * k * k, k * k)
    walled = laguerre_cells(centers, np.full(k * k, 0.5 / k), Box((1.0, 1.0)))
    assert (walled.edge_count, walled.vertex_count) == (2 * k * (k + 1), (k + 1) ** 2)
    assert int(walled.at_wall.sum()) == 4 * k


def test_one_disk_meets_its_own_images():
    cells = laguerre_cells(np.array([[0.1, 0.9]]), np.array([0.3]), Box((1.0, 2.0), (True, True)))
    assert (cells.edge_count, cells.vertex_count) == (2, 1)
    assert sorted(cells.distances[:, 0].tolist()) == [0.5, 1.0]


def test_cells_do_not_depend_on_the_order_or_the_origin():
    box = Box((1.0, 1.0), (True, True))
    centers, radii = random_disks(11, 9)
    order = np.random.default_rng(1).permutation(81)
    moved = laguerre_cells(box.wrap(centers[order] + 0.37), radii[order], box)
    assert np.allclose(areas(moved), areas(laguerre_cells(centers, radii, box))[order], rtol=1e-10)


@pytest.mark.parametrize(
    ("centers", "radii", "message"),
    [
        ([[0.5, 0.5], [0.5, 0.5]], [0.1, 0.1], "particles 0 and 1 have the same centre"),
        ([[0.5, 0.5], [0.52, 0.5]], [0.3, 0.05], "particle 1 .* has no Laguerre cell"),
        ([[0.5, 0.5], [0.72, 0.5]], [0.25, 0.1], "the centre of particle 1 .* outside its own Laguerre cell"),
        ([[0.0, 0.5], [0.5, 0.5]], [0.1, 0.1], "the centre of particle 0 lies on a wall"),
    ],
)
def test_what_has_no_cell_of_its_own_is_refused_by_name(centers, radii, message):
    with pytest.raises(GeometryError, match=message):
        laguerre_cells(np.array(centers), np.array(radii), Box((1.0, 1.0)))


def test_a_sphere_box_is_refused():
    with pytest.raises(GeometryError, match="two-dimensional"):
        laguerre_cells(np.array([[0.5, 0.5]]), np.array([0.1]), Box((1.0, 1.0, 1.0)))
