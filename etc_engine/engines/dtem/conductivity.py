"""Effective conductivity by the discrete thermal element method: one medium, or many contact half-angles of one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.engines.dtem.angle_curve import solve_angle_curve
from etc_engine.engines.dtem.exact.bounds import energy_bounds
from etc_engine.engines.dtem.exact.spheres import DEGREE
from etc_engine.engines.dtem.model_error import chord_error_estimate, film_error
from etc_engine.engines.dtem.steady import SteadySolution, solve_steady
from etc_engine.errors import InputError
from etc_engine.medium.backbone import Backbone, find_backbones
from etc_engine.medium.conduction import Conduction, Result, attempt
from etc_engine.medium.conductivity import EffectiveConductivity, conductivities, effective_tensor
from etc_engine.medium.loads import load_groups
from etc_engine.medium.medium import Medium
from etc_engine.medium.sides import count_close_arcs
from etc_engine.solvers import FamilySolution

Backbones = Mapping[tuple[int, ...], Backbone]


def element_conductivity(
    medium: Medium,
    *,
    method: str = "chord",
    tolerance: float = 1e-10,
    modes: int | None = None,
    axes: tuple[int, ...] | None = None,
    backbones: Backbones | None = None,
) -> EffectiveConductivity[SteadySolution]:
    """Effective conductivity by the discrete thermal element method.

    Walls: k_aa = Q L_a / (S_a dT). Periodic: k_ab = (1/area) sum_p t_pa . K_p t_pb.

    Parameters
    ----------
    medium, method, tolerance, modes
        As in `etc_engine.engines.dtem.steady.solve_steady`.
    axes : tuple of int, optional
        Load axes wanted; all by default.
    backbones : dict, optional
        From `find_backbones` of a network with the same contacts.

    Returns
    -------
    EffectiveConductivity
        0 along an axis that no path of contacts spans. ``model_error`` is estimated for ``chord``. For ``exact`` it is
        the distance of the two ``bounds`` of disks, and what the last degree of flux modes has changed for spheres.
        With a resistance of contacts, ``chord`` and ``exact`` of spheres add what a real interface conducts less.

    Raises
    ------
    InputError, GeometryError, ConvergenceError

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.rules import bonded_contacts
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> packing = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    >>> result = element_conductivity(Medium(packing, 1.0, bonded_contacts(packing, 0.1)), method="exact")
    >>> result.tensor.round(6), result.bounds[0].round(6)
    (array([[0.214842,      nan],
           [     nan, 0.      ]]), array([0.214842, 0.214842]))
    """
    backbones = backbones or find_backbones(medium.links, axes)

    def solve(group: tuple[int, ...]) -> SteadySolution:
        return solve_steady(medium, group, method=method, tolerance=tolerance, modes=modes, backbone=backbones[group])

    result = effective_tensor(medium.box, axes, solve)
    if method == "chord":
        estimates = [chord_error_estimate(s, load) for s in result.solutions for load in range(len(s.axes))]
        return replace(result, model_error=max(estimates))
    if method != "exact":
        return result
    if medium.dimension == 3:
        left = max((film_error(s, load) for s in result.solutions for load in range(len(s.axes))), default=0.0)
        return replace(
            result, model_error=left + _fewer_modes(result, medium, modes or DEGREE + 1, tolerance, backbones)
        )
    bounds = conductivity_bounds(result)
    apart = [upper / lower - 1.0 for lower, upper in bounds if lower > 0.0]
    return replace(result, bounds=bounds, model_error=float(max(apart, default=0.0)))


def _fewer_modes(
    result: EffectiveConductivity[SteadySolution], medium: Medium, modes: int, tolerance: float, backbones: Backbones
) -> float:
    """Estimated relative error of ``exact`` for spheres: what the flux modes of the highest degree have changed."""
    if modes == 1:
        return float("nan")
    axes = tuple(axis for solution in result.solutions for axis in solution.axes)

    def solve(group: tuple[int, ...]) -> SteadySolution:
        return solve_steady(
            medium, group, method="exact", tolerance=tolerance, modes=modes - 1, backbone=backbones[group]
        )

    fewer = effective_tensor(medium.box, axes, solve).tensor
    before, after = np.diag(fewer)[list(axes)], np.diag(result.tensor)[list(axes)]
    return float(np.abs(before[after > 0.0] / after[after > 0.0] - 1.0).max(initial=0.0))


def conductivity_bounds(result: EffectiveConductivity[SteadySolution]) -> Floats:
    """Two-sided bounds of the diagonal of the conductivity tensor by method ``exact``, shape (d, 2) [W/(m K)].

    Lower and upper bound along each axis; NaN where it was not asked for.

    Raises
    ------
    InputError
        If the method is another one.

    Notes
    -----
    See `etc_engine.engines.dtem.exact.bounds.energy_bounds` for what is rigorous about them and what is estimated.
    """
    bounds = np.full((result.tensor.shape[0], 2), np.nan)
    for solution in result.solutions:
        for end, energies in enumerate(energy_bounds(solution).T):
            scaled = conductivities(solution.medium.box, solution.axes, np.diag(energies))
            bounds[list(solution.axes), end] = np.diag(scaled)
    return bounds


def conductivity_curve(
    medium: Medium,
    half_angles: Sequence[float],
    *,
    method: str = "chord",
    tolerance: float = 1e-10,
    backbones: Backbones | None = None,
) -> tuple[EffectiveConductivity[FamilySolution] | None, ...]:
    """Effective conductivity at many contact half-angles of one network, by a reduced basis over the angles.

    Parameters
    ----------
    medium : Medium
        The half-angles of its contacts do not count.
    half_angles : sequence of float [rad]
        Each for all contacts.
    method, tolerance, backbones
        As in `element_conductivity`.

    Returns
    -------
    tuple of EffectiveConductivity or None
        In the order of the half-angles; None where the method fails, for `element_conductivity` to say why.

    Notes
    -----
    Components agree with those of `element_conductivity` to ``min(1e-8, 100 tolerance)`` relative (off the diagonal,
    relative to it), by an estimate described in `etc_engine.engines.dtem.angle_curve.solve_angle_curve`.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.rules import bonded_contacts
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> disk = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0), (True, True)))
    >>> points = conductivity_curve(Medium(disk, 1.0, bonded_contacts(disk, 0.1)), [0.05, 0.1, 0.2])
    >>> [round(float(point.tensor[0, 0]), 6) for point in points]
    [0.359798, 0.429685, 0.53673]
    """
    box = medium.box
    backbones = backbones or find_backbones(medium.links)
    solved: list[dict[tuple[int, ...], FamilySolution]] = [{} for _ in half_angles]
    for group in load_groups(box):
        curve = solve_angle_curve(
            medium, group, half_angles, method=method, tolerance=tolerance, backbone=backbones[group]
        )
        for index, solution in curve:
            if solution is not None:
                solved[index][group] = solution
    join = partial(_join, medium, backbones)
    return tuple(join(groups) if len(groups) == len(load_groups(box)) else None for groups in solved)


def _join(
    medium: Medium, backbones: Backbones, groups: Mapping[tuple[int, ...], FamilySolution]
) -> EffectiveConductivity[FamilySolution]:
    """The load groups of one half-angle as one conductivity."""
    d, solutions = medium.dimension, tuple(groups.values())
    tensor, spans = np.full((d, d), np.nan), [False] * d
    for group, solution in groups.items():
        spanned = np.outer(backbones[group].spans, backbones[group].spans)
        tensor[np.ix_(group, group)] = conductivities(medium.box, group, solution.energies) * spanned
        for axis, flag in zip(group, backbones[group].spans, strict=True):
            spans[axis] = flag
    return EffectiveConductivity(
        tensor,
        tuple(spans),
        max(solution.u.shape[0] for solution in solutions),
        max(solution.iterations for solution in solutions),
        max(solution.relative_energy_error for solution in solutions),
        solutions,
        snapshots=max(solution.snapshots for solution in solutions),
        certified=all(solution.certified or solution.snapshots == 0 for solution in solutions),
        seconds=sum(solution.seconds for solution in solutions),
    )


def accuracy_remarks(method: str, result: EffectiveConductivity[SteadySolution]) -> tuple[str, ...]:
    """A warning where contacts lie so close that a method other than ``exact`` loses accuracy, or a film is lumped."""
    sides = result.solutions[0].sides
    if method == "exact" and sides.dimension == 3 and sides.area_resistances.any():
        return (
            "method exact of spheres does not resolve the resistance over the contact area: each contact resists r/A "
            "and an approximate excess, see model_error_estimate",
        )
    close = 0 if method == "exact" else count_close_arcs(sides)
    if not close:
        return ()
    return (
        f"between {close} pairs of contacts of one particle the gap is less than the sum of their half-angles; "
        f"{method} loses accuracy there, method exact does not",
    )


CURVE_ANGLES = 4
"""From this many half-angles on, solving them together saves time."""


def solve_series(media: Sequence[Medium], conduction: Conduction) -> list[Result]:
    """Effective conductivity of media on one packing, one result per medium.

    Media that differ in nothing but one half-angle of all contacts are solved together by a reduced basis if there are
    at least `CURVE_ANGLES` of them, unless the option ``angle_curve`` is ``full``; what that cannot solve is solved
    alone, which says why. Method ``exact`` needs every solution for its bounds.

    Raises
    ------
    InputError
        If a packing is to be solved on many ranks, and is here already as a whole.
    """
    if conduction.options.get("distributed"):
        raise InputError("distributed is for packings in files: etc-engine solve --distributed, or a sweep over files")
    backbones: dict[int, Backbones] = {}
    for medium in media:
        key = id(medium.links.pairs)
        if key not in backbones:
            backbones[key] = find_backbones(medium.links, conduction.axes)

    def alone(medium: Medium) -> Result:
        return attempt(
            lambda: element_conductivity(
                medium,
                method=conduction.method,
                tolerance=conduction.tolerance,
                modes=conduction.options.get("modes"),
                axes=conduction.axes,
                backbones=backbones[id(medium.links.pairs)],
            )
        )

    found: dict[int, Result] = {}
    reduced = conduction.options.get("angle_curve", "reduced") == "reduced"
    if reduced and conduction.method != "exact" and conduction.axes is None:
        for rows in _curves(media):
            points = conductivity_curve(
                media[rows[0]],
                [float(media[row].links.angles.flat[0]) for row in rows],
                method=conduction.method,
                tolerance=conduction.tolerance,
                backbones=backbones[id(media[rows[0]].links.pairs)],
            )
            found |= {row: point for row, point in zip(rows, points, strict=True) if point is not None}
    return [found[row] if row in found else alone(medium) for row, medium in enumerate(media)]


def _curves(media: Sequence[Medium]) -> list[list[int]]:
    """Rows of the media that differ in one half-angle of all contacts only, where there are enough of them."""
    groups: dict[tuple[object, ...], list[int]] = {}
    for row, medium in enumerate(media):
        network = medium.links
        angles = np.concatenate([network.angles.ravel(), network.wall_angles])
        if network.count and (angles == angles[0]).all():
            resistances = network.lumped_resistances, network.wall_lumped_resistances, network.area_resistances
            shared = (b"" if values is None else values.tobytes() for values in (medium.conductivity, *resistances))
            key = (id(network.pairs), medium.pores, *shared)
            groups.setdefault(key, []).append(row)
    return [rows for rows in groups.values() if len(rows) >= CURVE_ANGLES]
