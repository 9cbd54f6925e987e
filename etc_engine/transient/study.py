"""Transient study files of kind "network": the schema."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from etc_engine.batch.study_tables import ContactsTable, PackingTable
from etc_engine.errors import InputError, StudyError
from etc_engine.solvers.marching import SCHEMES
from etc_engine.transient.systems import SYSTEMS
from etc_engine.walls import Convective, FixedTemperature, HeatFlux, Insulated, TimeTable, WallCondition

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class History(_Table):
    """Values at increasing times, linear in between and constant outside."""

    times: list[Finite]
    values: list[Finite]

    @model_validator(mode="after")
    def _check(self) -> History:
        try:
            self.table()
        except InputError as error:
            raise ValueError(str(error)) from None
        return self

    def table(self) -> TimeTable:
        """As a value of a wall or a source."""
        return TimeTable(tuple(self.times), tuple(self.values))


Value = Finite | History


def plain(value: float | History) -> float | TimeTable:
    """A number or a table as `etc_engine.walls` takes it."""
    return value.table() if isinstance(value, History) else value


class Wall(_Table):
    """One wall of ``[walls]``: how it exchanges heat."""

    type: Literal["fixed", "flux", "convective", "insulated"]
    value: Value | None = Field(
        default=None, description="temperature [K], heat flux into the body [W/m2] or ambient temperature [K]"
    )
    coefficient: Positive | None = Field(default=None, description="heat transfer coefficient [W/(m2 K)]")

    @model_validator(mode="after")
    def _check(self) -> Wall:
        if (self.type == "convective") != (self.coefficient is not None):
            raise ValueError("a coefficient goes with type = 'convective', and only with it")
        if (self.type == "insulated") != (self.value is None):
            raise ValueError("a value goes with every type but 'insulated'")
        return self

    def condition(self) -> WallCondition:
        """The condition of this wall."""
        if self.value is None:
            return Insulated()
        if self.type == "fixed":
            return FixedTemperature(plain(self.value))
        if self.type == "flux":
            return HeatFlux(plain(self.value))
        assert self.coefficient is not None
        return Convective(self.coefficient, plain(self.value))


class WallsTable(_Table):
    """``[walls]``; a wall that is left out is insulated."""

    left: Wall | None = None
    right: Wall | None = None
    bottom: Wall | None = None
    top: Wall | None = None

    def conditions(self) -> dict[str, WallCondition]:
        """The conditions by wall."""
        given = {name: getattr(self, name) for name in WallsTable.model_fields}
        return {name: wall.condition() for name, wall in given.items() if wall is not None}


class Conduction(_Table):
    """``[conduction]``: the method and the contacts' material."""

    method: str = "pipe"
    pipe_resistance: Literal["chord", "uniform"] | None = None
    dipoles: bool = False
    conductivity: Positive | None = Field(default=None, description="of the particles [W/(m K)]; 1 by default")
    contact_resistance: Annotated[float, Field(ge=0.0, allow_inf_nan=False)] = 0.0

    @model_validator(mode="after")
    def _check(self) -> Conduction:
        if self.method not in SYSTEMS:
            raise ValueError(f"method: found {self.method!r}, allowed: {', '.join(SYSTEMS)}")
        if self.method != "pipe" and self.pipe_resistance is not None:
            raise ValueError("pipe_resistance goes with method = 'pipe'")
        if self.method == "pipe" and self.dipoles:
            raise ValueError("dipoles have no meaning with method = 'pipe': a particle has one temperature")
        return self


class Gradient(_Table):
    """A temperature that varies linearly: ``value`` at the origin, ``gradient`` [K/m]."""

    value: Finite
    gradient: tuple[Finite, Finite]


class Source(_Table):
    """One of ``[[source]]``: heat set free in each of some particles (all by default) [W/m]."""

    heat: Value
    particles: list[Annotated[int, Field(ge=0)]] | None = None


class Material(_Table):
    """``[material]``: storage and initial temperatures; a number, or one for each particle."""

    heat_capacity: Positive | list[Positive] = Field(description="rho c [J/(m3 K)]")
    initial: Finite | list[Finite] | Gradient = Field(description="[K]")


class Time(_Table):
    """``[time]``: scheme, steps and output times; times[0] is the start."""

    scheme: str = "bdf2"
    times: list[Finite] = Field(default=[], description="of the output; with [motion] those of the frames")
    step: Positive | None = None
    steps: Annotated[int, Field(ge=1)] | None = Field(default=None, description="of each output interval")
    tolerance: Positive = Field(default=1e-3, description="of an adaptive step [K]")

    @model_validator(mode="after")
    def _check(self) -> Time:
        if self.scheme not in SCHEMES:
            raise ValueError(f"scheme: found {self.scheme!r}, allowed: {', '.join(SCHEMES)}")
        if len(self.times) == 1 or any(np.diff(self.times) <= 0.0):
            raise ValueError("times: they must increase; the first one is the start")
        if self.scheme == "adaptive" and self.steps is not None:
            raise ValueError("steps: an adaptive scheme chooses them; give a tolerance")
        if self.scheme != "adaptive" and (self.step is None) == (self.steps is None):
            raise ValueError(f"scheme {self.scheme!r} needs either step, in seconds, or steps, of each output interval")
        return self


