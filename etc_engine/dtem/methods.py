"""The variants of the method by name: how an element is made, and how its arc temperatures follow from its flows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from etc_engine.dtem.arc import arc_elements, arc_potentials
from etc_engine.dtem.closed_form import closed_form_elements, closed_form_potentials
from etc_engine.dtem.element import Elements, Material
from etc_engine.dtem.resistance import SELF_RESISTANCE
from etc_engine.dtem.sides import ContactSides
from etc_engine.errors import InputError


@dataclass(frozen=True)
class Method:
    """One variant.

    Parameters
    ----------
    elements : callable
        (sides, material) -> Elements.
    potentials : callable
        (sides, material, flows of shape (s, modes)) -> arc temperatures above the particle's mean, shape (s,).
    uniform_flux : bool
        Whether the flux is uniform over an arc; otherwise it follows Chebyshev modes over sqrt(1 - s^2).
    """

    elements: Callable[[ContactSides, Material], Elements]
    potentials: Callable[[ContactSides, Material, NDArray[np.float64]], NDArray[np.float64]]
    uniform_flux: bool


METHODS: Mapping[str, Method] = {
    **{
        name: Method(
            partial(closed_form_elements, method=name), partial(closed_form_potentials, method=name), name != "chord"
        )
        for name in SELF_RESISTANCE
    },
    "arc": Method(arc_elements, arc_potentials, uniform_flux=False),
}


def find_method(name: str) -> Method:
    """The variant of that name.

    Raises
    ------
    InputError
        If there is none.
    """
    if name not in METHODS:
        raise InputError(f"unknown method {name!r}: expected one of {', '.join(METHODS)}")
    return METHODS[name]
