"""Bodies with a singular corner, and transforms that oscillate."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve

from etc_engine.engines.meshless import Dirichlet, Discretization, HeatProblem, Neumann, solve_transient
from etc_engine.engines.meshless.corners import corner_nodes, corner_sources, singular_corners
from etc_engine.engines.meshless.domain import Polygon
from etc_engine.errors import ConvergenceError, InputError

ELL = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)]
POINTS = [(0.5, 0.5), (0.875, 0.875), (1.5, 0.5), (0.9375, 0.9375), (1.125, 0.875), (0.5, 1.5)]


def steady_by_finite_elements(conductivity: float) -> np.ndarray:
    """k lap u = -1 in the L, u = 0 around it: linear elements on right triangles, which are the five-point formula.

    The error of the corner, h^(4/3), is removed by extrapolation from h = 1/64 and 1/128.
    """
    found = []
    for n in (64, 128):
        i, j = np.meshgrid(np.arange(2 * n + 1), np.arange(2 * n + 1), indexing="ij")
        inside = (i > 0) & (j > 0) & (((i < n) & (j < 2 * n)) | ((j < n) & (i < 2 * n)))
        number = np.full(i.shape, -1)
        number[inside] = np.arange(inside.sum())
        rows, columns, values = [number[inside]], [number[inside]], [np.full(inside.sum(), 4.0)]
        for di, dj in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            other = number[i[inside] + di, j[inside] + dj]
            rows.append(number[inside][other >= 0])
            columns.append(other[other >= 0])
            values.append(np.full((other >= 0).sum(), -1.0))
        matrix = coo_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))).tocsr()
        u = spsolve(matrix, np.full(inside.sum(), 1.0 / n**2 / conductivity))
        found.append(u[[number[round(x * n), round(y * n)] for x, y in POINTS]])
    return found[1] + (found[1] - found[0]) / (2.0 ** (4.0 / 3.0) - 1.0)


def heated_ell() -> HeatProblem:
    return HeatProblem(
        vertices=ELL, conductivity=0.7, heat_capacity=1.0, initial=0.0, source=1.0, boundary=[Dirichlet(0.0)] * 6
    )


@pytest.fixture(scope="module")
def reference() -> np.ndarray:
    return steady_by_finite_elements(0.7)


@pytest.mark.parametrize("method", ["trefftz", "mfs"])
@pytest.mark.parametrize("scheme", ["laplace", "sdirk2"])
def test_the_ell_meets_finite_elements(method, scheme, reference):
    """At t = 3 the slowest mode has decayed to exp(-20); before corner functions the error was 3 to 114 %."""
    found = solve_transient(heated_ell(), [3.0], POINTS, method=method, scheme=scheme)
    np.testing.assert_allclose(found.temperature.values[0], reference, rtol=1e-3)
    assert found.temperature.values[0, 0] == pytest.approx(0.18722, abs=1e-5)
    assert found.attrs["boundary_residual_max"] < 1e-3


def test_the_two_ways_in_time_agree_early():
    early = [solve_transient(heated_ell(), [0.3], POINTS, scheme=s, steps=60).temperature for s in ("laplace", "bdf2")]
    np.testing.assert_allclose(early[1].values, early[0].values, rtol=5e-3)


def test_without_its_functions_a_corner_is_refused_with_a_number():
    with pytest.raises(ConvergenceError, match=r"missed by up to \d+ % of the temperature span"):
        solve_transient(heated_ell(), [3.0], POINTS, discretization=Discretization(corner_sources=0))


BOTH_WAYS = (("trefftz", "laplace"), ("mfs", "sdirk2"))


def test_an_insulated_corner():
    """The L as a bent strip: by symmetry 0.5 on its diagonal, elsewhere both methods and ways in time agree."""
    boundary = [Neumann(0.0), Dirichlet(0.0), Neumann(0.0), Neumann(0.0), Dirichlet(1.0), Neumann(0.0)]
    problem = HeatProblem(vertices=ELL, conductivity=1.0, heat_capacity=1.0, initial=0.0, boundary=boundary)
    points = [(0.5, 0.5), (0.9, 0.9), (1.2, 0.9)]
    one, two = (solve_transient(problem, [20.0], points, method=m, scheme=s).temperature.values for m, s in BOTH_WAYS)
    np.testing.assert_allclose(one[0, :2], 0.5, atol=1e-6)
    np.testing.assert_allclose(two, one, rtol=1e-4)


def test_a_change_of_condition_on_a_straight_edge():
    """Half of the lower edge held and half insulated: r^(1/2)."""
    vertices = [(-1.0, 0.0), (0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (-1.0, 1.0)]
    boundary = [Neumann(0.0), Dirichlet(0.0), Dirichlet(0.0), Dirichlet(0.0), Dirichlet(0.0)]
    assert singular_corners(Polygon(vertices), boundary).tolist() == [1]
    problem = HeatProblem(
        vertices=vertices, conductivity=1.0, heat_capacity=1.0, initial=0.0, source=1.0, boundary=boundary
    )
    points = [(-0.5, 0.25), (-0.05, 0.02), (0.05, 0.05)]
    one, two = (solve_transient(problem, [2.0], points, method=m, scheme=s).temperature.values for m, s in BOTH_WAYS)
    np.testing.assert_allclose(two, one, rtol=5e-3)


def test_sources_stand_outside_and_nodes_on_the_edges():
    ell = Polygon(ELL)
    corners = singular_corners(ell, [Dirichlet(0.0)] * 6)
    sources, nodes = corner_sources(ell, [Dirichlet(0.0)] * 6, corners, 24), corner_nodes(ell, corners, 24)
    assert len(sources) == 24
    assert not ell.contains(sources).any()
    assert (ell.edge_distances(nodes.points)[np.arange(nodes.count), nodes.edges] < 1e-12).all()


def test_a_clockwise_ell_gives_the_same():
    one = solve_transient(heated_ell(), [0.3], POINTS, steps=20).temperature.values
    turned = HeatProblem(
        vertices=ELL[::-1], conductivity=0.7, heat_capacity=1.0, initial=0.0, source=1.0, boundary=[Dirichlet(0.0)] * 6
    )
    np.testing.assert_allclose(solve_transient(turned, [0.3], POINTS, steps=20).temperature.values, one, rtol=2e-3)


@pytest.mark.parametrize("t", [0.5, 3.0, 7.0])
def test_oscillating_transforms_are_inverted(t):
    """A square whose walls all follow sin 3t: marching in small steps gives the same."""
    wall = Dirichlet(lambda x, t: np.full(len(x), np.sin(3.0 * t)), lambda x, s: np.full(len(x), 3.0 / (s * s + 9.0)))
    problem = HeatProblem(
        vertices=[(0, 0), (1, 0), (1, 1), (0, 1)], conductivity=1.0, heat_capacity=1.0, initial=0.0, boundary=[wall] * 4
    )
    inverted = solve_transient(problem, [t], [(0.5, 0.5), (0.2, 0.7)], scheme="laplace").temperature.values
    marched = solve_transient(problem, [t], [(0.5, 0.5), (0.2, 0.7)], steps=400).temperature.values
    np.testing.assert_allclose(inverted, marched, atol=2e-3)


def test_a_foreign_transform_is_still_refused():
    wall = Dirichlet(lambda x, t: np.full(len(x), np.sin(3.0 * t)), lambda x, s: np.full(len(x), 3.0 / (s * s + 8.0)))
    problem = HeatProblem(
        vertices=[(0, 0), (1, 0), (1, 1), (0, 1)], conductivity=1.0, heat_capacity=1.0, initial=0.0, boundary=[wall] * 4
    )
    with pytest.raises(InputError, match="does not belong to its function"):
        solve_transient(problem, [1.0], [(0.5, 0.5)], scheme="laplace")
