"""The physical values of a study file that may be a list: one row each, and a row is all that a new one takes.

A list becomes a dimension of the result, named as its row, in the order of the rows. Work is shared: what does not
change the packing uses one packing, what does not change the contacts uses one contact network.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

import numpy as np
from pydantic import AfterValidator, Field, Tag, create_model

from etc_engine.study.schema import (
    AS_LIST,
    AS_NUMBER,
    NOT_NEGATIVE,
    POSITIVE,
    WRITTEN,
    NotNegative,
    Positive,
    StudyTable,
    without_repeats,
)

Angle = Annotated[float, Field(strict=True, ge=1e-6, lt=90.0, allow_inf_nan=False)]
Share = Annotated[float, Field(strict=True, ge=0.0, le=1.0)]
SHARE = "a number from 0 to 1"
Accommodation = Annotated[float, Field(strict=True, gt=0.0, le=1.0)]
Poisson = Annotated[float, Field(strict=True, gt=-1.0, le=0.5)]
POISSON = "a number above -1, up to 0.5"
T = TypeVar("T", bound="QuantityTable")


@dataclass(frozen=True)
class Quantity:
    """A physical value of a study file.

    Parameters
    ----------
    place : str
        Table and key, such as ``contacts.contact_angle``.
    units : str
        Of the dimension, in the spelling of CF.
    long_name, comment : str
        Of the dimension.
    changes : str
        What has to be made again for another value: the packing, the contacts, or the medium alone.
    check : type
        What a value has to be, for pydantic; ``allowed`` says it in words.
    name : str
        Of the dimension, if it is not the key.
    default : float, optional
        None where the study need not give a value.
    si : float
        Factor from the unit of the study file to that of the engine.
    plane : str
        Units of disks, per unit thickness, where they are others than those of spheres.
    """

    place: str
    units: str
    long_name: str
    changes: Literal["packing", "contacts", "medium"]
    check: Any
    allowed: str
    name: str = ""
    default: float | None = None
    comment: str = ""
    si: float = 1.0
    plane: str = ""

    @property
    def table(self) -> str:
        """The table that holds the key."""
        return self.place.rpartition(".")[0]

    @property
    def key(self) -> str:
        """The key in its table."""
        return self.place.rpartition(".")[2]

    def attributes(self, dimension: int) -> dict[str, str]:
        """Attributes of the dimension in a result of disks (2) or spheres (3)."""
        units = self.plane if self.plane and dimension == 2 else self.units
        found = {"long_name": self.long_name, "units": units, "comment": self.comment}
        return {key: value for key, value in found.items() if value}

    def field(self) -> tuple[Any, Any]:
        """Annotation and default of the key, for pydantic: a value, or a list of different ones, put in order."""
        check: Any = self.check
        several: Any = Annotated[tuple[check, ...], AfterValidator(_ascending), Field(min_length=1)]
        one_or_several: Any = Annotated[Annotated[check, Tag(AS_NUMBER)] | Annotated[several, Tag(AS_LIST)], WRITTEN]
        plane = f", of disks {readable(self.plane)}" if self.plane else ""
        units = "" if self.units == "1" else f" [{readable(self.units)}{plane}]"
        described = f"{self.allowed}{units}, or a list of different ones"
        required = self.default is None and self.table.count(".") > 0  # a table in a table says all of it
        return (
            one_or_several if required else one_or_several | None,
            Field(... if required else self.default, description=described, title=self.long_name),
        )


def _ascending(values: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(sorted(without_repeats(values)))


QUANTITIES: Mapping[str, Quantity] = {
    row.name or row.key: row
    for row in (
        Quantity("packing.density", "1", "density", "packing", Positive, POSITIVE),
        Quantity(
            "contacts.contact_angle",
            "degree",
            "contact half-angle",
            "contacts",
            Angle,
            "a half-angle from 1e-6 to 90 degrees, 90 excluded",
            comment="half of the angle that the contact subtends at the centre of a particle; not a wetting angle",
            si=float(np.pi / 180.0),
        ),
        Quantity("contacts.contact_radius", "m", "contact radius", "contacts", Positive, POSITIVE),
        Quantity(
            "contacts.bond_gap",
            "1",
            "largest bonded gap over the mean radius of the pair",
            "contacts",
            NotNegative,
            NOT_NEGATIVE,
            default=1e-6,
        ),
        Quantity("contacts.coordination", "1", "mean coordination number", "contacts", Positive, POSITIVE),
        Quantity(
            "contacts.contact_resistance",
            "K W-1",
            "thermal resistance of a contact",
            "contacts",
            NotNegative,
            NOT_NEGATIVE,
            default=0.0,
            plane="m K W-1",
        ),
        Quantity(
            "contacts.area_resistance",
            "m2 K W-1",
            "thermal resistance of a unit of contact area",
            "contacts",
            NotNegative,
            NOT_NEGATIVE,
        ),
        Quantity(
            "contacts.youngs_modulus",
            "Pa",
            "Young's modulus of the particles",
            "contacts",
            Positive,
            POSITIVE,
        ),
        Quantity("contacts.poisson_ratio", "1", "Poisson's ratio of the particles", "contacts", Poisson, POISSON),
        Quantity("contacts.wall_youngs_modulus", "Pa", "Young's modulus of the walls", "contacts", Positive, POSITIVE),
        Quantity("contacts.wall_poisson_ratio", "1", "Poisson's ratio of the walls", "contacts", Poisson, POISSON),
        Quantity(
            "contacts.simulated_modulus",
            "Pa",
            "Young's modulus of the run that made the overlaps",
            "contacts",
            Positive,
            POSITIVE,
        ),
        Quantity("contacts.load", "Pa", "mean stress that the contacts carry", "contacts", Positive, POSITIVE),
        Quantity(
            "contacts.roughness.height",
            "m",
            "rms roughness height, of both surfaces together",
            "medium",
            Positive,
            POSITIVE,
            name="roughness_height",
        ),
        Quantity(
            "contacts.roughness.slope",
            "1",
            "rms roughness slope, of both surfaces together",
            "medium",
            Positive,
            POSITIVE,
            name="roughness_slope",
        ),
        Quantity(
            "contacts.roughness.hardness",
            "Pa",
            "micro-hardness of the softer surface",
            "medium",
            Positive,
            POSITIVE,
            name="roughness_hardness",
        ),
        Quantity(
            "particles.conductivity",
            "W m-1 K-1",
            "conductivity of the particles",
            "medium",
            Positive,
            POSITIVE,
            name="particle_conductivity",
            default=1.0,
        ),
        Quantity(
            "particles.mixture.conductivity",
            "W m-1 K-1",
            "conductivity of the second material of the particles",
            "medium",
            Positive,
            POSITIVE,
            name="mixture_conductivity",
        ),
        Quantity(
            "particles.mixture.fraction",
            "1",
            "number fraction of the particles of the second material",
            "medium",
            Share,
            SHARE,
            name="mixture_fraction",
        ),
        Quantity(
            "pores.conductivity",
            "W m-1 K-1",
            "conductivity of what fills the pores",
            "medium",
            NotNegative,
            NOT_NEGATIVE,
            name="pore_conductivity",
            default=0.0,
        ),
        Quantity("pores.pressure", "Pa", "pressure of the gas", "medium", NotNegative, NOT_NEGATIVE),
        Quantity(
            "pores.accommodation",
            "1",
            "thermal accommodation coefficient of the surfaces",
            "medium",
            Accommodation,
            "a number above 0, up to 1",
        ),
        Quantity("radiation.emissivity", "1", "emissivity of the particles", "medium", Share, SHARE),
        Quantity("conduction.temperature", "K", "temperature", "medium", Positive, POSITIVE),
        Quantity(
            "conduction.temperature_difference",
            "K",
            "temperature difference of the two walls",
            "medium",
            Positive,
            POSITIVE,
            comment="the wall at the low end of an axis is warmer than the temperature by half of it, the other colder",
        ),
    )
}
"""The rows by the names of their dimensions, in the order of the dimensions of a result."""

SWEPT = (*QUANTITIES, "method")
"""The dimensions of the cells of a sweep, in order; `density` is always there, another where the study has a list."""


class QuantityTable(StudyTable):
    """A table to which `with_quantities` adds its rows."""

    if TYPE_CHECKING:

        def __getattr__(self, key: str) -> Any:
            """The value of a key that a row adds."""


def with_quantities(table: str) -> Callable[[type[T]], type[T]]:
    """Add the rows of a table to the class that reads it.

    Examples
    --------
    >>> @with_quantities("pores")
    ... class Pores(QuantityTable):
    ...     pass
    >>> Pores.model_validate({"conductivity": [0.04, 0.02]}).conductivity
    (0.02, 0.04)
    """

    def extended(cls: type[T]) -> type[T]:
        fields: dict[str, Any] = {row.key: row.field() for row in QUANTITIES.values() if row.table == table}
        return create_model(cls.__name__, __base__=cls, __module__=cls.__module__, __doc__=cls.__doc__, **fields)

    return extended


def value_of(study: StudyTable, row: Quantity) -> float | tuple[float, ...] | None:
    """What a study says of a quantity: a value, several, or None where it says nothing."""
    found: Any = study
    for key in row.place.split("."):
        found = getattr(found, key, None)
    given: float | tuple[float, ...] | None = found
    return given


def word_of(name: str, value: Any) -> str:
    """A value of a dimension in words, for titles and legends.

    Examples
    --------
    >>> word_of("contact_angle", 2.5), word_of("pore_conductivity", 0.04), word_of("method", "chord")
    ('2.5°', 'pore conductivity 0.04', 'chord')
    """
    if name not in QUANTITIES:
        return str(value)
    if QUANTITIES[name].units == "degree":
        return f"{value:.4g}°"
    return f"{name.replace('_', ' ')} {value:.4g}"


def heading_of(name: str, attributes: Mapping[str, str]) -> str:
    """The heading of a column or an axis that holds a dimension with these attributes.

    Examples
    --------
    >>> heading_of("contact_resistance", QUANTITIES["contact_resistance"].attributes(2))
    'thermal resistance of a contact [m K/W]'
    >>> heading_of("density", QUANTITIES["density"].attributes(2)), heading_of("method", {})
    ('density', 'method')
    """
    units = attributes.get("units", "1")
    return attributes.get("long_name", name) + ("" if units == "1" else f" [{readable(units)}]")


def readable(units: str) -> str:
    """Units as they are written for readers.

    Examples
    --------
    >>> readable("W m-1 K-1"), readable("m K W-1"), readable("Pa")
    ('W/(m K)', 'm K/W', 'Pa')
    """
    above = [word for word in units.split() if "-" not in word]
    below = [word.replace("-1", "").replace("-", "") for word in units.split() if "-" in word]
    if not below:
        return units
    under = below[0] if len(below) == 1 else f"({' '.join(below)})"
    return f"{' '.join(above) or '1'}/{under}"
