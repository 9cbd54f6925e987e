from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.packing import PackingSpec, parse_radii
from etc_engine.realization import (
    ConductionSpec,
    ContactSpec,
    Mixture,
    RealizationSpec,
    Status,
    particle_conductivities,
    realize,
)

SPEC = RealizationSpec(
    PackingSpec("advancing-front", parse_radii("uniform:0.02:0.04"), Box((1.0, 1.0)), density=0.7, radius_growth=False),
    ContactSpec("bonded", (np.radians(2.5), np.radians(10.0))),
    ConductionSpec(methods=("chord", "standard")),
)


def run(spec, seed=71):
    return realize(spec, np.random.default_rng(seed))


def test_cells_are_ordered_by_angle_and_method():
    result = run(SPEC)
    k = np.array([[cell.conductivity[0, 0] for cell in row] for row in result.cells])
    assert k.shape == (2, 2)
    assert (k[1] > k[0]).all()  # wider arcs
    assert (k[:, 0] > k[:, 1]).all()  # chord above standard
    assert {cell.status for row in result.cells for cell in row} == {Status.OK}
    assert result.density == pytest.approx(0.7, abs=0.005)
    assert result.solid_fraction == pytest.approx(result.density, abs=1e-6)


def test_an_angle_does_not_depend_on_the_others():
    both = run(SPEC)
    alone = run(replace(SPEC, contacts=replace(SPEC.contacts, contact_angles=(np.radians(10.0),))))
    np.testing.assert_array_equal(both.cells[1][0].conductivity, alone.cells[0][0].conductivity)


def angle_curve(*degrees, solver="reduced", spec=SPEC, methods=("chord", "standard")):
    contacts = replace(spec.contacts, contact_angles=tuple(np.radians(degrees)))
    return run(replace(spec, contacts=contacts, conduction=ConductionSpec(methods=methods, angle_curve=solver)))


def test_many_angles_are_solved_together_within_a_tolerance():
    degrees = (1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 15.0)
    together, alone = angle_curve(*degrees), angle_curve(*degrees, solver="full")
    some = angle_curve(*degrees[:5])
    for m in (0, 1):
        column, exact = ([row[m] for row in result.cells] for result in (together, alone))
        words = [cell.solved_by for cell in column]
        assert "reduced" in words
        assert 1 <= words.count("full") <= 4
        assert [cell.snapshots > 0 for cell in column] == [word == "reduced" for word in words]
        assert all(cell.relative_energy_error <= 1e-8 for cell in column)
        assert {(cell.solved_by, cell.snapshots) for cell in exact} == {("full", 0)}
        for a, b in zip(column, exact, strict=True):
            np.testing.assert_allclose(a.conductivity, b.conductivity, rtol=1e-8)
            assert (a.contacts, a.unknowns, a.status) == (b.contacts, b.unknowns, b.status)
            assert a.mean_field_conductivity == b.mean_field_conductivity
        for a, b in zip(column, [row[m] for row in some.cells], strict=False):
            np.testing.assert_allclose(a.conductivity, b.conductivity, rtol=1e-8)


def test_many_angles_give_the_same_bits_twice():
    one, other = (angle_curve(1.0, 3.0, 6.0, 9.0, 12.0) for _ in range(2))
    for a, b in zip(one.cells, other.cells, strict=True):
        np.testing.assert_array_equal(a[0].conductivity, b[0].conductivity)
        assert a[0].solved_by == b[0].solved_by


def test_an_angle_too_wide_does_not_disturb_the_others():
    degrees = (2.0, 4.0, 6.0, 8.0, 40.0)
    together, alone = angle_curve(*degrees), angle_curve(*degrees, solver="full")
    assert [row[0].status for row in together.cells] == [Status.OK] * 4 + [Status.ERROR]
    assert together.cells[4][0].message == alone.cells[4][0].message
    assert together.cells[4][0].solved_by == ""
    np.testing.assert_allclose(together.cells[3][0].conductivity, alone.cells[3][0].conductivity, rtol=1e-8)


