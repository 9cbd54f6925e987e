from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
from scipy.linalg import eigh

from etc_engine.box import Box
from etc_engine.engines.dtem import angle_curve
from etc_engine.engines.dtem.angle_curve import solve_angle_curve
from etc_engine.engines.dtem.conductivity import conductivity_curve, element_conductivity, solve_series
from etc_engine.engines.dtem.element import smallest_ratio
from etc_engine.engines.dtem.methods import find_method
from etc_engine.engines.dtem.steady import solve_steady
from etc_engine.medium.conduction import Conduction
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import bonded_contacts
from etc_engine.medium.sides import contact_sides
from etc_engine.packing import PackingSpec, pack, parse_radii
from etc_engine.packing.particles import ParticlePacking
from etc_engine.realization import effective_conductivity


def packed(radii):
    spec = PackingSpec("advancing-front", parse_radii(radii), Box((1.0, 1.0)), radius_growth=False)
    return bonded_contacts(pack(spec, np.random.default_rng(311)), 0.1)


@pytest.fixture(scope="module")
def walled():
    return packed("uniform:0.02:0.04")


def honeycomb(columns=6, rows=4):
    """Three contacts a disk, 120 degrees apart: arcs of up to 60 degrees fit. Periodic."""
    a = np.sqrt(3.0)
    cell = np.array([(0.0, 0.0), (a / 2, 0.5), (a / 2, 1.5), (0.0, 2.0)])
    corners = np.array([(i * a, 3.0 * j) for i in range(columns) for j in range(rows)])
    centers = (corners[:, None] + cell + (0.2, 0.3)).reshape(-1, 2)
    box = Box((columns * a, 3.0 * rows), (True, True))
    packing = ParticlePacking(centers, np.full(len(centers), 0.5), box)
    return bonded_contacts(packing, 0.1), np.random.default_rng(312).uniform(0.2, 5.0, len(centers))


def at_angle(medium, angle):
    return medium.with_network(medium.links.with_half_angle(angle))


def energies(medium, angles, axes, **options):
    return [
        np.diag(solve_steady(at_angle(medium, angle), axes, tolerance=1e-13, **options).energies) for angle in angles
    ]


def test_twenty_angles_take_few_solves(walled):
    """Three up to where contacts come close, and some more while disk by disk the weight of close contacts rises."""
    angles = np.radians(np.linspace(1.0, 20.0, 20))
    curve = dict(solve_angle_curve(medium_of(walled), (0,), angles))
    excess = np.array(
        [curve[i].energies[0, 0] / e[0] - 1.0 for i, e in enumerate(energies(medium_of(walled), angles, (0,)))]
    )
    assert sum(solution.snapshots == 0 for solution in curve.values()) <= 6
    assert excess.max() <= 1e-8
    assert excess.min() > -1e-12  # an upper bound of the discrete energy
    reduced = [i for i in curve if curve[i].snapshots]
    assert all(curve[i].certified and excess[i] <= curve[i].relative_energy_error for i in reduced)


@pytest.mark.parametrize("method", ["chord", "arc"])
def test_an_extreme_range_is_solved_in_full_more_often(method):
    network, kappa = honeycomb()
    angles = np.radians(np.geomspace(0.1, 59.0 if method == "arc" else 45.0, 12))
    medium = medium_of(network.with_resistance(0.01), kappa)
    curve = dict(solve_angle_curve(medium, (0, 1), angles, method=method))
    narrow = dict(solve_angle_curve(medium, (0, 1), np.radians(np.geomspace(2.0, 4.0, 12)), method=method))
    full = [sum(solution.snapshots == 0 for solution in c.values()) for c in (curve, narrow)]
    assert 12 > full[0] > full[1]
    for index, exact in enumerate(energies(medium, angles, (0, 1), method=method)):
        excess = np.diag(curve[index].energies) / exact - 1.0
        assert excess.min() > -1e-12
        assert excess.max() <= 1e-8


def test_the_estimate_keeps_out_a_snapshot_that_is_too_far(monkeypatch):
    network, kappa = honeycomb()
    angles = np.radians([0.1, 45.0])
    # without a contact resistance all elements of a honeycomb would change by one factor
    medium = medium_of(network.with_resistance(0.1), kappa)
    strict = dict(solve_angle_curve(medium, (0, 1), angles))
    assert [strict[i].snapshots for i in (0, 1)] == [0, 0]
    monkeypatch.setattr(angle_curve, "TOLERANCE", 1.0)
    loose = dict(solve_angle_curve(medium, (0, 1), angles, tolerance=1.0))
    (far,) = [i for i in (0, 1) if loose[i].snapshots]
    error = np.diag(loose[far].energies) / energies(medium, angles, (0, 1))[far] - 1.0
    assert 1e-6 < error.max() <= loose[far].relative_energy_error


def test_the_whole_tensor_of_a_periodic_box():
    network, kappa = honeycomb()
    medium = medium_of(network.with_resistance(0.1), kappa)
    angles = np.radians(np.linspace(3.0, 30.0, 8))
    for angle, point in zip(angles, conductivity_curve(medium, angles), strict=True):
        exact = element_conductivity(at_angle(medium, angle), tolerance=1e-13).tensor
        assert abs(exact[0, 1]) > 1e-4
        np.testing.assert_allclose(point.tensor, exact, rtol=0.0, atol=1e-8 * exact.max())
        np.testing.assert_array_equal(point.tensor, point.tensor.T)


