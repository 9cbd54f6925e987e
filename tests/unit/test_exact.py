from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import gammaln

from etc_engine.box import Box
from etc_engine.engines.dtem.conductivity import element_conductivity
from etc_engine.engines.dtem.exact.cut_disk import solve_cut_disk
from etc_engine.engines.dtem.exact.element import edge_exponents, exact_elements
from etc_engine.engines.dtem.exact.lune import (
    LEVELS,
    PROFILE_POINTS,
    FluxModes,
    chord_points,
    log_gamma,
    mode_weights,
)
from etc_engine.engines.dtem.field import recover_field
from etc_engine.errors import GeometryError, InputError
from etc_engine.laws.disk import mutual_resistance, self_resistance
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import bonded_contacts, overlap_contacts
from etc_engine.medium.sides import contact_sides
from etc_engine.packing.particles import ParticlePacking
from etc_engine.realization import effective_conductivity


@pytest.fixture(scope="module")
def points():
    return chord_points()


def resistances(theta, alpha, exponents, levels, modes, points):
    h = np.empty((len(theta) * modes,) * 2)
    fluxes = FluxModes(np.array(exponents, float), np.zeros((0, modes, PROFILE_POINTS)))
    solve_cut_disk(np.array(theta, float), np.array(alpha, float), fluxes, np.array(levels), points, h)
    return h


def exact(packing, *, contact_angle=None, conductivity=1.0, contact_resistance=0.0, **options):
    network = overlap_contacts(packing) if contact_angle is None else bonded_contacts(packing, contact_angle)
    medium = medium_of(network.with_resistance(contact_resistance), conductivity)
    return element_conductivity(medium, method="exact", **options)


def jittered(seed: int, side: int, periodic=(False, False)) -> ParticlePacking:
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(np.arange(side), np.arange(side), indexing="ij"), axis=-1).reshape(-1, 2) + 0.5
    centers = (grid + 0.08 * rng.uniform(-1, 1, grid.shape)) / side
    return ParticlePacking(centers, rng.uniform(0.53, 0.58, side**2) / side, Box((1.0, 1.0), periodic))


# --- the disk -------------------------------------------------------------------------------------


def test_log_gamma_is_that_of_scipy():
    x = np.linspace(0.4, 4.0, 30)
    np.testing.assert_allclose([log_gamma(v) for v in x], gammaln(x), atol=2e-14)


@pytest.mark.parametrize("level", range(len(LEVELS)))
@pytest.mark.parametrize("b", [0.5, 0.61, 0.9])
def test_weights_of_the_flux_modes_have_their_moments(points, level, b):
    """int (1 - s^2)^(b-1) s^2 / B = 1/(2b + 1), and the modes beyond the first carry nothing."""
    count = points.counts[level]
    weights = np.empty((4, count))
    mode_weights(b, level, points, weights)
    s = points.s[level, :count]
    np.testing.assert_allclose(weights.sum(axis=1), [1, 0, 0, 0], atol=2e-9)
    assert weights[0] @ s**2 == pytest.approx(1 / (2 * b + 1), abs=1e-9)


@settings(max_examples=25, deadline=None)
@given(data=st.data())
def test_resistances_obey_reciprocity(points, data):
    """Temperature at i from heat at j = temperature at j from heat at i: nothing in the equations imposes it."""
    count = data.draw(st.integers(2, 6))
    theta = (
        np.arange(count) + data.draw(st.floats(0, 1)) + [data.draw(st.floats(-0.1, 0.1)) for _ in range(count)]
    ) * (2 * np.pi / count)
    alpha = [data.draw(st.floats(0.02, 0.7)) * np.pi / count for _ in range(count)]
    exponents = [data.draw(st.floats(0.5, 0.8)) for _ in range(count)]
    h = resistances(theta, alpha, exponents, [5] * count, 3, points)
    np.testing.assert_allclose(h, h.T, atol=3e-9)


def test_coarse_points_agree_with_fine_ones(points):
    for degrees, coarse, error in ((6.0, 0, 5e-8), (20.0, 1, 5e-8), (40.0, 1, 5e-8), (60.0, 3, 1e-9)):
        alpha = np.radians(degrees)
        args = [0.1, 0.1 + np.pi], [alpha] * 2, [np.pi / (2 * np.pi - 2 * alpha)] * 2
        one, other = (resistances(*args, [level] * 2, 3, points) for level in (coarse, 9))
        np.testing.assert_allclose(one, other, atol=error)


def test_narrow_chords_far_apart_exchange_as_points_on_a_circle(points):
    h = resistances([0.0, 2.0], [1e-4, 1e-4], [0.5, 0.5], [0, 0], 1, points)
    # H is known to a constant that the zero sum of heat flows takes out
    expected = self_resistance(1e-4, "chord") - mutual_resistance(2.0, 1e-4, 1e-4)
    assert h[0, 0] - h[0, 1] == pytest.approx(expected, abs=1e-7)


