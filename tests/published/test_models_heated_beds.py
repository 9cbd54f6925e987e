"""Bed models with contact, gas and radiation: the printed equations, and the limits one knows.

No worked numerical example of these models was found in print: each formula is held against its published
statement (evaluated here as printed, away from its singularities) and against its limits.
"""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.models import evaluate
from etc_engine.models.heated_beds import (
    STEFAN_BOLTZMANN,
    breitbach_barthels,
    hamilton_crosser,
    hsu_cubes,
    hsu_square_cylinders,
    kunii_smith_radiation,
    zehner_bauer_schluender,
)

HOT = {"diameter": 1e-3, "temperature": 1000.0, "emissivity": 0.8}


def vdi_heat_atlas(contrast, k_r, k_g, fraction, contact):
    """Section D6.3 as printed (and as the TransiEnt library evaluates it)."""
    porosity = 1.0 - fraction
    b = 1.25 * (fraction / porosity) ** (10.0 / 9.0)
    n = (1.0 + (k_r - b * k_g) / contrast) / k_g - b * (1.0 / k_g - 1.0) * (1.0 + k_r / contrast)
    log = np.log((contrast + k_r) / (b * (k_g + (1.0 - k_g) * (contrast + k_r))))
    core = b * (contrast + k_r - 1.0) / (n**2 * k_g * contrast) * log
    core += (b + 1.0) / (2.0 * b) * (k_r / k_g - b * (1.0 + (1.0 - k_g) / k_g * k_r)) - (b - 1.0) / (n * k_g)
    core *= 2.0 / n
    outside = (1.0 - np.sqrt(fraction)) * porosity * (1.0 / (porosity - 1.0 + 1.0 / k_g) + k_r)
    return outside + np.sqrt(fraction) * (contact * contrast + (1.0 - contact) * core)


@pytest.mark.parametrize("contrast", [3.0, 30.0, 1000.0])
@pytest.mark.parametrize("jump", [0.0, 1e-6, 1e-4, 3e-3])
@pytest.mark.parametrize("temperature", [300.0, 1500.0])
def test_zbs_as_printed(contrast, jump, temperature):
    d, e, k1, f = 1e-3, 0.8, 0.2, 0.61
    k_r = 4.0 * STEFAN_BOLTZMANN * temperature**3 * d / (2.0 / e - 1.0) / k1
    printed = k1 * vdi_heat_atlas(contrast, k_r, 1.0 / (1.0 + 2.0 * jump / d), f, 0.0077)
    found = zehner_bauer_schluender(
        k1, contrast * k1, f, diameter=d, temperature=temperature, emissivity=e, jump_length=jump
    )
    assert found == pytest.approx(printed, rel=1e-9)


def test_zbs_is_smooth_through_its_removable_pole():
    """N = 0 at lambda + k_R = B in a continuum gas."""
    b = 1.25 * (0.6 / 0.4) ** (10.0 / 9.0)
    contrast = b * (1.0 + np.array([-1e-6, -1e-12, 0.0, 1e-12, 1e-6]))
    k = zehner_bauer_schluender(1.0, contrast, 0.6, diameter=1e-3, temperature=1.0, emissivity=0.5)
    assert np.isfinite(k).all() and (np.diff(k) >= 0.0).all() and np.ptp(k) < 1e-5


def test_zbs_limits():
    cold = evaluate("zbs_contact", k1=0.3, k2=20.0, fraction=0.6, dimension=3)
    full = {"k1": 0.3, "k2": 20.0, "fraction": 0.6, "dimension": 3, "diameter": 1e-3, "temperature": 900.0}
    assert evaluate("zehner_bauer_schluender", **full, emissivity=0.0) == pytest.approx(cold, rel=1e-12)
    black = {"diameter": 1e-3, "temperature": 900.0, "emissivity": 1.0}
    vacuum = zehner_bauer_schluender(0.3, 20.0, 0.6, jump_length=np.inf, contact_fraction=0.0, **black)
    assert vacuum == pytest.approx(breitbach_barthels(20.0, 0.6, **black), rel=1e-12)
    nothing = zehner_bauer_schluender(
        0.3, 20.0, 0.6, diameter=1e-3, temperature=900.0, emissivity=0.0, jump_length=np.inf, contact_fraction=0.0
    )
    assert nothing == 0.0


def test_zbs_pressure_curve_is_an_s_between_vacuum_and_continuum():
    jumps = np.concatenate([[np.inf], np.logspace(1, -12, 200), [0.0]])
    k = zehner_bauer_schluender(0.3, 2.4, 0.64, jump_length=jumps, **HOT)
    assert (np.diff(k) >= 0.0).all()
    middle = k[1:-1]
    np.testing.assert_allclose(middle[[0, -1]], k[[0, -1]], rtol=2e-3)


