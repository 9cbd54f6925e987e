"""The plan of a sweep: work units, their order, their random streams, and how many a cell needs.

A unit is one packing, (density, realization); everything else that a study varies is solved on it. All functions here
are pure functions of the study and of results: any number of ranks and any history of restarts makes the same plan.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from etc_engine.arrays import Floats, Ints
from etc_engine.realization import Status
from etc_engine.sweep.statistics import interval

if TYPE_CHECKING:
    from etc_engine.study.sweep import Study
    from etc_engine.sweep.table import Table

GROWTH_LIMIT = 4
"""A round of an adaptive sweep multiplies the realizations of a density by at most this: the first
estimates of the spread are poor, and one of them must not order thousands of units."""

LEAST = 6
"""An adaptive sweep settles no cell with fewer realizations: intervals at the 95 % level would cover in 90 %."""

LEAST_OF_ZEROS = 20
"""... nor one in which nothing percolates: then fewer than one realization in five percolates, at the 95 % level."""


@dataclass(frozen=True)
class Unit:
    """One packing and everything solved on it. ``density`` None is the packer's own."""

    density: float | None
    realization: int


def density_bits(density: float | None) -> tuple[int, int]:
    """The two 32-bit halves of a density as a double; those of a NaN stand for the packer's own.

    Examples
    --------
    >>> density_bits(0.75)
    (1072168960, 0)
    """
    high, low = struct.unpack(">II", struct.pack(">d", np.nan if density is None else density))
    return high, low


def unit_seed(seed: int, unit: Unit) -> np.random.SeedSequence:
    """The seed of a unit, keyed by (study seed, bits of the density, realization).

    Neither the rank nor the position of a density in the study enters: adding densities or realizations
    changes no other unit.
    """
    return np.random.SeedSequence(seed, spawn_key=(*density_bits(unit.density), unit.realization))


def unit_rng(seed: int, unit: Unit) -> np.random.Generator:
    """The random stream of a unit; PCG64 by name, since numpy may change its default."""
    return np.random.Generator(np.random.PCG64(unit_seed(seed, unit)))


def stream_fingerprint(seed: int, unit: Unit) -> int:
    """64 bits that identify the random stream of a unit, for the result file."""
    return int(unit_seed(seed, unit).generate_state(1, np.uint64)[0])


def units_to_run(densities: Sequence[float | None], targets: Sequence[int], finished: Ints) -> Ints:
    """Units of all densities up to their targets that are not finished, the costliest first.

    A unit costs what its particles cost, and their number grows with the density. With the large units
    first the small ones even out the ends of the ranks.

    Parameters
    ----------
    densities : sequence of float or None
        The densities of the study.
    targets : sequence of int
        How many realizations each of them is to have.
    finished : ndarray, shape (m, 2)
        Density index and realization of the units that are there.

    Returns
    -------
    ndarray, shape (n, 2)
        Density index and realization of the units to run.
    """
    done = np.zeros((len(densities), 1 + max([*targets, finished[:, 1].max(initial=0)])), dtype=bool)
    done[finished[:, 0], finished[:, 1]] = True
    wanted = np.arange(done.shape[1]) < np.asarray(targets)[:, None]
    units = np.argwhere(wanted & ~done)
    cost = np.array([density or 0.0 for density in densities])[units[:, 0]]
    return units[np.lexsort((units[:, 1], -cost))]


def needed_realizations(
    samples: Sequence[float] | Floats, realized: int, relative_ci: float, confidence: float, cap: int
) -> int:
    r"""How many realizations a cell needs for :math:`t\,s/\sqrt{n} \le \epsilon\,|\bar k|`.

    Parameters
    ----------
    samples : sequence of float, shape (n,)
        The valid results of the cell, in the order of realizations.
    realized : int
        Realizations spent so far, failures included.
    relative_ci : float
        Half-width wanted, over the mean (epsilon).
    confidence : float
        Level of the interval.
    cap : int
        Never more than this.

    Returns
    -------
    int
        ``realized`` if the cell is settled, otherwise the next target.

    Notes
    -----
    The target is the n that the present interval asks for, at least one more and at most `GROWTH_LIMIT` times the
    present number. Stopping on the sample's own spread makes the interval optimistic (sequential sampling), so that
    nothing is settled before `LEAST` realizations. Once a realization did not percolate, the interval of
    `etc_engine.sweep.statistics.interval` carries the uncertainty of the percolating fraction, and a stretch of
    realizations that all percolate cannot end the cell early. A cell without any valid result is left alone,
    and one in which nothing percolates after `LEAST_OF_ZEROS`: more of the same teach little.

    Examples
    --------
    >>> needed_realizations([1.0, 1.02, 0.98, 1.01], 4, 0.01, 0.95, 100)
    16
    """
    n = len(samples)
    if n == 0 or realized >= cap:
        return realized
    if n == 1:
        return min(cap, 2 * realized)
    least = min(cap, LEAST, GROWTH_LIMIT * realized)
    found = interval(np.asarray(samples), confidence)
    if found.percolating_fraction == 0.0:
        return max(realized, min(cap, LEAST_OF_ZEROS, GROWTH_LIMIT * realized))
    if found.half_width <= relative_ci * found.mean:
        return max(realized, least)
    if not np.isfinite(found.half_width):
        return min(cap, GROWTH_LIMIT * realized)
    wanted = np.ceil(realized * (found.half_width / (relative_ci * found.mean)) ** 2)
    return int(min(cap, max(realized + 1, least, min(wanted, GROWTH_LIMIT * realized))))


def next_targets(study: Study, targets: Sequence[int], table: Table) -> tuple[int, ...]:
    """How many realizations each density needs after a round: its noisiest cell and direction decides.

    Only the units up to the targets count, so that units a former run has done beyond them do not matter.
    """
    wish, rows = study.statistics, table.rows
    if wish.relative_ci is None:
        return tuple(targets)
    grown = []
    for i, target in enumerate(targets):
        mine = rows[(rows["density_index"] == i) & (rows["realization"] < target)]
        needs = [
            needed_realizations(samples, target, wish.relative_ci, wish.confidence, wish.cap)
            for samples in _samples(mine[np.argsort(mine["realization"])])
        ]
        grown.append(max(needs, default=target))
    return tuple(grown)


def _samples(rows: NDArray[Any]) -> Iterator[Floats]:
    """Valid conductivities of each cell and each direction that has one."""
    *cells, d, _ = rows.dtype["conductivity"].shape
    for place in np.ndindex(*cells):
        valid = rows["status"][(slice(None), *place)] <= Status.NOT_PERCOLATING
        for k in range(d):
            samples = rows["conductivity"][(valid, *place, k, k)]
            if np.isfinite(samples).all():
                yield samples
