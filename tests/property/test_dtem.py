"""Contact networks of every kind: solved to invariants, or refused clearly."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve

from etc_engine.box import Box
from etc_engine.engines.dtem.methods import METHODS
from etc_engine.engines.dtem.steady import solve_steady
from etc_engine.errors import EtcError, GeometryError
from etc_engine.medium.backbone import find_backbone
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import bonded_contacts, overlap_contacts
from etc_engine.medium.sides import contact_sides
from etc_engine.packing.particles import ParticlePacking
from etc_engine.realization import effective_conductivity

METHOD = st.sampled_from(sorted(METHODS))
SETTINGS = settings(deadline=None, max_examples=40)


def jittered(seed: int, n: int, growth: float, periodic: tuple[bool, bool]) -> ParticlePacking:
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(np.arange(n), np.arange(n), indexing="ij"), axis=-1).reshape(-1, 2) + 0.5
    centers = (grid + 0.1 * rng.uniform(-1, 1, grid.shape)) / n
    return ParticlePacking(centers, growth * rng.uniform(0.45, 0.55, n * n) / n, Box((1.0, 1.0), periodic))


@SETTINGS
@given(
    seed=st.integers(2, 10_000),
    n=st.integers(1, 7),
    growth=st.floats(0.95, 1.15),
    periodic=st.tuples(st.booleans(), st.booleans()),
    method=METHOD,
)
def test_random_overlapping_disks_are_solved_or_refused(seed, n, growth, periodic, method):
    packing = jittered(seed, n, growth, periodic)
    try:
        result = effective_conductivity(medium_of(overlap_contacts(packing)), method=method)
    except GeometryError:
        return
    diagonal = np.diag(result.tensor)
    assert np.all(np.isfinite(diagonal))
    assert np.all(diagonal >= 0.0)
    assert all((k > 0.0) or not flag for k, flag in zip(diagonal, result.spans, strict=True))
    for solution in result.solutions:
        if not packing.box.periodic[solution.axes[0]]:
            heat_in, heat_out = solution.wall_heat()
            assert heat_in == pytest.approx(solution.energies[0, 0], rel=1e-9, abs=1e-15)
            assert heat_out == pytest.approx(heat_in, rel=1e-9, abs=1e-15)


@SETTINGS
@given(degrees=st.floats(0.1, 60.0), angle=st.floats(0.0, 360.0), method=METHOD)
def test_two_contacts_of_a_disk_at_any_angle_are_solved_or_refused(degrees, angle, method):
    """Element of a disk with two arcs: positive conductance, or a refusal when they overlap."""
    direction = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    packing = ParticlePacking([[5, 5], [7, 5], 5 + 2 * direction], [1.0, 1.0, 1.0], Box((10.0, 10.0)))
    try:
        overlapping = 0.0 < np.linalg.norm(packing.centers[1] - packing.centers[2]) < 1.99
        network = bonded_contacts(packing, np.radians(degrees))
        sides = contact_sides(network)
        assume(not overlapping)
        elements = METHODS[method].elements(sides, np.ones(3), METHODS[method].modes)
    except EtcError:
        return
    block = elements.values[elements.starts[0] : elements.starts[1]]
    assert block[0] > 0.0
    assert np.isfinite(block).all()


@pytest.mark.parametrize("count", [2, 3, 12, 60])
@pytest.mark.parametrize("method", ["standard", "enhanced", "chord", "arc"])
def test_many_contacts_on_one_disk(count, method):
    """A wheel of small disks: by symmetry the hub's temperature is the mean of the rim's."""
    r = 0.5 if count < 6 else 0.9 * np.sin(np.pi / count) / (1.0 - np.sin(np.pi / count))
    turn = 2.0 * np.pi * np.arange(count) / count
    rim = 10.0 + (1.0 + r) * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    packing = ParticlePacking(np.concatenate([[[10.0, 10.0]], rim]), [1.0, *np.full(count, r)], Box((20.0, 20.0)))
    network = bonded_contacts(packing, np.radians(80.0 / count))
    assert network.count == count
    elements = METHODS[method].elements(contact_sides(network), np.ones(count + 1), METHODS[method].modes)
    size = count * elements.modes
    hub = elements.values[: size * size].reshape(size, size)
    heat = hub[:: elements.modes, :: elements.modes]
    np.testing.assert_allclose(heat.sum(axis=1), 0.0, atol=1e-9 * np.abs(heat).max())
    np.testing.assert_allclose(np.diag(heat), heat[0, 0], rtol=1e-9)
    assert np.linalg.eigvalsh(hub).min() > -1e-9 * np.abs(hub).max()


@pytest.mark.parametrize("ratio", [1.0, 10.0, 100.0])
def test_unequal_disks_between_walls(ratio):
    """A large disk next to a small one: each disk's resistance does not depend on its size."""
    small = 1.0 / (1.0 + ratio) / 2.0
    large = small * ratio
    packing = ParticlePacking([[large, 0.5], [2 * large + small, 0.5]], [large, small], Box((1.0, 1.0)))
    equal = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    one, other = (
        effective_conductivity(medium_of(bonded_contacts(p, 0.05, 1e-9)), axes=(0,)).tensor[0, 0]
        for p in (packing, equal)
    )
    assert one == pytest.approx(other, rel=1e-10)


