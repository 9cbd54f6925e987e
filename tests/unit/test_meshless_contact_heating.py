"""A disk heated through its contact arcs, against its Fourier-Bessel series and the lumped relation."""

import numpy as np
import pytest
from scipy.special import jn_zeros, jnp_zeros

from etc_engine.engines.meshless import ContactArc, heat_disk_through_arcs
from etc_engine.engines.meshless.contact_heating import arc_resistances

DEGREE = np.pi / 180.0


def sinc(x):
    return np.sinc(x / np.pi)


def exact_arc_temperatures(arcs, heat, fourier, modes=1200, transients=40):
    """Mean temperature of each arc after a step of uniform flux; kappa = R = rho c = 1, start at 0.

    Mode k answers q_k [1/k - sum_n 2 exp(-j'^2 Fo)/(j'^2 - k^2)] on the rim, j' the zeros of J_k'.
    """
    zeros = jn_zeros(1, 60)
    uniform = 2 * fourier + 0.25 - np.sum(2 * np.exp(-(zeros**2) * fourier) / zeros**2)
    result = np.full(len(arcs), np.sum(heat) / (2 * np.pi) * uniform)
    for k in range(1, modes):
        response = 1.0 / k
        if k < 50:
            zeros = jnp_zeros(k, transients)
            response -= np.sum(2 * np.exp(-(zeros**2) * fourier) / (zeros**2 - k * k))
        for i, a in enumerate(arcs):
            for b, q in zip(arcs, heat, strict=True):
                part = sinc(k * a.half_angle) * sinc(k * b.half_angle) * np.cos(k * (a.theta - b.theta))
                result[i] += q / np.pi * part * response
    return result


ARCS = [ContactArc(0.3, 20 * DEGREE), ContactArc(2.5, 12 * DEGREE)]
HEAT = [1.0, -0.4]


@pytest.mark.parametrize("scheme, tolerance", [("laplace", 1e-3), ("sdirk2", 5e-3)])
def test_arc_temperatures_after_a_step_of_heat(scheme, tolerance):
    times = [0.05, 0.5]
    result = heat_disk_through_arcs(ARCS, HEAT, times, scheme=scheme)
    for found, mean, t in zip(result.arc_temperature.values, result.mean_temperature.values, times, strict=True):
        np.testing.assert_allclose(found, exact_arc_temperatures(ARCS, HEAT, t), atol=tolerance)
        assert mean == pytest.approx(0.6 * t / np.pi, abs=1e-3)
    assert result.warnings == ""


def test_the_lumped_relation_holds_at_late_times():
    result = heat_disk_through_arcs(ARCS, HEAT, [0.2, 2.0], scheme="laplace")
    gap = np.abs(result.arc_temperature - result.lumped_arc_temperature).max(dim="arc").values
    assert gap[0] > 0.05  # far from quasi-steady
    assert gap[1] < 2e-3  # what is left are the boundary nodes


def test_units_and_histories():
    # R = 2 mm, kappa = 40, rho c = 3e6; heat that ramps up: the mean follows the integral of the heat
    radius, capacity, t = 2e-3, 3e6, 0.2
    result = heat_disk_through_arcs(
        [ContactArc(1.0, 0.4)],
        [lambda t: 50.0 * t],
        [t],
        radius=radius,
        conductivity=40.0,
        heat_capacity=capacity,
        initial=300.0,
        points=[(0.0, 0.0), (1e-3, 0.0)],
        steps=100,
    )
    rise = 25.0 * t**2 / (capacity * np.pi * radius**2)
    assert float(result.mean_temperature[0]) - 300.0 == pytest.approx(rise, rel=2e-3)
    assert float(result.heat_input[0, 0]) == pytest.approx(10.0)
    assert float(result.heat_inflow[0]) == pytest.approx(10.0, rel=1e-2)


@pytest.mark.parametrize("half_angle", [0.05, 0.1])
def test_resistance_of_an_arc_with_itself(half_angle):
    # small-angle series (1/pi kappa)(-ln a + 3/2 + a^2/36 + ...) of the closed form, less ln 2 here
    series = -np.log(half_angle) + 1.5 + half_angle**2 / 36.0 + half_angle**4 / 2700.0 - np.log(2.0)
    found = arc_resistances([ContactArc(0.7, half_angle)], 3.0)[0, 0]
    assert found == pytest.approx(series / (3.0 * np.pi), rel=1e-7)


def test_resistances_are_symmetric_and_positive_definite():
    arcs = [ContactArc(a, h) for a, h in ((0.1, 0.2), (1.4, 0.35), (4.0, 0.1))]
    matrix = arc_resistances(arcs, 1.0)
    np.testing.assert_allclose(matrix, matrix.T, rtol=1e-14)
    assert np.linalg.eigvalsh(matrix).min() > 0.0
