"""A resistance over the contact area: resolved by ``exact`` of disks, with an excess law in ``chord``."""

from __future__ import annotations

from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.engines.dtem.conductivity import accuracy_remarks, element_conductivity, solve_series
from etc_engine.engines.dtem.exact.film import contact_film, flux_densities
from etc_engine.engines.dtem.field import recover_field
from etc_engine.errors import InputError
from etc_engine.medium.conduction import Conduction
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import bonded_contacts, overlap_contacts
from etc_engine.medium.sides import contact_sides
from etc_engine.packing.particles import ParticlePacking
from etc_engine.realization.media import contact_network
from etc_engine.study.quantities import QUANTITIES
from etc_engine.study.tables import ContactsTable


def film_elements():
    """The finite elements of the file beside this one, where scikit-fem is installed."""
    pytest.importorskip("skfem")
    specification = spec_from_file_location("film_elements", Path(__file__).with_name("film_elements.py"))
    elements = module_from_spec(specification)
    specification.loader.exec_module(elements)
    return elements


FILMS = (1e-8, 1e-5, 1e-3, 0.03, 0.3, 3.0, 1e3)


@pytest.fixture(scope="module")
def two():
    """Two unequal disks between walls."""
    return overlap_contacts(ParticlePacking([[0.25, 0.5], [0.72, 0.55]], [0.26, 0.29], Box((1.0, 1.2))))


def solved(network, kappa=1.0, method="exact", **options):
    return element_conductivity(medium_of(network, kappa), method=method, axes=(0,), tolerance=1e-13, **options)


def of_total(network, resistance):
    """The contacts with so much resistance each, spread over their areas."""
    return network.with_area_resistance(resistance * 2.0 * network.reaches)


# --- exact ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("film", "kappa"), [(0.02, (1.0, 3.0)), (0.3, (1.0, 3.0)), (0.3, (2.0, 1.0))])
def test_exact_against_finite_elements_of_our_own(two, film, kappa):
    elements = film_elements()
    films = film * np.array([1.0, 0.5, 2.0])
    found = solved(two.with_area_resistance(films), kappa)
    low, high = found.bounds[0]
    reference = elements.conductivity_along_x(two, films, kappa, 0.45, 3e-4)
    assert low <= found.tensor[0, 0] <= high < low * (1.0 + 1e-5)
    assert 0.0 < reference / low - 1.0 < 3e-5


@pytest.mark.slow
@pytest.mark.parametrize(("resistance", "reference"), [(0.3, 0.2338799), (3.0, 0.1011478)])
def test_twelve_particles_against_finite_elements(feng_particles, resistance, reference):
    """Both references are energies of finite elements, from above; the finer one is of another programme."""
    elements = film_elements()
    network = overlap_contacts(feng_particles)
    films = resistance * 2.0 * network.reaches
    found = solved(network.with_area_resistance(films)).tensor[0, 0]
    own = elements.conductivity_along_x(network, films, 1.0, 0.9, 3e-5)
    assert 0.0 < own / found - 1.0 < 4e-4
    assert 0.0 < reference / found - 1.0 < 5e-5


@pytest.mark.parametrize(
    ("resistance", "reference", "lumped"), [(0.3, 0.2338799, 0.2376365), (3.0, 0.1011478, 0.1021291)]
)
def test_twelve_particles_resolved_and_lumped(feng_particles, resistance, reference, lumped):
    """Finite elements of an interface (they lie above), and the jump taken as uniform."""
    network = overlap_contacts(feng_particles)
    resolved, uniform = solved(of_total(network, resistance)), solved(network.with_resistance(resistance))
    assert resolved.tensor[0, 0] == pytest.approx(reference, rel=5e-5)
    assert uniform.tensor[0, 0] == pytest.approx(lumped, rel=1e-6)
    low, high = resolved.bounds[0]
    assert low <= resolved.tensor[0, 0] <= high < low * (1.0 + 1e-6)


