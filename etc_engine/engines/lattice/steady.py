"""Steady conduction through a lattice: between walls, or with a mean gradient through a periodic box."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.engines.lattice.network import Conductances, Lattice
from etc_engine.medium.conductivity import EffectiveConductivity, effective_tensor
from etc_engine.medium.links import LinkSolution, solve_links
from etc_engine.solvers import SolveReport

FACTORISED = 1500
"""Graphs in space fill in: from this many unknowns on, multigrid is faster than a sparse factorisation."""

FREE = np.nan
"""Temperature of an adiabatic wall."""


@dataclass(frozen=True, eq=False)
class SteadyField:
    """A steady temperature field of a lattice.

    Parameters
    ----------
    lattice : Lattice
    conductances : Conductances
    gradient : ndarray, shape (3,) [K/m]
        Mean temperature gradient along the periodic axes.
    temperatures : ndarray, shape (n,) [K]
        Temperature of each node less that of the mean gradient; NaN where no path leads to.
    wall_temperatures : ndarray, shape (6,) [K]
        NaN for an adiabatic wall.
    energy : float [W K]
        Sum of H dT^2 over all links.
    report : SolveReport
    """

    lattice: Lattice
    conductances: Conductances
    gradient: Floats
    temperatures: Floats
    wall_temperatures: Floats
    energy: float
    report: SolveReport

    @property
    def link_flows(self) -> Floats:
        """Heat flow from i to j through every link, shape (m,) [W]."""
        i, j = self.lattice.pairs.T
        rise = self.lattice.branches @ self.gradient + self.temperatures[j] - self.temperatures[i]
        return np.where(self.conductances.links > 0.0, -self.conductances.links * np.nan_to_num(rise), 0.0)

    @property
    def wall_flows(self) -> Floats:
        """Heat flow out of the body through every wall link, shape (w,) [W]; 0 at adiabatic walls."""
        rise = self.wall_temperatures[self.lattice.walls] - self.temperatures[self.lattice.wall_particles]
        return -self.conductances.walls * np.nan_to_num(rise)


def solve_between_walls(
    lattice: Lattice,
    conductances: Conductances,
    axis: int,
    *,
    temperatures: tuple[float, float] = (1.0, 0.0),
    tolerance: float = 1e-10,
) -> SteadyField:
    """Steady field between the two walls of an axis at given temperatures, all other walls adiabatic.

    Parameters
    ----------
    lattice : Lattice
    conductances : Conductances
    axis : int
        A walled axis.
    temperatures : tuple of float [K]
        Of the walls at 0 and at the far end.
    tolerance : float
        Relative error of the conductivity left by the iterative solver.

    Returns
    -------
    SteadyField

    Raises
    ------
    ConvergenceError

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.engines.lattice.network import laguerre_lattice, link_conductances
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> two = ParticlePacking([[0.25, 0.5, 0.5], [0.8, 0.5, 0.5]], [0.2, 0.1], Box((1.0, 1.0, 1.0)))
    >>> lattice = laguerre_lattice(two)
    >>> field = solve_between_walls(lattice, link_conductances(lattice, 2.0), 0)
    >>> field.temperatures.round(12), round(field.energy, 12)
    (array([0.75, 0.2 ]), 2.0)
    """
    solution = solve_lattice(lattice, conductances, (axis,), tolerance=tolerance)
    low, high = temperatures
    wall_temperatures = np.full(6, FREE)
    wall_temperatures[2 * axis : 2 * axis + 2] = low, high
    field = _field(lattice, conductances, solution, 0)
    return replace(
        field,
        temperatures=high + (low - high) * field.temperatures,
        wall_temperatures=wall_temperatures,
        energy=(high - low) ** 2 * field.energy,
    )


def solve_with_gradient(
    lattice: Lattice, conductances: Conductances, axis: int, *, tolerance: float = 1e-10
) -> SteadyField:
    """Periodic fluctuation about a unit mean gradient along a periodic axis, all walls adiabatic.

    Parameters
    ----------
    lattice, conductances, tolerance
        As in `solve_between_walls`.
    axis : int
        A periodic axis.

    Returns
    -------
    SteadyField

    Raises
    ------
    ConvergenceError
    """
    return _field(lattice, conductances, solve_lattice(lattice, conductances, (axis,), tolerance=tolerance), 0)


def solve_lattice(
    lattice: Lattice, conductances: Conductances, axes: tuple[int, ...], *, tolerance: float = 1e-10
) -> LinkSolution:
    """One load group of a lattice; arguments as in `etc_engine.medium.links.solve_links`."""
    return solve_links(
        lattice, axes, conductances.links, conductances.walls, tolerance=tolerance, exact_level=FACTORISED
    )


def _field(lattice: Lattice, conductances: Conductances, solution: LinkSolution, load: int) -> SteadyField:
    """One load of a solution, its mean gradient apart."""
    axis, temperatures = solution.axes[load], solution.temperatures[:, load]
    gradient, walls = np.zeros(3), np.full(6, FREE)
    if lattice.packing.box.periodic[axis]:
        gradient[axis] = 1.0
        temperatures = temperatures - lattice.packing.centers[:, axis]
    else:
        walls[2 * axis : 2 * axis + 2] = (1.0, 0.0)
    energy = float(solution.energies[load, load])
    return SteadyField(lattice, conductances, gradient, temperatures, walls, energy, solution.reports[load])


def conductivity_tensor(
    lattice: Lattice, conductances: Conductances, *, tolerance: float = 1e-10
) -> EffectiveConductivity[LinkSolution]:
    """Effective conductivity tensor of a lattice.

    Walls: k_aa = Q L_a / (A_a dT). Periodic: k_ab = (1/V) sum H dT_a dT_b over all links.

    Parameters
    ----------
    lattice, conductances, tolerance
        As in `solve_between_walls`.

    Returns
    -------
    EffectiveConductivity
        0 along an axis that no links span.

    Raises
    ------
    ConvergenceError

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.engines.lattice.network import laguerre_lattice, link_conductances
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> seeds = np.random.default_rng(5).random((50, 3))
    >>> lattice = laguerre_lattice(ParticlePacking(seeds, np.full(50, 0.01), Box((1, 1, 1), (True, True, True))))
    >>> conductivity_tensor(lattice, link_conductances(lattice, 3.0)).tensor.round(9) + 0.0
    array([[3., 0., 0.],
           [0., 3., 0.],
           [0., 0., 3.]])
    """
    return effective_tensor(
        lattice.packing.box, None, lambda axes: solve_lattice(lattice, conductances, axes, tolerance=tolerance)
    )


def lattice_fields(
    lattice: Lattice, conductances: Conductances, result: EffectiveConductivity[LinkSolution]
) -> tuple[SteadyField, ...]:
    """The steady fields behind a conductivity, one per axis."""
    fields = {
        axis: _field(lattice, conductances, solution, load)
        for solution in result.solutions
        for load, axis in enumerate(solution.axes)
    }
    return tuple(fields[axis] for axis in sorted(fields))
