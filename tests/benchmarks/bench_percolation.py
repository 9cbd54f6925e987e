"""The solver near the percolation threshold: time per unknown and exactness against a dense packing, and spsolve.

Run by hand: ``python tests/benchmarks/bench_percolation.py [--disks 1e5]``. Disks are taken out of one packing at
random; columns: share kept, unknowns after pruning, conductivity, iterations, set-up and solve per unknown, imbalance
of the wall flows, and for at most 2e5 unknowns the time and the difference of scipy.sparse.linalg.spsolve.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from scipy.sparse.linalg import spsolve

from etc_engine import Box, PackingSpec, bonded_contacts, find_backbone, pack, parse_radii
from etc_engine.engines.dtem.assembly import assemble
from etc_engine.engines.dtem.methods import METHODS
from etc_engine.medium.loads import contact_lift
from etc_engine.medium.sides import contact_sides
from etc_engine.solvers import build_preconditioner, solve_energy


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--disks", type=float, default=1e5)
    arguments = parser.parse_args()
    edge = float(np.sqrt(arguments.disks / 1098.0))
    spec = PackingSpec("advancing-front", parse_radii("uniform:0.01:0.02"), Box((edge, edge)))
    rng = np.random.default_rng(20261)
    packing = pack(spec, rng)
    order = rng.permutation(packing.count)
    names = ("kept", "unknowns", "k", "iter", "us/unknown", "imbalance", "spsolve s", "difference")
    print("".join(f"{name:>{width}}" for name, width in zip(names, (6, 10, 12, 6, 12, 11, 11, 12), strict=True)))
    for kept in (1.0, 0.9, 0.8, 0.75, 0.7, 0.68, 0.66, 0.65, 0.64):
        network = bonded_contacts(packing.select(np.sort(order[: int(kept * packing.count)])), np.radians(5.0))
        backbone = find_backbone(network, (0,))
        if not backbone.spans[0]:
            print(f"{kept:6.2f}  does not span")
            break
        reduced = network.select(backbone.contacts, backbone.wall_contacts)
        sides = contact_sides(reduced)
        elements = METHODS["chord"].elements(sides, np.ones(network.packing.count), 1)
        system = assemble(elements, *contact_lift(reduced, (0,), backbone.clusters, sides, elements.modes))
        rhs, lift = np.ascontiguousarray(system.rhs[:, 0]), float(system.lift_energies[0])
        begin = time.perf_counter()
        preconditioner = build_preconditioner(system.matrix)
        u, report = solve_energy(system.matrix, rhs, lift, preconditioner=preconditioner)
        seconds = time.perf_counter() - begin
        energy = lift - float(u @ (2.0 * rhs - system.matrix @ u))
        line = f"{kept:6.2f}{rhs.size:10d}{energy:12.6f}{report.iterations:6d}{1e6 * seconds / rhs.size:12.2f}"
        line += f"{report.imbalance:11.1e}"
        if rhs.size <= 2e5:
            begin = time.perf_counter()
            exact = spsolve(system.matrix.tocsc(), rhs)
            line += f"{time.perf_counter() - begin:11.2f}{abs(lift - float(exact @ rhs) - energy) / energy:12.1e}"
        print(line, flush=True)


if __name__ == "__main__":
    main()
