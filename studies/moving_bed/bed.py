"""A slowly sheared bed of disks with a prescribed motion: ``python bed.py bed.dump``

The box is periodic along x, with walls at the bottom and the top. Every frame

1. moves each disk by the linear profile dx = strain (y - H/2),
2. pushes pairs apart that overlap by more than ``OVERLAP`` mean radii, each disk by half of the excess, and disks out
   of the walls, ``SWEEPS`` times.

The result is a dense bed whose disks pass each other, with contacts that open and close.
"""

from __future__ import annotations

import sys

import numpy as np

from etc_engine import Box, PackingSpec, ParticlePacking, pack, parse_radii
from etc_engine.packing.neighbors import neighbor_pairs
from etc_engine.particle_files.dumps import write_trajectory
from etc_engine.particle_files.trajectory import Trajectory

COUNT, DENSITY = 100, 0.8
LENGTHS = (1.0, 0.5)
OVERLAP, SWEEPS = 0.02, 60
STRAIN, FRAMES = 24.0, 2400
SEED = 20262


def sheared_bed(strain: float = STRAIN, frames: int = FRAMES, seed: int = SEED) -> Trajectory:
    """The bed at equal steps of strain; its times are the strains."""
    box = Box(LENGTHS, (True, False))
    spec = PackingSpec("lubachevsky-stillinger", parse_radii("uniform:0.8:1.2"), box, count=COUNT, density=DENSITY)
    packing = settle(pack(spec, np.random.default_rng(seed)))
    packings = [packing]
    for _ in range(frames):
        centers = packing.centers.copy()
        centers[:, 0] += strain / frames * (centers[:, 1] - 0.5 * box.lengths[1])
        packing = settle(ParticlePacking(centers, packing.radii, box))
        packings.append(packing)
    return Trajectory(np.linspace(0.0, strain, frames + 1), tuple(packings))


def settle(packing: ParticlePacking) -> ParticlePacking:
    """Disks that overlap, or reach into a wall, by more than is wanted are pushed apart."""
    radii, height = packing.radii, packing.box.lengths[1]
    depth = 0.5 * OVERLAP * radii
    for _ in range(SWEEPS):
        near = neighbor_pairs(packing)
        i, j = near.pairs.T
        excess = np.maximum(-near.gaps - OVERLAP * 0.5 * (radii[i] + radii[j]), 0.0)
        branch = packing.centers[j] + near.shifts * packing.box.lengths - packing.centers[i]
        push = (0.5 * excess / np.linalg.norm(branch, axis=1))[:, None] * branch
        centers = packing.centers.copy()
        np.add.at(centers, i, -push)
        np.add.at(centers, j, push)
        centers[:, 1] = np.clip(centers[:, 1], radii - depth, height - radii + depth)
        packing = ParticlePacking(centers, radii, packing.box)
    return packing


if __name__ == "__main__":
    write_trajectory(sys.argv[1], sheared_bed(), timestep=STRAIN / FRAMES)
