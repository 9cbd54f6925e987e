"""Packed-bed and network models: k_f = 1, k_s = 100, porosity 0.4, and the printed equations.

The reference figures were computed apart from this code from the published equations (sources in the
catalogue).
"""

import numpy as np
import pytest

from etc_engine.models import evaluate, granular

BED = {"k1": 1.0, "k2": 100.0, "fraction": 0.6, "dimension": 3}


@pytest.mark.parametrize(
    ("name", "parameters", "expected", "digits"),
    [
        ("zehner_schluender", {}, 8.886956, 6),
        ("zbs_contact", {"contact_fraction": 0.0077}, 9.416701, 6),
        ("krupiczka", {}, 8.599658, 6),
        ("kunii_smith", {}, 8.345371, 6),
        ("hadley", {}, 9.793631, 6),
        ("woodside_messmer", {}, 11.395, 3),
    ],
)
def test_bed_of_porosity_0_4(name, parameters, expected, digits):
    assert evaluate(name, **BED, **parameters) == pytest.approx(expected, abs=0.51 * 10.0**-digits)


def test_batchelor_obrien():
    k = evaluate("batchelor_obrien", k1=1.0, k2=1000.0, fraction=0.63, dimension=3)
    assert k == pytest.approx(16.63102, abs=5.1e-6)


def test_yagi_kunii_equation_16():
    """beta (1 - eps)/(k_g/k_s + phi) with the constants of spheres at a porosity of 0.4, phi = 0.034."""
    k = evaluate("yagi_kunii", **BED, film_thickness=0.034, spacing=0.9)
    assert k == pytest.approx(0.9 * 0.6 / (0.01 + 0.034), rel=1e-13)


def test_zehner_schluender_as_printed():
    """The published form, away from its removable pole at k_s/k_f = B."""
    contrast, f = np.array([0.3, 10.0, 100.0, 3000.0]), 0.55
    b = 1.25 * (f / (1 - f)) ** (10 / 9)
    h = 1 - b / contrast
    core = 2 / h * ((1 - 1 / contrast) * b / h**2 * np.log(contrast / b) - (b + 1) / 2 - (b - 1) / h)
    printed = 1 - np.sqrt(f) + np.sqrt(f) * core
    np.testing.assert_allclose(granular.zehner_schluender(1.0, contrast, f), printed, rtol=1e-12)


@pytest.mark.parametrize("fraction", [0.3, 0.5, 0.6, 0.74])
def test_zehner_schluender_is_smooth_through_its_removable_pole(fraction):
    b = 1.25 * (fraction / (1 - fraction)) ** (10 / 9)
    offset = np.array([-1e-3, -1e-7, -1e-12, 0.0, 1e-12, 1e-7, 1e-3])
    k = granular.zehner_schluender(1.0, b * (1.0 + offset), fraction)
    slope = (k[-1] - k[0]) / 2e-3
    np.testing.assert_allclose(k, k[3] + slope * offset, rtol=0, atol=1e-6)  # curvature of 1e-3 squared
    assert abs(k[2] - k[4]) < 1e-11


def test_zehner_schluender_branches_join():
    """Series and closed form agree where one takes over from the other, to rounding."""
    h = np.array([0.35 - 1e-12, 0.35 + 1e-12, -0.35 + 1e-12, -0.35 - 1e-12])
    value = granular.log_remainder(h)
    assert value[0] == pytest.approx(value[1], rel=1e-11)
    assert value[2] == pytest.approx(value[3], rel=1e-11)


def test_kunii_smith_as_printed():
    contrast, porosity = np.array([3.0, 20.0, 400.0]), 0.4

    def film(n):
        cos = np.sqrt(1 - 1 / n)
        log = np.log(contrast - (contrast - 1) * cos)
        top = 0.5 * ((contrast - 1) / contrast) ** 2 / n
        return top / (log - (contrast - 1) / contrast * (1 - cos)) - 2 / (3 * contrast)

    loose, dense = film(1.5), film(4 * np.sqrt(3))
    phi = dense + (loose - dense) * (porosity - 0.26) / (0.476 - 0.26)
    printed = porosity + (1 - porosity) / (phi + 2 / (3 * contrast))
    np.testing.assert_allclose(granular.kunii_smith(1.0, contrast, 0.6), printed, rtol=1e-12)


