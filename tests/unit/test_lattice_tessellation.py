"""The Laguerre tessellation against an independent construction, exact identities and degenerate seeds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from etc_engine.box import Box
from etc_engine.errors import GeometryError
from etc_engine.packing.particles import ParticlePacking
from etc_engine.structure.laguerre import laguerre_facets

BOUNDARIES = [(True, True, True), (False, False, False), (True, False, True)]


def random_seeds(count: int, seed: int, periodic=(True, True, True), lengths=(1.0, 0.8, 1.2)) -> ParticlePacking:
    """Overlapping spheres at random places: nothing helps the tessellation."""
    rng = np.random.default_rng(seed)
    spacing = (np.prod(lengths) / count) ** (1.0 / 3.0)
    centers = rng.random((count, 3)) * lengths
    return ParticlePacking(centers, spacing * rng.uniform(0.2, 0.6, count), Box(lengths, periodic))


def hull_areas(packing: ParticlePacking) -> dict[tuple[int, int], float]:
    """Facet areas of a periodic power diagram from the lower convex hull of lifted points, images included."""
    shifts = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    points = (packing.centers[None] + shifts[:, None] * np.asarray(packing.box.lengths)).reshape(-1, 3)
    owners, home = np.tile(np.arange(packing.count), 27), 13 * packing.count
    weights = packing.radii[owners] ** 2
    hull = ConvexHull(np.column_stack((points, (points**2).sum(axis=1) - weights)))
    simplices = hull.simplices[hull.equations[:, 3] < 0.0]
    normals = hull.equations[hull.equations[:, 3] < 0.0]
    vertices = -0.5 * normals[:, :3] / normals[:, 3:4]  # the point of equal power of the four seeds
    around: dict[tuple[int, int], list[int]] = {}
    for row, simplex in enumerate(simplices):
        for a in simplex:
            for b in simplex:
                if a < b and (home <= a < home + packing.count or home <= b < home + packing.count):
                    around.setdefault((int(a), int(b)), []).append(row)
    areas: dict[tuple[int, int], float] = {}
    for (a, b), rows in around.items():
        normal = (points[b] - points[a]) / np.linalg.norm(points[b] - points[a])
        frame = np.linalg.svd(normal[None])[2][1:]
        flat = (vertices[rows] - vertices[rows].mean(axis=0)) @ frame.T
        x, y = flat[np.argsort(np.arctan2(flat[:, 1], flat[:, 0]))].T
        area = 0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))
        inner = (home <= a < home + packing.count) + (home <= b < home + packing.count)
        key = tuple(sorted((int(owners[a]), int(owners[b]))))
        areas[key] = areas.get(key, 0.0) + area * inner / 2.0  # a facet across the border is met twice
    return areas


def test_facets_equal_those_of_the_lifted_convex_hull():
    packing = random_seeds(150, 77)
    facets = laguerre_facets(packing)
    expected = hull_areas(packing)
    found: dict[tuple[int, int], float] = {}
    for (i, j), area in zip(facets.pairs.tolist(), facets.areas, strict=True):
        found[(i, j)] = found.get((i, j), 0.0) + area
    mean = facets.areas.mean()
    for key in expected.keys() | found.keys():
        assert expected.get(key, 0.0) == pytest.approx(found.get(key, 0.0), abs=1e-9 * mean), key


@settings(max_examples=12)
@given(st.integers(1, 60), st.integers(10, 10**6), st.sampled_from(BOUNDARIES))
def test_cells_fill_the_box_and_are_closed(count, seed, periodic):
    packing = random_seeds(count, seed, periodic)
    facets = laguerre_facets(packing)
    box = packing.box
    assert facets.volumes.sum() == pytest.approx(box.volume, rel=1e-12)
    weighted = facets.areas @ facets.distances.sum(axis=1) + facets.wall_areas @ facets.wall_distances
    assert weighted == pytest.approx(3.0 * box.volume, rel=1e-12)
    branches = packing.centers[facets.pairs[:, 1]] - packing.centers[facets.pairs[:, 0]] + facets.shifts * box.lengths
    normals = branches / np.linalg.norm(branches, axis=1)[:, None] * facets.areas[:, None]
    outward = np.zeros((count, 3))
    np.add.at(outward, facets.pairs[:, 0], normals)
    np.add.at(outward, facets.pairs[:, 1], -normals)
    sign = np.where(facets.walls % 2, 1.0, -1.0) * facets.wall_areas
    np.add.at(outward, (facets.wall_cells, facets.walls // 2), sign)
    scale = facets.areas.max(initial=facets.wall_areas.max(initial=0.0))
    assert np.abs(outward).max() <= 1e-10 * scale


def test_centroids_integrate_the_identity():
    """Sum over a cell's facets of area n (x) (centroid - seed) is the volume times the identity."""
    packing = random_seeds(80, 83, (False, True, False))
    facets = laguerre_facets(packing)
    lengths = np.asarray(packing.box.lengths)
    branches = packing.centers[facets.pairs[:, 1]] - packing.centers[facets.pairs[:, 0]] + facets.shifts * lengths
    normals = branches / np.linalg.norm(branches, axis=1)[:, None] * facets.areas[:, None]
    moments = np.zeros((packing.count, 3, 3))
    np.add.at(moments, facets.pairs[:, 0], normals[:, :, None] * facets.centroids[:, None, :])
    np.add.at(moments, facets.pairs[:, 1], -normals[:, :, None] * (facets.centroids - branches)[:, None, :])
    outward = np.zeros((facets.walls.size, 3))
    outward[np.arange(facets.walls.size), facets.walls // 2] = np.where(facets.walls % 2, 1, -1) * facets.wall_areas
    np.add.at(moments, facets.wall_cells, outward[:, :, None] * facets.wall_centroids[:, None, :])
    np.testing.assert_allclose(moments, facets.volumes[:, None, None] * np.eye(3), atol=1e-11 * facets.volumes.mean())


@pytest.mark.parametrize("periodic", BOUNDARIES)
def test_a_regular_grid_has_no_facets_through_edges_and_corners(periodic):
    side = 6
    grid = (np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), axis=-1).reshape(-1, 3) + 0.5) / side
    facets = laguerre_facets(ParticlePacking(grid, np.full(side**3, 0.05), Box((1.0, 1.0, 1.0), periodic)))
    expected = sum((side if flag else side - 1) * side**2 for flag in periodic)
    assert facets.count == expected
    np.testing.assert_allclose(facets.areas, 1.0 / side**2, rtol=1e-12)
    assert facets.walls.size == sum(2 * side**2 for flag in periodic if not flag)


