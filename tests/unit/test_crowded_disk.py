"""A disk with very many contacts: the cost of an element grows with their cube, so there is a limit."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.engines.dtem.element import LARGEST_ELEMENT, packed_starts
from etc_engine.errors import GeometryError
from etc_engine.medium.medium import Medium
from etc_engine.medium.rules import overlap_contacts
from etc_engine.packing.particles import ParticlePacking
from etc_engine.realization import effective_conductivity


def star(m: int) -> Medium:
    """One disk amid a ring of m small ones that overlap it and their neighbours."""
    small = np.sin(np.pi / m) / (1 - np.sin(np.pi / m)) * 1.0005
    angle = 2 * np.pi * np.arange(m) / m
    ring = (1 + 0.9995 * small) * np.column_stack([np.cos(angle), np.sin(angle)])
    length = 2 * (1 + 2 * small) * 0.9999
    packing = ParticlePacking(
        np.vstack([[0.0, 0.0], ring]) + length / 2, np.r_[1.0, np.full(m, small)], Box((length, length))
    )
    return Medium(packing, 1.0, overlap_contacts(packing))


def test_many_contacts_are_solved_and_more_are_refused_by_name():
    element = effective_conductivity(star(200), axes=(0,)).tensor[0, 0]
    assert 0.0 < element < 1.0
    crowded = star(LARGEST_ELEMENT + 1)
    with pytest.raises(GeometryError, match=r"particle 0 has 2001 contacts .* use the engine pipe"):
        effective_conductivity(crowded, axes=(0,))
    assert effective_conductivity(crowded, engine="pipe", axes=(0,)).tensor[0, 0] > 0.0


def test_the_limit_is_of_rows():
    assert packed_starts(np.array([0, LARGEST_ELEMENT])).tolist() == [0, LARGEST_ELEMENT**2]
    with pytest.raises(GeometryError):
        packed_starts(np.array([0, 3, LARGEST_ELEMENT + 4]))
