"""etc_engine: effective thermal conductivity of particle systems and its statistics.

The names below are the public ones; each is imported when it is first used, so that the command line starts fast.

Examples
--------
>>> import numpy as np
>>> from etc_engine import Box, Medium, PackingSpec, bonded_contacts, effective_conductivity, pack, parse_radii
>>> packing = pack(PackingSpec("advancing-front", parse_radii("equal:0.05"), Box((1.0, 1.0))), np.random.default_rng(7))
>>> medium = Medium(packing, 1.0, bonded_contacts(packing, 0.1))
>>> bool(0.0 < effective_conductivity(medium).tensor[0, 0] < 1.0)
True
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from etc_engine.box import Box
    from etc_engine.comparison import evaluate_models
    from etc_engine.errors import EtcError
    from etc_engine.medium.backbone import find_backbone
    from etc_engine.medium.conductances import mean_field_conductivity
    from etc_engine.medium.conductivity import EffectiveConductivity
    from etc_engine.medium.field import ParticleField
    from etc_engine.medium.medium import Medium, Pores, medium_of
    from etc_engine.medium.network import ContactNetwork
    from etc_engine.medium.rules import bonded_contacts, overlap_contacts
    from etc_engine.medium.transient import ParticleSystem
    from etc_engine.models.catalogue import evaluate as evaluate_model
    from etc_engine.packing import PackingSpec, ParticlePacking, pack, parse_radii
    from etc_engine.particle_files.csv_files import read_csv
    from etc_engine.particle_files.dumps import read_dump
    from etc_engine.particle_files.particles import read_particles
    from etc_engine.realization import RealizationSpec, effective_conductivity, field_along, realize, transient_system
    from etc_engine.solvers.marching import march
    from etc_engine.structure.union import solid_fraction

__version__ = "0.2.0"

_HOMES = {
    "Box": "box",
    "ContactNetwork": "medium.network",
    "EffectiveConductivity": "medium.conductivity",
    "EtcError": "errors",
    "Medium": "medium.medium",
    "PackingSpec": "packing",
    "ParticleField": "medium.field",
    "ParticlePacking": "packing",
    "ParticleSystem": "medium.transient",
    "Pores": "medium.medium",
    "RealizationSpec": "realization",
    "bonded_contacts": "medium.rules",
    "effective_conductivity": "realization",
    "evaluate_model": "models.catalogue:evaluate",
    "evaluate_models": "comparison",
    "find_backbone": "medium.backbone",
    "march": "solvers.marching",
    "mean_field_conductivity": "medium.conductances",
    "medium_of": "medium.medium",
    "overlap_contacts": "medium.rules",
    "pack": "packing",
    "parse_radii": "packing",
    "read_csv": "particle_files.csv_files",
    "read_dump": "particle_files.dumps",
    "read_particles": "particle_files.particles",
    "realize": "realization",
    "field_along": "realization",
    "solid_fraction": "structure.union",
    "transient_system": "realization",
}

__all__ = [
    "Box",
    "ContactNetwork",
    "EffectiveConductivity",
    "EtcError",
    "Medium",
    "PackingSpec",
    "ParticleField",
    "ParticlePacking",
    "ParticleSystem",
    "Pores",
    "RealizationSpec",
    "bonded_contacts",
    "effective_conductivity",
    "evaluate_model",
    "evaluate_models",
    "field_along",
    "find_backbone",
    "march",
    "mean_field_conductivity",
    "medium_of",
    "overlap_contacts",
    "pack",
    "parse_radii",
    "read_csv",
    "read_dump",
    "read_particles",
    "realize",
    "solid_fraction",
    "transient_system",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, attribute = _HOMES[name].partition(":")
    return getattr(import_module(f"{__name__}.{module}"), attribute or name)


def __dir__() -> list[str]:
    return sorted(__all__)
