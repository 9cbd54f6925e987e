"""Radial, polynomial, Trefftz and fundamental functions satisfy their equations; nodes and quadrature fit."""

import numpy as np
import pytest
from scipy.special import iv, kv

from etc_engine.engines.meshless import Disk, Polygon, PolyharmonicSpline, ReverseBasis
from etc_engine.engines.meshless.domain import boundary_quadrature
from etc_engine.engines.meshless.fundamental_solutions import fundamental_solutions
from etc_engine.engines.meshless.nodes import boundary_nodes, interior_nodes
from etc_engine.engines.meshless.polynomials import monomials, particular_monomials
from etc_engine.engines.meshless.stepping import FACTORS, StepLibrary, amplification, spectral_radius
from etc_engine.engines.meshless.trefftz import scaled_bessel, trefftz_functions

LAMBDAS = [0.2, 0.99, 1.01, 6.0, 45.0, 3.0 + 2.0j, 2.0 + 11.0j]
L_SHAPE = [(-1.0, -1.0), (1.0, -1.0), (1.0, 0.0), (0.0, 0.0), (0.0, 1.0), (-1.0, 1.0)]


def laplacian(gradient, points, step=1e-4):
    """Divergence of a gradient by central differences."""
    ex, ey = np.array([step, 0.0]), np.array([0.0, step])
    along_x = (gradient(points + ex)[0] - gradient(points - ex)[0]) / (2 * step)
    return along_x + (gradient(points + ey)[1] - gradient(points - ey)[1]) / (2 * step)


@pytest.fixture
def points():
    return np.random.default_rng(31).uniform(-0.6, 0.6, (12, 2))


@pytest.mark.parametrize("lam", LAMBDAS)
@pytest.mark.parametrize("basis", [PolyharmonicSpline(n) for n in (1, 2, 3, 4, 5)] + [ReverseBasis()])
def test_radial_particular_solutions(basis, lam):
    # (1/r) d/dr (r psi') = r d/dr(psi'/r) + 2 psi'/r
    r = np.array([0.1, 0.23, 0.5, 1.1, 1.9])
    step, reach = 1e-4, 2.0

    def slope(r):
        return basis.particular_slope_over_r(r, lam, reach)

    along = (slope(r + step) - slope(r - step)) / (2 * step) * r + 2.0 * slope(r)
    residual = along - lam**2 * basis.particular(r, lam, reach) - basis.value(r, lam)
    assert np.abs(residual).max() < 1e-6 * np.abs(along).max()
    difference = (basis.particular(r + step, lam, reach) - basis.particular(r - step, lam, reach)) / (2 * step)
    np.testing.assert_allclose(difference, slope(r) * r, atol=1e-6 * np.abs(slope(r)).max())


def test_thin_plate_particular_solution_is_equation_23():
    lam, r = 5.0, np.array([1e-3, 0.05, 0.19, 0.21, 0.7])
    expected = -4 / lam**4 - 4 * np.log(r) / lam**4 - r**2 * np.log(r) / lam**2 - 4 * kv(0, lam * r) / lam**4
    found = PolyharmonicSpline(1).particular(r, lam, reach=2.0)
    np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-16)
    at_zero = -4 / lam**4 + 4 * np.euler_gamma / lam**4 + 4 / lam**4 * np.log(lam / 2)
    assert PolyharmonicSpline(1).particular(np.zeros(1), lam, reach=2.0)[0] == pytest.approx(at_zero, rel=1e-12)


@pytest.mark.parametrize("lam", LAMBDAS)
def test_particular_monomials(points, lam):
    degree = 4
    found = laplacian(lambda x: particular_monomials(x, lam, degree)[1:], points)
    found = found - lam**2 * particular_monomials(points, lam, degree)[0]
    expected = monomials(points, degree)[0]
    # second differences of p, which is about 1/lambda^2 at most
    np.testing.assert_allclose(found, expected, atol=1e-6)


@pytest.mark.parametrize("lam", LAMBDAS)
def test_trefftz_functions_solve_the_homogeneous_equation(points, lam):
    value, *_ = trefftz_functions(points, lam, 15)
    residual = laplacian(lambda x: trefftz_functions(x, lam, 15)[1:], points) - lam**2 * value
    assert np.abs(residual).max() < 2e-6 * (1.0 + abs(lam) ** 2)
    step = np.array([1e-5, 0.0])
    difference = (trefftz_functions(points + step, lam, 15)[0] - trefftz_functions(points - step, lam, 15)[0]) / 2e-5
    np.testing.assert_allclose(difference, trefftz_functions(points, lam, 15)[1], atol=1e-6)


def test_scaled_bessel_functions_where_scipy_still_follows():
    r = np.linspace(0.05, 1.0, 7)
    for lam in (0.5, 7.0, 60.0):
        orders = np.arange(21)
        expected = iv(orders, lam * r[:, None]) / iv(orders, lam)
        np.testing.assert_allclose(scaled_bessel(20, lam, r), expected, rtol=1e-11, atol=1e-300)


