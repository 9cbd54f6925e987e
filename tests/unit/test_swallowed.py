"""Particles inside each other are refused by every rule that finds its pairs by distance."""

from __future__ import annotations

import pytest

from etc_engine import Box, ParticlePacking, bonded_contacts
from etc_engine.errors import GeometryError
from etc_engine.medium.rules import coordination_contacts, radius_contacts

RULES = {
    "bonded": lambda packing: bonded_contacts(packing, 0.1),
    "radius": lambda packing: radius_contacts(packing, 0.05),
    "coordination": lambda packing: coordination_contacts(packing, 0.1, 1.0),
}


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(
    ("apart", "radii", "words"),
    [(0.0, (0.3, 0.3), "one lies inside the other"), (0.1, (0.5, 0.3), "inside"), (0.3, (0.5, 0.3), "behind")],
)
def test_swallowed_particles_are_refused(rule, dimension, apart, radii, words):
    centers = [[0.5] * dimension, [0.5 + apart] + [0.5] * (dimension - 1)]
    with pytest.raises(GeometryError, match=words):
        RULES[rule](ParticlePacking(centers, radii, Box((1.0,) * dimension)))
