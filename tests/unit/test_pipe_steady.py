from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components

from etc_engine.box import Box
from etc_engine.engines.pipe.field import pipe_field
from etc_engine.engines.pipe.steady import pipe_conductivity
from etc_engine.errors import ConvergenceError, GeometryError, InputError
from etc_engine.laws.disk import chord_resistance, standard_resistance
from etc_engine.medium.conductances import contact_conductances, mean_field_conductivity
from etc_engine.medium.conductivity import check_balance
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import bonded_contacts, overlap_contacts
from etc_engine.packing import PackingSpec, ParticlePacking, pack, parse_radii
from etc_engine.realization import effective_conductivity


@pytest.fixture(scope="module")
def random_network():
    spec = PackingSpec("advancing-front", parse_radii("uniform:0.02:0.04"), Box((1.0, 1.0)))
    return bonded_contacts(pack(spec, np.random.default_rng(11)), np.radians(8.0), 1e-3)


@pytest.fixture(scope="module")
def periodic_network():
    spec = PackingSpec(
        "lubachevsky-stillinger", parse_radii("uniform:1:2"), Box((1.0, 1.0), (True, True)), density=0.8, count=60
    )
    return bonded_contacts(pack(spec, np.random.default_rng(5)), np.radians(8.0), 0.05)


def dense_solution(network, conductance, wall_conductance, axis):
    """Temperatures by a dense solve of the whole graph, clusters without a driven wall left out."""
    n = network.packing.count
    K, b = np.zeros((n, n)), np.zeros(n)
    for (i, j), c in zip(network.pairs, conductance, strict=True):
        K[[i, j], [i, j]] += c
        K[[i, j], [j, i]] -= c
    touched = np.zeros(n, dtype=bool)
    for row in network.walls_of(axis):
        p, c = network.wall_particles[row], wall_conductance[row]
        K[p, p] += c
        b[p] += c * (1 - network.walls[row] % 2)
        touched[p] = True
    _, labels = connected_components(K != 0)
    live = np.isin(labels, labels[touched])
    T = np.full(n, np.nan)
    T[live] = np.linalg.solve(K[np.ix_(live, live)], b[live])
    return T


@pytest.mark.parametrize(("resistance", "published"), [("uniform", 0.26378), ("chord", 0.27433)])
def test_twelve_particle_assembly(feng_particles, resistance, published):
    result = pipe_conductivity(medium_of(overlap_contacts(feng_particles)), method=resistance, axes=(0,))
    assert result.tensor[0, 0] == pytest.approx(published, abs=5e-6)
    assert result.unknowns == 12
    assert result.missing_axes == ""


@pytest.mark.parametrize("resistance", ["uniform", "chord"])
def test_two_disks_in_series_by_hand(resistance):
    alpha = 0.2
    packing = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    network = bonded_contacts(packing, alpha)
    h = {"uniform": standard_resistance, "chord": chord_resistance}[resistance](alpha)
    medium = medium_of(network.with_resistance([0.1, 0.2, 0.3]), [2.0, 3.0])
    # walls carry all of their contact resistance on the particle's side
    total = 2.0 * h / 2.0 + 2.0 * h / 3.0 + 0.6
    result = pipe_conductivity(medium, method=resistance)
    assert result.tensor[0, 0] == pytest.approx(1.0 / total, rel=1e-12)
    T = result.solutions[0].temperatures[:, 0]
    assert T[0] == pytest.approx(1.0 - (h / 2.0 + 0.2) / total, rel=1e-12)
    field = pipe_field(medium, resistance, result.solutions[0])
    assert field.face_temperatures[0] == pytest.approx([T[0] - h / 2 / total, T[1] + h / 3 / total], rel=1e-12)
    assert field.contact_temperatures[0] == pytest.approx(field.face_temperatures[0].mean(), rel=1e-12)
    assert field.wall_temperatures.tolist() == [1.0, 0.0]


def test_walls_against_a_dense_graph_laplacian(random_network):
    C, C_wall = contact_conductances(medium_of(random_network.with_resistance(0.3), 2.0))
    result = pipe_conductivity(medium_of(random_network.with_resistance(0.3), 2.0), tolerance=1e-14)
    assert (result.tensor[0, 0] > 0.0) & (result.tensor[1, 1] > 0.0)
    for axis, solution in enumerate(result.solutions):
        T = dense_solution(random_network, C, C_wall, axis)
        assert solution.temperatures[:, 0] == pytest.approx(T, abs=1e-10, nan_ok=True)
        i, j = random_network.pairs.T
        flows = C * (T[i] - T[j])
        assert solution.flows[:, 0] == pytest.approx(np.where(np.isnan(flows), 0.0, flows), abs=1e-10)
        low = random_network.walls == 2 * axis
        heat = (C_wall * (1.0 - T[random_network.wall_particles]))[low].sum()
        assert result.tensor[axis, axis] == pytest.approx(heat, rel=1e-10)


