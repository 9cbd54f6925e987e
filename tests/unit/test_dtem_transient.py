"""Discrete thermal elements that store heat: the element, its limits, whole systems."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.special import jn_zeros, jnp_zeros

from etc_engine.box import Box
from etc_engine.engines.dtem.field import recover_field
from etc_engine.engines.dtem.methods import find_method
from etc_engine.engines.dtem.steady import solve_steady
from etc_engine.engines.dtem.storage import readings_of_parts, storing_elements
from etc_engine.engines.dtem.transient import dipole_amplitudes
from etc_engine.errors import GeometryError, InputError
from etc_engine.laws.disk import mutual_resistance, self_resistance
from etc_engine.medium.backbone import find_backbone
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import bonded_contacts, overlap_contacts
from etc_engine.medium.sides import ContactSides
from etc_engine.medium.walls import Convective, FixedTemperature, HeatFlux, Insulated
from etc_engine.packing import PackingSpec, ParticlePacking, pack, parse_radii
from etc_engine.realization import transient_system
from etc_engine.solvers.marching import SCHEMES, critical_step, march
from etc_engine.structure.union import union_area

DEGREE = np.pi / 180.0
METHODS = ("chord", "standard", "enhanced", "arc")
STEP = {"left": FixedTemperature(1.0), "right": FixedTemperature(0.0)}


def one_disk(theta, alpha, resistance=0.0) -> ContactSides:
    """Sides of a single disk with contacts that lead to walls."""
    theta, alpha = np.asarray(theta, dtype=float), np.broadcast_to(np.asarray(alpha, dtype=float), len(theta)).copy()
    n = theta.size
    arms = np.stack([np.cos(theta), np.sin(theta)], axis=1)
    no_contacts = np.zeros((0, 2), dtype=np.int64)
    return ContactSides(
        np.array([0, n]),
        np.arange(n),
        arms,
        alpha,
        np.full(n, resistance),
        np.zeros(n),
        np.sin(alpha),
        np.ones(1),
        no_contacts,
        np.arange(n),
    )


def blocks(theta, alpha, method, dipoles, kappa=1.0, resistance=0.0, modes=None):
    """K_cc, K_cs, K_ss of the storing element of one disk."""
    sides = one_disk(theta, alpha, resistance)
    elements = storing_elements(sides, np.array([kappa]), method, dipoles=dipoles, modes=modes)
    size = elements.offsets[-1]
    K = elements.values.reshape(size, size)
    n = size - (3 if dipoles else 1)
    return K[:n, :n], K[:n, n:], K[n:, n:]


def step_response(theta, alpha, heat, fourier, dipoles, method="standard"):
    """Contact temperatures above the mean after a step of heat; kappa = R = rho c = 1, whole disk."""
    A, B, D = blocks(theta, alpha, method, dipoles)
    inverse, states = np.linalg.inv(A), D.shape[0]
    capacity = np.pi / states
    augmented = np.zeros((states + 1, states + 1))
    augmented[:states, :states] = -(D - B.T @ inverse @ B) / capacity
    augmented[:states, states] = -(B.T @ inverse @ heat) / capacity
    found = []
    for time in fourier:
        x = expm(augmented * time)[:states, states]
        found.append(inverse @ (np.asarray(heat) - B @ x) - x.mean())
    return np.array(found)


def exact_step_response(theta, alpha, heat, fourier, modes=1200, transients=60):
    """The same by the Fourier-Bessel series of a disk under a step of uniform flux over its arcs.

    Mode k answers q_k [1/k - sum_n 2 exp(-j'^2 Fo)/(j'^2 - k^2)] at the rim (Carslaw and Jaeger 1959, section 7.8), j'
    the zeros of J_k'; mode 0 answers 1/4 - sum_n 2 exp(-j^2 Fo)/j^2 above the mean, j those of J_1.
    """
    k = np.arange(1, modes)
    response = np.repeat(1.0 / k[None], len(fourier), axis=0)
    for m in range(1, 60):
        zeros = jnp_zeros(m, transients) ** 2
        response[:, m - 1] -= (2 * np.exp(-np.outer(fourier, zeros)) / (zeros - m * m)).sum(axis=1)
    zeros = jn_zeros(1, 100) ** 2
    uniform = 0.25 - (2 * np.exp(-np.outer(fourier, zeros)) / zeros).sum(axis=1)
    theta = np.asarray(theta)
    shape = np.sinc(k * alpha / np.pi) ** 2 * np.cos(k * (theta[:, None] - theta)[..., None])
    return (uniform * np.sum(heat) / (2 * np.pi))[:, None] + np.einsum("ijk,tk,j->ti", shape, response, heat) / np.pi


def fitting_arcs(draw_alpha, gaps):
    """Arcs about a circle of given half-angles with the rest of it shared out by the gaps."""
    alpha, gaps = np.asarray(draw_alpha), np.asarray(gaps)
    gaps = gaps * (2 * np.pi - 2 * alpha.sum()) / gaps.sum()
    theta = np.cumsum(np.concatenate([[0.0], (alpha[:-1] + gaps[:-1] + alpha[1:])]))
    return theta, alpha


ARCS = st.lists(st.tuples(st.floats(0.02, 0.35), st.floats(0.2, 1.0)), min_size=1, max_size=6).map(
    lambda pairs: fitting_arcs([a for a, _ in pairs], [g for _, g in pairs])
)


@pytest.mark.parametrize("dipoles", [False, True])
@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=15)
@given(arcs=ARCS, kappa=st.floats(0.1, 10.0), resistance=st.floats(0.0, 2.0))
def test_element_is_symmetric_semi_definite_and_at_rest_the_steady_one(method, dipoles, arcs, kappa, resistance):
    K_cc, K_cs, K_ss = blocks(*arcs, method, dipoles, kappa, resistance)
    K = np.block([[K_cc, K_cs], [K_cs.T, K_ss]])
    np.testing.assert_allclose(K, K.T, atol=1e-14 * np.abs(K).max())
    assert np.linalg.eigvalsh(K).min() > -1e-12 * np.abs(K).max()
    # a common temperature (mode 0 of every contact, all states) drives nothing
    modes = find_method(method).modes
    common = np.concatenate([np.arange(K_cc.shape[0]) % modes == 0, np.ones(K_ss.shape[0])])
    np.testing.assert_allclose(K @ common, 0.0, atol=1e-11 * np.abs(K).max())
    if arcs[0].size < 2:
        return
    steady = find_method(method).elements(one_disk(*arcs, resistance), np.array([kappa]), modes)
    at_rest = K_cc - K_cs @ np.linalg.solve(K_ss, K_cs.T)
    np.testing.assert_allclose(at_rest.ravel(), steady.values, atol=1e-11 * np.abs(K).max())


@pytest.mark.parametrize("method", ["chord", "standard", "enhanced"])
def test_element_is_the_inverse_of_the_shifted_resistances(method):
    """A = (H - ln 2/(pi kappa) e e^T + e e^T/(8 pi kappa) + diag R_c)^-1, element [A, -A e; -e^T A, e^T A e]."""
    theta, alpha, kappa, resistance = np.array([0.2, 1.9, 4.0]), np.array([0.1, 0.3, 0.2]), 2.5, 0.7
    off = ~np.eye(3, dtype=bool)
    H = np.diag(self_resistance(alpha, method))
    separation = theta[:, None] - theta
    H[off] = mutual_resistance(separation[off], *(v[off] for v in np.broadcast_arrays(alpha[:, None], alpha)))
    A = np.linalg.inv((H - np.log(2) / np.pi + 1 / (8 * np.pi)) / kappa + resistance * np.eye(3))
    K_cc, K_cs, K_ss = blocks(theta, alpha, method, False, kappa, resistance)
    np.testing.assert_allclose(K_cc, A, rtol=1e-12)
    np.testing.assert_allclose(K_cs[:, 0], -A.sum(axis=1), rtol=1e-11)
    np.testing.assert_allclose(K_ss, A.sum(), rtol=1e-11)


@pytest.mark.parametrize("angles, heat", [((0, 110, 230), (1, 0.4, -0.6)), ((0,), (1,)), ((0, 90), (1, 1))])
@pytest.mark.parametrize("dipoles", [False, True])
def test_a_disk_after_a_step_of_heat_settles_on_its_series(angles, heat, dipoles):
    theta, heat, late = np.array(angles) * DEGREE, np.array(heat, dtype=float), [4.0]
    found = step_response(theta, 10 * DEGREE, heat, late, dipoles)
    np.testing.assert_allclose(found, exact_step_response(theta, 10 * DEGREE, heat, late), atol=3e-6)


@pytest.mark.parametrize(
    "angles, heat, without, with_dipoles",
    [
        ((0,), (1,), (0.9, 1.12), (0.25, 0.30)),
        ((0, 180), (1, -1), (1.05, 1.25), (0.11, 0.13)),
        ((0, 110, 230), (1, 0.4, -0.6), (1.0, 1.2), (0.22, 0.26)),
        ((0, 90), (1, 1), (0.9, 1.15), (0.14, 0.16)),
        # two opposite equal sources have no dipole: what is left out is the quadrupole, both times
        ((0, 180), (1, 1), (0.33, 0.42), (0.33, 0.42)),
    ],
)
@pytest.mark.parametrize("alpha", [5.0, 10.0, 20.0])
def test_fourier_number_from_which_the_error_is_below_one_per_cent(angles, heat, without, with_dipoles, alpha):
    """Largest error of T_i - T_o over its largest final value, after a step of heat."""
    theta, heat = np.array(angles) * DEGREE, np.array(heat, dtype=float)
    fourier = np.geomspace(0.05, 2.5, 300)
    exact = exact_step_response(theta, alpha * DEGREE, heat, fourier, modes=600)
    for dipoles, (low, high) in ((False, without), (True, with_dipoles)):
        found = step_response(theta, alpha * DEGREE, heat, fourier, dipoles)
        error = np.abs(found - exact).max(axis=1) / np.abs(exact[-1]).max()
        reached = fourier[np.flatnonzero(error > 0.01)[-1] + 1]
        assert low <= reached <= high


def test_a_dipole_decays_at_24_over_7_close_to_the_disks_own_rate():
    *_, K_ss = blocks([], [], "chord", True)
    rates, vectors = np.linalg.eigh(3.0 * K_ss / np.pi)
    np.testing.assert_allclose(rates, [0.0, 24 / 7, 24 / 7], atol=1e-13)
    assert rates[2] == pytest.approx(jnp_zeros(1, 1)[0] ** 2, rel=0.012)
    assert np.abs(readings_of_parts(2)[1:] @ vectors[:, 0]).max() < 1e-15


def critical_half_angle(contacts, dipoles):
    """Half-angle of evenly spread contacts at which ``chord`` stops to be positive definite, by bisection."""
    theta = 2 * np.pi * np.arange(contacts) / contacts
    low, high = 30.0, min(89.9, 179.9 / contacts)
    while high - low > 0.01:
        middle = 0.5 * (low + high)
        try:
            blocks(theta, middle * DEGREE, "chord", dipoles)
            low = middle
        except GeometryError:
            high = middle
    return low


@pytest.mark.parametrize(
    "contacts, plain, dipoles", [(1, 75.1, 48.4), (2, 55.2, 40.0), (3, 46.5, 46.5), (4, 43.2, 43.2)]
)
def test_chord_is_refused_where_it_loses_positive_definiteness(contacts, plain, dipoles):
    assert critical_half_angle(contacts, False) == pytest.approx(plain, abs=0.15)
    assert critical_half_angle(contacts, True) == pytest.approx(dipoles, abs=0.15)


def test_refusal_says_which_particle_and_what_to_do():
    with pytest.raises(
        GeometryError, match=r"particle 0 with 1 contact\(s\) of half-angles up to 80 degrees .* smaller"
    ):
        blocks([0.0], [80 * DEGREE], "chord", False)
    with pytest.raises(GeometryError, match="leave the dipoles out"):
        blocks([0.0], [60 * DEGREE], "chord", True)
    blocks([0.0], [80 * DEGREE], "standard", True)
    with pytest.raises(InputError, match="exact has no transient form"):
        blocks([0.0], [0.1], "exact", False)


@pytest.fixture(scope="module")
def random_network():
    spec = PackingSpec("advancing-front", parse_radii("uniform:0.03:0.05"), Box((1.0, 1.0)))
    return bonded_contacts(pack(spec, np.random.default_rng(5)), 8 * DEGREE, 1e-3)


@pytest.mark.parametrize("dipoles", [False, True])
@pytest.mark.parametrize("method", METHODS)
def test_at_large_times_it_is_the_steady_method(random_network, feng_particles, method, dipoles):
    """With ``arc`` on the backbone alone: fluxes of no sum enter dead ends, which the steady solver leaves out."""
    if method == "arc":
        backbone = find_backbone(random_network, (0,))
        random_network = random_network.select(backbone.contacts, backbone.wall_contacts)
    for network in (overlap_contacts(feng_particles), random_network):
        rng = np.random.default_rng(3)
        kappa = rng.uniform(0.5, 2.0, network.packing.count)
        resistance = rng.uniform(0.0, 0.5, network.count + network.walls.size)
        medium = medium_of(network.with_resistance(resistance), kappa, heat_capacity=1.0)
        system = transient_system(medium, STEP, method=method, dipoles=dipoles)
        *_, late = march(system.heat, system.initial(0.3), [0.0, 1e7], steps=5, scheme="backward-euler")
        solution = solve_steady(medium, (0,), method=method, tolerance=1e-12)
        steady = recover_field(solution)
        known = np.isfinite(steady.particle_temperatures)
        found = system.particle_temperatures(late.temperatures)
        np.testing.assert_allclose(found[known], steady.particle_temperatures[known], atol=1e-8)
        flows = system.flows(late.time, late.temperatures)
        np.testing.assert_allclose(flows[system.sides.of_contacts[:, 1]], steady.contact_flows, atol=1e-8)
        left = system.heat.rates(late.time, late.temperatures)[0]
        assert left == pytest.approx(solution.energies[0, 0], rel=1e-8)


@pytest.mark.parametrize("dipoles", [False, True])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_energy_balance_of_every_scheme_with_all_kinds_of_walls(feng_particles, scheme, dipoles):
    walls = {
        "left": FixedTemperature(lambda t: 1.0 + np.sin(20.0 * t)),
        "right": Convective(3.0, lambda t: -t),
        "bottom": HeatFlux(lambda t: np.cos(10.0 * t)),
        "top": Insulated(),
    }
    network = overlap_contacts(feng_particles)
    system = transient_system(
        medium_of(network, heat_capacity=1.0),
        walls,
        dipoles=dipoles,
        source=lambda t: np.full(12, 0.1 * t),
    )
    control = {"steps": 20}
    if scheme == "adaptive":
        control = {"tolerance": 1e-3}
    elif scheme == "explicit-euler":
        control = {"step": 0.9 * critical_step(system.heat)}
    times = [0.0, 0.02, 0.04]
    for state in march(system.heat, system.initial(lambda x: x[:, 0]), times, scheme=scheme, **control):
        assert abs(state.imbalance) < 1e-12
    means = system.particle_temperatures(state.temperatures) - feng_particles.centers[:, 0]
    assert network.cut_measures(prescribed=True) @ means == pytest.approx(state.stored, abs=1e-12)
    assert np.all(state.heat[[0, 2, 4]] != 0.0)


def test_contact_flows_feed_the_particles(random_network):
    """Equal and opposite at a contact; with the source they are what each particle stores."""
    network = random_network
    source = np.linspace(0.0, 1.0, network.packing.count)
    capacity = 2.0 * network.cut_measures(prescribed=True)
    for dipoles in (False, True):
        system = transient_system(medium_of(network, heat_capacity=2.0), STEP, dipoles=dipoles, source=source)
        *_, state = march(system.heat, system.initial(0.0), [0.0, 0.01], scheme="adaptive", tolerance=1e-5)
        flows = system.flows(state.time, state.temperatures)
        np.testing.assert_allclose(flows[system.sides.of_contacts].sum(axis=1), 0.0, atol=1e-11)
        into = np.bincount(system.sides.particles, flows, minlength=network.packing.count) + source
        slope = system.heat.slope(state.time, state.temperatures)[-capacity.size * system.states :]
        np.testing.assert_allclose(slope.reshape(-1, system.states).sum(axis=1), into, atol=1e-11)
        rates = system.heat.rates(state.time, state.temperatures)
        walls = network.walls[system.wall_contacts]
        at_walls = np.bincount(walls, flows[system.sides.of_walls], minlength=4)
        np.testing.assert_allclose(rates, [*at_walls, source.sum()], atol=1e-11)


def test_plates_of_walls_come_to_rest_as_resistances_in_series():
    """Two disks in a row, heat q L in through a plate at the left, out through a film at the right."""
    alpha, q, film, ambient, kappa, contact = 0.2, 3.0, 5.0, 300.0, 2.0, 0.4
    network = bonded_contacts(ParticlePacking([[0.5, 1.0], [1.5, 1.0]], [0.5, 0.5], Box((2.0, 2.0))), alpha)
    walls = {"left": HeatFlux(q), "right": Convective(film, ambient)}
    half = (self_resistance(alpha, "chord") - mutual_resistance(np.pi, alpha, alpha)) / kappa  # centre to contact
    for dipoles in (False, True):
        system = transient_system(
            medium_of(network.with_resistance(contact), kappa, heat_capacity=1.0), walls, dipoles=dipoles
        )
        *_, late = march(system.heat, system.initial(0.0), [0.0, 1e6], steps=5, scheme="backward-euler")
        heat = 2.0 * q
        last = ambient + heat / (2.0 * film) + heat * (contact + half)
        expected = [last + heat * (contact + 2.0 * half), last]
        np.testing.assert_allclose(system.particle_temperatures(late.temperatures), expected, rtol=1e-10)
        np.testing.assert_allclose(system.heat.rates(late.time, late.temperatures), [heat, -heat, 0, 0, 0], atol=1e-7)


def test_particles_without_contacts_keep_their_heat_and_a_source_warms_them():
    packing = ParticlePacking([[0.1, 0.1], [0.5, 0.5]], [0.1, 0.2], Box((2.0, 2.0)))
    system = transient_system(
        medium_of(bonded_contacts(packing, 0.1), heat_capacity=1.0), {}, dipoles=True, source=[0.0, 1.0]
    )
    *_, late = march(system.heat, system.initial([5.0, 1.0]), [0.0, 0.3], steps=10)
    np.testing.assert_allclose(
        system.particle_temperatures(late.temperatures), [5.0, 1.0 + 0.3 / (0.04 * np.pi)], rtol=1e-12
    )
    np.testing.assert_allclose(dipole_amplitudes(system, late.temperatures), 0.0, atol=1e-12)


@pytest.mark.parametrize("dipoles", [False, True])
def test_units_scale_out(feng_particles, dipoles):
    """T depends on kappa t/(rho c R^2) alone: another unit of length, another material."""
    scaled = ParticlePacking(feng_particles.centers * 40.0, feng_particles.radii * 40.0, Box((40.0, 40.0)))
    systems = (
        transient_system(medium_of(overlap_contacts(feng_particles), heat_capacity=1.0), STEP, dipoles=dipoles),
        transient_system(medium_of(overlap_contacts(scaled), 7.0, heat_capacity=0.2), STEP, dipoles=dipoles),
    )
    ends = []
    for system, span in zip(systems, (0.02, 0.02 * 0.2 / 7.0 * 1600.0), strict=True):
        *_, last = march(system.heat, system.initial(0.5), [0.0, span], steps=20)
        ends.append(system.particle_temperatures(last.temperatures))
    np.testing.assert_allclose(*ends, rtol=1e-10)


@pytest.mark.parametrize("dipoles", [False, True])
def test_turned_packing_has_turned_temperatures(feng_particles, dipoles):
    turned = ParticlePacking(
        np.stack([1.0 - feng_particles.centers[:, 1], feng_particles.centers[:, 0]], axis=1),
        feng_particles.radii,
        feng_particles.box,
    )
    ends = []
    for packing, walls in ((feng_particles, ("left", "right")), (turned, ("bottom", "top"))):
        conditions = dict(zip(walls, STEP.values(), strict=True))
        system = transient_system(medium_of(overlap_contacts(packing), heat_capacity=1.0), conditions, dipoles=dipoles)
        *_, last = march(system.heat, system.initial(0.0), [0.0, 0.02], steps=20)
        ends.append(last.temperatures)
        amplitudes = dipole_amplitudes(system, last.temperatures)
        ends.append(np.hypot(*amplitudes.T))
        ends[-2] = system.particle_temperatures(last.temperatures)
    np.testing.assert_allclose(ends[0], ends[2], atol=1e-12)
    np.testing.assert_allclose(ends[1], ends[3], atol=1e-12)


def test_periodic_row_of_two_disks_exchanges_heat_both_ways_round():
    box = Box((2.0, 3.0), (True, False))
    network = bonded_contacts(ParticlePacking([[0.5, 1.5], [1.5, 1.5]], [0.5, 0.5], box), 0.2)
    system = transient_system(medium_of(network, heat_capacity=1.0), {})
    states = list(march(system.heat, system.initial([1.0, 0.0]), [0.0, 1.0, 2.0], scheme="adaptive", tolerance=1e-9))
    gaps = [float(np.diff(system.particle_temperatures(s.temperatures))[0]) for s in states]
    # S = Q_1 + Q_2 = 2 Q warms the disk; T_c - T_o = (h'_11 + h'_12) Q + S/(8 pi), both contacts at 1/2
    h = float(self_resistance(0.2, "chord") + mutual_resistance(np.pi, 0.2, 0.2)) - 2 * np.log(2) / np.pi
    rate = 2.0 / (h + 1 / (4 * np.pi)) / network.cut_measures(prescribed=True)[0]
    np.testing.assert_allclose(gaps, -np.exp(-rate * np.arange(3.0)), atol=1e-6)


@settings(max_examples=10)
@given(seed=st.integers(0, 10**6))
def test_stored_areas_add_up_to_the_union(seed):
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(np.arange(5), np.arange(5), indexing="ij"), axis=-1).reshape(-1, 2) + 0.5
    packing = ParticlePacking((grid + 0.05 * rng.uniform(-1, 1, grid.shape)) / 5, np.full(25, 0.11), Box((1.0, 1.0)))
    assert overlap_contacts(packing).cut_measures(prescribed=False).sum() == pytest.approx(
        union_area(packing), rel=1e-12
    )


def test_prescribed_arcs_cut_disks_with_chord_only():
    network = bonded_contacts(ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0))), 0.3)
    whole = 0.25 * np.pi
    assert network.cut_measures(prescribed=False)[0] == pytest.approx(whole)
    assert network.cut_measures(prescribed=True)[0] == pytest.approx(
        whole - 4 * 0.25 * (0.3 - np.sin(0.3) * np.cos(0.3))
    )


@pytest.mark.parametrize("dipoles", [False, True])
def test_bigger_system_is_marched_by_multigrid(dipoles):
    spec = PackingSpec("advancing-front", parse_radii("uniform:0.0045:0.0075"), Box((1.0, 1.0)))
    network = bonded_contacts(pack(spec, np.random.default_rng(8)), 6 * DEGREE, 1e-3)
    system = transient_system(medium_of(network, heat_capacity=1.0), STEP, dipoles=dipoles)
    assert system.heat.capacity.size > 20_000
    *_, state = march(system.heat, system.initial(0.0), [0.0, 0.004], steps=4, scheme="backward-euler")
    assert abs(state.imbalance) < 1e-12
    assert state.iterations < 35 * state.steps
    means = system.particle_temperatures(state.temperatures)
    touching = network.wall_particles[network.walls == 0]
    assert means[touching].min() > 0.05
    assert -0.01 < means.min() <= means.max() < 1.0


def test_bad_input_is_refused(feng_particles):
    network = overlap_contacts(feng_particles)
    with pytest.raises(InputError, match="unknown wall 'middle'"):
        transient_system(medium_of(network, heat_capacity=1.0), {"middle": Insulated()})
    with pytest.raises(InputError, match="heat capacity must be positive"):
        transient_system(medium_of(network, heat_capacity=0.0), STEP)
    with pytest.raises(InputError, match="source must be one finite number or 12"):
        transient_system(medium_of(network, heat_capacity=1.0), STEP, source=[1.0, 2.0])
    with pytest.raises(InputError, match="initial temperature must be one finite number or 12"):
        transient_system(medium_of(network, heat_capacity=1.0), STEP).initial([1.0])
    alone = bonded_contacts(ParticlePacking([[0.5, 0.5]], [0.2], Box((1.0, 1.0))), 0.1)
    with pytest.raises(InputError, match="no particle touches the left wall"):
        transient_system(medium_of(alone, heat_capacity=1.0), {"left": HeatFlux(1.0)})


def test_results_do_not_depend_on_the_scheme(random_network):
    system = transient_system(medium_of(random_network, heat_capacity=1.0), STEP, dipoles=True)
    ends = []
    for scheme, control in (("bdf2", {"steps": 400}), ("adaptive", {"tolerance": 1e-6})):
        *_, last = march(system.heat, system.initial(0.0), [0.0, 0.02], scheme=scheme, **control)
        ends.append(system.particle_temperatures(last.temperatures))
    for one, other in pairwise(ends):
        np.testing.assert_allclose(one, other, atol=2e-5)
