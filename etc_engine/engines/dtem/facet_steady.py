"""Steady conduction through spheres and the fluid in their pores by facet links: method ``facets`` in 3D."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from etc_engine.engines.dtem.assembly import LinearSystem, assemble
from etc_engine.engines.dtem.element import Elements, Resistances
from etc_engine.engines.dtem.facet_elements import (
    SMALL_FACET,
    FacetMaterial,
    FacetSides,
    facet_elements,
    facet_resistances,
    facet_sides,
    weakened_spheres,
)
from etc_engine.errors import InputError
from etc_engine.medium.backbone import Backbone
from etc_engine.medium.conductivity import EffectiveConductivity, effective_tensor
from etc_engine.medium.facets import FacetLinks
from etc_engine.medium.loads import driven_walls, wall_temperatures
from etc_engine.solvers import SolveReport, solve_loads
from etc_engine.solvers.star import star_preconditioner
from etc_engine.solvers.summation import inner

ALIKE = 1.5
"""Contrast below which spheres and fluid are nearly alike."""
LOOSE = 0.52
"""Density below which gaps are wide."""
FEW_FACETS = 9
"""Spheres with fewer facets ..."""
HIGH_CONTRAST = 5.0
"""... at a higher contrast send heat past their neighbours."""


@dataclass(frozen=True, eq=False)
class FacetSolution:
    """Temperatures and heat flows of all facets.

    Parameters
    ----------
    links : FacetLinks
    axes : tuple of int
        Load axes, one column k each: walls at temperature 1 (low end) and 0 (far end), or a mean
        temperature gradient of 1 along a periodic axis.
    sides : FacetSides
    material : FacetMaterial
    resistances : Resistances
        Matrices H of all spheres.
    temperatures : ndarray, shape (s, k) [K]
        Node temperature at each side; along a periodic axis measured from the mean gradient at the sphere's centre.
    heat_flows : ndarray, shape (s, k) [W]
        Into the sphere at each side.
    energies : ndarray, shape (k, k)
    reports : tuple of SolveReport
        One per load.
    """

    links: FacetLinks
    axes: tuple[int, ...]
    sides: FacetSides
    material: FacetMaterial
    resistances: Resistances
    temperatures: NDArray[np.float64]
    heat_flows: NDArray[np.float64]
    energies: NDArray[np.float64]
    reports: tuple[SolveReport, ...]

    @property
    def backbone(self) -> Backbone:
        """Everything takes part: pores that conduct leave no dead ends."""
        driven = driven_walls(self.links, self.axes)
        clusters = np.zeros(self.links.packing.count, dtype=np.int64)
        return Backbone(np.ones(self.links.count, dtype=np.bool_), driven, clusters, (True,) * len(self.axes))

    def wall_heat(self) -> tuple[float, float]:
        """Heat flow into the spheres at the low wall and out of them at the far one [W]."""
        at_wall = self.sides.links[self.sides.nodes] >= self.links.count
        hot = at_wall & (self.temperatures[:, 0] == 1.0)
        return float(self.heat_flows[hot, 0].sum()), -float(self.heat_flows[at_wall & ~hot, 0].sum())

    @cached_property
    def sphere_temperatures(self) -> NDArray[np.float64]:
        """Mean temperature of every sphere, T_o = T_i - sum_j H_ij Q_j of its first facet, shape (n, k) [K]."""
        starts, values = self.resistances.starts, self.resistances.values
        sizes = np.diff(self.sides.offsets)
        first_row = np.repeat(starts[:-1] - self.sides.offsets[:-1], sizes) + np.arange(self.sides.nodes.size)
        rise = values[first_row, None] * self.heat_flows
        above = np.add.reduceat(rise, self.sides.offsets[:-1], axis=0)
        return np.asarray(self.temperatures[self.sides.offsets[:-1]] - above)


def uniform_material(
    links: FacetLinks,
    conductivity: ArrayLike,
    fluid: ArrayLike,
    jumps: ArrayLike = 0.0,
    radiation: ArrayLike = 0.0,
    open_fluid: ArrayLike | None = None,
) -> FacetMaterial:
    """Material from one number, or one per sphere (conductivity) and per link (the rest).

    ``open_fluid`` is the conductivity of the fluid beyond the spheres; that of the gaps if left out.

    Raises
    ------
    InputError
        If a value is negative or not finite, a shape does not fit, or a sphere conducts less than the fluid.
    """
    n, m = links.packing.count, links.count + links.walls.size
    values = {
        "conductivity of the spheres": (conductivity, n),
        "pore conductivity": (fluid, m),
        "conductivity of the open pore": (fluid if open_fluid is None else open_fluid, m),
        "temperature jump": (jumps, m),
        "radiative conductance": (radiation, m),
    }
    arrays = []
    for name, (value, size) in values.items():
        array = np.asarray(value, dtype=np.float64)
        if array.shape not in ((), (size,)):
            raise InputError(f"the {name} must be one number or an array of shape ({size},), found {array.shape}")
        if not ((array >= 0.0) & np.isfinite(array)).all():
            raise InputError(f"the {name} must be >= 0 and finite")
        arrays.append(np.array(np.broadcast_to(array, (size,))))
    kappa, pores = arrays[:2]
    if kappa.min() <= 0.0 or kappa.min() < pores.max(initial=0.0):
        raise InputError(
            f"facet links need spheres that conduct at least as well as the pores, found {kappa.min():.6g} in pores of "
            f"{pores.max(initial=0.0):.6g} W/(m K); use engine voxel or lattice for the opposite case"
        )
    return FacetMaterial(*arrays)


def solve_facets(
    links: FacetLinks, material: FacetMaterial, axes: tuple[int, ...], *, tolerance: float = 1e-10
) -> FacetSolution:
    """Solve for the facet temperatures of one walled axis, or of periodic axes together.

    Walls: K u = -sum_p P_p^T K_p t^wall_p. Periodic: a mean gradient e_a adds the jump j_p(c) = (x_c - x_p)_a to the
    periodic fluctuation u, K u_a = -sum_p P_p^T K_p j_pa.

    Parameters
    ----------
    links : FacetLinks
    material : FacetMaterial
    axes : tuple of int
        A single walled axis, or periodic axes only.
    tolerance : float
        Relative error of the conductivity left by the solver.

    Returns
    -------
    FacetSolution

    Raises
    ------
    InputError, GeometryError, ConvergenceError

    Notes
    -----
    Conjugate gradients, preconditioned by the elements as stars (`etc_engine.solvers.star`): 2 to 20 iterations.
    """
    sides = facet_sides(links, driven_walls(links, axes), bool((material.open_fluid > 0.0).all()))
    return solve_sides(links, material, axes, sides, tolerance=tolerance)[0]


def solve_sides(
    links: FacetLinks,
    material: FacetMaterial,
    axes: tuple[int, ...],
    sides: FacetSides,
    *,
    tolerance: float = 1e-10,
    nearby: FacetSolution | None = None,
) -> tuple[FacetSolution, Elements]:
    """`solve_facets` on known sides, with its elements; starts from the solution of a similar material on them."""
    h = facet_resistances(links, material, sides)
    elements = facet_elements(sides, h)
    lift, prescribed = lift_and_prescribed(links, sides, axes)
    system = assemble(elements, lift, prescribed)
    rows = system.free[elements.nodes]
    initial = np.zeros(system.rhs.shape)
    if nearby is not None:
        initial[rows[rows >= 0]] = (nearby.temperatures - lift)[rows >= 0]
    u, reports = _solve(system, elements, h.values, initial, tolerance)
    temperatures = system.element_temperatures(elements, u)
    flows = elements.apply(temperatures)
    energies = inner(temperatures, flows)
    solution = FacetSolution(links, axes, sides, material, h, temperatures, flows, energies, reports)
    return solution, elements


def lift_and_prescribed(
    links: FacetLinks, sides: FacetSides, axes: tuple[int, ...]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Lift and prescribed nodes: the driven walls, or the jumps of periodic axes and one pinned node."""
    prescribed = np.zeros(sides.links.size, dtype=np.bool_)
    if links.packing.box.periodic[axes[0]]:
        prescribed[0] = True
        return sides.arms[:, list(axes)], prescribed
    wall = sides.links >= links.count
    prescribed[wall] = True
    hot = np.zeros(sides.links.size)
    hot[wall] = wall_temperatures(links.walls[sides.links[wall] - links.count])
    return hot[sides.nodes, None], prescribed


