"""Steady conduction at many contact half-angles of one network, by a reduced basis over the angles.

Contacts, backbone, loads and prescribed nodes do not depend on the half-angle; only the element matrices do.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from scipy.sparse import csr_matrix

from etc_engine.engines.dtem.assembly import assemble
from etc_engine.engines.dtem.element import Elements, smallest_ratio
from etc_engine.engines.dtem.steady import ElementGeometry, element_geometry
from etc_engine.errors import GeometryError
from etc_engine.medium.backbone import Backbone
from etc_engine.medium.medium import Medium
from etc_engine.medium.sides import check_arcs
from etc_engine.solvers import FamilySolution, Member, TrialSpace, solve_family
from etc_engine.solvers.summation import inner

TOLERANCE = 1e-8
"""Largest estimated relative error of a conductivity of a reduced solution."""


@dataclass(frozen=True, eq=False)
class _Member(Member):
    """A member of the family that still knows its element matrices."""

    elements: Elements = field(kw_only=True)


def solve_angle_curve(
    medium: Medium,
    axes: tuple[int, ...],
    half_angles: Sequence[float],
    *,
    method: str = "chord",
    tolerance: float = 1e-10,
    backbone: Backbone | None = None,
) -> Iterator[tuple[int, FamilySolution | None]]:
    """Solve one load group at many contact half-angles, in full at a few of them.

    Parameters
    ----------
    medium : Medium
        With a contact network whose own angles do not count.
    axes : tuple of int
        A single walled axis, or periodic axes only.
    half_angles : sequence of float [rad]
        Each for all contacts.
    method, backbone
        As in `etc_engine.engines.dtem.steady.solve_steady`.
    tolerance : float
        Relative error of the conductivity left by full solutions; reduced ones have an estimated
        ``min(1e-8, 100 tolerance)`` at most.

    Yields
    ------
    index : int
        Which half-angle; not in their order.
    solution : FamilySolution or None
        None where the method fails, for `solve_steady` to say why.

    Notes
    -----
    The energies are those of trial temperatures, hence never below the discrete ones. The estimate of their error
    rests on a proven spectral bound where the system is small enough to be factorised, and on half the smallest
    Ritz value otherwise.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.rules import bonded_contacts
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> packing = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    >>> curve = solve_angle_curve(Medium(packing, 1.0, bonded_contacts(packing, 0.1)), (0,), [0.05, 0.1, 0.2])
    >>> {i: (solution.energies.item().__round__(6), solution.snapshots) for i, solution in sorted(curve)}
    {0: (0.179899, 1), 1: (0.214842, 0), 2: (0.268365, 1)}
    """
    load = element_geometry(medium, axes, method, None, backbone)
    modes = load.modes
    free = np.where(load.prescribed, -1, np.cumsum(~load.prescribed) - 1)
    size = int((~load.prescribed).sum())
    if size == 0:
        return ((index, _without_unknowns(load, angle)) for index, angle in enumerate(half_angles))
    rows = free[(modes * load.sides.nodes[:, None] + np.arange(modes)).ravel()]
    # mode 0 alone carries heat: with it in the basis as much heat leaves as enters
    heat = (np.flatnonzero(~load.prescribed) % modes == 0).astype(np.float64)
    return solve_family(
        TrialSpace(load.lift, rows, size, heat),
        # temperatures follow ln(alpha) where arcs are narrow, alpha where they draw near: a scale between the two
        np.cbrt(half_angles).tolist(),
        lambda index: _member(load, half_angles[index]),
        min(TOLERANCE, 100.0 * tolerance),
    )


def elements_at(load: ElementGeometry, half_angle: float) -> Elements:
    """Element matrices at a half-angle.

    Raises
    ------
    GeometryError
        Where the arcs do not fit.
    """
    sides = load.sides.with_half_angle(half_angle)
    if load.every_side is None:
        check_arcs(sides)
    else:  # what carries no heat must still be a valid geometry
        check_arcs(load.every_side.with_half_angle(half_angle))
    return load.variant.elements(sides, load.conductivity, load.modes)


def _without_unknowns(load: ElementGeometry, half_angle: float) -> FamilySolution | None:
    """Every node is a wall or pinned, or nothing spans: the lift is the solution."""
    start = time.perf_counter()
    member = _member(load, half_angle)
    if member is None:
        return None
    energies = inner(load.lift, member.apply(load.lift))
    return FamilySolution(np.empty((0, len(energies))), energies, 0.0, True, 0, 0, time.perf_counter() - start)


def _member(load: ElementGeometry, half_angle: float) -> Member | None:
    try:
        elements = elements_at(load, half_angle)
    except GeometryError:
        return None
    return _Member(elements.apply, partial(_matrix, load, elements), partial(_floor, elements), elements=elements)


def _matrix(load: ElementGeometry, elements: Elements) -> csr_matrix:
    return assemble(elements, load.lift, load.prescribed).matrix


def _floor(elements: Elements, reference: Member) -> float:
    assert isinstance(reference, _Member)
    return smallest_ratio(elements, reference.elements)
