"""Records: what a finished unit leaves behind, as one line of JSON that keeps every bit.

JSON writes a double as the shortest decimal that reads back to the same bits.
"""

from __future__ import annotations

import json
import re
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from etc_engine.realization import Outcome, Realization, RealizationSpec, Status
from etc_engine.realization.outcome import uniform_cells
from etc_engine.sweep.plan import Unit


@dataclass(frozen=True)
class Record:
    """A finished unit: its result, and where and when it was computed."""

    unit: Unit
    result: Realization
    rank: int
    host: str
    start_time: float
    end_time: float

    @property
    def failed(self) -> int:
        """Cells of the unit that ended without a conductivity."""
        return sum(cell.status > Status.NOT_PERCOLATING for row in self.result.cells for cell in row)


def failed_realization(error: Exception, spec: RealizationSpec, dimension: int) -> Realization:
    """The result of a unit that raised: every cell has status ERROR and says why."""
    message = _steady(f"{type(error).__name__}: {error}")
    nowhere = np.full((dimension, dimension), np.nan)
    cell = Outcome(Status.ERROR, message, conductivity=nowhere)
    return Realization(0, np.nan, np.nan, 0.0, uniform_cells(spec, cell))


def _steady(message: str) -> str:
    """One line without memory addresses, which differ from run to run."""
    return re.sub(r"0x[0-9a-fA-F]+", "0x...", " ".join(message.split()))


def encode(record: Record) -> str:
    """A record as one line of JSON, without the newline."""
    values = asdict(record)
    values["unit"] = [record.unit.density, record.unit.realization]
    values["result"]["cells"] = [[_plain_cell(cell) for cell in row] for row in record.result.cells]
    return json.dumps(values, default=_plain_scalar)


def decode(line: str) -> Record:
    """The record that `encode` wrote.

    Examples
    --------
    >>> cell = Outcome(Status.OK, conductivity=np.array([[0.1 + 0.2, np.nan], [np.nan, 1.0]]))
    >>> record = Record(Unit(0.7, 3), Realization(9, 0.7, 0.7, 0.1, ((cell,),)), 0, "node", 1.0, 2.0)
    >>> decode(encode(record)).result.cells[0][0].conductivity[0, 0] == 0.1 + 0.2
    np.True_
    """
    values = json.loads(line)
    result = values.pop("result")
    cells = tuple(tuple(_cell(cell) for cell in row) for row in result.pop("cells"))
    return Record(unit=Unit(*values.pop("unit")), result=Realization(cells=cells, **result), **values)


def _plain_cell(cell: Outcome) -> dict[str, Any]:
    values = {field.name: getattr(cell, field.name) for field in fields(Outcome)}
    values["status"] = int(cell.status)
    values["conductivity"] = np.asarray(cell.conductivity, dtype=np.float64).tolist()
    return values


def _cell(values: dict[str, Any]) -> Outcome:
    status, conductivity = (
        Status(values.pop("status")),
        np.array(values.pop("conductivity"), dtype=np.float64),
    )
    return Outcome(status=status, conductivity=conductivity, **values)


def _plain_scalar(value: object) -> object:
    """Engines may answer numpy scalars; JSON knows Python's."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"a record holds numbers and words, found {type(value).__name__}")