def test_below_percolation_many_angles_say_so_too():
    sparse = replace(SPEC, packing=replace(SPEC.packing, density=0.3))
    cells = angle_curve(2.0, 4.0, 6.0, 8.0, spec=sparse).cells
    assert {row[0].status for row in cells} == {Status.NOT_PERCOLATING}
    assert np.diag(cells[2][0].conductivity).tolist() == [0.0, 0.0]


def test_the_same_stream_gives_the_same_bits():
    one, other = run(SPEC), run(SPEC)
    for a, b in zip(one.cells, other.cells, strict=True):
        np.testing.assert_array_equal(a[0].conductivity, b[0].conductivity)


def test_below_percolation_the_cells_say_so_with_zero():
    spec = replace(SPEC, packing=replace(SPEC.packing, density=0.3))
    cell = run(spec).cells[0][0]
    assert cell.status is Status.NOT_PERCOLATING
    assert np.diag(cell.conductivity).tolist() == [0.0, 0.0]
    assert cell.message == "no path of contacts along xy"


def test_a_density_out_of_reach_is_a_failed_packing():
    cell = run(replace(SPEC, packing=replace(SPEC.packing, density=0.95))).cells[1][1]
    assert cell.status is Status.PACKING_FAILED
    assert np.isnan(cell.conductivity).all()
    assert "0.95" in cell.message


def test_arcs_that_overlap_are_an_error_with_a_reason():
    spec = replace(SPEC, contacts=replace(SPEC.contacts, contact_angles=(np.radians(40.0),)))
    cell = run(spec).cells[0][0]
    assert cell.status is Status.ERROR
    assert "overlap" in cell.message


def test_a_mixture_is_met_to_the_nearest_particle_and_lies_between_its_materials():
    mixed = ConductionSpec(mixture=Mixture(10.0, 0.3))
    values = particle_conductivities(1001, mixed, np.random.default_rng(72))
    assert np.count_nonzero(values == 10.0) == 300
    k = [
        run(replace(SPEC, conduction=ConductionSpec(mixture=mixture))).cells[0][0].conductivity[0, 0]
        for mixture in (None, Mixture(10.0, 0.0), Mixture(10.0, 0.5), Mixture(10.0, 1.0))
    ]
    assert k[0] == k[1] < k[2] < k[3]
    assert k[3] == pytest.approx(10.0 * k[0], rel=1e-9)


def test_bounds_of_method_exact_are_in_its_cells():
    small = PackingSpec("advancing-front", parse_radii("uniform:0.06:0.09"), Box((1.0, 1.0)))
    spec = RealizationSpec(small, ContactSpec("bonded", (np.radians(5.0),)), ConductionSpec(methods=("chord", "exact")))
    chord, exact = run(spec).cells[0]
    assert chord.conductivity_bounds == ()
    assert 0.0 < exact.model_error_estimate < 1e-4
    missed = abs(chord.conductivity[0, 0] / exact.conductivity[0, 0] - 1.0)
    assert missed < chord.model_error_estimate < 0.05
    for axis, (lower, upper) in enumerate(exact.conductivity_bounds):
        assert lower <= exact.conductivity[axis, axis] <= upper
        assert upper - lower < 1e-5 * upper


def test_the_pipe_engine_conducts_through_the_same_contacts():
    pipes = replace(SPEC, conduction=ConductionSpec(engine="pipe", methods=("chord", "uniform")))
    elements, result = run(SPEC), run(pipes)
    for ours, theirs in zip(result.cells, elements.cells, strict=True):
        for cell, element in zip(ours, theirs, strict=True):
            assert cell.status is Status.OK
            assert (cell.contacts, cell.coordination) == (element.contacts, element.coordination)
            assert cell.conductivity[0, 0] == pytest.approx(element.conductivity[0, 0], rel=0.15)
            assert cell.conductivity[0, 0] != pytest.approx(element.conductivity[0, 0], rel=1e-4)
    assert result.cells[0][0].conductivity[0, 0] > result.cells[0][1].conductivity[0, 0]
