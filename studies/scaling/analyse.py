"""Efficiency of a sweep on 64 to 16 384 ranks: a discrete-event simulation of counter, units, shards and gather.

``python studies/scaling/analyse.py`` prints the tables of README.md. Costs marked *measured* come from
``tests/benchmarks/bench_scheduler.py`` and the functions themselves on one machine; the others are assumptions
about a cluster, stated in README.md, and can be changed here.
"""

from __future__ import annotations

import argparse
import heapq
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Costs:
    """Seconds of everything that is not computing."""

    latency: float = 4e-6  # assumed: there and back over the network
    service: float = 0.5e-6  # assumed: atomic operations on one address queue up at the network card
    operations: int = 2  # of the counters, a unit
    append: float = 170e-6  # measured: encode, checksum and write a record of 8 cells
    create: float = 50e-6  # assumed: metadata server of a parallel file system, 20 000 new files a second
    every_rank_creates: bool = False
    sync: float = 5e-3  # assumed: fsync, at most 5 % of the time
    opening: float = 1e-3  # assumed: open a file that another host wrote
    decode: float = 200e-6  # measured: read, check, decode and tabulate a record
    decoded_by_all: bool = True
    join: float = 2e-6  # measured: join a row on rank 0
    assemble: float = 10e-6  # measured: place a row in the dataset and write it
    hardware_atomics: bool = True
    poll: float = 5e-3  # how often a waiting rank 0 looks into MPI


FIRST_VERSION = Costs(operations=3, every_rank_creates=True, decoded_by_all=False, assemble=130e-6)


@dataclass(frozen=True)
class Result:
    """Seconds of the stages, and the part of all rank-seconds that was spent computing."""

    compute: float
    waiting: float
    last: float
    gather: float

    @property
    def efficiency(self) -> float:
        """Computing over everything."""
        return self.compute / (self.last + self.gather)


def durations(units: int, mean: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Unit times of a study of ten densities (cost 0.6 to 0.78 and a spread of 10 %), the costliest first."""
    classes = np.sort(np.tile(np.linspace(0.6, 0.78, 10), -(-units // 10))[:units])[::-1]
    return mean / 0.69 * classes * rng.lognormal(-0.005, 0.1, units)


def simulate(ranks: int, times: NDArray[np.float64], costs: Costs) -> Result:
    """Run the units on the ranks; every rank takes its next unit from the counter."""
    counter = _Counter(costs)
    metadata_free = waiting = last = 0.0
    begun: set[int] = set()
    events = [(0.0, rank, False) for rank in range(ranks)]  # when, who, and whether to create a shard first
    while events:
        now, rank, creates = heapq.heappop(events)
        if creates:
            metadata_free = max(metadata_free, now) + costs.create
            heapq.heappush(events, (metadata_free, rank, False))
            continue
        for asked, who, answered in counter.answer(now, rank, len(times)):
            waiting += answered - asked
            unit = counter.taken
            counter.taken += 1
            if unit >= len(times):
                last = max(last, answered)
                continue
            end = answered + times[unit] + costs.append + min(costs.sync, 0.05 * times[unit])
            heapq.heappush(events, (end, who, who not in begun))
            begun.add(who)
    last += costs.create * (ranks - len(begun)) * costs.every_rank_creates
    return Result(float(times.sum()) / ranks, waiting / ranks, last, gathering(ranks, len(times), costs))


class _Counter:
    """The counter on rank 0: one request at a time, and without hardware only while rank 0 is inside MPI."""

    def __init__(self, costs: Costs) -> None:
        self.taken = 0
        self._costs = costs
        self._free = 0.0
        self._held: list[tuple[float, int]] = []
        self._root_waits = False

    def answer(self, now: float, rank: int, units: int) -> list[tuple[float, int, float]]:
        """Requests that can be answered now: when asked, by whom, and when answered."""
        costs = self._costs
        if not costs.hardware_atomics and rank > 0 and not self._root_waits:
            self._held.append((now, rank))
            return []
        requests = [(now, rank)]
        if rank == 0:
            requests, self._held = [*self._held, (now, rank)], []
            self._root_waits = self.taken + len(requests) > units
        answers = []
        for asked, who in requests:
            polled = costs.poll / 2 if self._root_waits and not costs.hardware_atomics else 0.0
            arrival = max(now, asked + costs.latency / 2) + polled
            self._free = max(self._free, arrival) + costs.service * costs.operations
            answers.append((asked, who, self._free + costs.latency / 2))
        return answers


def gathering(ranks: int, units: int, costs: Costs) -> float:
    """Seconds to turn shards into a dataset."""
    readers = ranks if costs.decoded_by_all else 1
    reading = (ranks * costs.opening + units * costs.decode) / readers
    return reading + units * (costs.join + costs.assemble)


def static(ranks: int, times: NDArray[np.float64], costs: Costs) -> Result:
    """The same units assigned to the ranks in turn beforehand, without a counter."""
    full = times + costs.append + np.minimum(costs.sync, 0.05 * times)
    longest = max(float(full[rank::ranks].sum()) for rank in range(ranks)) + costs.create * ranks
    return Result(float(times.sum()) / ranks, 0.0, longest, gathering(ranks, len(times), costs))


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mean", type=float, default=2.1, help="mean seconds of a unit")
    parser.add_argument("--per-rank", type=int, default=20, help="units per rank")
    parser.add_argument("--largest", type=int, default=16384, help="most ranks")
    parser.add_argument("--seed", type=int, default=141421)
    options = parser.parse_args()
    sizes = [ranks for ranks in (64, 256, 1024, 4096, 16384) if ranks <= options.largest]
    print(f"units of {options.mean:g} s, {options.per_rank} per rank\n")
    print("| ranks | now | first version | without atomics in hardware | random order | assigned beforehand |")
    print("| --- | --- | --- | --- | --- | --- |")
    stages = []
    for ranks in sizes:
        rng = np.random.Generator(np.random.PCG64(options.seed))
        times = durations(ranks * options.per_rank, options.mean, rng)
        now = simulate(ranks, times, Costs())
        first = simulate(ranks, times, FIRST_VERSION)
        soft = simulate(ranks, times, replace(Costs(), hardware_atomics=False))
        mixed = simulate(ranks, rng.permutation(times), Costs())
        dealt = static(ranks, rng.permutation(times), Costs())
        row = (now, first, soft, mixed, dealt)
        print(f"| {ranks} | " + " | ".join(f"{result.efficiency:.3f}" for result in row) + " |")
        stages.append((ranks, now, first))
    print("\nseconds of the stages (now, first version)\n")
    print("| ranks | computing | waiting for the counter | until the last rank is done | gather and write |")
    print("| --- | --- | --- | --- | --- |")
    for ranks, now, first in stages:
        pairs = [(a, b) for a, b in zip(vars(now).values(), vars(first).values(), strict=True)]
        print(f"| {ranks} | {pairs[0][0]:.1f} | " + " | ".join(f"{a:.3g}, {b:.3g}" for a, b in pairs[1:]) + " |")


if __name__ == "__main__":
    main()
