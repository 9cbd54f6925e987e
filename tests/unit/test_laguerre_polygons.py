"""Polygons of the power diagram: closed cells, shared vertices, the facets of the other kernel."""

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.engines.dtem.cell_3d.topology import cell_topology
from etc_engine.errors import GeometryError
from etc_engine.packing.particles import ParticlePacking
from etc_engine.structure.laguerre import laguerre_facets
from etc_engine.structure.laguerre_polygons import laguerre_polygons

PERIODIC = Box((1.0, 1.0, 1.0), (True, True, True))


def random_spheres(count, seed):
    random = np.random.default_rng(seed)
    return random.random((count, 3)), random.uniform(0.02, 0.08, count)


def areas(polygons, lengths):
    points = polygons.vertices[polygons.corners] + polygons.images * lengths
    result = np.zeros(polygons.count)
    for f in range(polygons.count):
        p = points[polygons.starts[f] : polygons.starts[f + 1]]
        crossed = np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0)
        result[f] = 0.5 * crossed @ polygons.normals[f]
    return result


@pytest.mark.parametrize("periodic", [(True, True, True), (True, False, True), (False, False, False)])
def test_areas_are_those_of_the_facets(periodic):
    centers, radii = random_spheres(50, 11)
    box = Box((1.0, 1.2, 0.9), periodic)
    centers = centers * np.array(box.lengths)
    polygons, facets = laguerre_polygons(centers, radii, box), laguerre_facets(ParticlePacking(centers, radii, box))
    inner = polygons.cells[:, 1] >= 0
    found = areas(polygons, np.array(box.lengths))
    assert (found > 0.0).all()  # counter-clockwise about the normal
    np.testing.assert_allclose(np.sort(found[inner])[-150:], np.sort(facets.areas)[-150:], rtol=1e-4, atol=1e-6)
    assert found[inner].sum() == pytest.approx(facets.areas.sum(), rel=1e-6)
    assert found[~inner].sum() == pytest.approx(facets.wall_areas.sum(), rel=1e-6)


def test_periodic_cells_obey_euler():
    """In a simple partition of the torus every vertex has four edges: V - E + F - C = 0 and E = 2 V."""
    centers, radii = random_spheres(60, 12)
    polygons = laguerre_polygons(centers, radii, PERIODIC)
    topology = cell_topology(polygons, 60)
    assert topology.edge_count == 2 * len(polygons.vertices)
    assert len(polygons.vertices) - topology.edge_count + polygons.count - 60 == 0


@pytest.mark.parametrize(
    ("places", "edge", "facets", "vertices"),
    [
        ([[0, 0, 0]], 2.002, 3, 1),
        ([[0, 0, 0], [0.5, 0.5, 0.5]], 2.3, 14, 12),
        ([[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]], 2.83, 24, 12),
    ],
)
def test_lattices_merge_their_vertices(places, edge, facets, vertices):
    centers = (np.array(places) + 0.1) * edge
    polygons = laguerre_polygons(centers, np.ones(len(centers)), Box((edge,) * 3, (True,) * 3))
    topology = cell_topology(polygons, len(centers))
    assert (polygons.count, len(polygons.vertices)) == (facets, vertices)
    assert np.unique(np.diff(topology.vertex_starts)).size == 1


def test_hidden_spheres_are_refused_by_number():
    centers = np.array([[0.3, 0.5, 0.5], [0.7, 0.5, 0.5], [0.32, 0.5, 0.5]])
    with pytest.raises(GeometryError, match=r"sphere 2 .* has no Laguerre cell"):
        laguerre_polygons(centers, np.array([0.2, 0.2, 0.01]), PERIODIC)


def test_two_dimensions_are_refused():
    with pytest.raises(GeometryError, match="three-dimensional"):
        laguerre_polygons(np.zeros((1, 2)), np.ones(1), Box((1.0, 1.0)))
