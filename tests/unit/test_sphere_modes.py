"""Flux modes of contact disks: against single-mode closed forms, quadrature in real space, and each other."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import eval_jacobi

from etc_engine.box import Box
from etc_engine.engines.dtem.exact.spheres import exact_sphere_elements
from etc_engine.engines.dtem.field import recover_field
from etc_engine.engines.dtem.steady import solve_steady
from etc_engine.errors import GeometryError, InputError
from etc_engine.laws.sphere import chord_resistance, disk_resistance, mutual_resistance
from etc_engine.laws.sphere_modes import _dual_scale, _self_block, mode_tables, own_blocks, pair_means
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import bonded_contacts, overlap_contacts
from etc_engine.medium.sides import contact_sides
from etc_engine.packing.particles import ParticlePacking
from etc_engine.realization import effective_conductivity


def test_the_first_mode_is_the_equilibrium_disk():
    tables = mode_tables(0)
    alpha = np.radians([0.5, 5.0, 20.0, 50.0, 75.0])
    for a in alpha:
        block = _self_block([(0, 0)], a)[0, 0] / np.sin(a) - 2.0 * a / np.sin(a) / (4.0 * np.pi)
        assert block == pytest.approx(disk_resistance(a), rel=1e-9)
    assert own_blocks(tables, alpha).selves[:, 0, 0] == pytest.approx(chord_resistance(alpha), rel=1e-12)
    means = np.empty((1, 1, 1))
    pair_means(np.cos(1.2), 0.2, 0.4, tables.orders, tables.lines, means)
    gauge = own_blocks(tables, np.array([0.2, 0.4])).gauges.sum()
    assert means[0, 0, 0] / (4.0 * np.pi) - gauge == pytest.approx(mutual_resistance(np.cos(1.2), 0.2, 0.4), abs=1e-9)


@pytest.mark.parametrize("family", [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1)])
def test_temperatures_and_fluxes_are_dual(family):
    """<s, t> = 1 in real space: s is t's own weight, normed by its far field in a small ball of sources."""
    m, k = family
    x, w = np.polynomial.legendre.leggauss(60)
    s, weight = np.sin(0.25 * np.pi * (x + 1.0)), 0.25 * np.pi * w * np.sin(0.25 * np.pi * (x + 1.0))
    shape = s**m * eval_jacobi(k, m, -0.5, 1.0 - 2.0 * s * s)
    turns = 2.0 * np.pi if m == 0 else np.pi
    # V of the flat space maps s_mk to the temperature lambda t_mk, lambda = half/(8 c (2 m + 4 k + 1)) = <s, V s>
    scale = _dual_scale(m, k)
    density = shape / (scale * turns * (weight * shape**2).sum())
    assert turns * (weight * density * scale * shape).sum() == pytest.approx(1.0)
    if m == k == 0:
        assert scale == pytest.approx(1.0)


def test_exact_of_degree_zero_is_chord_without_dents():
    chain = ParticlePacking([[0.5, 0.5, 0.5], [1.5, 0.5, 0.5], [2.5, 0.5, 0.5]], [0.5] * 3, Box((3.0, 1.0, 1.0)))
    network = bonded_contacts(chain, 0.3)
    one = effective_conductivity(medium_of(network), method="exact", modes=1, axes=(0,)).tensor[0, 0]
    assert one == pytest.approx(effective_conductivity(medium_of(network), axes=(0,)).tensor[0, 0], rel=1e-9)


def clump(seed: int = 12) -> ParticlePacking:
    """A sphere among smaller ones that reach into it from irregular directions, all inside a box they do not touch."""
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(400, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    kept: list[np.ndarray] = []
    for direction in directions:
        if all(direction @ other < 0.45 for other in kept):
            kept.append(direction)
    radii = rng.uniform(0.45, 0.6, len(kept))
    centers = np.array(kept) * (0.97 + radii)[:, None]
    return ParticlePacking(np.concatenate([[[0.0] * 3], centers]) + 2.5, np.append(1.0, radii), Box((5.0,) * 3))


def test_elements_turn_with_the_sphere():
    packing = clump()
    turn, _ = np.linalg.qr(np.random.default_rng(9).normal(size=(3, 3)))
    turned = ParticlePacking((packing.centers - 2.5) @ turn + 2.5, packing.radii, packing.box)
    blocks = []
    for one in (packing, turned):
        sides = contact_sides(overlap_contacts(one))
        elements = exact_sphere_elements(sides, np.ones(one.count), 6)
        n = 6 * (sides.offsets[1] - sides.offsets[0])
        block = elements.values[: n * n].reshape(n, n)
        blocks.append(block[::6, ::6])
        assert block == pytest.approx(block.T, abs=1e-9)
        assert np.linalg.eigvalsh(block).min() > -1e-9
        assert block[:, ::6].sum(axis=1) == pytest.approx(np.zeros(n), abs=1e-9)
    assert len(blocks[0]) >= 6
    assert blocks[1] == pytest.approx(blocks[0], rel=1e-8, abs=1e-10)


def test_field_of_exact_recovers_its_contact_temperatures():
    rng = np.random.default_rng(31)
    centers = np.stack(np.meshgrid(*[np.arange(3.0)] * 3), axis=-1).reshape(-1, 3) + 0.5
    packing = ParticlePacking(centers, rng.uniform(0.5, 0.56, 27) * 1.04, Box((3.0, 3.0, 3.0)))
    network = overlap_contacts(packing)
    solution = solve_steady(medium_of(network), (2,), method="exact")
    assert solution.modes == 6
    field = recover_field(solution)
    at = solution.temperatures[solution.sides.of_contacts[:, 0], 0]
    assert field.contact_temperatures[solution.backbone.contacts] == pytest.approx(at, abs=1e-7)
    assert np.isfinite(field.particle_temperatures).all()


def test_what_exact_refuses():
    alone = ParticlePacking([[0.5, 1.0, 1.0]], [0.5], Box((1.0, 2.0, 2.0)))
    with pytest.raises(
        GeometryError, match="particle 0 is beyond method exact: the half-angle 82 degrees of a contact"
    ):
        effective_conductivity(medium_of(bonded_contacts(alone, np.radians(82.0))), method="exact", axes=(0,))
    with pytest.raises(InputError, match="between 1 and 6, found 7"):
        effective_conductivity(medium_of(bonded_contacts(alone, 0.1)), method="exact", modes=7)
