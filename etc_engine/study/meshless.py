"""Transient study files of kind "meshless": the schema, and the run from parsed TOML to a dataset."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field, Tag, ValidationError, model_validator

from etc_engine.engines.meshless.contact_heating import ContactArc, heat_disk_through_arcs
from etc_engine.engines.meshless.discretization import Discretization
from etc_engine.engines.meshless.domain import Disk
from etc_engine.engines.meshless.problem import BoundaryCondition, Convective, Data, Dirichlet, HeatProblem, Neumann
from etc_engine.engines.meshless.radial_basis import PolyharmonicSpline
from etc_engine.engines.meshless.solve import solve_transient
from etc_engine.errors import ConvergenceError, InputError, StudyError
from etc_engine.solvers.overflow import representable_numbers
from etc_engine.study.schema import (
    AS_NUMBER,
    AS_TABLE,
    MOST_STEPS,
    NUMBER,
    POSITIVE,
    SMALLEST,
    WRITTEN,
    Number,
    Positive,
    StudyTable,
    Times,
    Word,
    first_problem,
)

if TYPE_CHECKING:
    import xarray

Point = tuple[Number, Number]
Count = Annotated[int, Field(strict=True, ge=1, le=10**6)]
A_VALUE = f"{NUMBER}, or a table {{ times = [...], values = [...] }}"
A_COUNT = "a whole number of at least 1"


class TimeTable(StudyTable):
    """Values at increasing times, linear in between and constant outside."""

    times: Times = Field(min_length=2, description=f"at least two times [s], each {NUMBER}")
    values: list[Number] = Field(min_length=2, description=f"at least two values, each {NUMBER}")

    @model_validator(mode="after")
    def _check(self) -> TimeTable:
        if len(self.times) != len(self.values):
            raise ValueError(f"a table needs as many values as times, found {len(self.values)} and {len(self.times)}")
        return self

    def at(self, t: float) -> float:
        """The value at a time."""
        return float(np.interp(t, self.times, self.values))


Value = Annotated[Annotated[Number, Tag(AS_NUMBER)] | Annotated[TimeTable, Tag(AS_TABLE)], WRITTEN]


class DiskShape(StudyTable):
    """A disk; ``breaks`` [degree] cut its circle into edges."""

    center: Point = Field(default=(0.0, 0.0), description=f"two numbers [m], each {NUMBER}")
    radius: Positive = Field(description=f"{POSITIVE} [m]")
    breaks: list[Number] = Field(default=[], description="a list of angles [degree]")


class Body(StudyTable):
    """Shape, material, uniform source and uniform initial temperature (SI units)."""

    vertices: list[Point] | None = Field(default=None, description="a list of points [x, y] [m]")
    disk: DiskShape | None = Field(default=None, description="a table with a radius")
    conductivity: Positive = Field(description=f"{POSITIVE} [W/(m K)]")
    heat_capacity: Positive = Field(description=f"{POSITIVE}, rho c [J/(m3 K)]")
    initial: Number = Field(description=f"{NUMBER} [K]")
    source: Value = Field(default=0.0, description=f"{A_VALUE} [W/m3]")


class Edge(StudyTable):
    """Boundary condition of one edge."""

    type: Literal["dirichlet", "neumann", "convective"] = Field(description="dirichlet, neumann or convective")
    value: Value = Field(
        description=f"{A_VALUE}: temperature [K], heat flux into the body [W/m2] or ambient temperature [K]"
    )
    coefficient: Positive | None = Field(
        default=None, description=f"{POSITIVE}, the heat transfer coefficient [W/(m2 K)]"
    )

    @model_validator(mode="after")
    def _check(self) -> Edge:
        if self.type == "convective" and self.coefficient is None:
            raise ValueError("coefficient: missing, type = 'convective' needs one [W/(m2 K)]")
        if self.type != "convective" and self.coefficient is not None:
            raise ValueError(f"coefficient: has no meaning with type = {self.type!r}, take it out")
        return self


class Contact(StudyTable):
    """A contact arc of a disk: angles in degrees, heat per unit thickness [W/m]."""

    angle: Number = Field(description=f"{NUMBER} [degree]")
    half_angle: Annotated[float, Field(strict=True, gt=0.0, lt=90.0)] = Field(
        description="an angle between 0 and 90 degrees, both excluded"
    )
    heat: Value = Field(description=f"{A_VALUE} [W/m]")


class Output(StudyTable):
    """Output times [s], and points [m] or a square grid of about ``grid`` points a side."""

    times: Times = Field(min_length=1, description=f"a list of times [s], each {NUMBER}")
    points: list[Point] = Field(default=[], description="a list of points [x, y] [m]")
    grid: Annotated[int, Field(strict=True, ge=2, le=400)] | None = Field(
        default=None, description="a whole number from 2 to 400"
    )

    @model_validator(mode="after")
    def _check(self) -> Output:
        if self.times[0] != 0.0 and abs(self.times[0]) < SMALLEST:
            raise ValueError(f"times: the first is 0 or at least {SMALLEST:g} s, found {self.times[0]:g}")
        return self


class Solver(StudyTable):
    """Method, scheme and discretization; what is left out takes the defaults of the solver."""

    method: Literal["trefftz", "mfs"] = Field(default="trefftz", description="trefftz or mfs")
    scheme: Literal["sdirk2", "bdf2", "crank-nicolson", "backward-euler", "laplace"] = Field(
        default="sdirk2", description="sdirk2, bdf2, crank-nicolson, backward-euler or laplace"
    )
    steps: Annotated[int, Field(strict=True, ge=1, le=MOST_STEPS)] = Field(
        default=100, description=f"a whole number from 1 to {MOST_STEPS:.0e}, of steps in total"
    )
    boundary_nodes: Annotated[Count, Field(ge=3)] | None = Field(
        default=None, description="a whole number of at least 3"
    )
    interior_nodes: Count | None = Field(default=None, description=A_COUNT)
    spacing: Literal["chebyshev", "uniform"] = Field(default="chebyshev", description="chebyshev or uniform")
    spline_order: Annotated[int, Field(strict=True, ge=1, le=5)] = Field(
        default=2, description="a whole number from 1 to 5"
    )
    functions: Count | None = Field(default=None, description=A_COUNT)
    source_offset: Positive | None = Field(default=None, description=POSITIVE)


class MeshlessStudy(StudyTable):
    """A transient study of kind "meshless"."""

    schema_version: Literal[1] = Field(alias="schema", description="1")
    kind: Literal["meshless"] = Field(description="meshless")
    name: Word = Field(description="a name")
    body: Body = Field(description="a table of shape and material")
    boundary: list[Edge] = Field(default=[], description="tables [[boundary]], one for each edge")
    contact: list[Contact] = Field(default=[], description="tables [[contact]], one for each arc")
    output: Output = Field(description="a table with times, and points or a grid")
    solver: Solver = Solver()

    @model_validator(mode="after")
    def _check(self) -> MeshlessStudy:
        if (self.body.vertices is None) == (self.body.disk is None):
            raise ValueError("[body] needs either vertices or a disk")
        if not self.output.points and self.output.grid is None:
            raise ValueError("[output] needs points or a grid")
        if self.contact and (self.body.disk is None or self.boundary):
            raise ValueError("[[contact]] goes with a disk, and instead of [[boundary]]")
        if self.contact and self.body.disk is not None and (self.body.disk.breaks or any(self.body.disk.center)):
            raise ValueError("a disk with [[contact]] sits at the origin and has no breaks")
        if self.contact and (self.solver.method != "trefftz" or self.body.source != 0.0):
            raise ValueError("a disk with [[contact]] is solved by Trefftz functions and has no source")
        return self


def parse_study(content: Mapping[str, Any]) -> MeshlessStudy:
    """The study of a parsed TOML file.

    Raises
    ------
    StudyError
        If it does not follow the schema; the message names the first offending entry.
    """
    try:
        return MeshlessStudy.model_validate(dict(content))
    except ValidationError as error:
        raise StudyError(first_problem(error, MeshlessStudy)) from None


@representable_numbers()
def run_study(content: Mapping[str, Any]) -> xarray.Dataset:
    """Solve a study of kind "meshless".

    Parameters
    ----------
    content : mapping
        The parsed TOML file.

    Returns
    -------
    xarray.Dataset
        That of ``solve_transient`` (or ``heat_disk_through_arcs``), with the name of the study.

    Examples
    --------
    >>> result = run_study({
    ...     "schema": 1, "kind": "meshless", "name": "quench",
    ...     "body": {"disk": {"radius": 1.0}, "conductivity": 1.0, "heat_capacity": 1.0, "initial": 1.0},
    ...     "boundary": [{"type": "dirichlet", "value": 0.0}],
    ...     "output": {"times": [0.1], "points": [[0.0, 0.0]]}, "solver": {"scheme": "laplace"}})
    >>> round(float(result.temperature[0, 0]), 5)
    0.84836
    """
    study = parse_study(content)
    result = _run_contacts(study) if study.contact else _run_body(study)
    if not np.isfinite(result.temperature.values).all():
        raise ConvergenceError("the temperatures are no longer finite: check the values of the study")
    return result.assign_attrs(study=study.name)


def _run_body(study: MeshlessStudy) -> xarray.Dataset:
    problem = HeatProblem(
        vertices=None if study.body.vertices is None else np.array(study.body.vertices),
        disk=_disk(study.body.disk),
        conductivity=study.body.conductivity,
        heat_capacity=study.body.heat_capacity,
        initial=study.body.initial,
        source=_data(study.body.source),
        boundary=[_condition(edge) for edge in study.boundary],
    )
    solver = study.solver
    return solve_transient(
        problem,
        study.output.times,
        _points(study, problem),
        method=solver.method,
        scheme=solver.scheme,
        steps=solver.steps,
        discretization=_discretization(solver),
    )


def _run_contacts(study: MeshlessStudy) -> xarray.Dataset:
    assert study.body.disk is not None
    nodes = (study.solver.boundary_nodes, study.solver.interior_nodes)
    if any(count is not None for count in nodes) and None in nodes:
        raise StudyError("solver: with [[contact]] give both boundary_nodes and interior_nodes, or neither")
    disk = HeatProblem(
        disk=_disk(study.body.disk), conductivity=1.0, heat_capacity=1.0, initial=0.0, boundary=[Neumann(0.0)]
    )
    return heat_disk_through_arcs(
        [ContactArc(np.radians(contact.angle), np.radians(contact.half_angle)) for contact in study.contact],
        [contact.heat.at if isinstance(contact.heat, TimeTable) else contact.heat for contact in study.contact],
        study.output.times,
        radius=study.body.disk.radius,
        conductivity=study.body.conductivity,
        heat_capacity=study.body.heat_capacity,
        initial=study.body.initial,
        points=_points(study, disk),
        scheme=study.solver.scheme,
        steps=study.solver.steps,
        discretization=None if None in nodes else _discretization(study.solver),
    )


def _discretization(solver: Solver) -> Discretization:
    given = {
        "boundary": solver.boundary_nodes,
        "interior": solver.interior_nodes,
        "functions": solver.functions,
        "source_offset": solver.source_offset,
    }
    return Discretization(
        spacing=solver.spacing,
        basis=PolyharmonicSpline(solver.spline_order),
        **{name: value for name, value in given.items() if value is not None},  # type: ignore[arg-type]
    )


def _disk(shape: DiskShape | None) -> Disk | None:
    if shape is None:
        return None
    return Disk(shape.center, shape.radius, tuple(np.radians(shape.breaks).tolist()))


def _data(value: float | TimeTable) -> Data:
    if not isinstance(value, TimeTable):
        return value
    table = value
    history: Callable[[np.ndarray, float], float] = lambda _, t: table.at(t)  # noqa: E731
    return history


def _condition(edge: Edge) -> BoundaryCondition:
    if edge.type == "dirichlet":
        return Dirichlet(_data(edge.value))
    if edge.type == "neumann":
        return Neumann(_data(edge.value))
    assert edge.coefficient is not None
    return Convective(edge.coefficient, _data(edge.value))


def _points(study: MeshlessStudy, problem: HeatProblem) -> np.ndarray:
    points = np.array(study.output.points, dtype=float).reshape(-1, 2)
    if study.output.grid is None:
        return points
    low, high = problem.domain.bounds
    step = (high - low).max() / study.output.grid
    axes = [np.arange(a + 0.5 * step, b, step) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    inside = grid[problem.domain.contains(grid)]
    if len(points) + len(inside) == 0:
        raise InputError("no point of the output grid lies inside the body: use a finer grid")
    return np.vstack([points, inside])
