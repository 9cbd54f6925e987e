"""The study file: what a sweep is made of, read from TOML and checked before anything runs."""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)
from pydantic_core import ErrorDetails

from etc_engine.box import Box, parse_periodic
from etc_engine.errors import InputError, StudyError
from etc_engine.models.catalogue import find_model
from etc_engine.packing import METHODS as PACKING_METHODS
from etc_engine.packing import PackingSpec, RadiusDistribution, parse_radii
from etc_engine.realization import ENGINES, ConductionSpec, ContactSpec, Mixture, RealizationSpec

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


Positive = Annotated[float, Field(strict=True, gt=0.0, allow_inf_nan=False)]
Count = Annotated[int, Field(strict=True, ge=1, le=10**9)]
Angle = Annotated[float, Field(strict=True, gt=0.0, lt=90.0, allow_inf_nan=False)]
Fraction = Annotated[float, Field(strict=True, gt=0.0, lt=1.0)]
Word = Annotated[str, Field(strict=True)]


class _Table(BaseModel):
    """A table of the study file. The description of a field says what is allowed, for the error line."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class PackingTable(_Table):
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
        radii = _parse_radii(self.radii)
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


class ContactsTable(_Table):
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


class MixtureTable(_Table):
    """``mixture`` of ``[conduction]``: a second material for part of the particles."""

    conductivity: Positive = Field(description="a positive number [W/(m K)]")
    fraction: Annotated[float, Field(strict=True, ge=0.0, le=1.0)] = Field(description="a number from 0 to 1")


class ConductionTable(_Table):
    """``[conduction]``: how the heat conduction is solved."""

    engine: Annotated[Word, AfterValidator(_known_engine)] = Field(default="dtem", description="the word of an engine")
    method: Word | Annotated[tuple[Word, ...], AfterValidator(_without_repeats), Field(min_length=1)] = Field(
        default="chord", description="a method of the engine, or a list of different ones"
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

    @model_validator(mode="after")
    def _check(self) -> ConductionTable:
        allowed = ENGINES[self.engine].methods
        for method in self.methods:
            if method not in allowed:
                raise ValueError(f"method: found {method!r}, allowed with {self.engine}: {', '.join(allowed)}")
        return self


class StatisticsTable(_Table):
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


class ModelsTable(_Table):
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


class Study(_Table):
    """A sweep: densities x contact angles x methods x realizations of one kind of packing."""

    schema_: Literal[1] = Field(alias="schema", description="1")
    name: Word = Field(description="a name")
    seed: Annotated[int, Field(strict=True, ge=0, lt=2**63)] = Field(description="a whole number from 0 to 2**63 - 1")
    packing: PackingTable = Field(description="a table")
    contacts: ContactsTable = Field(default_factory=ContactsTable, description="a table")
    conduction: ConductionTable = Field(default_factory=ConductionTable, description="a table")
    statistics: StatisticsTable = Field(description="a table")
    models: ModelsTable = Field(default_factory=ModelsTable, description="a table")

    @model_validator(mode="after")
    def _check(self) -> Study:
        if self.conduction.engine in ("dtem", "pipe") and len(self.packing.box) != 2:
            raise ValueError(f"packing.box: engine {self.conduction.engine!r} works in 2D, found {self.packing.box}")
        if self.contacts.rule == "bonded" and max(self.packing.density or (0.0,)) >= 1.0:
            raise ValueError(
                f"packing.density: found {max(self.packing.density or ())}, allowed below 1 "
                "with rule = 'bonded', whose disks do not overlap"
            )
        return self

    @property
    def densities(self) -> tuple[float | None, ...]:
        """The densities of the sweep; None alone stands for the packer's own."""
        return self.packing.density or (None,)

    @property
    def box(self) -> Box:
        """The box of every packing."""
        lengths = self.packing.box
        return Box(lengths, parse_periodic(self.packing.periodic, len(lengths)))

    def resolved(self) -> dict[str, Any]:
        """The study with all defaults written out, as plain JSON values."""
        return self.model_dump(mode="json", by_alias=True)

    def identity(self) -> dict[str, Any]:
        """What decides the numbers of the result: everything but the name and the models."""
        return {key: value for key, value in self.resolved().items() if key not in ("name", "models")}

    def digest(self) -> str:
        """SHA-256 of the identity: two studies with the same digest give the same bits."""
        return hashlib.sha256(json.dumps(self.identity(), sort_keys=True).encode()).hexdigest()

    def realization_spec(self, density: float | None) -> RealizationSpec:
        """The specification of one realization at a density of this study (None: the packer's own)."""
        packing, contacts, conduction = self.packing, self.contacts, self.conduction
        mixture = conduction.mixture
        return RealizationSpec(
            packing=PackingSpec(
                method=packing.method,
                radii=_parse_radii(packing.radii),
                box=self.box,
                count=packing.count,
                density=density,
                growth_rate=packing.growth_rate,
                radius_growth=contacts.rule == "overlap",
            ),
            contacts=ContactSpec(
                rule=contacts.rule,
                contact_angles=tuple(float(np.deg2rad(angle)) for angle in contacts.contact_angle or ()),
                bond_gap=contacts.bond_gap,
                coordination=contacts.coordination,
            ),
            conduction=ConductionSpec(
                engine=conduction.engine,
                methods=conduction.methods,
                conductivity=conduction.conductivity,
                contact_resistance=conduction.contact_resistance,
                mixture=None if mixture is None else Mixture(mixture.conductivity, mixture.fraction),
                tolerance=conduction.tolerance,
                angle_curve=conduction.angle_curve,
            ),
        )


