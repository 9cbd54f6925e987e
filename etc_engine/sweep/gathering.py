"""Gathering: the shards of all ranks as one table on rank 0, read by all ranks side by side."""

from __future__ import annotations

import time
from collections.abc import Iterable
from functools import partial
from pathlib import Path

from etc_engine.arrays import Ints
from etc_engine.errors import OutputError
from etc_engine.study.sweep import Study
from etc_engine.sweep.scheduler import Communicator, on_rank_zero
from etc_engine.sweep.shards import ShardReader
from etc_engine.sweep.table import Table, join, tabulate

AWAIT_SECONDS, VISIBLE_SECONDS = 0.2, 60.0
"""How long a network file system may take to show one host what another has synced."""


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
        new = tabulate(self._study, self._reader.read(files[ranks.rank :: ranks.size]))
        parts = ranks.gather((new, self._reader.damaged))
        if parts is not None:
            self._table = join([self._table, *(table for table, _ in parts)])
            self.damaged = sum(damaged for _, damaged in parts)
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

    def _missing(self, table: Table, units: Ints, deadline: float) -> int:
        there = {tuple(unit) for unit in table.units.tolist()}
        missing = [unit for unit in units.tolist() if tuple(unit) not in there]
        if missing and time.monotonic() > deadline:
            raise OutputError(
                f"{len(missing)} finished units do not appear in {self._reader.folder}: "
                "do all ranks see the same folder?"
            )
        return len(missing)
