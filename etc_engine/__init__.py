"""etc_engine: effective thermal conductivity of particle systems and its statistics.

The names below are the public ones; each is imported when it is first used, so that the command line starts fast.

Examples
--------
>>> import numpy as np
>>> from etc_engine import Box, PackingSpec, bonded_contacts, effective_conductivity, pack, parse_radii
>>> packing = pack(PackingSpec("advancing-front", parse_radii("equal:0.05"), Box((1.0, 1.0))), np.random.default_rng(7))
>>> bool(0.0 < effective_conductivity(bonded_contacts(packing, 0.1)).tensor[0, 0] < 1.0)
True
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from etc_engine.box import Box
    from etc_engine.comparison import evaluate_models
    from etc_engine.engines.dtem.effective import effective_conductivity, mean_field_conductivity
    from etc_engine.engines.dtem.field import ParticleField, recover_field
    from etc_engine.engines.dtem.interior import temperatures_inside
    from etc_engine.engines.dtem.steady import solve_steady
    from etc_engine.engines.dtem.transient import transient_system
    from etc_engine.engines.lattice.homogenize import homogenize_lattice
    from etc_engine.engines.pipe.steady import pipe_conductivity
    from etc_engine.engines.pipe.transient import pipe_transient
    from etc_engine.engines.voxel.homogenize import homogenize_voxel
    from etc_engine.errors import EtcError
    from etc_engine.medium.backbone import find_backbone
    from etc_engine.medium.composite import Composite
    from etc_engine.medium.conductivity import EffectiveConductivity
    from etc_engine.medium.network import ContactNetwork
    from etc_engine.medium.rules import bonded_contacts, overlap_contacts
    from etc_engine.models.catalogue import evaluate as evaluate_model
    from etc_engine.packing import PackingSpec, ParticlePacking, pack, parse_radii
    from etc_engine.particle_files.csv_files import read_csv
    from etc_engine.particle_files.dumps import read_dump
    from etc_engine.realization import RealizationSpec, realize
    from etc_engine.solvers.marching import march
    from etc_engine.structure.union import solid_fraction

_HOMES = {
    "Box": "box",
    "Composite": "medium.composite",
    "ContactNetwork": "medium.network",
    "EffectiveConductivity": "medium.conductivity",
    "EtcError": "errors",
    "PackingSpec": "packing",
    "ParticleField": "engines.dtem.field",
    "ParticlePacking": "packing",
    "RealizationSpec": "realization",
    "bonded_contacts": "medium.rules",
    "effective_conductivity": "engines.dtem.effective",
    "evaluate_model": "models.catalogue:evaluate",
    "evaluate_models": "comparison",
    "find_backbone": "medium.backbone",
    "homogenize_lattice": "engines.lattice.homogenize",
    "homogenize_voxel": "engines.voxel.homogenize",
    "march": "solvers.marching",
    "mean_field_conductivity": "engines.dtem.effective",
    "overlap_contacts": "medium.rules",
    "pack": "packing",
    "parse_radii": "packing",
    "pipe_conductivity": "engines.pipe.steady",
    "pipe_transient": "engines.pipe.transient",
    "read_csv": "particle_files.csv_files",
    "read_dump": "particle_files.dumps",
    "realize": "realization",
    "recover_field": "engines.dtem.field",
    "solid_fraction": "structure.union",
    "solve_steady": "engines.dtem.steady",
    "temperatures_inside": "engines.dtem.interior",
    "transient_system": "engines.dtem.transient",
}

__all__ = [
    "Box",
    "Composite",
    "ContactNetwork",
    "EffectiveConductivity",
    "EtcError",
    "PackingSpec",
    "ParticleField",
    "ParticlePacking",
    "RealizationSpec",
    "bonded_contacts",
    "effective_conductivity",
    "evaluate_model",
    "evaluate_models",
    "find_backbone",
    "homogenize_lattice",
    "homogenize_voxel",
    "march",
    "mean_field_conductivity",
    "overlap_contacts",
    "pack",
    "parse_radii",
    "pipe_conductivity",
    "pipe_transient",
    "read_csv",
    "read_dump",
    "realize",
    "recover_field",
    "solid_fraction",
    "solve_steady",
    "temperatures_inside",
    "transient_system",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, attribute = _HOMES[name].partition(":")
    return getattr(import_module(f"{__name__}.{module}"), attribute or name)


def __dir__() -> list[str]:
    return sorted(__all__)