def test_periodic_tensor_is_symmetric_and_a_replica_has_the_same(periodic_network):
    result = pipe_conductivity(medium_of(periodic_network))
    k = result.tensor
    assert k[0, 1] == k[1, 0]
    assert np.linalg.eigvalsh(k).min() > 0.0
    packing = periodic_network.packing
    twice = ParticlePacking(
        np.concatenate([packing.centers, packing.centers + [1.0, 0.0]]),
        np.tile(packing.radii, 2),
        Box((2.0, 1.0), (True, True)),
    )
    replica = bonded_contacts(twice, np.radians(8.0), 0.05)
    assert replica.count == 2 * periodic_network.count
    assert pipe_conductivity(medium_of(replica)).tensor == pytest.approx(k, rel=1e-9)
    shifted = ParticlePacking(packing.centers + [0.31, 0.77], packing.radii, packing.box)
    assert pipe_conductivity(medium_of(bonded_contacts(shifted, np.radians(8.0), 0.05))).tensor == pytest.approx(
        k, rel=1e-9
    )


def test_periodic_energy_is_the_flux_and_below_the_mean_field(periodic_network):
    result = pipe_conductivity(medium_of(periodic_network), tolerance=1e-14)
    solution = result.solutions[0]
    # mean flux against the gradient: k_ab = -(1/A) sum_c q_ca b_cb
    flux = -(solution.flows.T @ periodic_network.branches) / periodic_network.packing.box.volume
    assert flux == pytest.approx(result.tensor, rel=1e-6)
    bound = mean_field_conductivity(medium_of(periodic_network))
    assert 0.5 * np.trace(result.tensor) < bound


def test_hexagonal_lattice_is_affine(hexagonal):
    """Every particle follows the mean gradient: k is the mean field of the pipe network exactly."""
    network = bonded_contacts(hexagonal(2, 2), 0.1)
    k = pipe_conductivity(medium_of(network)).tensor
    assert k == pytest.approx(np.eye(2) * mean_field_conductivity(medium_of(network)), rel=1e-10, abs=1e-12)
    # three contacts a disk of unit diameter in an area of sqrt(3)/2
    C = 1.0 / (2.0 * chord_resistance(0.1))
    assert k[0, 0] == pytest.approx(1.5 * C / (0.5 * np.sqrt(3.0)), rel=1e-10)


def test_a_disk_bonded_to_its_own_images():
    disk = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0), (True, True)))
    network = bonded_contacts(disk, 0.1)
    assert pipe_conductivity(medium_of(network)).tensor == pytest.approx(
        np.eye(2) / (2.0 * chord_resistance(0.1)), rel=1e-12
    )


def test_nothing_spans():
    packing = ParticlePacking([[0.25, 0.5], [0.8, 0.5]], [0.25, 0.1], Box((1.0, 1.0)))
    medium = medium_of(bonded_contacts(packing, 0.1))
    result = pipe_conductivity(medium)
    assert result.tensor[0, 0] == 0.0
    assert result.missing_axes == "xy"
    assert result.unknowns == 0
    assert result.solutions[0].temperatures[0, 0] == 1.0  # hangs on the hot wall
    assert np.isnan(result.solutions[0].temperatures[1, 0])
    field = pipe_field(medium, "chord", result.solutions[0])
    assert field.wall_flows.tolist() == [0.0]


def test_scaling_with_the_conductivity(random_network):
    plain = pipe_conductivity(medium_of(random_network), axes=(0,)).tensor[0, 0]
    assert pipe_conductivity(medium_of(random_network, 7.0), axes=(0,)).tensor[0, 0] == pytest.approx(7.0 * plain)
    assert np.isnan(pipe_conductivity(medium_of(random_network), axes=(0,)).tensor[1, 1])


def test_errs_by_a_few_per_cent_against_the_thermal_elements(random_network):
    pipe = pipe_conductivity(medium_of(random_network), axes=(0,)).tensor[0, 0]
    chord = effective_conductivity(medium_of(random_network), axes=(0,)).tensor[0, 0]
    assert 0.001 < abs(pipe / chord - 1.0) < 0.2


def test_dead_ends_take_the_temperature_they_hang_on():
    packing = ParticlePacking([[0.25, 0.5], [0.75, 0.5], [0.75, 0.85]], [0.25, 0.25, 0.1], Box((1.0, 1.0)))
    solution = pipe_conductivity(medium_of(bonded_contacts(packing, 0.1)), axes=(0,)).solutions[0]
    assert solution.reports[0].unknowns == 2
    assert solution.temperatures[2, 0] == solution.temperatures[1, 0]


def test_what_is_refused(random_network):
    with pytest.raises(InputError, match="the pipe network has no method 'round'"):
        pipe_conductivity(medium_of(random_network), method="round")
    with pytest.raises(InputError, match="the conductivity must be positive"):
        pipe_conductivity(medium_of(random_network, 0.0))
    with pytest.raises(GeometryError, match="overlap"):
        pipe_conductivity(medium_of(random_network.with_half_angle(np.radians(40.0))))
    with pytest.raises(ConvergenceError, match="do not balance"):
        check_balance(1.0, 1.1, 1.0)
