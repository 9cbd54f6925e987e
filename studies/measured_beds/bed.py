"""A periodic bed of equal spheres, scaled to pebbles of any size, and its conductivity under given conditions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from etc_engine.engines.dtem.facet_steady import facet_conductivity, uniform_material
from etc_engine.laws.contact import Elastic, effective_modulus, mean_field_force, radius_from_force
from etc_engine.laws.radiation import grey_exchange
from etc_engine.laws.roughness import Roughness, area_resistance
from etc_engine.materials import gas_state, jump_length, pore_conductivity
from etc_engine.medium.facets import FacetLinks, facet_links
from etc_engine.medium.medium import Medium, Pores
from etc_engine.medium.rules import overlap_contacts
from etc_engine.particle_files.formats import read_table
from etc_engine.realization import effective_conductivity

VOXELS = 96
"""Along the edge of a bed, 12 along the diameter of a sphere."""


@dataclass(frozen=True)
class Conditions:
    """What a measurement, or an assumption, says of a bed.

    ``gas`` None: the number ``fluid`` is the conductivity of the pores [W/(m K)]. Everything is SI.
    """

    solid: float
    gas: str | None
    temperature: float
    pressure: float
    diameter: float
    emissivity: float
    accommodation: float
    load: float  # mean stress carried by the contacts [Pa]
    roughness: float  # root-mean-square height of both surfaces [m]
    youngs_modulus: float
    poisson_ratio: float = 0.25
    slope: float = 0.1
    hardness: float = 4e9
    fluid: float = 0.0


class Bed:
    """A bed of unit spheres; lengths scale with the diameter."""

    def __init__(self, path: Path) -> None:
        packing = read_table(path).packing
        network = overlap_contacts(packing)
        self.packing = packing
        self.links: FacetLinks = facet_links(network)
        self.density = packing.density
        self.coordination = 2.0 * network.count / packing.count

    def conductivity(self, c: Conditions) -> float:
        """Mean of the diagonal of the conductivity tensor [W/(m K)]."""
        radius = 0.5 * c.diameter
        modulus = effective_modulus(*[Elastic(c.youngs_modulus, c.poisson_ratio)] * 2)
        force = mean_field_force(c.load, radius, self.density, self.coordination)
        width = float(radius_from_force(force, 0.5 * radius, modulus))
        fluid, in_pores, jumps = c.fluid, c.fluid, 0.0
        if c.gas is not None:
            gas = gas_state(c.gas, c.temperature, c.pressure)
            jump = jump_length(gas, c.accommodation)
            fluid = gas.conductivity if c.pressure > 0.0 else 0.0
            in_pores = pore_conductivity(gas, jump, c.diameter, self.density)
            jumps = 2.0 * jump if c.pressure > 0.0 else 0.0
        bond = 0.0
        if c.roughness > 0.0:
            rough = Roughness(c.roughness, c.slope, hardness=c.hardness)
            spot = np.pi * width**2
            bond = float(area_resistance(force / spot, c.solid, rough, fluid, jumps)) / spot
        glow = float(grey_exchange(c.temperature, c.emissivity, c.emissivity)) if c.emissivity > 0.0 else 0.0
        closed = self.links.contacts > 0.0
        links = replace(
            self.links,
            contacts=np.where(closed, 0.5 * width / radius, 0.0),
            bonds=np.where(closed, bond * c.diameter, 0.0),
        )
        material = uniform_material(links, c.solid, fluid, jumps / c.diameter, glow * c.diameter, open_fluid=in_pores)
        return float(np.trace(facet_conductivity(links, material, tolerance=1e-6).tensor)) / 3.0

    @cache  # noqa: B019 - three beds
    def by_voxels(self, contrast: float) -> float:
        """k/k_f where solid and fluid are alike: facet links are up to 2.4 % low there, or do not take the solid."""
        medium = Medium(self.packing, contrast, pores=Pores(1.0))
        return effective_conductivity(medium, engine="voxel", resolution=VOXELS).mean
