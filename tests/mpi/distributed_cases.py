"""One packing on the ranks that run this file, against the same packing on rank 0 alone; rank 0 prints JSON."""

from __future__ import annotations

import json
import sys

import numpy as np

from etc_engine.box import Box
from etc_engine.engines.dtem.conductivity import element_conductivity
from etc_engine.engines.dtem.distributed.conductivity import Scattered, distributed_conductivity
from etc_engine.errors import EtcError
from etc_engine.medium.conduction import Conduction
from etc_engine.medium.medium import Medium
from etc_engine.medium.rules import bonded_contacts, overlap_contacts, radius_contacts
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.digits import Digits, PrintedColumn, PrintedColumns
from etc_engine.particle_files.precision import Doubt, doubtful_contacts
from etc_engine.particle_files.table import ParticleTable
from etc_engine.sweep.scheduler import connect

RULES = {
    "bonded": (lambda packing: bonded_contacts(packing, 0.1, 0.02).with_resistance(0.01), 0.02),
    "overlap": (overlap_contacts, 0.0),
    "radius": (lambda packing: radius_contacts(packing, 0.01, 0.02), 0.02),
}


def shaken_lattice(box: Box, edge: int, voids: float, seed: int) -> ParticlePacking:
    """Overlapping particles near the points of a square or cubic lattice, some of which are empty."""
    rng = np.random.default_rng(seed)
    d, h = box.dimension, min(box.lengths) / edge
    counts = [round(length / h) for length in box.lengths]
    places = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, d)
    centers = h * (places + 0.5) + 0.04 * h * (rng.random(places.shape) - 0.5)
    keep = rng.random(len(centers)) >= voids
    return ParticlePacking(centers[keep], 0.51 * h * (1.0 + 0.02 * (rng.random(keep.sum()) - 0.5)), box)


def cases():
    """Name, packing and rule: walls and periods, with and without dead ends, clusters that do not span, tiny boxes."""
    for d, edge in ((2, 17), (3, 8)):
        for periodic in ((True,) * d, (False,) * d, (False,) + (True,) * (d - 1)):
            box = Box((1.0,) * d, periodic)
            for voids in (0.0, 0.35):
                packing = shaken_lattice(box, edge, voids, 3)
                for rule in ("bonded", "overlap"):
                    yield f"{d}D periodic {box.periodic_axes or 'none'}, voids {voids}, {rule}", packing, rule
    yield "2D long", shaken_lattice(Box((4.0, 1.0), (True, False)), 6, 0.1, 7), "radius"
    yield "2D below percolation", shaken_lattice(Box((1.0, 1.0), (True, True)), 20, 0.6, 5), "overlap"
    yield "3D below percolation", shaken_lattice(Box((1.0, 1.0, 1.0)), 8, 0.85, 5), "overlap"
    yield "2D row", shaken_lattice(Box((9.0, 1.0)), 1, 0.0, 7), "overlap"
    yield "2D of two columns", shaken_lattice(Box((1.0, 1.0), (True, True)), 2, 0.0, 9), "overlap"
    yield "3D of two layers", shaken_lattice(Box((1.0, 1.0, 1.0), (True, True, True)), 2, 0.0, 9), "bonded"


def compare(ranks) -> list[dict[str, object]]:
    """How far every case is from the same case on one rank."""
    found = []
    for name, packing, rule in cases():
        contacts, gap = RULES[rule]
        kappa = np.random.default_rng(5).uniform(1.0, 3.0, packing.count)
        if packing.count < ranks.size:
            continue
        mine = np.random.default_rng(11).integers(ranks.size, size=packing.count) == ranks.rank  # any rank, any order
        digits = PrintedColumn(Digits(3, 3))  # as if the file printed three digits
        printed = PrintedColumns((digits,) * packing.dimension, digits)
        particles = packing.centers[mine], packing.radii[mine], kappa[mine]
        part = Scattered(packing.box, *particles, printed=printed)
        result, census = distributed_conductivity(part, contacts, Conduction(), ranks, gap=gap)
        if ranks.rank:
            continue
        network = contacts(packing)
        whole = element_conductivity(Medium(packing, kappa, network))
        scale = max(float(np.nanmax(whole.tensor)), 1e-300)
        doubt = doubtful_contacts(ParticleTable(packing, printed=printed), gap)
        counts = network.count, [network.walls_of(axis).size for axis in range(packing.dimension)]
        found.append(
            {
                "name": name,
                "error": float(np.nanmax(np.abs(result.tensor - whole.tensor))) / scale,
                "same_gaps": bool((np.isnan(result.tensor) == np.isnan(whole.tensor)).all()),
                "same_spans": result.spans == whole.spans,
                "spans": result.spans,
                "unknowns": [result.unknowns, whole.unknowns],
                "contacts": [[census.contacts, census.wall_contacts.tolist()], [counts[0], counts[1]]],
                "particles": [census.particles, packing.count],
                "doubts": [_doubts(census.doubt), _doubts(doubt)],
                "density": [census.density, packing.density],
                "model_error": [result.model_error, whole.model_error],
                "energy_error": result.relative_energy_error,
            }
        )
    return found


def _doubts(doubt: Doubt | None) -> list[int]:
    return [0, 0] if doubt is None else [doubt.pairs, doubt.wall_pairs]


def refusals(ranks) -> list[list[str]]:
    """The error that every rank has where one particle, or one place, is wrong."""
    box, found = Box((1.0, 1.0)), []
    whole = shaken_lattice(box, 10, 0.0, 3)
    twice = np.append(whole.radii[:-1], 4.0 * whole.radii[-1])
    for centers, radii, kappa in (
        (whole.centers, np.where(np.arange(whole.count) == 7, -1.0, whole.radii), 1.0),
        (np.where(np.arange(whole.count)[:, None] == 7, 1.5, whole.centers), whole.radii, 1.0),
        (whole.centers, twice, 1.0),
        (whole.centers, whole.radii, 0.0),
    ):
        mine = slice(ranks.rank, None, ranks.size)
        part = Scattered(box, centers[mine], radii[mine], np.full(radii[mine].size, kappa))
        try:
            distributed_conductivity(part, overlap_contacts, Conduction(), ranks)
            error = "none"
        except EtcError as raised:
            error = str(raised)
        found.append(ranks.share(error))
    return found


def main() -> None:
    ranks = connect()
    found = {"cases": compare(ranks), "refusals": refusals(ranks)}
    if ranks.rank == 0:
        json.dump(found, sys.stdout)
    ranks.close()


if __name__ == "__main__":
    main()
