"""Medium, links with width and resistance, and the table of engines: what is said once holds everywhere."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.errors import InputError
from etc_engine.medium.conductivity import conductivities
from etc_engine.medium.links import fill_dead_ends, solve_links
from etc_engine.medium.medium import Medium, Pores, medium_of
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.rules import RULES, bonded_contacts, find_rule, overlap_contacts
from etc_engine.packing.particles import ParticlePacking
from etc_engine.realization import ENGINES, Conduction, Status, effective_conductivity, field_along, transient_system

CUBE, SQUARE = Box((1.0, 1.0, 1.0)), Box((1.0, 1.0))


def crystal(d: int, side: int = 3, periodic: bool = False) -> ParticlePacking:
    """Touching particles on a square or cubic grid, a little too wide."""
    grid = np.stack(np.meshgrid(*[np.arange(side)] * d, indexing="ij"), axis=-1).reshape(-1, d)
    return ParticlePacking((grid + 0.5) / side, np.full(side**d, 0.5 / side * 1.001), Box((1.0,) * d, (periodic,) * d))


def numbered(network: ContactNetwork) -> ContactNetwork:
    return network.with_resistance(np.arange(1.0, network.count + network.walls.size + 1.0))


@pytest.mark.parametrize("d", [2, 3])
def test_a_link_keeps_its_resistance_through_a_selection(d):
    network = numbered(overlap_contacts(crystal(d)))
    kept, walls = np.arange(network.count) % 3 == 1, np.arange(network.walls.size) % 2 == 0
    part = network.select(kept, walls)
    assert part.resistances.tolist() == (np.flatnonzero(kept) + 1.0).tolist()
    assert part.wall_resistances.tolist() == (network.count + np.flatnonzero(walls) + 1.0).tolist()
    assert part.with_half_angle(0.1).resistances.tolist() == part.resistances.tolist()
    assert (network.rule, part.with_half_angle(0.1).rule) == ("overlap", "bonded")


@pytest.mark.parametrize(("d", "area"), [(2, lambda c: 2.0 * c), (3, lambda c: np.pi * c**2)])
def test_an_area_resistance_is_over_the_area_of_each_contact(d, area):
    pair = ParticlePacking([[0.3] + [0.5] * (d - 1), [0.7] + [0.5] * (d - 1)], [0.3, 0.15], Box((1.0,) * d))
    network = overlap_contacts(pair).with_area_resistance(1e-3)
    reach = 0.3 * np.sin(network.angles[0, 0])
    assert reach == pytest.approx(0.15 * np.sin(network.angles[0, 1]), rel=1e-12)
    assert network.resistances[0] == pytest.approx(1e-3 / area(reach), rel=1e-12)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda n: n.with_resistance(-1.0), "must be >= 0 and finite, found -1"),
        (lambda n: n.with_resistance([1.0]), r"shape \(24,\), found \(1,\)"),
        (lambda n: n.with_area_resistance(np.nan), "must be >= 0 and finite, found nan"),
        (lambda n: medium_of(n, [1.0, 2.0]), r"the conductivity must be one number or an array of shape \(9,\)"),
        (lambda n: medium_of(n, -1.0), "is -1: give a number"),
        (lambda n: medium_of(n, heat_capacity=0.0), "the heat capacity must be positive and finite, found 0"),
        (lambda n: Medium(crystal(2), np.ones(9), n), "must be of the packing of the medium"),
        (lambda _: Pores(-0.1), "conductivity of the pores must be finite and not negative"),
        (lambda n: Medium(n.packing, np.ones(9)).links, "this engine needs contacts"),
        (lambda _: find_rule("glue"), "unknown contact rule 'glue': expected overlap, bonded"),
    ],
)
def test_what_makes_no_medium_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make(overlap_contacts(crystal(2)))


def test_rules_name_their_functions_arguments():
    for name, rule in RULES.items():
        arguments = rule.contacts.__code__.co_varnames
        assert set(rule.keys.values()) <= set(arguments), name


def test_energies_become_a_conductivity_in_one_place():
    box = Box((2.0, 3.0, 4.0), (True, False, True))
    energies = np.array([[24.0, 1.0], [3.0, 48.0]])
    np.testing.assert_allclose(conductivities(box, (0, 2), energies), [[1.0, 2.0 / 24.0], [2.0 / 24.0, 2.0]])
    assert conductivities(box, (1,), np.array([[8.0]])).item() == pytest.approx(8.0 * 3.0 / 8.0)


def test_links_of_no_conductance_take_no_part():
    """A square of four particles whose lower path is cut: the upper one carries all heat, the rest hangs on it."""
    packing = ParticlePacking([[0.25, 0.75], [0.75, 0.75], [0.25, 0.25], [0.75, 0.25]], [0.251] * 4, SQUARE)
    network = overlap_contacts(packing)
    C = np.where((network.pairs < 2).all(axis=1), 2.0, np.where((network.pairs >= 2).all(axis=1), 0.0, 1.0))
    walls = np.where(network.wall_particles < 2, 4.0, 0.0)
    solution = solve_links(network, (0,), C, walls)
    assert solution.energies.item() == pytest.approx(1.0)
    np.testing.assert_allclose(solution.temperatures[:, 0], [0.75, 0.25, 0.75, 0.25])
    assert solution.wall_heat() == pytest.approx((1.0, 1.0))


def test_dead_ends_take_what_they_hang_on():
    temperatures = np.array([1.0, np.nan, np.nan, np.nan])
    fill_dead_ends(temperatures, np.array([[0, 1], [2, 1]]), np.array([0.0, 5.0]), np.array([[0.5, 0.0], [0.0, 0.0]]))
    np.testing.assert_allclose(temperatures, [1.0, 1.5, 6.5, np.nan])


ROWS = [
    (engine.name, name, d)
    for engine in ENGINES.values()
    for name, method in engine.methods.items()
    for d in method.dimensions
    if name != "cell"  # has tests of its own
]


@pytest.mark.parametrize(("engine", "method", "d"), ROWS)
def test_every_row_of_the_table_does_what_it_says(engine, method, d):
    """A crystal between walls conducts alike along all axes, and what a method cannot take it refuses by name."""
    row = ENGINES[engine].methods[method]
    packing = crystal(d, 2)
    pores = Pores(0.0 if row.pores == "no" else 0.2)
    medium = Medium(packing, np.full(packing.count, 2.0), overlap_contacts(packing) if row.contacts else None, pores)
    options = {"resolution": 16} if "resolution" in row.options else {}
    options |= {"particles": 1500} if "particles" in row.options else {}
    task = Conduction(engine, method, options, 1e-9)
    (outcome,) = ENGINES[engine].conduct([medium], task, 7)
    assert (outcome.status, outcome.message) == (Status.OK, "")
    assert outcome.conductivity.shape == (d, d)
    along = np.diag(outcome.conductivity)
    assert along == pytest.approx(along[0], rel=0.05)
    assert 0.0 < along[0] < 2.0
    assert ENGINES[engine].memory((1.0,) * d, 1e3, ENGINES[engine].resolve(method, options)) > 1e5
    if row.pores == "no":
        (refused,) = ENGINES[engine].conduct(
            [Medium(packing, medium.conductivity, medium.network, Pores(0.1))], task, 7
        )
        assert refused.status == Status.ERROR
        assert "does not model heat through the pores" in refused.message
        assert refused.conductivity is None
    with pytest.raises(InputError, match=f"option colour has no effect with method {method}"):
        effective_conductivity(medium, engine=engine, method=method, colour=1)


def test_outcomes_come_in_order_and_an_error_is_that_of_its_medium():
    packing = crystal(2)
    network = bonded_contacts(packing, 0.1)
    angles = (0.2, 0.05, 0.9, 0.1, 0.15)  # 0.9 overlaps
    media = [medium_of(network.with_half_angle(angle)) for angle in angles]
    together = ENGINES["dtem"].conduct(media, Conduction(), 1)
    assert [outcome.status for outcome in together] == [0, 0, Status.ERROR, 0, 0]
    assert "overlap" in together[2].message
    assert together[2].conductivity is None
    for angle, outcome in zip(angles, together, strict=True):
        if outcome.status == Status.OK:
            alone = effective_conductivity(medium_of(bonded_contacts(packing, angle))).tensor
            np.testing.assert_allclose(outcome.conductivity, alone, rtol=1e-8)
    assert {outcome.solved_by for outcome in together} == {"", "full", "reduced"}


def test_questions_an_engine_cannot_answer_are_refused():
    disks, spheres = medium_of(overlap_contacts(crystal(2))), medium_of(overlap_contacts(crystal(3)))
    with pytest.raises(InputError, match="unknown engine 'fem': expected one of dtem, pipe"):
        effective_conductivity(disks, engine="fem")
    with pytest.raises(InputError, match="engine lattice works in 3D, found a medium in 2D"):
        effective_conductivity(disks, engine="lattice")
    with pytest.raises(
        InputError, match=r"method arc of engine dtem works in 2D, found a medium in 3D; its methods there are .*chord"
    ):
        effective_conductivity(spheres, method="arc")
    with pytest.raises(InputError, match="load axes xy, found"):
        effective_conductivity(disks, axes=(2,))
    with pytest.raises(InputError, match="needs the heat capacity"):
        transient_system(disks, {})
    with pytest.raises(InputError, match="method exact of engine dtem has no transient form: choose chord"):
        transient_system(disks, {}, method="exact")
    result = effective_conductivity(disks, axes=(0,))
    with pytest.raises(InputError, match="the conductivity along y was not asked for"):
        field_along(disks, result, engine="dtem", method="chord", axis=1)
    assert field_along(disks, result, engine="dtem", method="chord").axis == 0


@pytest.mark.parametrize("value", [1e300, 1e-300, -1.0, np.nan, np.inf])
def test_a_conductivity_whose_products_overflow_is_refused_in_words(value):
    with pytest.raises(InputError, match="the pores"):
        Pores(value)
    if value != np.inf:
        with pytest.raises(InputError, match=r"from 1e-100 to 1e\+100, or, with homogenize, 0"):
            Medium(ParticlePacking([[0.5, 0.5]], [0.2], Box((1.0, 1.0))), value)
