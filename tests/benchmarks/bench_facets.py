"""Facet links of a large bed, and of a list of gas pressures on one bed: processor time by stage.

Run: python tests/benchmarks/bench_facets.py [--spheres 100000] [--contrast 100] [--spread 0.2] [--states]
"""

from __future__ import annotations

import argparse
import resource
import time

import numpy as np

from etc_engine.box import Box
from etc_engine.engines.dtem.facet_medium import solve_series, sphere_conductivity
from etc_engine.engines.dtem.facet_steady import facet_conductivity, uniform_material
from etc_engine.medium.conditions import Conditions, pores_at
from etc_engine.medium.conduction import Conduction
from etc_engine.medium.facets import facet_links
from etc_engine.medium.medium import Medium
from etc_engine.medium.rules import overlap_contacts
from etc_engine.packing.lubachevsky_stillinger import compress
from etc_engine.packing.particles import ParticlePacking

TEMPERATURES, PRESSURES = np.linspace(300.0, 1100.0, 5), np.geomspace(1e2, 1e6, 10)
SCALE = 4e-3
"""Box edge of the packed block [m]."""
BLOCK = 1000
"""Spheres that are packed; the bed repeats them, which costs the solver what a bed without repetition costs."""


def packed_block(spread: float) -> ParticlePacking:
    rng = np.random.default_rng(20261126)
    radii = rng.uniform(1.0 - spread, 1.0 + spread, BLOCK)
    radii *= (0.6 / (4.0 / 3.0 * np.pi * (radii**3).sum())) ** (1.0 / 3.0)
    return compress(radii, Box((1.0, 1.0, 1.0), (True, True, True)), rng, density=0.60).packing


def repeated(block: ParticlePacking, count: int) -> ParticlePacking:
    side = round((count / BLOCK) ** (1.0 / 3.0))
    shape = (side, side, max(round(count / BLOCK / side**2), 1))
    cells = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1).reshape(-1, 1, 3)
    centers = (cells + block.centers).reshape(-1, 3)
    box = Box(tuple(float(s) for s in shape), (True, True, True))
    return ParticlePacking(centers, np.tile(block.radii, cells.shape[0]), box)


def time_states(bed: ParticlePacking) -> None:
    """One state of gas and radiation, and fifty of them together; pebbles of 0.25 mm, accommodation 0.4."""
    small = ParticlePacking(
        bed.centers * SCALE, bed.radii * SCALE, Box(tuple(SCALE * v for v in bed.box.lengths), bed.box.periodic)
    )
    states = [Conditions(t, "helium", p, 0.4, emissivity=0.8) for t in TEMPERATURES for p in PRESSURES]
    media = [Medium(small, 2.4 * (300.0 / c.temperature) ** 0.5, pores=pores_at(c, small)) for c in states]
    one, many = (clock(lambda rows=rows: solve_series(rows, Conduction())) for rows in (media[22:23], media))
    alone = sphere_conductivity(media[7]).tensor
    apart = np.abs(many[1][7].tensor - alone).max() / alone.max()
    print(
        f"{bed.count} spheres, one state {one[0]:.2f} s, {len(media)} states {many[0]:.2f} s of processor time: "
        f"{many[0] / one[0]:.1f} times; state 7 off by {apart:.1e}, estimated {many[1][7].relative_energy_error:.1e}"
    )


def clock(work):
    start = time.process_time()
    result = work()
    return time.process_time() - start, result


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--spheres", type=int, default=100_000)
    parser.add_argument("--contrast", type=float, default=100.0)
    parser.add_argument("--spread", type=float, default=0.0)
    parser.add_argument("--states", action="store_true", help="50 temperatures and pressures of helium instead")
    arguments = parser.parse_args()
    start = time.process_time()
    block = packed_block(arguments.spread)
    links = facet_links(overlap_contacts(block))
    facet_conductivity(links, uniform_material(links, 10.0, 1.0))
    print(f"{BLOCK} spheres packed, kernels compiled or loaded: {time.process_time() - start:.1f} s")
    bed = repeated(block, arguments.spheres)
    if arguments.states:
        time_states(bed)
        return
    start = time.process_time()
    links = facet_links(overlap_contacts(bed))
    tessellated = time.process_time()
    result = facet_conductivity(links, uniform_material(links, arguments.contrast, 1.0), tolerance=1e-8)
    solved = time.process_time()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(
        f"{bed.count} spheres, {links.count} facets: tessellation and contacts {tessellated - start:.2f} s, solution "
        f"{solved - tessellated:.2f} s, together {solved - start:.2f} s of processor time; {result.iterations} "
        f"iterations, peak {peak:.2f} GB, k/k_f = {np.diag(result.tensor).round(4)}"
    )


if __name__ == "__main__":
    main()
