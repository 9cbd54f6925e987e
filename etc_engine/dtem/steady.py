"""Steady heat conduction through a contact network: one load axis, or all periodic axes at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from etc_engine.contacts import ContactNetwork
from etc_engine.dtem.assembly import LinearSystem, assemble, count_positive_off_diagonals
from etc_engine.dtem.element import (
    ContactSides,
    Elements,
    check_arcs,
    contact_sides,
    element_matrices,
    side_resistances,
)
from etc_engine.errors import InputError
from etc_engine.percolation import Backbone, find_backbone
from etc_engine.solvers import SolveReport, build_preconditioner, solve_energy


@dataclass(frozen=True, eq=False)
class SteadySolution:
    """Temperatures and heat flows on the backbone of a contact network.

    Parameters
    ----------
    network : ContactNetwork
        The whole network that was asked about.
    axes : tuple of int
        Load axes, one column k each: walls at temperature 1 (low end) and 0 (far end), or a mean
        temperature gradient of 1 along a periodic axis.
    backbone : Backbone
        What takes part.
    sides : ContactSides
        The contact sides of the backbone.
    resistances : ndarray, shape (s,) [m K/W]
        Diagonal of H at each of them.
    conductivity : ndarray, shape (n,) [W/(m K)]
        Conductivity of each particle.
    temperatures : ndarray, shape (s, k) [K]
        Node temperature at each side; along a periodic axis measured from the mean gradient at the
        particle's centre.
    heat_flows : ndarray, shape (s, k) [W/m]
        Heat flow into the particle at each side.
    energies : ndarray, shape (k, k)
        sum_p t_pa . K_p t_pb.
    reports : tuple of SolveReport
        One a load; empty when nothing spans.
    positive_off_diagonals : int
        Entries of the matrix that break the M-matrix property.
    """

    network: ContactNetwork
    axes: tuple[int, ...]
    backbone: Backbone
    sides: ContactSides
    resistances: NDArray[np.float64]
    conductivity: NDArray[np.float64]
    temperatures: NDArray[np.float64]
    heat_flows: NDArray[np.float64]
    energies: NDArray[np.float64]
    reports: tuple[SolveReport, ...]
    positive_off_diagonals: int


def solve_steady(
    network: ContactNetwork,
    axes: tuple[int, ...],
    *,
    method: str = "chord",
    conductivity: ArrayLike = 1.0,
    contact_resistance: ArrayLike = 0.0,
    tolerance: float = 1e-10,
    backbone: Backbone | None = None,
) -> SteadySolution:
    """Solve the discrete thermal element equations for one walled axis, or for periodic axes together.

    Walls: K u = -sum_p P_p^T K_p t^wall_p with the driven walls' nodes prescribed. Periodic: a mean gradient
    e_a adds the jump j_p(c) = (x_c - x_p)_a to the periodic fluctuation u, K u_a = -sum_p P_p^T K_p j_pa.

    Parameters
    ----------
    network : ContactNetwork
        Two-dimensional.
    axes : tuple of int
        A single walled axis, or periodic axes only.
    method : str
        ``standard``, ``enhanced`` or ``chord``.
    conductivity : float or array_like, shape (n,) [W/(m K)]
        Of all particles, or of each.
    contact_resistance : float or array_like, shape (m + w,) [m K/W]
        Total resistance of a contact per unit thickness; of all, or of each particle contact and then each
        wall contact.
    tolerance : float
        Relative error of the conductivity left by the solver.
    backbone : Backbone, optional
        Of the same network and axes, if already known (it does not depend on the contact angles).

    Returns
    -------
    SteadySolution

    Raises
    ------
    InputError, GeometryError, ConvergenceError

    References
    ----------
    Feng, Han, Li, Owen 2008, Box 1, doi:10.1016/j.jcp.2008.01.031.
    """
    conductivity = _positive(conductivity, network.packing.count, "conductivity", zero=False)
    resistance = _positive(contact_resistance, network.count + network.walls.size, "contact resistance", zero=True)
    if network.packing.dimension != 2:
        raise InputError("the discrete thermal element method is two-dimensional; the packing has 3 axes")
    if backbone is None:
        backbone = find_backbone(network, axes)
    reduced = network.select(backbone.contacts, backbone.wall_contacts)
    sides = contact_sides(reduced)
    kept = np.concatenate([backbone.contacts, backbone.wall_contacts])
    if not kept.all():  # what carries no heat must still be a valid geometry
        check_arcs(contact_sides(network.select(np.ones_like(backbone.contacts), _driven(network, axes))))
    diagonal = side_resistances(sides, method, conductivity, resistance[kept])
    elements = element_matrices(sides, diagonal, conductivity)
    if elements.nodes.size == 0:
        nothing = np.zeros((0, len(axes)))
        zero = np.zeros((len(axes), len(axes)))
        return SteadySolution(network, axes, backbone, sides, diagonal, conductivity, nothing, nothing, zero, (), 0)
    system = _load(reduced, axes, backbone, sides, elements)
    u, reports = _solve(system, tolerance)
    temperatures = system.element_temperatures(elements, u)
    flows = elements.apply(temperatures)
    return SteadySolution(
        network,
        axes,
        backbone,
        sides,
        diagonal,
        conductivity,
        temperatures,
        flows,
        temperatures.T @ flows,
        reports,
        count_positive_off_diagonals(system.matrix),
    )


def _driven(network: ContactNetwork, axes: tuple[int, ...]) -> NDArray[np.bool_]:
    """Wall contacts with the walls that drive the flow; none around a periodic axis."""
    return np.asarray(network.walls // 2 == axes[0])


def _load(
    reduced: ContactNetwork,
    axes: tuple[int, ...],
    backbone: Backbone,
    sides: ContactSides,
    elements: Elements,
) -> LinearSystem:
    """Prescribe the walls of a walled axis, or the jumps of periodic axes with one node pinned a cluster."""
    m = reduced.count
    prescribed = np.zeros(m + reduced.walls.size, dtype=np.bool_)
    if reduced.packing.box.periodic[axes[0]]:
        _, first = np.unique(backbone.clusters[reduced.pairs[:, 0]], return_index=True)
        prescribed[first] = True
        return assemble(elements, sides.arms[:, list(axes)], prescribed)
    prescribed[m:] = True
    wall_temperature = np.concatenate([np.zeros(m), 1.0 - reduced.walls % 2])
    return assemble(elements, wall_temperature[sides.nodes][:, None], prescribed)


def _solve(system: LinearSystem, tolerance: float) -> tuple[NDArray[np.float64], tuple[SolveReport, ...]]:
    if system.matrix.shape[0] == 0:  # every node is a wall or pinned
        return np.zeros(system.rhs.shape), tuple(
            SolveReport(0, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0) for _ in system.lift_energies
        )
    preconditioner = build_preconditioner(system.matrix)
    u = np.empty(system.rhs.shape)
    reports = []
    for load, lift_energy in enumerate(system.lift_energies):
        u[:, load], report = solve_energy(
            system.matrix,
            np.ascontiguousarray(system.rhs[:, load]),
            float(lift_energy),
            preconditioner=preconditioner,
            tolerance=tolerance,
        )
        reports.append(report)
    return u, tuple(reports)


def _positive(values: ArrayLike, size: int, name: str, *, zero: bool) -> NDArray[np.float64]:
    """One value for each, all of them finite and positive (or zero where allowed)."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim and array.shape != (size,):
        raise InputError(f"the {name} must be one number or an array of shape ({size},), found {array.shape}")
    bad = ~np.isfinite(array) | ((array < 0.0) if zero else (array <= 0.0))
    if bad.any():
        found = array[bad].flat[0]
        raise InputError(f"the {name} must be {'>= 0' if zero else 'positive'} and finite, found {found:g}")
    return np.broadcast_to(array, (size,))
