"""Solids and gases over temperature and pressure: published values, ranges, limits, mixtures."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest

from etc_engine.errors import InputError
from etc_engine.materials import (
    CATALOGUE,
    accommodation_from_masses,
    find_solid,
    gas_state,
    jump_length,
    pore_conductivity,
    solid_from_table,
)
from etc_engine.materials.gases import GAS_CONSTANT, interaction_factors, mixture_value
from etc_engine.materials.solids import lithium_titanate_conductivity, uranium_dioxide_conductivity

pytest.importorskip("CoolProp")


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("helium", (0.1560, 0.2524, 0.3606)),
        ("air", (0.0264, 0.0460, 0.0677)),
        ("nitrogen", (0.0260, 0.0448, 0.0654)),
        ("argon", (0.0178, 0.0306, 0.0436)),
        ("hydrogen", (0.1867, 0.3090, 0.4604)),
    ],
)
def test_conductivity_of_gases_at_one_bar(name, values):
    """Check values at 300, 600 and 1000 K of the issue's design page, four decimals."""
    found = [gas_state(name, t, 1e5).conductivity for t in (300.0, 600.0, 1000.0)]
    assert found == pytest.approx(values, abs=5.1e-5)


def test_monatomic_and_diatomic_gases():
    helium, nitrogen = gas_state("He", 300.0, 1e5), gas_state("N2", 300.0, 1e5)
    assert helium.heat_capacity_ratio == pytest.approx(5 / 3, rel=1e-3)
    assert helium.prandtl == pytest.approx(2 / 3, rel=0.01)  # Eucken: exact for hard spheres
    assert nitrogen.heat_capacity_ratio == pytest.approx(1.4, rel=2e-3)


@pytest.mark.parametrize(("name", "a"), [("helium", 0.2), ("helium", 1.0), ("nitrogen", 0.76), ("argon", 0.9)])
@pytest.mark.parametrize("pressure", [300.0, 1e4, 3e5])
def test_jump_length_against_the_length_of_zehner_bauer_schluender(name, a, pressure):
    """l = 2 (2 - a)/a sqrt(2 pi R T/M) k/(p (2 cp - R/M)) of the VDI Heat Atlas is both jump lengths of a gap."""
    gas = gas_state(name, 700.0, pressure)
    specific = GAS_CONSTANT / gas.molar_mass
    speed = math.sqrt(2.0 * math.pi * specific * gas.temperature)
    length = 2.0 * (2.0 - a) / a * speed * gas.conductivity / (pressure * (2.0 * gas.heat_capacity - specific))
    assert 2.0 * jump_length(gas, a) == pytest.approx(length, rel=2e-3)  # cp - cv = R/M only for an ideal gas


def test_a_pressure_beyond_the_correlations_is_refused():
    """At 8e8 Pa they give helium a conductivity of .004 W/(m K), at 1e9 Pa a negative one."""
    with pytest.raises(InputError, match=r"hold up to 1e\+08 Pa"):
        gas_state("helium", 600.0, 2e8)


def test_vacuum_and_continuum_limits_are_exact():
    vacuum, dense = gas_state("helium", 500.0, 0.0), gas_state("helium", 500.0, 1e8)
    assert vacuum.mean_free_path == math.inf
    jump = jump_length(vacuum, 0.5)
    assert vacuum.conductivity / (1e-6 + 2.0 * jump) == 0.0
    assert pore_conductivity(vacuum, jump, 1e-3, 0.6) == 0.0
    gap = 1e-4
    ratio = dense.conductivity / (gap + 2.0 * jump_length(dense, 0.5)) / (dense.conductivity / gap)
    assert ratio == pytest.approx(1.0, abs=1e-4)


def test_jump_length_falls_as_one_over_pressure():
    jumps = [jump_length(gas_state("helium", 800.0, p), 0.3) for p in (1.0, 10.0, 100.0)]
    assert jumps[0] / jumps[1] == pytest.approx(10.0) and jumps[1] / jumps[2] == pytest.approx(10.0)


def test_free_molecular_gap_does_not_depend_on_its_width():
    """At p -> 0 a gap conducts k/(2 j) = p (a/(2 - a)) (gamma + 1)/(gamma - 1) sqrt(R/(8 pi M T)): Kennard (1938)."""
    gas, a = gas_state("helium", 400.0, 1.0), 1.0
    gamma = gas.heat_capacity_ratio
    specific = GAS_CONSTANT / gas.molar_mass
    kennard = (gamma + 1.0) / (gamma - 1.0) * math.sqrt(specific / (8.0 * math.pi * gas.temperature))
    assert gas.conductivity / (2.0 * jump_length(gas, a)) == pytest.approx(kennard, rel=2e-3)


def test_mixture_by_wilke_published_value():
    """Wilke (1950) for dimethyl ether with 5 % sulphur dioxide, as the chemicals library evaluates it."""
    x, mu, m = np.array([0.05, 0.95]), np.array([1.34e-5, 9.5029e-6]), np.array([64.06, 46.07])
    assert mixture_value(x, mu, interaction_factors(mu, m)) == pytest.approx(9.701614885866193e-06, rel=1e-12)


