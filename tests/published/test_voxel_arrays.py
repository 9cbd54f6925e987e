"""FFT homogenization of ordered arrays, against Rayleigh's exact solution.

Values to eight digits from the multipole expansion of Lord Rayleigh (1892, 10.1080/14786449208620364), carried to
convergence by Perrins et al. (1979, 10.1098/rspa.1979.0160, disks) and McPhedran and McKenzie (1978,
10.1098/rspa.1978.0020, spheres).
"""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.engines.voxel import Scheme, homogenize_voxel
from etc_engine.medium.medium import Medium, Pores
from etc_engine.models.arrays import simple_cubic, square_array
from etc_engine.packing.particles import ParticlePacking

SQUARE = [(0.1, 7.7, 1.16687750), (0.3, 2.0, 1.22229023), (0.3, 7.7, 1.60204759), (0.5, 7.7, 2.27600343)]
CUBIC = [(0.3, 7.7, 1.7967699), (0.4, 7.7, 2.2026725)]
SINGLE = {0.1: 0.81284529, 0.5: 0.90970452, 2.0: 1.12107514, 5.0: 1.29213137, 10.0: 1.39573484}
"""A sphere of a third of the edge, by contrast."""

OFF_CENTRE = (0.371, 0.417, 0.223)
"""A place that no symmetry of the grid favours."""


def array(d: int, radius: float, contrast: float) -> Medium:
    box = Box((1.0,) * d, (True,) * d)
    return Medium(ParticlePacking([OFF_CENTRE[:d]], [radius], box), contrast, pores=Pores(1.0))


def disk(fraction: float, contrast: float) -> Medium:
    return array(2, np.sqrt(fraction / np.pi), contrast)


def sphere(fraction: float, contrast: float) -> Medium:
    return array(3, np.cbrt(0.75 * fraction / np.pi), contrast)


@pytest.mark.parametrize(("fraction", "contrast", "exact"), SQUARE)
def test_square_array(fraction, contrast, exact):
    result = homogenize_voxel(disk(fraction, contrast), resolution=128)
    assert result.tensor == pytest.approx(exact * np.eye(2), rel=3e-4, abs=3e-4)
    assert abs(result.tensor[0, 0] / exact - 1.0) < result.model_error < 0.01
    assert result.solid_fraction == pytest.approx(fraction, abs=1e-14)


@pytest.mark.parametrize(("contrast", "exact"), SINGLE.items())
def test_a_sphere_of_a_third_of_the_edge_at_64(contrast, exact):
    """The goal of 0.03 % at 64 voxels an edge, for contrasts up to 10."""
    result = homogenize_voxel(array(3, 1.0 / 3.0, contrast), resolution=64)
    assert np.diag(result.tensor) == pytest.approx(exact, rel=3e-4)
    assert np.abs(np.diag(result.tensor) / exact - 1.0).max() < result.model_error < 0.01


@pytest.mark.parametrize(("fraction", "contrast", "exact"), CUBIC)
def test_simple_cubic_array_at_64(fraction, contrast, exact):
    """At 0.4 a gap of 5.5 voxels carries the heat: 0.032 %."""
    result = homogenize_voxel(sphere(fraction, contrast), resolution=64, estimate_error=False)
    assert np.diag(result.tensor) == pytest.approx(exact, rel=3e-4 if fraction < 0.35 else 3.5e-4)


@pytest.mark.parametrize("voxels", ["laminate", "binary"])
def test_observed_order_of_convergence(voxels):
    """First order, laminates with a fortieth of the constant; many places of the disk take out the luck of one grid."""
    sizes, errors = np.array([24, 48, 96, 192]), []
    rng = np.random.default_rng(31)
    exact = square_array(1.0, 7.7, 0.3)
    radius = np.sqrt(0.3 / np.pi)
    for n in sizes:
        error = []
        for _ in range(6):
            made = ParticlePacking([rng.random(2)], [radius], Box((1.0, 1.0), (True, True)))
            k = homogenize_voxel(
                Medium(made, 7.7, pores=Pores(1.0)), resolution=int(n), voxels=voxels, estimate_error=False
            ).tensor
            error.append(k[0, 0] / exact - 1.0)
        errors.append(np.sqrt(np.mean(np.square(error))))
    order = -np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert 0.8 < order < 1.6
    assert errors[-1] < (1e-4 if voxels == "laminate" else 3e-3)


