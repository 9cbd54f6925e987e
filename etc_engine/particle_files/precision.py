"""Precision of the input: contacts that the printed digits of a file do not decide."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.packing.neighbors import neighbor_pairs
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.table import ParticleTable

TANGENT = 1e-12
"""A printed gap below this part of the mean radius is meant to be zero: rounding would leave one of the last digit."""


@dataclass(frozen=True)
class Doubt:
    """Pairs and walls whose contact is not decided by the printed digits.

    Parameters
    ----------
    pairs, wall_pairs : int
        Pairs of particles, and of a particle and a wall, whose gap is within two steps of the threshold.
    step : float [m]
        Median of the step of these gaps.
    remedy : str
        What to do about the digits.
    """

    pairs: int
    wall_pairs: int
    step: float
    remedy: str

    def sentence(self, gap: float, *, bonded: bool) -> str:
        """The doubt in one line, for a contact rule with a threshold of ``gap`` mean radii."""
        parts = [f"{self.pairs} pairs of particles"] * bool(self.pairs)
        parts += [f"{self.wall_pairs} particles at walls"] * bool(self.wall_pairs)
        rule = f"the bond gap of {gap:g} mean radii" if bonded else "touching"
        wider = "a wider --bond-gap" if bonded else "--rule bonded with a --bond-gap wider than the step"
        return (
            f"the file prints too few digits to decide on {' and '.join(parts)}, which are within two printed steps "
            f"({self.step:.2g} m) of {rule}: the conductivity depends on their rounding; {self.remedy}, or use {wider}"
        )


def doubtful_contacts(
    table: ParticleTable,
    relative_gap: float = 0.0,
    *,
    counts: Callable[[Ints, Ints], Flags] | None = None,
    places: Floats | None = None,
) -> Doubt | None:
    r"""Contacts that the printed digits of the file do not decide.

    A contact is in doubt if its gap g is within two steps of the threshold, :math:`|g - g_t| \le 2 s`, where the
    step of a gap is that of its coordinates along the line of centres and of the radii, :math:`2 s = \sum_k |n_k|
    (s_{ik} + s_{jk}) + s_{R_i} + s_{R_j}`. Rounding changes a gap by at most s.

    Parameters
    ----------
    table : ParticleTable
    relative_gap : float
        Threshold of the contact rule, in mean radii of the pair: 0 for overlaps, the bond gap for bonds.
    counts : callable, optional
        (rows i, rows j) -> whether the pair counts; of a particle and a wall, i is j. All count by default.
    places : ndarray, shape (n, d), optional [m]
        Coordinates as the file prints them, where those of the packing are of periodic images.

    Returns
    -------
    Doubt or None
        None if the digits decide on every contact.

    Notes
    -----
    Gaps that are zero to all digits of the arithmetic are taken as meant: disks of a lattice touch by intention.
    """
    if table.printed is None:
        return None
    packing = table.packing
    steps, radius_steps = _steps(table, places)
    reach = 2.0 * (float(steps.sum(axis=1).max()) + float(radius_steps.max()))
    near = neighbor_pairs(packing, gap=reach, relative_gap=relative_gap)
    i, j = near.pairs.T
    lengths = np.asarray(packing.box.lengths)
    branches = packing.centers[j] + near.shifts * lengths - packing.centers[i]
    distances = np.linalg.norm(branches, axis=1)
    normals = np.abs(branches) / np.where(distances > 0.0, distances, 1.0)[:, None]
    two_steps = ((steps[i] + steps[j]) * normals).sum(axis=1) + radius_steps[i] + radius_steps[j]
    mean = 0.5 * (packing.radii[i] + packing.radii[j])
    doubtful = (np.abs(near.gaps - relative_gap * mean) <= two_steps) & (np.abs(near.gaps) > TANGENT * mean)
    rows = np.arange(packing.count)
    counted = np.ones(packing.count, dtype=np.bool_) if counts is None else counts(rows, rows)
    wall_steps = _wall_doubts(packing, steps, radius_steps, relative_gap, counted)
    if counts is not None:
        doubtful &= counts(i, j)
    if not doubtful.any() and not wall_steps.size:
        return None
    half = np.concatenate([0.5 * two_steps[doubtful], 0.5 * wall_steps])
    return Doubt(int(doubtful.sum()), int(wall_steps.size), float(np.median(half)), table.printed.remedy)


def _steps(table: ParticleTable, places: Floats | None) -> tuple[Floats, Floats]:
    """Printed step of each coordinate, shape (n, d), and of each radius, shape (n,) [m]."""
    packing, printed = table.packing, table.printed
    assert printed is not None
    if places is None:
        places = packing.centers + np.array(table.origin or (0.0,) * packing.dimension)
    columns = [printed.positions[axis].step(places[:, axis]) for axis in range(packing.dimension)]
    return np.stack(columns, axis=1), printed.radius.step(packing.radii)


def _wall_doubts(
    packing: ParticlePacking, steps: Floats, radius_steps: Floats, relative_gap: float, counted: Flags
) -> Floats:
    """Two steps of each gap between a particle and a wall that is in doubt."""
    found = [np.zeros(0)]
    for axis in np.flatnonzero(~np.array(packing.box.periodic)):
        two_steps = 2.0 * (steps[:, axis] + radius_steps)
        for distance in (packing.centers[:, axis], packing.box.lengths[axis] - packing.centers[:, axis]):
            gap = distance - packing.radii
            doubtful = np.abs(gap - relative_gap * packing.radii) <= two_steps
            found.append(two_steps[counted & doubtful & (np.abs(gap) > TANGENT * packing.radii)])
    return np.concatenate(found)
