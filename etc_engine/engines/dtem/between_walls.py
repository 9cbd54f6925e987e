"""A medium between a hot and a cold wall, with solid, gas and radiation at the local temperature."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.engines.dtem.facet_elements import FacetMaterial
from etc_engine.engines.dtem.facet_medium import medium_links, medium_material
from etc_engine.engines.dtem.facet_nonlinear import NonlinearSolution, solve_nonlinear
from etc_engine.medium.conditions import Conditions, pores_at
from etc_engine.medium.medium import Medium

NODES = 65
"""Temperatures between the walls at which the properties of the pores are evaluated."""


def solve_between_walls(
    medium: Medium,
    axis: int,
    walls: tuple[float, float],
    conditions: Conditions,
    solid: Callable[[Floats], Floats] | None = None,
) -> NonlinearSolution:
    """Steady conduction with properties that follow the temperature, by facet links.

    Parameters
    ----------
    medium : Medium
        Its contacts, and the properties that do not change.
    axis : int
        Normal of the walls; not periodic.
    walls : (float, float) [K]
        At the low and at the far end.
    conditions : Conditions
        Gas and radiation; their temperature is replaced by the local one.
    solid : callable, optional
        Conductivity of the spheres [W/(m K)] from their temperatures [K]; that of the medium without it.

    Returns
    -------
    NonlinearSolution

    Raises
    ------
    InputError
        Also if a wall is out of the range of a property.
    ConvergenceError

    Notes
    -----
    Properties of the pores are cubic splines through 65 temperatures between the walls. A sphere has one temperature,
    a link the mean of its two.
    """
    from scipy.interpolate import CubicSpline

    links = medium_links(medium)
    fixed = medium_material(medium, links)
    grid = np.linspace(min(walls), max(walls), NODES)
    found = [
        pores_at(replace(conditions, temperature=float(t)), medium.packing, medium.pores.conductivity) for t in grid
    ]
    columns = np.array([[p.conductivity, p.in_open_pores, p.jump_length, p.radiation] for p in found])
    pores = CubicSpline(grid, columns)

    def material_at(spheres: Floats, between: Floats) -> FacetMaterial:
        fluid, open_fluid, jumps, radiation = np.maximum(pores(np.clip(between, grid[0], grid[-1])), 0.0).T
        conductivity = fixed.conductivity if solid is None else solid(np.clip(spheres, grid[0], grid[-1]))
        return FacetMaterial(conductivity, fluid, np.minimum(open_fluid, fluid), jumps, radiation)

    return solve_nonlinear(links, material_at, axis, walls)
