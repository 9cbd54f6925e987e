from __future__ import annotations

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.engines.dtem.field import recover_field
from etc_engine.engines.dtem.methods import METHODS
from etc_engine.engines.dtem.steady import solve_steady
from etc_engine.errors import GeometryError, InputError
from etc_engine.laws.disk import SELF_RESISTANCE, mutual_resistance, position_angles, self_resistance
from etc_engine.medium.loads import load_groups
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import bonded_contacts, overlap_contacts
from etc_engine.medium.sides import contact_sides
from etc_engine.packing.particles import ParticlePacking
from etc_engine.realization import effective_conductivity


def random_disks(seed: int, periodic: tuple[bool, bool] = (False, False), count: int = 60) -> ParticlePacking:
    """Disks on a jittered hexagonal grid, grown until they overlap slightly: percolating and irregular."""
    rng = np.random.default_rng(seed)
    n = round(np.sqrt(count))
    grid = np.stack(np.meshgrid(np.arange(n), np.arange(n), indexing="ij"), axis=-1).reshape(-1, 2) + 0.5
    centers = (grid + 0.08 * rng.uniform(-1, 1, grid.shape)) / n
    return ParticlePacking(centers, rng.uniform(0.53, 0.58, len(centers)) / n, Box((1.0, 1.0), periodic))


def literature_element(theta, alpha, method):
    """K_e = K_hat - g g^T / kappa_e with K_hat = H^-1, g = K_hat e (Feng et al. 2008, Eqs. 24 to 30)."""
    theta, alpha = np.asarray(theta), np.asarray(alpha)
    delta = theta[:, None] - theta[None, :]
    off = ~np.eye(theta.size, dtype=bool)
    H = np.diag(self_resistance(alpha, method))
    H[off] = mutual_resistance(delta[off], *(v[off] for v in np.broadcast_arrays(alpha[:, None], alpha[None, :])))
    K_hat = np.linalg.inv(H)
    g = K_hat.sum(axis=1)
    return K_hat - np.outer(g, g) / g.sum(), H


@pytest.mark.parametrize("method", SELF_RESISTANCE)
def test_element_equals_the_literature_form_is_symmetric_and_semi_definite(feng_particles, method):
    network = overlap_contacts(feng_particles)
    sides = contact_sides(network)
    elements = METHODS[method].elements(sides, np.ones(12), 1)
    theta = position_angles(sides.arms)
    for p in range(12):
        rows = slice(elements.offsets[p], elements.offsets[p + 1])
        n = rows.stop - rows.start
        K = elements.values[elements.starts[p] : elements.starts[p + 1]].reshape(n, n)
        expected, _ = literature_element(theta[rows], sides.alpha[rows], method)
        np.testing.assert_allclose(K, expected, atol=1e-13)
        np.testing.assert_allclose(K, K.T, atol=1e-16)
        np.testing.assert_allclose(K.sum(axis=1), 0.0, atol=1e-14)
        assert np.linalg.eigvalsh(K).min() > -1e-14


@pytest.mark.parametrize("method", SELF_RESISTANCE)
@pytest.mark.parametrize("count", [1, 2, 5])
def test_straight_chain_between_walls_is_a_series_of_two_contact_disks(method, count):
    """Each disk has opposite contacts: resistance h_11 + h_22 - 2 h_12, and a chain adds them up."""
    radius, alpha, kappa = 0.5 / count, np.radians(7.0), 2.5
    centers = [[(2 * i + 1) * radius, 0.5] for i in range(count)]
    network = bonded_contacts(ParticlePacking(centers, [radius] * count, Box((1.0, 1.0))), alpha)
    disk = 2.0 * (self_resistance(alpha, method) - mutual_resistance(np.pi, alpha, alpha)) / kappa
    result = effective_conductivity(medium_of(network, kappa), method=method, axes=(0,))
    assert result.tensor[0, 0] == pytest.approx(1.0 / (count * disk), rel=1e-12)
    field = recover_field(result.solutions[0])
    np.testing.assert_allclose(field.particle_temperatures, 1 - (2 * np.arange(count) + 1) / (2 * count), rtol=1e-12)


def test_conductivity_scales_with_the_particles():
    network = overlap_contacts(random_disks(3))
    one = effective_conductivity(medium_of(network), axes=(0,)).tensor[0, 0]
    seven = effective_conductivity(medium_of(network, 7.0), axes=(0,)).tensor[0, 0]
    assert seven == pytest.approx(7.0 * one, rel=1e-13)


def test_size_of_the_unit_of_length_does_not_matter():
    packing = random_disks(4)
    scaled = ParticlePacking(packing.centers * 37.0, packing.radii * 37.0, Box((37.0, 37.0)))
    one, other = (effective_conductivity(medium_of(overlap_contacts(p))).tensor for p in (packing, scaled))
    np.testing.assert_allclose(np.diag(one), np.diag(other), rtol=1e-10)


def test_order_of_the_particles_does_not_matter():
    packing = random_disks(5)
    order = np.random.default_rng(11).permutation(packing.count)
    one, other = (
        effective_conductivity(medium_of(overlap_contacts(p))).tensor for p in (packing, packing.select(order))
    )
    np.testing.assert_allclose(np.diag(one), np.diag(other), rtol=1e-12)