def test_kunii_smith_has_no_cancellation_at_equal_phases():
    offset = np.array([-0.1 - 1e-12, -1e-3, -1e-9, 0.0, 1e-9, 1e-3, 0.1 - 1e-12, 0.1 + 1e-12])
    k = granular.kunii_smith(1.0, 1.0 + offset, 0.6)
    assert k[3] == pytest.approx(1.0, abs=1e-14)
    # Below, the slope d(k)/d(k_s) at equal phases is read off +-1e-3 and must hold at 1e-9.
    slope = (k[5] - k[1]) / 2e-3
    assert (k[4] - k[2]) / 2e-9 == pytest.approx(slope, rel=1e-5)
    assert k[6] == pytest.approx(k[7], rel=1e-10)


def test_mean_field_of_a_square_lattice_of_disks_is_exact():
    """Unit disks touching on a square lattice: each of k_xx = k_yy is the contact conductance itself."""
    k = evaluate(
        "contact_mean_field",
        k1=0.0,
        k2=1.0,
        fraction=np.pi / 4,
        dimension=2,
        coordination=4.0,
        conductance_distance2=0.37 * 4.0,
        radius_moment=1.0,
    )
    assert k == pytest.approx(0.37, rel=1e-14)


def test_mean_field_of_a_cubic_lattice_of_spheres_is_exact():
    """Touching spheres of radius R on a simple cubic lattice: k = H/(2 R)."""
    radius, conductance = 0.5e-3, 2e-4
    k = evaluate(
        "contact_mean_field",
        k1=0.0,
        k2=1.0,
        fraction=np.pi / 6,
        dimension=3,
        coordination=6.0,
        conductance_distance2=conductance * 4 * radius**2,
        radius_moment=radius**3,
    )
    assert k == pytest.approx(conductance / (2 * radius), rel=1e-14)


def test_mean_field_of_unequal_disks_is_the_affine_energy():
    """A chain of alternating radii: sum over contacts of C d^2 over twice the area, counted by hand."""
    large, small, c, gap_area = 1.0, 0.5, 0.8, 7.0
    contacts, particles = 2, 2  # one period: large-small, small-large
    area = gap_area
    by_hand = contacts * c * (large + small) ** 2 / (2 * area)
    k = evaluate(
        "contact_mean_field",
        k1=0.0,
        k2=1.0,
        fraction=np.pi * (large**2 + small**2) / area,
        dimension=2,
        coordination=2.0 * contacts / particles,
        conductance_distance2=c * (large + small) ** 2,
        radius_moment=(large**2 + small**2) / 2,
    )
    assert k == pytest.approx(by_hand, rel=1e-14)


def test_kirkpatrick_square_lattice():
    """g = 2p - 1 above 1/2 on the square lattice, Kirkpatrick (1973), 10.1103/RevModPhys.45.574."""
    p = np.array([0.2, 0.5, 0.6, 0.9])
    k = evaluate("kirkpatrick", k1=0.0, k2=1.0, fraction=p, dimension=2, coordination=4.0)
    np.testing.assert_allclose(k, [0.0, 0.0, 0.2, 0.8], atol=1e-15)


@pytest.mark.parametrize(("dimension", "exponent"), [(2, 1.30), (3, 2.0)])
def test_percolation_exponent(dimension, exponent):
    f = np.array([0.3, 0.51, 0.52, 0.54])
    k = evaluate("percolation_power_law", k1=0.0, k2=2.0, fraction=f, dimension=dimension, threshold=0.5)
    assert k[0] == 0.0
    assert np.log2(k[2] / k[1]) == pytest.approx(exponent, rel=1e-12)
    assert np.log2(k[3] / k[2]) == pytest.approx(exponent, rel=1e-12)