@pytest.mark.parametrize("lam", [1e-3, 1.0, 900.0, 60.0 * np.exp(1.4j)])
def test_trefftz_functions_of_high_order_neither_over_nor_underflow(lam):
    circle = np.column_stack([np.cos(np.arange(9)), np.sin(np.arange(9))])
    value, along_x, along_y = trefftz_functions(circle, lam, 601)
    normal = circle[:, :1] * along_x + circle[:, 1:] * along_y
    assert np.isfinite(normal).all()
    # on the unit circle they are cos(n phi) and sin(n phi)
    np.testing.assert_allclose(value[:, 599], np.cos(300 * np.arctan2(circle[:, 1], circle[:, 0])), atol=1e-9)


@pytest.mark.parametrize("lam", [0.2, 6.0, 400.0, 3.0 + 2.0j])
def test_fundamental_solutions(points, lam):
    sources, nearest = np.array([[1.3, 0.0], [0.2, -1.4]]), np.array([0.4, 0.5])
    value, along_x, along_y = fundamental_solutions(points, sources, nearest, lam)
    r = np.linalg.norm(points[:, None] - sources, axis=2)
    if abs(lam) < 100:
        np.testing.assert_allclose(value, kv(0, lam * r) / kv(0, lam * nearest), rtol=1e-10)
        residual = laplacian(lambda x: fundamental_solutions(x, sources, nearest, lam)[1:], points)
        np.testing.assert_allclose(residual, lam**2 * value, atol=1e-5 * np.abs(lam**2 * value).max())
    assert np.isfinite([value, along_x, along_y]).all()


@pytest.mark.parametrize("domain", [Polygon(L_SHAPE), Polygon(L_SHAPE[::-1]), Disk((0.3, -0.2), 0.8)])
def test_quadratures_agree_by_the_divergence_theorem(domain):
    # div (x^3, x y^2) = 3 x^2 + 2 x y
    inside, weights = domain.quadrature(6)
    x, y = inside.T
    area = float(weights @ (3 * x**2 + 2 * x * y))
    at, normals, lengths = boundary_quadrature(domain, 12)
    flux = at[:, 0] ** 3 * normals[:, 0] + at[:, 0] * at[:, 1] ** 2 * normals[:, 1]
    assert float(lengths @ flux) == pytest.approx(area, rel=1e-9)
    assert weights.sum() == pytest.approx(domain.area) and lengths.sum() == pytest.approx(domain.edge_lengths.sum())


@pytest.mark.parametrize("spacing", ["uniform", "chebyshev"])
@pytest.mark.parametrize("domain", [Polygon(L_SHAPE), Disk((0.3, -0.2), 0.8)])
def test_generated_nodes(domain, spacing):
    inside = interior_nodes(domain, 150, spacing)
    assert len(inside) == pytest.approx(150, rel=0.15)
    assert domain.contains(inside).all()
    around = boundary_nodes(domain, 90, spacing)
    assert domain.edge_distances(around.points).min(axis=1).max() < 1e-12
    assert not domain.contains(around.points + 1e-6 * around.normals).any()
    assert domain.contains(around.points - 1e-6 * around.normals).all()


@pytest.mark.parametrize("scheme", FACTORS)
def test_amplification_is_that_of_the_scheme(scheme):
    # one mode u' = -mu u with lambda^2 scaled to 1/tau': the implicit solve answers s = 1/(1 + mu tau/factor)
    mu_tau = np.array([0.01, 0.3, 5.0])
    s = 1.0 / (1.0 + mu_tau / FACTORS[scheme])
    found = amplification(s + 0j, scheme).real
    order = 2 if scheme == "backward-euler" else 3
    assert abs(found[0] - np.exp(-0.01)) < 2.0 * 0.01**order
    assert (np.abs(found) < 1.0).all()


@pytest.mark.parametrize("scheme", FACTORS)
@pytest.mark.parametrize("order", [2, 5])
def test_spectral_radius_of_large_systems_is_that_of_small_ones(scheme, order, monkeypatch):
    # order 5 on graded nodes marches unstably, partly through negative eigenvalues inside the unit circle
    from etc_engine.engines.meshless import Dirichlet, Discretization, HeatProblem, stepping
    from etc_engine.engines.meshless.discretization import lay_out

    problem = HeatProblem(
        vertices=L_SHAPE, conductivity=1.0, heat_capacity=1.0, initial=1.0, boundary=[Dirichlet(0.0)] * 6
    )
    layout = lay_out(problem, Discretization(boundary=60, interior=150, basis=PolyharmonicSpline(order)), "trefftz")
    step = StepLibrary(layout).get(FACTORS[scheme], 0.02)
    dense = spectral_radius(step, scheme)
    monkeypatch.setattr(stepping, "DENSE_LIMIT", 10)
    assert spectral_radius(step, scheme) == pytest.approx(dense, rel=1e-4)
