"""Run one realization of a result file again and compare the bits."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from etc_engine.errors import InputError
from etc_engine.realization import Status
from etc_engine.study.sweep import study_of
from etc_engine.sweep.dataset import INCIDENTAL, PERCOLATION, assemble, same_bits
from etc_engine.sweep.plan import Unit
from etc_engine.sweep.sweep import Realize, run_unit
from etc_engine.sweep.table import tabulate

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class Comparison:
    """What a realization gave before and gives now."""

    density: float
    realization: int
    agree: dict[str, bool]
    stored: xarray.Dataset
    found: xarray.Dataset

    @property
    def same(self) -> bool:
        """Whether every variable has the same bits."""
        return all(self.agree.values())


def rerun(
    dataset: xarray.Dataset,
    density: float | None,
    realization: int,
    realize: Realize,
) -> Comparison:
    """Compute one realization of a sweep's dataset again, with all that was solved on its packing.

    Parameters
    ----------
    dataset : xarray.Dataset
        From :func:`etc_engine.sweep.result_file.open_dataset`.
    density : float or None
        A value of the coordinate (to six digits); None if there is only one.
    realization : int
        Its number.
    realize : callable
        (spec, rng) -> Realization.

    Raises
    ------
    InputError
        If the file has no such cell, or has never run it.
    """
    study = study_of(json.loads(dataset.attrs["study_resolved"]))
    if study.conduction.distributed:
        raise InputError("a packing that many ranks solved together is not run again on one: use the command sweep")
    row = _density_index(dataset["density"].values, density)
    if not 0 <= realization < dataset.sizes["realization"]:
        last = dataset.sizes["realization"] - 1
        raise InputError(f"realization {realization} is not in the file, which has 0 to {last}")
    stored = _unit_variables(dataset.isel(density=row, realization=realization))
    if (stored["status"] == Status.NOT_RUN).all():
        raise InputError(f"realization {realization} was not run at this density: there is nothing to compare with")
    unit = Unit(study.densities[row], realization)
    record = run_unit(study, study.realization_spec(unit.density), unit, 0, realize)
    again = assemble(study, tabulate(study, [record]), {}).isel(density=row, realization=realization)
    found = _unit_variables(again)
    agree = {str(name): same_bits(stored, found, str(name)) for name in found}
    return Comparison(float(dataset["density"].values[row]), realization, agree, stored, found)


def _unit_variables(cell: xarray.Dataset) -> xarray.Dataset:
    """What belongs to one realization and is the same wherever it runs."""
    statistics = {"count", *PERCOLATION}
    names = [
        name
        for name in map(str, cell.data_vars)
        if not name.endswith(INCIDENTAL) and not name.startswith("conductivity_") and name not in statistics
    ]
    return cell[names]


def _density_index(values: NDArray[np.float64], density: float | None) -> int:
    if density is None and values.size == 1:
        return 0
    near = np.flatnonzero(np.isclose(values, np.nan if density is None else density, rtol=1e-6, atol=0.0))
    if near.size != 1:
        asked = "no density was given" if density is None else f"density {density:g} is not in the file"
        raise InputError(f"{asked}, it has {', '.join(f'{value:g}' for value in values)}")
    return int(near[0])
