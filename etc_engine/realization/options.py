"""Options of engines: meaning, default and allowed values."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from etc_engine.errors import InputError

Check = Callable[[Any], str]
"""Maps a value to the words for the allowed ones; to an empty text if the value is allowed."""


@dataclass(frozen=True)
class Option:
    """A choice that an engine heeds besides its method.

    Parameters
    ----------
    description : str
    default : object
        None where the engine finds its own.
    check : callable
    """

    description: str
    default: Any
    check: Check

    def checked(self, name: str, value: Any) -> Any:
        """The value, or the default for None.

        Raises
        ------
        InputError
            If the value is not allowed.
        """
        if value is None:
            return self.default
        allowed = self.check(value)
        if allowed:
            raise InputError(f"{name}: found {value!r}, allowed: {allowed}")
        return value


def whole_number(least: int, most: int | None = None) -> Check:
    """Whole numbers from ``least`` to ``most``.

    Examples
    --------
    >>> whole_number(1, 10)(11), whole_number(1)(3)
    ('a whole number from 1 to 10', '')
    """
    span = f"of at least {least}" if most is None else f"from {least} to {most}"

    def check(value: Any) -> str:
        whole = isinstance(value, int) and not isinstance(value, bool)
        return "" if whole and least <= value <= (value if most is None else most) else f"a whole number {span}"

    return check


def word_of(*words: str) -> Check:
    """One of some words."""
    return lambda value: "" if value in words else " or ".join(words)


def _truth(value: Any) -> str:
    return "" if isinstance(value, bool) else "true or false"


MODES = Option("flux modes of a contact", None, whole_number(1, 10))
ANGLE_CURVE = Option(
    "reduced: many half-angles of one packing together, full: each alone", "reduced", word_of("reduced", "full")
)
MATERIAL_CURVE = Option(
    "reduced: many temperatures, pressures and conductivities of one packing together, full: each alone",
    "reduced",
    word_of("reduced", "full"),
)
DIPOLES = Option("dipole states in a transient, for earlier times", False, _truth)
BOUNDARY = Option("periodic or walls; as the box by default", None, word_of("periodic", "walls"))
GREEN = Option("Green operator", "rotated", word_of("rotated", "continuous"))
FRAME = Option(
    "degrees of the temperature on edges and facets of the cells of spheres; 1/1 by default, 3/3 in a better conductor",
    None,
    word_of("1/1", "2/1", "3/1", "3/2", "3/3"),
)
DEGREE = Option("polynomial degree of the temperature on the edges of the cells of disks", 3, whole_number(1, 5))
ERROR_ESTIMATE = Option("whether the discretization error is estimated, by finer computations", False, _truth)
BOUNDS = Option("whether rigorous bounds are computed, by a conforming mesh of few disks", False, _truth)
DISTRIBUTED = Option("whether all ranks solve each packing together, of packings in files", False, _truth)
