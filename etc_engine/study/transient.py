"""The study file of a transient on a contact network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Discriminator, Field, Tag, model_validator

from etc_engine.errors import InputError, StudyError
from etc_engine.materials import find_solid
from etc_engine.medium.conditions import Conditions
from etc_engine.medium.rules import RULES
from etc_engine.medium.walls import WallCondition
from etc_engine.realization import ENGINES
from etc_engine.solvers.marching import NONLINEAR, SCHEMES
from etc_engine.study.files import A_SEED, Seed, StudyFile, validated
from etc_engine.study.meaning import refuse_meaningless
from etc_engine.study.quantities import QUANTITIES, SHARE, Accommodation, Share
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
)
from etc_engine.study.tables import (
    A_GAS,
    A_MATERIAL,
    ContactsTable,
    Engine,
    Gas,
    Material,
    PackingTable,
    unknown_method,
)
from etc_engine.study.walls import A_VALUE, Value, Wall

SOME = Field(min_length=1)
A_WALL = "a table such as { type = 'fixed', value = 1.0 }"


class FileTable(StudyTable):
    """``[packing]`` of particles in a file."""

    files: Word = Field(description="a particle file, relative to the study file")
    frames: Annotated[int, Field(strict=True)] | Literal["last"] = Field(
        default="last", description="'last', or the number of a frame of a dump, from 0"
    )
    box: Annotated[tuple[Positive, ...], Field(min_length=2, max_length=3)] | None = Field(
        default=None, description="two or three positive edge lengths, of a CSV file"
    )
    periodic: Word | None = Field(default=None, description="a combination of the letters x, y, z, of a CSV file")
    crop: tuple[str, ...] | None = Field(
        default=None, description="ranges low:high of each axis to keep, '' for all, such as ['', '0:0.024']"
    )
    dimension: Literal[2, 3] | None = Field(default=None, description="2 or 3, where the file cannot say")
    radius_column: Word | None = Field(default=None, description="the name of the column of radii")


def _made_or_read(packing: object) -> str:
    read = "files" in packing if isinstance(packing, Mapping) else isinstance(packing, FileTable)
    return "read" if read else "made"


class WallsTable(StudyTable):
    """``[walls]``; a wall that is left out is insulated."""

    left: Wall | None = Field(default=None, description=A_WALL)
    right: Wall | None = Field(default=None, description=A_WALL)
    bottom: Wall | None = Field(default=None, description=A_WALL)
    top: Wall | None = Field(default=None, description=A_WALL)
    front: Wall | None = Field(default=None, description=f"{A_WALL}, at z = 0")
    back: Wall | None = Field(default=None, description=f"{A_WALL}, at the far end of z")

    def conditions(self) -> dict[str, WallCondition]:
        """The conditions by wall."""
        given = {name: getattr(self, name) for name in WallsTable.model_fields}
        return {name: wall.condition() for name, wall in given.items() if wall is not None}


class Conduction(StudyTable):
    """``[conduction]``: the engine and its method."""

    engine: Engine = Field(default="dtem", description="dtem or pipe")
    method: Word = Field(default="", description="a method of the engine")
    dipoles: Flag = Field(default=False, description="true or false")
    temperature: Positive | None = Field(
        default=None, description=f"{POSITIVE}, of material, gas and radiation at one temperature [K]"
    )
    nonlinear: Flag = Field(
        default=False, description="true or false: whether material, gas and radiation follow the local temperature"
    )

    @model_validator(mode="after")
    def _check(self) -> Conduction:
        if self.engine not in TRANSIENT:
            raise ValueError(f"engine: found {self.engine!r}, a transient takes {' or '.join(TRANSIENT)}")
        allowed = TRANSIENT[self.engine]
        if self.method and self.method not in allowed:
            raise ValueError(unknown_method(self.engine, self.method, allowed))
        if self.dipoles and not any("dipoles" in ENGINES[self.engine].methods[word].options for word in self.words):
            raise ValueError(f"dipoles have no effect with engine = {self.engine!r}: a particle has one temperature")
        return self

    @property
    def words(self) -> list[str]:
        """The method, or those that the engine has where none is given."""
        return [self.method] if self.method else TRANSIENT[self.engine]

    def method_for(self, dimension: int, pores_conduct: bool) -> str:
        """The method, by default that of the engine for a dimension and its pores."""
        return self.method or ENGINES[self.engine].default_method(dimension, pores_conduct)


TRANSIENT = {
    word: found for word, row in ENGINES.items() if (found := [name for name, m in row.methods.items() if m.transient])
}
"""Methods with a transient form, by engine."""


class Gradient(StudyTable):
    """A temperature that varies linearly: ``value`` at the origin, ``gradient`` [K/m]."""

    value: Number = Field(description=f"{NUMBER} [K]")
    gradient: Annotated[tuple[Number, ...], Field(min_length=2, max_length=3)] = Field(
        description=f"two or three numbers [K/m], one per axis, each {NUMBER}"
    )


class Source(StudyTable):
    """One of ``[[source]]``: heat released in each of some particles (all by default)."""

    heat: Value = Field(description=f"{A_VALUE} [W, of disks W/m]")
    particles: Annotated[list[Annotated[int, Field(strict=True, ge=0)]], Field(min_length=1)] | None = Field(
        default=None, description="a list of whole numbers from 0, the rows of particles; all by default"
    )
    ids: Annotated[list[Annotated[int, Field(strict=True)]], SOME] | None = Field(
        default=None, description="a list of whole numbers, the ids of particles in their file"
    )
    types: Annotated[list[int | Word], SOME] | None = Field(
        default=None, description="a list of types of particles, as their file names them"
    )

    @model_validator(mode="after")
    def _check(self) -> Source:
        given = [key for key in ("particles", "ids", "types") if getattr(self, key) is not None]
        if len(given) > 1:
            raise ValueError(f"{given[0]} and {given[1]} both choose particles; remove one of them")
        return self


class ParticlesTable(StudyTable):
    """``[particles]``: what they are made of, and how warm they are at first; a number, or one for each particle."""

    conductivity: Positive = Field(default=1.0, description=f"{POSITIVE} [W/(m K)]")
    material: Material | None = Field(default=None, description=A_MATERIAL)
    types: dict[str, Positive] | None = Field(
        default=None, description="a table such as { 1 = 2.4, 2 = 1.1 }: conductivity by type of the file [W/(m K)]"
    )
    heat_capacity: Annotated[
        Annotated[Positive, Tag(AS_NUMBER)] | Annotated[list[Positive], SOME, Tag(AS_LIST)], WRITTEN
    ] = Field(description=f"{POSITIVE}, or a list of such, one for each particle: rho c [J/(m3 K)]")
    initial: Annotated[
        Annotated[Number | Literal["file"], Tag(AS_NUMBER)]
        | Annotated[list[Number], SOME, Tag(AS_LIST)]
        | Annotated[Gradient, Tag(AS_TABLE)],
        WRITTEN,
    ] = Field(
        description=f"{NUMBER} [K], a list of such, one for each particle, a table such as "
        "{ value = 0.0, gradient = [1.0, 0.0] }, or 'file': the temperatures of the particle file"
    )


class PoresTable(StudyTable):
    """``[pores]``: the fluid between the particles, at rest."""

    conductivity: NotNegative = Field(default=0.0, description=f"{NOT_NEGATIVE} [W/(m K)]")
    heat_capacity: NotNegative = Field(default=0.0, description=f"{NOT_NEGATIVE}: rho c [J/(m3 K)]")
    gas: Gas | None = Field(default=None, description=A_GAS)
    pressure: NotNegative | None = Field(default=None, description=f"{NOT_NEGATIVE}, of the gas [Pa]")
    accommodation: Accommodation | None = Field(default=None, description="a number above 0, up to 1, of the surfaces")

    @property
    def filled(self) -> bool:
        """Whether a fluid conducts in them."""
        return self.conductivity > 0.0 or bool(self.pressure)

    @model_validator(mode="after")
    def _check(self) -> PoresTable:
        if self.heat_capacity > 0.0 and not self.filled:
            raise ValueError("heat_capacity: the pores store heat only if they conduct, give a conductivity")
        if self.gas is not None and self.conductivity > 0.0:
            raise ValueError("conductivity: has no effect with gas: remove it")
        return self


class RadiationTable(StudyTable):
    """``[radiation]``: between the surfaces of the particles."""

    emissivity: Share | None = Field(default=None, description=f"{SHARE}, of the particles")


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
            raise ValueError(f"tolerance: has no effect with scheme = {self.scheme!r}, only with 'adaptive'")
        if self.step is not None and self.steps is not None:
            raise ValueError("give step, in seconds, or steps, of each output interval, not both")
        if self.scheme != "adaptive" and self.step is None and self.steps is None:
            raise ValueError(f"scheme {self.scheme!r} needs either step, in seconds, or steps, of each output interval")
        return self


def refuse_endless(time: Time, times: Sequence[float] | NDArray[np.float64]) -> None:
    """Refuse more steps than a run can take.

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


