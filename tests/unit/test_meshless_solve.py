"""solve_transient against exact series, its convergence orders, and the heat balance."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import j0, j1

from etc_engine.engines.meshless import (
    Convective,
    Dirichlet,
    Discretization,
    Disk,
    HeatProblem,
    Neumann,
    PolyharmonicSpline,
    solve_transient,
)

SIDE, K = 3.0, 1.25
POINTS_1 = np.array([(2.4, 1.5), (2.4, 2.4), (1.8, 1.5), (1.8, 1.8), (1.5, 1.5)])
POINTS_2 = np.array([(1.5, 0.3 * k) for k in range(1, 6)])
L_SHAPE = [(-1.0, -1.0), (1.0, -1.0), (1.0, 0.0), (0.0, 0.0), (0.0, 1.0), (-1.0, 1.0)]
SMALL = Discretization(boundary=100, interior=200)


def relative_error(found, exact):
    return np.linalg.norm(found - exact) / np.linalg.norm(exact)


def cooled_square(insulated=False):
    boundary = [Dirichlet(0.0)] * 3 + [Neumann(0.0) if insulated else Dirichlet(0.0)]
    return HeatProblem(
        vertices=[(0, 0), (SIDE, 0), (SIDE, SIDE), (0, SIDE)],
        conductivity=K,
        heat_capacity=1.0,
        initial=30.0,
        boundary=boundary,
    )


def fixed_slab(x, t):
    """Zero at both ends, one at the start."""
    n = np.arange(1, 100, 2)
    decay = 4.0 / (n * np.pi) * np.exp(-K * (n * np.pi / SIDE) ** 2 * t)
    return np.sin(np.outer(x, n) * np.pi / SIDE) @ decay


def half_slab(x, t):
    """Insulated at 0, zero at SIDE, one at the start."""
    n = np.arange(1, 60)
    decay = -4.0 * (-1.0) ** n / ((2 * n - 1) * np.pi) * np.exp(-K * ((n - 0.5) * np.pi / SIDE) ** 2 * t)
    return np.cos(np.outer(x, n - 0.5) * np.pi / SIDE) @ decay


def l_shape_problem():
    def shape(x):
        return np.cos(3.0 * x[:, 0]) * np.sinh(2.0 * x[:, 1])

    condition = Dirichlet(lambda x, t: shape(x) * np.exp(-5.0 * t), lambda x, s: shape(x) / (s + 5.0))
    problem = HeatProblem(
        vertices=L_SHAPE, conductivity=1.0, heat_capacity=1.0, initial=shape, boundary=[condition] * 6
    )
    rng = np.random.default_rng(2010)
    points = rng.uniform(-1.0, 1.0, (300, 2))
    points = points[problem.domain.contains(points)]
    return problem, points, lambda t: shape(points) * np.exp(-5.0 * t)


@pytest.mark.parametrize("method", ["trefftz", "mfs"])
@pytest.mark.parametrize("insulated", [False, True])
def test_square_reaches_its_accuracy(method, insulated):
    problem, points = cooled_square(insulated), POINTS_2 if insulated else POINTS_1
    across = half_slab if insulated else fixed_slab
    exact = 30.0 * across(points[:, 0], 1.2) * fixed_slab(points[:, 1], 1.2)
    marched = solve_transient(problem, [1.2], points, method=method, steps=96).temperature.values[0]
    inverted = solve_transient(problem, [1.2], points, method=method, scheme="laplace")
    assert relative_error(marched, exact) < 2e-4
    assert relative_error(inverted.temperature.values[0], exact) < 1e-6


@pytest.mark.parametrize("method", ["trefftz", "mfs"])
def test_l_shape_reaches_its_accuracy(method):
    problem, points, exact = l_shape_problem()
    marched = solve_transient(problem, [1.0], points, method=method, steps=50).temperature.values[0]
    inverted = solve_transient(problem, [1.0], points, method=method, scheme="laplace")
    assert relative_error(marched, exact(1.0)) < 3e-4
    assert relative_error(inverted.temperature.values[0], exact(1.0)) < 1e-5


@pytest.mark.parametrize("order, least", [(1, 3.5), (2, 4.0)])
def test_order_in_space(order, least):
    # Laplace inversion leaves the error in space alone. Twice as many nodes along the boundary and four
    # times as many inside: the order was found between 4 and 5 for both splines.
    problem, points, exact = l_shape_problem()
    errors = []
    for boundary, interior in ((60, 110), (120, 440)):
        layout = Discretization(
            boundary=boundary, interior=interior, basis=PolyharmonicSpline(order), spacing="uniform"
        )
        found = solve_transient(problem, [0.3], points[:60], scheme="laplace", discretization=layout)
        errors.append(relative_error(found.temperature.values[0], exact(0.3)[:60]))
    assert np.log2(errors[0] / errors[1]) > least


def robin_slab(x, fourier, biot):
    """Insulated at 0, convective at 1, one at the start, ambient zero."""
    total = np.zeros_like(x)
    for n in range(40):
        z = brentq(lambda z: z * np.tan(z) - biot, n * np.pi + 1e-9, (n + 0.5) * np.pi - 1e-9)
        total += 4 * np.sin(z) / (2 * z + np.sin(2 * z)) * np.cos(z * x) * np.exp(-z * z * fourier)
    return total


def robin_square():
    # k = 2, rho c = 4, side 1, h = 3: Biot number 1.5, diffusivity 0.5
    convective = Convective(3.0, 5.0)
    return HeatProblem(
        vertices=[(0, 0), (1, 0), (1, 1), (0, 1)],
        conductivity=2.0,
        heat_capacity=4.0,
        initial=10.0,
        boundary=[Neumann(0.0), convective, convective, Neumann(0.0)],
    )


@pytest.mark.parametrize("method", ["trefftz", "mfs"])
@pytest.mark.parametrize("scheme, tolerance", [("sdirk2", 1e-5), ("laplace", 1e-8)])
def test_convective_square_against_its_series(method, scheme, tolerance):
    points = np.random.default_rng(12).uniform(0.0, 1.0, (50, 2))
    result = solve_transient(robin_square(), [0.6], points, method=method, scheme=scheme, steps=50)
    exact = 5.0 + 5.0 * robin_slab(points[:, 0], 0.3, 1.5) * robin_slab(points[:, 1], 0.3, 1.5)
    assert relative_error(result.temperature.values[0], exact) < tolerance


@pytest.mark.parametrize("scheme, order", [("backward-euler", 1), ("bdf2", 2), ("sdirk2", 2), ("crank-nicolson", 2)])
def test_order_in_time(scheme, order):
    points = np.random.default_rng(12).uniform(0.0, 1.0, (50, 2))
    exact = 5.0 + 5.0 * robin_slab(points[:, 0], 0.3, 1.5) * robin_slab(points[:, 1], 0.3, 1.5)
    errors = []
    for steps in (10, 20):
        result = solve_transient(robin_square(), [0.6], points, scheme=scheme, steps=steps)
        errors.append(relative_error(result.temperature.values[0], exact))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.2)


@pytest.mark.parametrize("method", ["trefftz", "mfs"])
@pytest.mark.parametrize("scheme, tolerance", [("sdirk2", 2e-5), ("laplace", 1e-8)])
def test_convective_disk_against_its_bessel_series(method, scheme, tolerance):
    biot, grid = 1.5, np.arange(1e-6, 120.0, 0.05)
    values = grid * j1(grid) - biot * j0(grid)
    starts = grid[:-1][values[:-1] * values[1:] < 0.0]
    roots = [brentq(lambda z: z * j1(z) - biot * j0(z), a, a + 0.05) for a in starts]
    problem = HeatProblem(
        disk=Disk((1.0, 2.0), 0.5),
        conductivity=2.0,
        heat_capacity=4.0,
        initial=10.0,
        boundary=[Convective(biot * 2.0 / 0.5, 5.0)],
    )
    r = np.linspace(0.0, 0.5, 9)
    points = np.column_stack([1.0 + r * np.cos(0.7), 2.0 + r * np.sin(0.7)])
    result = solve_transient(problem, [0.1], points, method=method, scheme=scheme, steps=50)
    fourier = 0.1 * 0.5 / 0.25
    exact = 5.0 + 5.0 * sum(
        2 * biot * j0(2 * z * r) / ((z * z + biot**2) * j0(z)) * np.exp(-z * z * fourier) for z in roots
    )
    assert relative_error(result.temperature.values[0], exact) < tolerance


@pytest.mark.parametrize("scheme, tolerance", [("laplace", 1e-7), ("sdirk2", 2e-5)])
def test_heat_that_enters_is_heat_that_is_stored(scheme, tolerance):
    nodes, weights = np.polynomial.legendre.leggauss(8)
    first, last = 0.1, 0.6
    times = first + 0.5 * (last - first) * (nodes + 1.0)
    result = solve_transient(
        robin_square(), [first, *times, last], [(0.5, 0.5)], scheme=scheme, steps=150, discretization=SMALL
    )
    stored = 4.0 * float(result.mean_temperature[-1] - result.mean_temperature[0])
    entered = 0.5 * (last - first) * float(weights @ result.heat_inflow.values[1:-1])
    assert entered == pytest.approx(stored, rel=tolerance)


def test_source_in_an_insulated_body_warms_it_evenly():
    problem = HeatProblem(
        vertices=[(0, 0), (2, 0), (2, 1), (0, 1)],
        conductivity=3.0,
        heat_capacity=2.0,
        initial=7.0,
        boundary=[Neumann(0.0)] * 4,
        source=lambda _, t: 10.0 * t,
    )
    result = solve_transient(problem, [0.5, 1.0], [(0.3, 0.4), (1.9, 0.9)], steps=20, discretization=SMALL)
    exact = 7.0 + 10.0 * np.array([0.5, 1.0]) ** 2 / 2.0 / 2.0
    np.testing.assert_allclose(result.temperature, np.column_stack([exact, exact]), rtol=1e-6)
    np.testing.assert_allclose(result.mean_temperature, exact, rtol=1e-6)


def test_heat_flux_is_fouriers_law():
    problem, points, _ = l_shape_problem()
    result = solve_transient(problem, [0.4], points[:40], scheme="laplace", discretization=SMALL)
    x, y = points[:40].T
    decay = np.exp(-2.0)
    flux = np.column_stack([3.0 * np.sin(3.0 * x) * np.sinh(2.0 * y), -2.0 * np.cos(3.0 * x) * np.cosh(2.0 * y)])
    np.testing.assert_allclose(result.heat_flux.values[0], flux * decay, atol=2e-4 * np.abs(flux).max() * decay)


def test_initial_time_answers_the_initial_state():
    problem, points, exact = l_shape_problem()
    result = solve_transient(problem, [0.0, 0.1], points[:30], steps=5, discretization=SMALL)
    np.testing.assert_allclose(result.temperature.values[0], exact(0.0)[:30])
    assert np.isnan(result.heat_inflow.values[0]) and np.isfinite(result.heat_inflow.values[1])


def test_output_times_off_the_step_grid_are_hit_exactly():
    times = [0.11, 0.5, 1.2]
    result = solve_transient(cooled_square(), times, POINTS_1, steps=120, discretization=SMALL)
    exact = [30.0 * fixed_slab(POINTS_1[:, 0], t) * fixed_slab(POINTS_1[:, 1], t) for t in times]
    for found, truth in zip(result.temperature.values, exact, strict=True):
        assert relative_error(found, truth) < 2e-3


def test_scaling_of_units_leaves_the_answer():
    # millimetres instead of metres with k and time to match: same Fourier number, same temperatures
    plain = solve_transient(cooled_square(), [1.2], POINTS_1, steps=24, discretization=SMALL)
    small = HeatProblem(
        vertices=[(0, 0), (3e-3, 0), (3e-3, 3e-3), (0, 3e-3)],
        conductivity=K * 40.0,
        heat_capacity=2e6,
        initial=30.0,
        boundary=[Dirichlet(0.0)] * 4,
    )
    time = 1.2 * 1e-6 * 2e6 / 40.0
    scaled = solve_transient(small, [time], POINTS_1 * 1e-3, steps=24, discretization=SMALL)
    np.testing.assert_allclose(scaled.temperature, plain.temperature, rtol=1e-8)