def test_radiation_grows_as_t_cubed():
    """Superconducting solid: exactly T^3 d."""
    k = breitbach_barthels(np.inf, 0.61, diameter=0.06, temperature=np.array([500.0, 1000.0]), emissivity=0.8)
    assert k[1] / k[0] == pytest.approx(8.0, rel=1e-12)
    k = breitbach_barthels(np.inf, 0.61, diameter=np.array([0.03, 0.06]), temperature=900.0, emissivity=0.8)
    assert k[1] / k[0] == pytest.approx(2.0, rel=1e-12)


def test_breitbach_barthels_as_printed():
    """Nucl. Technol. 49, 392 (1980), as a dissertation of UCLA (Van Lew, 2016) evaluates it for SANA's pebbles."""
    porosity, e, t, d, k_s = 0.41, 0.8, 1000.0, 0.06, 62.7
    black = 4.0 * STEFAN_BOLTZMANN * t**3 * d
    b = 1.25 * ((1.0 - porosity) / porosity) ** (10.0 / 9.0)
    first = (1.0 - np.sqrt(1.0 - porosity)) * porosity
    second = np.sqrt(1.0 - porosity) / (2.0 / e - 1.0) * (b + 1.0) / b
    second *= 1.0 / (1.0 + 1.0 / ((2.0 / e - 1.0) * k_s / black))
    found = breitbach_barthels(k_s, 1.0 - porosity, diameter=d, temperature=t, emissivity=e)
    assert found == pytest.approx((first + second) * black, rel=1e-12)


def test_kunii_smith_with_radiation():
    cold = evaluate("kunii_smith", k1=1.0, k2=100.0, fraction=0.6, dimension=3)
    found = kunii_smith_radiation(1.0, 100.0, 0.6, diameter=1e-3, temperature=1e-3, emissivity=0.8)
    assert found == pytest.approx(cold, rel=1e-9)
    hot = kunii_smith_radiation(1.0, 100.0, 0.6, **HOT)
    assert hot > cold


def test_coefficients_of_yagi_and_kunii_are_4_sigma_t_cubed():
    """0.1952 (T/100)^3 kcal/(m2 h K), with 1 kcal/h = 1.163 W."""
    assert pytest.approx(4.0 * STEFAN_BOLTZMANN * 100.0**3, rel=2e-3) == 0.1952 * 1.163


def test_hsu_cubes():
    assert hsu_cubes(2.0, 2.0, np.array([0.2, 0.6, 0.9])) == pytest.approx([2.0] * 3)
    assert hsu_cubes(1.0, 100.0, np.array([0.0, 1.0])) == pytest.approx([1.0, 100.0])
    g = 0.7
    fraction = (1.0 - 3.0 * 0.13**2) * g**3 + 3.0 * 0.13**2 * g**2
    printed = 1.0 - g**2 - 0.26 * g + 0.26 * g**2 + 0.13**2 * g**2 * 50.0
    printed += (g**2 - 0.13**2 * g**2) / (1.0 - g + g / 50.0) + 0.26 * (g - g**2) / (1.0 - 0.13 * g + 0.13 * g / 50.0)
    assert hsu_cubes(1.0, 50.0, fraction) == pytest.approx(printed, rel=1e-12)


def test_hsu_without_contact_does_not_conduct_through_the_solid():
    """c = 0: as k2 -> infinity the conductivity stays finite."""
    k = hsu_square_cylinders(1.0, np.array([1e6, 1e9]), 0.6, contact_width=0.0)
    assert k[1] == pytest.approx(k[0], rel=1e-5)
    contact = hsu_square_cylinders(1.0, np.array([1e6, 1e9]), 0.6, contact_width=0.01)
    assert contact[1] / contact[0] == pytest.approx(1e3, rel=1e-3)


def test_hsu_square_cylinders():
    assert hsu_square_cylinders(2.0, 2.0, np.array([0.2, 0.6, 0.9])) == pytest.approx([2.0] * 3)
    assert hsu_square_cylinders(1.0, 100.0, np.array([0.0, 1.0])) == pytest.approx([1.0, 100.0])


def test_hamilton_crosser_of_spheres_is_maxwell():
    k1, k2, f = 0.195, 1.5, np.array([0.1, 0.3, 0.5])
    maxwell = evaluate("maxwell", k1=k1, k2=k2, fraction=f, dimension=3)
    np.testing.assert_allclose(hamilton_crosser(k1, k2, f), maxwell, rtol=1e-13)
    assert (hamilton_crosser(k1, k2, f, sphericity=0.5) > maxwell).all()  # long particles conduct better
