"""Solid, gas and radiation of a study: required keys, and the conductivities that follow from them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.errors import InputError
from etc_engine.materials import find_solid, gas_state
from etc_engine.medium.conditions import Conditions

if TYPE_CHECKING:
    from etc_engine.study.sweep import Study

Derived = dict[str, tuple[tuple[str, ...], Floats]]


def check_conditions(study: Study) -> None:
    """Refuse a gas, a solid or radiation that lacks a key, and conditions beyond the range of its data.

    Raises
    ------
    ValueError
    """
    first = {name: next(iter(study.values(name)), None) for name in ("temperature", "pressure", "accommodation")}
    glow = max(study.values("emissivity"), default=0.0)
    try:
        Conditions(first["temperature"], study.pores.gas, first["pressure"], first["accommodation"], None, glow)
    except InputError as error:
        raise ValueError(f"pores: {error}") from None
    if study.particles.material is not None and first["temperature"] is None:
        raise ValueError("conduction.temperature: missing, the conductivity of particles.material depends on it")
    named = study.particles.material or getattr(study.particles, "types", None)
    if first["temperature"] is not None and not (named or study.pores.gas or glow):
        raise ValueError("conduction.temperature: has no effect without a material, a gas or radiation: remove it")
    derived_conductivities(study)
    if study.conduction.nonlinear:
        _check_local(study)


def _check_local(study: Study) -> None:
    """Refuse properties at the local temperature without walls and their temperatures, or out of their ranges.

    Raises
    ------
    ValueError
    """
    box, middles, differences = study.box, study.values("temperature"), study.values("temperature_difference")
    if all(box.periodic):
        raise ValueError(
            f"conduction.nonlinear: the temperature varies between two walls, found a box periodic along "
            f"{box.periodic_axes}: leave an axis out of packing.periodic"
        )
    for name, given in (("temperature", middles), ("temperature_difference", differences)):
        if not given:
            raise ValueError(f"conduction.{name}: missing, nonlinear = true needs the temperatures of the walls [K]")
    ends = min(middles) - 0.5 * max(differences), max(middles) + 0.5 * max(differences)
    if ends[0] <= 0.0:
        raise ValueError(
            f"conduction.temperature_difference: found {max(differences):g}, the cold wall would be at {ends[0]:g} K"
        )
    types = getattr(study.particles, "types", None) or {}
    solids: dict[str, str | dict[str, Any]] = {
        f"particles.types.{key}": word for key, word in types.items() if isinstance(word, str)
    }
    if study.particles.material is not None:
        solids["particles.material"] = study.particles.material
    for place, word in solids.items():
        _in_range(place, find_solid(word).conductivity.at, ends)
    if study.pores.gas is not None:
        gas, pressure = study.pores.gas, max(study.values("pressure"))
        _in_range("pores.gas", lambda t: gas_state(gas, t, pressure), ends)


def _in_range(place: str, value: Callable[[float], object], temperatures: tuple[float, float]) -> None:
    """Refuse walls at which a property is not known.

    Raises
    ------
    ValueError
    """
    for temperature in temperatures:
        try:
            value(temperature)
        except InputError as error:
            raise ValueError(f"{place}: at the wall of {temperature:g} K {error}") from None


def derived_conductivities(study: Study) -> Derived:
    """Conductivities of particles and pores that follow from a solid and a gas by name [W/(m K)].

    Returns
    -------
    dict
        ``particle_conductivity`` and ``pore_conductivity`` where they follow: dimensions (of temperature and pressure
        those with a list) and values. Of a gas that of the continuum; 0 without any.

    Raises
    ------
    ValueError
        If a name is unknown, or a value lies out of the range of the data.
    """
    found: Derived = {}
    if study.particles.material is not None:
        solid = find_solid(study.particles.material)
        found["particle_conductivity"] = _over(
            study, "particles.material", ("temperature",), lambda t: float(solid.conductivity.at(t))
        )
    gas = study.pores.gas
    if gas is not None:
        found["pore_conductivity"] = _over(
            study,
            "pores.gas",
            ("pressure", "temperature"),
            lambda p, t: gas_state(gas, t, p).conductivity if p > 0.0 else 0.0,
        )
    return found


def _over(
    study: Study, place: str, names: tuple[str, ...], value: Callable[..., float]
) -> tuple[tuple[str, ...], Floats]:
    """Values over every combination, along the dimensions with a list."""
    grids = np.meshgrid(*(study.values(name) for name in names), indexing="ij")
    try:
        values = np.array([value(*map(float, point)) for point in zip(*(grid.ravel() for grid in grids), strict=True)])
    except InputError as error:
        raise ValueError(f"{place}: {error}") from None
    several = tuple(name for name in names if name in study.axes)
    return several, values.reshape([len(study.values(name)) for name in several])
