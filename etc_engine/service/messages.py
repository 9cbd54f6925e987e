"""Messages to and from the service, as the OpenAPI description shows them."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from etc_engine.service.queue import Entry, State

Id = Annotated[str, Field(pattern="^[0-9a-f]{16}$", description="identity of a study, the same for the same study")]


class Problem(BaseModel):
    """Why a request is refused: the line that the command line would show."""

    error: str = Field(description="what was found, what was expected, what to do")
    field: str = Field(default="", description="field of the study that it is about, such as packing.density")


class StudySummary(BaseModel):
    """A study in the queue."""

    id: Id
    name: str
    state: State
    reason: str = Field(description="why it failed, was cancelled or waits again; else empty")
    cancelling: bool = Field(description="it has been asked to end and will soon")
    done: int = Field(description="finished packings")
    planned: int = Field(description="packings planned so far; an adaptive study may grow")
    most: int = Field(description="packings at most")
    failed_cells: int = Field(description="results of a finished study that have no conductivity")
    submitted: str = Field(description="time in ISO 8601, UTC; the next two as well, once they exist")
    started: str
    ended: str

    @classmethod
    def of(cls, entry: Entry) -> StudySummary:
        """The public part of an entry."""
        return cls.model_construct(**{name: getattr(entry, name) for name in cls.model_fields})


class StudyStatus(StudySummary):
    """A study with the end of its log."""

    log: str = Field(description="the last lines that its batches printed")


class StudyList(BaseModel):
    """A part of the queue, the newest studies first."""

    studies: list[StudySummary]
    total: int = Field(description="studies there are, in this state if one was asked for")


class Submitted(StudySummary):
    """A study that has been handed in."""

    new: bool = Field(description="False if the same study was there already: its result is returned")


class Estimate(BaseModel):
    """A valid study and its size."""

    id: Id
    name: str
    known: bool = Field(description="the same study is there already")
    units: int = Field(description="packings planned")
    most: int = Field(description="packings at most")
    cells: int = Field(description="results at most")
    particles: float = Field(description="expected number of particles in the densest packing")
    text: str = Field(description="the study as TOML")


class Modelled(BaseModel):
    """Inputs of a conductivity model."""

    model_config = ConfigDict(extra="forbid")

    k1: float | None = Field(default=None, description="conductivity of phase 1 (matrix, fluid, pores) [W/(m K)]")
    k2: float | None = Field(default=None, description="conductivity of phase 2 (inclusions, solid) [W/(m K)]")
    fraction: float | None = Field(default=None, description="fraction of phase 2")
    dimension: int | None = Field(default=None, description="2 (disks) or 3 (spheres)")
    parameters: dict[str, float] = Field(default_factory=dict, description="further inputs, by name")


class About(BaseModel):
    """The service."""

    engine: str = Field(description="version of the engine")
    launcher: str
    ranks: int
    limits: dict[str, float]
    queued: int
    running: int
    packing_methods: list[str]
    size_distributions: list[str]
    engines: dict[str, list[str]] = Field(description="engines of a single solve, and their methods")


class Solved(BaseModel):
    """Conductivity of uploaded particles; the keys are those of ``etc-engine solve --json``."""

    model_config = ConfigDict(extra="allow")

    method: str
    conductivity: float = Field(description="in x direction [W/(m K)]")
    particles: int
    contacts: int
    percolates: bool
    status: int
    warnings: list[str]
    contact_temperatures: list[dict[str, Any]]
