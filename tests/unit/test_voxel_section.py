"""Fields of a composite in a section and at points, and their picture."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.engines.voxel import Scheme, solve_cell
from etc_engine.engines.voxel.section import sample, solve_section, temperature_between_walls
from etc_engine.errors import InputError
from etc_engine.medium.medium import Medium, Pores
from etc_engine.output.figures.canvas import png
from etc_engine.output.figures.voxel import draw_section
from etc_engine.packing.particles import ParticlePacking


def disk(inclusion: float, radius: float = 0.3, periodic: bool = True) -> Medium:
    box = Box((1.0, 1.0), (periodic,) * 2)
    return Medium(ParticlePacking([[0.5, 0.5]], [radius], box), np.array(inclusion), pores=Pores(1.0))


def test_a_dilute_disk_has_the_uniform_flux_of_theory_inside():
    """A single disk in an infinite matrix: q = 2 k2/(k1 + k2) inside, to the order of its area fraction 0.8 %."""
    section = solve_section(disk(10.0, 0.05), resolution=160)
    middle = section.flux[section.fractions == 1.0]
    assert np.median(middle) == pytest.approx(20.0 / 11.0, rel=0.015)
    assert section.flux.shape == section.fractions.shape == (160, 160)


def test_temperatures_between_walls_of_layers_are_piecewise_linear():
    image = np.ones((8, 6))
    image[:, :3] = 3.0  # layers across y: gradients 0.5 and 1.5
    solved = solve_cell(
        image, (2.0, 1.2), boundary="walls", axes=(1,), keep_gradients=True, scheme=Scheme(tolerance=1e-12)
    )
    temperatures = temperature_between_walls(solved.gradients[0], 1, 1.2)
    exact = np.cumsum([0.05, 0.1, 0.1, 0.05 + 0.15, 0.3, 0.3])
    assert temperatures == pytest.approx(np.broadcast_to(exact, (8, 6)), abs=1e-9)


def test_temperatures_between_walls_are_antisymmetric_about_the_middle_of_a_symmetric_cell():
    solved = solve_cell(
        np.pad(np.full((6, 6), 7.0), 5, constant_values=1.0),
        (1.0, 1.0),
        boundary="walls",
        axes=(0,),
        keep_gradients=True,
        scheme=Scheme(tolerance=1e-12),
    )
    temperatures = temperature_between_walls(solved.gradients[0], 0, 1.0)
    assert temperatures + temperatures[::-1] == pytest.approx(np.ones((16, 16)), abs=1e-7)
    assert temperatures.min() > 0.0  # maximum principle


def test_samples_are_linear_between_voxels_and_constant_beyond_the_outermost_centres():
    x = (np.arange(10) + 0.5) / 10
    field = 2.0 * x[:, None] - 3.0 * x
    points = np.random.default_rng(41).uniform(0.05, 0.95, (20, 2))
    assert sample(field, points, (1.0, 1.0)) == pytest.approx(points @ [2.0, -3.0], abs=1e-12)
    assert sample(field, [[0.0, 0.5]], (1.0, 1.0)) == pytest.approx(2.0 * 0.05 - 1.5)


def test_the_picture_shows_inclusions_and_flux():
    figure = draw_section(solve_section(disk(5.0), resolution=24), "a caption")
    left, right = (axes for axes in figure.axes if axes.get_title())
    assert (left.get_title(), right.get_title()) == ("inclusions", "heat flux")
    shown = left.images[0].get_array()
    assert float(shown.mean()) == pytest.approx(0.09 * np.pi, abs=1e-12)
    assert figure.get_suptitle() == "a caption"
    assert png(figure)[:4] == b"\x89PNG"


def test_spheres_are_cut_where_they_fill_the_largest_area():
    box = Box((1.0, 1.0, 2.0), (True,) * 3)
    pair = ParticlePacking([[0.5, 0.5, 0.42], [0.5, 0.5, 1.4]], [0.35, 0.2], box)
    section = solve_section(Medium(pair, np.array(4.0), pores=Pores(1.0)), resolution=16)
    assert section.height == pytest.approx(0.42, abs=0.5 / 16)
    assert section.fractions.mean() == pytest.approx(np.pi * 0.35**2, abs=0.01)
    assert draw_section(section, "k").get_suptitle() == f"section at z = {section.height:.4g} m, k"


def test_spheres_are_cut_in_the_middle():
    box = Box((1.0, 1.0, 1.0), (True,) * 3)
    sphere = Medium(ParticlePacking([[0.5, 0.5, 0.5]], [0.35], box), np.array(4.0), pores=Pores(1.0))
    section = solve_section(sphere, resolution=16)
    assert section.fractions.mean() == pytest.approx(np.pi * 0.35**2, abs=0.01)


def test_perfect_conductors_have_no_picture_of_their_flux():
    with pytest.raises(InputError, match="finite conductivities"):
        solve_section(disk(np.inf), resolution=16)
