"""The tables of a study file: keys, allowed values, and keys that exclude each other.

The physical values of a table come from `etc_engine.study.quantities`, one row each.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, WithJsonSchema, create_model, model_validator

from etc_engine.box import Box, parse_periodic
from etc_engine.errors import InputError
from etc_engine.materials import find_solid
from etc_engine.medium.rules import RULES
from etc_engine.models.catalogue import find_model
from etc_engine.packing import PackingSpec, RadiusDistribution, parse_radii
from etc_engine.realization import ENGINES
from etc_engine.realization.options import Option
from etc_engine.study.meaning import OPTIONS
from etc_engine.study.quantities import QUANTITIES, QuantityTable, T, with_quantities
from etc_engine.study.schema import Flag, Positive, StudyTable, Word, without_repeats

DEFAULT_CAP = 10
"""Without ``max_realizations`` an adaptive sweep stops at this many times ``realizations``."""


def _known_engine(word: str) -> str:
    if word not in ENGINES:
        raise ValueError(f"found {word!r}, allowed: {', '.join(ENGINES)}")
    return word


def _known_rule(word: str) -> str:
    if word not in RULES:
        raise ValueError(f"found {word!r}, allowed: {', '.join(RULES)}")
    return word


def _known_solid(found: str | dict[str, Any]) -> str | dict[str, Any]:
    try:
        solid = find_solid(found)
        return solid.name if isinstance(found, str) else found
    except InputError as error:
        raise ValueError(str(error)) from None


def unknown_method(engine: str, method: str, allowed: Iterable[str]) -> str:
    """The reason why a method is refused."""
    cure = f"; write engine = {method!r}" if method in ENGINES else ""
    return f"method: found {method!r}, allowed with {engine}: {', '.join(allowed)}{cure}"


def with_options(cls: type[T]) -> type[T]:
    """Add the options of all engines to the class that reads ``[conduction]``."""
    fields: dict[str, Any] = {name: _field_of(option) for name, option in OPTIONS.items()}
    return create_model(cls.__name__, __base__=cls, __module__=cls.__module__, __doc__=cls.__doc__, **fields)


def _field_of(option: Option) -> tuple[Any, Any]:
    def checked(value: Any) -> Any:
        allowed = "" if value is None else option.check(value)
        if allowed:
            raise ValueError(f"found {value!r}, allowed: {allowed}")
        return value

    kind = {bool: "boolean", int: "integer", str: "string"}.get(type(option.default))
    schema = WithJsonSchema({"type": kind} if kind else {})
    return Annotated[Any, AfterValidator(checked), schema], Field(
        default=option.default, description=option.description
    )


Count = Annotated[int, Field(strict=True, ge=1, le=10**9)]
Fraction = Annotated[float, Field(strict=True, gt=0.0, lt=1.0)]
Engine = Annotated[Word, AfterValidator(_known_engine)]
Material = Annotated[Word | dict[Word, Any], AfterValidator(_known_solid), WithJsonSchema({"type": "string"})]
A_MATERIAL = (
    "a solid by the name that the command `materials` prints, or a table such as "
    "{ temperature = [300, 900], conductivity = [2.0, 1.5] }"
)
Gas = Annotated[Word | dict[Word, Positive], WithJsonSchema({"type": "string"})]
A_GAS = "a gas by name, such as 'helium', or a table of mole fractions"


@with_quantities("packing")
class PackingTable(QuantityTable):
    """``[packing]``: the words of the command ``pack``."""

    method: Literal["advancing-front", "lubachevsky-stillinger", "random-sequential"] = Field(
        default="advancing-front", description="advancing-front, lubachevsky-stillinger or random-sequential"
    )
    radii: Word = Field(description="a size distribution such as 'uniform:0.01:0.02' [m]")
    box: Annotated[tuple[Positive, ...], Field(min_length=2, max_length=3)] = Field(
        description="two or three positive edge lengths [m]"
    )
    periodic: Word = Field(default="", description="a combination of the letters of the axes, such as '', 'x', 'xy'")
    count: Count | None = Field(default=None, description="a whole number of at least 1, of particles")
    growth_rate: Positive | None = Field(
        default=None, description="a positive number, with method = 'lubachevsky-stillinger' only"
    )

    @model_validator(mode="after")
    def _check(self) -> PackingTable:
        try:
            parse_periodic(self.periodic, len(self.box))
        except InputError as error:
            raise ValueError(f"periodic: {error}") from None
        radii = distribution(self.radii)
        if self.method == "advancing-front" and self.count is not None:
            raise ValueError("count has no effect with method = 'advancing-front', which fills the box")
        if self.method == "advancing-front" and self.periodic:
            raise ValueError(
                f"periodic: found {self.periodic!r}, 'advancing-front' fills a walled box; a periodic one takes "
                "method = 'lubachevsky-stillinger'"
            )
        if self.method == "advancing-front" and radii.scalable:
            raise ValueError(f"radii: found {self.radii!r}, 'advancing-front' needs a radius, such as 'equal:0.01'")
        if self.growth_rate is not None and self.method != "lubachevsky-stillinger":
            raise ValueError(f"growth_rate has no effect with method = {self.method!r}: remove it")
        return self

    def spec(self, density: float | None, *, radius_growth: bool) -> PackingSpec:
        """What the packer needs; ``radius_growth`` where disks may overlap to reach a density."""
        return PackingSpec(
            method=self.method,
            radii=distribution(self.radii),
            box=Box(self.box, parse_periodic(self.periodic, len(self.box))),
            count=self.count,
            density=density,
            growth_rate=self.growth_rate,
            radius_growth=radius_growth,
        )


@with_quantities("contacts.roughness")
class RoughnessTable(QuantityTable):
    """``roughness`` of ``[contacts]``: rough surfaces, which conduct through asperities."""


@with_quantities("contacts")
class ContactsTable(QuantityTable):
    """``[contacts]``: which pairs conduct, and how well."""

    rule: Annotated[Word, AfterValidator(_known_rule)] = Field(
        default="overlap", description="the word of a contact rule", json_schema_extra={"enum": list(RULES)}
    )
    roughness: RoughnessTable | None = Field(
        default=None, description="a table such as { height = 1e-6, slope = 0.1, hardness = 4e9 }"
    )

    @model_validator(mode="after")
    def _check(self) -> ContactsTable:
        if self.roughness is not None and getattr(self, "area_resistance", None) is not None:
            raise ValueError("area_resistance and roughness are both a resistance of the contact area, take one out")
        needs = dict.fromkeys(RULES[self.rule].needs, f"rule = {self.rule!r}")
        for choice in ("simulated_modulus", "roughness"):
            if getattr(self, choice) is not None:
                needs |= dict.fromkeys(("youngs_modulus", "poisson_ratio"), choice)
        for key, choice in needs.items():
            if getattr(self, key) is None:
                raise ValueError(f"{choice} needs {key}, {QUANTITIES[key].allowed}")
        return self

    def values(self) -> dict[str, float]:
        """The quantities of a study with one value each, in SI units."""
        rows = [row for row in QUANTITIES.values() if row.table == "contacts"]
        given = {row.key: (getattr(self, row.key), row.si) for row in rows}
        return {key: value * si for key, (value, si) in given.items() if value is not None}


@with_quantities("particles.mixture")
class MixtureTable(QuantityTable):
    """``mixture`` of ``[particles]``: a second material for part of the particles."""


@with_quantities("particles")
class ParticlesTable(QuantityTable):
    """``[particles]``: what they are made of."""

    material: Material | None = Field(default=None, description=A_MATERIAL)
    mixture: MixtureTable | None = Field(
        default=None, description="a table such as { conductivity = 10.0, fraction = 0.3 }"
    )


@with_quantities("pores")
class PoresTable(QuantityTable):
    """``[pores]``: what fills them."""

    gas: Gas | None = Field(default=None, description=A_GAS)


@with_quantities("radiation")
class RadiationTable(QuantityTable):
    """``[radiation]``: between the surfaces of the particles."""


@with_options
@with_quantities("conduction")
class ConductionTable(QuantityTable):
    """``[conduction]``: how the heat conduction is solved."""

    engine: Engine = Field(
        default="dtem", description="the word of an engine", json_schema_extra={"enum": list(ENGINES)}
    )
    method: Word | Annotated[tuple[Word, ...], AfterValidator(without_repeats), Field(min_length=1)] | None = Field(
        default=None, description="a method of the engine, or a list of different ones; the first that fits by default"
    )
    tolerance: Annotated[float, Field(strict=True, gt=0.0, lt=1.0)] = Field(
        default=1e-10, description="a relative error of the conductivity, between 0 and 1"
    )

    nonlinear: Flag = Field(
        default=False,
        description="true or false: whether solid, gas and radiation follow the local temperature between two walls",
    )

    @model_validator(mode="after")
    def _check(self) -> ConductionTable:
        allowed = ENGINES[self.engine].methods
        for method in (self.method,) if isinstance(self.method, str) else self.method or ():
            if method not in allowed:
                raise ValueError(unknown_method(self.engine, method, allowed))
        return self


class StatisticsTable(StudyTable):
    """``[statistics]``: how many realizations, and how sure the mean has to be."""

    realizations: Count = Field(description="a whole number of at least 1")
    confidence: Fraction = Field(default=0.95, description="a number between 0 and 1")
    relative_ci: Fraction | None = Field(default=None, description="a number between 0 and 1")
    max_realizations: Count | None = Field(default=None, description="a whole number of at least 1")

    @property
    def cap(self) -> int:
        """The largest number of realizations a cell may get: the length of the dimension."""
        if self.relative_ci is None:
            return self.realizations
        return self.max_realizations or DEFAULT_CAP * self.realizations

    @model_validator(mode="after")
    def _check(self) -> StatisticsTable:
        if self.relative_ci is None and self.max_realizations is not None:
            raise ValueError("max_realizations is only valid with relative_ci, which is missing")
        if self.relative_ci is not None and self.realizations < 2:
            raise ValueError("realizations = 1 shows no spread: with relative_ci at least 2 are needed")
        if self.cap < self.realizations:
            raise ValueError(f"max_realizations = {self.cap} is below realizations = {self.realizations}")
        return self


class ModelsTable(StudyTable):
    """``[models]``: closed-form models to compare the result with."""

    names: Annotated[tuple[Word, ...], AfterValidator(without_repeats)] = Field(
        default=(), description="a list of names that the command `models` prints"
    )

    @model_validator(mode="after")
    def _check(self) -> ModelsTable:
        for name in self.names:
            try:
                find_model(name)
            except InputError as error:
                raise ValueError(f"names: {error}") from None
        return self


def distribution(text: str) -> RadiusDistribution:
    """The radius distribution of a word, with the key in its error."""
    try:
        return parse_radii(text)
    except InputError as error:
        raise ValueError(f"radii: {error}") from None
