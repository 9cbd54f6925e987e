"""Conductivity of solids and gases over temperature and pressure, with sources."""

from etc_engine.materials.gases import Gas, accommodation_from_masses, gas_state, jump_length, pore_conductivity
from etc_engine.materials.lookup import CATALOGUE, find_solid
from etc_engine.materials.properties import Property
from etc_engine.materials.solid import Solid, solid_from_table

__all__ = [
    "CATALOGUE",
    "Gas",
    "Property",
    "Solid",
    "accommodation_from_masses",
    "find_solid",
    "gas_state",
    "jump_length",
    "pore_conductivity",
    "solid_from_table",
]
