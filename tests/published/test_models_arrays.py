"""Ordered arrays against reference values, an independent numerical solution, and published expansions.

The reference figures to eight digits were computed apart from this code, by converged multipole solutions
in the manner of Perrins, McKenzie and McPhedran (1979), 10.1098/rspa.1979.0160 (disks), and McPhedran and
McKenzie (1978), 10.1098/rspa.1978.0031 (spheres).
"""

import time

import numpy as np
import pytest

from etc_engine.models import arrays
from etc_engine.models.lattice_sums import BCC, FCC, HEXAGONAL, SIMPLE_CUBIC, SQUARE, space_sums

INF = np.inf
DISK_CONTRASTS = np.array([2.0, 7.7, 50.0, INF])
SQUARE_TABLE = {
    0.1: (1.06896576, 1.16687750, 1.21258798, 1.22222977),
    0.3: (1.22229023, 1.60204759, 1.81252896, 1.86018831),
    0.5: (1.40102548, 2.27600343, 2.91459398, 3.08019783),
    0.7: (1.61538450, 3.60291445, 6.33592091, 7.43270933),
}


@pytest.mark.parametrize("fraction", SQUARE_TABLE)
def test_square_array_reference_values(fraction):
    k = arrays.square_array(1.0, DISK_CONTRASTS, fraction)
    np.testing.assert_allclose(k, SQUARE_TABLE[fraction], rtol=0, atol=5.1e-9)


@pytest.mark.parametrize(
    ("fraction", "contrast", "expected"),
    [(0.3, 7.7, 1.7967699), (0.3, INF, 2.3328845), (0.4, 7.7, 2.2026725), (0.4, INF, 3.2625663)],
)
def test_simple_cubic_reference_values(fraction, contrast, expected):
    assert arrays.simple_cubic(1.0, contrast, fraction) == pytest.approx(expected, abs=5.1e-8)


def test_single_inclusion_of_a_third_of_the_box():
    # A sphere of radius L/3 in a box with two isothermal and four adiabatic faces is a simple cubic array.
    contrast = np.array([0.01, 0.1, 0.5, 2.0, 5.0, 10.0, 100.0])
    expected = [
        0.78684728,
        0.81284529,
        0.90970452,
        1.12107514,
        1.29213137,
        1.39573484,
        1.53338681,
    ]
    fraction = 4.0 * np.pi / 81.0
    np.testing.assert_allclose(arrays.simple_cubic(1.0, contrast, fraction), expected, rtol=0, atol=5.1e-9)


def _at_order(lattice, order, contrast, size):
    """The array's conductivity with a given highest multipole, whatever the solver would choose."""
    d, fraction = lattice.dimension, lattice.touching_fraction * size**lattice.dimension
    with np.errstate(invalid="ignore"):
        dipole = arrays._dipole(lattice, order, np.ones(size.size), np.full(size.size, contrast), size)
    return fraction, (1.0 + (d - 1) * fraction * dipole) / (1.0 - fraction * dipole)


@pytest.mark.parametrize(("function", "lattice"), [(arrays.square_array, SQUARE), (arrays.hexagonal_array, HEXAGONAL)])
def test_disk_arrays_are_converged(function, lattice):
    """Twice the multipoles change nothing at the catalogue's 1e-9, even for superconducting disks."""
    size = np.array([0.3, 0.5, 0.79, 0.81, 0.94, 0.96, 0.979, 0.99, 0.999])
    fraction, k = _at_order(lattice, 499, INF, size)
    np.testing.assert_allclose(function(1.0, INF, fraction), k, rtol=1e-9)
    fraction, k = _at_order(lattice, 499, 10.0, np.array([0.9999]))
    np.testing.assert_allclose(function(1.0, 10.0, fraction), k, rtol=1e-9)


@pytest.mark.parametrize(
    ("function", "lattice"), [(arrays.simple_cubic, SIMPLE_CUBIC), (arrays.bcc, BCC), (arrays.fcc, FCC)]
)
def test_sphere_arrays_are_converged(function, lattice):
    """More multipoles change nothing at the figures that the catalogue states."""
    size = np.array([0.4, 0.69, 0.71, 0.84, 0.86, 0.92, 0.94, 0.97, 0.99])
    fraction, k = _at_order(lattice, 81, INF, size)
    np.testing.assert_allclose(function(1.0, INF, fraction), k, rtol=1e-8)
    for contrast, tolerance in ((10.0, 1e-6), (INF, 2e-3)):
        fraction, k = _at_order(lattice, 81, contrast, np.array([0.999]))
        np.testing.assert_allclose(function(1.0, contrast, fraction), k, rtol=tolerance)


