"""One realization: pack, find contacts, conduct; and the table of engines."""

from etc_engine.medium.conduction import Conduction
from etc_engine.realization.engine import Engine, Method
from etc_engine.realization.engines import ENGINES, effective_conductivity, field_along, find_engine
from etc_engine.realization.outcome import Outcome, Realization, Status
from etc_engine.realization.realize import realize
from etc_engine.realization.specification import RealizationSpec
from etc_engine.realization.transients import transient_system

__all__ = [
    "ENGINES",
    "Conduction",
    "Engine",
    "Method",
    "Outcome",
    "Realization",
    "RealizationSpec",
    "Status",
    "effective_conductivity",
    "field_along",
    "find_engine",
    "realize",
    "transient_system",
]
