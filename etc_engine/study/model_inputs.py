"""What a study gives the models that it names: a model that has no value in it is refused before anything runs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from etc_engine.models import Model
from etc_engine.models.catalogue import find_model
from etc_engine.realization import ENGINES
from etc_engine.study.conditions import derived_conductivities

if TYPE_CHECKING:
    from etc_engine.study.sweep import Study

OF_THE_SWEEP = ("fraction", "diameter", "coordination")
"""Inputs of models that every sweep measures."""

OF_NETWORKS = "contact_mean_field"
"""The model that a sweep computes on its own contact networks."""


def check_models(study: Study) -> None:
    """Refuse a model of another dimension, one whose inputs the sweep does not know, and one without any value.

    Raises
    ------
    ValueError
    """
    known = _known(study)
    for name in study.models.names:
        model, place = find_model(name), f"models.names: {name!r}"
        if len(study.packing.box) not in model.dimensions:
            covered = " and ".join(f"{d}D" for d in model.dimensions)
            raise ValueError(f"{place} holds in {covered}, found packing.box = {list(study.packing.box)}")
        if name == OF_NETWORKS:
            if not ENGINES[study.conduction.engine].needs_contacts:
                raise ValueError(
                    f"{place} needs a network of contacts, which engine {study.conduction.engine!r} lacks: remove it"
                )
            continue
        _check_inputs(model, known, place)


def _check_inputs(model: Model, known: dict[str, tuple[float, ...]], place: str) -> None:
    missing = [name for name in ("k1", "k2", *model.required) if name not in known and name not in OF_THE_SWEEP]
    missing = [name for name in missing if name in {item.name for item in model.inputs}]
    if missing:
        meanings = {item.name: item.meaning for item in model.inputs}
        described = ", ".join(f"{name} ({meanings[name]})" for name in missing)
        raise ValueError(f"{place} needs {described}, which this study does not give: remove it from the list")
    for item in model.inputs:
        values = np.array(known.get(item.name, ()))
        if values.size and not item.interval.contains(values).any():
            found = ", ".join(f"{value:g}" for value in values[:3])
            raise ValueError(f"{place} needs {item.name} ({item.meaning}) in {item.interval}, found {found}")


def _known(study: Study) -> dict[str, tuple[float, ...]]:
    """Values of the inputs that the study gives."""
    derived = {name: tuple(values.ravel().tolist()) for name, (_, values) in derived_conductivities(study).items()}
    names = {"k1": "pore_conductivity", "k2": "particle_conductivity", "temperature": "temperature"}
    names["emissivity"] = "emissivity"
    found: dict[str, Iterable[float]] = {key: derived.get(name) or study.values(name) for key, name in names.items()}
    if found["temperature"] and not found["emissivity"]:
        found["emissivity"] = (0.0,)
    found["k1"] = found["k1"] or (0.0,)
    return {name: tuple(values) for name, values in found.items() if values}
