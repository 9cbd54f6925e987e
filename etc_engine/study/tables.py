"""The tables of a study file: the words, what they allow, and what they exclude."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from etc_engine.box import parse_periodic
from etc_engine.errors import InputError
from etc_engine.models.catalogue import find_model
from etc_engine.packing import METHODS as PACKING_METHODS
from etc_engine.packing import RadiusDistribution, parse_radii
from etc_engine.realization import ENGINES
from etc_engine.study.schema import StudyTable, Word

DEFAULT_CAP = 10
"""Without ``max_realizations`` an adaptive sweep stops at this many times ``realizations``."""


def _as_tuple(value: object) -> object:
    """One value stands for a list of one."""
    return tuple(value) if isinstance(value, list | tuple) else (value,)


def _without_repeats(values: tuple[Any, ...]) -> tuple[Any, ...]:
    repeated = [value for value in dict.fromkeys(values) if values.count(value) > 1]
    if repeated:
        raise ValueError(f"{repeated[0]!r} is listed twice, each value may stand once")
    return values


def _ascending(values: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(sorted(_without_repeats(values)))


def _known_engine(word: str) -> str:
    if word not in ENGINES:
        raise ValueError(f"found {word!r}, allowed: {', '.join(ENGINES)}")
    return word


# squares and products of what a study says must stay finite
Positive = Annotated[float, Field(strict=True, ge=1e-100, le=1e100)]
Count = Annotated[int, Field(strict=True, ge=1, le=10**9)]
Angle = Annotated[float, Field(strict=True, gt=0.0, lt=90.0, allow_inf_nan=False)]
Fraction = Annotated[float, Field(strict=True, gt=0.0, lt=1.0)]


class PackingTable(StudyTable):
    """``[packing]``: the words of the command ``pack``."""

    method: Literal["advancing-front", "lubachevsky-stillinger", "random-sequential"] = Field(
        default="advancing-front", description="advancing-front, lubachevsky-stillinger or random-sequential"
    )
    radii: Word = Field(description="a size distribution such as 'uniform:0.01:0.02'")
    box: Annotated[tuple[Positive, ...], Field(min_length=2, max_length=3)] = Field(
        description="two or three positive edge lengths"
    )
    periodic: Word = Field(default="", description="a combination of the letters of the axes, such as '', 'x', 'xy'")
    density: (
        Annotated[tuple[Positive, ...], BeforeValidator(_as_tuple), AfterValidator(_ascending), Field(min_length=1)]
        | None
    ) = Field(default=None, description="a positive number or a list of different ones")
    count: Count | None = Field(default=None, description="a whole number of at least 1")
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
        if self.method not in PACKING_METHODS:
            raise ValueError(f"method {self.method!r} is not available, allowed: {', '.join(PACKING_METHODS)}")
        if self.method == "advancing-front" and self.count is not None:
            raise ValueError("count has no meaning with method = 'advancing-front', which fills the box")
        if self.method == "advancing-front" and self.periodic:
            raise ValueError(
                f"periodic: found {self.periodic!r}, 'advancing-front' fills a walled box; a periodic one takes "
                "method = 'lubachevsky-stillinger'"
            )
        if self.method == "advancing-front" and radii.scalable:
            raise ValueError(f"radii: found {self.radii!r}, 'advancing-front' needs a radius, such as 'equal:0.01'")
        if self.growth_rate is not None and self.method != "lubachevsky-stillinger":
            raise ValueError(f"growth_rate has no meaning with method = {self.method!r}, take it out")
        return self


class ContactsTable(StudyTable):
    """``[contacts]``: which pairs conduct, and through how wide an arc."""

    rule: Literal["overlap", "bonded", "coordination"] = Field(
        default="overlap", description="overlap, bonded or coordination"
    )
    contact_angle: (
        Annotated[tuple[Angle, ...], BeforeValidator(_as_tuple), AfterValidator(_ascending), Field(min_length=1)] | None
    ) = Field(default=None, description="a half-angle between 0 and 90 degrees (both excluded) or a list of them")
    bond_gap: Annotated[float, Field(strict=True, ge=0.0, allow_inf_nan=False)] = Field(
        default=1e-6, description="a number of at least 0, times the mean radius of the pair"
    )
    coordination: Positive | None = Field(
        default=None, description="a positive mean coordination number, with rule = 'coordination' only"
    )

    @model_validator(mode="after")
    def _check(self) -> ContactsTable:
        if self.rule == "overlap" and self.contact_angle is not None:
            raise ValueError("contact_angle has no meaning with rule = 'overlap': take it out, or set rule = 'bonded'")
        if self.rule != "overlap" and self.contact_angle is None:
            raise ValueError(f"rule = {self.rule!r} needs contact_angle, a list of half-angles in degrees")
        if (self.rule == "coordination") != (self.coordination is not None):
            raise ValueError("coordination, the mean number wanted, goes with rule = 'coordination' and only with it")
        return self


class MixtureTable(StudyTable):
    """``mixture`` of ``[conduction]``: a second material for part of the particles."""

    conductivity: Positive = Field(description="a positive number [W/(m K)]")
    fraction: Annotated[float, Field(strict=True, ge=0.0, le=1.0)] = Field(description="a number from 0 to 1")


class ConductionTable(StudyTable):
    """``[conduction]``: how the heat conduction is solved."""

    engine: Annotated[Word, AfterValidator(_known_engine)] = Field(default="dtem", description="the word of an engine")
    method: Word | Annotated[tuple[Word, ...], AfterValidator(_without_repeats), Field(min_length=1)] = Field(
        default="", description="a method of the engine, or a list of different ones"
    )
    conductivity: Positive = Field(default=1.0, description="a positive number [W/(m K)]")
    contact_resistance: Annotated[float, Field(strict=True, ge=0.0, allow_inf_nan=False)] = Field(
        default=0.0, description="a number of at least 0 [m K/W]"
    )
    mixture: MixtureTable | None = Field(
        default=None, description="a table such as { conductivity = 10.0, fraction = 0.3 }"
    )
    tolerance: Annotated[float, Field(strict=True, gt=0.0, lt=1.0)] = Field(
        default=1e-10, description="a relative error of the conductivity, between 0 and 1"
    )
    angle_curve: Literal["reduced", "full"] = Field(default="reduced", description="reduced or full")

    @property
    def methods(self) -> tuple[str, ...]:
        """The methods as a list, one or many."""
        return (self.method,) if isinstance(self.method, str) else self.method

    @model_validator(mode="before")
    @classmethod
    def _default_method(cls, values: Any) -> Any:
        if not isinstance(values, dict) or "method" in values or values.get("engine", "dtem") not in ENGINES:
            return values
        return {**values, "method": next(iter(ENGINES[values.get("engine", "dtem")].methods))}

    @model_validator(mode="after")
    def _check(self) -> ConductionTable:
        allowed = tuple(ENGINES[self.engine].methods)
        for method in self.methods:
            if method not in allowed:
                raise ValueError(f"method: found {method!r}, allowed with {self.engine}: {', '.join(allowed)}")
        return self


class CompositeTable(StudyTable):
    """``[composite]``: the matrix that holds the particles, with the engines that solve the whole medium."""

    matrix_conductivity: Positive = Field(default=1.0, description="a positive number [W/(m K)]")
    contrast: (
        Annotated[tuple[Positive, ...], BeforeValidator(_as_tuple), AfterValidator(_ascending), Field(min_length=1)]
        | None
    ) = Field(
        default=None,
        description="conductivity of the particles over that of the matrix, a positive number or a list of them",
    )
    resolution: Annotated[int, Field(strict=True, ge=4, le=10**5)] = Field(
        default=64, description="a whole number of at least 4: voxels along the shortest edge of the box"
    )
    nodes: Annotated[int, Field(strict=True, ge=100, le=10**8)] = Field(
        default=10_000, description="a whole number of at least 100: particles of the lattice"
    )


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
            raise ValueError("max_realizations goes with relative_ci, which is missing")
        if self.relative_ci is not None and self.realizations < 2:
            raise ValueError("realizations = 1 shows no spread: with relative_ci at least 2 are needed")
        if self.cap < self.realizations:
            raise ValueError(f"max_realizations = {self.cap} is below realizations = {self.realizations}")
        return self


class ModelsTable(StudyTable):
    """``[models]``: closed-form models to compare the result with."""

    names: Annotated[tuple[Word, ...], AfterValidator(_without_repeats)] = Field(
        default=(), description="a list of names that the command `models` prints"
    )
    pore_conductivity: Annotated[float, Field(strict=True, ge=0.0, allow_inf_nan=False)] = Field(
        default=0.0, description="a number of at least 0 [W/(m K)]"
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
