"""Steady heat conduction through a contact network: one load axis, or all periodic axes at once."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from etc_engine.arrays import Flags, Floats
from etc_engine.engines.dtem.assembly import assemble, count_positive_off_diagonals
from etc_engine.engines.dtem.methods import Variant, find_method, flux_modes
from etc_engine.medium.backbone import Backbone, find_backbone, restore_dead_ends
from etc_engine.medium.loads import contact_lift, driven_walls
from etc_engine.medium.medium import Medium, check_conductors
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.sides import NO_CUTS, ContactSides, check_arcs, contact_sides, insulated_cuts
from etc_engine.solvers import SolveReport, solve_loads
from etc_engine.solvers.summation import inner


@dataclass(frozen=True, eq=False)
class SteadySolution:
    """Temperatures and heat flows on the backbone of a contact network.

    Parameters
    ----------
    medium : Medium
        With its whole contact network.
    axes : tuple of int
        Load axes, one column k each: walls at temperature 1 (low end) and 0 (far end), or a mean
        temperature gradient of 1 along a periodic axis.
    backbone : Backbone
        What takes part.
    sides : ContactSides
        The contact sides of the backbone.
    method : str
        Name of the method.
    temperatures : ndarray, shape (s, k) [K]
        Node temperature at each side; along a periodic axis measured from the mean gradient at the
        particle's centre.
    flows : ndarray, shape (s, M, k) [W/m]
        Flux modes into the particle at each side; mode 0 is the heat flow.
    energies : ndarray, shape (k, k)
        sum_p t_pa . K_p t_pb.
    reports : tuple of SolveReport
        One per load.
    positive_off_diagonals : int
        Entries of the matrix that break the M-matrix property.
    """

    medium: Medium
    axes: tuple[int, ...]
    backbone: Backbone
    sides: ContactSides
    method: str
    temperatures: Floats
    flows: Floats
    energies: Floats
    reports: tuple[SolveReport, ...]
    positive_off_diagonals: int

    @property
    def network(self) -> ContactNetwork:
        """The whole contact network."""
        return self.medium.links

    @property
    def modes(self) -> int:
        """Flux modes of a contact."""
        return int(self.flows.shape[1])

    @property
    def heat_flows(self) -> Floats:
        """Heat flow into the particle at each side, shape (s, k) [W/m]."""
        return self.flows[:, 0, :]

    def wall_heat(self) -> tuple[float, float]:
        """Heat flow into the particles at the low wall and out of them at the far wall [W/m]."""
        at_wall = self.sides.nodes >= int(self.backbone.contacts.sum())
        hot = at_wall & (self.temperatures[:, 0] == 1.0)
        cold = at_wall & ~hot
        return float(self.heat_flows[hot, 0].sum()), -float(self.heat_flows[cold, 0].sum())


@dataclass(frozen=True, eq=False)
class ElementGeometry:
    """What the elements of one load group stand on, at any half-angle.

    Parameters
    ----------
    variant : Variant
    modes : int
    conductivity : ndarray, shape (n,) [W/(m K)]
    backbone : Backbone
        Of what takes part: with its dead ends where the variant needs them.
    sides : ContactSides
        Of the contacts that take part.
    every_side : ContactSides, optional
        Of all contacts, driven walls included, where some take no part: they must still be a valid geometry.
    lift : ndarray, shape (rows, k)
    prescribed : ndarray of bool, shape (nodes,)
        As of `etc_engine.medium.loads.contact_lift`.
    """

    variant: Variant
    modes: int
    conductivity: Floats
    backbone: Backbone
    sides: ContactSides
    every_side: ContactSides | None
    lift: Floats
    prescribed: Flags


def element_geometry(
    medium: Medium, axes: tuple[int, ...], method: str, modes: int | None, backbone: Backbone | None
) -> ElementGeometry:
    """Backbone, contact sides and loads of one load group; arguments as in `solve_steady`."""
    network = medium.links
    check_conductors(medium)
    variant, modes = find_method(method, medium.dimension), flux_modes(method, modes, medium.dimension)
    backbone = find_backbone(network, axes) if backbone is None else backbone
    driven, cuts = driven_walls(network, axes), NO_CUTS
    if variant.exact_cuts:
        backbone = restore_dead_ends(network, backbone)
        cuts = insulated_cuts(network, driven)
    reduced = network.select(backbone.contacts, backbone.wall_contacts)
    sides = contact_sides(reduced, cuts)
    every_side = None
    if not (backbone.contacts.all() and backbone.wall_contacts.all()):
        every_side = contact_sides(network.select(np.ones_like(backbone.contacts), driven))
    lift, prescribed = contact_lift(reduced, axes, backbone.clusters, sides, modes)
    return ElementGeometry(variant, modes, medium.conductivity, backbone, sides, every_side, lift, prescribed)


def solve_steady(
    medium: Medium,
    axes: tuple[int, ...],
    *,
    method: str = "chord",
    tolerance: float = 1e-10,
    modes: int | None = None,
    backbone: Backbone | None = None,
) -> SteadySolution:
    """Solve the discrete thermal element equations for one walled axis, or for periodic axes together.

    Walls: K u = -sum_p P_p^T K_p t^wall_p with the driven walls' nodes prescribed. Periodic: a mean gradient
    e_a adds the jump j_p(c) = (x_c - x_p)_a to the periodic fluctuation u, K u_a = -sum_p P_p^T K_p j_pa.

    Parameters
    ----------
    medium : Medium
        Of disks or spheres, with a contact network.
    axes : tuple of int
        A single walled axis, or periodic axes only.
    method : str
        A name of `etc_engine.engines.dtem.methods.METHODS`.
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
    made = element_geometry(medium, axes, method, modes, backbone)
    check_arcs(made.sides)
    if made.every_side is not None:
        check_arcs(made.every_side)
        made = replace(made, every_side=None)  # as large as the sides: freed before the solver takes its memory
    elements = made.variant.elements(made.sides, made.conductivity, made.modes)
    system = assemble(elements, made.lift, made.prescribed)
    # a uniform temperature lives on mode 0 alone
    uniform = (np.flatnonzero(system.free >= 0) % made.modes == 0).astype(np.float64)
    u, reports = solve_loads(system.matrix, system.rhs, system.lift_energies, tolerance=tolerance, conserved=uniform)
    temperatures = system.element_temperatures(elements, u)
    flows = elements.apply(temperatures)
    return SteadySolution(
        medium=medium,
        axes=axes,
        backbone=made.backbone,
        sides=made.sides,
        method=method,
        temperatures=temperatures[:: made.modes],
        flows=flows.reshape(made.sides.nodes.size, made.modes, len(axes)),
        energies=inner(temperatures, flows),
        reports=reports,
        positive_off_diagonals=count_positive_off_diagonals(system.matrix),
    )
