"""Transient study files of kind "network": the schema."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, Tag, ValidationError, model_validator

from etc_engine.errors import InputError, StudyError
from etc_engine.medium.walls import Convective, FixedTemperature, HeatFlux, Insulated, TimeTable, WallCondition
from etc_engine.realization import ENGINES
from etc_engine.solvers.marching import SCHEMES
from etc_engine.study.schema import (
    AS_LIST,
    AS_NUMBER,
    AS_TABLE,
    MOST_STEPS,
    NOT_NEGATIVE,
    NUMBER,
    POSITIVE,
    WRITTEN,
    Flag,
    NotNegative,
    Number,
    Positive,
    Steps,
    StudyTable,
    Times,
    Word,
    first_problem,
)
from etc_engine.study.tables import ContactsTable, PackingTable

SOME = Field(min_length=1)
A_VALUE = f"{NUMBER}, or a table {{ times = [...], values = [...] }}"


class History(StudyTable):
    """Values at increasing times, linear in between and constant outside."""

    times: Times = Field(description=f"a list of times [s], each {NUMBER}")
    values: list[Number] = Field(description=f"a list of values, each {NUMBER}")

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


Value = Annotated[Annotated[Number, Tag(AS_NUMBER)] | Annotated[History, Tag(AS_TABLE)], WRITTEN]


def plain(value: float | History) -> float | TimeTable:
    """A number or a table as `etc_engine.medium.walls` takes it."""
    return value.table() if isinstance(value, History) else value


class Wall(StudyTable):
    """One wall of ``[walls]``: how it exchanges heat."""

    type: Literal["fixed", "flux", "convective", "insulated"] = Field(
        description="fixed, flux, convective or insulated"
    )
    value: Value | None = Field(
        default=None,
        description=f"{A_VALUE}: temperature [K], heat flux into the body [W/m2] or ambient temperature [K]",
    )
    coefficient: Positive | None = Field(
        default=None, description=f"{POSITIVE}, the heat transfer coefficient [W/(m2 K)]"
    )

    @model_validator(mode="after")
    def _check(self) -> Wall:
        if self.type == "convective" and self.coefficient is None:
            raise ValueError("coefficient: missing, type = 'convective' needs one [W/(m2 K)]")
        if self.type != "convective" and self.coefficient is not None:
            raise ValueError(f"coefficient: has no meaning with type = {self.type!r}, take it out")
        if self.type != "insulated" and self.value is None:
            raise ValueError(f"value: missing, type = {self.type!r} needs one")
        if self.type == "insulated" and self.value is not None:
            raise ValueError("value: has no meaning with type = 'insulated', take it out")
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


A_WALL = "a table such as { type = 'fixed', value = 1.0 }"


class WallsTable(StudyTable):
    """``[walls]``; a wall that is left out is insulated."""

    left: Wall | None = Field(default=None, description=A_WALL)
    right: Wall | None = Field(default=None, description=A_WALL)
    bottom: Wall | None = Field(default=None, description=A_WALL)
    top: Wall | None = Field(default=None, description=A_WALL)

    def conditions(self) -> dict[str, WallCondition]:
        """The conditions by wall."""
        given = {name: getattr(self, name) for name in WallsTable.model_fields}
        return {name: wall.condition() for name, wall in given.items() if wall is not None}


SYSTEMS = ("pipe", *(name for name, method in ENGINES["dtem"].methods.items() if method.transient))


class Conduction(StudyTable):
    """``[conduction]``: the method and the contacts' material."""

    method: Word = Field(default="pipe", description=", ".join(SYSTEMS))
    pipe_resistance: Literal["chord", "uniform"] | None = Field(default=None, description="chord or uniform")
    dipoles: Flag = Field(default=False, description="true or false")
    conductivity: Positive | None = Field(
        default=None, description=f"{POSITIVE}, of the particles [W/(m K)]; 1 by default"
    )
    contact_resistance: NotNegative = Field(default=0.0, description=f"{NOT_NEGATIVE} [m K/W]")

    @model_validator(mode="after")
    def _check(self) -> Conduction:
        if self.method not in SYSTEMS:
            raise ValueError(f"method: found {self.method!r}, allowed: {', '.join(SYSTEMS)}")
        if self.method != "pipe" and self.pipe_resistance is not None:
            raise ValueError("pipe_resistance goes with method = 'pipe'")
        if self.method == "pipe" and self.dipoles:
            raise ValueError("dipoles have no meaning with method = 'pipe': a particle has one temperature")
        return self


class Gradient(StudyTable):
    """A temperature that varies linearly: ``value`` at the origin, ``gradient`` [K/m]."""

    value: Number = Field(description=f"{NUMBER} [K]")
    gradient: tuple[Number, Number] = Field(description=f"two numbers [K/m], each {NUMBER}")


class Source(StudyTable):
    """One of ``[[source]]``: heat set free in each of some particles (all by default) [W/m]."""

    heat: Value = Field(description=f"{A_VALUE} [W/m]")
    particles: Annotated[list[Annotated[int, Field(strict=True, ge=0)]], Field(min_length=1)] | None = Field(
        default=None, description="a list of whole numbers from 0, the rows of particles; all by default"
    )


