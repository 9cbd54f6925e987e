"""One realization from packing to outcomes. Serial, no I/O, no MPI."""

from __future__ import annotations

import math
import time

import numpy as np

from etc_engine.errors import EtcError, InputError, PackingError
from etc_engine.packing import pack
from etc_engine.particle_files.collection import PackingSource
from etc_engine.particle_files.table import ParticleTable
from etc_engine.realization.engines import find_engine
from etc_engine.realization.media import make_media
from etc_engine.realization.outcome import Outcome, Realization, Status
from etc_engine.realization.specification import RealizationSpec
from etc_engine.structure.union import solid_fraction


def realize(spec: RealizationSpec, rng: np.random.Generator) -> Realization:
    """Pack once, then solve every medium by every method on that packing.

    Failures of the packer or the solver are recorded in the outcomes, not raised.

    Parameters
    ----------
    spec : RealizationSpec
    rng : numpy.random.Generator
        The random stream of this realization; nothing else is random.

    Returns
    -------
    Realization
    """
    start, count = time.perf_counter(), math.prod(spec.shape)
    try:
        table = found_packing(spec, rng)
        packing = table.packing
    except (PackingError, InputError) as error:
        failed = Outcome(Status.PACKING_FAILED, str(error))
        return Realization(0, np.nan, np.nan, time.perf_counter() - start, (failed,) * count)
    seconds = time.perf_counter() - start
    try:
        cells = _conduct(spec, table, rng)
    except EtcError as error:
        cells = (Outcome(Status.ERROR, str(error)),) * count
    return Realization(packing.count, packing.density, solid_fraction(packing), seconds, cells)


def found_packing(spec: RealizationSpec, rng: np.random.Generator) -> ParticleTable:
    """The packing of a realization, made or read, with the columns of its file.

    Raises
    ------
    PackingError, InputError
    """
    if isinstance(spec.packing, PackingSource):
        return spec.packing.read()
    return ParticleTable(pack(spec.packing, rng))


def _conduct(spec: RealizationSpec, table: ParticleTable, rng: np.random.Generator) -> tuple[Outcome, ...]:
    """Outcomes of all media and methods on one packing."""
    engine = find_engine(spec.conduction[0].engine)
    seed = 0 if engine.needs_contacts else int(rng.integers(2**63))
    media = make_media(table, spec, rng, contacts=engine.needs_contacts)
    columns = [engine.conduct(media, conduction, seed) for conduction in spec.conduction]
    return tuple(outcome for row in zip(*columns, strict=True) for outcome in row)
