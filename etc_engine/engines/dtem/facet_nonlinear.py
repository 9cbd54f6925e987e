"""Steady conduction between a hot and a cold wall with properties that follow the local temperature."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.engines.dtem.facet_elements import FacetMaterial, facet_sides
from etc_engine.engines.dtem.facet_steady import FacetSolution, solve_sides
from etc_engine.errors import ConvergenceError, InputError
from etc_engine.medium.facets import FacetLinks
from etc_engine.medium.loads import driven_walls

LINEAR = 1e-18
"""Relative error of the energy left in each linear problem: about 1e-9 of its temperatures."""
MaterialAt = Callable[[Floats, Floats], FacetMaterial]
"""Material from the temperatures [K] of the spheres, shape (n,), and of the links, shape (m + w,)."""


@dataclass(frozen=True, eq=False)
class NonlinearSolution:
    """Temperatures and heat flow between two walls.

    Parameters
    ----------
    solution : FacetSolution
        Of the last linear problem: hot wall 1, cold wall 0.
    temperatures : ndarray, shape (n,) [K]
        Of the spheres.
    heat_flow : float [W]
        From the hot to the cold wall.
    imbalance : float [-]
        Difference of what enters at one wall and leaves at the other, over the heat flow.
    conductivity : float [W/(m K)]
        Q L/(S (T_hot - T_cold)), the mean over the temperatures between the walls.
    iterations : int
    change : float [K]
        Largest change of a temperature in the last iteration.
    """

    solution: FacetSolution
    temperatures: Floats
    heat_flow: float
    imbalance: float
    conductivity: float
    iterations: int
    change: float


def solve_nonlinear(
    links: FacetLinks,
    material_at: MaterialAt,
    axis: int,
    walls: tuple[float, float],
    *,
    tolerance: float = 1e-6,
    most: int = 60,
) -> NonlinearSolution:
    r"""Picard iteration: solve with the properties of the last temperatures until these stay.

    .. math:: K(T^{(n)})\, T^{(n+1)} = f, \qquad \max_p |T_p^{(n+1)} - T_p^{(n)}| < \epsilon

    Parameters
    ----------
    links : FacetLinks
    material_at : callable
        Material from the temperatures of spheres and links. A link has the mean temperature of its two spheres, or of
        its sphere and its wall.
    axis : int
        Normal of the two walls; not periodic.
    walls : (float, float) [K]
        Temperature of the wall at the low end, and at the far end.
    tolerance : float [K]
        Largest change of a temperature in the last iteration.
    most : int
        Largest number of iterations.

    Returns
    -------
    NonlinearSolution

    Raises
    ------
    InputError
        If the axis is periodic, or the walls are not two positive different temperatures.
    ConvergenceError
        If the temperatures still change after ``most`` iterations.

    Notes
    -----
    Every iteration is a linear problem on the same links; the tessellation and the rings' geometry are shared. The heat
    balance of the last one is that of the solver.
    """
    low, high = walls
    if links.packing.box.periodic[axis]:
        raise InputError(f"properties follow the temperature between two walls: axis {'xyz'[axis]} is periodic")
    if not (low > 0.0 and high > 0.0 and np.isfinite([low, high]).all() and low != high):
        raise InputError(f"the walls need two different absolute temperatures [K], found {low:g} and {high:g}")
    share = links.packing.centers[:, axis] / links.packing.box.lengths[axis]
    temperatures = low + (high - low) * np.clip(share, 0.0, 1.0)
    change = np.inf
    sides, solution = None, None
    for iteration in range(1, most + 1):
        inside = np.clip(temperatures, min(walls), max(walls))  # facet links may pass a wall by a little
        material = material_at(inside, link_temperatures(links, inside, axis_walls(links, axis, walls)))
        if sides is None:
            sides = facet_sides(links, driven_walls(links, (axis,)), bool((material.open_fluid > 0.0).all()))
        solution, _ = solve_sides(links, material, (axis,), sides, tolerance=LINEAR, nearby=solution)
        found = high + (low - high) * solution.sphere_temperatures[:, 0]
        change = float(np.abs(found - temperatures).max())
        temperatures = found
        if change < tolerance:
            return _balanced(solution, temperatures, axis, walls, (iteration, change))
    raise ConvergenceError(
        f"after {most} iterations a temperature still changes by {change:.3g} K, {tolerance:g} K was asked for: bring "
        "the walls closer, or raise the number of iterations"
    )


def axis_walls(links: FacetLinks, axis: int, walls: tuple[float, float]) -> Floats:
    """Temperature of every wall of the box, shape (2 d,) [K]; NaN but for the two of an axis."""
    found = np.full(2 * links.packing.dimension, np.nan)
    found[2 * axis : 2 * axis + 2] = walls
    return found


def link_temperatures(links: FacetLinks, temperatures: Floats, walls: Floats) -> Floats:
    """Temperature of every link, shape (m + w,) [K]: the mean of its two ends.

    Parameters
    ----------
    links : FacetLinks
    temperatures : ndarray, shape (n,) [K]
        Of the spheres.
    walls : ndarray, shape (2 d,) [K]
        Of the walls of the box; at one that is NaN the link has the temperature of its sphere.
    """
    between = temperatures[links.pairs].mean(axis=1)
    own = temperatures[links.wall_particles]
    wall = walls[links.walls]
    return np.concatenate([between, 0.5 * (own + np.where(np.isnan(wall), own, wall))])


def _balanced(
    solution: FacetSolution, temperatures: Floats, axis: int, walls: tuple[float, float], last: tuple[int, float]
) -> NonlinearSolution:
    enters, leaves = solution.wall_heat()
    lengths = np.asarray(solution.links.packing.box.lengths)
    area = float(np.prod(lengths) / lengths[axis])
    drop = abs(walls[0] - walls[1])
    return NonlinearSolution(
        solution,
        temperatures,
        enters * drop,
        (enters - leaves) / enters,
        enters * float(lengths[axis]) / area,
        *last,
    )
