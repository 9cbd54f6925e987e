"""Facet links on a medium: conductivity of one and of many, and fields."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from etc_engine.engines.dtem.facet_bounds import held_between_bounds, needs_all_axes
from etc_engine.engines.dtem.facet_elements import FacetMaterial, FacetSides
from etc_engine.engines.dtem.facet_family import FEW_MATERIALS, FamilyMember, solve_family
from etc_engine.engines.dtem.facet_nonlinear import MaterialAt
from etc_engine.engines.dtem.facet_steady import (
    FacetSolution,
    accuracy_warnings,
    facet_conductivity,
    uniform_material,
)
from etc_engine.errors import EtcError, InputError
from etc_engine.medium.conduction import Conduction, Result, attempt
from etc_engine.medium.conductivity import EffectiveConductivity, conductivities
from etc_engine.medium.facets import FacetLinks, facet_links, links_network, no_contacts
from etc_engine.medium.field import ParticleField
from etc_engine.medium.loads import asked_groups, driven_walls, wall_temperatures
from etc_engine.medium.medium import Medium, check_conductors
from etc_engine.medium.sides import contact_sides

Floats = NDArray[np.float64]

MOVED = 1e-4
"""A shift onto a bound by more than this part is worth a warning."""


def medium_links(medium: Medium) -> FacetLinks:
    """Facets of the packing of a medium, with the contacts of its network if it has one.

    Raises
    ------
    GeometryError
        If a sphere is hidden.
    """
    return facet_links(medium.network or no_contacts(medium.packing))


def medium_material(medium: Medium, links: FacetLinks) -> FacetMaterial:
    """What spheres and pores of a medium are made of.

    Raises
    ------
    InputError
        If a sphere conducts less than the pores.
    """
    check_conductors(medium)
    pores = medium.pores
    return uniform_material(
        links, medium.conductivity, pores.conductivity, pores.jump_length, pores.radiation, pores.in_open_pores
    )


def local_material(medium: Medium, links: FacetLinks) -> MaterialAt:
    """What spheres and pores of a medium are made of, by the temperatures of spheres and links.

    Raises
    ------
    InputError
        If the properties of the medium do not follow the temperature; from the function, if a temperature is out of
        the range of a property or a sphere conducts less than the pores.
    """
    check_conductors(medium)
    local = medium.local
    if local is None:
        raise InputError("the properties of this medium do not follow the temperature: give it local properties")

    def material_at(spheres: Floats, between: Floats) -> FacetMaterial:
        fluid, open_fluid, jumps, radiation = local.pores(between)
        return uniform_material(links, local.solid(spheres), fluid, jumps, radiation, np.minimum(open_fluid, fluid))

    return material_at


def sphere_conductivity(
    medium: Medium,
    *,
    axes: tuple[int, ...] | None = None,
    tolerance: float = 1e-10,
    links: FacetLinks | None = None,
) -> EffectiveConductivity[FacetSolution]:
    """Effective conductivity of spheres and of the fluid between them, by facet links.

    Parameters
    ----------
    medium : Medium
        Three-dimensional, with pores that conduct or radiate. Contacts are those of its network.
    axes : tuple of int, optional
        Load axes; all by default.
    tolerance : float
        Relative error of the conductivity left by the solver.
    links : FacetLinks, optional
        Of the same network, if already known.

    Returns
    -------
    EffectiveConductivity
        Every axis is spanned, through the pores. Not beyond the bounds of
        `etc_engine.engines.dtem.facet_bounds.held_between_bounds`.

    Raises
    ------
    InputError, GeometryError, ConvergenceError

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.medium import Pores
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> cell = ParticlePacking([[0.25] * 3, [0.75] * 3], [0.43, 0.43], Box((1.0, 1.0, 1.0), (True, True, True)))
    >>> round(sphere_conductivity(Medium(cell, 10.0, pores=Pores(1.0))).mean, 2)  # multipoles: 4.43
    4.44
    """
    links = links or medium_links(medium)
    material = medium_material(medium, links)
    found = facet_conductivity(links, material, tolerance=tolerance, axes=axes)
    if not needs_all_axes(found, medium):
        return held_between_bounds(found, medium)
    whole = held_between_bounds(facet_conductivity(links, material, tolerance=tolerance), medium)
    return replace(found, tensor=np.where(np.isnan(found.tensor), np.nan, whole.tensor))


def solve_series(media: Sequence[Medium], conduction: Conduction) -> list[Result]:
    """Effective conductivity of media on one packing, one result per medium.

    Media with the same contacts share their facets. At least `FEW_MATERIALS` of them, which differ in temperature,
    pressure or a conductivity, are solved together (`etc_engine.engines.dtem.facet_family`), unless the option
    ``material_curve`` is ``full``; what that cannot solve is solved alone, which says why.
    """
    together: dict[int, list[int]] = {}
    for row, medium in enumerate(media):
        together.setdefault(id(medium.network), []).append(row)
    found: dict[int, Result] = {}
    for rows in together.values():
        try:
            links = medium_links(media[rows[0]])
        except EtcError as error:
            found.update(dict.fromkeys(rows, error))
            continue
        if len(rows) >= FEW_MATERIALS and conduction.options.get("material_curve", "reduced") == "reduced":
            family = _family(media, rows, links, conduction)
            found |= {
                row: held_between_bounds(result, media[row])
                for row, result in family.items()
                if not needs_all_axes(result, media[row])  # solved alone
            }
        for row in rows:
            if row not in found:
                solve = partial(
                    sphere_conductivity,
                    media[row],
                    axes=conduction.axes,
                    tolerance=conduction.tolerance,
                    links=links,
                )
                found[row] = attempt(solve)
    return [found[row] for row in range(len(media))]


def _family(
    media: Sequence[Medium], rows: Sequence[int], links: FacetLinks, conduction: Conduction
) -> dict[int, EffectiveConductivity[FacetSolution]]:
    """Results of the media that could be solved together."""
    axes, box, start = conduction.axes, links.packing.box, time.perf_counter()
    try:
        materials = [medium_material(media[row], links) for row in rows]
        by_group = {
            group: solve_family(links, materials, group, tolerance=conduction.tolerance)
            for group in asked_groups(box, axes)
        }
    except EtcError:
        return {}
    each = (time.perf_counter() - start) / len(rows)
    unknowns = max(
        report.unknowns
        for members in by_group.values()
        for member in members
        if member.solution is not None
        for report in member.solution.reports
    )
    return {
        row: replace(
            _joined(links, {group: members[place] for group, members in by_group.items()}),
            unknowns=unknowns,
            seconds=each,
        )
        for place, row in enumerate(rows)
    }


def _joined(links: FacetLinks, members: Mapping[tuple[int, ...], FamilyMember]) -> EffectiveConductivity[FacetSolution]:
    """The load groups of one medium as one conductivity."""
    box = links.packing.box
    tensor = np.full((3, 3), np.nan)
    spanned: list[bool | None] = [None] * 3
    for group, member in members.items():
        tensor[np.ix_(group, group)] = conductivities(box, group, member.energies)
        for axis in group:
            spanned[axis] = True
    solutions = tuple(member.solution for member in members.values() if member.solution is not None)
    reports = [report for solution in solutions for report in solution.reports]
    full = len(solutions) == len(members)
    return EffectiveConductivity(
        tensor,
        tuple(spanned),
        0,
        max((report.iterations for report in reports), default=0),
        max([member.relative_error for member in members.values()] + [r.relative_energy_error for r in reports]),
        solutions if full else (),
        snapshots=0 if full else max(member.anchors for member in members.values()),
    )


def accuracy_remarks(_: str, result: EffectiveConductivity[FacetSolution]) -> tuple[str, ...]:
    """Warnings where facet links are known to be inaccurate, and where a bound took the place of their value."""
    if not result.solutions:
        return ()
    moved = 0.0
    for solution in result.solutions:
        own = np.diag(conductivities(solution.links.packing.box, solution.axes, solution.energies))
        shift = np.diag(result.tensor)[list(solution.axes)] / own - 1.0
        moved = max(moved, float(np.abs(shift).max()))
    held = (
        f"facet links miss rigorous bounds by {100.0 * moved:.2g} %: the conductivity is moved onto them, temperatures "
        "and heat flows are not; check with method cell"
    )
    return (*accuracy_warnings(result.solutions[0]), *((held,) if moved > MOVED else ()))


def sphere_field(medium: Medium, solution: FacetSolution, load: int = 0) -> ParticleField:
    """Temperatures and heat flows of spheres in a fluid: every facet is a link, of half-angle 0 where it is a gap.

    Parameters
    ----------
    medium : Medium
    solution : FacetSolution
        Of the medium.
    load : int
        Column of the solution.

    Notes
    -----
    The temperature of a link is that of its rings, or of its column of fluid where it has none. Walls without a
    temperature take no heat; theirs is that of the sphere.
    """
    links, sides, axis = solution.links, solution.sides, solution.axes[load]
    linked = sphere_links(medium, solution)
    m, w = links.count, links.walls.size
    into = into_links(sides, links, solution.heat_flows[:, load])
    mean = solution.sphere_temperatures[:, load].copy()
    node = solution.temperatures[:, load].copy()
    if links.packing.box.periodic[axis]:
        centers = links.packing.centers[:, axis]
        mean += centers
        node += np.repeat(centers, np.diff(sides.offsets))
    of_links = np.concatenate([mean[links.pairs[:, 0]], mean[links.wall_particles]])
    first = np.flatnonzero(sides.ends == 0)
    first = first[np.argsort(sides.columns[sides.nodes[first]] == 0.0, kind="stable")]  # rings last: they count
    of_links[sides.links[sides.nodes[first]]] = node[first]
    driven = driven_walls(links, solution.axes)
    at_walls = np.where(driven, wall_temperatures(links.walls), of_links[m:])
    contact = contact_sides(linked.links)
    modes = np.zeros((contact.nodes.size, 1))
    modes[contact.of_contacts, 0] = into[:m]
    modes[contact.of_walls, 0] = into[m : m + w, 0]
    return ParticleField(
        medium=linked,
        axis=axis,
        sides=contact,
        particle_temperatures=mean,
        contact_temperatures=of_links[:m],
        wall_temperatures=at_walls,
        contact_flows=into[:m, 1],
        wall_flows=-into[m:, 0],
        face_temperatures=np.column_stack([of_links[:m], of_links[:m]]),
        flow_modes=modes,
    )


def sphere_links(medium: Medium, solution: FacetSolution) -> Medium:
    """The medium with every facet as a link."""
    return medium.with_network(links_network(solution.links, medium.network.rule if medium.network else "none"))


def into_links(sides: FacetSides, links: FacetLinks, flows: Floats) -> Floats:
    """Heat into the sphere at either end of each link, rings and columns together, shape (m + w, 2)."""
    place = 2 * sides.links[sides.nodes] + sides.ends
    total = np.bincount(place, weights=flows, minlength=2 * (links.count + links.walls.size))
    return np.asarray(total, dtype=np.float64).reshape(-1, 2)