def _solve(
    system: LinearSystem,
    elements: Elements,
    resistances: NDArray[np.float64],
    initial: NDArray[np.float64],
    tolerance: float,
) -> tuple[NDArray[np.float64], tuple[SolveReport, ...]]:
    """Free temperatures of all loads."""
    size = system.matrix.shape[0]
    if size == 0:
        return solve_loads(system.matrix, system.rhs, system.lift_energies)
    widths = np.diff(elements.offsets)
    owner = np.repeat(np.arange(widths.size), widths)
    local = np.arange(owner.size) - elements.offsets[owner]
    diagonal = resistances[elements.starts[owner] + local * (widths[owner] + 1)]
    diagonal = np.where(diagonal > 0.0, diagonal, np.median(diagonal[diagonal > 0.0]))  # one of a sphere may be below
    preconditioner = star_preconditioner(system.free[elements.nodes], owner, 1.0 / diagonal, size)
    return solve_loads(
        system.matrix,
        system.rhs,
        system.lift_energies,
        preconditioner=preconditioner,
        initial=initial,
        tolerance=tolerance,
    )


def facet_conductivity(
    links: FacetLinks, material: FacetMaterial, *, tolerance: float = 1e-10, axes: tuple[int, ...] | None = None
) -> EffectiveConductivity[FacetSolution]:
    """Effective conductivity of spheres in a conducting fluid.

    Walls: k_aa = Q L_a / (S_a dT). Periodic: k_ab = (1/V) sum_p t_pa . K_p t_pb.

    Parameters
    ----------
    links : FacetLinks
    material : FacetMaterial
    tolerance : float
    axes : tuple of int, optional
        Load axes wanted; all by default.

    Returns
    -------
    EffectiveConductivity

    Raises
    ------
    InputError, GeometryError, ConvergenceError

    Notes
    -----
    Against lattice sums (contrast 2 to 1e4, gaps .002 to .1 R): body- and face-centred cubic within 1 %, simple cubic
    -1 to -13.5 %. Random packings of solid fraction .60 within 1.5 % at contrast 2 to 100. Wider gaps are worse, see
    `accuracy_warnings`.

    Examples
    --------
    A face-centred cubic array, nearly touching, contrast 100; the sum of multipoles gives 16.56:

    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.facets import facet_links
    >>> from etc_engine.medium.rules import overlap_contacts
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> a = 2.002 * np.sqrt(2.0)
    >>> corners = a * (np.array([[0, 0, 0], [0, 1, 1], [1, 0, 1], [1, 1, 0]]) / 2 + 0.25)
    >>> spheres = ParticlePacking(corners, np.ones(4), Box((a, a, a), (True, True, True)))
    >>> links = facet_links(overlap_contacts(spheres))
    >>> facet_conductivity(links, uniform_material(links, 100.0, 1.0)).tensor.round(2).diagonal()
    array([16.55, 16.55, 16.55])
    """
    return effective_tensor(
        links.packing.box, axes, lambda group: solve_facets(links, material, group, tolerance=tolerance)
    )


