"""The two transients of this comparison: a step of temperature at the left wall, everything else at 0 before."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from etc_engine import Box, ContactNetwork, overlap_contacts, read_csv
from etc_engine.medium.walls import FixedTemperature
from etc_engine.packing.particles import ParticlePacking

HERE = Path(__file__).parent
ASSEMBLY = HERE.parent / "feng2008" / "particles.csv"
HALF_ANGLE = np.radians(10.0)
FOURIER = np.round(np.geomspace(0.01, 100.0, 33), 6)
"""Output times, kappa t/(rho c R^2) with the mean radius R; kappa = rho c = 1."""


@dataclass(frozen=True)
class Case:
    """A contact network and its driven walls, (x, temperature)."""

    name: str
    walls: tuple[tuple[float, float], ...]

    def network(self) -> ContactNetwork:
        """Overlapping disks."""
        if self.name == "twelve":
            return overlap_contacts(read_csv(ASSEMBLY, Box((1.0, 1.0))).packing)
        half = 0.5 * np.cos(HALF_ANGLE)
        box = Box((3.0 * half + 0.5, 1.0))
        return overlap_contacts(ParticlePacking([[half, 0.5], [3.0 * half, 0.5]], [0.5, 0.5], box))

    @property
    def radius(self) -> float:
        """Mean radius, the length of the Fourier number [m]."""
        return float(self.network().packing.radii.mean())

    @property
    def conditions(self) -> dict[str, FixedTemperature]:
        """The driven walls by name."""
        return {side: FixedTemperature(T) for side, (_, T) in zip(("left", "right"), self.walls, strict=False)}


CASES = (Case("two", ((0.0, 1.0),)), Case("twelve", ((0.0, 1.0), (1.0, 0.0))))
