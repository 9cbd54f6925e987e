"""What transient studies share: values that vary with time, and the condition of a wall or an edge."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, Tag, model_validator

from etc_engine.errors import InputError
from etc_engine.medium.walls import Convective, FixedTemperature, HeatFlux, Insulated, TimeTable, WallCondition
from etc_engine.study.schema import AS_NUMBER, AS_TABLE, NUMBER, POSITIVE, WRITTEN, Number, Positive, StudyTable, Times

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
        """The values as a function of time."""
        return TimeTable(tuple(self.times), tuple(self.values))


Value = Annotated[Annotated[Number, Tag(AS_NUMBER)] | Annotated[History, Tag(AS_TABLE)], WRITTEN]


def plain(value: float | History) -> float | TimeTable:
    """A number, or a function of time."""
    return value.table() if isinstance(value, History) else value


class Wall(StudyTable):
    """How a wall, or an edge of a body, exchanges heat."""

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
            raise ValueError(f"coefficient: has no effect with type = {self.type!r}: remove it")
        if self.type != "insulated" and self.value is None:
            raise ValueError(f"value: missing, type = {self.type!r} needs one")
        if self.type == "insulated" and self.value is not None:
            raise ValueError("value: has no effect with type = 'insulated': remove it")
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
