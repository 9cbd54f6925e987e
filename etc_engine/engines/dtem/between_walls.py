"""Media between a hot and a cold wall, with solid, gas and radiation at the local temperature."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from etc_engine.engines.dtem import facet_medium
from etc_engine.engines.dtem.facet_medium import local_material, medium_links
from etc_engine.engines.dtem.facet_nonlinear import NonlinearSolution, solve_nonlinear
from etc_engine.engines.dtem.facet_steady import FacetSolution
from etc_engine.errors import InputError
from etc_engine.medium.conduction import Conduction, Result, attempt
from etc_engine.medium.conductivity import EffectiveConductivity, check_balance
from etc_engine.medium.facets import FacetLinks
from etc_engine.medium.loads import asked_groups
from etc_engine.medium.medium import Medium


def solve_series(media: Sequence[Medium], conduction: Conduction) -> list[Result]:
    """Effective conductivity of media on one packing; those whose walls have temperatures one by one."""
    rows = [row for row, medium in enumerate(media) if medium.local is None]
    found = dict(zip(rows, facet_medium.solve_series([media[row] for row in rows], conduction), strict=True))
    shared: dict[int, FacetLinks] = {}
    for row, medium in enumerate(media):
        if row not in found:
            found[row] = attempt(partial(_conductivity, medium, conduction, shared))
    return [found[row] for row in range(len(media))]


def _conductivity(
    medium: Medium, conduction: Conduction, shared: dict[int, FacetLinks]
) -> EffectiveConductivity[FacetSolution]:
    """`conductivity_between_walls` on the facets of a contact network that was met before."""
    key = id(medium.network)
    if key not in shared:
        shared[key] = medium_links(medium)
    return conductivity_between_walls(medium, axes=conduction.axes, links=shared[key])[0]


def conductivity_between_walls(
    medium: Medium,
    *,
    axes: tuple[int, ...] | None = None,
    links: FacetLinks | None = None,
) -> tuple[EffectiveConductivity[FacetSolution], dict[int, NonlinearSolution]]:
    r"""Conductivity between two walls, with properties that follow the temperature from one to the other.

    .. math:: k_{aa} = \frac{Q L_a}{S_a (T_{hot} - T_{cold})}

    Parameters
    ----------
    medium : Medium
        With local properties, and temperatures of the walls in them.
    axes : tuple of int, optional
        Load axes; all by default.
    links : FacetLinks, optional
        Of the same network, if already known.

    Returns
    -------
    EffectiveConductivity
        NaN along axes without walls.
    dict of int to NonlinearSolution
        By axis.

    Raises
    ------
    InputError
        If none of the axes has walls, or the walls have no temperatures; also if one is out of the range of a property.
    ConvergenceError
    """
    walls = None if medium.local is None else medium.local.walls
    if walls is None:
        raise InputError("properties follow the temperature between two walls: give the temperatures of the walls")
    links = links or medium_links(medium)
    box = links.packing.box
    material_at = local_material(medium, links)
    found = {
        axis: solve_nonlinear(links, material_at, axis, walls)
        for (axis, *_) in asked_groups(box, axes)
        if not box.periodic[axis]
    }
    if not found:
        raise InputError(
            f"properties follow the temperature between two walls: expected a box with walls along an axis asked for, "
            f"found one that is periodic along {box.periodic_axes}"
        )
    tensor, spans = np.full((3, 3), np.nan), [None if axis not in found else True for axis in range(3)]
    for axis, one in found.items():
        check_balance(*one.solution.wall_heat(), float(one.solution.energies[0, 0]))
        tensor[axis, axis] = one.conductivity
    solutions = tuple(one.solution for one in found.values())
    reports = [report for solution in solutions for report in solution.reports]
    whole = EffectiveConductivity(
        tensor,
        tuple(spans),
        max(report.unknowns for report in reports),
        max(report.iterations for report in reports),
        max(report.relative_energy_error for report in reports),
        solutions,
        heat_imbalance=max(abs(one.imbalance) for one in found.values()),
        picard_iterations=max(one.iterations for one in found.values()),
    )
    return whole, found
