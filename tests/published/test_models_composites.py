"""Composite models for epoxy/silica, k1 = 0.195 and k2 = 1.5 W/(m K), against reference values.

The six-digit figures were computed apart from this code from the published equations (sources in the
catalogue).
"""

import numpy as np
import pytest

from etc_engine.models import evaluate

EPOXY, SILICA = 0.195, 1.5
FRACTION = np.array([0.1, 0.2, 0.3, 0.4, 0.5])

TABLE = [
    ("maxwell", 3, {}, (0.238389, 0.288729, 0.347838, 0.418224, 0.503455)),
    ("hashin_shtrikman_lower", 3, {}, (0.238389, 0.288729, 0.347838, 0.418224, 0.503455)),
    ("hashin_shtrikman_upper", 3, {}, (0.290422, 0.391720, 0.499452, 0.614253, 0.736842)),
    ("effective_medium", 3, {}, (0.242886, 0.309317, 0.398891, 0.513056, 0.649072)),
    ("differential", 3, {}, (0.240484, 0.297776, 0.369546, 0.458676, 0.568089)),
    (
        "lewis_nielsen",
        3,
        {"shape_factor": 1.5, "maximum_fraction": 0.637},
        (0.234929, 0.286826, 0.358084, 0.463430, 0.637153),
    ),
    ("lewis_nielsen", 3, {}, (0.234929, 0.286826, 0.358084, 0.463430, 0.637153)),
    (
        "agari_uno",
        3,
        {"matrix_factor": 1.0, "chain_factor": 1.0},
        (0.239133, 0.293255, 0.359626, 0.441019, 0.540833),
    ),
    ("third_order", 3, {}, (0.239229, 0.292194, 0.355833, 0.432674, 0.526096)),
    ("maxwell", 2, {}, (0.227531, 0.265983, 0.312135, 0.368555, 0.439101)),
    ("hashin_shtrikman_upper", 2, {}, (0.272086, 0.356517, 0.449396, 0.552058, 0.666134)),
    ("effective_medium", 2, {}, (0.229654, 0.276162, 0.339517, 0.425854, 0.540833)),
    ("third_order", 2, {}, (0.228159, 0.268641, 0.318454, 0.380389, 0.458448)),
]


@pytest.mark.parametrize(("name", "dimension", "parameters", "expected"), TABLE)
def test_epoxy_silica(name, dimension, parameters, expected):
    k = evaluate(name, k1=EPOXY, k2=SILICA, fraction=FRACTION, dimension=dimension, **parameters)
    np.testing.assert_allclose(k, expected, rtol=0, atol=5.1e-7)


def test_lewis_nielsen_breaks_the_lower_bound_at_small_fractions():
    case = {"k1": EPOXY, "k2": SILICA, "fraction": 0.1, "dimension": 3}
    assert evaluate("lewis_nielsen", **case) < evaluate("hashin_shtrikman_lower", **case)


@pytest.mark.parametrize("dimension", [2, 3])
def test_three_point_bounds_in_their_defining_form(dimension):
    """<k> - f1 f2 (k2 - k1)^2 / (f2 k1 + f1 k2 + (d - 1) X), as printed in Torquato (2002)."""
    f, zeta = FRACTION, np.array([0.0, 0.1, 0.3, 0.6, 1.0])
    mean, swapped = (1 - f) * EPOXY + f * SILICA, f * EPOXY + (1 - f) * SILICA
    for name, x in (
        ("three_point_lower", 1.0 / ((1 - zeta) / EPOXY + zeta / SILICA)),
        ("three_point_upper", (1 - zeta) * EPOXY + zeta * SILICA),
    ):
        expected = mean - f * (1 - f) * (SILICA - EPOXY) ** 2 / (swapped + (dimension - 1) * x)
        k = evaluate(name, k1=EPOXY, k2=SILICA, fraction=f, dimension=dimension, zeta2=zeta)
        np.testing.assert_allclose(k, expected, rtol=1e-13)


def test_hasselman_johnson_as_printed():
    """Equation for spheres of Hasselman and Johnson (1987), 10.1177/002199838702100602."""
    k1, k2, a, h, f = 0.8, 5.0, 2e-6, 3e6, np.array([0.05, 0.2, 0.4])
    r = k2 / (a * h)
    printed = k1 * ((2 * (k2 / k1 - r - 1) * f + k2 / k1 + 2 * r + 2) / ((1 - k2 / k1 + r) * f + k2 / k1 + 2 * r + 2))
    k = evaluate("hasselman_johnson", k1=k1, k2=k2, fraction=f, dimension=3, radius=a, interface_conductance=h)
    np.testing.assert_allclose(k, printed, rtol=1e-13)


def test_russell_is_layers_of_cubes_and_matrix():
    k1, k2, side = 2.0, 9.0, 0.6
    layer = side**2 * k2 + (1 - side**2) * k1
    expected = 1.0 / (side / layer + (1 - side) / k1)
    assert evaluate("russell", k1=k1, k2=k2, fraction=side**3, dimension=3) == pytest.approx(expected, rel=1e-13)