def test_edge_exponents():
    packing = ParticlePacking([[0.25, 0.5], [0.72, 0.5]], [0.26, 0.25], Box((1.0, 1.0)))
    sides = contact_sides(overlap_contacts(packing))
    equal = edge_exponents(sides, np.ones(2))
    both = sides.of_contacts[0]
    np.testing.assert_allclose(equal[both], np.pi / (2 * np.pi - sides.alpha[both].sum()), rtol=1e-14)
    np.testing.assert_allclose(equal[sides.of_walls], 0.5 * np.pi / (np.pi - sides.alpha[sides.of_walls]), rtol=1e-14)
    mixed = edge_exponents(sides, np.array([1.0, 1e9]))
    assert mixed[both[0]] == pytest.approx(0.5 * np.pi / (np.pi - sides.alpha[both[0]]), rel=1e-6)


# --- exact limits ---------------------------------------------------------------------------------


@pytest.mark.parametrize(("radius", "error"), [(0.70, 5e-4), (0.707, 2e-5)])
def test_disk_cut_by_four_walls_tends_to_the_full_square(radius, error):
    """The insulated walls cut it as well; at radius sqrt(1/2) nothing is left to miss."""
    value = exact(ParticlePacking([[0.5, 0.5]], [radius], Box((1.0, 1.0))), modes=9, axes=(0,)).tensor[0, 0]
    assert 1.0 - error < value < 1.0


def test_insulated_wall_is_a_plane_of_symmetry():
    """A row of disks cut by the insulated wall, and the same row with its mirror image on the other side."""
    row = np.array([[0.15, 0.14], [0.45, 0.13], [0.80, 0.17]])
    radii = np.array([0.155, 0.16, 0.205])
    cut = exact(ParticlePacking(row, radii, Box((1.0, 0.6))), axes=(0,)).tensor[0, 0]
    both = np.concatenate([row + [0.0, 0.6], row * [1.0, -1.0] + [0.0, 0.6]])
    twin = exact(ParticlePacking(both, np.tile(radii, 2), Box((1.0, 1.2))), axes=(0,)).tensor[0, 0]
    assert cut == pytest.approx(twin, rel=1e-9)
    whole = exact(ParticlePacking(row + [0.0, 0.1], radii, Box((1.0, 0.6))), axes=(0,)).tensor[0, 0]
    assert cut < whole * (1 - 1e-4)


@pytest.mark.parametrize("degrees", [1.0, 20.0, 45.0, 60.0])
def test_straight_chain_is_a_series_of_equal_disks(degrees):
    alpha = np.radians(degrees)
    one = exact(ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0))), contact_angle=alpha, axes=(0,)).tensor[0, 0]
    centers = [[1 / 6, 0.5], [0.5, 0.5], [5 / 6, 0.5]]
    three = ParticlePacking(centers, [1 / 6] * 3, Box((1.0, 1.0)))
    assert exact(three, contact_angle=alpha, axes=(0,)).tensor[0, 0] == pytest.approx(one / 3, rel=1e-6)
    mixed = exact(three, contact_angle=alpha, conductivity=[1.0, 2.0, 4.0], axes=(0,)).tensor[0, 0]
    assert mixed == pytest.approx(one / 1.75, rel=1e-6)
    resistive = exact(three, contact_angle=alpha, contact_resistance=0.5, axes=(0,)).tensor[0, 0]
    assert resistive == pytest.approx(1 / (3 / one + 2.0), rel=1e-6)


def test_few_degrees_agree_with_the_chord_formula():
    """Exact for one isothermal chord and a far source."""
    packing = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0)))
    network = bonded_contacts(packing, np.radians(2.0))
    one, other = (
        effective_conductivity(medium_of(network), method=m, axes=(0,)).tensor[0, 0] for m in ("exact", "chord")
    )
    assert one == pytest.approx(other, rel=1e-6)


# --- assemblies -----------------------------------------------------------------------------------


def test_modes_converge_from_below(feng_particles):
    """More flux modes are a larger space of admissible fluxes: the complementary energy can only fall."""
    values = [exact(feng_particles, modes=m, axes=(0,), tolerance=1e-13).tensor[0, 0] for m in range(1, 8)]
    assert (np.diff(values) > -1e-12).all()
    assert values[-1] - values[2] < 2e-8


