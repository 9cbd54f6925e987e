from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.engines.dtem.conductivity import conductivity_bounds, element_conductivity
from etc_engine.engines.dtem.exact.cut_disk import solve_cut_disk
from etc_engine.engines.dtem.exact.element import cut_chords, of_disk
from etc_engine.engines.dtem.exact.jumps import _least_extension, jump_energies
from etc_engine.engines.dtem.exact.lune import chord_points
from etc_engine.engines.dtem.exact.waves import chord_trace, chord_waves, temperature_at
from etc_engine.errors import InputError
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import bonded_contacts, overlap_contacts
from etc_engine.packing.particles import ParticlePacking
from etc_engine.realization import effective_conductivity

TRUTH = 0.2787774  # corner-graded finite elements between energy bounds 1e-7 apart


def bounds_of(network, modes, conductivity=1.0, **options):
    medium = medium_of(network, conductivity)
    return element_conductivity(medium, method="exact", modes=modes, axes=(0,), **options).bounds[0]


def test_bounds_contain_the_truth_of_the_twelve_particles_and_tighten(feng_particles):
    network = overlap_contacts(feng_particles)
    bounds = np.array([bounds_of(network, modes) for modes in range(1, 8)])
    assert (bounds[:, 0] < TRUTH + 1e-7).all()
    assert (bounds[:, 1] > TRUTH - 1e-7).all()
    widths = np.diff(bounds, axis=1)[:, 0]
    assert widths[2] < 1e-5
    assert widths[2] < 0.02 * widths[1] < 0.2 * widths[0]
    assert widths[-1] < 2e-8
    # every lower bound lies below every upper one
    assert bounds[:, 0].max() < bounds[:, 1].min()


@pytest.mark.parametrize("degrees", [3.0, 15.0, 25.0, 29.0])
def test_bounds_of_a_bonded_lattice_contain_the_converged_value(hexagonal, degrees):
    network = bonded_contacts(hexagonal(), np.radians(degrees))
    best = effective_conductivity(medium_of(network), method="exact", modes=10).tensor[0, 0]
    for modes in (1, 2, 3, 4, 6):
        low, high = bounds_of(network, modes)
        assert low < best < high


def test_bounds_of_random_disks_contain_the_converged_value():
    rng = np.random.default_rng(41)
    grid = np.stack(np.meshgrid(np.arange(5), np.arange(5), indexing="ij"), axis=-1).reshape(-1, 2) + 0.5
    for periodic in (False, True):
        packing = ParticlePacking(
            (grid + 0.08 * rng.uniform(-1, 1, grid.shape)) / 5,
            rng.uniform(0.53, 0.58, 25) / 5,
            Box((1.0, 1.0), (periodic, periodic)),
        )
        network, kappa = overlap_contacts(packing), rng.uniform(1.0, 5.0, 25)
        best = effective_conductivity(medium_of(network, kappa), method="exact", modes=9).tensor[0, 0]
        for modes in (1, 3, 5):
            low, high = bounds_of(network, modes, conductivity=kappa)
            assert low < best < high


@pytest.mark.parametrize("ratio", [3.0, 10.0, 30.0])
def test_strongly_unequal_disks_converge(ratio):
    """A large disk between two small ones that reach over the walls; their arcs are up to 34 degrees wide."""
    small = 0.5 / (ratio + 2.0)
    large = ratio * small
    radii = [1.2 * small, large, 1.2 * small]
    packing = ParticlePacking([[small, 0.5], [0.5, 0.5], [1 - small, 0.5]], radii, Box((1.0, 1.0)))
    network = overlap_contacts(packing)
    widths = [np.ptp(bounds_of(network, modes)) / bounds_of(network, modes)[0] for modes in (1, 3, 5)]
    assert widths[2] < 1e-5
    assert widths[2] < widths[1] < widths[0]


def test_bounds_scale_with_the_conductivity(feng_particles):
    network = overlap_contacts(feng_particles)
    np.testing.assert_allclose(bounds_of(network, 3, conductivity=7.0), 7.0 * bounds_of(network, 3), rtol=1e-12)


def test_contact_resistance_leaves_no_jump_in_the_mean():
    """A chain with wide resistances: the bounds close as without them."""
    chain = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    low, high = bounds_of(bonded_contacts(chain, 0.3).with_resistance(2.0), 4)
    assert 0.0 < high - low < 1e-6 * high


def test_other_methods_have_no_bounds(feng_particles):
    with pytest.raises(InputError, match="bounds are only available with method exact, found a solution by chord"):
        conductivity_bounds(effective_conductivity(medium_of(overlap_contacts(feng_particles)), axes=(0,)))


def test_nothing_that_spans_is_between_zero_and_zero():
    packing = ParticlePacking([[0.2, 0.5], [0.8, 0.5]], [0.2, 0.2], Box((1.0, 1.0)))
    assert bounds_of(bonded_contacts(packing, 0.1), 3).tolist() == [0.0, 0.0]


