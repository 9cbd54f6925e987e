"""The cell element on media: through the engine table, contacts on edges, walls, fields, heat in time."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.engines.dtem.cell.conductivity import cell_conductivity
from etc_engine.engines.dtem.cell.geometry import cell_geometry
from etc_engine.engines.dtem.cell.medium import edge_contacts, medium_geometry
from etc_engine.engines.dtem.cell.rim_grid import BONDED, CUT, TOUCHING
from etc_engine.engines.dtem.cell.transient import fluid_areas
from etc_engine.errors import InputError
from etc_engine.medium.conduction import Conduction
from etc_engine.medium.medium import Medium, Pores
from etc_engine.medium.rules import bonded_contacts, overlap_contacts
from etc_engine.medium.walls import Convective, FixedTemperature, HeatFlux
from etc_engine.packing import PackingSpec, pack, parse_radii
from etc_engine.packing.particles import ParticlePacking
from etc_engine.realization import effective_conductivity, field_along, find_engine
from etc_engine.realization.engines import linked_medium
from etc_engine.realization.transients import transient_system
from etc_engine.solvers.marching import march


@pytest.fixture(scope="module")
def square():
    return ParticlePacking([[0.5, 0.5], [0.5, 1.5]], [0.5, 0.5], Box((1.0, 2.0)))


def test_cell_is_the_default_where_the_pores_of_disks_conduct(feng_particles):
    engine = find_engine("dtem")
    assert engine.default_method(2, True) == "cell"
    assert engine.default_method(2, False) == "chord"
    medium = Medium(feng_particles, 1.0, overlap_contacts(feng_particles), Pores(0.01))
    result = effective_conductivity(medium, error_estimate=True, bounds=True)
    assert result.spans == (True, True)
    assert 0.0 < result.model_error < 0.008
    assert np.abs(np.diag(result.tensor) / (0.3104213, 0.0813412) - 1.0).max() < 0.004
    assert (result.bounds[:, 0] < (0.3104213, 0.0813412)).all()
    assert (result.bounds[:, 1] > (0.3104213, 0.0813412)).all()
    with pytest.raises(InputError, match=r"does not model heat through the pores: use .*cell"):
        effective_conductivity(medium, method="chord")


def test_where_the_pores_insulate_it_is_the_contact_network(feng_particles):
    network = overlap_contacts(feng_particles)
    media = [Medium(feng_particles, 1.0, network, Pores(fluid)) for fluid in (0.1, 0.0, 1e-6)]
    results = find_engine("dtem").results(media, Conduction("dtem", "cell"), 1)
    chord = effective_conductivity(media[1], method="chord")
    assert np.array_equal(results[1].tensor, chord.tensor, equal_nan=True)
    assert results[2].tensor[0, 0] == pytest.approx(chord.tensor[0, 0], rel=2e-3)
    assert results[1].spans == (True, False)
    assert field_along(media[1], results[1], engine="dtem", method="cell").particle_temperatures.shape == (12,)
    walls = {"left": FixedTemperature(1.0)}
    storing = Medium(feng_particles, 1.0, network, heat_capacity=1.0)
    assert transient_system(storing, walls, method="cell").heat.capacity.size == 17 + 12


def test_contacts_of_a_network_are_placed_on_their_edges(square):
    network = bonded_contacts(square, 0.2).with_resistance(np.arange(1.0, 8.0))
    geometry = medium_geometry(Medium(square, 1.0, network, Pores(0.1)))
    assert (geometry.edges.kind == BONDED).all()  # one between the disks, six at walls
    edge = np.flatnonzero(~geometry.cells.at_wall)
    assert geometry.edges.resistances[edge].tolist() == [1.0]
    walls = np.flatnonzero(geometry.cells.at_wall)
    given = {(int(i), int(w)): r for i, w, r in zip(*_walls(network), strict=True)}
    assert all(
        geometry.edges.resistances[e] == given[int(geometry.cells.cells[e, 0]), int(-1 - geometry.cells.cells[e, 1])]
        for e in walls
    )
    along_y = geometry.driven_by((1,))
    kinds = along_y.edges.kind[walls], -1 - geometry.cells.cells[walls, 1]
    assert all(kind == (BONDED if wall >= 2 else TOUCHING) for kind, wall in zip(*kinds, strict=True))


def _walls(network):
    return network.wall_particles, network.walls, network.wall_resistances


def test_own_images_and_overlaps_match(hexagonal):
    disk = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0), (True, True)))
    geometry = medium_geometry(Medium(disk, 1.0, bonded_contacts(disk, 0.1), Pores(0.1)))
    assert geometry.edges.kind.tolist() == [BONDED, BONDED]
    lattice = hexagonal()
    grown = ParticlePacking(lattice.centers, 1.05 * lattice.radii, lattice.box)
    network = overlap_contacts(grown)
    geometry = medium_geometry(Medium(grown, 1.0, network, Pores(0.1)))
    assert (geometry.edges.kind == CUT).all()
    contacts = edge_contacts(geometry.cells, network.with_resistance(0.3))
    assert contacts.half_angles.max() == 0.0
    assert (contacts.resistances == 0.3).all()


def test_media_of_one_packing_are_solved_like_each_alone(feng_particles):
    network = bonded_contacts(feng_particles, 0.1)
    media = [
        Medium(feng_particles, 1.0, network.with_half_angle(angle), Pores(fluid))
        for angle in (0.05, 0.2)
        for fluid in (0.01, 0.1)
    ]
    results = find_engine("dtem").results(media, Conduction("dtem", "cell"), 1)
    for medium, result in zip(media, results, strict=True):
        alone = effective_conductivity(medium)
        assert np.array_equal(alone.tensor, result.tensor, equal_nan=True)
    k = [result.tensor[0, 0] for result in results]
    assert k[0] < k[1]
    assert k[0] <= k[2]


def test_bonds_with_idle_walls_conduct_nothing_to_them(square):
    # along x the column of disks touches walls at y = 0 and 2, which must not shorten anything
    network = bonded_contacts(square, 0.2)
    with_walls = effective_conductivity(Medium(square, 1.0, network, Pores(0.05)), axes=(0,)).tensor[0, 0]
    keep = network.walls < 2
    bare = network.select(np.ones(network.count, dtype=bool), keep)
    without = effective_conductivity(Medium(square, 1.0, bare, Pores(0.05)), axes=(0,)).tensor[0, 0]
    assert with_walls == pytest.approx(without, rel=1e-12)


def test_cells_away_from_walls_are_shared_by_the_axes(feng_particles):
    packing = ParticlePacking(feng_particles.centers, 0.985 * feng_particles.radii, feng_particles.box)
    medium = Medium(packing, 1.0, bonded_contacts(packing, 0.1, 0.1), Pores(0.05))
    both = effective_conductivity(medium).tensor
    alone = [effective_conductivity(medium, axes=(axis,)).tensor[axis, axis] for axis in range(2)]
    assert np.diag(both) == pytest.approx(alone, rel=1e-12)


@pytest.mark.parametrize("periodic", [(False, False), (True, True)])
def test_fields_of_particles_links_and_pores(feng_particles, periodic):
    packing = ParticlePacking(feng_particles.centers, 0.97 * feng_particles.radii, Box((1.0, 1.0), periodic))
    medium = Medium(packing, 1.0, overlap_contacts(packing), Pores(0.1))
    result = effective_conductivity(medium)
    field = field_along(medium, result, engine="dtem", method="cell")
    links = field.medium.links
    alone = linked_medium(medium, result, engine="dtem", method="cell").links
    assert np.array_equal(alone.pairs, links.pairs) and np.array_equal(alone.angles, links.angles)
    assert np.array_equal(alone.wall_angles, links.wall_angles)
    assert field.particle_temperatures.shape == (12,)
    assert field.contact_flows.shape == (links.count,)
    assert links.count > medium.links.count
    if not periodic[0]:
        at_low = links.walls == 0
        assert -field.wall_flows[at_low].sum() == pytest.approx(result.tensor[0, 0], rel=0.05)
        assert np.abs(field.wall_temperatures[at_low] - 1.0).max() < 1e-9
    inside = field.inside(np.arange(12), np.zeros((12, 2)))
    assert np.abs(inside - field.particle_temperatures).max() < 0.02
    assert (field.reach > packing.radii).all()


def test_dual_media_have_fields_too(feng_particles):
    packing = ParticlePacking(feng_particles.centers, 0.97 * feng_particles.radii, Box((1.0, 1.0)))
    medium = Medium(packing, 0.5, overlap_contacts(packing), Pores(1.0))
    result = effective_conductivity(medium)
    field = field_along(medium, result, engine="dtem", method="cell", axis=1)
    assert np.isfinite(field.particle_temperatures).all()
    assert 0.5 < result.tensor[0, 0] < 1.0


@pytest.fixture(scope="module")
def column():
    centers = np.column_stack((np.arange(6) + 0.5, np.full(6, 0.5)))
    packing = ParticlePacking(centers, np.full(6, 0.45), Box((6.0, 1.0)))
    return Medium(packing, 20.0, overlap_contacts(packing), Pores(1.0, 3.0), heat_capacity=2.0)


def test_cells_store_the_heat_of_disks_and_fluid(column):
    system = transient_system(column, {"left": FixedTemperature(1.0)})
    assert system.capacities.sum() == pytest.approx(2.0 * 6 * np.pi * 0.45**2 + 3.0 * (6.0 - 6 * np.pi * 0.45**2))
    *_, late = march(system.heat, system.initial(0.0), [0.0, 400.0], steps=200)
    assert system.particle_temperatures(late.temperatures) == pytest.approx(np.ones(6), abs=1e-6)
    assert late.heat[0] == pytest.approx(system.capacities.sum(), rel=1e-6)


def test_the_steady_limit_of_a_transient_is_the_steady_cell(column):
    walls = {"left": FixedTemperature(1.0), "right": FixedTemperature(0.0)}
    system = transient_system(column, walls)
    *_, late = march(system.heat, system.initial(0.5), [0.0, 400.0], steps=200)
    result = effective_conductivity(column, axes=(0,))
    field = field_along(column, result, engine="dtem", method="cell")
    assert system.particle_temperatures(late.temperatures) == pytest.approx(field.particle_temperatures, abs=1e-7)
    flows = system.flows(400.0, late.temperatures)
    into_first = flows[system.sides.of_walls[system.medium.links.walls[system.wall_contacts] == 0]].sum()
    assert into_first == pytest.approx(result.tensor[0, 0] / 6.0, rel=0.03)


def test_long_waves_diffuse_as_in_the_homogenized_medium(column):
    system = transient_system(column, {"left": FixedTemperature(0.0), "right": FixedTemperature(0.0)})
    start = system.initial(lambda x: np.sin(np.pi * x[:, 0] / 6.0))
    *_, early, late = march(system.heat, start, [0.0, 4.0, 8.0], steps=100)
    rate = np.log(
        system.particle_temperatures(early.temperatures).mean() / system.particle_temperatures(late.temperatures).mean()
    )
    conductivity = effective_conductivity(column, axes=(0,)).tensor[0, 0]
    capacity = system.capacities.sum() / 6.0
    assert rate / 4.0 == pytest.approx(conductivity / capacity * (np.pi / 6.0) ** 2, rel=0.03)


def test_walls_with_a_flux_or_a_film_and_sources(column):
    system = transient_system(column, {"left": HeatFlux(2.0), "right": Convective(5.0, 0.0)}, source=0.5)
    *_, late = march(system.heat, system.initial(0.0), [0.0, 600.0], steps=200)
    right = system.wall_temperatures(600.0, late.temperatures)[1]
    assert right == pytest.approx((2.0 + 6 * 0.5) / 5.0, rel=1e-6)
    assert system.particle_temperatures(late.temperatures)[0] > right


def test_a_transient_of_insulating_disks_is_refused(column):
    poor = Medium(column.packing, 0.1, column.links, Pores(1.0, 1.0), heat_capacity=1.0)
    with pytest.raises(InputError, match="conduct at least as well as the pores"):
        transient_system(poor, {"left": FixedTemperature(1.0)})


def test_areas_of_fluid_fill_the_box(feng_particles):
    packing = feng_particles
    medium = Medium(packing, 1.0, overlap_contacts(packing), Pores(0.1))
    areas = fluid_areas(medium_geometry(medium))
    assert areas.sum() == pytest.approx(1.0 - medium.solid_fraction, rel=1e-6)


def test_the_same_geometry_without_a_network(feng_particles):
    medium = Medium(feng_particles, 1.0, overlap_contacts(feng_particles), Pores(0.1))
    bare = cell_geometry(feng_particles.centers, feng_particles.radii, feng_particles.box)
    assert np.array_equal(
        effective_conductivity(medium).tensor, cell_conductivity(bare, np.ones(12), 0.1).tensor, equal_nan=True
    )


@pytest.mark.parametrize("pores", [1e-5, 1e-7])
def test_touching_disks_at_a_high_contrast_balance(pores):
    """Rim nodes 1e-5 radii apart: the heat flows at the walls are equal, and a mirror image conducts the same."""
    spec = PackingSpec("advancing-front", parse_radii("uniform:0.02:0.04"), Box((1.0, 1.0)))
    packing = pack(spec, np.random.default_rng(7))
    turned = ParticlePacking(1.0 - packing.centers[:, ::-1], packing.radii, packing.box)
    found = []
    for particles, axis in ((packing, 0), (turned, 1)):
        medium = Medium(particles, 1.0, overlap_contacts(particles), Pores(pores))
        found.append(effective_conductivity(medium, method="cell", axes=(axis,)).tensor[axis, axis])
    assert found[0] == pytest.approx(found[1], rel=1e-5)
