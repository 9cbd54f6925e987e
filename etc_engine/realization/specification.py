"""Everything that defines one realization but its random stream."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etc_engine.packing import PackingSpec


@dataclass(frozen=True)
class ContactSpec:
    """Which pairs conduct, and through how wide an arc.

    Parameters
    ----------
    rule : str
        ``overlap``, ``bonded`` or ``coordination``.
    contact_angles : tuple of float [rad]
        Half-angles of prescribed contacts, one cell each; empty with ``overlap``, where geometry sets them.
    bond_gap : float
        Largest bonded gap, in mean radii of the pair.
    coordination : float, optional
        Mean coordination number wanted by the ``coordination`` rule.
    """

    rule: str = "overlap"
    contact_angles: tuple[float, ...] = ()
    bond_gap: float = 1e-6
    coordination: float | None = None


@dataclass(frozen=True)
class Mixture:
    """A second material, given to randomly chosen particles.

    Parameters
    ----------
    conductivity : float [W/(m K)]
        Its conductivity.
    fraction : float
        Its number fraction, met to the nearest particle.
    """

    conductivity: float
    fraction: float


@dataclass(frozen=True)
class ConductionSpec:
    """How the heat conduction through a contact network is solved.

    Parameters
    ----------
    engine : str
        A word of the engine table.
    methods : tuple of str
        Variants of the engine, one cell each.
    conductivity : float [W/(m K)]
        Conductivity of the particles.
    contact_resistance : float [m K/W]
        Total resistance of a contact per unit thickness.
    mixture : Mixture, optional
        A second material for part of the particles.
    tolerance : float
        Relative error of the conductivity left by the iterative solver.
    angle_curve : str
        ``reduced`` solves many prescribed half-angles of one packing together, by a reduced basis, to an estimated
        relative error of ``min(1e-8, 100 tolerance)`` at most; ``full`` solves each alone.
    """

    engine: str = "dtem"
    methods: tuple[str, ...] = ("chord",)
    conductivity: float = 1.0
    contact_resistance: float = 0.0
    mixture: Mixture | None = None
    tolerance: float = 1e-10
    angle_curve: str = "reduced"


@dataclass(frozen=True)
class CompositeSpec:
    """The matrix that holds the particles, for the engines that solve the whole medium.

    Parameters
    ----------
    matrix_conductivity : float [W/(m K)]
        Conductivity of the matrix.
    contrasts : tuple of float
        Conductivity of the particles over that of the matrix, one cell each; empty where ``ConductionSpec`` gives it.
    resolution : int
        Voxels along the shortest edge of the box, for the engine ``voxel``.
    nodes : int
        Particles of the lattice, about, for the engine ``lattice``.
    """

    matrix_conductivity: float
    contrasts: tuple[float, ...] = ()
    resolution: int = 64
    nodes: int = 10_000


@dataclass(frozen=True)
class RealizationSpec:
    """Everything that defines one realization but its random stream; ``composite`` where a matrix conducts too."""

    packing: PackingSpec
    contacts: ContactSpec
    conduction: ConductionSpec
    composite: CompositeSpec | None = None

    @property
    def variants(self) -> int:
        """Cells of a method: contact half-angles, or contrasts."""
        swept = self.contacts.contact_angles if self.composite is None else self.composite.contrasts
        return max(len(swept), 1)


def particle_conductivities(count: int, conduction: ConductionSpec, rng: np.random.Generator) -> NDArray[np.float64]:
    """Conductivity of each particle, shape (count,) [W/(m K)]; a mixture's second material at random places."""
    conductivities = np.full(count, conduction.conductivity)
    if conduction.mixture is not None:
        chosen = rng.permutation(count)[: round(conduction.mixture.fraction * count)]
        conductivities[chosen] = conduction.mixture.conductivity
    return conductivities
