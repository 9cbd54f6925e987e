"""The table of a sweep: finished units as rows of one structured array, the cells of a unit in its row.

The ranks turn the shards into rows in parallel and rank 0 joins the arrays. Record by record on rank 0, reading would
take longer than computing as soon as some thousand ranks work. A row holds a word (host, message) as its number in a
list of words: a million rows repeat a few of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from etc_engine.arrays import Floats, Ints
from etc_engine.realization import Outcome, Status
from etc_engine.study.sweep import Study
from etc_engine.sweep.plan import stream_fingerprint
from etc_engine.sweep.records import Record

if TYPE_CHECKING:
    import xarray


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
        np.float64, np.nan, "estimated relative error of the method: chord if solved in full, exact, voxel and lattice"
    ),
    "mean_field_conductivity": Variable(
        np.float64, np.nan, "contact mean field of the network: pipes under an affine temperature", "W m-1 K-1"
    ),
    "heat_imbalance": Variable(
        np.float64, np.nan, "heat in at one wall less heat out at the other, over the heat flow; of nonlinear studies"
    ),
    "solve_seconds": Variable(np.float64, np.nan, "time to solve", "s"),
    "solved_by": Variable(object, "", "full, or reduced: made of the solutions at other contact angles"),
    "snapshots": Variable(np.int64, -1, "solutions at other contact angles in a reduced one"),
}
MEASURED = "measured_"
"""What the name of a variable begins with where the study gives a quantity of that name."""


def measured(dataset: xarray.Dataset, name: str) -> xarray.DataArray:
    """The variable of a result that was computed, not the quantity of the same name that its study gives.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of a sweep.
    name : str
        Variable of a cell or a unit, such as ``coordination``.

    Returns
    -------
    xarray.DataArray
        ``measured_coordination`` where the study gives ``contacts.coordination``, else ``coordination``.
    """
    return dataset[MEASURED + name] if MEASURED + name in dataset else dataset[name]


WORD = np.int32
"""How a row holds a word: its number in the words of the table."""
NO_WORDS = ("",)

MEASURES = {2: "area", 3: "volume"}
"""What a density is a fraction of, by dimension."""

UNIT_VARIABLES = {
    "particles": Variable(np.int64, -1, "number of particles, before pruning"),
    "packing_density": Variable(np.float64, np.nan, "sum of full particle {measure}s over the {measure} of the box"),
    "solid_fraction": Variable(np.float64, np.nan, "{measure} of the union of the particles over that of the box"),
    "pack_seconds": Variable(np.float64, np.nan, "time to pack", "s"),
    "random_stream": Variable(np.uint64, 0, "first 64 bits of the random stream"),
    "worker_rank": Variable(np.int64, -1, "rank that computed the realization"),
    "worker_host": Variable(object, "", "host that computed the realization"),
    "start_time": Variable(np.float64, np.nan, "start of the realization", "seconds since 1970-01-01"),
    "end_time": Variable(np.float64, np.nan, "end of the realization", "seconds since 1970-01-01"),
}


WORD_FIELDS = (*(n for n, v in {**UNIT_VARIABLES, **CELL_VARIABLES}.items() if v.dtype is object), "message")
"""Fields of a row that hold words."""


@dataclass(frozen=True)
class Table:
    """Finished units, each once, by density index and realization.

    Parameters
    ----------
    rows : ndarray, shape (n,)
        Fields ``density_index``, ``realization``, the names of `UNIT_VARIABLES`, and with the shape of the cells
        (axes, methods) those of `CELL_VARIABLES`, ``message``, ``status``, ``conductivity`` (there (..., d, d)) and
        ``conductivity_bounds`` (there (..., d, 2)).
    words : tuple of str
        What the numbers of `WORD_FIELDS` stand for; the first is empty.
    """

    rows: NDArray[Any]
    words: tuple[str, ...] = NO_WORDS

    def spelled(self, name: str) -> NDArray[np.object_]:
        """The words of a field of `WORD_FIELDS`, in the shape of the field; equal ones are one object."""
        return np.array(self.words, dtype=object)[self.rows[name]]

    @property
    def units(self) -> Ints:
        """Density index and realization of each row, shape (n, 2)."""
        return np.column_stack((self.rows["density_index"], self.rows["realization"]))


def row_type(study: Study) -> np.dtype[Any]:
    """The numpy type of a row."""
    cells, d = study.shape, study.box.dimension
    fields: list[Any] = [("density_index", np.int64), ("realization", np.int64)]
    fields += [(name, WORD if v.dtype is object else v.dtype) for name, v in UNIT_VARIABLES.items()]
    fields += [(name, WORD if v.dtype is object else v.dtype, cells) for name, v in CELL_VARIABLES.items()]
    fields += [("message", WORD, cells), ("status", np.int8, cells), ("conductivity", np.float64, (*cells, d, d))]
    fields += [("conductivity_bounds", np.float64, (*cells, d, 2))]
    return np.dtype(fields)


def tabulate(study: Study, records: Iterable[Record]) -> Table:
    """Records as a table."""
    records = list(records)
    rows = np.empty(len(records), row_type(study))
    if not records:
        return Table(rows)
    results, words = [record.result for record in records], {"": 0}
    rows["density_index"] = [study.densities.index(record.unit.density) for record in records]
    rows["realization"] = [record.unit.realization for record in records]
    rows["particles"] = [result.particles for result in results]
    rows["packing_density"] = [result.density for result in results]
    rows["solid_fraction"] = [result.solid_fraction for result in results]
    rows["pack_seconds"] = [result.pack_seconds for result in results]
    rows["random_stream"] = [stream_fingerprint(study.seed, record.unit) for record in records]
    rows["worker_rank"] = [record.rank for record in records]
    rows["worker_host"] = [_number_of(record.host, words) for record in records]
    rows["start_time"] = [record.start_time for record in records]
    rows["end_time"] = [record.end_time for record in records]
    cells, d = study.shape, study.box.dimension
    every = [cell for result in results for cell in result.cells]
    for name in (*CELL_VARIABLES, "message", "status"):
        values = [getattr(cell, name) for cell in every]
        if name in WORD_FIELDS:
            values = [_number_of(value, words) for value in values]
        rows[name] = np.array(values, rows[name].dtype).reshape(-1, *cells)
    tensors = np.array([_known(cell, cell.conductivity, (d, d)) for cell in every])
    bounds = np.array([_known(cell, cell.conductivity_bounds or None, (d, 2)) for cell in every])
    rows["conductivity"] = tensors.reshape(-1, *cells, d, d)
    rows["conductivity_bounds"] = bounds.reshape(-1, *cells, d, 2)
    return join([Table(rows, tuple(words))])


def _number_of(word: str, words: dict[str, int]) -> int:
    """The number of a word, which joins the words if it is new."""
    return words.setdefault(word, len(words))


def _known(cell: Outcome, values: Any, shape: tuple[int, ...]) -> Floats:
    """The values of a cell that has any; a failed one has none, whatever it stands for them."""
    if values is None or cell.status > Status.NOT_PERCOLATING:
        return np.full(shape, np.nan)
    return np.asarray(values, dtype=np.float64).reshape(shape)


def join(tables: Sequence[Table]) -> Table:
    """One table of several; a unit that was computed twice is kept once, as the first table that has it says.

    Beside the tables only the joined one takes memory that grows with the rows.
    """
    indices = np.concatenate([table.rows["density_index"] for table in tables])
    realizations = np.concatenate([table.rows["realization"] for table in tables])
    order = np.lexsort((realizations, indices))  # stable: of equal units the first comes first
    new = np.ones(order.size, dtype=np.bool_)
    new[1:] = (np.diff(indices[order]) != 0) | (np.diff(realizations[order]) != 0)
    rows, words = np.empty(int(new.sum()), tables[0].rows.dtype), {"": 0}
    place = np.full(order.size, -1)
    place[order[new]] = np.arange(rows.size)  # where each row goes, or -1
    start = 0
    for table in tables:
        to = place[start : start + len(table.rows)]
        start, kept = start + len(table.rows), to >= 0
        rows[to[kept]] = table.rows[kept]
        numbers = np.array([_number_of(word, words) for word in table.words], dtype=WORD)
        for name in WORD_FIELDS:
            rows[name][to[kept]] = numbers[table.rows[name][kept]]
    return Table(rows, tuple(words))
