"""ParticleTable: what a particle file holds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etc_engine.arrays import Floats, Ints
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.digits import PrintedColumns


@dataclass(frozen=True, eq=False)
class ParticleTable:
    """A packing, and the columns that its file holds beside positions and radii.

    Parameters
    ----------
    packing : ParticlePacking
    conductivity : ndarray, shape (n,) [W/(m K)], optional
        Conductivity of each particle.
    ids : ndarray of int64, shape (n,), optional
        Number by which the file names each particle.
    wrapped : int
        Centres outside the box that the user gave, wrapped into it along a periodic axis.
    types : ndarray of str, shape (n,), optional
        Type (kind, species, material) of each particle, as the file writes it.
    temperature : ndarray, shape (n,) [K], optional
        Temperature of each particle.
    origin : tuple of float [m]
        Low corner of the packing's box in the coordinates of the file; empty stands for zeros.
    printed : PrintedColumns, optional
        How finely the numbers are printed in a text file; None where they are exact.
    cropped : tuple of bool
        Whether each wall (0 and L along x, then along y, ...) was made by a crop; empty stands for none.
    notes : tuple of str
        What the reader decided and the user should know, a sentence each.
    """

    packing: ParticlePacking
    conductivity: Floats | None = None
    ids: Ints | None = None
    wrapped: int = 0
    types: NDArray[np.str_] | None = None
    temperature: Floats | None = None
    origin: tuple[float, ...] = ()
    printed: PrintedColumns | None = None
    cropped: tuple[bool, ...] = ()
    notes: tuple[str, ...] = ()
