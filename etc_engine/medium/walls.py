"""Thermal conditions at the walls of a box, each of them free to vary with time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from etc_engine.box import Box
from etc_engine.errors import InputError

WALLS = ("left", "right", "bottom", "top", "front", "back")
"""Names of the walls 0, 1 (x), 2, 3 (y), 4, 5 (z): the low end of an axis before its far end."""


@dataclass(frozen=True)
class TimeTable:
    """Values at increasing times, linear in between and constant outside.

    Parameters
    ----------
    times : tuple of float [s]
    values : tuple of float

    Raises
    ------
    InputError
        If the times do not increase, a number is not finite, or there are not as many values.

    Examples
    --------
    >>> TimeTable((0.0, 10.0), (300.0, 400.0))(2.5)
    325.0
    """

    times: tuple[float, ...]
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "times", tuple(float(t) for t in self.times))
        object.__setattr__(self, "values", tuple(float(v) for v in self.values))
        increasing = all(a < b for a, b in pairwise(self.times))
        finite = bool(np.isfinite(self.times + self.values).all())
        if not self.times or len(self.times) != len(self.values) or not increasing or not finite:
            raise InputError(
                f"a table needs increasing times and as many values, all of them finite; found "
                f"{len(self.times)} times and {len(self.values)} values: {self.times}, {self.values}"
            )

    def __call__(self, t: float) -> float:
        """The value at a time."""
        return float(np.interp(t, self.times, self.values))


Value = float | TimeTable | Callable[[float], float]
"""A number, a table or a function of the time [s]."""
ValueLike = Value | tuple[Sequence[float], Sequence[float]]
"""As `Value`, a table also as its two columns."""


def as_value(value: ValueLike, name: str) -> Value:
    """A value as it was given: a finite number, a `TimeTable` of a pair of columns, or a function.

    Raises
    ------
    InputError
        If it is none of these; ``name`` says which value it is.
    """
    if callable(value):
        return value
    if isinstance(value, tuple) and len(value) == 2:
        return TimeTable(tuple(value[0]), tuple(value[1]))
    if isinstance(value, int | float | np.number) and np.isfinite(value):
        return float(value)
    raise InputError(
        f"the {name} must be a finite number, a table (times, values) or a function of time, found {value!r}"
    )


def knots_of(value: ValueLike) -> tuple[float, ...]:
    """Times at which a value has a kink [s]: those of a table.

    Examples
    --------
    >>> knots_of(TimeTable((0.0, 2.0), (1.0, 3.0))), knots_of(5.0)
    ((0.0, 2.0), ())
    """
    return value.times if isinstance(value, TimeTable) else ()


def value_at(value: Value, t: float) -> float:
    """The value at a time.

    Examples
    --------
    >>> value_at(300.0, 5.0), value_at(lambda t: 2.0 * t, 5.0)
    (300.0, 10.0)
    """
    return float(value(t)) if callable(value) else value


@dataclass(frozen=True)
class FixedTemperature:
    """A wall held at a temperature.

    Parameters
    ----------
    value : float, table or callable [K]
    """

    value: ValueLike

    def __post_init__(self) -> None:
        object.__setattr__(self, "value", as_value(self.value, "wall temperature"))

    @property
    def knots(self) -> tuple[float, ...]:
        """Times at which the temperature has a kink [s]."""
        return knots_of(self.value)

    def temperature(self, t: float) -> float:
        """Wall temperature at a time [K]."""
        return value_at(self.value, t)  # type: ignore[arg-type]


@dataclass(frozen=True)
class HeatFlux:
    """A wall through which a prescribed heat flows in.

    The wall is a plate of no heat capacity and of infinite conductivity: its temperature is uniform and follows from
    the contacts that share the heat.

    Parameters
    ----------
    value : float, table or callable [W/m2]
        Heat flux into the body, averaged over the face of the box; negative cools.
    """

    value: ValueLike

    def __post_init__(self) -> None:
        object.__setattr__(self, "value", as_value(self.value, "wall heat flux"))

    @property
    def knots(self) -> tuple[float, ...]:
        """Times at which the flux has a kink [s]."""
        return knots_of(self.value)

    def flux(self, t: float) -> float:
        """Heat flux into the body at a time [W/m2]."""
        return value_at(self.value, t)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Convective:
    """A wall that exchanges heat with an ambient fluid, q = h (T_ambient - T_wall).

    The wall is a plate of no heat capacity and of infinite conductivity, as in `HeatFlux`.

    Parameters
    ----------
    coefficient : float [W/(m2 K)]
        Heat transfer coefficient h over the face of the box, positive and constant (it is part of the matrix).
    ambient : float, table or callable [K]

    Raises
    ------
    InputError
        If the coefficient is not positive and finite.
    """

    coefficient: float
    ambient: ValueLike

    def __post_init__(self) -> None:
        object.__setattr__(self, "coefficient", float(self.coefficient))
        if not (np.isfinite(self.coefficient) and self.coefficient > 0.0):
            raise InputError(
                f"the heat transfer coefficient of a convective wall must be positive and finite, found "
                f"{self.coefficient:g}; an insulated wall is Insulated()"
            )
        object.__setattr__(self, "ambient", as_value(self.ambient, "ambient temperature"))

    @property
    def knots(self) -> tuple[float, ...]:
        """Times at which the ambient temperature has a kink [s]."""
        return knots_of(self.ambient)

    def temperature(self, t: float) -> float:
        """Ambient temperature at a time [K]."""
        return value_at(self.ambient, t)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Insulated:
    """A wall that no heat crosses. It has no temperature."""


WallCondition = FixedTemperature | HeatFlux | Convective | Insulated


def wall_conditions(box: Box, named: Mapping[str, WallCondition]) -> tuple[WallCondition, ...]:
    """Condition at each wall of a box, in the order of `WALLS`; a wall that is not named is insulated.

    Parameters
    ----------
    box : Box
    named : mapping of str to WallCondition

    Raises
    ------
    InputError
        If there is no wall of that name, or none because the box is periodic there.

    Examples
    --------
    >>> wall_conditions(Box((1.0, 1.0)), {"left": FixedTemperature(300.0)})[:2]
    (FixedTemperature(value=300.0), Insulated())
    """
    names = WALLS[: 2 * box.dimension]
    for name, condition in named.items():
        if name not in names:
            raise InputError(f"unknown wall {name!r}: expected one of {', '.join(names)}")
        if box.periodic[names.index(name) // 2] and not isinstance(condition, Insulated):
            raise InputError(f"the box is periodic across the {name} wall: there is no such wall")
    return tuple(named.get(name, Insulated()) for name in names)