@pytest.mark.parametrize("film", FILMS)
def test_bounds_close_in_from_both_sides_at_any_film(two, film):
    values = [solved(two.with_area_resistance(film), (1.0, 3.0), modes=modes) for modes in (1, 2, 3, 5)]
    low, high = np.array([value.bounds[0] for value in values]).T
    assert (np.diff(low) > -3e-8 * low[:-1]).all()  # 1 - element_error changes with the modes
    assert (low[:, None] < high).all()
    assert high[2] / low[2] - 1.0 < 3e-5


def test_limits_of_no_film_and_of_films_alone(two):
    perfect = solved(two, modes=5).tensor[0, 0]
    assert solved(two.with_area_resistance(1e-10), modes=5).tensor[0, 0] == pytest.approx(perfect, rel=1e-6)
    films = 1e6 / (2.0 * two.reaches)
    alone = solved(two.with_area_resistance(1e6)).tensor[0, 0] * 1.2
    assert alone == pytest.approx(1.0 / films.sum(), rel=1e-5)
    values = [solved(two.with_area_resistance(film)).tensor[0, 0] for film in (0.0, *FILMS)]
    assert (np.diff(values) < 0.0).all()


def test_a_film_conducts_less_than_its_mean_and_more_than_uniform_flux(two):
    for film in FILMS[2:]:
        total = film / (2.0 * two.reaches)
        lumped, resolved = solved(two.with_resistance(total)), solved(two.with_area_resistance(film))
        assert resolved.tensor[0, 0] < lumped.tensor[0, 0]
        assert resolved.tensor[0, 0] > solved(two.with_resistance(total), method="standard").tensor[0, 0]


def test_one_film_among_perfect_contacts(two):
    """Perfect contacts keep the modes of their corners."""
    found = solved(two.with_area_resistance([0.1, 0.0, 0.0]), modes=5)
    low, high = found.bounds[0]
    assert low < high < low * (1.0 + 1e-5)
    assert solved(two.with_area_resistance(0.1)).tensor[0, 0] < low < solved(two).tensor[0, 0]


def test_flux_modes_carry_one_heat_flow_and_spread_over_a_thick_film():
    pair = overlap_contacts(ParticlePacking([[0.25, 0.5], [0.74, 0.5]], [0.25, 0.26], Box((1.0, 1.0))))
    for film in (1e-6, 1e-2, 1e4):
        sides = contact_sides(pair.with_area_resistance(film))
        profiles = contact_film(sides, np.ones(2), np.full(sides.nodes.size, 0.55), 4).profiles
        np.testing.assert_allclose(profiles[:, ::2].sum(axis=2), [[1.0, 0.0]] * len(profiles), atol=1e-12)
    np.testing.assert_allclose(flux_densities(profiles)[:, 0], 0.5, rtol=1e-4)


def test_faces_differ_by_the_mean_jump(two):
    result = solved(two.with_area_resistance(1e4))
    field = recover_field(result.solutions[0])
    first, second = field.face_temperatures[0]
    heat = result.tensor[0, 0] * 1.2
    assert first - second == pytest.approx(heat * 1e4 / (2.0 * two.reaches[0]), rel=1e-6)
    assert field.contact_temperatures[0] == pytest.approx(0.5 * (first + second), abs=1e-6)


def test_replicas_of_a_periodic_row_agree():
    row = ParticlePacking([[0.25, 0.2], [0.75, 0.22]], [0.26, 0.255], Box((1.0, 0.6), (True, False)))
    more = np.concatenate([row.centers, row.centers + [1.0, 0.0]])
    twice = ParticlePacking(more, np.tile(row.radii, 2), Box((2.0, 0.6), (True, False)))
    one, other = (solved(overlap_contacts(p).with_area_resistance(0.05)).tensor[0, 0] for p in (row, twice))
    assert one == pytest.approx(other, rel=1e-10)