def test_laminate_voxels_are_an_order_better_than_binary_ones():
    exact = 1.7967699
    laminate, binary = (
        homogenize_voxel(sphere(0.3, 7.7), resolution=48, voxels=v, estimate_error=False).tensor[0, 0] / exact - 1.0
        for v in ("laminate", "binary")
    )
    assert abs(laminate) < 0.1 * abs(binary)


def test_eyre_milton_and_the_continuous_operator_come_to_the_same():
    exact = 1.60204759
    em = homogenize_voxel(disk(0.3, 7.7), resolution=64, scheme=Scheme(solver="eyre-milton"))
    assert em.tensor[0, 0] == pytest.approx(exact, rel=3e-4)
    assert 25 <= em.iterations <= 28
    continuous = homogenize_voxel(
        disk(0.3, 7.7), resolution=64, estimate_error=False, scheme=Scheme(green="continuous")
    )
    assert continuous.tensor[0, 0] == pytest.approx(exact, rel=1e-3)


@pytest.mark.parametrize("contrast", [0.0, np.inf])
@pytest.mark.parametrize("fraction", [0.1, 0.3, 0.5])
def test_holes_and_perfect_conductors(fraction, contrast):
    """k(0) k(inf) = 1 exactly; k(inf) = 1.22222977, 1.86018831, 3.08019783."""
    exact = {0.1: 1.22222977, 0.3: 1.86018831, 0.5: 3.08019783}[fraction]
    exact = exact if contrast > 0.0 else 1.0 / exact
    result = homogenize_voxel(disk(fraction, contrast), resolution=96)
    assert result.tensor[0, 0] == pytest.approx(exact, rel=2e-3)
    assert abs(result.tensor[0, 0] / exact - 1.0) < result.model_error < 0.02


@pytest.mark.parametrize("contrast", [0.0, np.inf])
def test_spheres_that_insulate_or_conduct_perfectly(contrast):
    exact = float(simple_cubic(1.0, contrast, 0.3))
    result = homogenize_voxel(sphere(0.3, contrast), resolution=32, estimate_error=False, scheme=Scheme(tolerance=1e-6))
    assert result.tensor[0, 0] == pytest.approx(exact, rel=2e-3)
    if contrast > 0.0:
        assert exact == pytest.approx(2.3328845, abs=1e-7)


def test_walls_about_one_centred_sphere_are_the_array_too():
    box = Box((1.0, 1.0, 1.0))
    made = Medium(ParticlePacking([[0.5, 0.5, 0.5]], [1.0 / 3.0], box), 5.0, pores=Pores(1.0))
    result = homogenize_voxel(made, resolution=32, estimate_error=False)
    assert np.diag(result.tensor) == pytest.approx(SINGLE[5.0], rel=6e-4)
    assert np.isnan(result.tensor[0, 1])


@pytest.mark.parametrize(
    ("fraction", "contrast", "resolution"),
    [(0.6, np.inf, 64), (0.6, 0.0, 64), (0.3, 0.0, 96), (0.3, np.inf, 192), (0.3, 0.01, 128), (0.3, 100.0, 128)],
)
def test_the_estimate_covers_symmetric_arrays_whose_error_hardly_falls_between_grids(fraction, contrast, resolution):
    """A disk in the middle of the cell: twice the difference to half the resolution was .58 to .89 of the error."""
    exact = float(square_array(1.0, contrast, fraction))
    centred = ParticlePacking([[0.5, 0.5]], [np.sqrt(fraction / np.pi)], Box((1.0, 1.0), (True, True)))
    result = homogenize_voxel(Medium(centred, contrast, pores=Pores(1.0)), resolution=resolution)
    error = np.abs(np.diag(result.tensor) / exact - 1.0).max()
    assert error < result.model_error < 6.0 * error


@pytest.mark.parametrize("boundary", ["periodic", "walls"])
@pytest.mark.parametrize("d", [2, 3])
def test_disks_and_spheres_that_touch_in_insulating_pores_conduct_nothing(d, boundary):
    touching = Medium(ParticlePacking([[0.5] * d], [0.5], Box((1.0,) * d, (True,) * d)), 1.0, pores=Pores(0.0))
    result = homogenize_voxel(touching, resolution=16, boundary=boundary)
    assert np.diag(result.tensor).tolist() == [0.0] * d
    assert result.model_error == 0.0
    assert result.spans == (False,) * d