def test_quarter_turn_swaps_the_axes():
    packing = random_disks(6)
    turned = ParticlePacking(
        np.stack([1.0 - packing.centers[:, 1], packing.centers[:, 0]], axis=1), packing.radii, packing.box
    )
    one, other = (effective_conductivity(medium_of(overlap_contacts(p))).tensor for p in (packing, turned))
    np.testing.assert_allclose(np.diag(one), np.diag(other)[::-1], rtol=1e-11)


def test_energy_equals_both_wall_flows_and_temperatures_obey_the_maximum_principle():
    result = effective_conductivity(medium_of(overlap_contacts(random_disks(7, count=400))), axes=(0,))
    heat_in, heat_out = result.solutions[0].wall_heat()
    assert heat_in == pytest.approx(result.tensor[0, 0], rel=1e-10)
    assert heat_out == pytest.approx(result.tensor[0, 0], rel=1e-10)
    field = recover_field(result.solutions[0])
    assert field.particle_temperatures.min() > 0.0
    assert field.particle_temperatures.max() < 1.0
    assert result.solutions[0].positive_off_diagonals == 0


def test_methods_keep_their_order():
    """The uniform-flux resistance is the largest, the chord's the smallest."""
    network = overlap_contacts(random_disks(8))
    values = [
        effective_conductivity(medium_of(network), method=m, axes=(0,)).tensor[0, 0]
        for m in ("standard", "enhanced", "chord")
    ]
    assert values == sorted(values)


def test_dead_ends_change_nothing_and_take_the_temperature_of_their_contact():
    """A disk that hangs on a chain is isothermal at T_o + sum_j h_cj Q_j of the disk that holds it."""
    alpha = 0.1
    chain = [[0.25, 0.5], [0.75, 0.5]]
    box = Box((1.0, 1.0))
    bare = bonded_contacts(ParticlePacking(chain, [0.25, 0.25], box), alpha)
    hung = bonded_contacts(ParticlePacking([*chain, [0.25, 0.85], [0.25, 0.975]], [0.25, 0.25, 0.1, 0.025], box), alpha)
    one, other = (
        effective_conductivity(medium_of(bare), axes=(0,)),
        effective_conductivity(medium_of(hung), axes=(0,)),
    )
    assert hung.count == 3
    assert other.unknowns == one.unknowns == 1
    assert other.tensor[0, 0] == one.tensor[0, 0]
    field = recover_field(other.solutions[0])
    # by symmetry of the heated disk the contact at its top sees the mean temperature
    np.testing.assert_allclose(field.particle_temperatures, [0.75, 0.25, 0.75, 0.75], rtol=1e-12)


def test_no_path_means_zero_and_says_so():
    packing = ParticlePacking([[0.2, 0.5], [0.8, 0.5]], [0.2, 0.2], Box((1.0, 1.0)))
    result = effective_conductivity(medium_of(bonded_contacts(packing, 0.1)))
    assert np.diag(result.tensor).tolist() == [0.0, 0.0]
    assert result.spans == (False, False)
    assert result.missing_axes == "xy"
    temperatures = recover_field(result.solutions[0]).particle_temperatures
    assert temperatures.tolist() == [1.0, 0.0]  # each hangs on its wall


def test_single_disk_bridges_both_walls():
    packing = ParticlePacking([[0.5, 0.5]], [0.52], Box((1.0, 1.0)))
    alpha = np.arccos(0.5 / 0.52)
    result = effective_conductivity(medium_of(overlap_contacts(packing)), axes=(0,))
    disk = 2.0 * (self_resistance(alpha, "chord") - mutual_resistance(np.pi, alpha, alpha))
    assert result.unknowns == 0
    assert result.tensor[0, 0] == pytest.approx(1.0 / disk, rel=1e-12)


# --- periodic boxes -------------------------------------------------------------------------------


@pytest.mark.parametrize(("degrees", "exact", "error"), [(5, 0.62564, 5e-4), (10, 0.74811, 3e-3), (15, 0.84357, 9e-3)])
def test_bonded_hexagonal_lattice_is_isotropic_and_near_exact(hexagonal, degrees, exact, error):
    tensor = effective_conductivity(medium_of(bonded_contacts(hexagonal(), np.radians(degrees)))).tensor
    np.testing.assert_allclose(tensor, tensor[0, 0] * np.eye(2), atol=1e-14)
    assert tensor[0, 0] == pytest.approx(exact, rel=error)


@pytest.mark.parametrize("repeats", [(2, 1), (2, 2)])
def test_replicas_of_a_periodic_box_agree(repeats):
    packing = random_disks(21, (True, True), 25)
    nx, ny = repeats
    copies = [packing.centers + [i, j] for i in range(nx) for j in range(ny)]
    bigger = ParticlePacking(np.concatenate(copies), np.tile(packing.radii, nx * ny), Box((nx, ny), (True, True)))
    one, other = (effective_conductivity(medium_of(overlap_contacts(p))).tensor for p in (packing, bigger))
    np.testing.assert_allclose(one, other, atol=1e-13)
    assert one[0, 1] == one[1, 0] != 0.0


