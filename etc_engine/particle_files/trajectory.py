"""Trajectory: one set of particles at several times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from etc_engine.arrays import Floats, Ints
from etc_engine.errors import InputError
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.table import ParticleTable


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The same particles, row by row, in one box at increasing times.

    Parameters
    ----------
    times : ndarray, shape (f,) [s]
        When each packing is there, increasing.
    packings : tuple of ParticlePacking
        One per time, of the same number of particles in the same box.
    ids : ndarray of int64, shape (n,), optional
        Numbers of the particles; their rows by default.
    conductivity : ndarray, shape (n,), optional [W/(m K)]
        Conductivity of each particle, where its file gives it.
    tables : tuple of ParticleTable, optional
        What the file says of each frame, where the packings come from one.

    Raises
    ------
    InputError
        If there is no packing, the times do not increase, or particles or box are not the same throughout.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> places = [ParticlePacking([[x, 0.5]], [0.1], Box((1.0, 1.0))) for x in (0.3, 0.5)]
    >>> Trajectory([0.0, 2.0], places).count
    1
    """

    times: Floats
    packings: tuple[ParticlePacking, ...]
    ids: Ints | None = None
    conductivity: Floats | None = None
    tables: tuple[ParticleTable, ...] = ()

    def __post_init__(self) -> None:
        times, packings = np.array(self.times, dtype=np.float64), tuple(self.packings)
        if not packings or times.shape != (len(packings),):
            raise InputError(
                f"a trajectory needs one time per packing, found {times.size} times, {len(packings)} packings"
            )
        if not np.isfinite(times).all() or (np.diff(times) <= 0.0).any():
            late = int(np.flatnonzero(~(np.diff(times) > 0.0))[0]) + 1 if times.size > 1 else 0
            raise InputError(f"the times of a trajectory must increase, found {times[late]:g} at frame {late}")
        first = packings[0]
        for number, packing in enumerate(packings):
            if packing.count != first.count:
                raise InputError(
                    f"frame {number} holds {packing.count} particles, frame 0 {first.count}: all must stay"
                )
            same = np.allclose(packing.box.lengths, first.box.lengths, rtol=1e-9, atol=0.0)
            if not same or packing.box.periodic != first.box.periodic:
                raise InputError(f"frame {number} has another box than frame 0: {packing.box} instead of {first.box}")
        ids = np.arange(first.count) if self.ids is None else np.array(self.ids, dtype=np.int64)
        if ids.shape != (first.count,) or np.unique(ids).size != ids.size:
            raise InputError(f"{first.count} different ids are needed, found {np.unique(ids).size} of {ids.size}")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "packings", packings)
        object.__setattr__(self, "ids", ids)

    @property
    def count(self) -> int:
        """Number of particles."""
        return self.packings[0].count
