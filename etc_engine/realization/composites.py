"""Engines on the whole medium: the particles of a packing are inclusions in a conducting matrix."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from etc_engine.engines.lattice.homogenize import homogenize_lattice
from etc_engine.engines.voxel.homogenize import homogenize_voxel
from etc_engine.medium.composite import Composite, Homogenized
from etc_engine.packing import ParticlePacking
from etc_engine.packing.neighbors import neighbor_pairs
from etc_engine.realization.outcome import Cell, Cells, Status, attempted
from etc_engine.realization.specification import CompositeSpec, RealizationSpec, particle_conductivities

TOUCHING = 1e-6
"""Surfaces closer than this, in mean radii of the pair, count as a contact."""

Homogenize = Callable[[Composite, str, CompositeSpec, float, int], Homogenized]
"""(composite, method, spec, tolerance, seed) -> effective conductivity."""


def conduct_voxel(packing: ParticlePacking, spec: RealizationSpec, rng: np.random.Generator) -> Cells:
    """FFT homogenization; a method is the kind of voxel."""

    def homogenize(composite: Composite, method: str, spec: CompositeSpec, tolerance: float, _: int) -> Homogenized:
        return homogenize_voxel(composite, resolution=spec.resolution, voxels=method, tolerance=tolerance)

    return _conduct(packing, spec, rng, homogenize)


def conduct_lattice(packing: ParticlePacking, spec: RealizationSpec, rng: np.random.Generator) -> Cells:
    """Particle lattice; a method is the way the conductances between its nodes are made."""

    def homogenize(composite: Composite, method: str, spec: CompositeSpec, tolerance: float, seed: int) -> Homogenized:
        return homogenize_lattice(
            composite,
            rng=np.random.default_rng(seed),
            particles=spec.nodes,
            transmission=method,
            tolerance=tolerance,
        )

    return _conduct(packing, spec, rng, homogenize)


def _conduct(
    packing: ParticlePacking, spec: RealizationSpec, rng: np.random.Generator, homogenize: Homogenize
) -> Cells:
    """Solve every contrast and method on one packing of inclusions.

    Whatever an engine draws comes from one seed, so that all cells of a realization share it.
    """
    assert spec.composite is not None
    seed = int(rng.integers(2**63))
    kappa = particle_conductivities(packing.count, spec.conduction, rng)
    matrix = spec.composite.matrix_conductivity
    inclusions = [np.full(packing.count, contrast * matrix) for contrast in spec.composite.contrasts] or [kappa]
    touching = neighbor_pairs(packing, relative_gap=TOUCHING).count
    solve = partial(_cell, packing, spec, touching, seed, homogenize)
    return tuple(
        tuple(attempted(partial(solve, values, method), packing.dimension) for method in spec.conduction.methods)
        for values in inclusions
    )


def _cell(
    packing: ParticlePacking,
    spec: RealizationSpec,
    touching: int,
    seed: int,
    homogenize: Homogenize,
    inclusions: NDArray[np.float64],
    method: str,
) -> Cell:
    assert spec.composite is not None
    composite = Composite(packing, spec.composite.matrix_conductivity, inclusions)
    result = homogenize(composite, method, spec.composite, spec.conduction.tolerance, seed)
    return Cell(
        status=Status.OK,
        conductivity=result.tensor,
        contacts=touching,
        coordination=2.0 * touching / packing.count,
        unknowns=result.unknowns,
        iterations=result.iterations,
        relative_energy_error=result.relative_error_estimate,
        solved_by="full",
    )
