from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from scipy.integrate import quad

from etc_engine.errors import InputError
from etc_engine.laws.disk import (
    chord_resistance,
    clausen_c3,
    enhanced_resistance,
    mutual_resistance,
    self_resistance,
    standard_resistance,
)


def double_quadrature(separation: float, a: float, b: float, points: int = 40) -> float:
    """Feng et al. 2008, Eq. 20, by tensor Gauss quadrature; the integrand is smooth for separate arcs."""
    x, w = leggauss(points)
    kernel = np.log(np.abs(np.sin(0.5 * (separation + a * x[:, None] - b * x[None, :]))))
    return float(-(w[:, None] * w[None, :] * kernel).sum() / (4.0 * np.pi))


def self_quadrature(alpha: float) -> float:
    """Double integral of Eq. 20 for i = j, reduced to one integral over the distance of the two points."""
    value, _ = quad(
        lambda x: (2 * alpha - x) * np.log(np.sin(0.5 * x)),
        0.0,
        2 * alpha,
        epsabs=1e-13,
        epsrel=1e-13,
        limit=200,
    )
    return -2.0 * value / (4.0 * np.pi * alpha**2)


@pytest.mark.parametrize("x", [0.3, 1.0, 2.5, np.pi, 4.0, 6.1, -1.0, 9.0])
def test_clausen_function_equals_its_series(x):
    k = np.arange(1, 200_001)
    assert clausen_c3(x) == pytest.approx(np.sum((np.cos(k * x) / k**3.0)[::-1]), abs=2e-11)


@pytest.mark.parametrize(
    ("separation", "a", "b"),
    [
        (1.0, 0.1, 0.1),
        (2.0, 0.3, 0.4),
        (3.1, 0.05, 0.3),
        (0.5, 0.02, 0.03),
        (0.5, 0.2, 0.02),
        (1.8, 0.8, 0.4),
    ],
)
def test_mutual_resistance_equals_the_double_integral(separation, a, b):
    assert mutual_resistance(separation, a, b) == pytest.approx(double_quadrature(separation, a, b), abs=2e-13)


@pytest.mark.parametrize("separation", [0.2, 0.7, 1.5, 3.0])
def test_series_and_closed_form_meet(separation):
    """On either side of the switch (a + b)^2 = 0.03 sin^2(D/2) the two forms agree to round-off."""
    total = np.sqrt(0.03) * np.sin(0.5 * separation)
    for share in (0.5, 0.2):
        for side in (1 - 1e-9, 1 + 1e-9):
            a, b = share * total * side, (1 - share) * total * side
            assert mutual_resistance(separation, a, b) == pytest.approx(double_quadrature(separation, a, b), abs=1e-12)


def test_mutual_resistance_is_even_periodic_and_symmetric():
    d, a, b = 1.3, 0.1, 0.25
    value = mutual_resistance(d, a, b)
    for other in (
        mutual_resistance(-d, a, b),
        mutual_resistance(2 * np.pi - d, a, b),
        mutual_resistance(d, b, a),
    ):
        assert other == pytest.approx(value, abs=1e-14)


@pytest.mark.parametrize("degrees", [0.1, 1.0, 5.0, 20.0, 60.0, 85.0])
def test_standard_resistance_equals_the_double_integral(degrees):
    alpha = np.radians(degrees)
    assert standard_resistance(alpha) == pytest.approx(self_quadrature(alpha), rel=1e-10)


def test_standard_resistance_has_the_corrected_series():
    """Eq. 34 with its last coefficient corrected to 1/79380, and one more term."""
    a = np.radians(np.array([1.0, 5.0, 10.0, 20.0]))
    series = -np.log(a) + 1.5 + a**2 / 36 + a**4 / 2700 + a**6 / 79380 + a**8 / 1701000
    np.testing.assert_allclose(np.pi * standard_resistance(a), series, atol=1e-11)


def test_enhanced_factor_is_tabulated_and_constant_outside():
    a = np.radians([0.2, 1.0, 3.75, 20.0, 40.0])
    factor = enhanced_resistance(a) / standard_resistance(a)
    np.testing.assert_allclose(factor, [0.9799, 0.9799, 0.5 * (0.9762 + 0.9729), 0.9671, 0.9671], rtol=1e-12)


@pytest.mark.parametrize("degrees", [0.5, 5.0, 30.0, 80.0])
def test_chord_resistance_formula_by_quadrature(degrees):
    alpha = np.radians(degrees)
    mean, _ = quad(lambda t: np.log(np.cos(0.5 * t)), 0.0, alpha, epsabs=1e-14)
    beta = np.pi / (2 * np.pi - 2 * alpha)
    expected = (-np.log(beta * np.tan(0.5 * alpha)) - 2.0 * mean / alpha) / np.pi
    assert chord_resistance(alpha) == pytest.approx(expected, abs=1e-13)


def test_chord_resistance_of_small_angles_is_the_isothermal_arc():
    """An isothermal arc of half-angle a on a disk has -ln sin(a/2) / pi; the chord tends to it."""
    alpha = 1e-5
    assert np.pi * chord_resistance(alpha) == pytest.approx(-np.log(alpha / 4.0), abs=1e-5)


def test_an_unknown_method_is_refused_with_the_known_ones():
    with pytest.raises(InputError, match=r"'spline'.*chord, standard, enhanced"):
        self_resistance(0.1, "spline")