def test_mixture_limits():
    pure = gas_state("helium", 700.0, 1e5)
    one = gas_state({"helium": 1.0, "argon": 0.0}, 700.0, 1e5)
    twins = gas_state({"helium": 0.5, "he": 0.5}, 700.0, 1e5)
    for item in ("conductivity", "viscosity", "heat_capacity", "heat_capacity_ratio", "molar_mass"):
        assert getattr(one, item) == pytest.approx(getattr(pure, item), rel=1e-12)
        assert getattr(twins, item) == pytest.approx(getattr(pure, item), rel=1e-12)
    k = [gas_state({"helium": x, "nitrogen": 1.0 - x}, 700.0, 1e5).conductivity for x in np.linspace(0, 1, 11)]
    assert (np.diff(k) > 0.0).all()


def test_air_as_a_mixture():
    mixed = gas_state({"nitrogen": 0.7812, "oxygen": 0.2095, "argon": 0.0093}, 600.0, 1e5)
    air = gas_state("air", 600.0, 1e5)
    assert mixed.conductivity == pytest.approx(air.conductivity, rel=0.02)
    assert mixed.viscosity == pytest.approx(air.viscosity, rel=0.02)
    assert mixed.molar_mass == pytest.approx(0.028965, rel=1e-3)


def test_accommodation_is_largest_for_equal_masses():
    helium = gas_state("helium", 300.0, 1e5)
    assert accommodation_from_masses(helium.molar_mass, helium) == pytest.approx(0.6)
    assert accommodation_from_masses(1.0, helium) < accommodation_from_masses(0.02, helium) < 0.6


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("helum", 300.0, 1e5), "there is no gas named"),
        (("helium", 300.0, -1.0), "not negative"),
        (("helium", -3.0, 1e5), "positive"),
        (("helium", 3000.0, 1e5), "holds from"),
        (("carbon dioxide", 250.0, 5e6), "expected a gas"),
        (({"helium": 0.5, "argon": 0.4}, 300.0, 1e5), "add up to 1"),
        (({"helium": 1.5, "argon": -0.5}, 300.0, 1e5), "must lie in"),
        (({}, 300.0, 1e5), "mole fractions"),
    ],
)
def test_refused_gases_are_told_in_one_line(arguments, message):
    with pytest.raises(InputError, match=message) as caught:
        gas_state(*arguments)
    assert "\n" not in str(caught.value)


def test_without_coolprop_one_line_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "CoolProp", None)
    monkeypatch.setitem(sys.modules, "CoolProp.CoolProp", None)
    with pytest.raises(InputError, match="pip install"):
        gas_state("helium", 300.0, 1e5)


def test_coolprop_is_imported_only_when_a_gas_is_asked_for():
    code = "import sys, etc_engine.materials, etc_engine.cli.materials; print('CoolProp' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_every_solid_has_a_source_a_range_and_positive_values():
    for solid in CATALOGUE.values():
        for item in solid.properties:
            assert item.source and item.low <= item.high
            assert (item.at(np.linspace(item.low, item.high, 50)) > 0.0).all(), item.name
            for outside in (item.low - 1.0, item.high + 1.0):
                with pytest.raises(InputError, match="is known from"):
                    item.at(outside)


@pytest.mark.parametrize(
    ("name", "temperature", "published", "tolerance"),
    [
        ("alumina", 293.15, 33.0, 2.0),  # Munro (1997): 33(2) at 20 C
        ("copper", 300.0, 401.0, 0.5),
        ("aluminium", 300.0, 237.0, 0.5),  # Ho, Powell and Liley: 237 at 300 K, 240 at 400 K
        ("aluminium", 400.0, 240.0, 0.5),
        ("graphite IG-11", 298.15, 110.0, 0.1),
        ("silicon carbide", 293.15, 114.0, 1.0),  # Munro (1997): 114 at 20 C
    ],
)
def test_published_points(name, temperature, published, tolerance):
    assert float(find_solid(name).conductivity.at(temperature)) == pytest.approx(published, abs=tolerance)


def test_porosity_corrections():
    dense = uranium_dioxide_conductivity(np.array([1000.0]), porosity=0.0)
    assert uranium_dioxide_conductivity(np.array([1000.0])) == pytest.approx(dense * 0.95 / 1.1)
    full = lithium_titanate_conductivity(np.array([800.0]), porosity=0.0)
    assert lithium_titanate_conductivity(np.array([800.0]), porosity=0.1) == pytest.approx(full * 0.9**2.9)


def test_names_and_near_misses():
    assert find_solid("stainless_steel-316").name == "stainless steel 316"
    with pytest.raises(InputError, match=r"did you mean .*alumina"):
        find_solid("alumna")
    with pytest.raises(InputError, match="there are"):
        find_solid("xyzzy")


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"temperature": [300, 400]}, "needs a column 'conductivity'"),
        ({"temperature": [300, 400], "conductivity": [1.0]}, None),
        ({"temperature": [300, 400], "conductivity": [1.0, 2.0, 3.0]}, "2 temperatures and 3 values"),
        ({"temperature": [400, 300], "conductivity": [1.0, 2.0]}, "must increase"),
        ({"temperature": [300, 400], "conductivity": [1.0, -2.0]}, "must be positive"),
        ({"temperature": [300, 400], "conductivity": [1.0, float("nan")]}, "must be positive"),
        ({"temperature": [300, 400], "conductivity": ["a", "b"]}, "must hold numbers"),
        ({"temperature": [300, 400], "conductivities": [1.0, 2.0]}, "has no column"),
    ],
)
def test_tables_of_the_user(columns, message):
    if message is None:
        assert float(solid_from_table("mine", columns).conductivity.at(350.0)) == 1.0
    else:
        with pytest.raises(InputError, match=message):
            solid_from_table("mine", columns)
