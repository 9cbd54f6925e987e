"""Variants of the method by name: how an element is made, and how contact temperatures follow from flows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

from etc_engine.arrays import Floats
from etc_engine.engines.dtem import arc
from etc_engine.engines.dtem.arc import arc_resistances
from etc_engine.engines.dtem.closed_form import closed_form_potentials, closed_form_resistances
from etc_engine.engines.dtem.element import Elements, Resistances, condensed_elements, contact_potentials
from etc_engine.engines.dtem.exact import element as exact
from etc_engine.engines.dtem.exact.element import exact_drops, exact_elements, exact_potentials
from etc_engine.engines.dtem.exact.spheres import DEGREE, exact_sphere_elements, exact_sphere_potentials
from etc_engine.errors import InputError
from etc_engine.laws.by_dimension import LAWS
from etc_engine.laws.sphere_modes import number_of_modes
from etc_engine.medium.sides import ContactSides

MakeResistances = Callable[[ContactSides, Floats, int], Resistances]
"""(sides, conductivity of each particle, modes) -> resistance matrices."""


def _uniform_drops(sides: ContactSides, _: Floats, flows: Floats) -> Floats:
    """Temperature drops that are uniform over the contact."""
    return sides.resistances * flows[:, 0]


@dataclass(frozen=True)
class Variant:
    """One variant of the method.

    Parameters
    ----------
    elements : callable
        (sides, conductivity of each particle, modes) -> Elements.
    potentials : callable
        (sides, conductivity, flows of shape (s, modes)) -> contact temperatures above the particle's mean, shape (s,).
    drops : callable
        (sides, conductivity, flows) -> mean temperature of each contact above that of the face of the side, shape (s,).
    modes : int
        Flux modes of a contact, unless others are asked for; a variant with 1 has no more. On the disk between two
        spheres ``modes`` stands for all modes of a degree below it.
    uniform_flux : bool
        Whether the flux is uniform over an arc; otherwise it follows Chebyshev modes over sqrt(1 - s^2).
    exact_cuts : bool
        Whether the disks lose what contacts and walls cut off: insulated walls and dead ends count then.
    resistances : callable, optional
        (sides, conductivity, modes) -> Resistances, which a transient needs; None where there is no such form.
    most : int
        Largest ``modes``: beyond it the matrices of an element lose their last digits.
    count : callable
        ``modes`` -> how many modes that are.
    """

    elements: Callable[[ContactSides, Floats, int], Elements]
    potentials: Callable[[ContactSides, Floats, Floats], Floats]
    modes: int
    uniform_flux: bool
    exact_cuts: bool = False
    resistances: MakeResistances | None = None
    most: int = 10
    count: Callable[[int], int] = int
    drops: Callable[[ContactSides, Floats, Floats], Floats] = _uniform_drops


def _elements_of(make: MakeResistances, sides: ContactSides, conductivity: Floats, modes: int) -> Elements:
    """Elements that follow from resistance matrices."""
    return condensed_elements(make(sides, conductivity, modes), sides)


def _arc_potentials(sides: ContactSides, conductivity: Floats, flows: Floats) -> Floats:
    return contact_potentials(arc_resistances(sides, conductivity, flows.shape[1]), sides, flows)


def _closed_form(name: str) -> Variant:
    """A variant in closed form."""
    make = partial(closed_form_resistances, method=name)
    return Variant(
        partial(_elements_of, make),
        partial(closed_form_potentials, method=name),
        modes=1,
        uniform_flux=name != "chord",
        resistances=make,
    )


_CLOSED_FORMS = {name: _closed_form(name) for name in LAWS[2].self_resistances}
METHODS: Mapping[str, Variant] = {
    **_CLOSED_FORMS,
    "arc": Variant(
        partial(_elements_of, arc_resistances),
        _arc_potentials,
        arc.MODES,
        uniform_flux=False,
        resistances=arc_resistances,
    ),
    "exact": Variant(
        exact_elements, exact_potentials, exact.MODES, uniform_flux=False, exact_cuts=True, drops=exact_drops
    ),
}
METHODS_BY_DIMENSION: Mapping[int, Mapping[str, Variant]] = {
    2: METHODS,
    3: {
        **{name: _CLOSED_FORMS[name] for name in LAWS[3].self_resistances},
        "exact": Variant(
            exact_sphere_elements,
            exact_sphere_potentials,
            DEGREE + 1,
            uniform_flux=False,
            exact_cuts=True,
            most=6,
            count=lambda modes: number_of_modes(modes - 1),
        ),
    },
}


def dimensions_of(name: str) -> tuple[int, ...]:
    """2 for disks and 3 for spheres, where a method has them."""
    return tuple(dimension for dimension, known in METHODS_BY_DIMENSION.items() if name in known)


def find_method(name: str, dimension: int = 2) -> Variant:
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
    variant = find_method(name, dimension)
    if modes is None or modes == variant.modes:
        return variant.count(variant.modes)
    if variant.modes == 1:
        raise InputError(f"method {name} has one flux mode per contact, found modes = {modes}: leave it out")
    if not 1 <= modes <= variant.most:
        raise InputError(f"the number of flux modes must lie between 1 and {variant.most}, found {modes}")
    return variant.count(modes)
