"""Temperatures inside the cells, and heat stored in the disks."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.engines.dtem.cell.geometry import cell_geometry
from etc_engine.engines.dtem.cell.recovery import recover_cells, temperatures_inside
from etc_engine.engines.dtem.cell.steady import build_model, solve_model


@pytest.fixture(scope="module")
def jittered():
    rng = np.random.default_rng(40)
    centers = (np.mgrid[:4, :3].reshape(2, -1).T + 0.5 + rng.uniform(-0.15, 0.15, (12, 2))) / (4.0, 3.0)
    return centers, rng.uniform(0.06, 0.09, 12)


@pytest.mark.parametrize("periodic", [(True, True), (False, False)])
@pytest.mark.parametrize("contrast", [1.0, 30.0])
def test_the_field_is_continuous_and_carries_the_heat_of_the_energy(jittered, periodic, contrast):
    centers, radii = jittered
    box = Box((1.0, 1.0), periodic)
    geometry = cell_geometry(centers, radii, box)
    solution = solve_model(build_model(geometry, np.full(12, contrast), 1.0), (0, 1) if periodic[0] else (0,))
    field = recover_cells(solution)
    cells = geometry.cells
    # across every edge the two cells agree
    ahead = np.flatnonzero(cells.forward & ~cells.at_wall[cells.edges])
    owner = np.searchsorted(cells.starts, ahead, side="right") - 1
    e = cells.edges[ahead]
    tangent = np.column_stack((-cells.normals[e, 1], cells.normals[e, 0]))
    middle = 0.3 * cells.ends[e, :1] + 0.7 * cells.ends[e, 1:]
    place = cells.distances[e, :1] * cells.normals[e] + middle * tangent
    other = place - (cells.distances[e].sum(axis=1))[:, None] * cells.normals[e]
    here = temperatures_inside(field, owner, place * (1.0 - 1e-9))
    there = temperatures_inside(field, cells.cells[e, 1], other * (1.0 - 1e-9))
    jump = cells.shifts[e, 0] if periodic[0] else 0.0
    assert np.abs(here - there - jump).max() < 2e-4 * np.ptp(here) + 1e-3 / contrast
    # heat through a cut of the box, from the flows over the edges; what enters at vertices is shared roughly
    wall = cells.cells[:, 1] < 0
    if periodic[0]:
        crossing = -field.edge_flows[~wall] * cells.shifts[~wall, 0]
        total = -crossing.sum()
        assert total == pytest.approx(-solution.energies[0, 0], rel=0.03)
    else:
        low = field.edge_flows[cells.cells[:, 1] == -1].sum()
        assert -low == pytest.approx(solution.energies[0, 0], rel=0.03)


def test_a_uniform_medium_has_the_linear_field(jittered):
    centers, radii = jittered
    geometry = cell_geometry(centers, radii, Box((1.0, 1.0), (True, True)))
    solution = solve_model(build_model(geometry, np.ones(12), 1.0), (0, 1))
    field = recover_cells(solution, 1)
    rng = np.random.default_rng(41)
    disks = rng.integers(0, 12, 200)
    offsets = rng.uniform(-0.05, 0.05, (200, 2))
    found = temperatures_inside(field, disks, offsets)
    exact = (centers[disks] + offsets)[:, 1]
    assert np.ptp(found - exact) < 5e-3
    assert np.ptp(field.disk_temperatures - centers[:, 1]) < 2e-3


def test_temperature_stays_between_the_walls_in_disks_and_fluid(jittered):
    centers, radii = jittered
    geometry = cell_geometry(centers, radii, Box((1.0, 1.0)))
    field = recover_cells(solve_model(build_model(geometry, np.full(12, 100.0), 1.0), (0,)))
    rng = np.random.default_rng(42)
    offsets = rng.uniform(-0.1, 0.1, (2000, 2))
    disks = rng.integers(0, 12, 2000)
    place = centers[disks] + offsets
    power = ((place[:, None] - centers) ** 2).sum(axis=-1) - radii**2
    mine = (np.argmin(power, axis=1) == disks) & (place > 0.0).all(axis=1) & (place < 1.0).all(axis=1)
    found = temperatures_inside(field, disks[mine], offsets[mine])
    assert -2e-3 < found.min() < found.max() < 1.002
    assert np.corrcoef(found, place[mine, 0])[0, 1] < -0.99


def test_storing_cells_have_the_same_steady_state_and_one_mean_each(jittered):
    centers, radii = jittered
    geometry = cell_geometry(centers, radii, Box((1.0, 1.0), (True, True)))
    solid = np.random.default_rng(43).uniform(5.0, 20.0, 12)
    plain = solve_model(build_model(geometry, solid, 1.0), (0, 1))
    storing = solve_model(build_model(geometry, solid, 1.0, storing=True), (0, 1))
    assert storing.model.frame.count == plain.model.frame.count + 12
    assert np.allclose(storing.energies, plain.energies, rtol=1e-9)
    means = storing.fluctuations[-12:, 0] + centers[:, 0]
    found = recover_cells(plain).disk_temperatures
    assert np.ptp(means - found) < 1e-9


def test_a_heated_disk_is_warmer_inside_by_the_parabola():
    # one disk between walls of one temperature, heated evenly by q: mean of the disk less mean of its rim = q R^2/(8 k)
    geometry = cell_geometry(np.array([[0.5, 0.5]]), np.array([0.45]), Box((1.0, 1.0)))
    means = {}
    for solid in (2.0, 1e9):
        model = build_model(geometry, np.array([solid]), 1.0, storing=True)
        matrix = model.system.matrix
        walls = np.arange(model.frame.count - 1)
        means[solid] = 1.0 / (matrix[-1:, :].toarray()[0, -1])
        assert matrix[-1:, walls].sum() == pytest.approx(-matrix[-1, -1])
    rim_to_wall = means[1e9]
    assert means[2.0] - rim_to_wall > 1.0 / (8.0 * np.pi * 2.0)
    assert means[2.0] - rim_to_wall == pytest.approx(1.0 / (8.0 * np.pi * 2.0), rel=0.35)