def accuracy_warnings(solution: FacetSolution) -> tuple[str, ...]:
    """One line for everything that makes facet links inaccurate.

    Few facets per sphere: in a simple cubic array the heat bends to second neighbours, with which a sphere shares no
    facet (-1 % at contrast 2, -5 .. -8 % at 10, -6 .. -13.5 % above). Wide gaps: at solid fractions of .2 to .5 cubic
    arrays are up to 5.7 % high, dilute random packings 3 % low. Spheres and fluid nearly alike: random packings are
    up to 2.4 % low at contrast 1, where no bounds hold them (`held_between_bounds`). Spheres cut so deep that their
    matrices were mended.
    """
    links, material = solution.links, solution.material
    contrast = float(np.median(material.conductivity) / max(float(np.median(material.open_fluid)), 1e-300))
    return tuple(
        text
        for text in (
            low_coordination_warning(links, material),
            _loose_warning(links, contrast),
            _alike_warning(contrast),
            _cut_warning(weakened_spheres(links, material, solution.sides, solution.resistances)),
        )
        if text
    )


def _loose_warning(links: FacetLinks, contrast: float) -> str:
    density = links.packing.density
    if density >= LOOSE or contrast < HIGH_CONTRAST:
        return ""
    return (
        f"facet links are made for dense beds: at a density of {density:.2f} and contrast {contrast:.3g} they may be "
        "6 % high (regular arrays) or 3 % low (dilute); check with method cell"
    )


def _alike_warning(contrast: float) -> str:
    if contrast >= ALIKE:
        return ""
    return (
        f"at a contrast of {contrast:.3g} facet links alone are up to 2.4 % low: with a continuum and no contact "
        "resistances rigorous bounds hold them, otherwise use method cell"
    )


def _cut_warning(count: int) -> str:
    if not count:
        return ""
    return (
        f"{count} sphere(s) are cut so deep by walls or contacts that their facets overlap: the coupling between "
        "those was weakened"
    )


def low_coordination_warning(links: FacetLinks, material: FacetMaterial) -> str:
    """One line where facet links lose accuracy: few facets per sphere at a high contrast; empty otherwise.

    In a simple cubic array the heat bends to second neighbours, with which a sphere shares no facet: -1 % at contrast
    2, -5 .. -8 % at 10, -6 .. -13.5 % above.
    """
    radii = links.packing.radii
    pairs = links.pairs[links.areas >= SMALL_FACET * radii[links.pairs].min(axis=1, initial=np.inf) ** 2]
    facets = np.bincount(np.concatenate([pairs.ravel(), links.wall_particles]), minlength=radii.size)
    few = float(np.mean(facets < FEW_FACETS))
    contrast = float(np.median(material.conductivity) / max(float(np.median(material.fluid)), 1e-300))
    if few < 0.1 or contrast < HIGH_CONTRAST:
        return ""
    return (
        f"{few:.0%} of the spheres have fewer than {FEW_FACETS} facets at contrast {contrast:.3g}: facet links may be "
        f"4 to 13 % low there; check with method cell"
    )
