"""Effective conductivity from energies: the only place that divides by a volume or by a cross-section.

Walls: k_aa = E_aa L_a / S_a at a temperature difference of 1, where E_aa is also the heat flow.
Periodic: k_ab = E_ab / V at mean gradients of 1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.box import AXES, Box
from etc_engine.errors import ConvergenceError
from etc_engine.medium.backbone import Backbone
from etc_engine.medium.loads import asked_groups
from etc_engine.solvers import SolveReport

BALANCE = 1e-6
"""The wall flows of a solution must agree with its energy and with each other to this part of the flux."""


class LoadSolution(Protocol):
    """The solution for one walled axis, or for periodic axes together."""

    @property
    def backbone(self) -> Backbone:
        """What takes part."""

    @property
    def energies(self) -> Floats:
        """Energy of every pair of loads, shape (k, k)."""

    @property
    def reports(self) -> tuple[SolveReport, ...]:
        """One per load."""

    def wall_heat(self) -> tuple[float, float]:
        """Heat flow in at the low wall and out at the far one, between walls only."""


Solution = TypeVar("Solution")
Solved = TypeVar("Solved", bound=LoadSolution)


@dataclass(frozen=True, eq=False)
class EffectiveConductivity(Generic[Solution]):
    """Effective conductivity of one medium.

    Parameters
    ----------
    tensor : ndarray, shape (d, d) [W/(m K)]
        Symmetric for a periodic box; components that walls leave undefined, or that were not asked for, are NaN.
    spans : tuple of bool or None
        For each axis, whether something that conducts spans it; None if it was not asked for.
    unknowns, iterations : int
        Largest of a load.
    relative_energy_error : float
        Largest relative error of the conductivity that the solver is estimated to leave.
    solutions : tuple
        The solutions behind it, each of the type of its engine.
    model_error : float
        Estimated relative error of the method or of its discretization; NaN where there is no estimate.
    bounds : ndarray, shape (d, 2), optional [W/(m K)]
        Lower and upper bound along each axis, of methods that give them; NaN where it was not asked for.
    solid_fraction : float
        Of the particles in the geometry that was solved; NaN where the pores are not resolved.
    snapshots : int
        Full solutions that a reduced one is made of, 0 for a full one.
    certified : bool
        Whether the error of a reduced solution is a proven bound.
    seconds : float
    heat_imbalance : float
        Largest difference of the heat in at one wall and out at the other, over the heat flow, where properties follow
        the local temperature; NaN elsewhere.
    picard_iterations : int
        Largest number of linear problems of an axis there, 0 elsewhere.
    """

    tensor: Floats
    spans: tuple[bool | None, ...]
    unknowns: int
    iterations: int
    relative_energy_error: float
    solutions: tuple[Solution, ...] = ()
    model_error: float = np.nan
    bounds: Floats | None = None
    solid_fraction: float = np.nan
    snapshots: int = 0
    certified: bool = False
    seconds: float = 0.0
    heat_imbalance: float = np.nan
    picard_iterations: int = 0

    @property
    def conductivity(self) -> float | Floats:
        """The number k along the one axis that was asked for, or else the tensor [W/(m K)].

        See `mean` for the mean over all axes.
        """
        diagonal = np.diag(self.tensor)
        asked = np.isfinite(diagonal)
        return float(diagonal[asked][0]) if asked.sum() == 1 else self.tensor

    def __repr__(self) -> str:
        """Conductivity along each axis, unknowns, and the error that the solver leaves."""
        axes = [f"{AXES[a]} {k:.6g}" for a, k in enumerate(np.diag(self.tensor)) if np.isfinite(k)]
        return (
            f"<EffectiveConductivity: k along {', '.join(axes) or 'no axis'} W/(m K), {self.unknowns} unknowns, "
            f"relative error of the solver {self.relative_energy_error:.1g}>"
        )

    @property
    def missing_axes(self) -> str:
        """Axes that nothing spans, as a word."""
        return "".join(AXES[axis] for axis, flag in enumerate(self.spans) if flag is False)

    @property
    def mean(self) -> float:
        """Mean of the diagonal over the axes asked for [W/(m K)]."""
        return float(np.nanmean(np.diag(self.tensor)))


def conductivities(box: Box, axes: Sequence[int], energies: Floats) -> Floats:
    """Conductivity tensor of a group of load axes from the energies of its loads, shape (k, k) [W/(m K)].

    Parameters
    ----------
    box : Box
    axes : sequence of int
        A single walled axis, or periodic axes only.
    energies : ndarray, shape (k, k) [W K, in 2D W K/m]
        Of every pair of loads: a temperature difference of 1 between walls, mean gradients of 1.
    """
    if box.periodic[axes[0]]:
        return np.asarray(0.5 * (energies + energies.T) / box.volume)
    return energies * box.lengths[axes[0]] / box.cross_section(axes[0])


def effective_tensor(
    box: Box, axes: tuple[int, ...] | None, solve: Callable[[tuple[int, ...]], Solved]
) -> EffectiveConductivity[Solved]:
    """Solve every group of load axes and put the tensor together.

    Parameters
    ----------
    box : Box
    axes : tuple of int or None
        Load axes wanted; all for None.
    solve : callable
        Group of load axes -> solution.

    Raises
    ------
    ConvergenceError
        If the heat flows at two walls differ from each other or from the energy by more than `BALANCE`.
    """
    tensor = np.full((box.dimension, box.dimension), np.nan)
    spans: list[bool | None] = [None] * box.dimension
    solutions = []
    for group in asked_groups(box, axes):
        solution = solve(group)
        for axis, flag in zip(group, solution.backbone.spans, strict=True):
            spans[axis] = flag
        if not box.periodic[group[0]]:
            check_balance(*solution.wall_heat(), float(solution.energies[0, 0]))
        spanned = np.outer(solution.backbone.spans, solution.backbone.spans)
        tensor[np.ix_(group, group)] = conductivities(box, group, solution.energies) * spanned
        solutions.append(solution)
    reports = [report for solution in solutions for report in solution.reports]
    return EffectiveConductivity(
        tensor,
        tuple(spans),
        max((report.unknowns for report in reports), default=0),
        max((report.iterations for report in reports), default=0),
        max((report.relative_energy_error for report in reports), default=0.0),
        tuple(solutions),
    )


def check_balance(heat_in: float, heat_out: float, energy: float) -> None:
    """Refuse heat flows at two walls that differ from each other or from the energy.

    Raises
    ------
    ConvergenceError
    """
    if max(abs(heat_in - heat_out), abs(heat_in - energy)) > BALANCE * abs(energy):
        raise ConvergenceError(
            f"the heat flows do not balance: {heat_in:.10g} in, {heat_out:.10g} out, energy {energy:.10g}; "
            f"conductivities so far apart leave too much round-off: bring them closer, or ask for a smaller tolerance"
        )


def affine_conductivity(box: Box, branches: Floats, conductances: Floats) -> float:
    """Mean conductivity over the axes of a network of links whose nodes all follow the mean gradient.

    k = 1/(d V) sum_c C_c |b_c|^2, an upper bound of the network in a periodic box.

    Parameters
    ----------
    box : Box
    branches : ndarray, shape (m, d) [m]
    conductances : ndarray, shape (m,) [W/K, in 2D W/(m K)]
    """
    return float((conductances * (branches**2).sum(axis=1)).sum() / (box.dimension * box.volume))