def read_study(path: Path) -> tuple[Study, str]:
    """Read and check a study file; answers the study and its text.

    Raises
    ------
    StudyError
        If the file is missing, is not TOML, has unknown keys or values that are not allowed; the message is
        one line that names the file, the key, what was found and what is allowed.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise StudyError(f"study {path}: cannot be read ({error.strerror}), expected a TOML file") from None
    except UnicodeDecodeError:
        raise StudyError(f"study {path}: is not text in UTF-8, expected a TOML file") from None
    return parse_study(text, str(path)), text


def parse_study(text: str, source: str = "study") -> Study:
    """Check the text of a study file; ``source`` names it in errors.

    Examples
    --------
    >>> parse_study("[packing", "s.toml")
    Traceback (most recent call last):
    etc_engine.errors.StudyError: s.toml: is not valid TOML: ...
    """
    try:
        values = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise StudyError(f"{source}: is not valid TOML: {error}") from None
    try:
        return Study.model_validate(values)
    except ValidationError as error:
        raise StudyError(f"{source}: {_one_line(error)}") from None


def _parse_radii(text: str) -> RadiusDistribution:
    try:
        return parse_radii(text)
    except InputError as error:
        raise ValueError(f"radii: {error}") from None


def _one_line(error: ValidationError) -> str:
    """The first problem in words; unknown keys first, since they often explain a missing one."""
    details = sorted(error.errors(), key=lambda detail: detail["type"] != "extra_forbidden")
    places = {_field(detail["loc"])[0] for detail in details}
    more = f" (and {len(places) - 1} more problem{'s' * (len(places) > 2)})" if len(places) > 1 else ""
    return _describe(details[0]) + more


def _describe(detail: ErrorDetails) -> str:
    key, table, allowed = _field(detail["loc"])
    if detail["type"] == "extra_forbidden":
        names = [field.alias or name for name, field in table.model_fields.items()]
        near = get_close_matches(str(detail["loc"][-1]), names, 1)
        hint = f", did you mean {near[0]!r}?" if near else ","
        return f"{key}: unknown key{hint} allowed: {', '.join(names)}"
    if detail["type"] == "missing":
        return f"{key}: missing, expected {allowed}"
    if detail["type"] == "value_error":  # our own checks, which say it all
        reason = str(detail["ctx"]["error"])
        return f"{key}: {reason}" if key else reason
    return f"{key}: found {detail['input']!r}, allowed: {allowed}"


def _field(location: Sequence[int | str]) -> tuple[str, type[BaseModel], str]:
    """Name of the key at an error's location, the table it is in, and what the key allows."""
    table: type[BaseModel] = Study
    words: list[str] = []
    allowed = "a table"
    for step in location:
        field = next((f for n, f in table.model_fields.items() if step in (n, f.alias)), None)
        words.append(str(step))
        if field is None:  # an unknown key
            break
        allowed = field.description or allowed
        if not (isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel)):
            break
        table = field.annotation
    places = [f"[{step}]" for step in location[len(words) :] if isinstance(step, int)]
    return ".".join(words) + "".join(places), table, allowed
