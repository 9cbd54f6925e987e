"""One realization: pack, find contacts, conduct; and the table of engines."""

from etc_engine.medium.conduction import Conduction
from etc_engine.realization.engines import ENGINES, Engine, Method, effective_conductivity, field_along, find_engine
from etc_engine.realization.outcome import Cells, Outcome, Realization, Status
from etc_engine.realization.realize import realize
from etc_engine.realization.specification import (
    CompositeSpec,
    ConductionSpec,
    ContactSpec,
    Mixture,
    RealizationSpec,
    particle_conductivities,
)
from etc_engine.realization.transients import transient_system

__all__ = [
    "ENGINES",
    "Cells",
    "CompositeSpec",
    "Conduction",
    "ConductionSpec",
    "ContactSpec",
    "Engine",
    "Method",
    "Mixture",
    "Outcome",
    "Realization",
    "RealizationSpec",
    "Status",
    "effective_conductivity",
    "field_along",
    "find_engine",
    "particle_conductivities",
    "realize",
    "transient_system",
]
