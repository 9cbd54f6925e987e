"""One realization: pack, find contacts, conduct."""

from etc_engine.realization.engines import ENGINES, Engine, realize
from etc_engine.realization.networks import conduct_dtem
from etc_engine.realization.outcome import Cell, Realization, Status
from etc_engine.realization.specification import (
    ConductionSpec,
    RealizationSpec,
    particle_conductivities,
)

__all__ = [
    "ENGINES",
    "Cell",
    "ConductionSpec",
    "Engine",
    "Realization",
    "RealizationSpec",
    "Status",
    "conduct_dtem",
    "particle_conductivities",
    "realize",
]
