"""The study file of a meshless transient, and the run from its content to a dataset."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from etc_engine.engines.meshless.contact_heating import ContactArc, heat_disk_through_arcs
from etc_engine.engines.meshless.discretization import Discretization
from etc_engine.engines.meshless.domain import Disk
from etc_engine.engines.meshless.problem import BoundaryCondition, Convective, Data, Dirichlet, HeatProblem, Neumann
from etc_engine.engines.meshless.radial_basis import PolyharmonicSpline
from etc_engine.engines.meshless.solve import solve_transient
from etc_engine.errors import ConvergenceError, InputError, StudyError
from etc_engine.medium import walls
from etc_engine.medium.walls import FixedTemperature, HeatFlux, ValueLike, WallCondition, as_value
from etc_engine.solvers.overflow import representable_numbers
from etc_engine.study.files import StudyFile, validated
from etc_engine.study.schema import MOST_STEPS, NUMBER, POSITIVE, SMALLEST, Number, Positive, StudyTable, Times
from etc_engine.study.walls import A_VALUE, Value, Wall, plain

if TYPE_CHECKING:
    import xarray

Point = tuple[Number, Number]
Count = Annotated[int, Field(strict=True, ge=1, le=10**6)]
A_COUNT = "a whole number of at least 1"


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
            raise ValueError(f"times: the first must be 0 or at least {SMALLEST:g} s, found {self.times[0]:g}")
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


class MeshlessStudy(StudyFile):
    """A transient study of kind "meshless"."""

    KIND: ClassVar[str] = "meshless"

    kind: Literal["meshless"] = Field(description="meshless")
    body: Body = Field(description="a table of shape and material")
    boundary: list[Wall] = Field(default=[], description="tables [[boundary]], one for each edge")
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
            raise ValueError("[[contact]] is only valid with a disk, and replaces [[boundary]]")
        if self.contact and self.body.disk is not None and (self.body.disk.breaks or any(self.body.disk.center)):
            raise ValueError("a disk with [[contact]] sits at the origin and has no breaks")
        if self.contact and (self.solver.method != "trefftz" or self.body.source != 0.0):
            raise ValueError("a disk with [[contact]] is solved by Trefftz functions and has no source")
        return self


@representable_numbers()
def run_study(content: Mapping[str, Any], source: str = "study") -> xarray.Dataset:
    """Solve a study of kind "meshless".

    Parameters
    ----------
    content : mapping
        Of the study file.
    source : str
        Its name, for errors.

    Returns
    -------
    xarray.Dataset
        That of ``solve_transient`` (or ``heat_disk_through_arcs``), with the name of the study.

    Examples
    --------
    >>> result = run_study({
    ...     "schema": 2, "kind": "meshless", "name": "quench",
    ...     "body": {"disk": {"radius": 1.0}, "conductivity": 1.0, "heat_capacity": 1.0, "initial": 1.0},
    ...     "boundary": [{"type": "fixed", "value": 0.0}],
    ...     "output": {"times": [0.1], "points": [[0.0, 0.0]]}, "solver": {"scheme": "laplace"}})
    >>> round(float(result.temperature[0, 0]), 5)
    0.84836
    """
    study = validated(content, MeshlessStudy, source)
    result = _run_contacts(study) if study.contact else _run_body(study)
    if not np.isfinite(result.temperature.values).all():
        raise ConvergenceError("the temperatures are no longer finite: check the values of the study")
    return result.assign_attrs(
        study=study.name, study_resolved=json.dumps(study.resolved()), study_digest=study.digest()
    )


def _run_body(study: MeshlessStudy) -> xarray.Dataset:
    problem = HeatProblem(
        vertices=None if study.body.vertices is None else np.array(study.body.vertices),
        disk=_disk(study.body.disk),
        conductivity=study.body.conductivity,
        heat_capacity=study.body.heat_capacity,
        initial=study.body.initial,
        source=_data(plain(study.body.source)),
        boundary=[_condition(edge.condition()) for edge in study.boundary],
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
        [plain(contact.heat) for contact in study.contact],
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


def _data(value: ValueLike) -> Data:
    """A number, or a function of position and time, as a problem takes it."""
    at = as_value(value, "value")
    if not callable(at):
        return at
    history: Callable[[np.ndarray, float], float] = lambda _, t: at(t)  # noqa: E731
    return history


def _condition(wall: WallCondition) -> BoundaryCondition:
    if isinstance(wall, FixedTemperature):
        return Dirichlet(_data(wall.value))
    if isinstance(wall, HeatFlux):
        return Neumann(_data(wall.value))
    if isinstance(wall, walls.Convective):
        return Convective(wall.coefficient, _data(wall.ambient))
    return Neumann(0.0)


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
