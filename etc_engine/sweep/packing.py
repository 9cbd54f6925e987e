"""A packing of a sweep, made again from its random stream or read again from its file."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from etc_engine.errors import InputError
from etc_engine.packing import ParticlePacking
from etc_engine.realization import Status
from etc_engine.realization.realize import found_packing
from etc_engine.study.sweep import study_of
from etc_engine.sweep.plan import Unit, unit_rng

if TYPE_CHECKING:
    import xarray

LONGEST = 60.0
"""A packing that took longer is not made again [s]."""


def first_packing(dataset: xarray.Dataset) -> tuple[ParticlePacking, float]:
    """The packing of the first realization at the highest density that has one, and that density.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of a sweep.

    Returns
    -------
    ParticlePacking
    float

    Raises
    ------
    InputError
        If no realization has a packing, its file is not there, it took longer than `LONGEST` seconds to make, or this
        version makes another one of the same stream.
    EtcError
        If the packing cannot be made or read.
    """
    study = study_of(json.loads(dataset.attrs["study_resolved"]))
    status = dataset["status"].transpose("density", "realization", ...).values
    rows, realizations = np.nonzero((status < Status.PACKING_FAILED).reshape(*status.shape[:2], -1).any(axis=2))
    if not rows.size:
        raise InputError("no realization of this sweep has a packing")
    row, realization = int(rows[-1]), int(realizations[rows == rows[-1]][0])
    cell = dataset.isel(density=row, realization=realization)
    if float(cell["pack_seconds"]) > LONGEST:
        raise InputError(f"the packing took {float(cell['pack_seconds']):.0f} s to make: too long to make it again")
    unit = Unit(study.densities[row], realization)
    spec = study.for_realization(study.realization_spec(unit.density), realization)
    packing = found_packing(spec, unit_rng(study.seed, unit)).packing
    if packing.density != float(cell["packing_density"]):
        raise InputError("this version of the engine, or of its libraries, makes another packing of the same stream")
    return packing, packing.density