def test_large_systems_are_estimated_not_certified(monkeypatch):
    from etc_engine.solvers import amg_cg, reduced_basis

    monkeypatch.setattr(
        reduced_basis, "build_preconditioner", lambda matrix: amg_cg.build_preconditioner(matrix, exact_level=100)
    )
    network = packed("uniform:0.01:0.02")
    angles = np.radians(np.linspace(1.0, 20.0, 10))
    curve = dict(solve_angle_curve(medium_of(network), (0,), angles))
    reduced = [i for i in curve if curve[i].snapshots]
    assert len(reduced) >= 4
    assert not any(curve[i].certified for i in reduced)
    exact = energies(medium_of(network), angles, (0,))
    assert all(0.0 < curve[i].energies[0, 0] / exact[i][0] - 1.0 <= curve[i].relative_energy_error for i in reduced)


@pytest.mark.parametrize("method", ["chord", "standard", "arc"])
def test_the_ratio_of_elements_is_below_the_smallest_eigenvalue(walled, method):
    modes = 3 if method == "arc" else 1
    kappa, tied = np.ones(walled.packing.count), walled.with_resistance(0.02)
    wide, narrow = (
        find_method(method).elements(contact_sides(tied.with_half_angle(angle)), kappa, modes)
        for angle in np.radians([8.0, 2.0])
    )
    for one, other in ((wide, narrow), (narrow, wide)):
        least = np.inf
        for p in range(walled.packing.count):
            n = one.offsets[p + 1] - one.offsets[p]
            if n <= one.modes:
                continue
            rows = np.delete(np.arange(n), n - one.modes)  # one node grounded
            a, b = (e.values[e.starts[p] : e.starts[p + 1]].reshape(n, n)[np.ix_(rows, rows)] for e in (one, other))
            least = min(least, eigh(a, b, eigvals_only=True)[0])
        assert 0.5 * least < smallest_ratio(one, other) <= least * (1.0 + 1e-9)


def test_an_axis_that_nothing_spans_stays_zero():
    row = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    network = bonded_contacts(row, 0.1)
    points = conductivity_curve(medium_of(network), [0.05, 0.1, 0.2, 0.3])
    for angle, point in zip([0.05, 0.1, 0.2, 0.3], points, strict=True):
        exact = effective_conductivity(medium_of(network.with_half_angle(angle)))
        assert point.missing_axes == exact.missing_axes == "y"
        np.testing.assert_allclose(point.tensor, exact.tensor, rtol=1e-9)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_load_that_drives_nothing_has_no_energy(axis):
    """A row of disks around a periodic box conducts along one axis only."""
    centers = np.full((4, 2), 0.5)
    centers[:, axis] = 0.125 + 0.25 * np.arange(4)
    chain = ParticlePacking(centers, np.full(4, 0.125), Box((1.0, 1.0), (True, True)))
    network, kappa = bonded_contacts(chain, 0.1), np.array([1.0, 2.0, 0.5, 3.0])
    angles = [0.05, 0.1, 0.2, 0.3, 0.4]
    for angle, point in zip(angles, conductivity_curve(medium_of(network, kappa), angles), strict=True):
        exact = effective_conductivity(medium_of(network.with_half_angle(angle), kappa))
        assert point.missing_axes == exact.missing_axes != ""
        np.testing.assert_allclose(point.tensor, exact.tensor, rtol=1e-8, atol=1e-12)


def test_the_bits_do_not_depend_on_the_number_of_threads():
    script = """
import numpy as np
from etc_engine import Box, PackingSpec, bonded_contacts, medium_of, pack, parse_radii
from etc_engine.engines.dtem.angle_curve import solve_angle_curve
spec = PackingSpec("advancing-front", parse_radii("uniform:0.006:0.012"), Box((1.0, 1.0)), radius_growth=False)
network = bonded_contacts(pack(spec, np.random.default_rng(313)), 0.1)
for index, solution in solve_angle_curve(medium_of(network), (0,), [0.02, 0.05, 0.1, 0.15, 0.2]):
    print(index, solution.snapshots, solution.energies.item().hex())
"""
    answers = []
    for threads in ("1", "2"):
        environment = os.environ | dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), threads)
        done = subprocess.run(
            [sys.executable, "-c", script], capture_output=True, text=True, env=environment, check=True
        )
        answers.append(done.stdout)
    assert answers[0] == answers[1]
    assert len(answers[0].splitlines()) == 5


def test_a_series_along_one_axis_is_that_of_each_medium_alone(walled):
    media = [medium_of(walled.with_half_angle(angle), conductivity=1.0) for angle in (0.05, 0.08, 0.1, 0.12)]
    found = solve_series(media, Conduction("dtem", "chord", axes=(1,)))
    for medium, result in zip(media, found, strict=True):
        alone = element_conductivity(medium, method="chord", axes=(1,))
        assert result.tensor[1, 1] == pytest.approx(alone.tensor[1, 1], rel=1e-8)