class Material(StudyTable):
    """``[material]``: storage and initial temperatures; a number, or one for each particle."""

    heat_capacity: Annotated[
        Annotated[Positive, Tag(AS_NUMBER)] | Annotated[list[Positive], SOME, Tag(AS_LIST)], WRITTEN
    ] = Field(description=f"{POSITIVE}, or a list of such, one for each particle: rho c [J/(m3 K)]")
    initial: Annotated[
        Annotated[Number, Tag(AS_NUMBER)]
        | Annotated[list[Number], SOME, Tag(AS_LIST)]
        | Annotated[Gradient, Tag(AS_TABLE)],
        WRITTEN,
    ] = Field(
        description=f"{NUMBER} [K], a list of such, one for each particle, or a table such as "
        "{ value = 0.0, gradient = [1.0, 0.0] }"
    )


class Time(StudyTable):
    """``[time]``: scheme, steps and output times; times[0] is the start."""

    scheme: Word = Field(default="bdf2", description=", ".join(SCHEMES))
    times: Times = Field(default=[], description=f"a list of output times [s], the first one the start, each {NUMBER}")
    step: Positive | None = Field(default=None, description=f"{POSITIVE} [s]")
    steps: Steps | None = Field(
        default=None, description="a whole number of at least 1, of each output interval or from frame to frame"
    )
    tolerance: Positive = Field(default=1e-3, description=f"{POSITIVE}, of an adaptive step [K]")

    @model_validator(mode="after")
    def _check(self) -> Time:
        if self.scheme not in SCHEMES:
            raise ValueError(f"scheme: found {self.scheme!r}, allowed: {', '.join(SCHEMES)}")
        if len(self.times) == 1:
            raise ValueError("times: at least two are needed; the first one is the start")
        if self.scheme == "adaptive" and self.steps is not None:
            raise ValueError("steps: an adaptive scheme chooses them; give a tolerance")
        if self.scheme != "adaptive" and "tolerance" in self.model_fields_set:
            raise ValueError(f"tolerance: has no meaning with scheme = {self.scheme!r}, only with 'adaptive'")
        if self.step is not None and self.steps is not None:
            raise ValueError("give step, in seconds, or steps, of each output interval, not both")
        if self.scheme != "adaptive" and self.step is None and self.steps is None:
            raise ValueError(f"scheme {self.scheme!r} needs either step, in seconds, or steps, of each output interval")
        return self


def refuse_endless(time: Time, times: Sequence[float] | NDArray[np.float64]) -> None:
    """Refuse steps that no run lives to see.

    Raises
    ------
    StudyError
        If output at these times asks for more than `MOST_STEPS`.
    """
    intervals = np.diff(np.asarray(times, dtype=np.float64))
    if time.scheme == "adaptive":
        return
    count = float(intervals.size) * float(time.steps) if time.steps else float((intervals / (time.step or 1.0)).sum())
    if count > MOST_STEPS:
        word = "steps" if time.steps else "step"
        raise StudyError(f"time.{word}: that makes {count:.3g} steps in total, allowed are {MOST_STEPS:.0e}")


class Motion(StudyTable):
    """``[motion]``: all frames of the dump, one after the other, instead of one."""

    timestep: Positive = Field(description=f"{POSITIVE}, the time of one step of the dump [s]")
    expansion: Number = Field(default=0.0, description=f"{NUMBER}, linear thermal expansion of the radii [1/K]")
    reference: Number = Field(default=0.0, description=f"{NUMBER}, temperature of the radii in the dump [K]")


class NetworkStudy(StudyTable):
    """A transient study of kind "network"."""

    schema_version: Literal[1] = Field(alias="schema", description="1")
    kind: Literal["network"] = Field(description="network")
    name: Word = Field(description="a name")
    seed: Annotated[int, Field(strict=True, ge=0, lt=2**63)] | None = Field(
        default=None, description="a whole number from 0 to 2**63 - 1, with [packing]"
    )
    particles: Word | None = Field(default=None, description="a particle file, relative to the study file")
    frame: Annotated[int, Field(strict=True)] | None = Field(
        default=None, description="the number of a frame of a dump, from 0; the last one by default"
    )
    box: tuple[Positive, Positive] | None = Field(default=None, description="two positive edge lengths, of a CSV file")
    periodic: Word | None = Field(default=None, description="a combination of the letters x, y, of a CSV file")
    packing: PackingTable | None = None
    contacts: ContactsTable = ContactsTable()
    conduction: Conduction = Conduction()
    material: Material = Field(description="a table with heat_capacity and initial")
    walls: WallsTable = WallsTable()
    source: list[Source] = Field(default=[], description="tables [[source]] with heat and particles")
    motion: Motion | None = Field(default=None, description="a table with timestep")
    time: Time = Field(description="a table with times and steps")

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
        try:
            refuse_endless(self.time, self.time.times)
        except StudyError as error:
            raise ValueError(str(error)) from None
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

    def identity(self) -> dict[str, Any]:
        """What decides the numbers: everything but the name."""
        return {key: value for key, value in self.resolved().items() if key != "name"}

    def digest(self) -> str:
        """SHA-256 of the identity."""
        return hashlib.sha256(json.dumps(self.identity(), sort_keys=True).encode()).hexdigest()


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
    etc_engine.errors.StudyError: material: missing, expected a table ... (and 1 more problem)
    """
    try:
        return NetworkStudy.model_validate(dict(content))
    except ValidationError as error:
        raise StudyError(first_problem(error, NetworkStudy)) from None
