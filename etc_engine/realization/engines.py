"""The engines by name, and one realization from packing to cells. Serial, no I/O, no MPI."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from etc_engine.engines.dtem.methods import METHODS as DTEM_METHODS
from etc_engine.errors import PackingError
from etc_engine.packing import ParticlePacking, pack
from etc_engine.realization.composites import conduct_lattice, conduct_voxel
from etc_engine.realization.networks import conduct_dtem, conduct_pipe
from etc_engine.realization.outcome import Cell, Cells, Realization, Status, uniform_cells
from etc_engine.realization.specification import RealizationSpec
from etc_engine.structure.union import solid_fraction


@dataclass(frozen=True)
class Engine:
    """One way to conduct heat through a packing.

    Parameters
    ----------
    conduct : callable
        (packing, spec, rng) -> cells, by contact angle (or contrast) and method.
    methods : tuple of str
        The variants it knows, the default first.
    dimensions : tuple of int
        Of the boxes it works in.
    composite : bool
        Whether the particles sit in a matrix that conducts; otherwise heat goes through their contacts alone.
    """

    conduct: Callable[[ParticlePacking, RealizationSpec, np.random.Generator], Cells]
    methods: tuple[str, ...]
    dimensions: tuple[int, ...]
    composite: bool = False


ENGINES: Mapping[str, Engine] = {
    "dtem": Engine(conduct_dtem, ("chord", *(name for name in DTEM_METHODS if name != "chord")), (2,)),
    "pipe": Engine(conduct_pipe, ("chord", "uniform"), (2,)),
    "lattice": Engine(conduct_lattice, ("laguerre", "contact"), (3,), composite=True),
    "voxel": Engine(conduct_voxel, ("laminate", "binary"), (2, 3), composite=True),
}


def realize(spec: RealizationSpec, rng: np.random.Generator) -> Realization:
    """Pack once, then solve every contact angle and method on that packing.

    Failures of the packer or the solver are recorded in the cells, not raised.

    Parameters
    ----------
    spec : RealizationSpec
    rng : numpy.random.Generator
        The random stream of this realization; nothing else is random.

    Returns
    -------
    Realization
    """
    start = time.perf_counter()
    try:
        packing = pack(spec.packing, rng)
    except PackingError as error:
        failed = Cell(Status.PACKING_FAILED, str(error))
        return Realization(0, np.nan, np.nan, time.perf_counter() - start, uniform_cells(spec, failed))
    seconds = time.perf_counter() - start
    return Realization(
        packing.count,
        packing.density,
        solid_fraction(packing),
        seconds,
        ENGINES[spec.conduction.engine].conduct(packing, spec, rng),
    )