def test_translation_of_a_periodic_box_does_not_matter():
    packing = random_disks(22, (True, True), 36)
    moved = ParticlePacking(packing.centers + [0.37, 0.81], packing.radii, packing.box)
    one, other = (effective_conductivity(medium_of(overlap_contacts(p))).tensor for p in (packing, moved))
    np.testing.assert_allclose(one, other, atol=1e-13)


def test_periodic_axis_beside_walls():
    """A square lattice: the walled axis and the periodic axis give the same chain of disks."""
    network = bonded_contacts(
        ParticlePacking(
            [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]],
            [0.25] * 4,
            Box((1.0, 1.0), (False, True)),
        ),
        0.1,
    )
    assert load_groups(network.packing.box) == ((0,), (1,))
    tensor = effective_conductivity(medium_of(network)).tensor
    assert tensor[0, 0] == pytest.approx(tensor[1, 1], rel=1e-12)
    assert np.isnan(tensor[0, 1])


def test_single_periodic_disk_touches_its_own_images():
    network = bonded_contacts(ParticlePacking([[0.3, 0.9]], [0.5], Box((1.0, 1.0), (True, True))), 0.2)
    assert network.count == 2
    disk = 2.0 * (self_resistance(0.2, "chord") - mutual_resistance(np.pi, 0.2, 0.2))
    np.testing.assert_allclose(effective_conductivity(medium_of(network)).tensor, np.eye(2) / disk, atol=1e-14)


def test_periodic_temperatures_follow_the_gradient(hexagonal):
    packing = hexagonal(3, 2)
    solution = effective_conductivity(medium_of(bonded_contacts(packing, 0.1))).solutions[0]
    for load in (0, 1):
        field = recover_field(solution, load)
        difference = field.particle_temperatures - packing.centers[:, load]
        np.testing.assert_allclose(difference, difference[0], atol=1e-13)


# --- contact resistance and mixed materials -------------------------------------------------------


def test_contact_resistance_adds_to_a_chain():
    alpha, resistance = 0.1, 0.7
    packing = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    network = bonded_contacts(packing, alpha)
    disk = 2.0 * (self_resistance(alpha, "chord") - mutual_resistance(np.pi, alpha, alpha))
    result = effective_conductivity(medium_of(network.with_resistance(resistance)), axes=(0,))
    assert result.tensor[0, 0] == pytest.approx(1.0 / (2.0 * disk + 3.0 * resistance), rel=1e-12)
    per_contact = effective_conductivity(medium_of(network.with_resistance([0.7, 0.0, 0.2])), axes=(0,))
    assert per_contact.tensor[0, 0] == pytest.approx(1.0 / (2.0 * disk + 0.9), rel=1e-12)


def test_mixed_conductivities_add_in_a_chain():
    alpha = 0.1
    packing = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    disk = 2.0 * (self_resistance(alpha, "chord") - mutual_resistance(np.pi, alpha, alpha))
    result = effective_conductivity(medium_of(bonded_contacts(packing, alpha), [1.0, 4.0]), axes=(0,))
    assert result.tensor[0, 0] == pytest.approx(1.0 / (disk * 1.25), rel=1e-12)


# --- refusals -------------------------------------------------------------------------------------


def test_overlapping_arcs_are_refused_with_the_particle():
    packing = ParticlePacking([[0.5, 0.5], [0.85, 0.5], [0.7, 0.8]], [0.2, 0.15, 0.16], Box((1.0, 1.0)))
    with pytest.raises(GeometryError, match=r"two contact arcs of particle \d overlap"):
        solve_steady(medium_of(bonded_contacts(packing, np.radians(60.0), bond_gap=0.5)), (0,))


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_bad_conductivities_are_refused(value):
    network = overlap_contacts(random_disks(9))
    with pytest.raises(InputError, match=r"give a number of W/\(m K\) from 1e-100 to|must be positive and finite"):
        effective_conductivity(medium_of(network, value))


def test_wrong_number_of_conductivities_is_refused():
    with pytest.raises(InputError, match=r"shape \(64,\), found \(3,\)"):
        effective_conductivity(medium_of(overlap_contacts(random_disks(9)), [1.0, 2.0, 3.0]))


def test_a_row_that_wraps_around_one_axis_conducts_nothing_along_the_other():
    """The load across the row has no energy at all: 0, exactly, and no complaint of the solver."""
    row = [[0.1 + 0.2 * i, 0.5 + 0.01 * (-1) ** i] for i in range(10)]
    packing = ParticlePacking(row, [0.11] * 10, Box((2.0, 1.0), (True, True)))
    for method in ("chord", "arc"):
        result = effective_conductivity(medium_of(overlap_contacts(packing)), method=method)
        assert result.spans == (True, False)
        assert result.tensor[0, 0] > 0.0
        assert result.tensor[1].tolist() == result.tensor[:, 1].tolist() == [0.0, 0.0]
