"""Steady heat conduction through a contact network: one load axis, or all periodic axes at once."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from etc_engine.engines.dtem.assembly import LinearSystem, assemble, count_positive_off_diagonals
from etc_engine.engines.dtem.element import Material
from etc_engine.engines.dtem.methods import find_method, flux_modes
from etc_engine.errors import InputError
from etc_engine.medium.backbone import Backbone, find_backbone, restore_dead_ends
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.sides import NO_CUTS, ContactSides, check_arcs, contact_sides, insulated_cuts
from etc_engine.solvers import SolveReport, build_preconditioner, solve_energy

LARGEST = 1e100
"""Of a conductivity or resistance: products of a few of them stay finite."""


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
    method : str
        Name of the method.
    material : Material
        Of the whole network.
    temperatures : ndarray, shape (s, k) [K]
        Node temperature at each side; along a periodic axis measured from the mean gradient at the
        particle's centre.
    flows : ndarray, shape (s, M, k) [W/m]
        Flux modes into the particle at each side; mode 0 is the heat flow.
    energies : ndarray, shape (k, k)
        sum_p t_pa . K_p t_pb.
    reports : tuple of SolveReport
        One a load.
    positive_off_diagonals : int
        Entries of the matrix that break the M-matrix property.
    """

    network: ContactNetwork
    axes: tuple[int, ...]
    backbone: Backbone
    sides: ContactSides
    method: str
    material: Material
    temperatures: NDArray[np.float64]
    flows: NDArray[np.float64]
    energies: NDArray[np.float64]
    reports: tuple[SolveReport, ...]
    positive_off_diagonals: int

    @property
    def modes(self) -> int:
        """Flux modes of a contact."""
        return int(self.flows.shape[1])

    @property
    def heat_flows(self) -> NDArray[np.float64]:
        """Heat flow into the particle at each side, shape (s, k) [W/m]."""
        return self.flows[:, 0, :]


def solve_steady(
    network: ContactNetwork,
    axes: tuple[int, ...],
    *,
    method: str = "chord",
    conductivity: ArrayLike = 1.0,
    contact_resistance: ArrayLike = 0.0,
    tolerance: float = 1e-10,
    modes: int | None = None,
    backbone: Backbone | None = None,
) -> SteadySolution:
    """Solve the discrete thermal element equations for one walled axis, or for periodic axes together.

    Walls: K u = -sum_p P_p^T K_p t^wall_p with the driven walls' nodes prescribed. Periodic: a mean gradient
    e_a adds the jump j_p(c) = (x_c - x_p)_a to the periodic fluctuation u, K u_a = -sum_p P_p^T K_p j_pa.

    Parameters
    ----------
    network : ContactNetwork
        Of disks or spheres.
    axes : tuple of int
        A single walled axis, or periodic axes only.
    method : str
        A name of `etc_engine.engines.dtem.methods.METHODS`.
    conductivity : float or array_like, shape (n,) [W/(m K)]
        Of all particles, or of each.
    contact_resistance : float or array_like, shape (m + w,) [m K/W]
        Total resistance of a contact per unit thickness; of all, or of each particle contact and then each
        wall contact.
    tolerance : float
        Relative error of the conductivity left by the solver.
    modes : int, optional
        Flux modes of a contact, with ``arc`` or ``exact``; by default the method's own.
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
    dimension = network.packing.dimension
    material = make_material(network, conductivity, contact_resistance)
    variant, modes = find_method(method, dimension), flux_modes(method, modes, dimension)
    if backbone is None:
        backbone = find_backbone(network, axes)
    driven = driven_walls(network, axes)
    cuts = NO_CUTS
    if variant.exact_cuts:
        backbone = restore_dead_ends(network, backbone)
        cuts = insulated_cuts(network, driven)
    kept = np.concatenate([backbone.contacts, backbone.wall_contacts])
    reduced = network.select(backbone.contacts, backbone.wall_contacts)
    sides = contact_sides(reduced, cuts)
    check_arcs(sides)
    if not kept.all():  # what carries no heat must still be a valid geometry
        check_arcs(contact_sides(network.select(np.ones_like(backbone.contacts), driven)))
    elements = variant.elements(sides, replace(material, contact_resistance=material.contact_resistance[kept]), modes)
    system = assemble(elements, *prescribe(reduced, axes, backbone, sides, elements.modes))
    u, reports = _solve(system, elements.modes, tolerance)
    temperatures = system.element_temperatures(elements, u)
    flows = elements.apply(temperatures)
    return SteadySolution(
        network=network,
        axes=axes,
        backbone=backbone,
        sides=sides,
        method=method,
        material=material,
        temperatures=temperatures[:: elements.modes],
        flows=flows.reshape(sides.nodes.size, elements.modes, len(axes)),
        energies=temperatures.T @ flows,
        reports=reports,
        positive_off_diagonals=count_positive_off_diagonals(system.matrix),
    )


def driven_walls(network: ContactNetwork, axes: tuple[int, ...]) -> NDArray[np.bool_]:
    """Wall contacts whose wall has a prescribed temperature, shape (w,)."""
    return np.asarray((network.walls // 2 == axes[0]) & (not network.packing.box.periodic[axes[0]]))


def make_material(network: ContactNetwork, conductivity: ArrayLike, contact_resistance: ArrayLike) -> Material:
    """The material of a network, arguments as in `solve_steady`."""
    return Material(
        per_particle(conductivity, network.packing.count, "conductivity"),
        _positive(contact_resistance, network.count + network.walls.size, "contact resistance", zero=True),
    )


def prescribe(
    reduced: ContactNetwork, axes: tuple[int, ...], backbone: Backbone, sides: ContactSides, modes: int
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Lift and prescribed nodes: the walls of a walled axis, or the jumps of periodic axes and a pinned node a cluster.

    Walls and jumps are uniform over a contact: they load mode 0, and a wall holds the other modes at 0.
    """
    m = reduced.count
    prescribed = np.zeros((m + reduced.walls.size, modes), dtype=np.bool_)
    lift = np.zeros((sides.nodes.size, modes, len(axes)))
    if reduced.packing.box.periodic[axes[0]]:
        _, first = np.unique(backbone.clusters[reduced.pairs[:, 0]], return_index=True)
        prescribed[first, 0] = True
        lift[:, 0, :] = sides.arms[:, list(axes)]
    else:
        prescribed[m:] = True
        lift[:, 0, 0] = np.concatenate([np.zeros(m), 1.0 - reduced.walls % 2])[sides.nodes]
    return lift.reshape(-1, len(axes)), prescribed.ravel()


