"""Media of one packing: every combination of the physical values of a realization."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from etc_engine.medium.medium import Medium, Pores
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.rules import find_rule
from etc_engine.packing import ParticlePacking
from etc_engine.realization.specification import RealizationSpec

Values = Mapping[str, float]


def make_media(
    packing: ParticlePacking, spec: RealizationSpec, rng: np.random.Generator, *, contacts: bool
) -> list[Medium]:
    """The media of a packing, in the order of `RealizationSpec.combinations`.

    Parameters
    ----------
    packing : ParticlePacking
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
    mixed = "mixture_fraction" in {*spec.values, *spec.axes}
    order = rng.permutation(packing.count) if mixed else None
    found: dict[tuple[float, ...], ContactNetwork] = {}
    media = []
    for values in spec.combinations():
        network = _network(packing, spec.rule, values, found) if contacts else None
        conductivity = particle_conductivities(packing.count, values, order)
        media.append(Medium(packing, conductivity, network, Pores(values.get("pore_conductivity", 0.0))))
    return media


def contact_network(packing: ParticlePacking, word: str, values: Values) -> ContactNetwork:
    """Contacts of a packing by a rule, with their resistance.

    Parameters
    ----------
    packing : ParticlePacking
    word : str
        Of the rule.
    values : mapping of str to float
        Keys of the rule, and ``contact_resistance``, in SI units.
    """
    return _network(packing, word, values, {})


def _network(
    packing: ParticlePacking, word: str, values: Values, found: dict[tuple[float, ...], ContactNetwork]
) -> ContactNetwork:
    """Contacts for some values; ``found`` holds those that were made before."""
    rule = find_rule(word)
    own = {key: values[key] for key in rule.keys if key in values}
    resistance, angle = values.get("contact_resistance", 0.0), own.get("contact_angle", 0.0)
    whole = (*own.values(), resistance)
    if whole not in found:
        pairs = tuple(value for key, value in own.items() if key != "contact_angle")
        if pairs not in found:
            found[pairs] = rule.contacts(packing, **{rule.keys[key]: value for key, value in own.items()})
        network = found[pairs]
        if "contact_angle" in own:
            network = network.with_half_angle(angle)
        found[whole] = network.with_resistance(resistance)
    return found[whole]


def particle_conductivities(count: int, values: Values, order: NDArray[np.int64] | None) -> NDArray[np.float64]:
    """Conductivity of each particle, shape (count,) [W/(m K)]; a mixture has its second material at random places."""
    conductivities = np.full(count, values["particle_conductivity"])
    if order is not None:
        conductivities[order[: round(values["mixture_fraction"] * count)]] = values["mixture_conductivity"]
    return conductivities