# --- the temperature behind them ------------------------------------------------------------------


def loaded_disk(solution, p):
    """Chords of one disk and the waves of its fluxes."""
    sides = solution.sides
    chords = cut_chords(sides, solution.medium.conductivity, modes=solution.modes)
    points = chord_points(chords.levels)
    theta, alpha, fluxes, levels = of_disk(chords, p)
    rows = chords.rows[chords.offsets[p] : chords.offsets[p + 1]]
    coefficients = np.where(rows[:, None] >= 0, solution.flows[rows, :, 0], 0.0)
    coefficients[:, 1::2] *= chords.signs[chords.offsets[p] : chords.offsets[p + 1], None]
    h = np.empty((coefficients.size,) * 2)
    offsets, densities, _ = solve_cut_disk(theta, alpha, fluxes, levels, points, h)
    waves = chord_waves(alpha, fluxes, levels, offsets, densities @ coefficients.ravel(), coefficients, points)
    return theta, alpha, waves, h @ coefficients.ravel(), fluxes.exponents


@pytest.fixture(scope="module")
def solution(feng_particles):
    return effective_conductivity(medium_of(overlap_contacts(feng_particles)), method="exact", axes=(0,)).solutions[0]


@pytest.mark.parametrize("p", [0, 3, 6])
def test_temperature_is_harmonic_continuous_up_to_the_chords_and_insulated_on_the_arc(solution, p):
    theta, alpha, waves, means, exponents = loaded_disk(solution, p)

    def at(z):
        return temperature_at(z, -1, 0.0, theta, alpha, *waves)

    for z in (0.3 + 0.2j, -0.5j, 0.61 + 0.0j):
        step = 1e-2  # nine-point stencil: error h^6
        ring = (
            [at(z + step * d) for d in (1, -1, 1j, -1j)],
            [at(z + step * d) for d in (1 + 1j, 1 - 1j, -1 + 1j, -1 - 1j)],
        )
        assert 4 * sum(ring[0]) + sum(ring[1]) - 20 * at(z) == pytest.approx(0.0, abs=1e-9)
    free = [
        t for t in np.linspace(0, 2 * np.pi, 40) if (abs((t - theta + np.pi) % (2 * np.pi) - np.pi) > alpha + 0.1).all()
    ]
    for t in free:
        out = np.exp(1j * t)
        assert 4 * at(0.999 * out) - at(0.998 * out) - 3 * at(out) == pytest.approx(0.0, abs=2e-6)
    assert at(1e-4 + 0j) == pytest.approx(0.0, abs=1e-4)
    # its weighted mean over a chord is what the resistance matrix says
    chi = np.arange(-80, 81) * 0.4
    for on in range(theta.size):
        trace = np.empty(chi.size)
        chord_trace(on, chi, theta, alpha, *waves, trace)
        weight = np.cosh(0.5 * chi) ** (-2 * exponents[on])
        assert weight @ trace / weight.sum() == pytest.approx(means[on * solution.modes], abs=1e-8)


def test_extension_of_a_jump_costs_at_least_the_harmonic_one():
    """J = cos(kx) sech-like on a strip with its far side insulated: the harmonic energy is int k tanh(kH) |J^|^2."""
    height, chi = 2.8, np.arange(-200, 201) * 0.1
    jump = np.exp(-0.5 * chi**2) * np.cos(2.0 * chi)
    slope = np.gradient(jump, chi)
    k = np.arange(0.005, 12.0, 0.01)
    transform = np.array([(jump * np.cos(q * chi)).sum() * 0.1 for q in k])
    harmonic = (k * np.tanh(k * height) * transform**2).sum() * 0.01 / np.pi
    for reach, depth in ((0.0, height), (1.0, 1.5), (3.0, 0.3)):
        extension = _least_extension(height, reach, depth, chi, jump, slope)
        assert harmonic < extension < 2.0 * harmonic * max(1.0, 0.6 / depth)


def test_energies_of_jumps_are_those_of_the_particles(solution):
    energies = jump_energies(solution)
    assert energies.shape == (12,)
    assert (energies >= 0.0).all()
    assert energies.sum() < 1e-7


# --- command line ---------------------------------------------------------------------------------


def test_solve_reports_bounds_and_error(tmp_path):
    path = tmp_path / "disks.csv"
    path.write_text("x,y,radius\n0.25,0.5,0.252\n0.75,0.5,0.252\n")
    words = ["solve", str(path), "--box", "1,1", "--method", "exact", "--modes", "4", "--json"]
    done = subprocess.run([sys.executable, "-m", "etc_engine", *words], capture_output=True, text=True, check=True)
    record = json.loads(done.stdout)
    low, high = record["conductivity_bounds"]
    assert low < record["conductivity"] < high
    assert record["model_error_estimate"] == pytest.approx(high / low - 1.0)