class Motion(_Table):
    """``[motion]``: all frames of the dump, one after the other, instead of one."""

    timestep: Positive = Field(description="time of one step of the dump [s]")
    expansion: Finite = Field(default=0.0, description="linear thermal expansion of the radii [1/K]")
    reference: Finite = Field(default=0.0, description="temperature of the radii in the dump [K]")


class NetworkStudy(_Table):
    """A transient study of kind "network"."""

    schema_version: Literal[1] = Field(alias="schema")
    kind: Literal["network"]
    name: str
    seed: Annotated[int, Field(ge=0, lt=2**63)] | None = None
    particles: str | None = Field(default=None, description="a particle file, relative to the study file")
    frame: int | None = None
    box: tuple[Positive, Positive] | None = Field(default=None, description="of a CSV file")
    periodic: str | None = None
    packing: PackingTable | None = None
    contacts: ContactsTable = ContactsTable()
    conduction: Conduction = Conduction()
    material: Material
    walls: WallsTable = WallsTable()
    source: list[Source] = []
    motion: Motion | None = None
    time: Time

    @model_validator(mode="after")
    def _check(self) -> NetworkStudy:
        if (self.particles is None) == (self.packing is None):
            raise ValueError("particles, a file, or a table [packing] is needed, and not both")
        if self.packing is not None:
            if self.box is not None or self.periodic is not None or self.frame is not None:
                raise ValueError("box, periodic and frame go with a particle file; [packing] has its own")
            if len(self.packing.box) != 2 or len(self.packing.density or (0.0,)) != 1:
                raise ValueError("[packing] makes one packing: a box of two lengths, and one density")
            if self.seed is None:
                raise ValueError("seed: [packing] draws random numbers, give a whole number")
        if self.motion is None and not self.time.times:
            raise ValueError("time.times: missing, expected the output times; the first one is the start")
        if self.motion is not None:
            self._check_motion(self.motion)
        if len(self.contacts.contact_angle or (0.0,)) != 1:
            raise ValueError("contacts.contact_angle: a transient has one half-angle")
        return self

    def _check_motion(self, motion: Motion) -> None:
        """Frames of a dump, and their times."""
        if self.particles is None or self.frame is not None or self.box is not None:
            raise ValueError(
                "motion: it takes all frames of a dump, whose name is in particles, and the dump's own box"
            )
        if self.time.times:
            raise ValueError("time.times: with [motion] the output times are those of the frames, take them out")
        if self.time.scheme != "adaptive" and self.time.steps is None:
            raise ValueError("time.steps: with [motion] give the steps from frame to frame, or scheme = 'adaptive'")
        if self.conduction.dipoles:
            raise ValueError("conduction.dipoles: how a disk turns from frame to frame is not known, take it out")
        if motion.expansion != 0.0 and self.contacts.rule != "overlap":
            raise ValueError("motion.expansion: radii change the contacts of rule = 'overlap' only")

    def resolved(self) -> dict[str, Any]:
        """The study with all defaults written out, as plain JSON values."""
        return self.model_dump(mode="json", by_alias=True)

    def digest(self) -> str:
        """SHA-256 of all that decides the numbers: everything but the name."""
        identity = {key: value for key, value in self.resolved().items() if key != "name"}
        return hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()


def parse_study(content: Mapping[str, Any]) -> NetworkStudy:
    """The study of a parsed TOML file.

    Raises
    ------
    StudyError
        If it does not follow the schema; the message names the first offending entry.

    Examples
    --------
    >>> parse_study({"schema": 1, "kind": "network", "name": "bed"})
    Traceback (most recent call last):
    etc_engine.errors.StudyError: material: Field required (and 1 more)
    """
    try:
        return NetworkStudy.model_validate(dict(content))
    except ValidationError as error:
        # where a number or a table may stand, our own check of the table says more than "not a number"
        details = sorted(error.errors(), key=lambda detail: detail["type"] != "value_error")
        first, count = details[0], len(details)
        place = ".".join(str(part) for part in first["loc"]) or "the study"
        more = f" (and {count - 1} more)" if count > 1 else ""
        raise StudyError(f"{place}: {first['msg'].removeprefix('Value error, ')}{more}") from error
