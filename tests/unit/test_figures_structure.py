"""The picture of a packing's structure shows the numbers it should."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.output.figures import draw_structure, png
from etc_engine.packing import neighbor_pairs
from etc_engine.packing.particles import ParticlePacking


def panels(figure):
    return {axes.get_title(): axes for part in figure.subfigs for axes in part.axes}


def test_a_crystal_of_disks_is_drawn_with_its_known_structure(hexagonal):
    """Six contacts each, directions every 60 degrees, no overlaps, g(r) zero below contact."""
    packing = hexagonal(6, 4)
    drawn = panels(draw_structure(packing))
    bars = [bar.get_height() for bar in drawn["coordination, mean 6.000"].patches]
    assert bars == [0.0] * 6 + [1.0]
    assert "contacts are points" in drawn["contact half-angles"].texts[0].get_text()
    rose = drawn["contact directions (dashed: uniform)"].patches
    assert sum(bar.get_height() > 0.0 for bar in rose) == 6
    distances, g = drawn["pair correlation of the centres"].lines[0].get_data()
    assert g[distances < 0.95].max() == 0.0
    assert g[np.argmin(np.abs(distances - 1.0))] > 5.0
    s2 = drawn["two-point probability of the solid"].lines[0].get_ydata()
    assert s2[0] == pytest.approx(np.pi / np.sqrt(12.0), abs=2e-3)
    words = [text.get_text() for text in drawn[""].texts]
    assert words[words.index("fabric eigenvalues") + 1] == "0.500 0.500"
    assert words[words.index("below 3 contacts") + 1] == "0.0 % of the particles"
    assert words[words.index("largest cluster") + 1] == "100.0 %"


def test_overlapping_disks_show_their_half_angles():
    packing = ParticlePacking([[0.3, 0.5], [0.7, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    drawn = panels(draw_structure(packing))
    assert "contact half-angles, mean 36.87°" in drawn  # cos = 0.2 / 0.25


def test_spheres_are_seen_along_z_with_statistics_in_space():
    edge = 4
    grid = np.stack(np.meshgrid(*[np.arange(edge)] * 3), axis=-1).reshape(-1, 3) + 0.5
    packing = ParticlePacking(grid, np.full(len(grid), 0.5), Box((edge,) * 3, (True,) * 3))
    assert neighbor_pairs(packing).count == 3 * edge**3
    figure = draw_structure(packing)
    drawn = panels(figure)
    assert any(title.endswith("seen along z") for title in drawn)
    assert drawn["coordination, mean 6.000"].patches[6].get_height() == 1.0
    assert drawn["two-point probability of the solid"].lines[0].get_ydata()[0] == pytest.approx(np.pi / 6.0, abs=5e-3)
    assert png(figure)[:4] == b"\x89PNG"


@pytest.mark.parametrize("lengths", [(1.0, 1.0), (1.0, 0.2), (1.0, 2.0, 1.0)])
def test_a_lone_particle_has_a_picture_too(lengths):
    packing = ParticlePacking([[0.5, 0.1, 0.5][: len(lengths)]], [0.1], Box(lengths))
    drawn = panels(draw_structure(packing))
    assert drawn["pair correlation"].texts[0].get_text() == "one particle only"
    assert drawn["contact directions"].texts[0].get_text() == "no contacts"
