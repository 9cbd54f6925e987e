"""Spheres that store heat in a fluid, joined by facet links: the system of a transient."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.engines.dtem.assembly import assemble
from etc_engine.engines.dtem.element import Elements
from etc_engine.engines.dtem.facet_elements import (
    FacetMaterial,
    FacetSides,
    facet_elements,
    facet_resistances,
    facet_sides,
)
from etc_engine.engines.dtem.facet_medium import into_links, local_material, medium_links, medium_material
from etc_engine.engines.dtem.facet_nonlinear import link_temperatures
from etc_engine.engines.dtem.storage import with_states
from etc_engine.errors import GeometryError
from etc_engine.medium.facets import FacetLinks, links_network, no_contacts
from etc_engine.medium.medium import Medium
from etc_engine.medium.sides import ContactSides, contact_sides
from etc_engine.medium.transient import ParticleSystem, Source, joined_walls, particle_capacities, state_source
from etc_engine.medium.wall_nodes import heat_system, number_nodes
from etc_engine.medium.walls import WallCondition, wall_conditions
from etc_engine.solvers.marching import HeatSystem


def sphere_system(
    medium: Medium,
    walls: Mapping[str, WallCondition],
    *,
    method: str = "facets",  # noqa: ARG001
    dipoles: bool = False,
    source: Source = 0.0,
    capacities: Floats | None = None,
    **_: object,
) -> ParticleSystem:
    """Spheres that store heat, with the fluid around them, and the conditions at the walls of the box.

    Parameters
    ----------
    medium : Medium
        Three-dimensional, with heat capacities, and pores that conduct (and may store heat).
    walls : mapping of str to condition
        By the names of `etc_engine.medium.walls.WALLS`; a wall that is not named is insulated.
    method : str
        ``facets``.
    dipoles : bool
        Whether the spheres have dipole states, for earlier times.
    source : float, array_like, shape (n,), or callable of t [W]
        Heat set free evenly in all spheres, or in each.
    capacities : ndarray, shape (n,), optional [J/K]
        Of the spheres; rho c times what their contacts leave of them by default. That of the fluid is added.

    Returns
    -------
    ParticleSystem
        With 4 states per sphere with dipoles, otherwise 1. Its medium has a link for every facet.

    Raises
    ------
    InputError, GeometryError

    Notes
    -----
    The fluid of a Laguerre cell stores its heat at the mean temperature of the sphere inside. At rest the temperatures
    are those of the steady method. Where the properties of the medium follow the temperature, ``heat.at`` is the
    system at the temperatures of some unknowns, and ``heat`` that at the temperature of the medium.
    """
    links = medium_links(medium)
    material = medium_material(medium, links)
    conditions = wall_conditions(medium.box, walls)
    kept = joined_walls(links.walls, conditions)
    sides = facet_sides(links, kept, bool((material.open_fluid > 0.0).all()))
    n, states = medium.packing.count, 4 if dipoles else 1
    stored = np.repeat(_capacities(medium, links, capacities) / states, states)
    at_walls = sides.links[sides.links >= links.count] - links.count
    between = sides.links.size - at_walls.size
    nodes = number_nodes(medium.box, links.walls[at_walls], conditions, contacts=between, states=stored.size)
    released = state_source(source, n, states)

    def assembled(material: FacetMaterial) -> tuple[Elements, HeatSystem]:
        elements = _elements(links, material, sides, dipoles=dipoles)
        none = np.zeros((elements.nodes.size, 0)), np.zeros(nodes.unknowns.size, dtype=np.bool_)
        return elements, heat_system(assemble(elements, *none).matrix, nodes, stored, released)

    constant, heat = assembled(material)
    at = None if medium.local is None else local_material(medium, links)

    def material_of(time: float, unknowns: Floats) -> FacetMaterial:
        """The material at the temperatures of the unknowns."""
        if at is None:
            return material
        spheres = made.particle_temperatures(unknowns)
        return at(spheres, link_temperatures(links, spheres, made.wall_temperatures(time, unknowns)))

    if at is not None:
        heat = replace(heat, at=lambda time, unknowns: assembled(material_of(time, unknowns))[1])
    network = links_network(links, medium.network.rule if medium.network else "none")
    seen = contact_sides(network.select(np.ones(links.count, dtype=np.bool_), kept))
    is_facet = constant.nodes < nodes.unknowns.size - stored.size

    def flows(time: float, unknowns: Floats) -> Floats:
        """Q = A (T_c - T_o e), of rings and columns together."""
        elements = constant if at is None else assembled(material_of(time, unknowns))[0]
        rows = made.node_temperatures(time, unknowns)[elements.nodes]
        into = into_links(sides, links, elements.apply(rows[:, None])[is_facet, 0])
        return _by_side(seen, into[: links.count], into[links.count :][kept, 0])

    made = ParticleSystem(heat, medium.with_network(network), nodes, seen, np.flatnonzero(kept), flows)
    return made


def _elements(links: FacetLinks, material: FacetMaterial, sides: FacetSides, *, dipoles: bool) -> Elements:
    """Elements over the facets and the states of all spheres."""
    h = facet_resistances(links, material, sides)
    facet_elements(sides, h)  # mends what is not positive definite
    scales = material.conductivity * links.packing.radii
    elements, bad = with_states(h, sides.offsets, sides.nodes, scales, 3, dipoles=dipoles)
    if bad >= 0:
        cure = "leave the dipoles out or use smaller contacts" if dipoles else "use smaller contacts"
        raise GeometryError(
            f"sphere {bad} has a storage resistance that is not positive definite (method facets): {cure}"
        )
    return elements


def _by_side(sides: ContactSides, between: Floats, at_walls: Floats) -> Floats:
    out = np.empty(sides.nodes.size)
    out[sides.of_contacts] = between
    out[sides.of_walls] = at_walls
    return out


def _capacities(medium: Medium, links: FacetLinks, given: Floats | None) -> Floats:
    """Heat capacity of every sphere and of the fluid of its cell, shape (n,) [J/K]."""
    network = medium.network or no_contacts(medium.packing)
    whole = medium if medium.network else replace(medium, network=network)
    solid = particle_capacities(whole, given, cut=False)
    fluid = np.maximum(links.volumes - network.cut_measures(), 0.0)
    return np.asarray(solid + medium.pores.heat_capacity * fluid)
