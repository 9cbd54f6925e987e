"""Random packings of disks and spheres: (spec, rng) -> ParticlePacking."""

from etc_engine.packing.particles import ParticlePacking

__all__ = ["ParticlePacking"]