@pytest.mark.parametrize("resistance", [1e-6, 0.3, 50.0])
@pytest.mark.parametrize("method", ["standard", "chord"])
def test_contact_resistance_equals_the_doubled_system(resistance, method):
    """Feng et al. 2008, Eq. 43: two temperatures a contact joined by a bar, against half of it on either side."""
    packing = jittered(31, 6, 1.06, (False, False))
    network = overlap_contacts(packing)
    backbone = find_backbone(network, (0,))
    reduced = network.select(backbone.contacts, backbone.wall_contacts)
    sides = contact_sides(reduced)
    elements = METHODS[method].elements(sides, np.ones(packing.count), 1)
    # every side has its own face temperature; behind a wall's bar lies the wall
    faces = sides.nodes.size
    rows, columns, values = [], [], []
    for p in range(packing.count):
        first, n = sides.offsets[p], sides.offsets[p + 1] - sides.offsets[p]
        i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
        rows += list(first + i.ravel())
        columns += list(first + j.ravel())
        values += list(elements.values[elements.starts[p] : elements.starts[p + 1]])
    for a, b in sides.of_contacts:
        rows += [a, b, a, b]
        columns += [a, b, b, a]
        values += [1 / resistance, 1 / resistance, -1 / resistance, -1 / resistance]
    rhs = np.zeros(faces)
    for k, a in enumerate(sides.of_walls):
        rows.append(a)
        columns.append(a)
        values.append(1 / resistance)
        rhs[a] += (1.0 - reduced.walls[k] % 2) / resistance
    K = coo_matrix((values, (rows, columns)), shape=(faces, faces)).tocsc()
    temperature = spsolve(K, rhs)
    hot = sides.of_walls[reduced.walls == 0]
    doubled = np.sum((1.0 - temperature[hot]) / resistance)
    solution = solve_steady(medium_of(network.with_resistance(resistance)), (0,), method=method)
    assert solution.energies[0, 0] == pytest.approx(doubled, rel=1e-8)
    from etc_engine.engines.dtem.field import recover_field

    field = recover_field(solution)
    np.testing.assert_allclose(field.face_temperatures[backbone.contacts], temperature[sides.of_contacts], atol=2e-9)


def test_limits_of_the_contact_resistance():
    network = overlap_contacts(jittered(32, 6, 1.06, (False, False)))
    bare = effective_conductivity(medium_of(network), axes=(0,)).tensor[0, 0]
    small = effective_conductivity(medium_of(network.with_resistance(1e-9)), axes=(0,)).tensor[0, 0]
    assert small == pytest.approx(bare, rel=1e-7)
    large = [
        effective_conductivity(medium_of(network.with_resistance(r)), axes=(0,)).tensor[0, 0] * r for r in (1e5, 1e6)
    ]
    assert large[0] == pytest.approx(large[1], rel=1e-4)  # particles become isothermal: k ~ 1/R_c


def test_clusters_on_one_wall_take_its_temperature():
    from etc_engine.engines.dtem.field import recover_field

    triangle = [[0.1, 0.3], [0.3, 0.3], [0.2, 0.3 + np.sqrt(0.03)]]
    packing = ParticlePacking([*triangle, [0.9, 0.5]], [0.1] * 4, Box((1.0, 1.0)))
    result = effective_conductivity(medium_of(bonded_contacts(packing, 0.1)), axes=(0,))
    assert result.tensor[0, 0] == 0.0
    assert recover_field(result.solutions[0]).particle_temperatures.tolist() == [1.0, 1.0, 1.0, 0.0]
