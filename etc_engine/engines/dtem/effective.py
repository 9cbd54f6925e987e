"""Effective conductivity tensor of a packing from the energies of its steady solutions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from etc_engine.box import AXES
from etc_engine.engines.dtem.angle_curve import solve_angle_curve
from etc_engine.engines.dtem.exact.bounds import energy_bounds
from etc_engine.engines.dtem.steady import SteadySolution, solve_steady
from etc_engine.engines.pipe.conductances import pipe_conductances
from etc_engine.medium.backbone import Backbone, find_backbones, load_groups
from etc_engine.medium.conductivity import EffectiveConductivity, assemble_tensor
from etc_engine.medium.network import ContactNetwork


def effective_conductivity(
    network: ContactNetwork,
    *,
    method: str = "chord",
    conductivity: ArrayLike = 1.0,
    contact_resistance: ArrayLike = 0.0,
    tolerance: float = 1e-10,
    modes: int | None = None,
    axes: tuple[int, ...] | None = None,
    backbones: Mapping[tuple[int, ...], Backbone] | None = None,
) -> EffectiveConductivity[SteadySolution]:
    """Effective conductivity by the discrete thermal element method.

    Walls: k_aa = Q L_a / (S_a dT). Periodic: k_ab = (1/area) sum_p t_pa . K_p t_pb.

    Parameters
    ----------
    network : ContactNetwork
    method, conductivity, contact_resistance, tolerance, modes
        As in `etc_engine.engines.dtem.steady.solve_steady`.
    axes : tuple of int, optional
        Load axes wanted; all by default.
    backbones : dict, optional
        From `find_backbones` of a network with the same contacts.

    Returns
    -------
    EffectiveConductivity
        0 along an axis that no path of contacts spans.

    Raises
    ------
    InputError, GeometryError, ConvergenceError

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.rules import bonded_contacts
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> packing = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    >>> effective_conductivity(bonded_contacts(packing, 0.1)).tensor.round(6)
    array([[0.214842,      nan],
           [     nan, 0.      ]])
    """
    box = network.packing.box
    backbones = backbones or find_backbones(network, axes)

    def solve(group: tuple[int, ...]) -> SteadySolution:
        return solve_steady(
            network,
            group,
            method=method,
            conductivity=conductivity,
            contact_resistance=contact_resistance,
            tolerance=tolerance,
            modes=modes,
            backbone=backbones[group],
        )

    return assemble_tensor(box, axes, solve, wall_heat_flows)


@dataclass(frozen=True, eq=False)
class CurvePoint:
    """Effective conductivity at one contact half-angle of a curve.

    Parameters
    ----------
    tensor : ndarray, shape (d, d) [W/(m K)]
        As in `EffectiveConductivity`.
    missing_axes : str
        Axes that no path of contacts spans, as a word.
    unknowns, iterations : int
        Largest of a load group; a reduced solution takes no iterations.
    relative_energy_error : float
        Largest estimated relative error of a load group.
    certified : bool
        Whether that is a proven upper bound.
    snapshots : int
        Full solutions it is made of, 0 if it is one itself in every load group.
    seconds : float
    """

    tensor: NDArray[np.float64]
    missing_axes: str
    unknowns: int
    iterations: int
    relative_energy_error: float
    certified: bool
    snapshots: int
    seconds: float


def conductivity_curve(
    network: ContactNetwork,
    half_angles: Sequence[float],
    *,
    method: str = "chord",
    conductivity: ArrayLike = 1.0,
    contact_resistance: ArrayLike = 0.0,
    tolerance: float = 1e-10,
    backbones: Mapping[tuple[int, ...], Backbone] | None = None,
) -> tuple[CurvePoint | None, ...]:
    """Effective conductivity at many contact half-angles of one network, by a reduced basis over the angles.

    Parameters
    ----------
    network : ContactNetwork
        Its own half-angles do not count.
    half_angles : sequence of float [rad]
        Each for all contacts.
    method, conductivity, contact_resistance, tolerance, backbones
        As in `effective_conductivity`.

    Returns
    -------
    tuple of CurvePoint or None
        In the order of the half-angles; None where the method fails, for `effective_conductivity` to say why.

    Notes
    -----
    Components agree with those of `effective_conductivity` to ``min(1e-8, 100 tolerance)`` relative (off the diagonal,
    relative to it), by an estimate described in `etc_engine.engines.dtem.angle_curve.solve_angle_curve`.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.rules import bonded_contacts
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> disk = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0), (True, True)))
    >>> points = conductivity_curve(bonded_contacts(disk, 0.1), [0.05, 0.1, 0.2])
    >>> [round(float(point.tensor[0, 0]), 6) for point in points]
    [0.359798, 0.429685, 0.53673]
    """
    box = network.packing.box
    backbones = backbones or find_backbones(network)
    every: list[list[CurvePoint]] = [[] for _ in half_angles]
    for group in load_groups(box):
        spanned = np.asarray(backbones[group].spans)
        missing = "".join(AXES[axis] for axis, flag in zip(group, spanned, strict=True) if not flag)
        axis = group[0]
        scale = 1.0 / box.volume if box.periodic[axis] else box.lengths[axis] / box.cross_section(axis)
        curve = solve_angle_curve(
            network,
            group,
            half_angles,
            method=method,
            conductivity=conductivity,
            contact_resistance=contact_resistance,
            tolerance=tolerance,
            backbone=backbones[group],
        )
        for index, solution in curve:
            if solution is None:
                continue
            tensor = np.full((box.dimension, box.dimension), np.nan)
            symmetric = 0.5 * (solution.energies + solution.energies.T)
            tensor[np.ix_(group, group)] = symmetric * scale * np.outer(spanned, spanned)
            every[index].append(
                CurvePoint(
                    tensor,
                    missing,
                    solution.u.shape[0],
                    solution.iterations,
                    solution.relative_energy_error,
                    solution.certified,
                    solution.snapshots,
                    solution.seconds,
                )
            )
    return tuple(_join(points) if len(points) == len(load_groups(box)) else None for points in every)


def _join(points: Sequence[CurvePoint]) -> CurvePoint:
    """The load groups of one half-angle as one point."""
    tensors = np.array([point.tensor for point in points])
    known = np.isfinite(tensors)
    return CurvePoint(
        np.where(known.any(axis=0), np.where(known, tensors, 0.0).sum(axis=0), np.nan),
        "".join(point.missing_axes for point in points),
        max(point.unknowns for point in points),
        max(point.iterations for point in points),
        max(point.relative_energy_error for point in points),
        all(point.certified or point.snapshots == 0 for point in points),
        max(point.snapshots for point in points),
        sum(point.seconds for point in points),
    )


def conductivity_bounds(result: EffectiveConductivity[SteadySolution]) -> NDArray[np.float64]:
    """Two-sided bounds of the diagonal of the conductivity tensor, by method ``exact``.

    Parameters
    ----------
    result : EffectiveConductivity
        Of method ``exact``.

    Returns
    -------
    ndarray, shape (d, 2) [W/(m K)]
        Lower and upper bound along each axis; NaN where it was not asked for.

    Raises
    ------
    InputError
        If the method is another one.

    Notes
    -----
    See `etc_engine.engines.dtem.exact.bounds.energy_bounds` for what is rigorous about them and what is estimated.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.rules import bonded_contacts
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> packing = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    >>> result = effective_conductivity(bonded_contacts(packing, 0.1), method="exact", axes=(0,))
    >>> conductivity_bounds(result)[0].round(6)
    array([0.214842, 0.214842])
    """
    bounds = np.full((result.tensor.shape[0], 2), np.nan)
    for solution in result.solutions:
        box = solution.network.packing.box
        for axis, energies in zip(solution.axes, energy_bounds(solution), strict=True):
            periodic = box.periodic[axis]
            bounds[axis] = energies * (1.0 / box.volume if periodic else box.lengths[axis] / box.cross_section(axis))
    return bounds


def wall_heat_flows(solution: SteadySolution) -> tuple[float, float]:
    """Heat flow into the particles at the low wall and out of them at the far wall [W/m]."""
    at_wall = solution.sides.nodes >= int(solution.backbone.contacts.sum())
    hot = at_wall & (solution.temperatures[:, 0] == 1.0)
    cold = at_wall & ~hot
    return float(solution.heat_flows[hot, 0].sum()), -float(solution.heat_flows[cold, 0].sum())


def mean_field_conductivity(
    network: ContactNetwork,
    *,
    resistance: str = "chord",
    conductivity: ArrayLike = 1.0,
    contact_resistance: ArrayLike = 0.0,
) -> float:
    """Mean over the axes of the conductivity of the pipe network when every particle follows the mean gradient.

    k = (1/dV) sum_c C_c d_c^2,  C_c = 1/(h_ii + h_jj + R_c), over the particle contacts; d = 2 or 3 axes, V the area or
    volume of the box.

    Parameters
    ----------
    network, conductivity, contact_resistance
        As in `effective_conductivity`.
    resistance : str
        As in `etc_engine.engines.pipe.conductances.pipe_conductances`.

    Returns
    -------
    float [W/(m K)]

    Notes
    -----
    An upper bound of the periodic pipe network, which joins particles at their mean temperatures through
    their self-resistances alone; an estimate, not a bound, for the discrete thermal element method.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.rules import bonded_contacts
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> disk = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0), (True, True)))
    >>> round(mean_field_conductivity(bonded_contacts(disk, 0.1)), 6)
    0.429587
    """
    conductances, _ = pipe_conductances(
        network, resistance=resistance, conductivity=conductivity, contact_resistance=contact_resistance
    )
    squares = (network.branches**2).sum(axis=1)
    return float(conductances @ squares / (network.packing.dimension * network.packing.box.volume))
