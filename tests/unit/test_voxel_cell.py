"""The cell problem on voxels: exact laminates, dualities, invariants, and the two solvers against each other."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from etc_engine.box import Box
from etc_engine.engines.voxel import Scheme, homogenize_voxel, solve_cell, voxelize
from etc_engine.engines.voxel.cell import _solve_fluxes
from etc_engine.engines.voxel.conductivity import voxel_conductivity
from etc_engine.engines.voxel.green import GREEN_OPERATORS, gradient_projection
from etc_engine.errors import ConvergenceError, InputError
from etc_engine.medium.medium import Medium, Pores
from etc_engine.models.arrays import square_array
from etc_engine.models.bounds import parallel, series
from etc_engine.packing.particles import ParticlePacking

CELL_2D, CELL_3D = (1.0, 0.7), (1.0, 0.8, 0.6)


def random_image(seed: int, shape: tuple[int, ...], phases=(1.0, 3.0, 20.0)) -> np.ndarray:
    return np.random.default_rng(seed).choice(phases, size=shape)


@pytest.mark.parametrize("solver", ["cg", "eyre-milton"])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_layers_conduct_in_parallel_along_and_in_series_across(solver, axis):
    thickness = np.array([1.0, 4.0, 9.0, 1.0, 2.0, 4.0])
    image = np.broadcast_to(np.moveaxis(thickness[:, None, None], 0, axis), [6 if a == axis else 4 for a in range(3)])
    tensor = solve_cell(image, CELL_3D, scheme=Scheme(solver=solver, tolerance=1e-11)).tensor
    exact = np.full(3, thickness.mean())
    exact[axis] = 1.0 / (1.0 / thickness).mean()
    assert tensor == pytest.approx(np.diag(exact), rel=1e-9, abs=1e-9)


def test_the_two_solvers_solve_the_same_equations():
    image = random_image(5, (12, 10, 9))
    for green in GREEN_OPERATORS:
        cg = solve_cell(image, CELL_3D, scheme=Scheme(green=green, tolerance=1e-12))
        em = solve_cell(image, CELL_3D, scheme=Scheme(solver="eyre-milton", green=green, tolerance=1e-12))
        assert cg.tensor == pytest.approx(em.tensor, abs=1e-10)
        assert cg.iterations < 0.7 * em.iterations  # the energy converges twice as fast as the field


def test_conjugate_gradients_stop_at_the_error_asked_for():
    """Diagonal and off-diagonal components alike: both are energies."""
    image = random_image(6, (16, 12, 10))
    truth = solve_cell(image, CELL_3D, scheme=Scheme(tolerance=1e-13)).tensor
    for tolerance in (1e-3, 1e-5, 1e-7):
        found = solve_cell(image, CELL_3D, scheme=Scheme(tolerance=tolerance))
        error = np.abs(found.tensor - truth).max() / truth[0, 0]
        assert error < tolerance
        assert found.solver_error < tolerance


def test_eyre_milton_falls_at_its_theoretical_rate():
    """At contrast 7.7 by (sqrt(c) - 1)/(sqrt(c) + 1) = 0.470 a step: 25 to 28 steps to 1e-8."""
    x = (np.arange(48) + 0.5) / 48 - 0.5
    image = np.where(x[:, None] ** 2 + x**2 < 0.3 / np.pi, 7.7, 1.0)
    assert 25 <= solve_cell(image, (1.0, 1.0), scheme=Scheme(solver="eyre-milton")).iterations <= 28


def two_phases(image: np.ndarray, one: float, other: float) -> np.ndarray:
    return np.where(image == 1.0, one, other)


def test_keller_duality_in_the_plane_holds_in_the_limit_of_fine_voxels():
    """K(1/k) = R K(k) R^T / det K(k) for every image of the plane; its voxels alone spoil that, less the finer."""
    blocks = random_image(7, (6, 6), (1.0, 3.0))
    defects = []
    for refine in (8, 16, 32):
        image = np.kron(blocks, np.ones((refine, refine)))
        there, back = (solve_cell(k, (1.0, 1.0)).tensor for k in (image, 1.0 / image))
        turned = back[1, 1] - back[0, 1] ** 2 / back[0, 0]  # of the plane turned by 90 degrees, 1/(K^-1)_xx
        defects.append(abs(there[0, 0] * turned - 1.0))
    assert defects[-1] < 2e-3
    assert defects[2] < defects[1] < defects[0]


def test_insulators_and_perfect_conductors_are_dual_in_the_plane():
    x = (np.arange(64) + 0.5) / 64 - 0.5
    disk = x[:, None] ** 2 + x**2 < 0.3 / np.pi
    hole = solve_cell(np.where(disk, 0.0, 1.0), (1.0, 1.0)).tensor[0, 0]
    metal = solve_cell(np.where(disk, np.inf, 1.0), (1.0, 1.0)).tensor[0, 0]
    assert hole * metal == pytest.approx(1.0, abs=1e-4)


def test_fluxes_through_resistivities_are_the_same_discrete_problem():
    """The space of gradients and its complement: both sides give one tensor at every contrast."""
    image = random_image(8, (8, 6, 8), (1.0, 1.0, 2.0))
    image[2:5, 1:4, 3:6] = 50.0
    spacing = tuple(length / n for length, n in zip(CELL_3D, image.shape, strict=True))
    projection = gradient_projection(image.shape, spacing)
    fluxes, _ = _solve_fluxes(voxel_conductivity(image), projection, (0, 1, 2), Scheme(tolerance=1e-13, limit=500))
    assert fluxes == pytest.approx(
        solve_cell(image, CELL_3D, scheme=Scheme(tolerance=1e-13)).tensor, rel=1e-9, abs=1e-9
    )


def test_perfect_conductors_are_the_limit_of_good_ones():
    """The conductivity approaches its limit like 1/contrast."""
    image = random_image(8, (8, 6, 8), (1.0, 1.0, 2.0))
    image[2:5, 1:4, 3:6] = np.inf
    perfect = solve_cell(image, CELL_3D).tensor[0, 0]
    rest = [
        perfect - solve_cell(np.where(np.isinf(image), k, image), CELL_3D, scheme=Scheme(tolerance=1e-12)).tensor[0, 0]
        for k in (1e3, 1e4)
    ]
    assert rest[0] / rest[1] == pytest.approx(10.0, rel=0.02)


def test_walls_of_a_symmetric_image_are_invisible_and_layers_stay_exact():
    x = np.abs((np.arange(12) + 0.5) / 12 - 0.5)
    image = np.where(x[:, None, None] + x[:, None] + x < 0.5, 8.0, 1.0)
    free, walled = (
        solve_cell(image, (1.0, 1.0, 1.0), boundary=b, scheme=Scheme(tolerance=1e-11)) for b in ("periodic", "walls")
    )
    assert np.diag(walled.tensor) == pytest.approx(np.diag(free.tensor), rel=1e-9)
    assert np.isnan(walled.tensor[~np.eye(3, dtype=bool)]).all()


def mirrored(image: np.ndarray) -> np.ndarray:
    """An image of tensors and its mirror images, in a cell twice as long along every axis."""
    d = image.shape[-1]
    for axis in range(d):
        sign = np.where(np.arange(d) == axis, -1.0, 1.0)
        image = np.concatenate((image, np.flip(image, axis) * np.outer(sign, sign)), axis=axis)
    return image


@pytest.mark.parametrize("green", GREEN_OPERATORS)
@pytest.mark.parametrize("shape", [(6, 7), (4, 5, 6)])
def test_walls_are_the_periodic_cell_of_the_mirror_images(shape, green):
    """Sines and cosines on the cell against the complex transform of 2^d cells, with anisotropic voxels."""
    d = len(shape)
    factors = np.random.default_rng(9).uniform(-1.0, 1.0, (*shape, d, d))
    image = factors @ np.swapaxes(factors, -1, -2) + 0.2 * np.eye(d)
    lengths = CELL_3D[:d]
    walled = solve_cell(image, lengths, boundary="walls", scheme=Scheme(green=green, tolerance=1e-12))
    whole = solve_cell(
        mirrored(image), [2.0 * length for length in lengths], scheme=Scheme(green=green, tolerance=1e-12)
    )
    assert np.diag(walled.tensor) == pytest.approx(np.diag(whole.tensor), rel=1e-10)
    assert walled.iterations == pytest.approx(whole.iterations, abs=2)


@pytest.mark.parametrize("value", [0.0, np.inf])
def test_walls_with_insulators_and_perfect_conductors(value):
    image = random_image(15, (8, 9), (1.0, 4.0))
    image[2:5, 3:6] = value
    walled = solve_cell(image, CELL_2D, boundary="walls", scheme=Scheme(tolerance=1e-11)).tensor
    doubled = np.concatenate((image, image[::-1]), axis=0)
    doubled = np.concatenate((doubled, doubled[:, ::-1]), axis=1)
    whole = solve_cell(doubled, (2.0, 1.4), scheme=Scheme(tolerance=1e-11)).tensor
    assert np.diag(walled) == pytest.approx(np.diag(whole), rel=1e-8)


def test_kept_gradients_have_the_mean_asked_for_and_carry_the_flux():
    image = random_image(10, (10, 8))
    result = solve_cell(image, CELL_2D, keep_gradients=True, scheme=Scheme(tolerance=1e-13))
    for axis, gradient in enumerate(result.gradients):
        assert gradient.mean(axis=(1, 2)) == pytest.approx(np.eye(2)[axis], abs=1e-12)
        flux = (image * gradient).mean(axis=(1, 2))
        assert flux == pytest.approx(result.tensor[:, axis], rel=1e-6, abs=1e-6)


def test_a_subset_of_axes_is_the_same_tensor():
    image = random_image(11, (8, 6, 10))
    every, some = solve_cell(image, CELL_3D), solve_cell(image, CELL_3D, axes=(1,))
    assert some.tensor[1, 1] == every.tensor[1, 1]
    assert np.isfinite(some.tensor).sum() == 1


def test_threads_do_not_change_a_bit():
    image = random_image(12, (24, 20, 18))
    one, two = (solve_cell(image, CELL_3D, scheme=Scheme(threads=n)).tensor for n in (1, 2))
    assert np.array_equal(one, two)


@given(
    st.integers(2, 9), st.integers(2, 9), st.integers(0, 2**16), st.sampled_from(GREEN_OPERATORS), st.floats(0.1, 10.0)
)
@settings(max_examples=25)
def test_scaling_symmetry_and_bounds_of_any_image(n1, n2, seed, green, factor):
    image = random_image(seed, (n1, n2), (1.0, 5.0))
    tensor = solve_cell(image, CELL_2D, scheme=Scheme(green=green, tolerance=1e-11)).tensor
    scaled = solve_cell(factor * image, CELL_2D, scheme=Scheme(green=green, tolerance=1e-11)).tensor
    assert scaled == pytest.approx(factor * tensor, rel=1e-8, abs=1e-8 * factor)
    turned = solve_cell(image.T, CELL_2D[::-1], scheme=Scheme(green=green, tolerance=1e-11)).tensor
    assert turned[::-1, ::-1] == pytest.approx(tensor, rel=1e-8, abs=1e-8)
    low, high = (model(1.0, 5.0, float((image == 5.0).mean())) for model in (series, parallel))
    values = np.linalg.eigvalsh(tensor)
    assert low * (1.0 - 1e-9) <= values[0]
    assert values[1] <= high * (1.0 + 1e-9)


@given(st.integers(0, 2**16), st.booleans(), st.sampled_from(GREEN_OPERATORS))
@settings(max_examples=20)
def test_the_projection_is_a_symmetric_projection(seed, odd, green):
    shape = (7, 5, 9) if odd else (6, 8, 4)
    rng = np.random.default_rng(seed)
    projection = gradient_projection(shape, (0.1, 0.2, 0.3), green)
    u, v = rng.standard_normal((2, 3, *shape))
    pu, pv = projection.onto_gradients(u), projection.onto_gradients(v)
    assert projection.onto_gradients(pu) == pytest.approx(pu, abs=1e-12)
    assert np.vdot(pu, v) == pytest.approx(np.vdot(u, pv), abs=1e-10)
    assert np.abs(pu.mean(axis=(1, 2, 3))).max() < 1e-14
    assert np.abs(projection.onto_gradients(projection.onto_fluxes(u))).max() < 1e-12


def test_a_rotated_gradient_is_that_of_corner_temperatures():
    """The range of the rotated projection: mean differences of the corner values of a voxel."""
    shape, step = (6, 5, 8), np.array([0.5, 0.25, 1.0])
    corners = np.random.default_rng(13).standard_normal(shape)
    gradient = []
    for axis in range(3):
        other = np.roll(corners, -1, axis)
        values = (other - corners) / step[axis]
        for across in {0, 1, 2} - {axis}:
            values = 0.5 * (values + np.roll(values, -1, across))
        gradient.append(values)
    projected = gradient_projection(shape, tuple(step)).onto_gradients(np.array(gradient))
    assert projected == pytest.approx(np.array(gradient), abs=1e-12)


def test_tensors_of_voxels_are_taken_as_they_are():
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    tensor = turn @ np.diag([5.0, 1.0]) @ turn.T
    uniform = np.broadcast_to(tensor, (4, 6, 2, 2))
    assert solve_cell(uniform, CELL_2D).tensor == pytest.approx(tensor, rel=1e-12)


@pytest.mark.parametrize(
    ("image", "options", "words"),
    [
        (np.ones(4), {}, "an image has the shape"),
        (np.ones((4, 1)), {}, "at least 2 voxels"),
        (-np.ones((4, 4)), {}, "must not be negative"),
        (np.full((4, 4), np.nan), {}, "found NaN"),
        (np.zeros((4, 4)), {}, "no voxel of the image conducts"),
        (np.full((4, 4), np.inf), {}, "conducts perfectly"),
        (np.diag([0.0, np.inf]), {}, "both insulators"),
        (np.eye(4), {"solver": "eyre-milton"}, "does not converge with insulators"),
        (1.0 / (np.eye(4) + 1e-300), {"solver": "eyre-milton"}, "does not converge"),
        (np.ones((4, 4)), {"solver": "sor"}, "unknown solver"),
        (np.ones((4, 4)), {"green": "staggered"}, "unknown Green operator"),
        (np.ones((4, 4)), {"boundary": "open"}, "unknown boundary"),
        (np.ones((4, 4)), {"tolerance": 0.0}, "tolerance"),
        (np.ones((4, 4)), {"threads": 0}, "at least one thread"),
        (np.ones((4, 4)), {"threads": 1.5}, "at least one thread"),
        (np.ones((4, 4)), {"tolerance": "small"}, "tolerance"),
        (np.ones((4, 4)), {"axes": (5,)}, "load axes of an image of 2 axes are different numbers from 0 to 1"),
        (np.ones((4, 4)), {"axes": (0, 0)}, "axes of an image"),
        (np.ones((4, 4)), {"axes": ()}, "axes of an image"),
        (np.ones((4, 4)), {"axes": "xy"}, "axes of an image"),
        (np.ones((4, 4)), {"axes": 0}, "axes of an image"),
        (np.ones((4, 4)), {"limit": 0}, "at least one iteration, found 0"),
        (np.ones((4, 4)), {"limit": "many"}, "at least one iteration"),
        (np.full((4, 4), "k"), {}, "must be numbers"),
        ([[1.0, 2.0], [1.0]], {}, "must be numbers"),
    ],
)
def test_bad_input_is_refused(image, options, words):
    options = dict(options)
    with pytest.raises(InputError, match=words):
        scheme = Scheme(**{key: options.pop(key) for key in Scheme.__dataclass_fields__ if key in options})
        solve_cell(image, CELL_2D, scheme=scheme, **options)


def test_lengths_must_fit_and_joined_perfect_conductors_are_refused():
    with pytest.raises(InputError, match="positive edge lengths"):
        solve_cell(np.ones((4, 4)), (1.0,))
    with pytest.raises(InputError, match="positive edge lengths"):
        solve_cell(np.ones((4, 4)), ("1", "b"))
    bars = np.ones((4, 4))
    bars[:, 1] = np.inf
    with pytest.raises(InputError, match="join across the cell along x"):
        solve_cell(bars, (1.0, 1.0))


def test_what_does_not_conduct_across_answers_zero():
    bars = np.ones((4, 4))
    bars[:, 1] = 0.0
    assert solve_cell(bars, (1.0, 1.0)).tensor == pytest.approx(np.diag([0.75, 0.0]), abs=1e-12)


@pytest.mark.parametrize("periodic", [True, False])
@pytest.mark.parametrize(("radius", "matrix", "inclusion"), [(0.55, 1.0, 0.0), (0.3, 0.0, 1.0), (0.3, 0.0, 1e7)])
def test_disks_that_cut_the_matrix_off_or_lie_apart_in_none_conduct_nothing(periodic, radius, matrix, inclusion):
    place = [[0.371, 0.417]] if periodic else [[0.5, 0.5]]
    disk = ParticlePacking(place, [radius], Box((1.0, 1.0), (periodic,) * 2))
    result = homogenize_voxel(Medium(disk, inclusion, pores=Pores(matrix)), resolution=32)
    assert np.diag(result.tensor).tolist() == [0.0, 0.0]
    assert result.model_error == 0.0


def test_small_conductivities_without_insulators_are_kept():
    layers = np.repeat([[1e-10], [1.0]], 4, axis=0) * np.ones(4)
    assert solve_cell(layers, (1.0, 1.0), scheme=Scheme(tolerance=1e-12)).tensor[0, 0] == pytest.approx(2e-10, rel=1e-6)


def test_too_few_iterations_are_an_error_with_its_history():
    with pytest.raises(ConvergenceError, match="Eyre-Milton") as caught:
        solve_cell(random_image(14, (8, 8)), (1.0, 1.0), scheme=Scheme(solver="eyre-milton", limit=3))
    assert len(caught.value.residuals) == 3
    with pytest.raises(ConvergenceError, match="conjugate gradients"):
        solve_cell(random_image(14, (8, 8)), (1.0, 1.0), scheme=Scheme(limit=3))


def test_a_contrast_too_large_for_the_iteration_is_called_so():
    image = random_image(16, (8, 8), (1.0, 1e9))
    with pytest.raises(ConvergenceError, match=r"contrast 1e\+09 is too large .*: give inf \(or 0\)"):
        solve_cell(image, (1.0, 1.0), scheme=Scheme(limit=3))


FAR = {1e2: 5e-3, 1e3: 2e-3, 1e4: 1.5e-3, 1e6: 1.5e-3, np.inf: 1.5e-3}
"""Error at 48 voxels by contrast; all laminates: 0.5, 1.6, 5, 8 %."""


@pytest.mark.parametrize("sign", [1, -1])
def test_the_square_array_is_met_up_to_perfect_contrast_and_grows_with_it(sign):
    disk = ParticlePacking([[0.371, 0.417]], [np.sqrt(0.5 / np.pi)], Box((1.0, 1.0), (True, True)))
    contrasts = np.array([50.0, 100.0, 130.0, 200.0, 400.0, 1e3, 3e3, 1e4, 1e6, np.inf])
    found = []
    for contrast in contrasts:
        k2 = contrast**sign
        k = homogenize_voxel(Medium(disk, k2, pores=Pores(1.0)), resolution=48, estimate_error=False).tensor[0, 0]
        assert k == pytest.approx(float(square_array(1.0, k2, 0.5)), rel=FAR.get(contrast, 6e-3))
        found.append(k)
    assert (sign * np.diff(found) > 0.0).all()


def test_laminates_remain_up_to_a_contrast_of_100_and_where_good_conductors_reach_through():
    box = Box((1.0, 1.0), (True, True))
    apart, joined = (Medium(ParticlePacking([[0.4, 0.4]], [r], box), 1e4, pores=Pores(1.0)) for r in (0.4, 0.55))
    near = Medium(apart.packing, 100.0, pores=Pores(1.0))
    isotropic = []
    for composite in (near, apart, joined):
        principal = voxelize(composite, 24).conductivity.principal
        isotropic.append(np.allclose(principal[:, 0], principal[:, 1], rtol=0.2))
    assert isotropic == [False, True, False]