def test_heat_balances_and_temperatures_obey_the_maximum_principle():
    result = exact(jittered(7, 12), axes=(0,))
    heat_in, heat_out = result.solutions[0].wall_heat()
    assert heat_in == pytest.approx(result.tensor[0, 0], rel=1e-9)
    assert heat_out == pytest.approx(result.tensor[0, 0], rel=1e-9)
    field = recover_field(result.solutions[0])
    for temperatures in (field.particle_temperatures, field.contact_temperatures, field.wall_temperatures):
        assert temperatures.min() >= 0.0
        assert temperatures.max() <= 1.0


def test_contact_temperatures_are_the_same_from_both_sides():
    result = exact(jittered(17, 5), axes=(0,))
    field = recover_field(result.solutions[0])
    solution = result.solutions[0]
    rows = field.sides.of_contacts[:, 0][solution.backbone.contacts]
    mine = solution.sides.of_contacts
    np.testing.assert_allclose(solution.temperatures[mine[:, 0], 0], solution.temperatures[mine[:, 1], 0], atol=1e-14)
    at_contact = field.contact_temperatures[solution.backbone.contacts]
    np.testing.assert_allclose(at_contact, solution.temperatures[mine[:, 0], 0], atol=1e-9)
    assert rows.size == mine.shape[0]


def test_replicas_of_a_periodic_box_agree():
    packing = jittered(21, 4, (True, True))
    copies = np.concatenate([packing.centers, packing.centers + [1.0, 0.0]])
    bigger = ParticlePacking(copies, np.tile(packing.radii, 2), Box((2.0, 1.0), (True, True)))
    one, other = (exact(p, tolerance=1e-13).tensor for p in (packing, bigger))
    np.testing.assert_allclose(one, other, atol=1e-12)


def test_two_builds_have_the_same_bits():
    sides = contact_sides(overlap_contacts(jittered(23, 6)))
    one, other = exact_elements(sides, np.ones(36)), exact_elements(sides, np.ones(36))
    np.testing.assert_array_equal(one.values, other.values)


def test_dead_end_returns_some_heat_within_its_contact():
    chain = [[0.25, 0.5], [0.75, 0.5]]
    box = Box((1.0, 1.0))
    bare = exact(ParticlePacking(chain, [0.252, 0.252], box), axes=(0,)).tensor[0, 0]
    hung = exact(ParticlePacking([*chain, [0.25, 0.84]], [0.252, 0.252, 0.1], box), axes=(0,)).tensor[0, 0]
    assert bare < hung < bare * 1.01


# --- refusals -------------------------------------------------------------------------------------


def test_chords_that_nearly_touch_are_refused(hexagonal):
    with pytest.raises(GeometryError, match=r"beyond method exact: two contact chords end .* half-chords apart"):
        exact(hexagonal(), contact_angle=np.radians(30.0 - 1e-5))


def test_too_wide_contacts_are_refused():
    packing = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0)))
    with pytest.raises(GeometryError, match=r"half-angle 80 degrees of a contact is too wide"):
        exact(packing, contact_angle=np.radians(80.0), axes=(0,))


def test_corner_outside_a_disk_that_both_walls_cut_is_refused():
    """The two cuts cross inside the disk: that is another shape than a disk cut by separate chords."""
    packing = ParticlePacking([[0.1, 0.1], [0.5, 0.12], [0.86, 0.12]], [0.2, 0.23, 0.16], Box((1.0, 1.0)))
    with pytest.raises(GeometryError, match="two contact arcs of particle 0 overlap"):
        exact(packing, axes=(0,))


@pytest.mark.parametrize(("method", "modes"), [("chord", 2), ("exact", 0), ("exact", 99)])
def test_modes_a_method_does_not_have_are_refused(feng_particles, method, modes):
    with pytest.raises(InputError, match="modes"):
        effective_conductivity(medium_of(overlap_contacts(feng_particles)), method=method, modes=modes)


def test_temperature_inside_is_continuous_across_contacts_and_that_of_the_walls(feng_particles):
    result = exact(feng_particles, modes=6, axes=(0,))
    solution, network = result.solutions[0], result.solutions[0].network
    field = recover_field(solution)
    centers, radii = feng_particles.centers, feng_particles.radii
    normals = network.branches / np.linalg.norm(network.branches, axis=1, keepdims=True)
    across = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
    i, j = network.pairs.T
    for s in (-0.8, -0.3, 0.0, 0.6):
        middle = normals * (radii[i] * np.cos(network.angles[:, 0]))[:, None]
        place = middle + s * across * (radii[i] * np.sin(network.angles[:, 0]))[:, None]
        one = field.inside(i, place)
        other = field.inside(j, place + centers[i] - centers[j])
        np.testing.assert_allclose(one, other, atol=5e-6)  # what six modes leave
    hot = network.wall_particles[network.walls == 0]
    at_wall = np.stack([-centers[hot, 0], np.full(hot.size, 0.004)], axis=1)
    np.testing.assert_allclose(field.inside(hot, at_wall), 1.0, atol=5e-7)
