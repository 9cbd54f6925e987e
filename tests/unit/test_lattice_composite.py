"""Composites on a lattice: fitted seeds, phases, exact arrays of spheres, interfaces, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.engines.lattice.fitted import fitted_seeds
from etc_engine.engines.lattice.homogenize import homogenize_lattice, medium_lattice
from etc_engine.engines.lattice.phases import find_phases, phase_conductivity
from etc_engine.engines.voxel import homogenize_voxel
from etc_engine.errors import EtcError, GeometryError, InputError
from etc_engine.medium.medium import Medium, Pores
from etc_engine.medium.phases import PORE
from etc_engine.models.arrays import fcc, simple_cubic
from etc_engine.packing.lubachevsky_stillinger import compress
from etc_engine.packing.particles import ParticlePacking
from etc_engine.structure.laguerre import laguerre_facets

CUBE = Box((1.0, 1.0, 1.0), (True, True, True))
CENTRE = [[0.5, 0.5, 0.5]]
FCC = [[0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]]


def spheres(centers, radius, conductivity=5.0, box=CUBE) -> Medium:
    return Medium(ParticlePacking(centers, np.full(len(centers), radius), box), conductivity, pores=Pores(1.0))


def rng(seed: int = 307) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize(
    "composite",
    [
        spheres(CENTRE, 0.33),
        spheres([[0.0, 0.1, 0.9]], 0.33),  # cut by the border, whole across it
        spheres([[0.1, 0.5, 0.5]], 0.3, box=Box((1.0, 1.0, 1.0))),  # cut off by a wall
        spheres([[0.3, 0.5, 0.5], [0.7, 0.5, 0.5]], 0.2),  # touching
        spheres([[0.35, 0.5, 0.5], [0.65, 0.5, 0.5]], 0.2),  # overlapping
    ],
    ids=["whole", "border", "wall", "touching", "overlapping"],
)
def test_fitted_cells_have_the_exact_volume(composite):
    seeds = fitted_seeds(composite.packing, 1500, rng())
    volumes = laguerre_facets(seeds.packing).volumes
    assert volumes[seeds.owner != PORE].sum() == pytest.approx(composite.solid_fraction, rel=1e-6)
    assert seeds.packing.count == pytest.approx(1500, rel=0.1)


def test_facets_between_a_pair_of_seeds_lie_on_the_sphere():
    seeds = fitted_seeds(spheres(CENTRE, 0.3).packing, 2000, rng())
    facets = laguerre_facets(seeds.packing)
    across = (seeds.owner[facets.pairs] == 0).sum(axis=1) == 1
    i = facets.pairs[across, 0]
    place = seeds.packing.centers[i] + facets.centroids[across] - CENTRE[0]
    area = facets.areas[across]
    # the planes touch a sphere that is smaller by kappa h^2 / a^2, half a per cent here, for the volume's sake
    assert np.linalg.norm(place, axis=1) @ area / area.sum() == pytest.approx(0.3 * (1.0 - 0.005), rel=2e-3)
    assert area.sum() == pytest.approx(4.0 * np.pi * 0.3**2, rel=0.02)


@pytest.mark.parametrize("contrast", [0.0, 0.01, 2.0, 100.0, np.inf])
@pytest.mark.parametrize("boundary", ["periodic", "walls"])
def test_simple_cubic_array_is_met(contrast, boundary):
    made = homogenize_lattice(spheres(CENTRE, 1 / 3, contrast), rng=rng(), particles=3000, boundary=boundary)
    exact = float(simple_cubic(1.0, contrast, 4.0 * np.pi / 81.0))
    assert np.diag(made.tensor) == pytest.approx(exact, rel=1.5e-3)
    assert made.model_error < 6e-3
    assert made.solid_fraction == pytest.approx(4.0 * np.pi / 81.0, rel=2e-6)


def test_face_centred_cubic_array_converges_with_order_two():
    exact = float(fcc(1.0, 50.0, 4 * 4.0 / 3.0 * np.pi * 0.25**3))
    errors = [
        abs(np.trace(homogenize_lattice(spheres(FCC, 0.25, 50.0), rng=rng(), particles=n).tensor) / 3.0 / exact - 1.0)
        for n in (1500, 12_000)
    ]
    assert errors[1] < 1.5e-3
    assert errors[1] < 0.5 * errors[0]  # half the spacing


@pytest.mark.parametrize(("contrast", "boundary"), [(7.7, "walls"), (0.05, "periodic")])
def test_random_spheres_conduct_as_by_fft(contrast, boundary):
    """An independent method under the same conditions; both are within their error estimates."""
    packing = compress(np.ones(8), CUBE, rng(31), density=0.3).packing
    composite = Medium(packing, contrast, pores=Pores(1.0))
    lattice = homogenize_lattice(composite, rng=rng(), particles=8000, boundary=boundary)
    fft = homogenize_voxel(composite, resolution=32, boundary=boundary)
    difference = np.abs(np.diag(lattice.tensor) / np.diag(fft.tensor) - 1.0).max()
    assert difference < 6e-3
    assert difference < lattice.model_error + fft.model_error


@pytest.mark.parametrize("boundary", ["periodic", "walls"])
@pytest.mark.parametrize("transmission", ["laguerre", "contact"])
def test_perfect_conductors_that_join_across_the_cell_are_refused(boundary, transmission):
    joined = spheres(CENTRE, 0.55, np.inf)
    with pytest.raises(GeometryError, match=r"join across the cell along x .* give them a finite conductivity"):
        homogenize_lattice(joined, rng=rng(), particles=800, boundary=boundary, transmission=transmission)


def test_perfect_conductors_that_join_in_pairs_only_are_solved():
    pair = spheres([[0.5, 0.5, 0.4], [0.5, 0.5, 0.6]], 0.2, np.inf)
    made = homogenize_lattice(pair, rng=rng(), particles=1000, estimate_error=False)
    assert 1.0 < made.tensor[0, 0] < made.tensor[2, 2] < 10.0


def test_a_matrix_of_inclusions_is_homogeneous():
    made = homogenize_lattice(spheres(CENTRE, 0.3, 1.0), rng=rng(), particles=600, tolerance=1e-12)
    np.testing.assert_allclose(made.tensor, np.eye(3), atol=1e-9)
    assert made.model_error < 1e-9


def test_interface_resistance_acts_like_a_lesser_inclusion():
    """To the dipole that governs a dilute array, k2 becomes k2 / (1 + k2 r / a) (Hasselman and Johnson 1987)."""
    a, r = 0.2, 0.05
    made = homogenize_lattice(spheres(CENTRE, a, 5.0), rng=rng(), particles=6000, interface_resistance=r)
    exact = float(simple_cubic(1.0, 5.0 / (1.0 + 5.0 * r / a), 4.0 / 3.0 * np.pi * a**3))
    bare = float(simple_cubic(1.0, 5.0, 4.0 / 3.0 * np.pi * a**3))
    assert abs(np.trace(made.tensor) / 3.0 - exact) < 0.03 * abs(bare - exact)


def test_an_infinite_interface_resistance_insulates():
    sealed = homogenize_lattice(spheres(CENTRE, 0.3, 5.0), rng=rng(), particles=1000, interface_resistance=1e9)
    void = homogenize_lattice(spheres(CENTRE, 0.3, 0.0), rng=rng(), particles=1000)
    np.testing.assert_allclose(sealed.tensor, void.tensor, atol=1e-6)


def test_what_others_cover_does_not_count():
    nested = Medium(ParticlePacking(CENTRE * 2, [0.3, 0.15], CUBE), [5.0, 1000.0], pores=Pores(1.0))
    made = homogenize_lattice(nested, rng=rng(), particles=1000)
    assert made.solid_fraction == pytest.approx(4.0 / 3.0 * np.pi * 0.027, rel=2e-6)
    assert np.diag(made.tensor) == pytest.approx(float(simple_cubic(1.0, 5.0, 0.036 * np.pi)), rel=0.005)


@pytest.mark.parametrize("box", [CUBE, Box((1.0, 1.0, 1.0))])
def test_inclusions_apart_in_an_insulating_matrix_conduct_nothing(box):
    isolated = Medium(ParticlePacking(CENTRE, [0.3], box), 5.0, pores=Pores(0.0))
    made = homogenize_lattice(isolated, rng=rng(), particles=600)
    assert np.abs(np.diag(made.tensor)).max() < 1e-9
    assert made.model_error == 0.0


@pytest.mark.parametrize(
    ("fraction", "contrast", "boundary", "particles"),
    [
        (0.5, 10.0, "periodic", 1200),
        (0.5, 100.0, "periodic", 1200),
        (0.4, 10.0, "walls", 1200),
        (0.3, 0.01, "walls", 2500),
    ],
)
def test_the_estimate_covers_gaps_that_the_lattice_does_not_resolve(fraction, contrast, boundary, particles):
    """Gaps of a quarter to a whole seed spacing: a coarser lattice alone differed by .4 to .8 of the error."""
    exact = float(simple_cubic(1.0, contrast, fraction))
    medium = spheres(CENTRE, float(np.cbrt(0.75 * fraction / np.pi)), contrast)
    made = homogenize_lattice(medium, rng=rng(), particles=particles, boundary=boundary)
    error = np.abs(np.diag(made.tensor) / exact - 1.0).max()
    assert error < made.model_error < 8.0 * error


@pytest.mark.slow
@pytest.mark.parametrize("contrast", [10.0, 100.0])
def test_the_estimate_covers_the_array_at_half_filling_with_5000_particles(contrast):
    exact = float(simple_cubic(1.0, contrast, 0.5))
    made = homogenize_lattice(spheres(CENTRE, float(np.cbrt(0.375 / np.pi)), contrast), rng=rng(), particles=5000)
    error = np.abs(np.diag(made.tensor) / exact - 1.0).max()
    assert error < made.model_error < 4.0 * error


def test_spheres_that_touch_in_insulating_pores_conduct_nothing():
    touching = Medium(ParticlePacking(CENTRE, [0.5], CUBE), 5.0, pores=Pores(0.0))
    made = homogenize_lattice(touching, rng=rng(), particles=600)
    assert np.diag(made.tensor).tolist() == [0.0] * 3
    assert made.model_error == 0.0


def test_the_contact_lattice_is_calibrated_on_itself():
    made = homogenize_lattice(spheres(CENTRE, 1 / 3, 1.0), rng=rng(), particles=1000, transmission="contact")
    np.testing.assert_allclose(np.diag(made.tensor), 1.0, rtol=1e-9)
    other = homogenize_lattice(spheres(CENTRE, 1 / 3, 5.0), rng=rng(), particles=4000, transmission="contact")
    assert np.trace(other.tensor) / 3.0 == pytest.approx(1.29213137, rel=0.03)
    assert 1e-4 < other.model_error < 0.1


def test_the_same_stream_gives_the_same_bits():
    first, second = (homogenize_lattice(spheres(CENTRE, 0.3), rng=rng(5), particles=500) for _ in range(2))
    np.testing.assert_array_equal(first.tensor, second.tensor)


def test_phases_of_spheres_voxels_and_functions_agree():
    box, points = Box((1.0, 1.0, 1.0)), rng().random((500, 3))
    packing = ParticlePacking(CENTRE, [0.3], box)

    def inside(x):
        return (np.linalg.norm(x - 0.5, axis=1) < 0.3).astype(int)

    grid = (np.stack(np.meshgrid(*[np.arange(80)] * 3, indexing="ij"), axis=-1) + 0.5) / 80
    voxels = inside(grid.reshape(-1, 3)).reshape(80, 80, 80)
    exact = inside(points)
    np.testing.assert_array_equal(find_phases(points, box, packing), exact)
    np.testing.assert_array_equal(find_phases(points, box, inside), exact)
    assert (find_phases(points, box, voxels) != exact).mean() < 0.03


def test_voxels_make_layers_that_conduct_as_exactly_as_they_are_drawn():
    lattice = medium_lattice(spheres(CENTRE, 0.1), 500, rng()).lattice
    layers = np.repeat([0, 1], 4).reshape(8, 1, 1)
    phase = find_phases(lattice.packing.centers, lattice.packing.box, layers)
    np.testing.assert_array_equal(phase, lattice.packing.centers[:, 0] > 0.5)


@pytest.mark.parametrize(
    ("work", "message"),
    [
        (lambda: phase_conductivity(np.array([0, 0]), [1.0, 2.0]), "phase 1 is empty"),
        (lambda: phase_conductivity(np.array([0, 1]), [1.0, -2.0]), "positive and finite"),
        (lambda: phase_conductivity(np.array([0, 3]), [1.0, 2.0]), "phase 3 has no conductivity"),
        (
            lambda: find_phases([[0.1] * 3], CUBE, np.zeros((2, 2), dtype=int)),
            r"three-dimensional array of integers, found shape \(2, 2\)",
        ),
        (lambda: find_phases([[0.1] * 3], CUBE, np.zeros((2, 2, 2))), "of integers"),
        (lambda: find_phases([[0.1] * 3], CUBE, lambda x: x[:, 0]), "whole phase number"),
        (lambda: spheres([[1.5, 0.5, 0.5]], 0.1, box=Box((1.0, 1.0, 1.0))), "outside the box"),
        (lambda: spheres(CENTRE, 0.3, -1.0), "the conductivity of a particle is -1: give a number"),
        (lambda: fitted_seeds(spheres(CENTRE, 0.01).packing, 500, rng()), "too small for 500 lattice particles"),
        (lambda: homogenize_lattice(spheres(CENTRE, 0.3), rng=rng(), particles=3), "at least 50 particles, found 3"),
        (lambda: homogenize_lattice(spheres(CENTRE, 0.3), rng=rng(), particles=5000.5), "at least 50 .* found 5000.5"),
        (
            lambda: homogenize_lattice(spheres(CENTRE, 0.3), rng=rng(), particles="9"),
            "at least 50 particles, found '9'",
        ),
        (lambda: homogenize_lattice(spheres(CENTRE, 0.3), rng=rng(), tolerance=0), "between 0 and 1, found 0"),
        (lambda: homogenize_lattice(spheres(CENTRE, 0.3), rng=7), "rng is a numpy.random.Generator, found int"),
        (lambda: homogenize_lattice(spheres(CENTRE, 0.3), rng=rng(), boundary="open"), "unknown boundary 'open'"),
        (lambda: homogenize_lattice(spheres(CENTRE, 0.3), rng=rng(), transmission="x"), "unknown transmission 'x'"),
        (
            lambda: homogenize_lattice(spheres([[0.5, 0.5]], 0.2, box=Box((1.0, 1.0))), rng=rng()),
            "three-dimensional, found particles in 2",
        ),
        (
            lambda: homogenize_lattice(spheres(CENTRE, 0.02), rng=rng(), particles=60, transmission="contact"),
            "inclusion 0 holds no lattice particle",
        ),
    ],
)
def test_bad_input_is_one_clear_line(work, message):
    with pytest.raises((InputError, GeometryError), match=message) as caught:
        work()
    assert isinstance(caught.value, EtcError)
    assert "\n" not in str(caught.value)
