"""Pores at a temperature and a pressure: vacuum, continuum, radiation, refusals; engines that cannot take them."""

from __future__ import annotations

import pytest

from etc_engine.box import Box
from etc_engine.errors import InputError
from etc_engine.laws.radiation import grey_exchange
from etc_engine.materials import gas_state, jump_length
from etc_engine.medium.conditions import Conditions, pores_at
from etc_engine.medium.medium import Medium, Pores
from etc_engine.medium.rules import overlap_contacts
from etc_engine.packing.particles import ParticlePacking
from etc_engine.realization.engines import find_engine

pytest.importorskip("CoolProp")
ONE = ParticlePacking([[0.5, 0.5, 0.5]], [0.5], Box((1.0, 1.0, 1.0), (True,) * 3))


def test_rarefied_gas():
    pores = pores_at(Conditions(800.0, "helium", 1e3, 0.3), ONE)
    gas = gas_state("helium", 800.0, 1e3)
    assert pores.conductivity == gas.conductivity
    assert pores.jump_length == pytest.approx(2.0 * jump_length(gas, 0.3))
    assert 0.0 < pores.in_open_pores < pores.conductivity
    assert not pores.plain and pores.conduct


def test_vacuum_is_radiation_alone():
    pores = pores_at(Conditions(800.0, "helium", 0.0, 0.3, emissivity=0.8), ONE)
    assert pores == Pores(radiation=float(grey_exchange(800.0, 0.8, 0.8)))
    assert pores.conduct and not pores_at(Conditions(800.0, "helium", 0.0, 0.3), ONE).conduct


def test_without_an_accommodation_the_gas_is_a_continuum():
    assert pores_at(Conditions(800.0, "helium", 1e3), ONE).plain
    by_mass = pores_at(Conditions(800.0, "helium", 1e3, atomic_mass=0.0133), ONE)
    given = pores_at(Conditions(800.0, "helium", 1e3, 0.427), ONE)
    assert by_mass.jump_length == pytest.approx(given.jump_length, rel=2e-3)


def test_a_number_stands_for_the_gas():
    assert pores_at(Conditions(), ONE, 0.3) == Pores(0.3)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"pressure": 1e5}, "name one, such as helium"),
        ({"accommodation": 0.5}, "name one, such as helium"),
        ({"gas": "helium", "temperature": 300.0}, "needs a pressure"),
        ({"gas": "helium", "pressure": 1e5}, "needs a temperature"),
        ({"emissivity": 0.5}, "needs a temperature"),
    ],
)
def test_refusals(given, message):
    with pytest.raises(InputError, match=message):
        Conditions(**given)


@pytest.mark.parametrize("pores", [{"conductivity": -1.0}, {"jump_length": float("inf")}, {"radiation": -1.0}])
def test_pores_refuse_what_is_not_a_number(pores):
    with pytest.raises(InputError, match="finite and not negative"):
        Pores(**pores)


def test_engines_say_what_they_cannot_take():
    medium = Medium(ONE, 10.0, overlap_contacts(ONE), Pores(1.0, jump_length=0.1))
    with pytest.raises(InputError, match="models neither the temperature jumps"):
        find_engine("voxel").check(medium, "laminate")
