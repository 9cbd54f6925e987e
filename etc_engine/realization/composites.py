"""Engines on the whole medium: the particles of a packing are inclusions in a conducting matrix."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from etc_engine.engines.lattice.homogenize import homogenize_lattice
from etc_engine.engines.voxel.homogenize import homogenize_voxel
from etc_engine.medium.composite import Composite, Homogenized
from etc_engine.packing import ParticlePacking
from etc_engine.packing.neighbors import neighbor_pairs
from etc_engine.realization.outcome import Cell, Cells, Status, attempted
from etc_engine.realization.specification import ConductionSpec, RealizationSpec, particle_conductivities

TOUCHING = 1e-6
"""Surfaces closer than this, in mean radii of the pair, count as a contact."""

Homogenize = Callable[[Composite, str, ConductionSpec, int], Homogenized]
"""(composite, method, conduction, seed) -> effective conductivity."""


def conduct_voxel(packing: ParticlePacking, spec: RealizationSpec, rng: np.random.Generator) -> Cells:
    """FFT homogenization; a method is the kind of voxel."""

    def homogenize(composite: Composite, method: str, spec: ConductionSpec, _: int) -> Homogenized:
        return homogenize_voxel(composite, resolution=spec.resolution, voxels=method, tolerance=spec.tolerance)

    return _conduct(packing, spec, rng, homogenize)


def conduct_lattice(packing: ParticlePacking, spec: RealizationSpec, rng: np.random.Generator) -> Cells:
    """Particle lattice; a method is the way the conductances between its nodes are made."""

    def homogenize(composite: Composite, method: str, spec: ConductionSpec, seed: int) -> Homogenized:
        return homogenize_lattice(
            composite,
            rng=np.random.default_rng(seed),
            particles=spec.particles,
            transmission=method,
            tolerance=spec.tolerance,
        )

    return _conduct(packing, spec, rng, homogenize)


def _conduct(
    packing: ParticlePacking, spec: RealizationSpec, rng: np.random.Generator, homogenize: Homogenize
) -> Cells:
    """Solve every contrast and method on one packing of inclusions.

    Whatever an engine draws comes from one seed, so that all cells of a realization share it.
    """
    order = rng.permutation(packing.count) if "mixture_fraction" in {*spec.axes, *spec.values} else None
    seed = int(rng.integers(2**63))
    touching = neighbor_pairs(packing, relative_gap=TOUCHING).count
    cells: list[Cell] = []
    for values in spec.combinations():
        composite = Composite(
            packing, values["pore_conductivity"], particle_conductivities(packing.count, values, order)
        )
        solve = partial(_cell, composite, spec.conduction, touching, seed, homogenize)
        cells += [attempted(partial(solve, method), packing.dimension) for method in spec.conduction.methods]
    return tuple(cells)


def _cell(
    composite: Composite, conduction: ConductionSpec, touching: int, seed: int, homogenize: Homogenize, method: str
) -> Cell:
    result = homogenize(composite, method, conduction, seed)
    return Cell(
        status=Status.OK,
        conductivity=result.tensor,
        contacts=touching,
        coordination=2.0 * touching / composite.inclusions.count,
        unknowns=result.unknowns,
        iterations=result.iterations,
        relative_energy_error=result.relative_error_estimate,
        solved_by="full",
    )
