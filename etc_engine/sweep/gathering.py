"""Gathering: the shards of all ranks as one table on rank 0, read by all ranks side by side.

Rank 0 takes the rows in portions of a limited size, so that its memory is that of the table and not of all records.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from math import prod
from pathlib import Path

import numpy as np

from etc_engine.arrays import Ints
from etc_engine.errors import EtcError, OutputError
from etc_engine.study.sweep import Study
from etc_engine.sweep.records import Record
from etc_engine.sweep.scheduler import Communicator, on_rank_zero
from etc_engine.sweep.shards import ShardReader
from etc_engine.sweep.table import Table, join, tabulate

PORTION = 4096
"""Cells that all ranks together turn into rows before rank 0 takes these; records in memory take kilobytes a cell."""

AWAIT_SECONDS, VISIBLE_SECONDS = 0.2, 60.0
"""How long a network file system may take to show one host what another has synced."""


@dataclass(frozen=True)
class _Portion:
    """Rows of one rank, whether it may have more, and what kept it from reading on."""

    table: Table
    more: bool = False
    error: EtcError | None = None


class Gatherer:
    """Knows what of the shards has been read; every rank calls its methods together.

    Parameters
    ----------
    study : Study
        The study, for the shape of the rows.
    folder : Path
        The folder of the shards.
    communicator : Communicator
        The ranks that read.
    """

    def __init__(self, study: Study, folder: Path, communicator: Communicator) -> None:
        self._study, self._communicator = study, communicator
        self._reader = ShardReader(folder)
        self._table = tabulate(study, [])
        self.damaged = 0

    def gather(self, written: Path | None = None) -> Table:
        """The table of all finished units, on rank 0; elsewhere an empty one.

        ``written`` is the shard this rank has just written: its folder may show it later than it can be read.
        """
        ranks = self._communicator
        every = ranks.gather(written)
        files = on_rank_zero(ranks, partial(self._files, every))
        records = self._reader.read(files[ranks.rank :: ranks.size])
        portion = max(1, PORTION // (ranks.size * prod(self._study.shape)))
        tables = [self._table]
        more = True
        while more:
            parts = ranks.gather(self._portion(records, portion))
            tables += [part.table for part in parts or () if len(part.table.rows)]
            more = on_rank_zero(ranks, partial(_any_more, parts or ()))
        damaged = ranks.gather(self._reader.damaged)
        self.damaged = sum(damaged or ())
        if len(tables) > 1:
            self._table = join(tables)
        return self._table

    def gather_all(self, units: Ints, written: Path | None = None) -> Table:
        """The same, once it has the units of a round, which all ranks have written.

        Raises
        ------
        OutputError
            If they do not appear within a minute.
        """
        deadline = time.monotonic() + VISIBLE_SECONDS
        while True:
            table = self.gather(written)
            missing = on_rank_zero(self._communicator, partial(self._missing, table, units, deadline))
            if not missing:
                return table
            time.sleep(AWAIT_SECONDS)

    def _files(self, written: Iterable[Path | None] | None) -> list[Path]:
        return self._reader.files(path for path in written or () if path is not None)

    def _portion(self, records: Iterator[Record], size: int) -> _Portion:
        """The next rows of this rank; an error is passed on to all ranks, which would wait for this one."""
        try:
            batch = list(islice(records, size))
            return _Portion(tabulate(self._study, batch), len(batch) == size)
        except EtcError as error:
            return _Portion(tabulate(self._study, []), error=error)

    def _missing(self, table: Table, units: Ints, deadline: float) -> int:
        here = table.units
        width = 1 + max(units[:, 1].max(initial=0), here[:, 1].max(initial=0))
        missing = int((~np.isin(units @ [width, 1], here @ [width, 1])).sum())
        if missing and time.monotonic() > deadline:
            raise OutputError(
                f"{missing} finished units do not appear in {self._reader.folder}: do all ranks see the same folder?"
            )
        return missing


def _any_more(parts: Sequence[_Portion]) -> bool:
    """Whether any rank may have more rows than these."""
    for part in parts:
        if part.error is not None:
            raise part.error
    return any(part.more for part in parts)
