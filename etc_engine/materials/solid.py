"""The record of a solid, from the catalogue or from a table of the user."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from etc_engine.errors import InputError
from etc_engine.materials.properties import Property, table

W_MK = "W/(m K)"


@dataclass(frozen=True)
class Solid:
    """Properties of a solid and their sources.

    Parameters
    ----------
    name : str
        The key under which it is looked up.
    title : str
        Name in print.
    conductivity : Property
        Thermal conductivity [W/(m K)].
    youngs_modulus : Property, optional
        [Pa].
    poisson_ratio : Property, optional
        [-].
    emissivity : Property, optional
        Total hemispherical emissivity [-].
    atomic_mass : float, optional
        Mean molar mass of its atoms [kg/mol], for the accommodation of a gas.
    """

    name: str
    title: str
    conductivity: Property
    youngs_modulus: Property | None = None
    poisson_ratio: Property | None = None
    emissivity: Property | None = None
    atomic_mass: float | None = None

    @property
    def properties(self) -> tuple[Property, ...]:
        """The properties that are known, conductivity first."""
        known = (self.conductivity, self.youngs_modulus, self.poisson_ratio, self.emissivity)
        return tuple(item for item in known if item is not None)


def solid_from_table(name: str, columns: Mapping[str, Any]) -> Solid:
    """Solid of the user's own table.

    Parameters
    ----------
    name : str
        What the user calls it.
    columns : mapping
        ``temperature`` [K] and ``conductivity`` [W/(m K)], lists of one length; optionally ``youngs_modulus``
        [Pa], ``poisson_ratio``, ``emissivity`` (lists of that length, or one number) and ``source``.

    Raises
    ------
    InputError
        For an unknown or missing column, lists of different length, values that are not positive.

    Examples
    --------
    >>> solid = solid_from_table("mine", {"temperature": [300, 500], "conductivity": [2.0, 1.0]})
    >>> float(solid.conductivity.at(400.0)), solid.conductivity.source
    (1.5, "user's table")
    """
    optional = {"youngs_modulus": "Pa", "poisson_ratio": "-", "emissivity": "-"}
    known = {"temperature", "conductivity", "source", *optional}
    unknown = sorted(set(columns) - known)
    if unknown:
        raise InputError(f"a table of {name} has no column {unknown[0]!r}; its columns are {', '.join(sorted(known))}")
    for key in ("temperature", "conductivity"):
        if key not in columns:
            raise InputError(f"the table of {name} needs a column {key!r}")
    source = str(columns.get("source", "user's table"))
    temperatures = _numbers(name, "temperature", columns["temperature"], None)
    properties = {}
    for key, unit in {"conductivity": W_MK, **optional}.items():
        if key in columns:
            values = _numbers(name, key, columns[key], len(temperatures))
            properties[key] = table(temperatures, values, f"{key.replace('_', ' ')} of {name}", unit, source)
    return Solid(
        name,
        name,
        properties["conductivity"],
        youngs_modulus=properties.get("youngs_modulus"),
        poisson_ratio=properties.get("poisson_ratio"),
        emissivity=properties.get("emissivity"),
    )


def _numbers(name: str, column: str, given: Any, length: int | None) -> Sequence[float]:
    values = list(given) if isinstance(given, Sequence) and not isinstance(given, str) else [given]
    if length is not None and len(values) == 1:
        values = values * length
    for value in values:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InputError(f"column {column!r} of the table of {name} must hold numbers, found {value!r}")
        if not value > 0.0:
            raise InputError(f"column {column!r} of the table of {name} must be positive, found {value:g}")
    return [float(value) for value in values]
