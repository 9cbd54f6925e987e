"""One realization: every combination of values and methods on one packing, and failures as outcomes."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.medium.conduction import Conduction
from etc_engine.packing import PackingSpec, pack, parse_radii
from etc_engine.particle_files.table import ParticleTable
from etc_engine.realization import RealizationSpec, Status, realize
from etc_engine.realization.media import make_media

VALUES = {"bond_gap": 1e-6, "contact_resistance": 0.0, "particle_conductivity": 1.0, "pore_conductivity": 0.0}
SPEC = RealizationSpec(
    PackingSpec(
        "advancing-front", parse_radii("uniform:0.02:0.04"), Box((1.0, 1.0)), density=0.75, radius_growth=False
    ),
    "bonded",
    (Conduction("dtem", "chord"), Conduction("dtem", "standard")),
    VALUES,
    {"contact_angle": (np.radians(2.5), np.radians(10.0))},
)


def run(spec, seed=71):
    """Outcomes as an array over the axes and the methods."""
    result = realize(spec, np.random.default_rng(seed))
    cells = np.empty(spec.shape, dtype=object)
    cells.ravel()[:] = result.cells
    return cells, result


def k_xx(cells):
    return np.vectorize(lambda cell: cell.conductivity[0, 0], otypes=[float])(cells)


def statuses(cells):
    return {cell.status for cell in cells.ravel()}


def test_cells_are_ordered_by_angle_and_method():
    cells, result = run(SPEC)
    k = k_xx(cells)
    assert k.shape == (2, 2)
    assert (k[1] > k[0]).all()  # wider arcs
    assert (k[:, 0] > k[:, 1]).all()  # chord above standard
    assert statuses(cells) == {Status.OK}
    assert result.density == pytest.approx(0.75, abs=0.005)
    assert result.solid_fraction == pytest.approx(result.density, abs=1e-6)


def test_an_angle_does_not_depend_on_the_others():
    both, _ = run(SPEC)
    alone, _ = run(replace(SPEC, axes={"contact_angle": (np.radians(10.0),)}))
    np.testing.assert_array_equal(both[1, 0].conductivity, alone[0, 0].conductivity)


def test_axes_are_scaled_as_the_equations_say_and_do_not_disturb_each_other():
    """k -> c k for all conductivities; resistances count as R kappa: (kappa, R) and (c kappa, R/c) give k and c k."""
    axes = {
        "contact_angle": (np.radians(5.0), np.radians(10.0)),
        "contact_resistance": (0.0, 0.5, 1.0),
        "particle_conductivity": (1.0, 2.0),
    }
    values = {name: value for name, value in VALUES.items() if name not in axes}
    cells, _ = run(replace(SPEC, axes=axes, values=values, conduction=SPEC.conduction[:1]))
    k = k_xx(cells[..., 0])
    assert k.shape == (2, 3, 2)
    np.testing.assert_allclose(k[:, 0, 1], 2.0 * k[:, 0, 0], rtol=1e-8)
    np.testing.assert_allclose(k[:, 1, 1], 2.0 * k[:, 2, 0], rtol=1e-8)
    assert (np.diff(k, axis=1) < 0.0).all()
    alone, _ = run(replace(SPEC, axes={"contact_angle": axes["contact_angle"]}, conduction=SPEC.conduction[:1]))
    np.testing.assert_array_equal(k[:, 0, 0], k_xx(alone)[:, 0])


def test_media_share_what_does_not_change():
    axes = {"contact_angle": (0.05, 0.1), "contact_resistance": (0.0, 1.0), "particle_conductivity": (1.0, 2.0)}
    values = {name: value for name, value in VALUES.items() if name not in axes}
    spec = replace(SPEC, axes=axes, values=values)
    rng = np.random.default_rng(71)
    packing = pack(spec.packing, rng)
    media = make_media(ParticleTable(packing), spec, rng, contacts=True)
    assert len(media) == 8
    assert {id(medium.packing) for medium in media} == {id(packing)}
    assert len({id(medium.network) for medium in media}) == 4  # the conductivity changes no contacts
    assert len({id(medium.links.pairs) for medium in media}) == 1
    assert media[0].network is media[1].network


def angle_curve(*degrees, solver="reduced", spec=SPEC, methods=("chord", "standard")):
    conduction = tuple(Conduction("dtem", method, {"angle_curve": solver}) for method in methods)
    return run(replace(spec, axes={"contact_angle": tuple(np.radians(degrees))}, conduction=conduction))[0]


def test_many_angles_are_solved_together_within_a_tolerance():
    degrees = (1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 15.0)
    together, alone = angle_curve(*degrees), angle_curve(*degrees, solver="full")
    some = angle_curve(*degrees[:5])
    for m in (0, 1):
        column, exact = together[:, m], alone[:, m]
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
        for a, b in zip(column, some[:, m], strict=False):
            np.testing.assert_allclose(a.conductivity, b.conductivity, rtol=1e-8)


def test_the_angles_of_every_other_value_share_their_basis():
    """Four half-angles and two conductivities: two curves, with as many full solutions each as a curve alone."""
    axes = {"contact_angle": tuple(np.radians((2.0, 4.0, 6.0, 8.0))), "particle_conductivity": (1.0, 3.0)}
    values = {name: value for name, value in VALUES.items() if name not in axes}
    cells, _ = run(replace(SPEC, axes=axes, values=values, conduction=(Conduction("dtem", "chord"),)))
    words = np.vectorize(lambda cell: cell.solved_by, otypes=[object])(cells[..., 0])
    alone = [cell.solved_by for cell in angle_curve(2.0, 4.0, 6.0, 8.0, methods=("chord",))[:, 0]]
    assert words[:, 0].tolist() == words[:, 1].tolist() == alone
    np.testing.assert_allclose(k_xx(cells)[:, 1, 0], 3.0 * k_xx(cells)[:, 0, 0], rtol=1e-7)


def test_many_angles_give_the_same_bits_twice():
    one, other = (angle_curve(1.0, 3.0, 6.0, 9.0, 12.0) for _ in range(2))
    for a, b in zip(one.ravel(), other.ravel(), strict=True):
        np.testing.assert_array_equal(a.conductivity, b.conductivity)
        assert a.solved_by == b.solved_by


def test_an_angle_too_wide_does_not_disturb_the_others():
    degrees = (2.0, 4.0, 6.0, 8.0, 40.0)
    together, alone = angle_curve(*degrees), angle_curve(*degrees, solver="full")
    assert [cell.status for cell in together[:, 0]] == [Status.OK] * 4 + [Status.ERROR]
    assert together[4, 0].message == alone[4, 0].message
    assert together[4, 0].solved_by == ""
    np.testing.assert_allclose(together[3, 0].conductivity, alone[3, 0].conductivity, rtol=1e-8)


def test_below_percolation_many_angles_say_so_too():
    sparse = replace(SPEC, packing=replace(SPEC.packing, density=0.3))
    cells = angle_curve(2.0, 4.0, 6.0, 8.0, spec=sparse)
    assert statuses(cells) == {Status.NOT_PERCOLATING}
    assert np.diag(cells[2, 0].conductivity).tolist() == [0.0, 0.0]


def test_the_same_stream_gives_the_same_bits():
    one, other = run(SPEC)[0], run(SPEC)[0]
    for a, b in zip(one.ravel(), other.ravel(), strict=True):
        np.testing.assert_array_equal(a.conductivity, b.conductivity)


def test_below_percolation_the_cells_say_so_with_zero():
    cells, _ = run(replace(SPEC, packing=replace(SPEC.packing, density=0.3)))
    assert cells[0, 0].status is Status.NOT_PERCOLATING
    assert np.diag(cells[0, 0].conductivity).tolist() == [0.0, 0.0]
    assert cells[0, 0].message == "no path of contacts along xy"


def test_a_density_out_of_reach_is_a_failed_packing():
    cells, _ = run(replace(SPEC, packing=replace(SPEC.packing, density=0.95)))
    assert statuses(cells) == {Status.PACKING_FAILED}
    assert "0.95" in cells[1, 1].message


def test_arcs_that_overlap_are_an_error_with_a_reason():
    cells, _ = run(replace(SPEC, axes={"contact_angle": (np.radians(40.0),)}))
    assert cells[0, 0].status is Status.ERROR
    assert "overlap" in cells[0, 0].message


def test_a_mixture_is_met_to_the_nearest_particle_and_lies_between_its_materials():
    """The fractions of one packing are nested: its particles change in one random order."""
    fractions = (0.0, 0.3, 0.5, 1.0)
    mixed = replace(SPEC, values=VALUES | {"mixture_conductivity": 10.0}, conduction=SPEC.conduction[:1])
    mixed = replace(mixed, axes={"contact_angle": (0.1,), "mixture_fraction": fractions})
    rng = np.random.default_rng(71)
    packing = pack(mixed.packing, rng)
    second = [medium.conductivity == 10.0 for medium in make_media(ParticleTable(packing), mixed, rng, contacts=True)]
    assert [int(chosen.sum()) for chosen in second] == [round(f * packing.count) for f in fractions]
    assert all((~few | many).all() for few, many in pairwise(second))
    k = k_xx(run(mixed)[0])[0, :, 0]
    pure = k_xx(run(replace(mixed, values=VALUES, axes={"contact_angle": (0.1,)}))[0])[0, 0]
    assert k[0] == pure < k[1] < k[2] < k[3]
    assert k[3] == pytest.approx(10.0 * k[0], rel=1e-9)


def test_bounds_of_method_exact_are_in_its_cells():
    small = PackingSpec("advancing-front", parse_radii("uniform:0.06:0.09"), Box((1.0, 1.0)))
    methods = (Conduction("dtem", "chord"), Conduction("dtem", "exact"))
    chord, exact = run(RealizationSpec(small, "bonded", methods, VALUES | {"contact_angle": np.radians(5.0)}))[0]
    assert chord.conductivity_bounds == ()
    assert 0.0 < exact.model_error_estimate < 1e-4
    missed = abs(chord.conductivity[0, 0] / exact.conductivity[0, 0] - 1.0)
    assert missed < chord.model_error_estimate < 0.05
    for axis, (lower, upper) in enumerate(exact.conductivity_bounds):
        assert lower <= exact.conductivity[axis, axis] <= upper
        assert upper - lower < 1e-5 * upper


def test_the_pipe_engine_conducts_through_the_same_contacts():
    pipes = replace(SPEC, conduction=(Conduction("pipe", "chord"), Conduction("pipe", "uniform")))
    elements, found = run(SPEC)[0], run(pipes)[0]
    for cell, element in zip(found.ravel(), elements.ravel(), strict=True):
        assert cell.status is Status.OK
        assert (cell.contacts, cell.coordination) == (element.contacts, element.coordination)
        assert cell.conductivity[0, 0] == pytest.approx(element.conductivity[0, 0], rel=0.15)
        assert cell.conductivity[0, 0] != pytest.approx(element.conductivity[0, 0], rel=1e-4)
    assert k_xx(found)[0, 0] > k_xx(found)[0, 1]
