"""Random packings of disks and spheres: (spec, rng) -> ParticlePacking."""

from etc_engine.packing.algorithms import METHODS, PackingSpec, pack
from etc_engine.packing.density import set_density
from etc_engine.packing.neighbors import NeighborPairs, neighbor_pairs
from etc_engine.packing.particles import ParticlePacking
from etc_engine.packing.radii import RadiusDistribution, parse_radii

__all__ = [
    "METHODS",
    "NeighborPairs",
    "PackingSpec",
    "ParticlePacking",
    "RadiusDistribution",
    "neighbor_pairs",
    "pack",
    "parse_radii",
    "set_density",
]
