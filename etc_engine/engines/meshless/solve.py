"""solve_transient: a heat problem in, temperatures, fluxes and diagnostics out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.engines.meshless.diagnostics import Diagnostics, judge, note_corner_jumps, temperature_span
from etc_engine.engines.meshless.discretization import Discretization, Layout, Method, away_from, lay_out
from etc_engine.engines.meshless.helmholtz import prepare_operator
from etc_engine.engines.meshless.laplace import talbot_nodes
from etc_engine.engines.meshless.observation import (
    Observation,
    Probe,
    boundary_residual,
    observe,
    observe_initial,
    prepare_probe,
)
from etc_engine.engines.meshless.particular import interpolate_source
from etc_engine.engines.meshless.polynomials import exponents
from etc_engine.engines.meshless.problem import Data, HeatProblem, Transform, transformed
from etc_engine.engines.meshless.stepping import FACTORS, StepLibrary, march, spectral_radius, step_counts
from etc_engine.errors import InputError

if TYPE_CHECKING:
    import xarray

Scheme = Literal["sdirk2", "bdf2", "crank-nicolson", "backward-euler", "laplace"]

#: A Laplace transform must agree with its function to this part of the function's size.
TRANSFORM_TOLERANCE = 1e-6
#: Numbers of contour nodes that are tried; more pass around poles farther off the real axis and lose digits.
CONTOURS = (16, 32, 64, 96)


def solve_transient(
    problem: HeatProblem,
    times: Sequence[float] | Floats | float,
    points: Sequence[Sequence[float]] | Floats,
    *,
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
        Number of equal time steps up to the last output time (not used by "laplace"). When an output time is
        not a multiple of that step, each interval between output times is cut into its own equal steps, none
        longer.
    discretization : Discretization, optional
        Nodes and functions.

    Returns
    -------
    xarray.Dataset
        ``temperature`` (time, point) [K], ``heat_flux`` (time, point, direction) [W/m2], ``mean_temperature``
        (time) [K], ``heat_inflow`` (time) [W/m], ``boundary_residual`` (time); the diagnostics are
        attributes: condition numbers, ranks, spectral radius of the step, lambda times node spacing,
        warnings.

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
    >>> from etc_engine.engines.meshless import Dirichlet, HeatProblem
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
    layout = away_from(layout, note_corner_jumps(problem, diagnostics))
    if scheme == "laplace":
        layout = _with_fewer_nodes(layout)
    probe = prepare_probe(layout, output_points)
    positive = output_times[output_times > 0.0]
    if scheme == "laplace":
        readings = [_solve_laplace(probe, float(t), diagnostics) for t in positive]
    else:
        readings = _solve_marching(probe, scheme, positive, steps, diagnostics)
    if len(positive) < len(output_times):
        readings.insert(0, _initial_reading(probe))
    span = temperature_span(layout, readings)
    residuals = np.array(
        [
            boundary_residual(layout, reading.boundary_values[:, 0], float(t), span)
            for reading, t in zip(readings, output_times, strict=True)
        ]
    )
    judge(layout, readings, residuals, diagnostics)
    result = _dataset(layout, scheme, output_times, output_points, readings)
    about = {
        "units": "1",
        "long_name": "largest violation of the boundary conditions over the temperature span",
    }
    return result.assign(boundary_residual=("time", residuals, about)).assign_attrs(
        boundary_residual_max=float(np.nanmax(residuals, initial=0.0)), **diagnostics.attributes()
    )


def _solve_marching(
    probe: Probe, scheme: str, times: Floats, steps: int, diagnostics: Diagnostics
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
            diagnostics.note_radius(probe.layout, spectral_radius(snapshot.step, scheme), steps)
        readings.append(observe(probe, operator, snapshot.coefficients()[:, None]))
    diagnostics.steps = int(step_counts(times, int(steps)).sum())
    return readings


def _solve_laplace(probe: Probe, t: float, diagnostics: Diagnostics) -> Observation:
    """Reading at one positive time by Talbot inversion: eight complex Helmholtz problems."""
    layout = probe.layout
    problem = layout.problem
    nodes, weights = talbot_nodes(t, _nodes_needed(layout, t))
    interpolation = None
    total: Observation | None = None
    initial = problem.initial_values(layout.nodes) / problem.diffusivity
    for s, weight in zip(nodes, weights, strict=True):
        lam = complex(layout.scale * np.sqrt(s / problem.diffusivity))
        if interpolation is None or layout.discretization.basis.depends_on_lambda:
            interpolation = interpolate_source(
                layout.discretization.basis, layout.scaled(layout.nodes), lam, layout.wedges
            )
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


def _with_fewer_nodes(layout: Layout) -> Layout:
    """Keep just enough nodes when initial state and source are uniform: a constant needs no more."""
    problem, degree = layout.problem, layout.discretization.basis.polynomial_degree
    if degree < 0 or callable(problem.initial) or callable(problem.source):
        return layout
    needed = 4 * len(exponents(degree))
    return replace(layout, nodes=layout.nodes[:: max(1, len(layout.nodes) // needed)], wedges=())


def _sum(a: Observation, b: Observation) -> Observation:
    return Observation(
        a.temperature + b.temperature,
        a.heat_flux + b.heat_flux,
        a.mean_temperature + b.mean_temperature,
        a.heat_inflow + b.heat_inflow,
        a.boundary_values + b.boundary_values,
    )


def _nodes_needed(layout: Layout, t: float) -> int:
    """Nodes of a contour that gives every function back from its transform at an output time.

    A transform with poles off the real axis (of a function that oscillates) needs a contour that passes around them.

    Raises
    ------
    InputError
        If a transform does not give back its own function on any contour.
    """
    problem = layout.problem
    sites = [
        (f"the boundary condition of edge {edge}", condition.data, condition.transform,
         layout.collocation.points[layout.collocation.edges == edge][:5])
        for edge, condition in enumerate(problem.boundary)
    ]  # fmt: skip
    if problem.source is not None:
        sites.append(("the heat source", problem.source, problem.source_transform, layout.nodes[:5]))
    for count in CONTOURS:
        message = ""
        for what, data, transform, points in sites:
            if transform is not None:
                message = message or _mismatch(what, data, transform, points, (t, count))
        if not message:
            return count
    raise InputError(message)


def _mismatch(what: str, data: Data, transform: Transform, points: Floats, contour: tuple[float, int]) -> str:
    """How a transform, inverted at a time with some nodes, differs from its function; empty if it does not."""
    t = contour[0]
    given = np.broadcast_to(np.asarray(data(points, t) if callable(data) else data, dtype=float), len(points))
    s, w = talbot_nodes(*contour)
    back = sum(wk * transformed(data, transform, points, sk, what) for sk, wk in zip(s, w, strict=True)).real
    size = np.abs(given).max() + np.abs(back).max()
    worst = int(np.argmax(np.abs(back - given)))
    if abs(back[worst] - given[worst]) <= max(TRANSFORM_TOLERANCE * size, 1e-9):
        return ""
    return (
        f"the Laplace transform of {what} does not belong to its function, or oscillates too fast to be inverted: at "
        f"t = {t:g} it gives {back[worst]:.6g}, the function {given[worst]:.6g}"
    )


def _initial_reading(probe: Probe) -> Observation:
    layout = probe.layout
    interpolation = interpolate_source(layout.discretization.basis, layout.scaled(layout.nodes), 1.0, layout.wedges)
    nodal = interpolation.coefficients(layout.problem.initial_values(layout.nodes))
    return observe_initial(probe, interpolation.gradient_rows(layout.scaled(probe.points)), nodal)


def _checked_times(times: Sequence[float] | Floats | float) -> Floats:
    values = np.atleast_1d(np.asarray(times, dtype=np.float64))
    if values.ndim != 1 or len(values) == 0 or not np.isfinite(values).all():
        raise InputError(f"output times must be a list of finite numbers, found {times!r}")
    if values[0] < 0.0 or (np.diff(values) <= 0.0).any():
        raise InputError(f"output times must be increasing and not negative, found {values.tolist()}")
    return values


def _checked_points(problem: HeatProblem, points: Sequence[Sequence[float]] | Floats) -> Floats:
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


def _dataset(layout: Layout, scheme: str, times: Floats, points: Floats, readings: list[Observation]) -> xarray.Dataset:
    import xarray

    def stacked(name: str) -> Floats:
        return np.array([getattr(reading, name)[..., 0] for reading in readings])

    variables = {
        "temperature": (("time", "point"), "K", "temperature"),
        "heat_flux": (("time", "point", "direction"), "W m-2", "heat flux"),
        "mean_temperature": (("time",), "K", "mean temperature of the body"),
        "heat_inflow": (("time",), "W m-1", "heat entering through the boundary per unit thickness"),
    }
    return xarray.Dataset(
        {
            name: (dims, stacked(name), {"units": units, "long_name": long_name})
            for name, (dims, units, long_name) in variables.items()
        },
        coords={
            "time": ("time", times, {"units": "s", "long_name": "time"}),
            "x": ("point", points[:, 0], {"units": "m", "long_name": "first coordinate"}),
            "y": ("point", points[:, 1], {"units": "m", "long_name": "second coordinate"}),
            "direction": ("direction", ["x", "y"]),
        },
        attrs={
            "method": layout.method,
            "scheme": scheme,
            "nodes": len(layout.nodes),
            "boundary_nodes": layout.collocation.count,
            "functions": layout.columns,
        },
    )
