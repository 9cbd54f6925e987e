"""The cell element against two-sided bounds, lattice sums, exact chains and its own invariants."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.engines.dtem.cell.conductivity import (
    CALIBRATED_ERROR,
    cell_conductivity,
    dual_tensor,
    error_estimate,
)
from etc_engine.engines.dtem.cell.edges import EdgeContacts
from etc_engine.engines.dtem.cell.geometry import Resolution, cell_geometry
from etc_engine.engines.dtem.cell.steady import build_model, solve_model
from etc_engine.errors import GeometryError, InputError
from etc_engine.models.arrays import hexagonal_array, square_array
from etc_engine.models.bounds import hashin_shtrikman_lower, hashin_shtrikman_upper
from etc_engine.structure.laguerre_2d import laguerre_cells

DATA = Path(__file__).parents[1] / "data" / "pores"
TABLE = np.genfromtxt(DATA / "reference.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
CASES = sorted(set(TABLE["case"].tolist()))
UNIT = Box((1.0, 1.0), (True, True))


def load(case):
    rows = np.loadtxt(DATA / f"{case}.csv", delimiter=",", skiprows=1)
    first = TABLE[TABLE["case"] == case][0]
    return rows[:, :2], rows[:, 2], Box((float(first["box_x"]), float(first["box_y"])), (True, True))


def geometry_of(case):
    return cell_geometry(*load(case))


def tensor(geometry, contrast, degree=3, **options):
    solid = np.full(geometry.count, float(contrast))
    return cell_conductivity(geometry, solid, 1.0, resolution=Resolution(degree), **options).tensor


def array(kind, fraction):
    """Square or hexagonal array of unit spacing."""
    if kind == "square":
        return cell_geometry(np.array([[0.5, 0.5]]), np.array([np.sqrt(fraction / np.pi)]), UNIT)
    height = np.sqrt(3.0)
    radius = np.sqrt(fraction * height / (2.0 * np.pi))
    centers = np.array([[0.25, 0.25 * height], [0.75, 0.75 * height]])
    return cell_geometry(centers, np.full(2, radius), Box((1.0, height), (True, True)))


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize(("degree", "within"), [(3, 0.30), (4, 0.28), (5, 0.27)])
def test_random_packings_against_two_sided_bounds(case, degree, within):
    geometry = geometry_of(case)
    for row in TABLE[TABLE["case"] == case]:
        found = tensor(geometry, row["contrast_ks_over_kf"], degree)
        true = np.array([[row["k_xx"], row["k_xy"]], [row["k_xy"], row["k_yy"]]])
        assert 100.0 * abs(np.trace(found) / np.trace(true) - 1.0) < within
        assert 100.0 * np.abs(found - true).max() / (0.5 * np.trace(true)) < 1.6 * within


@pytest.mark.parametrize(("kind", "touching"), [("square", np.pi / 4.0), ("hexagonal", np.pi / np.sqrt(12.0))])
@pytest.mark.parametrize("contrast", [2.0, 10.0, 100.0, 1e4])
def test_arrays_against_lattice_sums(kind, touching, contrast):
    model = square_array if kind == "square" else hexagonal_array
    for share in (0.15, 0.5, 0.8, 0.9, 0.95, 0.98, 0.999):
        exact = float(model(1.0, contrast, share * touching))
        found = tensor(array(kind, share * touching), contrast)
        assert abs(found[0, 0] / exact - 1.0) < 0.0038
        assert found[0, 0] == pytest.approx(found[1, 1], rel=1e-6)


def test_perfect_conductors_approach_the_asymptotics_of_narrow_gaps():
    ratios = []
    for gap in (1e-2, 1e-4, 1e-6):
        radius = 0.5 * (1.0 - gap)
        found = tensor(cell_geometry(np.array([[0.5, 0.5]]), np.array([radius]), UNIT), 1e8)
        ratios.append(found[0, 0] / (np.pi * np.sqrt(radius / gap)))
    assert ratios == pytest.approx([0.917, 0.992, 0.999], abs=2e-3)


@pytest.mark.parametrize("case", ["rsa30_equal", "ls75_poly", "front_poly", "front_over"])
def test_contrast_one_is_the_fluid(case):
    found = tensor(geometry_of(case), 1.0)
    assert np.abs(found - np.eye(2)).max() < 2e-3


@pytest.mark.parametrize("case", ["ls60_equal", "front_over"])
def test_insulating_disks_by_duality(case):
    geometry = geometry_of(case)
    for row in TABLE[TABLE["case"] == case][:4]:
        contrast = row["contrast_ks_over_kf"]
        true = dual_tensor(np.array([[row["k_xx"], row["k_xy"]], [row["k_xy"], row["k_yy"]]]))
        result = cell_conductivity(geometry, np.full(geometry.count, 1.0 / contrast), 1.0)
        assert result.dual
        assert abs(np.trace(result.tensor) / np.trace(true) - 1.0) < 0.0055


def test_duality_between_walls_and_for_one_axis():
    rng = np.random.default_rng(30)
    centers = (np.mgrid[:3, :4].reshape(2, -1).T + 0.5 + rng.uniform(-0.1, 0.1, (12, 2))) / (3.0, 4.0)
    geometry = cell_geometry(centers, np.full(12, 0.08), Box((1.0, 1.0), (True, False)))
    solid = rng.uniform(5.0, 9.0, 12)
    direct = cell_conductivity(geometry, solid, 1.0).tensor
    dual = cell_conductivity(geometry, 1.0 / solid, 1.0, (1,)).tensor
    assert dual[1, 1] == pytest.approx(1.0 / direct[0, 0], rel=1e-12)
    assert np.isnan(dual[0, 0])


def test_mixed_conductivities_report_their_spread():
    geometry = geometry_of("ls60_equal")
    solid = np.where(np.arange(geometry.count) % 2, 5.0, 0.2)
    result = cell_conductivity(geometry, solid, 1.0)
    assert 0.0 < result.spread < 0.05
    assert not result.dual


def test_published_particles_between_walls(feng_particles):
    geometry = cell_geometry(feng_particles.centers, feng_particles.radii, feng_particles.box)
    # two-sided bounds of our own: k_x, k_y
    for fluid, true in ((0.01, (0.3104213, 0.0813412)), (0.1, (0.4811781, 0.3935730))):
        found = np.diag(cell_conductivity(geometry, np.ones(12), fluid).tensor)
        assert np.abs(found / true - 1.0).max() < CALIBRATED_ERROR
    model = build_model(geometry, np.ones(12), 0.01)
    solution = solve_model(model, (0,))
    heat_in, heat_out = solution.wall_heat()
    assert heat_in == pytest.approx(heat_out, rel=1e-9)
    assert heat_in == pytest.approx(solution.energies[0, 0], rel=1e-9)
    u = solution.fluctuations[:, 0]
    assert -1e-3 < u.min() <= u.max() < 1.0 + 1e-3


def test_without_fluid_it_tends_to_the_contact_network(feng_particles):
    geometry = cell_geometry(feng_particles.centers, feng_particles.radii, feng_particles.box)
    found = cell_conductivity(geometry, np.ones(12), 1e-6, (0,)).tensor[0, 0]
    assert abs(found / 0.2787774 - 1.0) < 0.002  # the converged value of method exact


def test_bonded_hexagonal_lattice_without_fluid(hexagonal):
    # converged conductivities of method exact: tests/published/test_bonded_hexagonal.py
    packing = hexagonal()
    cells = laguerre_cells(packing.centers, packing.radii, packing.box)
    touch = np.abs(cells.gaps) < 1e-9
    for degrees, true in ((5.0, 0.62564), (15.0, 0.84357), (25.0, 0.97733)):
        half = np.radians(degrees) * np.repeat(touch[:, None], 2, axis=1)
        contacts = EdgeContacts(half, np.zeros(touch.size), np.zeros(touch.size))
        geometry = cell_geometry(packing.centers, packing.radii, packing.box, contacts, cells)
        found = cell_conductivity(geometry, np.ones(2), 1e-7).tensor
        assert 0.0 < found[0, 0] / true - 1.0 < 0.002


def touching_contacts(case, degrees=0.0, neck=0.0, resistance=0.0, uniform=True):
    centers, radii, box = load(case)
    cells = laguerre_cells(centers, radii, box)
    touch = np.abs(cells.gaps) < 1e-6 * radii.mean()
    smaller = np.minimum(radii[cells.cells[:, 0]], radii[cells.cells[:, 1]])
    contacts = EdgeContacts(
        np.radians(degrees) * np.repeat(touch[:, None], 2, axis=1),
        np.sin(np.radians(neck)) * smaller * touch,
        np.full(touch.size, resistance),
        uniform,
    )
    return cell_geometry(centers, radii, box, contacts, cells)


def half_trace(geometry, fluid):
    return 0.5 * np.trace(cell_conductivity(geometry, np.ones(geometry.count), fluid).tensor)


@pytest.mark.parametrize(
    ("degrees", "finest"), [(5.0, (0.609052, 0.321464, 0.196592)), (10.0, (0.631383, 0.362842, 0.236941))]
)
def test_bonded_contacts_in_fluid_against_finest_grids(degrees, finest):
    geometry = touching_contacts("front_poly", degrees)
    found = [half_trace(geometry, fluid) for fluid in (0.1, 0.01, 0.001)]
    assert np.abs(np.array(found) / finest - 1.0).max() < 0.002


def test_necks_conduct_less_than_bonds_without_thickness():
    necks, bonds = touching_contacts("front_poly", neck=5.0), touching_contacts("front_poly", 5.0)
    for fluid, finest in ((0.1, 0.6057), (0.01, 0.3126), (0.001, 0.1878)):
        found = half_trace(necks, fluid)
        assert abs(found / finest - 1.0) < 0.003
        assert found < half_trace(bonds, fluid)


def test_a_contact_resistance_lies_between_none_and_no_contact():
    touching = half_trace(geometry_of("front_poly"), 0.1)
    for uniform in (True, False):
        values = [
            half_trace(touching_contacts("front_poly", 8.0, 0.0, resistance, uniform), 0.1)
            for resistance in (0.0, 1e-6, 0.1, 1.0, 10.0)
        ]
        assert values[1] == pytest.approx(values[0], rel=1e-4)
        assert (np.diff(values) < 0.0).all()
        assert values[-1] == pytest.approx(touching, rel=0.15)
    uniform, area = (half_trace(touching_contacts("front_poly", 8.0, 0.0, 1.0, u), 1e-6) for u in (True, False))
    assert 0.0 < 1.0 - area / uniform < 0.02


def test_a_resisting_chain_adds_its_resistances():
    # a column of disks between walls: n cells in series with n - 1 inner contacts and two at the walls
    def column(count, resistance):
        box = Box((1.0, float(count)), (True, False))
        centers = np.column_stack((np.full(count, 0.5), np.arange(count) + 0.5))
        cells = laguerre_cells(centers, np.full(count, 0.5), box)
        contact = np.abs(cells.normals[:, 1]) > 0.5
        half = np.radians(10.0) * np.repeat(contact[:, None], 2, axis=1)
        contacts = EdgeContacts(half, np.zeros(contact.size), resistance * contact)
        geometry = cell_geometry(centers, np.full(count, 0.5), box, contacts, cells)
        return count / cell_conductivity(geometry, np.ones(count), 1e-9, (1,)).tensor[1, 1]

    plain = column(3, 0.0)
    assert plain == pytest.approx(3.0 * column(1, 0.0), rel=1e-7)
    assert column(3, 2.0) == pytest.approx(plain + 4 * 2.0, rel=1e-5)


def test_replicas_rotation_permutation_and_scaling():
    centers, radii, box = load("ls75_poly")
    solid = np.random.default_rng(31).uniform(5.0, 50.0, radii.size)
    base = cell_conductivity(cell_geometry(centers, radii, box), solid, 1.0).tensor
    order = np.random.default_rng(32).permutation(radii.size)
    moved = cell_geometry(box.wrap(centers[order] + (0.31, 0.77)), radii[order], box)
    assert np.allclose(cell_conductivity(moved, solid[order], 1.0).tensor, base, rtol=1e-9)
    scaled = cell_geometry(1e-3 * centers, 1e-3 * radii, Box((1e-3, 1e-3), (True, True)))
    assert np.allclose(cell_conductivity(scaled, 7.0 * solid, 7.0).tensor, 7.0 * base, rtol=1e-9)
    turned = cell_geometry(np.column_stack((1.0 - centers[:, 1], centers[:, 0])), radii, box)
    quarter = cell_conductivity(turned, solid, 1.0).tensor
    assert np.allclose(quarter, [[base[1, 1], -base[0, 1]], [-base[0, 1], base[0, 0]]], rtol=1e-7)
    twice = cell_geometry(
        np.concatenate((centers, centers + (1.0, 0.0))), np.tile(radii, 2), Box((2.0, 1.0), (True, True))
    )
    assert np.allclose(cell_conductivity(twice, np.tile(solid, 2), 1.0).tensor, base, rtol=1e-9)


def test_walls_equal_the_mirrored_periodic_cell():
    rng = np.random.default_rng(33)
    centers = (np.mgrid[:3, :3].reshape(2, -1).T + 0.5 + rng.uniform(-0.15, 0.15, (9, 2))) / 3.0
    walled = cell_conductivity(cell_geometry(centers, np.full(9, 0.12), Box((1.0, 1.0))), np.full(9, 20.0), 1.0)
    mirrored = np.concatenate([centers, centers * (-1, 1), centers * (1, -1), -centers])
    doubled = Box((2.0, 2.0), (True, True))
    geometry = cell_geometry(doubled.wrap(mirrored), np.full(36, 0.12), doubled)
    periodic = cell_conductivity(geometry, np.full(36, 20.0), 1.0).tensor
    assert np.allclose(np.diag(walled.tensor), np.diag(periodic), rtol=1e-9)


@pytest.mark.parametrize("case", ["ls80_equal", "front_poly", "front_over"])
def test_conductivity_grows_with_either_phase_and_keeps_hashin_shtrikman(case):
    geometry = geometry_of(case)
    fraction = float(TABLE[TABLE["case"] == case][0]["solid_fraction"])
    ones = np.ones(geometry.count)
    found = [half_trace(geometry, fluid) for fluid in (1e-3, 1e-2, 0.1, 0.3, 1.0)]
    assert (np.diff(found) > 0.0).all()
    better = cell_conductivity(geometry, ones * np.where(np.arange(geometry.count) == 0, 1.5, 1.0), 0.1).tensor
    assert np.trace(better) > 2.0 * found[2]
    for fluid, value in zip((1e-3, 1e-2, 0.1, 0.3), found, strict=False):
        assert value > float(hashin_shtrikman_lower(fluid, 1.0, fraction, dimension=2)) * (1 - 1e-3)
        assert value < float(hashin_shtrikman_upper(fluid, 1.0, fraction, dimension=2)) * (1 + 1e-3)


def test_frames_are_symmetric_definite_and_repeatable():
    geometry = geometry_of("front_over")
    first, second = (build_model(geometry, np.full(geometry.count, 100.0), 1.0).system for _ in range(2))
    assert np.array_equal(first.matrix.data, second.matrix.data)
    dense = first.matrix.toarray()
    scale = np.abs(dense).max()
    assert np.abs(dense - dense.T).max() < 1e-13 * scale
    assert np.abs(dense.sum(axis=1)).max() < 1e-11 * scale
    values = np.linalg.eigvalsh(dense)
    assert values[0] > -1e-12 * scale
    assert values[1] > 0.0


def test_error_estimate_is_near_the_error():
    centers, radii, box = load("front_poly")
    row = TABLE[(TABLE["case"] == "front_poly") & (TABLE["contrast_ks_over_kf"] == 10)][0]
    geometry = cell_geometry(centers, radii, box)
    estimate = error_estimate(geometry, np.full(radii.size, 10.0), 1.0)
    error = abs(0.5 * np.trace(tensor(geometry, 10.0)) / row["k_mean"] - 1.0)
    assert 0.3 * error < estimate < 5.0 * error
    assert estimate < CALIBRATED_ERROR


@pytest.mark.parametrize("contrast", [1.0, 1.001])
def test_error_estimate_covers_disks_that_hardly_differ_from_the_fluid(contrast):
    """k = 1 + f (c - 1) up to the square of c - 1, whatever the arrangement."""
    geometry = geometry_of("ls60_equal")
    solid = np.full(geometry.count, contrast)
    estimate = error_estimate(geometry, solid, 1.0)
    exact = 1.0 + 0.6 * (contrast - 1.0)
    error = np.abs(np.diag(cell_conductivity(geometry, solid, 1.0).tensor) / exact - 1.0).max()
    assert error - 1e-6 < estimate < 1e-3


def test_bad_input_is_refused_with_its_reason():
    geometry = geometry_of("ls60_equal")
    ones = np.ones(geometry.count)
    for solid, fluid in ((ones, 0.0), (ones, -1.0), (ones, np.nan), (0.0 * ones, 1.0)):
        with pytest.raises(InputError, match="positive and finite"):
            cell_conductivity(geometry, solid, fluid)
    with pytest.raises(InputError, match="whole number from 1 to 5, found 6"):
        Resolution(6)
    with pytest.raises(InputError, match="bonded contacts or contact resistances"):
        cell_conductivity(touching_contacts("front_poly", 5.0), np.ones(40), 2.0)
    with pytest.raises(GeometryError, match=r"wider .* than their common Laguerre edge"):
        touching_contacts("front_poly", 60.0)
