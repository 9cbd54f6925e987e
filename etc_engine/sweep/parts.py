"""Parts: a sweep that several runs share which do not know of each other, such as the jobs of an array.

Beside ``out.nc`` part 3 of 8 keeps its units in the folder ``out.nc.part-3-of-8.shards``, with a lock of its own. A run
of the whole study takes them up: streams are keyed by (seed, density, realization), so that its result has the bits of
a run that has computed everything itself.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from glob import escape
from pathlib import Path

import numpy as np

from etc_engine.arrays import Ints
from etc_engine.durable.lock import Lock
from etc_engine.study.sweep import Study
from etc_engine.sweep.plan import units_to_run
from etc_engine.sweep.shards import SUFFIX, clear_folder


@dataclass(frozen=True)
class Part:
    """Part ``number`` of ``count``, from 1."""

    number: int
    count: int

    def __str__(self) -> str:
        return f"{self.number} of {self.count}"

    def folder(self, output: Path) -> Path:
        """Where the shards of this part are."""
        return output.with_name(f"{output.name}.part-{self.number}-of-{self.count}.shards")

    def select(self, study: Study, units: Ints) -> Ints:
        """Those of some units that belong to this part.

        Every ``count``-th unit of the whole study, the costliest first. Of an adaptive study every ``count``-th
        density: how many realizations a density needs depends on all of its own.

        Parameters
        ----------
        study : Study
        units : ndarray, shape (n, 2)
            Density index and realization.
        """
        realizations = study.statistics.realizations
        place = units[:, 0]
        if study.statistics.relative_ci is None:
            first = units_to_run(study.densities, (1,) * len(study.densities), np.empty((0, 2), np.int64))
            place = np.argsort(first[:, 0])[units[:, 0]] * realizations + units[:, 1]
        return units[place % self.count == self.number - 1]


def part_folders(output: Path) -> list[Path]:
    """The folders of all parts of an output."""
    return sorted(output.parent.glob(f"{escape(output.name)}.part-*-of-*.shards"))


def take_up(part: Path, folder: Path | None, run: str) -> None:
    """Move the finished units of a part, and the records of its runs, into the folder of the whole; None drops them.

    Raises
    ------
    OutputError
        If the part is being computed.
    """
    with Lock(part, run):
        if folder is not None:
            for path in (*part.glob(f"*{SUFFIX}"), *part.glob("*.run")):
                path.replace(folder / path.name)
        clear_folder(part)
    with suppress(OSError):  # a job of the part has just come for its lock
        part.rmdir()
