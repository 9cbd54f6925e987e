"""The effective conductivity tensor of a packing, put together from solutions by groups of load axes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from etc_engine.box import AXES, Box
from etc_engine.errors import ConvergenceError
from etc_engine.medium.backbone import Backbone, asked_groups
from etc_engine.solvers import SolveReport

BALANCE = 1e-6
"""The wall flows of a solution must agree with its energy and with each other to this part of the flux."""


class LoadSolution(Protocol):
    """The solution for one walled axis, or for periodic axes together."""

    @property
    def backbone(self) -> Backbone:
        """What takes part."""

    @property
    def energies(self) -> NDArray[np.float64]:
        """Energy of every pair of loads, shape (k, k)."""

    @property
    def reports(self) -> tuple[SolveReport, ...]:
        """One a load."""


Solution = TypeVar("Solution", bound=LoadSolution)


@dataclass(frozen=True, eq=False)
class EffectiveConductivity(Generic[Solution]):
    """Effective conductivity of one packing.

    Parameters
    ----------
    tensor : ndarray, shape (d, d) [W/(m K)]
        Symmetric for a periodic box; components that walls leave undefined, or that were not asked for, are NaN.
    spans : tuple of bool or None
        For each axis, whether some cluster of contacts spans it; None if it was not asked for.
    solutions : tuple
        The solutions behind it, each of the type of its engine.
    """

    tensor: NDArray[np.float64]
    spans: tuple[bool | None, ...]
    solutions: tuple[Solution, ...]

    @property
    def unknowns(self) -> int:
        """Largest number of unknowns of a solve, dead ends taken out."""
        return max((r.unknowns for s in self.solutions for r in s.reports), default=0)

    @property
    def iterations(self) -> int:
        """Largest number of iterations of a solve."""
        return max((r.iterations for s in self.solutions for r in s.reports), default=0)

    @property
    def relative_energy_error(self) -> float:
        """Largest relative error of the conductivity estimated by a solve."""
        return max((r.relative_energy_error for s in self.solutions for r in s.reports), default=0.0)

    @property
    def missing_axes(self) -> str:
        """Axes that no path of contacts spans, as a word."""
        return "".join(AXES[axis] for axis, flag in enumerate(self.spans) if flag is False)


def assemble_tensor(
    box: Box,
    axes: tuple[int, ...] | None,
    solve: Callable[[tuple[int, ...]], Solution],
    wall_heat_flows: Callable[[Solution], tuple[float, float]],
) -> EffectiveConductivity[Solution]:
    """Solve every group of load axes and put the tensor together.

    Walls: k_aa = Q L_a / (S_a dT). Periodic: k_ab = (1/area) times the energy of the loads a and b.

    Parameters
    ----------
    box : Box
    axes : tuple of int or None
        Load axes wanted; all for None.
    solve : callable
        Group of load axes -> solution.
    wall_heat_flows : callable
        Solution between walls -> heat flow in at the low wall, and out at the far one [W/m].

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
        if box.periodic[group[0]]:
            spanned = np.outer(solution.backbone.spans, solution.backbone.spans)
            tensor[np.ix_(group, group)] = 0.5 * (solution.energies + solution.energies.T) / box.volume * spanned
        else:
            axis, energy = group[0], float(solution.energies[0, 0])
            check_balance(*wall_heat_flows(solution), energy)
            tensor[axis, axis] = energy * box.lengths[axis] / box.cross_section(axis)
        solutions.append(solution)
    return EffectiveConductivity(tensor, tuple(spans), tuple(solutions))


def check_balance(heat_in: float, heat_out: float, energy: float) -> None:
    """Refuse heat flows at two walls that differ from each other or from the energy.

    Raises
    ------
    ConvergenceError
    """
    if max(abs(heat_in - heat_out), abs(heat_in - energy)) > BALANCE * abs(energy):
        raise ConvergenceError(
            f"the heat flows do not balance: {heat_in:.10g} in, {heat_out:.10g} out, energy {energy:.10g}; "
            f"ask for a smaller tolerance"
        )
