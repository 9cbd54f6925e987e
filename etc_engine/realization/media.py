"""Media of one packing: every combination of the physical values of a realization."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from etc_engine.arrays import Floats, Ints
from etc_engine.errors import InputError
from etc_engine.laws.roughness import Roughness
from etc_engine.materials import find_solid
from etc_engine.medium.conditions import Conditions, pores_at
from etc_engine.medium.loaded import Stiffness, with_roughness
from etc_engine.medium.local import LocalProperties, solid_law
from etc_engine.medium.medium import Medium, Pores
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.rules import find_rule
from etc_engine.packing import ParticlePacking
from etc_engine.particle_files.table import ParticleTable
from etc_engine.realization.specification import RealizationSpec

Values = Mapping[str, float]


def make_media(
    table: ParticleTable, spec: RealizationSpec, rng: np.random.Generator, *, contacts: bool
) -> list[Medium]:
    """The media of a packing, in the order of `RealizationSpec.combinations`.

    Parameters
    ----------
    table : ParticleTable
        The packing, and conductivities or types of its particles where a file gives them.
    spec : RealizationSpec
    rng : numpy.random.Generator
        It places the second material of a mixture: the same order of the particles for all media.
    contacts : bool
        Whether the media need a contact network. Media that differ in nothing of it share it; those that differ in
        the half-angle or the resistance alone share its pairs.

    Raises
    ------
    InputError, GeometryError
    """
    packing = table.packing
    mixed = "mixture_fraction" in {*spec.values, *spec.axes}
    order = rng.permutation(packing.count) if mixed else None
    found: dict[tuple[float, ...], ContactNetwork] = {}
    media = []
    for values in spec.combinations():
        network = _network(packing, spec.rule, values, found) if contacts else None
        solid = {} if spec.material is None else {"particle_conductivity": solid_conductivity(spec.material, values)}
        own = own_conductivities(table, spec.types, values)
        conductivity = particle_conductivities(packing.count, {**values, **solid}, order, own)
        pores = pores_at(conditions_of(spec, values), packing, values.get("pore_conductivity", 0.0))
        if network is not None and "roughness_height" in values:
            network = _roughened(network, values, conductivity, pores)
        local = _local(table, spec, values, order, conductivity) if spec.nonlinear else None
        media.append(Medium(packing, conductivity, network, pores, local=local))
    return media


def _local(
    table: ParticleTable, spec: RealizationSpec, values: Values, order: Ints | None, conductivity: Floats
) -> LocalProperties:
    """Properties over the temperature, and the temperatures of the walls."""
    middle, half = values["temperature"], 0.5 * values["temperature_difference"]
    materials = []
    if spec.types is not None and table.types is not None:
        named = {word: value for word, value in spec.types.items() if isinstance(value, str)}
        materials = [(table.types == word, find_solid(value).conductivity) for word, value in named.items()]
    elif spec.material is not None:
        rows = np.ones(table.packing.count, dtype=np.bool_)
        if order is not None:
            rows[order[: round(values["mixture_fraction"] * rows.size)]] = False
        materials = [(rows, find_solid(spec.material).conductivity)]
    return LocalProperties(
        table.packing,
        conditions_of(spec, values),
        solid_law(conductivity, materials),
        values.get("pore_conductivity", 0.0),
        (middle + half, middle - half),
    )


def solid_conductivity(material: str | Mapping[str, Any], values: Values) -> float:
    """Conductivity of a solid by name at the temperature among the values [W/(m K)]."""
    return float(find_solid(material).conductivity.at(values["temperature"]))


def conditions_of(spec: RealizationSpec, values: Values) -> Conditions:
    """Gas, temperature, pressure and radiation of one medium."""
    return Conditions(
        values.get("temperature"),
        spec.gas,
        values.get("pressure"),
        values.get("accommodation"),
        None if spec.gas is None or spec.material is None else find_solid(spec.material).atomic_mass,
        values.get("emissivity"),
    )


def _roughened(
    network: ContactNetwork, values: Values, conductivity: NDArray[np.float64], pores: Pores
) -> ContactNetwork:
    """The contacts with the area resistance of rough surfaces."""
    roughness = Roughness(values["roughness_height"], values["roughness_slope"], hardness=values["roughness_hardness"])
    stiffness = Stiffness(
        values["youngs_modulus"],
        values["poisson_ratio"],
        values.get("wall_youngs_modulus"),
        values.get("wall_poisson_ratio"),
    )
    return with_roughness(network, roughness, stiffness, conductivity, (pores.conductivity, pores.jump_length))


def contact_network(packing: ParticlePacking, word: str, values: Values) -> ContactNetwork:
    """Contacts of a packing by a rule, with their resistance.

    Parameters
    ----------
    packing : ParticlePacking
    word : str
        Of the rule.
    values : mapping of str to float
        Keys of the rule, ``contact_resistance`` and ``area_resistance``, in SI units.
    """
    return _network(packing, word, values, {})


def _network(
    packing: ParticlePacking, word: str, values: Values, found: dict[tuple[float, ...], ContactNetwork]
) -> ContactNetwork:
    """Contacts for some values; ``found`` holds those that were made before."""
    rule = find_rule(word)
    own = {key: values[key] for key in rule.keys if key in values}
    resistance, angle = values.get("contact_resistance", 0.0), own.get("contact_angle", 0.0)
    film = values.get("area_resistance", 0.0)
    whole = (*own.values(), resistance, film)
    if whole not in found:
        pairs = tuple(value for key, value in own.items() if key != "contact_angle")
        if pairs not in found:
            found[pairs] = rule.contacts(packing, **{rule.keys[key]: value for key, value in own.items()})
        network = found[pairs]
        if "contact_angle" in own:
            network = network.with_half_angle(angle)
        found[whole] = network.with_resistance(resistance).with_area_resistance(film)
    return found[whole]


def own_conductivities(
    table: ParticleTable, types: Mapping[str, float | str] | None, values: Values
) -> NDArray[np.float64] | None:
    """Conductivity of each particle by its type, or by the column of its file; None where there is neither.

    Raises
    ------
    InputError
        If the particles have no types, or one of a type that is not named.
    """
    if types is None:
        return table.conductivity
    if table.types is None:
        raise InputError("the particles have no column of types, by which their conductivities are given")
    found = sorted(set(table.types.tolist()))
    missing = [word for word in found if word not in types]
    if missing:
        raise InputError(
            f"the particles have the types {', '.join(found)}: the conductivity of {missing[0]} is missing"
        )
    by_type = {
        word: solid_conductivity(value, values) if isinstance(value, str) else float(value)
        for word, value in types.items()
    }
    return np.array([by_type[word] for word in table.types.tolist()])


def particle_conductivities(
    count: int, values: Values, order: NDArray[np.int64] | None, own: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """Conductivity of each particle, shape (count,) [W/(m K)]; a mixture has its second material at random places."""
    conductivities = np.full(count, values["particle_conductivity"]) if own is None else own.copy()
    if order is not None:
        conductivities[order[: round(values["mixture_fraction"] * count)]] = values["mixture_conductivity"]
    return conductivities
