"""Everything that defines one realization but its random stream."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from etc_engine.packing import PackingSpec


@dataclass(frozen=True)
class ConductionSpec:
    """How the heat conduction is solved.

    Parameters
    ----------
    engine : str
        A word of the engine table.
    methods : tuple of str
        Variants of the engine, one cell each.
    tolerance : float
        Relative error of the conductivity left by the iterative solver.
    angle_curve : str
        ``reduced`` solves many prescribed half-angles of one packing together, by a reduced basis, to an estimated
        relative error of ``min(1e-8, 100 tolerance)`` at most; ``full`` solves each alone.
    resolution : int
        Voxels along the shortest edge of the box, for the engine ``voxel``.
    particles : int
        Of the lattice, about, for the engine ``lattice``.
    """

    engine: str = "dtem"
    methods: tuple[str, ...] = ("chord",)
    tolerance: float = 1e-10
    angle_curve: str = "reduced"
    resolution: int = 64
    particles: int = 10_000


@dataclass(frozen=True)
class RealizationSpec:
    """What is packed, and every medium that is made of the packing and solved.

    Parameters
    ----------
    packing : PackingSpec
    rule : str
        Contact rule.
    conduction : ConductionSpec
    values : mapping of str to float
        Physical values in SI units (angles in radians) by the names of `etc_engine.study.quantities`.
    axes : mapping of str to tuple of float
        Those of which there are several; each combination is a medium, the last axis running fastest.
    """

    packing: PackingSpec
    rule: str = "overlap"
    conduction: ConductionSpec = ConductionSpec()
    values: Mapping[str, float] = field(default_factory=dict)
    axes: Mapping[str, tuple[float, ...]] = field(default_factory=dict)

    @property
    def shape(self) -> tuple[int, ...]:
        """Cells of a realization: along each axis, and methods."""
        return (*(len(values) for values in self.axes.values()), len(self.conduction.methods))

    @property
    def dimension(self) -> int:
        """2 for disks, 3 for spheres."""
        return self.packing.box.dimension

    def combinations(self) -> Iterator[dict[str, float]]:
        """The physical values of each medium."""
        for values in itertools.product(*self.axes.values()):
            yield {**self.values, **dict(zip(self.axes, values, strict=True))}


def particle_conductivities(
    count: int, values: Mapping[str, float], order: NDArray[np.int64] | None
) -> NDArray[np.float64]:
    """Conductivity of each particle, shape (count,) [W/(m K)]; a mixture's second material at random places."""
    conductivities = np.full(count, values["particle_conductivity"])
    if order is not None:
        conductivities[order[: round(values["mixture_fraction"] * count)]] = values["mixture_conductivity"]
    return conductivities
