"""The dataset of a sweep: records in, one xarray dataset out, written whole or not at all."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from etc_engine.realization import Status
from etc_engine.study.conditions import derived_conductivities
from etc_engine.study.quantities import QUANTITIES
from etc_engine.study.sweep import Study
from etc_engine.sweep.statistics import interval, summarize
from etc_engine.sweep.table import CELL_VARIABLES, MEASURED, MEASURES, UNIT_VARIABLES, WORD_FIELDS, Table

if TYPE_CHECKING:
    import xarray

Values = dict[str, NDArray[Any]]
UNIT = ("density", "realization")
TENSOR = ("direction_i", "direction_j")
INCIDENTAL = ("_seconds", "_rank", "_host", "_time")
"""Endings of the names of variables that differ from run to run."""


STATISTICS = {
    "mean": "mean of the conductivity over realizations",
    "std": "standard deviation of the conductivity over realizations",
    "sem": "standard error of the mean conductivity",
    "ci_low": "lower end of the confidence interval of the mean conductivity",
    "ci_high": "upper end of the confidence interval of the mean conductivity",
}
PERCOLATION = {
    "percolating_fraction": ("percolating_fraction", "fraction of the realizations that percolate"),
    "percolating_fraction_ci_low": ("fraction_low", "lower end of the interval of the percolating fraction"),
    "percolating_fraction_ci_high": ("fraction_high", "upper end of the interval of the percolating fraction"),
    "conductivity_mean_percolating": ("percolating_mean", "mean conductivity of the realizations that percolate"),
    "conductivity_mean_percolating_ci_low": ("percolating_low", "lower end of the interval of that conductivity"),
    "conductivity_mean_percolating_ci_high": ("percolating_high", "upper end of the interval of that conductivity"),
}
"""Variable of a direction -> field of `etc_engine.sweep.statistics.Interval`, meaning."""

INTERVAL_COMMENT = (
    "of a diagonal component: Student t, given that all percolate, where all realizations do; where some do not, "
    "the intervals of their fraction and of the mean of the others combined. Off the diagonal: Student t"
)
DERIVED = "of the material, or of the gas as a continuum, at the temperature and pressure"
STREAM_COMMENT = (
    "the stream is PCG64(SeedSequence(seed, spawn_key=(high, low, realization))) with the two 32-bit halves "
    "of the density as a double (NaN: the packer's own); stored is generate_state(1, uint64) of the sequence"
)


def assemble(study: Study, table: Table, attributes: Mapping[str, Any]) -> xarray.Dataset:
    """The dataset of a study from the table of its units.

    Parameters
    ----------
    study : Study
        The study; it gives the dimensions.
    table : Table
        What was run; cells without a row are ``not_run``.
    attributes : mapping
        Global attributes, see :mod:`etc_engine.sweep.attributes`.

    Returns
    -------
    xarray.Dataset
        Dimensions ``density``, then those quantities that the study gives as a list, in the order of
        `etc_engine.study.quantities.QUANTITIES`, ``method`` (only where it lists methods), ``realization``,
        ``direction_i``, ``direction_j``. A quantity with one value is a coordinate without a dimension. A computed
        variable that has the name of a given quantity is stored as ``measured_NAME``.
    """
    import xarray

    cells, units = _cell_values(study, table), _unit_values(study, table)
    swept = ("density", *study.axes, "method")
    cell = (*swept, "realization")
    dataset = xarray.Dataset(attrs=dict(attributes))
    dataset = dataset.assign_coords(_coordinates(study, units["packing_density"]))
    dataset["conductivity"] = (cell + TENSOR, cells["conductivity"], _conductivity_attributes("conductivity"))
    if "exact" in study.methods or study.conduction.bounds:
        meaning = _conductivity_attributes("lower and upper bound of the conductivity along a direction")
        dataset["conductivity_bounds"] = ((*cell, "direction_i", "bound"), cells["conductivity_bounds"], meaning)
        dataset = dataset.assign_coords(bound=np.array(["lower", "upper"], dtype=object))
    for name, variable in CELL_VARIABLES.items():
        if name != "heat_imbalance" or study.conduction.nonlinear:
            stored = MEASURED + name if name in study.quantities else name
            dataset[stored] = (cell, cells[name], variable.attributes)
    dataset["status"] = (cell, cells["status"], _status_attributes())
    dataset["message"] = (cell, cells["message"], {"long_name": "what went wrong, in words"})
    for name, variable in UNIT_VARIABLES.items():
        measure = MEASURES[study.box.dimension]
        meaning = {**variable.attributes, "long_name": variable.long_name.format(measure=measure)}
        dataset[name] = (UNIT, units[name], meaning)
    dataset["random_stream"].attrs["comment"] = STREAM_COMMENT
    _add_statistics(dataset, swept, cells, study.statistics.confidence)
    return dataset if isinstance(study.conduction.method, tuple) else dataset.isel(method=0, drop=True)


def _coordinates(study: Study, packing_density: NDArray[np.float64]) -> dict[str, Any]:
    axes = np.array(list("xyz"[: study.box.dimension]), dtype=object)
    measure = MEASURES[study.box.dimension]
    density, comment = study.values("density"), f"sum of the full particle {measure}s over the {measure} of the box"
    if not density:
        reached = packing_density[np.isfinite(packing_density)]
        density = (float(reached.mean()) if reached.size else np.nan,)
        comment += "; the packer's own, mean over realizations"
    found: dict[str, Any] = {
        "density": ("density", np.array(density), {"long_name": "density", "units": "1", "comment": comment}),
        "method": ("method", np.array(study.methods, dtype=object), {"long_name": "method"}),
        "realization": ("realization", np.arange(study.statistics.cap), {"long_name": "realization", "units": "1"}),
        "direction_i": ("direction_i", axes, {"long_name": "direction of the flux"}),
        "direction_j": ("direction_j", axes, {"long_name": "direction of the gradient"}),
    }
    for name, (held, meaning) in study.realization_coordinates().items():
        kind = object if isinstance(held[0], str) else np.int64
        found[name] = ("realization", np.array(held, dtype=kind), {"long_name": meaning})
    for name, values in study.quantities.items():
        several = name in study.axes
        attributes = QUANTITIES[name].attributes(study.box.dimension)
        found[name] = (name if several else (), np.array(values if several else values[0]), attributes)
    for name, (dims, derived) in derived_conductivities(study).items():
        found[name] = (dims, derived, {**QUANTITIES[name].attributes(study.box.dimension), "comment": DERIVED})
    return found


def _cell_values(study: Study, table: Table) -> Values:
    """Arrays over (density, axes of the study, method, realization)."""
    rows, d, cells = table.rows, study.box.dimension, study.shape
    shape = (len(study.densities), *cells, study.statistics.cap)
    values: Values = {name: np.full(shape, v.empty, v.dtype) for name, v in CELL_VARIABLES.items()}
    values["conductivity"] = np.full((*shape, d, d), np.nan)
    values["conductivity_bounds"] = np.full((*shape, d, 2), np.nan)
    values["status"] = np.full(shape, Status.NOT_RUN, np.int8)
    values["message"] = np.full(shape, "", object)
    every: Any = (slice(None),) * len(cells)
    for name, grid in values.items():
        held = table.spelled(name) if name in WORD_FIELDS else rows[name]
        grid[(rows["density_index"], *every, rows["realization"])] = held
    return values


def _unit_values(study: Study, table: Table) -> Values:
    """Arrays over (density, realization)."""
    rows, shape = table.rows, (len(study.densities), study.statistics.cap)
    values: Values = {name: np.full(shape, v.empty, v.dtype) for name, v in UNIT_VARIABLES.items()}
    for name, grid in values.items():
        held = table.spelled(name) if name in WORD_FIELDS else rows[name]
        grid[rows["density_index"], rows["realization"]] = held
    return values


def _add_statistics(dataset: xarray.Dataset, swept: tuple[str, ...], cells: Values, confidence: float) -> None:
    """Statistics over the realizations that have a conductivity, 0 of a non-percolating one included."""
    valid = cells["status"] <= Status.NOT_PERCOLATING
    shape, tensor = valid.shape[:-1], cells["conductivity"].shape[-2:]
    count = np.zeros(shape, np.int64)
    values = {name: np.full(shape + tensor, np.nan) for name in STATISTICS}
    parts = {name: np.full(shape + tensor[:1], np.nan) for name in PERCOLATION}
    for place in np.ndindex(*shape):
        samples = cells["conductivity"][place][valid[place]]
        summary = summarize(samples, confidence)
        count[place] = summary.count
        for name in STATISTICS:
            values[name][place] = getattr(summary, name)
        for k in range(tensor[0]):
            if not summary.count or not np.isfinite(samples[:, k, k]).all():
                continue
            found = interval(np.maximum(samples[:, k, k], 0.0), confidence)
            for name, (field, _) in PERCOLATION.items():
                parts[name][(*place, k)] = getattr(found, field)
            if found.percolating_fraction < 1.0:
                values["ci_low"][(*place, k, k)], values["ci_high"][(*place, k, k)] = found.low, found.high
    for name, long_name in STATISTICS.items():
        attributes = _conductivity_attributes(long_name)
        if name.startswith("ci"):
            attributes |= {"confidence_level": confidence, "comment": INTERVAL_COMMENT}
        dataset[f"conductivity_{name}"] = (swept + TENSOR, values[name], attributes)
    for name, (_, meaning) in PERCOLATION.items():
        attributes = _conductivity_attributes(meaning)
        if name.startswith("percolating"):
            attributes["units"] = "1"
        if "_ci_" in name:
            attributes |= {"confidence_level": confidence}
        dataset[name] = ((*swept, TENSOR[0]), parts[name], attributes)
    dataset["count"] = (
        swept,
        count,
        {"long_name": "realizations that enter the statistics: ok and not_percolating", "units": "1"},
    )


def _conductivity_attributes(long_name: str) -> dict[str, Any]:
    return {
        "long_name": long_name.replace("conductivity", "effective thermal conductivity"),
        "units": "W m-1 K-1",
    }


def _status_attributes() -> dict[str, Any]:
    return {
        "long_name": "how the realization ended",
        "flag_values": np.array([int(status) for status in Status], dtype=np.int8),
        "flag_meanings": " ".join(status.name.lower() for status in Status),
    }


def differing_variables(one: xarray.Dataset, other: xarray.Dataset) -> list[str]:
    """Names of the variables in which two datasets do not have the same bits.

    Variables that say where and when something was computed (``_seconds``, ``_rank``, ``_host``, ``_time``)
    and attributes are left out.
    """
    names = sorted({str(name) for name in (*one.variables, *other.variables)})
    return [name for name in names if not name.endswith(INCIDENTAL) and not same_bits(one, other, name)]


def same_bits(one: xarray.Dataset, other: xarray.Dataset, name: str) -> bool:
    """Whether a variable has the same bits in two datasets."""
    if name not in one.variables or name not in other.variables:
        return False
    a, b = one[name].values, other[name].values
    if a.shape != b.shape:
        return False
    if a.dtype.kind not in "biuf":  # words, in whatever way they are held
        return bool(a.ravel().tolist() == b.ravel().tolist())
    return bool(a.dtype == b.dtype and a.tobytes() == b.tobytes())
