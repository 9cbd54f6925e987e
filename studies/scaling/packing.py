"""Predicted time and memory per rank of one packing on many ranks, up to 10^9 particles on 1024 ranks.

``python studies/scaling/packing.py`` prints the tables of README.md. Costs marked *measured* come from
``tests/benchmarks/bench_distributed.py`` on one machine, in processor time of one rank; the others are assumptions
about a cluster, stated in README.md, and can be changed here.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from math import log2


@dataclass(frozen=True)
class Costs:
    """Seconds and bytes per particle on its rank, and those of the machine."""

    dimension: int
    read: float  # measured [s]: parse a line
    contacts: float  # measured [s]: deal out, copies, contacts, backbone, elements, assembly
    setup: float  # measured [s]: hierarchy of BoomerAMG
    iteration: float  # measured [s]
    iterations: float  # measured on 1 to 4 ranks
    growth: float  # assumed: iterations more for each doubling of the ranks
    memory: float  # measured [B]: above the libraries, a copy counts as much
    line: float = 110.0  # bytes of a particle in a dump
    libraries: float = 0.25e9  # measured [B]: Python, PETSc and compiled code
    disk: float = 10e9  # assumed [B/s]: of a parallel file system, shared by all ranks
    network: float = 0.2e9  # assumed [B/s]: share of a rank of its node's network
    latency: float = 2e-6  # assumed [s]: of a message
    exchanges: int = 40  # of Python objects with all ranks: numbering, copies, about 20 rounds of pruning
    pickle: float = 5e-6  # assumed [s]: of an object to or from one rank in an exchange
    levels: int = 8  # of the hierarchy


# lattices of overlapping particles with a tenth of the places empty: 3.1 contacts of a disk and 4.6 of a sphere conduct
DISKS = Costs(2, 1.05e-6, 6.1e-6, 1.9e-6, 0.55e-6, iterations=11, growth=0.5, memory=1.52e3)
SPHERES = Costs(3, 1.2e-6, 10.9e-6, 5.9e-6, 1.46e-6, iterations=9, growth=0.5, memory=2.9e3)


@dataclass(frozen=True)
class Forecast:
    """Of one rank; ``copies`` is their number over that of its own particles."""

    copies: float
    read: float
    contacts: float
    setup: float
    solve: float
    talk: float
    memory: float

    @property
    def seconds(self) -> float:
        """All of it."""
        return self.read + self.contacts + self.setup + self.solve + self.talk


def copied(own: float, ranks: int, dimension: int) -> float:
    """Copies over own particles of a block inside the packing: a layer of one diameter on each side that is cut."""
    edge = own ** (1.0 / dimension)
    cuts = min(2.0, 2.0 * (1.0 - ranks ** (-1.0 / dimension)))  # faces per axis that have a neighbour, on average
    return float((1.0 + cuts / edge) ** dimension - 1.0)


def forecast(particles: float, ranks: int, costs: Costs) -> Forecast:
    """Time and memory of a rank that has its even share."""
    own = particles / ranks
    copies = copied(own, ranks, costs.dimension)
    iterations = costs.iterations + costs.growth * log2(ranks)
    surface = 8.0 * copies * own  # bytes of one number per copy
    talk = costs.exchanges * ranks * (costs.pickle + costs.latency)
    talk += (10.0 + 3.0 * iterations) * surface / costs.network
    talk += iterations * costs.levels * 26.0 * costs.latency + iterations * 3.0 * log2(ranks or 1) * costs.latency
    return Forecast(
        copies=copies,
        read=own * costs.read + particles * costs.line / costs.disk,
        contacts=own * (1.0 + copies) * costs.contacts,
        setup=own * costs.setup,
        solve=own * costs.iteration * iterations,
        talk=talk,
        memory=costs.libraries + own * (1.0 + copies) * costs.memory,
    )


CASES = ((1e6, 1), (1e6, 4), (1e7, 16), (1e8, 128), (1e9, 1024), (1e9, 4096))


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--particles", type=float)
    parser.add_argument("--ranks", type=int)
    asked = parser.parse_args()
    cases = CASES if asked.particles is None else ((asked.particles, asked.ranks or 1),)
    for name, costs in (("disks", DISKS), ("spheres", SPHERES)):
        print(
            f"| {name} | ranks | copies | read | contacts | set-up | solve | communication | total | GB per rank "
            "| GB in all |"
        )
        print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
        for particles, ranks in cases:
            one = forecast(particles, ranks, costs)
            stages = " | ".join(f"{value:.3g}" for value in (one.read, one.contacts, one.setup, one.solve, one.talk))
            memory = f"{one.memory / 1e9:.3g} | {ranks * one.memory / 1e9:.4g}"
            print(f"| {particles:.0e} | {ranks} | {100 * one.copies:.1f} % | {stages} | {one.seconds:.3g} | {memory} |")
        print()


if __name__ == "__main__":
    main()
