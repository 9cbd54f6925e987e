from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.engines.dtem.conductivity import element_conductivity
from etc_engine.engines.dtem.model_error import chord_error_estimate, chord_error_terms
from etc_engine.errors import InputError
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import bonded_contacts, overlap_contacts
from etc_engine.packing import PackingSpec, pack
from etc_engine.packing.particles import ParticlePacking
from etc_engine.packing.radii import parse_radii
from etc_engine.realization import effective_conductivity


def error_and_estimate(network, conductivity=1.0):
    medium = medium_of(network, conductivity)
    chord = element_conductivity(medium, axes=(0,))
    exact = element_conductivity(medium, method="exact", modes=4, axes=(0,))
    return abs(chord.tensor[0, 0] / exact.tensor[0, 0] - 1.0), chord_error_estimate(chord.solutions[0])


@pytest.mark.parametrize("degrees", [2.0, 6.0, 11.0, 16.0])
@pytest.mark.parametrize("seed", [51, 52])
def test_estimate_covers_random_packings_it_was_not_fitted_to(seed, degrees):
    """Radii, box and seeds of their own; within a factor 6 unless the terms cancel."""
    spec = PackingSpec("advancing-front", parse_radii("bidisperse:0.03:0.05:0.4"), Box((1.2, 0.8)))
    network = bonded_contacts(pack(spec, np.random.default_rng(seed)), np.radians(degrees))
    error, estimate = error_and_estimate(network)
    assert error < estimate
    assert estimate < max(6.0 * error, 2e-3)


def test_estimate_covers_overlapping_disks_of_mixed_conductivity():
    rng = np.random.default_rng(53)
    grid = np.stack(np.meshgrid(np.arange(6), np.arange(6), indexing="ij"), axis=-1).reshape(-1, 2) + 0.5
    packing = ParticlePacking(
        (grid + 0.05 * rng.uniform(-1, 1, grid.shape)) / 6,
        rng.uniform(0.53, 0.57, 36) / 6,
        Box((1.0, 1.0), (True, True)),
    )
    error, estimate = error_and_estimate(overlap_contacts(packing), conductivity=rng.uniform(1.0, 3.0, 36))
    assert error < estimate < 6.0 * error


def test_terms_are_those_of_a_disk_worked_out_by_hand():
    """Square lattice: Q = +-q at 0 and 180 degrees, none above and below, where the slope is q/(pi kappa)."""
    packing = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0), (True, True)))
    solution = effective_conductivity(medium_of(bonded_contacts(packing, 0.2))).solutions[0]
    q, a = solution.heat_flows[:, 0].max(), np.sin(0.2)
    energy = solution.energies[0, 0]
    expected = [2 * (q / np.pi) ** 2 * a**3 * (1 + 7 * a**4) / energy, 0.0, 0.0]
    np.testing.assert_allclose(chord_error_terms(solution), expected, atol=1e-15)


def test_estimate_does_not_see_units():
    packing = ParticlePacking([[0.1, 0.2], [0.6, 0.2 + 0.5 * 3**0.5]], [0.5, 0.5], Box((1.0, 3**0.5), (True, True)))
    values = [
        chord_error_estimate(effective_conductivity(medium_of(network, kappa)).solutions[0])
        for network, kappa in (
            (bonded_contacts(packing, 0.2), 1.0),
            (bonded_contacts(packing, 0.2), 40.0),
            (
                bonded_contacts(
                    ParticlePacking(packing.centers * 9.0, packing.radii * 9.0, Box((9.0, 9.0 * 3**0.5), (True, True))),
                    0.2,
                ),
                1.0,
            ),
        )
    ]
    np.testing.assert_allclose(values, values[0], rtol=1e-9)


def test_it_is_for_chord_alone(feng_particles):
    solution = effective_conductivity(medium_of(overlap_contacts(feng_particles)), method="arc", axes=(0,)).solutions[0]
    with pytest.raises(InputError, match="estimated for method chord, found a solution by arc"):
        chord_error_estimate(solution)


def test_solve_reports_it(tmp_path):
    path = tmp_path / "disks.csv"
    path.write_text("x,y,radius\n0.25,0.25,0.25\n0.75,0.25,0.25\n0.25,0.75,0.25\n0.75,0.75,0.25\n")
    words = ["solve", str(path), "--box", "1,1", "--periodic", "xy", "--contact-angle", "10", "--json"]
    done = subprocess.run([sys.executable, "-m", "etc_engine", *words], capture_output=True, text=True, check=True)
    assert 4e-4 < json.loads(done.stdout)["model_error_estimate"] < 1.2e-3  # the square lattice: 4.1e-4
