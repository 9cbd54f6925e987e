"""The independent check that particles do not overlap each other or the walls."""

from __future__ import annotations

import numpy as np

from etc_engine.errors import PackingError
from etc_engine.packing.neighbors import neighbor_pairs
from etc_engine.packing.particles import ParticlePacking

ALLOWED_OVERLAP = 1e-10
"""Largest overlap, in mean diameters of the pair, that a packing of hard particles may show."""


def largest_overlap(packing: ParticlePacking) -> float:
    """Largest overlap of a pair in units of its mean diameter, or of a particle with a wall in its diameter.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> packing = ParticlePacking([[0.25, 0.5], [0.74, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    >>> round(largest_overlap(packing), 3)
    0.02
    """
    pairs = neighbor_pairs(packing)
    i, j = pairs.pairs.T
    overlaps = [np.zeros(1), -pairs.gaps / (packing.radii[i] + packing.radii[j])]
    for axis, length in enumerate(packing.box.lengths):
        if not packing.box.periodic[axis]:
            position = packing.centers[:, axis]
            inside = np.minimum(position, length - position)
            overlaps.append((packing.radii - inside) / (2.0 * packing.radii))
    return float(np.concatenate(overlaps).max())


def check_no_overlap(packing: ParticlePacking) -> None:
    """Raise PackingError if hard particles overlap by more than rounding."""
    found = largest_overlap(packing)
    if found > ALLOWED_OVERLAP:
        raise PackingError(
            f"the packing made has an overlap of {found:.2g} diameters (allowed: {ALLOWED_OVERLAP:g}): "
            "this is a fault of the packer, please report it with its seed",
            reached=packing.density,
        )