def test_one_seed_meets_its_own_images():
    facets = laguerre_facets(ParticlePacking([[0.3, 0.3, 0.3]], [0.1], Box((1.0, 2.0, 3.0), (True, True, True))))
    assert facets.pairs.tolist() == [[0, 0]] * 3
    assert sorted(facets.areas.round(12)) == [2.0, 3.0, 6.0]
    assert sorted(map(tuple, facets.shifts.tolist())) == [(0, 0, 1), (0, 1, 0), (1, 0, 0)]


def test_a_seed_within_a_large_sphere_owns_no_cell():
    packing = ParticlePacking([[0.5, 0.5, 0.5], [0.55, 0.5, 0.5], [0.9, 0.9, 0.9]], [0.45, 0.01, 0.1], Box((1, 1, 1)))
    facets = laguerre_facets(packing)
    assert facets.volumes[1] == 0.0
    assert not (facets.pairs == 1).any()
    assert facets.volumes.sum() == pytest.approx(1.0, rel=1e-12)


def test_coinciding_seeds_share_one_cell():
    packing = ParticlePacking([[0.2, 0.5, 0.5], [0.2, 0.5, 0.5], [0.7, 0.5, 0.5]], [0.1, 0.1, 0.1], Box((1, 1, 1)))
    assert laguerre_facets(packing).volumes.tolist() == pytest.approx([0.45, 0.0, 0.55])


def test_disks_are_refused():
    with pytest.raises(GeometryError, match="three-dimensional box, found 2"):
        laguerre_facets(ParticlePacking([[0.5, 0.5]], [0.1], Box((1.0, 1.0))))
