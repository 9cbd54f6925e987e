"""Variants of the method by name: how an element is made, and how contact temperatures follow from flows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from etc_engine.engines.dtem import arc
from etc_engine.engines.dtem.arc import arc_resistances
from etc_engine.engines.dtem.closed_form import closed_form_resistances
from etc_engine.engines.dtem.element import Elements, Resistances, condensed_elements, contact_potentials
from etc_engine.engines.dtem.exact import element as exact
from etc_engine.engines.dtem.exact.element import exact_elements, exact_potentials
from etc_engine.errors import InputError
from etc_engine.laws.disk import SELF_RESISTANCE
from etc_engine.medium.sides import ContactSides

MakeResistances = Callable[[ContactSides, NDArray[np.float64], int], Resistances]
"""(sides, conductivity of each particle, modes) -> resistance matrices."""


@dataclass(frozen=True)
class Variant:
    """One variant of the method.

    Parameters
    ----------
    elements : callable
        (sides, conductivity of each particle, modes) -> Elements.
    potentials : callable
        (sides, conductivity, flows of shape (s, modes)) -> contact temperatures above the particle's mean, shape (s,).
    modes : int
        Flux modes of a contact, unless others are asked for; a variant with 1 has no more.
    uniform_flux : bool
        Whether the flux is uniform over an arc; otherwise it follows Chebyshev modes over sqrt(1 - s^2).
    exact_cuts : bool
        Whether the disks lose what contacts and walls cut off: insulated walls and dead ends count then.
    resistances : callable, optional
        (sides, conductivity, modes) -> Resistances, which a transient needs; None where there is no such form.
    """

    elements: Callable[[ContactSides, NDArray[np.float64], int], Elements]
    potentials: Callable[[ContactSides, NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]
    modes: int
    uniform_flux: bool
    exact_cuts: bool = False
    resistances: MakeResistances | None = None


def from_resistances(make: MakeResistances, modes: int, *, uniform_flux: bool) -> Variant:
    """The variant whose elements and contact temperatures follow from its resistance matrices."""

    def elements(sides: ContactSides, conductivity: NDArray[np.float64], modes: int) -> Elements:
        return condensed_elements(make(sides, conductivity, modes), sides)

    def potentials(
        sides: ContactSides, conductivity: NDArray[np.float64], flows: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        return contact_potentials(make(sides, conductivity, flows.shape[1]), sides, flows)

    return Variant(elements, potentials, modes, uniform_flux, resistances=make)


MOST_MODES = 10
"""Beyond these the matrices of an element lose their last digits."""

METHODS: Mapping[str, Variant] = {
    **{
        name: from_resistances(partial(closed_form_resistances, method=name), 1, uniform_flux=name != "chord")
        for name in SELF_RESISTANCE
    },
    "arc": from_resistances(arc_resistances, arc.MODES, uniform_flux=False),
    "exact": Variant(exact_elements, exact_potentials, exact.MODES, uniform_flux=False, exact_cuts=True),
}


def find_method(name: str) -> Variant:
    """The variant of that name.

    Raises
    ------
    InputError
        If there is none.
    """
    if name not in METHODS:
        raise InputError(f"unknown method {name!r}: expected one of {', '.join(METHODS)}")
    return METHODS[name]


def flux_modes(name: str, modes: int | None) -> int:
    """Flux modes of a contact: those asked for, or the method's own.

    Raises
    ------
    InputError
        If the method does not have them.
    """
    own = find_method(name).modes
    if modes is None or modes == own:
        return own
    if own == 1:
        raise InputError(f"method {name} has one flux mode a contact, found modes = {modes}: leave it out")
    if not 1 <= modes <= MOST_MODES:
        raise InputError(f"the number of flux modes must lie between 1 and {MOST_MODES}, found {modes}")
    return modes
