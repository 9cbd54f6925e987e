"""Spheres by the discrete thermal element method and the pipe network: invariants, exact cases, bad input."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import spherical_jn

from etc_engine.box import Box
from etc_engine.engines.dtem.closed_form import closed_form_resistances
from etc_engine.engines.dtem.conductivity import conductivity_curve
from etc_engine.engines.dtem.field import recover_field
from etc_engine.engines.dtem.steady import solve_steady
from etc_engine.engines.dtem.storage import readings_of_parts, storing_elements
from etc_engine.engines.pipe.steady import pipe_conductivity
from etc_engine.errors import GeometryError, InputError
from etc_engine.laws.sphere import chord_resistance, mutual_resistance, standard_resistance
from etc_engine.medium.conductances import contact_conductances, mean_field_conductivity
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import bonded_contacts, coordination_contacts, overlap_contacts
from etc_engine.medium.sides import contact_sides
from etc_engine.medium.walls import FixedTemperature
from etc_engine.packing.algorithms import PackingSpec, pack
from etc_engine.packing.particles import ParticlePacking
from etc_engine.packing.radii import parse_radii
from etc_engine.realization import effective_conductivity, transient_system
from etc_engine.solvers.marching import march

METHODS = ("chord", "standard")


def packed(periodic: str, seed: int = 5, density: float = 0.5) -> ParticlePacking:
    """Overlapping spheres of several sizes: a packing below its density, grown by 6 %."""
    spec = PackingSpec(
        "lubachevsky-stillinger",
        radii=parse_radii("uniform:0.8:1.2"),
        box=Box((1.0, 1.0, 1.0), tuple(axis in periodic for axis in "xyz")),
        count=60,
        density=density,
    )
    packing = pack(spec, np.random.default_rng(seed))
    return ParticlePacking(packing.centers, packing.radii * 1.06, packing.box)


@pytest.fixture(scope="module")
def periodic() -> ParticlePacking:
    return packed("xyz")


@pytest.fixture(scope="module")
def walled() -> ParticlePacking:
    return packed("")


def test_a_chain_of_spheres_has_its_exact_conductance():
    chain = ParticlePacking([[0.5, 0.5, 0.5], [1.5, 0.5, 0.5], [2.5, 0.5, 0.5]], [0.5] * 3, Box((3.0, 1.0, 1.0)))
    alpha = 0.2
    for method, own in (("chord", chord_resistance), ("standard", standard_resistance)):
        found = effective_conductivity(medium_of(bonded_contacts(chain, alpha), 2.0), method=method, axes=(0,))
        through = 2.0 * (own(alpha) - mutual_resistance(-1.0, alpha, alpha, method)) / (2.0 * 0.5)
        assert found.tensor[0, 0] == pytest.approx(3.0 / (3.0 * through), rel=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_energy_equals_the_flux_in_and_out(walled, method):
    for axis in range(3):
        solution = solve_steady(medium_of(overlap_contacts(walled)), (axis,), method=method)
        at_wall = solution.sides.nodes >= int(solution.backbone.contacts.sum())
        hot = at_wall & (solution.temperatures[:, 0] == 1.0)
        into, out = solution.heat_flows[hot, 0].sum(), -solution.heat_flows[at_wall & ~hot, 0].sum()
        assert into == pytest.approx(out, rel=1e-9)
        assert solution.energies[0, 0] == pytest.approx(into, rel=1e-9)
        assert solution.positive_off_diagonals == 0


def turned(packing: ParticlePacking, axes: list[int], signs: list[float]) -> ParticlePacking:
    lengths = np.asarray(packing.box.lengths)[axes]
    centers = packing.centers[:, axes] * signs % lengths
    return ParticlePacking(centers, packing.radii, Box(tuple(lengths), packing.box.periodic))


@pytest.mark.parametrize(
    ("axes", "signs"), [([0, 2, 1], [1, -1, 1]), ([2, 1, 0], [1, 1, -1]), ([1, 0, 2], [-1, 1, 1])], ids=["x", "y", "z"]
)
def test_a_quarter_turn_turns_the_tensor(periodic, axes, signs):
    tensor = effective_conductivity(medium_of(overlap_contacts(periodic))).tensor
    found = effective_conductivity(medium_of(overlap_contacts(turned(periodic, axes, signs)))).tensor
    turn = np.eye(3)[axes] * np.array(signs)[:, None]
    assert found == pytest.approx(turn @ tensor @ turn.T, rel=1e-9, abs=1e-12)
    assert tensor == pytest.approx(tensor.T)
    assert np.linalg.eigvalsh(tensor).min() > 0.0


def test_replicas_translation_permutation_and_scale_change_nothing(periodic):
    tensor = effective_conductivity(medium_of(overlap_contacts(periodic))).tensor
    shifted = np.concatenate([periodic.centers, periodic.centers + [1.0, 0.0, 0.0]])
    replica = ParticlePacking(shifted, np.tile(periodic.radii, 2), Box((2.0, 1.0, 1.0), (True,) * 3))
    moved = ParticlePacking((periodic.centers + [0.3, 0.7, 0.9]) % 1.0, periodic.radii, periodic.box)
    order = np.random.default_rng(3).permutation(periodic.count)
    mixed = ParticlePacking(periodic.centers[order], periodic.radii[order], periodic.box)
    large = ParticlePacking(7.0 * periodic.centers, 7.0 * periodic.radii, Box((7.0,) * 3, (True,) * 3))
    for other in (replica, moved, mixed, large):
        assert effective_conductivity(medium_of(overlap_contacts(other))).tensor == pytest.approx(
            tensor, rel=1e-9, abs=1e-12
        )
    kappa = np.random.default_rng(4).uniform(0.5, 3.0, periodic.count)
    one = effective_conductivity(medium_of(overlap_contacts(periodic), kappa)).tensor
    five = effective_conductivity(medium_of(overlap_contacts(periodic), 5.0 * kappa)).tensor
    assert five == pytest.approx(5.0 * one, rel=1e-9, abs=1e-12)


def test_pipe_mean_field_and_rules(periodic):
    network = overlap_contacts(periodic)
    pipes = pipe_conductivity(medium_of(network), method="chord").tensor
    assert np.trace(pipes) / 3.0 < mean_field_conductivity(medium_of(network))
    chord = effective_conductivity(medium_of(network)).tensor
    assert np.trace(pipes) == pytest.approx(np.trace(chord), rel=0.15)
    asked = coordination_contacts(periodic, 0.1, 5.0)
    assert asked.coordination == pytest.approx(5.0, abs=0.05)
    assert np.isfinite(effective_conductivity(medium_of(asked)).tensor).all()


@pytest.mark.parametrize("method", METHODS)
def test_contact_resistance_equals_two_more_unknowns(method):
    """Two nodes a contact, joined by 1/R_c, against the resistance on the diagonals."""
    packing = ParticlePacking([[0.5, 1.5, 1.5], [1.5, 1.5, 1.5]], [0.5] * 2, Box((2.0, 3.0, 3.0)))
    resistance, alpha, kappa = np.array([0.7, 0.2, 0.4]), 0.15, np.array([1.0, 3.0])
    network = bonded_contacts(packing, alpha)
    found = solve_steady(medium_of(network.with_resistance(resistance), kappa), (0,), method=method)
    own = {"chord": chord_resistance, "standard": standard_resistance}[method](alpha)
    across = 2.0 * (own - mutual_resistance(-1.0, alpha, alpha, method)) / (0.5 * kappa)
    assert found.energies[0, 0] == pytest.approx(1.0 / (across.sum() + resistance.sum()), rel=1e-12)


def test_field_recovers_every_temperature(walled):
    network = overlap_contacts(walled)
    solution = solve_steady(medium_of(network), (0,))
    field = recover_field(solution)
    known = np.isfinite(field.particle_temperatures)
    assert known.sum() > 40
    assert field.particle_temperatures[known].min() >= 0.0
    assert field.particle_temperatures[known].max() <= 1.0
    linear = 1.0 - walled.centers[known, 0]
    assert np.corrcoef(field.particle_temperatures[known], linear)[0, 1] > 0.95
    kept = solution.backbone.contacts
    at = solution.temperatures[solution.sides.of_contacts[:, 0], 0]
    assert field.contact_temperatures[kept] == pytest.approx(at, abs=1e-8)


def test_nothing_spans_two_separate_spheres():
    apart = ParticlePacking([[0.3, 0.5, 0.5], [0.7, 0.5, 0.5]], [0.15] * 2, Box((1.0, 1.0, 1.0)))
    result = effective_conductivity(medium_of(bonded_contacts(apart, 0.1)))
    assert np.diag(result.tensor).tolist() == [0.0, 0.0, 0.0]


def test_contacts_that_meet_and_what_else_cannot_be_are_refused():
    box = Box((4.0, 4.0, 4.0))
    triple = ParticlePacking([[1.0, 1.0, 1.0], [2.0, 1.0, 1.0], [1.5, 1.0 + np.sqrt(0.75), 1.0]], [0.5] * 3, box)
    with pytest.raises(GeometryError, match="two contact disks of particle 0 overlap: 60 degrees apart"):
        effective_conductivity(medium_of(bonded_contacts(triple, np.radians(31.0))))
    with pytest.raises(InputError, match="between 1e-06 and 90 degrees"):
        bonded_contacts(triple, np.radians(90.0))
    with pytest.raises(GeometryError, match="one lies inside the other"):
        overlap_contacts(ParticlePacking([[1.0, 1.0, 1.0], [1.1, 1.0, 1.0]], [0.5, 0.2], box))
    with pytest.raises(GeometryError, match=r"apart|coincide"):
        overlap_contacts(ParticlePacking([[1.0, 1.0, 1.0], [1.0, 1.0, 1.0]], [0.5, 0.5], box))
    with pytest.raises(InputError, match="method enhanced of engine dtem works in 2D, found a medium in 3D"):
        effective_conductivity(medium_of(bonded_contacts(triple, 0.1)), method="enhanced")


def test_a_sphere_that_bridges_both_walls():
    bridge = ParticlePacking([[0.4, 1.0, 1.0]], [0.5], Box((0.8, 2.0, 2.0)))
    found = effective_conductivity(medium_of(overlap_contacts(bridge)), axes=(0,)).tensor[0, 0]
    alpha = np.arccos(0.4 / 0.5)
    through = 2.0 * (chord_resistance(alpha) - mutual_resistance(-1.0, alpha, alpha)) / 0.5
    assert found == pytest.approx(0.8 / (4.0 * through), rel=1e-10)


def test_radii_of_a_thousand_to_one():
    small = ParticlePacking([[1.0, 0.5, 0.5], [1.5009, 0.5, 0.5]], [0.5, 0.001], Box((2.0, 1.0, 1.0)))
    network = overlap_contacts(small)
    assert network.count == 1
    assert network.angles[0].tolist() == pytest.approx([0.0008715, 0.448], rel=2e-2)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("dipoles", [False, True])
def test_at_rest_the_storing_element_is_the_steady_one(walled, method, dipoles):
    network = overlap_contacts(walled)
    walls = {"left": FixedTemperature(1.0), "right": FixedTemperature(0.0)}
    system = transient_system(medium_of(network, heat_capacity=1.0), walls, method=method, dipoles=dipoles)
    *_, late = march(system.heat, system.initial(0.5), [0.0, 50.0], steps=400)
    steady = solve_steady(medium_of(network), (0,), method=method)
    flows = system.flows(50.0, late.temperatures)
    hot = np.isin(system.sides.nodes, np.flatnonzero(network.walls[system.wall_contacts] == 0) + network.count)
    # the pruned contacts of the steady solution dent its spheres no more
    assert flows[hot].sum() == pytest.approx(steady.energies[0, 0], rel=1e-3)


def test_a_dipole_decays_at_35_over_8_close_to_the_spheres_own_rate():
    alone = ParticlePacking([[1.0, 1.0, 1.0]], [0.5], Box((2.0, 2.0, 2.0)))
    sides = contact_sides(bonded_contacts(alone, 0.1))
    elements = storing_elements(sides, np.ones(1), "chord", dipoles=True)
    rates = np.linalg.eigvalsh(elements.values.reshape(4, 4) * 4.0 / (4.0 / 3.0 * np.pi * 0.5**3)) * 0.5**2
    assert rates == pytest.approx([0.0, 35 / 8, 35 / 8, 35 / 8], abs=1e-12)
    own = 2.0815759778
    assert abs(spherical_jn(1, own, derivative=True)) < 1e-9
    assert rates[3] == pytest.approx(own**2, rel=0.01)
    assert readings_of_parts(3)[1:].sum(axis=1) == pytest.approx(np.zeros(3), abs=1e-15)


def test_an_evenly_heated_sphere_warms_at_its_surface_first():
    """T_i - T_o = sum_j h_ij Q_j + S/(20 pi kappa R): the l = 0 part of the exact solution of even heating."""
    alone = ParticlePacking([[1.0, 1.0, 1.0]], [1.0], Box((2.0, 2.0, 2.0)))
    sides = contact_sides(bonded_contacts(alone, 0.05))
    kappa = np.full(1, 3.0)
    h = closed_form_resistances(sides, kappa, method="standard").values.reshape(6, 6)
    elements = storing_elements(sides, kappa, "standard")
    block = elements.values.reshape(7, 7)
    rise = np.linalg.solve(block[:6, :6], np.ones(6))
    assert rise == pytest.approx(h.sum(axis=1) + 6.0 / (20.0 * np.pi * 3.0), rel=1e-12)


def test_heat_is_conserved_and_volumes_add_up(walled):
    pair = ParticlePacking([[0.4, 1.0, 1.0], [1.2, 1.0, 1.0]], [0.5, 0.5], Box((2.0, 2.0, 2.0)))
    caps = [
        np.pi * h**2 * (1.5 - h) / 3.0 for h in (0.1, 0.1, 0.1)
    ]  # one at the wall, one at either side of the contact
    assert overlap_contacts(pair).cut_measures(prescribed=True).sum() == pytest.approx(
        np.pi / 3.0 - sum(caps), rel=1e-12
    )
    network = overlap_contacts(walled)
    system = transient_system(medium_of(network, heat_capacity=2.0), {"left": FixedTemperature(1.0)})
    *_, state = march(system.heat, system.initial(0.0), [0.0, 0.02], steps=50)
    stored = 2.0 * network.cut_measures(prescribed=True) @ system.particle_temperatures(state.temperatures)
    assert stored == pytest.approx(state.heat[0], rel=1e-8)
    pipes = transient_system(medium_of(network, heat_capacity=2.0), {"left": FixedTemperature(1.0)}, engine="pipe")
    *_, state = march(pipes.heat, pipes.initial(0.0), [0.0, 0.02], steps=50)
    stored = 2.0 * network.cut_measures(prescribed=True) @ pipes.particle_temperatures(state.temperatures)
    assert stored == pytest.approx(state.heat[0], rel=1e-8)


def test_a_curve_of_angles_agrees_with_its_full_solutions(periodic):
    """A reduced basis over the contact half-angles: 1e-8 of full solutions."""
    shrunk = ParticlePacking(periodic.centers, periodic.radii / 1.06, periodic.box)
    angles = np.radians([1.0, 2.0, 4.0, 6.0, 8.0, 10.0])
    media = medium_of(bonded_contacts(shrunk, 0.1, 0.15))
    points = conductivity_curve(media, angles)
    assert any(point.snapshots for point in points)
    for angle, point in zip(angles, points, strict=True):
        full = effective_conductivity(medium_of(bonded_contacts(shrunk, angle, 0.15))).tensor
        assert point.tensor == pytest.approx(full, rel=3e-8, abs=1e-9 * full.max())


@pytest.mark.parametrize("growth", [1.0, 1.03])
def test_the_estimate_covers_what_chord_misses(periodic, growth):
    packing = ParticlePacking(periodic.centers, periodic.radii * growth, periodic.box)
    medium = medium_of(overlap_contacts(packing))
    chord, exact = (effective_conductivity(medium, method=method) for method in ("chord", "exact"))
    missed = np.abs(np.diag(chord.tensor) / np.diag(exact.tensor) - 1.0).max()
    assert missed < chord.model_error < 6.0 * missed
    assert exact.model_error < 0.3 * missed


def test_pipes_of_small_contacts_and_of_dem_codes(periodic):
    """2 kappa c, and sqrt(pi) times as much; both go through the contact radius alone."""
    medium = medium_of(overlap_contacts(periodic), 3.0)
    network = medium.links
    width = packing_widths(network)
    between, _ = contact_conductances(medium, "holm")
    assert between == pytest.approx(2.0 * 3.0 * width, rel=1e-12)
    holm, area = (effective_conductivity(medium, engine="pipe", method=m).tensor for m in ("holm", "root-area"))
    assert area == pytest.approx(np.sqrt(np.pi) * holm, rel=1e-9, abs=1e-12)


def packing_widths(network):
    """Radius of the common circle of two spheres, from their positions."""
    r, t = network.packing.radii[network.pairs].T
    d = np.linalg.norm(network.branches, axis=1)
    return np.sqrt((-d + r + t) * (d - r + t) * (d + r - t) * (d + r + t)) / (2.0 * d)
