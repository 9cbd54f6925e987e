"""solve_transient: a heat problem in, temperatures, fluxes and diagnostics out."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from etc_engine.errors import ConvergenceError, InputError
from etc_engine.meshless.discretization import Discretization, Layout, Method, lay_out
from etc_engine.meshless.domain import Polygon
from etc_engine.meshless.helmholtz import HelmholtzOperator, prepare_operator
from etc_engine.meshless.laplace import talbot_nodes
from etc_engine.meshless.observation import (
    Observation,
    Probe,
    boundary_residual,
    observe,
    observe_initial,
    prepare_probe,
)
from etc_engine.meshless.particular import interpolate_source
from etc_engine.meshless.problem import Dirichlet, HeatProblem, transformed
from etc_engine.meshless.stepping import FACTORS, StepLibrary, march, spectral_radius, step_counts

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]
Scheme = Literal["sdirk2", "bdf2", "crank-nicolson", "backward-euler", "laplace"]

#: lambda times the node spacing within which time marching was found stable (both methods, splines of
#: order 1 to 3, square and L): larger values leave the Trefftz part unstable, smaller ones the splines.
STABLE_RANGE = (0.1, 4.0)
#: Beyond this condition number of the interpolation, rounding was seen to reach 1e-5 of the field.
CONDITION_LIMIT = 1e16
#: A boundary residual beyond this part of the temperature span is worth a warning.
RESIDUAL_LIMIT = 0.05
#: A Laplace transform must agree with its function to this part of the function's size.
TRANSFORM_TOLERANCE = 1e-6


class DiscretizationWarning(UserWarning):
    """The field is less accurate than the method promises; the message says where and why."""


@dataclass
class Diagnostics:
    """What the solvers found out about themselves; becomes the attributes of the dataset."""

    boundary_condition: float = 0.0
    boundary_rank: int = 0
    interpolation_condition: float = 0.0
    spectral_radius: float = float("nan")
    lambda_spacing: list[float] = field(default_factory=list)
    steps: int = 0
    warnings: list[str] = field(default_factory=list)

    def note_operator(self, operator: HelmholtzOperator) -> None:
        """Keep the worst figures over all lambdas."""
        first = not self.lambda_spacing
        self.boundary_condition = max(self.boundary_condition, operator.fit.condition)
        self.boundary_rank = operator.fit.rank if first else min(self.boundary_rank, operator.fit.rank)
        self.interpolation_condition = max(self.interpolation_condition, operator.interpolation.condition)
        self.lambda_spacing.append(abs(operator.lam) * operator.layout.spacing / operator.layout.scale)

    def warn(self, message: str) -> None:
        """Record a warning and raise it as a Python warning."""
        self.warnings.append(message)
        warnings.warn(message, DiscretizationWarning, stacklevel=4)


def solve_transient(
    problem: HeatProblem,
    times: Sequence[float] | Array | float,
    points: Sequence[Sequence[float]] | Array,
    method: Method = "trefftz",
    scheme: Scheme = "sdirk2",
    steps: int = 100,
    discretization: Discretization | None = None,
) -> xarray.Dataset:
    """Transient temperature and heat flux of a homogeneous plane body.

    k lap u + Q = rho c du/dt becomes one modified Helmholtz problem per time step (or per node of a Laplace
    contour); its particular part comes from dual reciprocity, its homogeneous part from Trefftz functions
    or fundamental solutions fitted to the boundary conditions.

    Parameters
    ----------
    problem : HeatProblem
        Body, material, source, initial state and boundary conditions.
    times : sequence of float, shape (nt,) [s]
        Output times, increasing; 0 gives the initial state.
    points : array_like, shape (np, 2) [m]
        Output points inside or on the body.
    method : "trefftz" or "mfs"
        Functions of the homogeneous part.
    scheme : "sdirk2", "bdf2", "crank-nicolson", "backward-euler" or "laplace"
        Time marching, or Laplace transform with Talbot inversion.
    steps : int
        Number of equal time steps up to the last output time (not used by "laplace"). When an output time is not a
        multiple of that step, each interval between output times is cut into its own equal steps, none longer.
    discretization : Discretization, optional
        Nodes and functions.

    Returns
    -------
    xarray.Dataset
        ``temperature`` (time, point) [K], ``heat_flux`` (time, point, direction) [W/m2], ``mean_temperature`` (time)
        [K], ``heat_inflow`` (time) [W/m], ``boundary_residual`` (time); the diagnostics are attributes:
        condition numbers, ranks, spectral radius of the step, lambda times node spacing, warnings.

    Raises
    ------
    InputError
        If times, points or data are not what is asked for, or ``scheme="laplace"`` meets data that varies in
        time without a transform (or with one that does not belong to it).
    ConvergenceError
        If the time step amplifies, or the field is not finite.

    Warns
    -----
    DiscretizationWarning
        If prescribed temperatures jump at a corner, lambda times the node spacing leaves the stable range,
        singular values were cut off, or the boundary conditions are met poorly between the nodes.

    Notes
    -----
    The initial value at boundary nodes is the interior one: a thermal shock needs no special care except with
    Crank-Nicolson, which starts with two backward Euler half steps.

    References
    ----------
    Cao, Qin and Zhao (2010), Recent Patents on Space Technology 2, 41.

    Examples
    --------
    >>> from etc_engine.meshless import Dirichlet, HeatProblem
    >>> problem = HeatProblem(vertices=[(0, 0), (3, 0), (3, 3), (0, 3)], conductivity=1.25, heat_capacity=1.0,
    ...                       initial=30.0, boundary=[Dirichlet(0.0)] * 4)
    >>> result = solve_transient(problem, [1.2], [(1.5, 1.5)], scheme="laplace")
    >>> round(float(result.temperature[0, 0]), 5)
    1.81205
    """
    output_times, output_points = _checked_times(times), _checked_points(problem, points)
    if scheme != "laplace" and scheme not in FACTORS:
        raise InputError(f"the scheme {scheme!r} is unknown: expected laplace or one of {', '.join(FACTORS)}")
    layout = lay_out(problem, discretization or Discretization(), method)
    diagnostics = Diagnostics()
    _note_corner_jumps(problem, diagnostics)
    probe = prepare_probe(layout, output_points)
    positive = output_times[output_times > 0.0]
    if scheme == "laplace":
        readings = [_solve_laplace(probe, float(t), diagnostics) for t in positive]
    else:
        readings = _solve_marching(probe, scheme, positive, steps, diagnostics)
    if len(positive) < len(output_times):
        readings.insert(0, _initial_reading(probe))
    residuals = _residuals(layout, readings, output_times)
    _judge(layout, readings, residuals, diagnostics)
    return _dataset(layout, scheme, output_times, output_points, readings, residuals, diagnostics)


def _solve_marching(
    probe: Probe, scheme: str, times: Array, steps: int, diagnostics: Diagnostics
) -> list[Observation]:
    """Readings at positive times; each step operator is judged when it is first used."""
    if steps < 1 or int(steps) != steps:
        raise InputError(f"at least one whole time step is needed, found steps = {steps}")
    if len(times) == 0:
        return []
    library = StepLibrary(probe.layout)
    readings, seen = [], set()
    for snapshot in march(library, scheme, times, int(steps)):
        operator = snapshot.step.operator
        if operator.lam not in seen:
            seen.add(operator.lam)
            diagnostics.note_operator(operator)
            radius = spectral_radius(snapshot.step, scheme)
            diagnostics.spectral_radius = float(np.fmax(diagnostics.spectral_radius, radius))
            _refuse_growth(probe.layout, radius, steps, diagnostics)
        readings.append(observe(probe, operator, snapshot.coefficients()[:, None]))
    diagnostics.steps = int(step_counts(times, int(steps)).sum())
    return readings


def _refuse_growth(layout: Layout, radius: float, steps: int, diagnostics: Diagnostics) -> None:
    """An amplification that adds more than a per cent over the run spoils the field."""
    if radius <= 1.0 + 0.01 / steps:
        return
    message = (
        f"time marching is unstable: the spectral radius of a step is {radius:.6g} with {layout.functions} functions "
        f"on {layout.collocation.count} boundary nodes; use fewer functions, splines of lower order, more nodes or "
        'longer steps, or method="mfs"'
    )
    if not (layout.discretization.allow_unstable and np.isfinite(radius)):
        raise ConvergenceError(message)
    diagnostics.warn(message)


def _solve_laplace(probe: Probe, t: float, diagnostics: Diagnostics) -> Observation:
    """Reading at one positive time by Talbot inversion: eight complex Helmholtz problems."""
    layout = probe.layout
    problem = layout.problem
    nodes, weights = talbot_nodes(t)
    _check_transforms(layout, t)
    interpolation = None
    total: Observation | None = None
    initial = problem.initial_values(layout.nodes) / problem.diffusivity
    for s, weight in zip(nodes, weights, strict=True):
        lam = complex(layout.scale * np.sqrt(s / problem.diffusivity))
        if interpolation is None or layout.discretization.basis.depends_on_lambda:
            interpolation = interpolate_source(layout.discretization.basis, layout.scaled(layout.nodes), lam)
        operator = prepare_operator(layout, lam, interpolation)
        diagnostics.note_operator(operator)
        source = 0.0 if problem.source is None else problem.source
        heating = transformed(source, problem.source_transform, layout.nodes, s, "the heat source")
        data = np.empty(layout.collocation.count, dtype=complex)
        for edge, condition in enumerate(problem.boundary):
            mine = layout.collocation.edges == edge
            what = f"the boundary condition of edge {edge}"
            values = transformed(condition.data, condition.transform, layout.collocation.points[mine], s, what)
            data[mine] = condition.factor * values
        coefficients = operator.solve(-(layout.scale**2) * (initial + heating / problem.conductivity), data)
        part = observe(probe, operator, coefficients[:, None]).weighted(np.array([[weight]]))
        total = part if total is None else _sum(total, part)
    assert total is not None
    return total


def _sum(a: Observation, b: Observation) -> Observation:
    return Observation(
        a.temperature + b.temperature,
        a.heat_flux + b.heat_flux,
        a.mean_temperature + b.mean_temperature,
        a.heat_inflow + b.heat_inflow,
        a.boundary_values + b.boundary_values,
    )


def _check_transforms(layout: Layout, t: float) -> None:
    """Refuse a transform that does not give back its own function at the output time."""
    problem = layout.problem
    sites = [
        (f"the boundary condition of edge {edge}", condition.data, condition.transform,
         layout.collocation.points[layout.collocation.edges == edge][:5])
        for edge, condition in enumerate(problem.boundary)
    ]  # fmt: skip
    if problem.source is not None:
        sites.append(("the heat source", problem.source, problem.source_transform, layout.nodes[:5]))
    for what, data, transform, points in sites:
        if transform is None:
            continue
        given = np.broadcast_to(np.asarray(data(points, t) if callable(data) else data, dtype=float), len(points))
        s, w = talbot_nodes(t)
        back = sum(wk * transformed(data, transform, points, sk, what) for sk, wk in zip(s, w, strict=True)).real
        size = np.abs(given).max() + np.abs(back).max()
        gap = np.abs(back - given).max()
        if gap > TRANSFORM_TOLERANCE * max(size, 1e-12) and gap > 1e-12:
            raise InputError(
                f"the Laplace transform of {what} does not belong to its function: at t = {t:g} it gives "
                f"{back[np.argmax(np.abs(back - given))]:.6g}, the function {given[np.argmax(np.abs(back - given))]:.6g}"
            )


def _initial_reading(probe: Probe) -> Observation:
    layout = probe.layout
    interpolation = interpolate_source(layout.discretization.basis, layout.scaled(layout.nodes), 1.0)
    nodal = interpolation.coefficients(layout.problem.initial_values(layout.nodes))
    return observe_initial(probe, interpolation.gradient_rows(layout.scaled(probe.points)), nodal)


def _checked_times(times: Sequence[float] | Array | float) -> Array:
    values = np.atleast_1d(np.asarray(times, dtype=np.float64))
    if values.ndim != 1 or len(values) == 0 or not np.isfinite(values).all():
        raise InputError(f"output times must be a list of finite numbers, found {times!r}")
    if values[0] < 0.0 or (np.diff(values) <= 0.0).any():
        raise InputError(f"output times must be increasing and not negative, found {values.tolist()}")
    return values


def _checked_points(problem: HeatProblem, points: Sequence[Sequence[float]] | Array) -> Array:
    values = np.asarray(points, dtype=np.float64)
    if values.ndim != 2 or values.shape[1] != 2 or len(values) == 0 or not np.isfinite(values).all():
        raise InputError(f"output points must be positions (x, y), found an array of shape {values.shape}")
    low, high = problem.domain.bounds
    near = problem.domain.edge_distances(values).min(axis=1) <= 1e-9 * np.linalg.norm(high - low)
    outside = ~(problem.domain.contains(values) | near)
    if outside.any():
        first = int(np.argmax(outside))
        raise InputError(
            f"output point {first} at {values[first].tolist()} lies outside the body "
            f"({int(outside.sum())} of {len(values)} do): the field is defined inside only"
        )
    return values


def _note_corner_jumps(problem: HeatProblem, diagnostics: Diagnostics) -> None:
    """Warn where two prescribed temperatures disagree at their common corner."""
    if not isinstance(problem.domain, Polygon):
        return
    for vertex, corner in enumerate(problem.domain.corners):
        pair = problem.boundary[vertex - 1], problem.boundary[vertex]
        if not all(isinstance(condition, Dirichlet) for condition in pair):
            continue
        before, after = (float(condition.sample(corner[None, :], 0.0)[0]) for condition in pair)
        if abs(before - after) > 1e-9 * max(abs(before), abs(after)):
            diagnostics.warn(
                f"prescribed temperatures jump from {before:g} to {after:g} at vertex {vertex}: no smooth field meets "
                "both, so values within a node spacing of that corner are not to be trusted (the nodes leave it out)"
            )


def _residuals(layout: Layout, readings: list[Observation], times: Array) -> Array:
    temperatures = np.concatenate(
        [np.concatenate([reading.temperature.ravel() for reading in readings]),
         layout.problem.initial_values(layout.nodes)]
    )  # fmt: skip
    span = float(np.ptp(temperatures))
    span = span if span > 1e-9 * np.abs(temperatures).max() else max(float(np.abs(temperatures).max()), 1e-300)
    return np.array(
        [boundary_residual(layout, reading.boundary_values[:, 0], float(t), span)
         for reading, t in zip(readings, times, strict=True)]
    )  # fmt: skip


def _judge(layout: Layout, readings: list[Observation], residuals: Array, diagnostics: Diagnostics) -> None:
    """Refuse fields that are not finite; warn about figures outside what was tried and found good."""
    if not all(np.isfinite(reading.temperature).all() for reading in readings):
        raise ConvergenceError("the temperature is not finite: use fewer functions or longer time steps")
    marched = diagnostics.steps > 0
    low, high = STABLE_RANGE
    spacings = diagnostics.lambda_spacing
    if marched and not (low <= min(spacings) and max(spacings) <= high):
        diagnostics.warn(
            f"lambda times the node spacing runs from {min(spacings):.3g} to {max(spacings):.3g}, outside the stable "
            f"range {low} to {high}: use {'more nodes or longer' if max(spacings) > high else 'shorter'} time steps"
        )
    if spacings and diagnostics.boundary_rank < layout.functions:
        diagnostics.warn(
            f"the boundary system has rank {diagnostics.boundary_rank} of {layout.functions}: the remaining singular "
            "values were cut off; use fewer functions or sources closer to the boundary"
        )
    if diagnostics.interpolation_condition > CONDITION_LIMIT:
        diagnostics.warn(
            f"the interpolation matrix has condition number {diagnostics.interpolation_condition:.1e}, so rounding may "
            "dominate the error: use a spline of lower order, fewer nodes or uniform spacing"
        )
    worst = np.nanmax(residuals, initial=0.0)
    if worst > RESIDUAL_LIMIT:
        diagnostics.warn(
            f"the boundary conditions are missed by up to {100.0 * worst:.2g} % of the temperature span between the "
            "boundary nodes: use more boundary nodes and functions"
        )


def _dataset(
    layout: Layout,
    scheme: str,
    times: Array,
    points: Array,
    readings: list[Observation],
    residuals: Array,
    diagnostics: Diagnostics,
) -> xarray.Dataset:
    import xarray

    def variable(dims: tuple[str, ...], values: Array, units: str, name: str) -> tuple:
        return dims, values, {"units": units, "long_name": name}

    return xarray.Dataset(
        {
            "temperature": variable(
                ("time", "point"), np.array([r.temperature[:, 0] for r in readings]), "K", "temperature"
            ),
            "heat_flux": variable(
                ("time", "point", "direction"), np.array([r.heat_flux[:, :, 0] for r in readings]), "W m-2", "heat flux"
            ),
            "mean_temperature": variable(
                ("time",), np.array([r.mean_temperature[0] for r in readings]), "K", "mean temperature of the body"
            ),
            "heat_inflow": variable(
                ("time",), np.array([r.heat_inflow[0] for r in readings]), "W m-1",
                "heat entering through the boundary per unit thickness",
            ),
            "boundary_residual": variable(
                ("time",), residuals, "1", "largest violation of the boundary conditions over the temperature span"
            ),
        },
        coords={
            "time": variable(("time",), times, "s", "time"),
            "x": variable(("point",), points[:, 0], "m", "first coordinate"),
            "y": variable(("point",), points[:, 1], "m", "second coordinate"),
            "direction": ("direction", ["x", "y"]),
        },
        attrs={
            "method": layout.method,
            "scheme": scheme,
            "steps": diagnostics.steps,
            "nodes": len(layout.nodes),
            "boundary_nodes": layout.collocation.count,
            "functions": layout.functions,
            "boundary_rank": diagnostics.boundary_rank,
            "boundary_condition_number": diagnostics.boundary_condition,
            "interpolation_condition_number": diagnostics.interpolation_condition,
            "spectral_radius": diagnostics.spectral_radius,
            "lambda_spacing_max": max(diagnostics.lambda_spacing, default=float("nan")),
            "boundary_residual_max": float(np.nanmax(residuals, initial=0.0)),
            "warnings": "\n".join(diagnostics.warnings),
        },
    )  # fmt: skip
