"""Many temperatures, pressures and contrasts on one packing from a few full solutions."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.engines.dtem.facet_family import solve_family
from etc_engine.engines.dtem.facet_steady import solve_facets, uniform_material
from etc_engine.medium.facets import facet_links
from etc_engine.medium.rules import overlap_contacts
from etc_engine.packing.particles import ParticlePacking


@pytest.fixture(scope="module")
def links():
    """250 spheres at random places in the cells of a cubic grid, radii 1 : 1.6."""
    rng = np.random.default_rng(77)
    cells = np.stack(np.meshgrid(range(6), range(6), range(7), indexing="ij"), axis=-1).reshape(-1, 3)[:250]
    centers = (cells + 0.5 + rng.uniform(-0.12, 0.12, (250, 3))) / 6.0
    box = Box((1.0, 1.0, 7.0 / 6.0), (True, True, False))
    return facet_links(overlap_contacts(ParticlePacking(centers, rng.uniform(0.05, 0.08, 250), box)))


def test_thirty_states_of_a_gas_follow_from_a_few(links):
    materials = [
        uniform_material(links, 2.4 * (300.0 / t) ** 0.5, 0.15 * (t / 300.0) ** 0.7, 2e-5 * t / p, 5e-9 * t**3)
        for t in np.linspace(300.0, 900.0, 5)
        for p in np.geomspace(1.0, 1e3, 6)
    ]
    for axes in ((2,), (0, 1)):
        members = solve_family(links, materials, axes)
        assert members[0].anchors <= 14
        for row in range(0, 30, 7):
            exact = solve_facets(links, materials[row], axes).energies
            error = np.abs(members[row].energies - exact).max() / exact.max()
            assert error <= max(members[row].relative_error, 1e-9)
            assert error < 2e-4


def test_few_or_unlike_materials_are_solved_in_full(links):
    vacuum = uniform_material(links, 2.0, 0.0, radiation=0.1)
    gas = [uniform_material(links, 2.0, fluid) for fluid in (0.1, 0.3)]
    members = solve_family(links, [gas[0], vacuum, gas[1]], (2,))
    assert all(member.solution is not None and member.relative_error == 0.0 for member in members)
    for member, material in zip(members, (gas[0], vacuum, gas[1]), strict=True):
        assert member.energies[0, 0] == pytest.approx(solve_facets(links, material, (2,)).energies[0, 0], rel=1e-8)
