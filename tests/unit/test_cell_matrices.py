"""The parts of the cell element, each against quadrature or dense linear algebra."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import dblquad

from etc_engine.engines.dtem.cell.elimination import eliminate_dense, solve_cyclic, substitute_back
from etc_engine.engines.dtem.cell.frame import lagrange_values, lobatto_points
from etc_engine.engines.dtem.cell.rim import disk_energy
from etc_engine.engines.dtem.cell.rim_grid import BONDED, CUT, FINEST, GAP, TOUCHING, divide_edges
from etc_engine.engines.dtem.cell.strip import corner_exponent, strip_matrix


def disk_matrix(angles, conductivity=1.0):
    count = angles.size
    spare, out = np.empty((count, count)), np.empty((count, count))
    disk_energy(angles, count, conductivity, spare, out)
    return out


def test_disk_energy_equals_its_fourier_series():
    rng = np.random.default_rng(20)
    angles = np.sort(rng.uniform(-np.pi, np.pi, 17))
    values = rng.normal(size=17)
    # of a function linear between nodes: its slope jumps at the nodes, c_k = -sum_m jump_m e^(-i k phi_m) / (2 pi k^2)
    steps = np.diff(np.concatenate((angles, angles[:1] + 2.0 * np.pi)))
    slopes = np.diff(np.concatenate((values, values[:1]))) / steps
    jumps = slopes - np.roll(slopes, 1)
    k = np.arange(1, 200001)
    energy = 0.0
    for part in np.array_split(k, 100):
        modes = np.exp(-1j * np.outer(part, angles)) @ jumps / (2.0 * np.pi * part**2)
        energy += 4.0 * np.pi * float(np.sum(part * np.abs(modes) ** 2))
    assert values @ disk_matrix(angles, 2.5) @ values == pytest.approx(2.5 * energy, rel=1e-9)


def test_disk_energy_is_semi_definite_and_blind_to_a_uniform_temperature():
    angles = np.sort(np.random.default_rng(21).uniform(0.0, 6.2, 40))
    matrix = disk_matrix(angles)
    assert np.abs(matrix.sum(axis=1)).max() < 1e-10 * np.abs(matrix).max()
    assert np.abs(matrix - matrix.T).max() < 1e-10 * np.abs(matrix).max()
    values = np.linalg.eigvalsh(0.5 * (matrix + matrix.T))
    assert values[0] > -1e-12 * values[-1]
    assert values[1] > 1e-4 * values[-1]


def test_disk_energy_converges_to_that_of_a_linear_field():
    errors = []
    for count in (24, 48):
        angles = np.arange(count) * 2.0 * np.pi / count
        errors.append(np.cos(angles) @ disk_matrix(angles) @ np.cos(angles) / np.pi - 1.0)
    assert abs(errors[1]) < 3e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


@pytest.mark.parametrize(
    ("h", "radius", "s0", "s1"), [(1.2, 1.0, 0.1, 0.4), (1.0, 1.0, -0.4, -0.25), (0.9, 1.0, 0.0, 0.2)]
)
def test_strip_matrix_equals_the_energy_of_the_field_in_the_plane(h, radius, s0, s1):
    rng = np.random.default_rng(22)
    x = rng.normal(size=8)
    local = np.empty((8, 8))
    strip_matrix(h, h - radius, radius, s0, s1, 1.7, 8, local)

    plain = np.empty((8, 8))
    strip_matrix(h, h - radius, radius, s0, s1, 1.7, 6, plain)
    assert np.array_equal(plain[:6, :6], local[:6, :6])  # without the coefficients of a resisting contact

    def field(s, t):
        low, high = (s1 - s) / (s1 - s0), (s - s0) / (s1 - s0)
        w, m, v = low * x[0] + high * x[2], low * x[1] + high * x[3], low * x[6] + high * x[7]
        return low * x[4] + high * x[5] + w * (1.0 - t) + 4.0 * m * t * (1.0 - t) + v * t

    def place(s, t):
        rho = np.hypot(h, s)
        r = radius + t * (rho - radius)
        return np.array([h, s]) * r / rho

    def density(t, s, step=1e-6):
        along = (place(s + step, t) - place(s - step, t)) / (2.0 * step)
        across = (place(s, t + step) - place(s, t - step)) / (2.0 * step)
        jacobian = np.array([along, across])
        slopes = np.array([field(s + step, t) - field(s - step, t), field(s, t + step) - field(s, t - step)])
        gradient = np.linalg.solve(jacobian, slopes / (2.0 * step))
        # across runs outwards: the area is positive outside the disk and negative inside
        return gradient @ gradient * (across[0] * along[1] - across[1] * along[0])

    energy = 1.7 * dblquad(density, s0, s1, 0.0, 1.0, epsabs=1e-9, epsrel=1e-9)[0]
    assert x @ local @ x == pytest.approx(energy, rel=2e-5)
    assert np.sign(energy) == np.sign(h - radius) or h == radius


def test_cyclic_tridiagonal_system_against_dense_algebra():
    rng = np.random.default_rng(23)
    n = 9
    diagonal, coupling, rows = rng.uniform(3.0, 4.0, n), rng.uniform(-1.0, 1.0, n), rng.normal(size=(n, 5))
    matrix = np.diag(diagonal)
    for c in range(n):
        matrix[c, (c + 1) % n] += coupling[c]
        matrix[(c + 1) % n, c] += coupling[c]
    expected = np.linalg.solve(matrix, rows)
    solve_cyclic(diagonal, coupling, n, 5, rows)
    assert np.allclose(rows, expected, rtol=1e-12)


@pytest.mark.parametrize("inner", [1, 4, 5])
def test_elimination_gives_the_schur_complement_and_the_inner_unknowns(inner):
    rng = np.random.default_rng(24)
    half = rng.normal(size=(9, 9))
    matrix = half @ half.T + 9.0 * np.eye(9)
    schur = matrix[inner:, inner:] - matrix[inner:, :inner] @ np.linalg.solve(
        matrix[:inner, :inner], matrix[:inner, inner:]
    )
    reduced = matrix.copy()
    eliminate_dense(reduced, inner, 9)
    assert np.allclose(np.triu(reduced[inner:, inner:]), np.triu(schur), rtol=1e-12)
    values = np.concatenate((np.zeros(inner), rng.normal(size=9 - inner)))
    expected = -np.linalg.solve(matrix[:inner, :inner], matrix[:inner, inner:] @ values[inner:])
    substitute_back(reduced, inner, 9, values)
    assert np.allclose(values[:inner], expected, rtol=1e-11)


@pytest.mark.parametrize("degree", range(1, 9))
def test_edge_polynomials_reproduce_their_degree(degree):
    points, values = lobatto_points(degree), np.empty(9)
    coefficients = np.random.default_rng(25).normal(size=degree + 1)
    nodal = np.polynomial.polynomial.polyval(points, coefficients)
    order = np.concatenate(([0, degree], np.arange(1, degree)))
    lagrange_values(0.3, degree, values)
    assert values[: degree + 1] @ nodal[order] == pytest.approx(np.polynomial.polynomial.polyval(0.3, coefficients))
    weights = np.polynomial.legendre.legval(points, np.eye(degree + 1)[degree]) ** -2.0 * 2.0 / degree / (degree + 1)
    assert weights @ points ** (2 * degree - 2) == pytest.approx(2.0 / (2 * degree - 1))  # the rule of these points


def test_grid_grows_from_contacts_and_gaps():
    m = 4
    ends = np.tile([-0.5, 0.6], (m, 1))
    kind = np.array([GAP, TOUCHING, CUT, BONDED])
    corner = np.array([0.0, 0.0, 0.2, 0.1])
    starts, points = divide_edges(
        kind, ends, corner, np.full(m, 0.01), np.tile([0.01, FINEST], (m, 1)), np.full(m, 0.3)
    )
    for e in range(m):
        grid = points[starts[e] : starts[e + 1]]
        size = np.diff(grid)
        assert (grid[0], grid[-1]) == (-0.5, 0.6)
        assert (size > 0.0).all()
        assert size.max() <= 0.3001
        assert (size[1:] / size[:-1]).max() < 2.5
        if corner[e]:
            assert np.isin([-corner[e], corner[e]], grid).all()
            assert size.min() >= 0.0035
    assert 0.0 in points[starts[1] : starts[2]]
    assert np.diff(points[starts[1] : starts[2]]).min() <= 1.001 * FINEST


def test_corner_exponent_solves_the_wedge():
    for k_f, angle in ((0.1, 0.3), (0.001, 0.05), (0.5, 0.7)):
        power = corner_exponent(1.0, k_f, angle)
        assert k_f / np.tan(power * angle) == pytest.approx(np.tan(power * (np.pi - angle)), rel=1e-9)
        assert 0.0 < power < 1.0
