"""Steady conduction through lattices: the patch test, exact layers, halos and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from etc_engine.box import Box
from etc_engine.engines.lattice.calibration import calibrate, pack_lattice
from etc_engine.engines.lattice.flux import flux_moments, halo_flux, mean_flux, near_wall, probe
from etc_engine.engines.lattice.network import contact_lattice, laguerre_lattice, link_conductances
from etc_engine.engines.lattice.steady import (
    FACTORISED,
    conductivity_tensor,
    lattice_fields,
    solve_between_walls,
    solve_with_gradient,
)
from etc_engine.errors import GeometryError, InputError
from etc_engine.packing.particles import ParticlePacking

LENGTHS = (1.0, 0.8, 1.2)
WALLS, PERIODIC = (False,) * 3, (True,) * 3
EXACT = 1e-24  # relative error of the energy: the square of that of the temperatures


@pytest.fixture(scope="module")
def packings():
    """Packings between walls and periodic ones, of a size that is factorised and of one that is not."""
    rng = np.random.default_rng(911)
    return {
        (count, periodic): pack_lattice(count, LENGTHS, rng, periodic=periodic, density=0.45)
        for count in (400, FACTORISED + 500)
        for periodic in (WALLS, PERIODIC)
    }


@pytest.mark.parametrize("count", [400, FACTORISED + 500])
@pytest.mark.parametrize("axis", range(3))
def test_linear_fields_between_walls_are_exact(packings, count, axis):
    lattice = laguerre_lattice(packings[count, WALLS])
    field = solve_between_walls(
        lattice, link_conductances(lattice, 33.0), axis, temperatures=(25.0, 35.0), tolerance=EXACT
    )
    linear = 25.0 + 10.0 * lattice.packing.centers[:, axis] / LENGTHS[axis]
    assert np.abs(field.temperatures - linear).max() < 1e-10 * 10.0
    assert field.energy == pytest.approx(33.0 * 100.0 * np.prod(LENGTHS) / LENGTHS[axis] ** 2, rel=1e-11)


@pytest.mark.parametrize("count", [400, FACTORISED + 500])
def test_linear_fields_through_a_periodic_box_are_exact(packings, count):
    lattice = laguerre_lattice(packings[count, PERIODIC])
    conductances = link_conductances(lattice, 33.0)
    result = conductivity_tensor(lattice, conductances, tolerance=EXACT)
    np.testing.assert_allclose(result.tensor, 33.0 * np.eye(3), atol=33.0 * 1e-11)
    for field in lattice_fields(lattice, conductances, result):
        assert np.ptp(field.temperatures) < 1e-10


def test_a_uniform_field_has_no_scatter(packings):
    lattice = laguerre_lattice(packings[400, WALLS])
    field = solve_between_walls(lattice, link_conductances(lattice, 2.0), 1, tolerance=EXACT)
    expected = np.array([0.0, 2.0 / LENGTHS[1], 0.0])
    assert np.abs(flux_moments(field) / lattice.volumes[:, None] - expected).max() < 1e-10
    assert np.abs(halo_flux(field, 0.2) - expected).max() < 1e-10


@pytest.mark.parametrize("transmission", [laguerre_lattice, contact_lattice])
@pytest.mark.parametrize("periodic", [WALLS, PERIODIC])
def test_the_volume_average_is_the_mean_flux(packings, transmission, periodic):
    """Random conductivities: the flux is anything but uniform, its average is Q L / V (E / V) to rounding."""
    lattice = transmission(packings[400, periodic])
    k = np.random.default_rng(5).lognormal(0.0, 1.0, lattice.count)
    solve = solve_with_gradient if periodic[2] else solve_between_walls
    field = solve(lattice, link_conductances(lattice, k), 2, tolerance=EXACT)
    sign = -1.0 if periodic[2] else LENGTHS[2]  # unit gradient upwards; unit drop downwards
    assert mean_flux(field)[2] == pytest.approx(sign * field.energy / np.prod(LENGTHS), rel=1e-11)


def test_layers_conduct_in_series_with_their_interfaces():
    side = 8
    grid = (np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), axis=-1).reshape(-1, 3) + 0.5) / side
    lattice = laguerre_lattice(ParticlePacking(grid, np.full(side**3, 0.02), Box((1.0, 1.0, 1.0))))
    phase = (grid[:, 0] > 0.25).astype(np.int64)
    conductances = link_conductances(lattice, np.array([0.2, 3.0])[phase], interface_resistance=0.7, phase=phase)
    tensor = conductivity_tensor(lattice, conductances).tensor
    assert tensor[0, 0] == pytest.approx(1.0 / (0.25 / 0.2 + 0.75 / 3.0 + 0.7), rel=1e-9)
    assert tensor[1, 1] == pytest.approx(0.25 * 0.2 + 0.75 * 3.0, rel=1e-9)


@settings(max_examples=8)
@given(st.integers(10, 10**6), st.floats(0.01, 100.0))
def test_conductivity_lies_between_the_means_and_scales(seed, factor):
    rng = np.random.default_rng(seed)
    packing = ParticlePacking(rng.random((60, 3)), np.full(60, 0.01), Box((1.0, 1.0, 1.0), PERIODIC))
    lattice, k = laguerre_lattice(packing), rng.lognormal(0.0, 1.5, 60)
    tensor = conductivity_tensor(lattice, link_conductances(lattice, k), tolerance=1e-14).tensor
    scaled = conductivity_tensor(lattice, link_conductances(lattice, factor * k), tolerance=1e-14).tensor
    np.testing.assert_allclose(scaled, factor * tensor, rtol=1e-9, atol=1e-9 * factor * np.trace(tensor))
    np.testing.assert_allclose(tensor, tensor.T, atol=1e-10 * np.trace(tensor))
    # trial fields of a uniform gradient, and of a uniform flux, summed over the axes: sum S d = 3 V
    assert np.trace(tensor) / 3.0 <= lattice.volumes @ k
    assert np.trace(np.linalg.inv(tensor)) / 3.0 <= lattice.volumes @ (1.0 / k)


def test_insulating_nodes_take_no_part(packings):
    lattice = laguerre_lattice(packings[400, WALLS])
    k = np.where(lattice.packing.centers[:, 1] < 0.4, 1.0, 0.0)
    tensor = conductivity_tensor(lattice, link_conductances(lattice, k)).tensor
    assert tensor[1, 1] == 0.0
    assert 0.4 < tensor[0, 0] < 0.6
    everything = solve_between_walls(lattice, link_conductances(lattice, k), 0)
    assert np.isnan(everything.temperatures[k == 0.0]).all()


@pytest.mark.parametrize("periodic", [WALLS, PERIODIC])
def test_halos_add_up_all_nodes_within_reach(packings, periodic):
    packing = packings[400, periodic]
    lattice = contact_lattice(packing)
    solve = solve_with_gradient if periodic[0] else solve_between_walls
    field = solve(lattice, link_conductances(lattice), 0)
    radius, moments = 0.27, flux_moments(field)
    tree = cKDTree(packing.centers, boxsize=LENGTHS if periodic[0] else None)
    near = tree.query_ball_point(packing.centers, radius)
    expected = [moments[rows].sum(axis=0) / lattice.volumes[rows].sum() for rows in near]
    np.testing.assert_allclose(halo_flux(field, radius), expected, atol=1e-12)


def test_the_wall_region_is_where_halos_reach_over_walls(packings):
    lattice = laguerre_lattice(packings[400, WALLS])
    x = lattice.packing.centers
    expected = (np.minimum(x, np.asarray(LENGTHS) - x) < 0.1).any(axis=1)
    np.testing.assert_array_equal(near_wall(lattice, 0.1), expected)
    assert 0 < expected.sum() < lattice.count
    assert not near_wall(laguerre_lattice(packings[400, PERIODIC]), 0.1).any()


def test_a_probe_is_refused_in_a_periodic_box(packings):
    lattice = laguerre_lattice(packings[400, PERIODIC])
    with pytest.raises(InputError, match="this box is periodic"):
        probe(solve_with_gradient(lattice, link_conductances(lattice), 0), [[0.1, 0.1, 0.1]])


def test_calibrated_contacts_give_the_conductivity_back(packings):
    packing = packings[400, PERIODIC]
    found = calibrate(packing, tolerance=1e-12)
    lattice = contact_lattice(packing, transmission=found.coefficient)
    assert conductivity_tensor(lattice, link_conductances(lattice, 5.0), tolerance=1e-12).mean == pytest.approx(5.0)
    assert found.mean_field < found.coefficient
    assert found.coordination == pytest.approx(7.5, abs=0.01)


def test_whole_particles_at_the_walls_shorten_the_body(packings):
    """Held as a whole, the outer half of the particles at the walls no longer resists: C_t comes out lower."""
    packing = packings[400, WALLS]
    assert calibrate(packing, attachment="particle").coefficient < 0.95 * calibrate(packing).coefficient


@pytest.mark.parametrize(
    ("work", "message"),
    [
        (lambda p: contact_lattice(p, coordination=-1.0), "coordination number must be positive"),
        (lambda p: contact_lattice(p, coordination=400.0), "400 is out of reach"),
        (lambda p: contact_lattice(p, transmission=0.0), "C_t must be positive"),
        (lambda p: contact_lattice(p, attachment="glue"), "unknown attachment 'glue'"),
        (lambda p: link_conductances(laguerre_lattice(p), -1.0), "not negative, found -1"),
        (lambda p: link_conductances(laguerre_lattice(p), 0.0), "no node conducts"),
        (lambda p: link_conductances(laguerre_lattice(p), [1.0, 2.0]), r"found \(2,\)"),
        (lambda p: link_conductances(laguerre_lattice(p), 1.0, interface_resistance=-2.0), "resistance must be finite"),
        (lambda p: link_conductances(laguerre_lattice(p), 1.0, interface_resistance=2.0), "needs the phase"),
        (lambda p: halo_flux(_field(p), -1.0), "radius of a halo"),
        (lambda p: halo_flux(_field(p), 1.0, [1.0, 2.0, 3.0]), r"found \(3,\)"),
    ],
)
def test_bad_input_is_one_clear_line(packings, work, message):
    with pytest.raises(InputError, match=message) as caught:
        work(packings[400, WALLS])
    assert "\n" not in str(caught.value)


def _field(packing):
    lattice = laguerre_lattice(packing)
    return solve_between_walls(lattice, link_conductances(lattice), 0)


def test_spheres_within_others_are_refused():
    nested = ParticlePacking([[0.5, 0.5, 0.5], [0.55, 0.5, 0.5], [0.9, 0.9, 0.9]], [0.45, 0.01, 0.1], Box((1, 1, 1)))
    with pytest.raises(GeometryError, match=r"has no Laguerre cell|does not pass between"):
        laguerre_lattice(nested)
    with pytest.raises(GeometryError, match="three-dimensional"):
        contact_lattice(ParticlePacking([[0.5, 0.5]], [0.1], Box((1.0, 1.0))))
