"""The cell element on a medium of spheres: conductivity of media on one packing, its accuracy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from etc_engine.engines.dtem.cell_3d.cells import Frame
from etc_engine.engines.dtem.cell_3d.plan import Fineness
from etc_engine.engines.dtem.cell_3d.steady import SphereCellSolution, sphere_cell_conductivity, sphere_cells
from etc_engine.errors import InputError
from etc_engine.medium.conduction import Conduction, Result, attempt
from etc_engine.medium.conductivity import EffectiveConductivity
from etc_engine.medium.facets import FacetLinks, facet_links
from etc_engine.medium.field import ParticleField
from etc_engine.medium.medium import Medium, check_conductors
from etc_engine.medium.transient import ParticleSystem

CONDUCTING, INSULATING = "1/1", "3/3"
"""Frames of spheres that conduct at least as well as the fluid, and of ones that conduct worse."""
FINEST = Frame(3, 3)
FINER = Fineness(largest=0.8, growth=1.5)
INSULATING_ERROR = 0.017
"""Largest relative error of frame 3/3 against lattice sums of spheres that conduct worse than the fluid."""


def sphere_conductivity(
    medium: Medium,
    *,
    frame: str | None = None,
    error_estimate: bool = False,
    axes: tuple[int, ...] | None = None,
    tolerance: float = 1e-10,
    links: FacetLinks | None = None,
) -> EffectiveConductivity[SphereCellSolution]:
    """Effective conductivity of spheres and of the fluid between them, by the cell element.

    Parameters
    ----------
    medium : Medium
        Three-dimensional, with a contact network and pores that conduct.
    frame : str, optional
        Degrees of edges and facets, as ``"3/1"``; 1/1, or 3/3 where spheres conduct worse than the fluid, by default.
    error_estimate : bool
        Whether ``model_error`` is estimated, from a finer computation with frame 3/3.
    axes : tuple of int, optional
        Load axes; all by default.
    tolerance : float
        Relative error of the conductivity left by the solver.
    links : FacetLinks, optional
        Of the same network, if already known.

    Returns
    -------
    EffectiveConductivity
        Every axis is spanned, through the fluid.

    Raises
    ------
    InputError, GeometryError, ConvergenceError

    Notes
    -----
    See `etc_engine.engines.dtem.cell_3d.steady.sphere_cell_conductivity` for the accuracy. Where spheres conduct worse
    than the fluid, frame 3/3 is .1 to .9 % high at a contrast of .1 and up to 1.7 % at insulating spheres, for gaps of
    .02 R and more.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.medium import Pores
    >>> from etc_engine.medium.rules import overlap_contacts
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> one = ParticlePacking([[1.0, 1.0, 1.0]], [1.0], Box((2.1, 2.1, 2.1), (True, True, True)))
    >>> medium = Medium(one, 10.0, overlap_contacts(one), Pores(1.0))
    >>> round(float(sphere_conductivity(medium, frame="3/1").mean), 2)
    2.71
    """
    check_conductors(medium)
    links = links or facet_links(medium.links)
    fluid = medium.pores.conductivity
    default = INSULATING if (medium.conductivity < fluid).any() else CONDUCTING
    cells = sphere_cells(links, medium.conductivity, fluid, frame=frame_of(frame or default))
    result = sphere_cell_conductivity(cells, axes=axes, tolerance=tolerance)
    if error_estimate:
        finer = sphere_cells(links, medium.conductivity, fluid, frame=FINEST, fineness=FINER)
        better = np.diag(sphere_cell_conductivity(finer, axes=axes, tolerance=tolerance).tensor)
        result = replace(result, model_error=float(np.nanmax(np.abs(np.diag(result.tensor) / better - 1.0))))
    return result


def frame_of(word: str) -> Frame:
    """Frame of a word such as ``"3/1"``.

    Raises
    ------
    InputError
        If it is none.

    Examples
    --------
    >>> frame_of("3/1")
    Frame(edge_degree=3, face_degree=1)
    """
    parts = word.split("/")
    if len(parts) != 2 or not all(part.lstrip("-").isdigit() for part in parts):
        raise InputError(f"a frame is two degrees, of edges and of facets, as 1/1 or 3/3, found {word!r}")
    return Frame(*map(int, parts))


def accuracy_remarks(_: str, result: EffectiveConductivity[SphereCellSolution]) -> tuple[str, ...]:
    """The error that is known where spheres conduct worse than the fluid, and the estimate if it is large."""
    remarks = []
    materials = result.solutions[0].cells.materials
    if (materials.spheres < materials.fluid).any():
        remarks.append(
            f"spheres conduct worse than the fluid: the cell element is up to {100.0 * INSULATING_ERROR:.1f} % high "
            f"there at gaps of .02 radii, and more at smaller gaps"
        )
    if np.nan_to_num(result.model_error) > 0.01:
        remarks.append(f"a finer computation differs by {100.0 * result.model_error:.1f} %: use frame 3/1 or 3/3")
    return tuple(remarks)


def solve_series(media: Sequence[Medium], conduction: Conduction) -> list[Result]:
    """Effective conductivity of media on one packing, one result per medium; facets of one network are found once."""
    known: dict[int, FacetLinks] = {}

    def alone(medium: Medium) -> EffectiveConductivity[SphereCellSolution]:
        if id(medium.links) not in known:
            known[id(medium.links)] = facet_links(medium.links)
        return sphere_conductivity(
            medium,
            axes=conduction.axes,
            tolerance=conduction.tolerance,
            links=known[id(medium.links)],
            **conduction.options,
        )

    return [attempt(partial(alone, medium)) for medium in media]


def sphere_field(*_: Any) -> ParticleField:
    """Refuse: the element gives the conductivity and the mean temperatures of spheres, but no flows of links.

    Raises
    ------
    InputError
    """
    raise InputError("method cell has no field of spheres: use method facets for temperatures and heat flows")


def sphere_system(*_: Any, **__: Any) -> ParticleSystem:
    """Refuse: spheres do not store heat in this element.

    Raises
    ------
    InputError
    """
    raise InputError("method cell has no transient of spheres: use method facets")
