"""The table of a sweep: finished units as rows of one structured array, the cells of a unit in its row.

Ranks turn the shards into rows side by side and rank 0 joins the arrays; one by one on rank 0, records
would take longer than computing them as soon as some thousand ranks work.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from etc_engine.realization import Status
from etc_engine.study.sweep import Study
from etc_engine.sweep.plan import stream_fingerprint
from etc_engine.sweep.records import Record


@dataclass(frozen=True)
class Variable:
    """How a quantity is stored: numpy type, what stands in cells that were not run, and its meaning."""

    dtype: Any
    empty: Any
    long_name: str
    units: str = "1"

    @property
    def attributes(self) -> dict[str, Any]:
        """The attributes of the stored variable."""
        return {"long_name": self.long_name, "units": self.units}


CELL_VARIABLES = {
    "contacts": Variable(np.int64, -1, "number of contacts between particles, before pruning"),
    "wall_contacts": Variable(np.int64, -1, "number of contacts with walls, before pruning"),
    "coordination": Variable(np.float64, np.nan, "mean coordination number, before pruning"),
    "unknowns": Variable(np.int64, -1, "number of unknowns of the linear system, after pruning"),
    "iterations": Variable(np.int64, -1, "iterations of the linear solver"),
    "relative_energy_error": Variable(np.float64, np.nan, "estimated relative error of the conductivity"),
    "model_error_estimate": Variable(
        np.float64, np.nan, "estimated relative error of the method: chord, if solved in full, and exact"
    ),
    "mean_field_conductivity": Variable(
        np.float64, np.nan, "contact mean field of the network: pipes under an affine temperature", "W m-1 K-1"
    ),
    "solve_seconds": Variable(np.float64, np.nan, "time to solve", "s"),
    "solved_by": Variable(object, "", "full, or reduced: made of the solutions at other contact angles"),
    "snapshots": Variable(np.int64, -1, "solutions at other contact angles that a reduced one is made of"),
}
WORD = "U64"
"""Longest word, such as the name of a host, that a row holds."""

UNIT_VARIABLES = {
    "particles": Variable(np.int64, -1, "number of particles, before pruning"),
    "packing_density": Variable(np.float64, np.nan, "sum of full particle areas over the area of the box"),
    "solid_fraction": Variable(np.float64, np.nan, "area of the union of the particles over the area of the box"),
    "pack_seconds": Variable(np.float64, np.nan, "time to pack", "s"),
    "random_stream": Variable(np.uint64, 0, "first 64 bits of the random stream"),
    "worker_rank": Variable(np.int64, -1, "rank that computed the realization"),
    "worker_host": Variable(object, "", "host that computed the realization"),
    "start_time": Variable(np.float64, np.nan, "start of the realization", "seconds since 1970-01-01"),
    "end_time": Variable(np.float64, np.nan, "end of the realization", "seconds since 1970-01-01"),
}


@dataclass(frozen=True)
class Table:
    """Finished units, each once, by density index and realization.

    Parameters
    ----------
    rows : ndarray, shape (n,)
        Fields ``density_index``, ``realization``, the names of `UNIT_VARIABLES`, and with shape (variants, methods)
        those of `CELL_VARIABLES`, ``status`` and ``conductivity`` (there (variants, methods, d, d)).
    messages : dict
        (density index, realization, variant, method) -> what went wrong.
    """

    rows: NDArray[Any]
    messages: dict[tuple[int, int, int, int], str] = field(default_factory=dict)

    @property
    def units(self) -> NDArray[np.int64]:
        """Density index and realization of each row, shape (n, 2)."""
        return np.column_stack((self.rows["density_index"], self.rows["realization"]))


def row_type(study: Study) -> np.dtype[Any]:
    """The numpy type of a row."""
    cells = (len(study.variants[1] or (None,)), len(study.conduction.methods))
    d = study.box.dimension
    fields: list[Any] = [("density_index", np.int64), ("realization", np.int64)]
    fields += [(name, WORD if v.dtype is object else v.dtype) for name, v in UNIT_VARIABLES.items()]
    fields += [(name, WORD if v.dtype is object else v.dtype, cells) for name, v in CELL_VARIABLES.items()]
    fields += [("status", np.int8, cells), ("conductivity", np.float64, (*cells, d, d))]
    fields += [("conductivity_bounds", np.float64, (*cells, d, 2))]
    return np.dtype(fields)


def tabulate(study: Study, records: Iterable[Record]) -> Table:
    """Records as a table."""
    records = list(records)
    rows = np.empty(len(records), row_type(study))
    if not records:
        return Table(rows)
    results = [record.result for record in records]
    rows["density_index"] = [study.densities.index(record.unit.density) for record in records]
    rows["realization"] = [record.unit.realization for record in records]
    rows["particles"] = [result.particles for result in results]
    rows["packing_density"] = [result.density for result in results]
    rows["solid_fraction"] = [result.solid_fraction for result in results]
    rows["pack_seconds"] = [result.pack_seconds for result in results]
    rows["random_stream"] = [stream_fingerprint(study.seed, record.unit) for record in records]
    rows["worker_rank"] = [record.rank for record in records]
    rows["worker_host"] = [record.host for record in records]
    rows["start_time"] = [record.start_time for record in records]
    rows["end_time"] = [record.end_time for record in records]
    for name in (*CELL_VARIABLES, "status", "conductivity"):
        rows[name] = [[[getattr(cell, name) for cell in row] for row in result.cells] for result in results]
    unknown = np.full((study.box.dimension, 2), np.nan)
    rows["conductivity_bounds"] = [
        [[cell.conductivity_bounds or unknown for cell in row] for row in result.cells] for result in results
    ]
    rows["conductivity"][rows["status"] > Status.NOT_PERCOLATING] = np.nan
    messages = {
        (int(i), int(r), a, m): cell.message
        for i, r, result in zip(rows["density_index"], rows["realization"], results, strict=True)
        for a, row in enumerate(result.cells)
        for m, cell in enumerate(row)
        if cell.message
    }
    return join([Table(rows, messages)])


def join(tables: Sequence[Table]) -> Table:
    """One table of several; a unit that was computed twice is kept once."""
    rows = np.concatenate([table.rows for table in tables])
    _, first = np.unique(rows[["density_index", "realization"]], return_index=True)
    messages = {place: text for table in tables for place, text in table.messages.items()}
    return Table(rows[first], messages)