class NetworkStudy(StudyFile):
    """A transient study of kind "network"."""

    KIND: ClassVar[str] = "transient"

    kind: Literal["network"] = Field(description="network")
    seed: Seed | None = Field(default=None, description=f"{A_SEED}, if particles are packed")
    packing: Annotated[
        Annotated[PackingTable, Tag("made")] | Annotated[FileTable, Tag("read")], Discriminator(_made_or_read)
    ] = Field(description="a table with files, or with the words of the command pack")
    particles: ParticlesTable = Field(description="a table with heat_capacity and initial")
    contacts: ContactsTable = Field(default_factory=ContactsTable, description="a table")
    pores: PoresTable = Field(default_factory=PoresTable, description="a table with conductivity")
    radiation: RadiationTable = Field(default_factory=RadiationTable, description="a table with emissivity")
    conduction: Conduction = Field(default_factory=Conduction, description="a table")
    walls: WallsTable = Field(default_factory=WallsTable, description="a table")
    source: list[Source] = Field(default=[], description="tables [[source]] with heat and particles")
    motion: Motion | None = Field(default=None, description="a table with timestep")
    time: Time = Field(description="a table with times and steps")

    @model_validator(mode="after")
    def _check(self) -> NetworkStudy:
        if isinstance(self.packing, PackingTable):
            if isinstance(getattr(self.packing, "density", None), tuple):
                raise ValueError("[packing] makes one packing: give one density")
            if self.seed is None:
                raise ValueError("seed: [packing] draws random numbers, give a whole number")
        if self.motion is None and not self.time.times:
            raise ValueError("time.times: missing, expected the output times; the first one is the start")
        self._check_pores()
        self._check_temperature()
        if self.motion is not None:
            self._check_motion(self.motion)
        try:
            refuse_endless(self.time, self.time.times)
        except StudyError as error:
            raise ValueError(str(error)) from None
        self._check_contacts()
        return self

    def _check_contacts(self) -> None:
        """One value of each key that the contact rule reads, and no other key."""
        for row in QUANTITIES.values():
            if row.table == "contacts" and isinstance(getattr(self.contacts, row.key), tuple):
                raise ValueError(f"{row.place}: a transient takes one value, found a list")
        refuse_meaningless(self, "contacts")
        if self.contacts.roughness is not None:
            raise ValueError(
                "contacts.roughness: a transient does not compute the resistance of rough contacts: remove it and "
                "give contacts.contact_resistance"
            )

    @property
    def pores_conduct(self) -> bool:
        """Whether heat passes through the pores, by a fluid or by radiation."""
        return self.pores.filled or bool(self.radiation.emissivity)

    def conditions(self, temperature: float | None) -> Conditions:
        """Gas and radiation of the study at a temperature [K].

        Raises
        ------
        InputError
        """
        material, gas = self.particles.material, self.pores.gas
        mass = None if gas is None or material is None else find_solid(material).atomic_mass
        return Conditions(
            temperature, gas, self.pores.pressure, self.pores.accommodation, mass, self.radiation.emissivity
        )

    def _check_temperature(self) -> None:
        """Material, gas and radiation have a temperature: one of the study, or the local one."""
        table, row = self.conduction, ENGINES[self.conduction.engine]
        named = self.particles.material is not None or self.pores.gas is not None or bool(self.radiation.emissivity)
        if self.particles.material is not None and "conductivity" in self.particles.model_fields_set:
            raise ValueError("particles.conductivity: has no effect with material: remove it")
        try:  # at any temperature: which one is checked when it is known
            self.conditions(300.0 if table.nonlinear else table.temperature)
        except InputError as error:
            raise ValueError(f"pores: {error}") from None
        if table.temperature is not None and (table.nonlinear or not named):
            choice = "with nonlinear = true" if table.nonlinear else "without a material, a gas or radiation"
            raise ValueError(f"conduction.temperature: has no effect {choice}: remove it")
        if self.particles.material is not None and table.temperature is None and not table.nonlinear:
            raise ValueError("conduction.temperature: missing, the conductivity of particles.material depends on it")
        if not table.nonlinear:
            return
        able = [name for name, method in row.methods.items() if method.local]
        if not named:
            raise ValueError("conduction.nonlinear: no property depends on the temperature: give a material or a gas")
        if not able or (table.method and table.method not in able) or not self.pores_conduct:
            raise ValueError(
                "conduction.nonlinear: properties follow the temperature with engine dtem, method facets and pores "
                "that conduct or radiate"
            )
        if self.time.scheme not in NONLINEAR:
            raise ValueError(
                f"time.scheme: found {self.time.scheme!r}, allowed with nonlinear = true: {', '.join(NONLINEAR)}"
            )
        if self.motion is not None:
            raise ValueError("conduction.nonlinear: properties do not follow the temperature with [motion]: remove it")

    def _check_pores(self) -> None:
        """The method takes heat through the pores, or not, as they conduct."""
        methods = ENGINES[self.conduction.engine].methods
        word, conduct = self.conduction.method, self.pores_conduct
        able = [name for name, row in methods.items() if row.transient and (row.pores != "no") is conduct]
        if word and word not in able and methods[word].pores != "may":
            what = "conduct" if conduct else "do not conduct"
            raise ValueError(f"conduction.method: found {word!r}, allowed where the pores {what}: {', '.join(able)}")
        if conduct and not able:
            raise ValueError(
                f"pores.conductivity: engine {self.conduction.engine} does not model heat through the pores"
            )
        if conduct and self.motion is not None:
            raise ValueError("pores.conductivity: with [motion] the pores do not conduct: remove it")

    def _check_motion(self, motion: Motion) -> None:
        """Frames of a dump, and their times."""
        file = self.packing
        if not isinstance(file, FileTable) or "frames" in file.model_fields_set or file.box is not None:
            raise ValueError("motion: needs a dump in packing.files, with all of its frames and its box")
        if file.crop is not None:
            raise ValueError("packing.crop: particles would enter and leave with [motion]: remove it")
        if self.time.times:
            raise ValueError("time.times: with [motion] the output times are those of the frames; remove them")
        if self.time.scheme != "adaptive" and self.time.steps is None:
            raise ValueError("time.steps: with [motion] give the steps from frame to frame, or scheme = 'adaptive'")
        if self.conduction.dipoles:
            raise ValueError("conduction.dipoles: the rotation of a disk between frames is not known: remove it")
        if motion.expansion != 0.0 and not RULES[self.contacts.rule].geometric:
            raise ValueError("motion.expansion: works with rule = 'overlap' only, where the radii decide the contacts")


def parse_study(content: Mapping[str, Any], source: str = "study") -> NetworkStudy:
    """The study of a file's content.

    Raises
    ------
    StudyError
        If it does not follow the schema; the message names the first offending entry.

    Examples
    --------
    >>> parse_study({"schema": 2, "kind": "network", "name": "bed", "packing": {"files": "bed.dump"}})
    Traceback (most recent call last):
    etc_engine.errors.StudyError: study: particles: missing, expected a table ... (and 1 more problem)...
    """
    return validated(content, NetworkStudy, source)
