"""The variants of the method by name: how an element is made, and how its arc temperatures follow from its flows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from etc_engine.engines.dtem import arc
from etc_engine.engines.dtem.arc import arc_elements, arc_potentials, arc_resistances
from etc_engine.engines.dtem.closed_form import closed_form_elements, closed_form_potentials, closed_form_resistances
from etc_engine.engines.dtem.element import Elements, Material, Resistances
from etc_engine.engines.dtem.exact import element as exact
from etc_engine.engines.dtem.exact.element import exact_elements, exact_potentials
from etc_engine.errors import InputError
from etc_engine.laws.by_dimension import LAWS
from etc_engine.medium.sides import ContactSides


@dataclass(frozen=True)
class Method:
    """One variant.

    Parameters
    ----------
    elements : callable
        (sides, material, modes) -> Elements.
    potentials : callable
        (sides, material, flows of shape (s, modes)) -> arc temperatures above the particle's mean, shape (s,).
    modes : int
        Flux modes of a contact, unless others are asked for; a method with 1 has no more.
    uniform_flux : bool
        Whether the flux is uniform over an arc; otherwise it follows Chebyshev modes over sqrt(1 - s^2).
    exact_cuts : bool
        Whether the disks lose what contacts and walls cut off: insulated walls and dead ends count then.
    resistances : callable, optional
        (sides, material, modes) -> Resistances, which a transient needs; None where the method has no such form.
    """

    elements: Callable[[ContactSides, Material, int], Elements]
    potentials: Callable[[ContactSides, Material, NDArray[np.float64]], NDArray[np.float64]]
    modes: int
    uniform_flux: bool
    exact_cuts: bool = False
    resistances: Callable[[ContactSides, Material, int], Resistances] | None = None


MOST_MODES = 10
"""Beyond these the matrices of an element lose their last digits."""

_CLOSED_FORMS = {
    name: Method(
        partial(closed_form_elements, method=name),
        partial(closed_form_potentials, method=name),
        modes=1,
        uniform_flux=name != "chord",
        resistances=partial(closed_form_resistances, method=name),
    )
    for name in LAWS[2].self_resistances
}
METHODS: Mapping[str, Method] = {
    **_CLOSED_FORMS,
    "arc": Method(arc_elements, arc_potentials, arc.MODES, uniform_flux=False, resistances=arc_resistances),
    "exact": Method(exact_elements, exact_potentials, exact.MODES, uniform_flux=False, exact_cuts=True),
}
METHODS_BY_DIMENSION: Mapping[int, Mapping[str, Method]] = {
    2: METHODS,
    3: {name: _CLOSED_FORMS[name] for name in LAWS[3].self_resistances},
}


def find_method(name: str, dimension: int = 2) -> Method:
    """The variant of that name for disks (2) or spheres (3).

    Raises
    ------
    InputError
        If there is none.
    """
    known = METHODS_BY_DIMENSION[dimension]
    if name not in known:
        particles = "" if dimension == 2 else f" of a {LAWS[dimension].name}"
        raise InputError(f"unknown method {name!r}{particles}: expected one of {', '.join(known)}")
    return known[name]


def flux_modes(name: str, modes: int | None, dimension: int = 2) -> int:
    """Flux modes of a contact: those asked for, or the method's own.

    Raises
    ------
    InputError
        If the method does not have them.
    """
    own = find_method(name, dimension).modes
    if modes is None or modes == own:
        return own
    if own == 1:
        raise InputError(f"method {name} has one flux mode a contact, found modes = {modes}: leave it out")
    if not 1 <= modes <= MOST_MODES:
        raise InputError(f"the number of flux modes must lie between 1 and {MOST_MODES}, found {modes}")
    return modes