def test_known_lattice_sums():
    # Degree 4 by direct summation over a ball of radius 60, where the angular average hides the slow tail.
    n = np.mgrid[-60:61, -60:61, -60:61].reshape(3, -1).T.astype(float)
    r = np.linalg.norm(n, axis=1)
    inside = (r > 0) & (r <= 60)
    n, r = n[inside], r[inside]
    c = n[:, 2] / r
    direct = np.sum((35 * c**4 - 30 * c**2 + 3) / 8.0 / r**5)
    assert space_sums(SIMPLE_CUBIC, 4)[4, 0] == pytest.approx(direct, rel=1e-4)


def _finite_volume_square(contrast, fraction, cells):
    """Quarter cell of the square array by finite volumes, cells cut by the circle averaged: first order."""
    import scipy.sparse as sp
    from scipy.sparse.linalg import spsolve

    radius = np.sqrt(fraction / np.pi)
    sub = 4
    x = (np.arange(cells * sub) + 0.5) / (cells * sub) * 0.5
    inside = (x[:, None] ** 2 + x**2 <= radius**2).reshape(cells, sub, cells, sub).mean(axis=(1, 3))
    k = 1.0 + (contrast - 1.0) * inside
    number = np.arange(cells * cells).reshape(cells, cells)
    gx = 2.0 / (1.0 / k[1:] + 1.0 / k[:-1])
    gy = 2.0 / (1.0 / k[:, 1:] + 1.0 / k[:, :-1])
    pairs = [(number[1:], number[:-1], gx), (number[:, 1:], number[:, :-1], gy)]
    i = np.concatenate([a.ravel() for a, _, _ in pairs])
    j = np.concatenate([b.ravel() for _, b, _ in pairs])
    g = np.concatenate([c.ravel() for _, _, c in pairs])
    n = cells * cells
    matrix = sp.coo_matrix((np.r_[-g, -g], (np.r_[i, j], np.r_[j, i])), shape=(n, n)).tocsr()
    diagonal = -np.asarray(matrix.sum(axis=1)).ravel()
    load = np.zeros(n)
    diagonal[number[0]] += 2.0 * k[0]
    diagonal[number[-1]] += 2.0 * k[-1]
    load[number[0]] += 2.0 * k[0]
    temperature = spsolve((matrix + sp.diags(diagonal)).tocsc(), load)
    return float(np.sum(2.0 * k[-1] * temperature[number[-1]]))


def test_square_array_against_finite_volumes():
    exact = arrays.square_array(1.0, 7.7, 0.5)
    error = [abs(_finite_volume_square(7.7, 0.5, cells) / exact - 1.0) for cells in (32, 128)]
    assert error[1] < 5e-3
    assert error[1] < 0.5 * error[0]


@pytest.mark.parametrize(
    ("function", "coefficient"),
    # c of k/k1 = 1 + 3 f / (1/beta - f - c f^(10/3) - O(f^(14/3))) for superconducting spheres: McKenzie,
    # McPhedran and Derrick (1978), 10.1098/rspa.1978.0129; Sangani and Acrivos, Proc. R. Soc. A 386, 263
    # (1983). The tolerance is half a unit of their last digit.
    [(arrays.simple_cubic, 1.3047), (arrays.bcc, 0.129), (arrays.fcc, 0.0753)],
)
def test_leading_correction_to_maxwell_of_cubic_arrays(function, coefficient):
    f = 0.003  # small enough for the next term, large enough for the digits
    k = function(1.0, INF, f)
    c = (1.0 - f - 3.0 * f / (k - 1.0)) / f ** (10.0 / 3.0)
    assert c == pytest.approx(coefficient, rel=4e-3)


def test_a_thousand_evaluations_are_quick():
    fraction = np.linspace(0.01, 0.7, 1000)
    for function in (arrays.square_array, arrays.hexagonal_array):
        start = time.perf_counter()
        function(1.0, 50.0, fraction)
        assert time.perf_counter() - start < 2.0  # measured 0.05 s; the margin is for a busy machine
    start = time.perf_counter()
    arrays.simple_cubic(1.0, 50.0, np.linspace(0.01, 0.5, 1000))
    assert time.perf_counter() - start < 4.0