def _solve(system: LinearSystem, modes: int, tolerance: float) -> tuple[NDArray[np.float64], tuple[SolveReport, ...]]:
    """Free temperatures of all loads; a uniform temperature lives on mode 0 alone."""
    if system.matrix.shape[0] == 0:  # every node is a wall or pinned
        return np.zeros(system.rhs.shape), tuple(
            SolveReport(0, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0) for _ in system.lift_energies
        )
    preconditioner = build_preconditioner(system.matrix)
    uniform = (np.flatnonzero(system.free >= 0) % modes == 0).astype(np.float64)
    u = np.empty(system.rhs.shape)
    reports = []
    for load, lift_energy in enumerate(system.lift_energies):
        u[:, load], report = solve_energy(
            system.matrix,
            np.ascontiguousarray(system.rhs[:, load]),
            float(lift_energy),
            preconditioner=preconditioner,
            tolerance=tolerance,
            conserved=uniform,
        )
        reports.append(report)
    return u, tuple(reports)


def per_particle(values: ArrayLike, count: int, name: str) -> NDArray[np.float64]:
    """A positive value of each particle, from one number or an array."""
    return _positive(values, count, name, zero=False)


def _positive(values: ArrayLike, size: int, name: str, *, zero: bool) -> NDArray[np.float64]:
    """One value for each, all of them finite and positive (or zero where allowed)."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim and array.shape != (size,):
        raise InputError(f"the {name} must be one number or an array of shape ({size},), found {array.shape}")
    bad = ~(np.abs(array) <= LARGEST) | ((array < 0.0) if zero else (array < 1.0 / LARGEST))
    if bad.any():
        found = array[bad].flat[0]
        if found > 0.0 and np.isfinite(found):
            raise InputError(f"the {name} must lie between {1.0 / LARGEST:g} and {LARGEST:g}, found {found:g}")
        raise InputError(f"the {name} must be {'>= 0' if zero else 'positive'} and finite, found {found:g}")
    return np.broadcast_to(array, (size,))
