"""Records: what a finished unit leaves behind, as one line of JSON that keeps every bit.

JSON writes a double as the shortest decimal that reads back to the same bits.
"""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from etc_engine.errors import OutputError
from etc_engine.realization import Outcome, Realization, RealizationSpec, Status
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
        return sum(cell.status > Status.NOT_PERCOLATING for cell in self.result.cells)


def failed_realization(error: Exception, spec: RealizationSpec) -> Realization:
    """The result of a unit that raised: every cell has status ERROR and says why."""
    message = _steady(f"{type(error).__name__}: {error}")
    cells = (Outcome(Status.ERROR, message),) * math.prod(spec.shape)
    return Realization(0, np.nan, np.nan, 0.0, cells)


def _steady(message: str) -> str:
    """One line without memory addresses, which differ from run to run."""
    return re.sub(r"0x[0-9a-fA-F]+", "0x...", " ".join(message.split()))


def encode(record: Record) -> str:
    """A record as one line of JSON, without the newline."""
    # the fields as they stand: dataclasses.asdict copies everything, ten times as slowly
    values = vars(record) | {"unit": [record.unit.density, record.unit.realization]}
    values["result"] = vars(record.result) | {"cells": [_plain_cell(cell) for cell in record.result.cells]}
    return json.dumps(values, default=_plain_scalar)


def decode(line: str) -> Record:
    """The record that `encode` wrote; what an older version of the engine did not write has its default.

    Raises
    ------
    OutputError
        If another version of the engine wrote something that this one does not know.

    Examples
    --------
    >>> cell = Outcome(Status.OK, conductivity=np.array([[0.1 + 0.2, np.nan], [np.nan, 1.0]]))
    >>> record = Record(Unit(0.7, 3), Realization(9, 0.7, 0.7, 0.1, (cell,)), 0, "node", 1.0, 2.0)
    >>> decode(encode(record)).result.cells[0].conductivity[0, 0] == 0.1 + 0.2
    np.True_
    """
    values = json.loads(line)
    try:
        result = values.pop("result")
        cells = tuple(_cell(cell) for cell in _flat(result.pop("cells")))
        return Record(unit=Unit(*values.pop("unit")), result=Realization(cells=cells, **result), **values)
    except (TypeError, KeyError, ValueError) as error:
        raise OutputError(
            f"a shard holds a record of another version of the engine ({error}): finish the sweep with that version, "
            "or start anew with --overwrite"
        ) from None


def _flat(cells: list[Any]) -> list[dict[str, Any]]:
    """Cells as a list; older versions wrote a list of lists."""
    return [inner for cell in cells for inner in (cell if isinstance(cell, list) else [cell])]


def _plain_cell(cell: Outcome) -> dict[str, Any]:
    values = vars(cell) | {"status": int(cell.status)}
    if cell.conductivity is not None:
        values["conductivity"] = np.asarray(cell.conductivity, dtype=np.float64).tolist()
    return values


def _cell(values: dict[str, Any]) -> Outcome:
    status, tensor = Status(values.pop("status")), values.pop("conductivity")
    conductivity = None if tensor is None else np.array(tensor, dtype=np.float64)
    return Outcome(status=status, conductivity=conductivity, **values)


def _plain_scalar(value: object) -> object:
    """Engines may return numpy scalars; JSON takes those of Python."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"a record holds numbers and words, found {type(value).__name__}")