# --- chord ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("resistance", [1e-4, 0.003, 0.03, 0.3, 3.0, 300.0])
def test_chord_has_the_excess_and_reports_what_a_lumped_resistance_misses(feng_particles, resistance):
    network = overlap_contacts(feng_particles)
    truth = solved(of_total(network, resistance)).tensor[0, 0]
    resolved = solved(of_total(network, resistance), method="chord")
    lumped = solved(network.with_resistance(resistance), method="chord")
    assert abs(resolved.tensor[0, 0] / truth - 1.0) < min(3e-4, resolved.model_error)
    missed = lumped.tensor[0, 0] / truth - 1.0
    assert abs(missed) < lumped.model_error < 1.1 * abs(missed) + 1e-3


def test_excess_of_wide_contacts_and_unequal_conductivities():
    chain = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    for degrees in (2.0, 10.0, 25.0):
        network = bonded_contacts(chain, np.radians(degrees))
        for resistance in (0.1, 1.0):
            truth, found = (
                solved(of_total(network, resistance), (1.0, 4.0), method=method) for method in ("exact", "chord")
            )
            missed = abs(found.tensor[0, 0] / truth.tensor[0, 0] - 1.0)
            assert missed < min(1e-3, found.model_error)


# --- how it is said -------------------------------------------------------------------------------


def test_the_area_counts_at_the_width_that_holds():
    one = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0)))
    network = bonded_contacts(one, 0.1).with_area_resistance(0.2)
    wider = network.with_half_angle(0.3)
    np.testing.assert_allclose(wider.wall_resistances, 0.2 / np.sin(0.3), rtol=1e-12)
    sides = contact_sides(network)
    np.testing.assert_allclose(sides.with_half_angle(0.3).resistances, 0.2 / np.sin(0.3), rtol=1e-12)
    both = network.with_resistance(1.0)
    np.testing.assert_allclose(both.wall_resistances, 1.0 + 0.2 / np.sin(0.1), rtol=1e-12)
    kept = np.array([True, False, False, False])
    assert both.select(np.zeros(0, dtype=bool), kept).wall_resistances.size == 1
    with pytest.raises(InputError, match="must be >= 0 and finite, found -1"):
        network.with_area_resistance(-1.0)


def test_a_study_takes_a_list_of_them(two):
    contacts = ContactsTable.model_validate({"area_resistance": [0.0, 0.1]})
    assert contacts.area_resistance == (0.0, 0.1)
    assert QUANTITIES["area_resistance"].attributes(2)["units"] == "m2 K W-1"
    network = contact_network(two.packing, "overlap", {"area_resistance": 0.1})
    np.testing.assert_allclose(network.resistances, 0.1 / (2.0 * two.reaches[:1]), rtol=1e-12)
    rough = {"height": 1e-6, "slope": 0.1, "hardness": 4e9}
    given = {"rule": "hertz", "youngs_modulus": 1e9, "poisson_ratio": 0.3, "area_resistance": 0.1, "roughness": rough}
    with pytest.raises(ValueError, match="both a resistance of the contact area"):
        ContactsTable.model_validate(given)


def test_half_angles_of_one_film_are_solved_together():
    chain = bonded_contacts(ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0))), 0.1)
    media = [medium_of(chain.with_half_angle(a).with_area_resistance(0.05)) for a in np.linspace(0.05, 0.3, 5)]
    together = solve_series(media, Conduction())
    for medium, result in zip(media, together, strict=True):
        alone = element_conductivity(medium, axes=(0,), tolerance=1e-13)
        assert result.tensor[0, 0] == pytest.approx(alone.tensor[0, 0], rel=1e-8)


def test_spheres_say_that_they_do_not_resolve_it():
    one = ParticlePacking([[0.5, 0.5, 0.5]], [0.5], Box((1.0, 1.0, 1.0)))
    network = bonded_contacts(one, 0.2).with_area_resistance(0.05)
    exact, chord = (solved(network, method=method) for method in ("exact", "chord"))
    assert exact.tensor[0, 0] == pytest.approx(chord.tensor[0, 0], rel=1e-3)
    total = network.with_area_resistance(0.0).with_resistance(network.wall_resistances)
    assert exact.tensor[0, 0] < solved(total).tensor[0, 0]
    assert any("does not resolve" in remark for remark in accuracy_remarks("exact", exact))
    assert not any("does not resolve" in remark for remark in accuracy_remarks("exact", solved(total)))
