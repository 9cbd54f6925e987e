from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from etc_engine.box import Box
from etc_engine.engines.dtem.steady import solve_steady
from etc_engine.medium.backbone import find_backbone
from etc_engine.medium.medium import medium_of
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.rules import bonded_contacts
from etc_engine.packing.particles import ParticlePacking


def square_lattice(n: int, keep: np.ndarray, periodic: tuple[bool, bool]) -> ParticlePacking:
    grid = np.stack(np.meshgrid(np.arange(n), np.arange(n), indexing="ij"), axis=-1).reshape(-1, 2)
    return ParticlePacking((grid[keep] + 0.5) / n, np.full(int(keep.sum()), 0.5 / n), Box((1.0, 1.0), periodic))


def site_percolation(n: int, p: float, seed: int, periodic: tuple[bool, bool] = (False, False)) -> ContactNetwork:
    keep = np.random.default_rng(seed).random(n * n) < p
    return bonded_contacts(square_lattice(n, keep, periodic), 0.1)


def spans_by_graph(network: ContactNetwork, axis: int) -> bool:
    """Independent: connected components with the two walls as extra vertices."""
    n = network.packing.count
    rows = network.walls_of(axis)
    i = np.concatenate([network.pairs[:, 0], network.wall_particles[rows]])
    j = np.concatenate([network.pairs[:, 1], n + network.walls[rows] % 2])
    _, label = connected_components(coo_matrix((np.ones(i.size), (i, j)), shape=(n + 2, n + 2)), directed=False)
    return bool(label[n] == label[n + 1])


@pytest.mark.parametrize("p", [0.55, 0.6, 0.65])
def test_spanning_agrees_with_graph_components(p):
    for seed in range(100, 110):
        network = site_percolation(20, p, seed)
        for axis in (0, 1):
            assert find_backbone(network, (axis,)).spans == (spans_by_graph(network, axis),)


def test_backbone_has_no_dead_ends_and_prunes_nothing_else():
    network = site_percolation(40, 0.68, 111)
    backbone = find_backbone(network, (0,))
    reduced = network.select(backbone.contacts, backbone.wall_contacts)
    ends = np.concatenate([reduced.pairs.ravel(), reduced.wall_particles])
    degree = np.bincount(ends, minlength=network.packing.count)
    assert not np.any(degree == 1)
    assert 0 < reduced.count < network.count


@pytest.mark.parametrize("periodic", [(False, False), (True, True)])
def test_pruning_does_not_change_the_energy(periodic):
    """The same system with dead ends kept (an all-true backbone of the spanning clusters)."""
    network = site_percolation(30, 0.7, 112, periodic)
    pruned = solve_steady(medium_of(network), (0,))
    backbone = find_backbone(network, (0,))
    kept = np.unique(network.pairs[backbone.contacts])
    spanning = np.isin(backbone.clusters, np.unique(backbone.clusters[kept]))
    whole = type(backbone)(
        spanning[network.pairs[:, 0]],
        (network.walls // 2 == 0) & spanning[network.wall_particles] & (not periodic[0]),
        backbone.clusters,
        backbone.spans,
    )
    full = solve_steady(medium_of(network), (0,), backbone=whole)
    assert full.reports[0].unknowns > pruned.reports[0].unknowns
    assert pruned.energies[0, 0] == pytest.approx(full.energies[0, 0], rel=1e-10)


def test_wrapping_needs_a_closed_path_around_the_box():
    """A row of disks across a periodic box wraps around x only; one disk fewer and it does not."""
    box = Box((1.0, 1.0), (True, True))
    row = [[0.1 + 0.2 * i, 0.5] for i in range(5)]
    whole = bonded_contacts(ParticlePacking(row, [0.1] * 5, box), 0.1)
    broken = bonded_contacts(ParticlePacking(row[:4], [0.1] * 4, box), 0.1)
    assert find_backbone(whole, (0, 1)).spans == (True, False)
    assert find_backbone(broken, (0, 1)).spans == (False, False)


def test_wrapping_does_not_depend_on_where_the_box_is_cut():
    keep = np.random.default_rng(113).random(400) < 0.62
    packing = square_lattice(20, keep, (True, True))
    spans = set()
    for offset in ([0.0, 0.0], [0.31, 0.77], [0.5, 0.05]):
        moved = ParticlePacking(packing.centers + offset, packing.radii, packing.box)
        spans.add(find_backbone(bonded_contacts(moved, 0.1), (0, 1)).spans)
    assert len(spans) == 1


def test_rattlers_take_no_part():
    packing = ParticlePacking([[0.25, 0.5], [0.75, 0.5], [0.5, 0.9]], [0.25, 0.25, 0.05], Box((1.0, 1.0)))
    backbone = find_backbone(bonded_contacts(packing, 0.1), (0,))
    assert backbone.clusters.tolist() == [0, 0, 2]
    assert backbone.contacts.tolist() == [True]
