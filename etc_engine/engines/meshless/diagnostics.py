"""What a solution says about itself: condition numbers, stability, residuals; when it warns or refuses."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.engines.meshless.discretization import Layout
from etc_engine.engines.meshless.domain import Polygon
from etc_engine.engines.meshless.helmholtz import HelmholtzOperator
from etc_engine.engines.meshless.observation import Observation
from etc_engine.engines.meshless.problem import Dirichlet, HeatProblem
from etc_engine.errors import ConvergenceError

#: lambda times the node spacing within which time marching was found stable (both methods, splines of
#: order 1 to 3, square and L): larger values leave the Trefftz part unstable, smaller ones the splines.
STABLE_RANGE = (0.1, 4.0)
#: Beyond this condition number of the interpolation, rounding was seen to reach 1e-5 of the field.
CONDITION_LIMIT = 1e16
#: Growth of a disturbance over a whole run (exponent) that is worth a warning, and that is refused.
GROWTH_WARNED, GROWTH_REFUSED = 0.05, 1.0


class DiscretizationWarning(UserWarning):
    """The field is less accurate than the method promises; the message says where and why."""


@dataclass
class Diagnostics:
    """Figures gathered while solving; they become the attributes of the dataset."""

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

    def note_radius(self, layout: Layout, radius: float, steps: int) -> None:
        """Keep a step's spectral radius; warn about slow growth, refuse fast growth.

        Raises
        ------
        ConvergenceError
            If a disturbance grows by more than a factor e over the run.
        """
        self.spectral_radius = float(np.fmax(self.spectral_radius, radius))
        growth = (radius - 1.0) * steps
        if growth <= GROWTH_WARNED:
            return
        message = (
            f"time marching is unstable: the spectral radius of a step is {radius:.6g} with "
            f"{layout.columns} functions on {layout.collocation.count} boundary nodes; use fewer "
            'functions, splines of lower order, more nodes or longer steps, or method="mfs"'
        )
        if growth > GROWTH_REFUSED and not layout.discretization.allow_unstable:
            raise ConvergenceError(message)
        self.warn(message)

    def warn(self, message: str) -> None:
        """Record a warning and raise it as a Python warning."""
        self.warnings.append(message)
        warnings.warn(message, DiscretizationWarning, stacklevel=4)

    def attributes(self) -> dict[str, float | int | str]:
        """The figures under the names they have in the dataset."""
        return {
            "steps": self.steps,
            "boundary_rank": self.boundary_rank,
            "boundary_condition_number": self.boundary_condition,
            "interpolation_condition_number": self.interpolation_condition,
            "spectral_radius": self.spectral_radius,
            "lambda_spacing_max": max(self.lambda_spacing, default=float("nan")),
            "warnings": "\n".join(self.warnings),
        }


def note_corner_jumps(problem: HeatProblem, diagnostics: Diagnostics) -> list[int]:
    """Warn where two prescribed temperatures disagree at their common corner; returns those vertices."""
    jumps: list[int] = []
    if not isinstance(problem.domain, Polygon):
        return jumps
    for vertex, corner in enumerate(problem.domain.corners):
        pair = problem.boundary[vertex - 1], problem.boundary[vertex]
        if not all(isinstance(condition, Dirichlet) for condition in pair):
            continue
        before, after = (float(condition.sample(corner[None, :], 0.0)[0]) for condition in pair)
        if abs(before - after) > 1e-9 * max(abs(before), abs(after)):
            jumps.append(vertex)
            diagnostics.warn(
                f"prescribed temperatures jump from {before:g} to {after:g} at vertex {vertex}: no smooth "
                "field meets both, so values within a node spacing of that corner are not to be trusted (no "
                "boundary node is set there)"
            )
    return jumps


def temperature_span(layout: Layout, readings: list[Observation]) -> float:
    """Range of the temperatures read and of the initial state; their size if all are equal."""
    read = [reading.temperature.ravel() for reading in readings]
    values = np.concatenate([*read, layout.problem.initial_values(layout.nodes)])
    span, size = float(np.ptp(values)), float(np.abs(values).max())
    return span if span > 1e-9 * size else max(size, 1e-300)


def judge(layout: Layout, readings: list[Observation], residuals: Floats, diagnostics: Diagnostics) -> None:
    """Refuse fields that are not finite or miss their boundary; warn about figures outside what was tried.

    Raises
    ------
    ConvergenceError
    """
    if not all(np.isfinite(reading.temperature).all() for reading in readings):
        raise ConvergenceError("the temperature is not finite: use fewer functions or longer time steps")
    spacings = diagnostics.lambda_spacing
    low, high = STABLE_RANGE
    if diagnostics.steps and not (low <= min(spacings) and max(spacings) <= high):
        cure = "more nodes or longer time steps" if max(spacings) > high else "shorter time steps"
        diagnostics.warn(
            f"lambda times the node spacing runs from {min(spacings):.3g} to {max(spacings):.3g}, outside "
            f"the stable range {low} to {high}: use {cure}"
        )
    if spacings and diagnostics.boundary_rank < layout.columns - layout.clustered:
        diagnostics.warn(
            f"the boundary system has rank {diagnostics.boundary_rank} of {layout.columns}: the remaining "
            "singular values were cut off; use fewer functions or sources closer to the boundary"
        )
    if diagnostics.interpolation_condition > CONDITION_LIMIT:
        diagnostics.warn(
            f"the interpolation matrix has condition number {diagnostics.interpolation_condition:.1e}, so "
            "rounding may dominate the error: use a spline of lower order, fewer nodes or uniform spacing"
        )
    worst = np.nanmax(residuals, initial=0.0)
    if worst > layout.discretization.residual_limit:
        raise ConvergenceError(
            f"the boundary conditions are missed by up to {100.0 * worst:.2g} % of the temperature span between the "
            f"boundary nodes, more than {100.0 * layout.discretization.residual_limit:.2g} %: use more boundary nodes "
            "and functions, or accept it by a larger residual_limit"
        )
