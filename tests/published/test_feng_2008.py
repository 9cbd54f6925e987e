"""Feng, Han, Li, Owen 2008, J. Comput. Phys. 227, doi:10.1016/j.jcp.2008.01.031: the 12-particle example."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from etc_engine.engines.dtem.field import recover_field
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import overlap_contacts
from etc_engine.realization import effective_conductivity

DATA = Path(__file__).parent / "data"
# corner-graded finite elements, energy bounds from above and below agree to 1e-7
CONVERGED_TRUTH = 0.2787774


@pytest.fixture(scope="module")
def network(feng_particles):
    return overlap_contacts(feng_particles)


@pytest.fixture(scope="module")
def table4():
    return np.genfromtxt(DATA / "feng2008_table4_contact_temperatures.csv", delimiter=",", names=True)


def test_the_assembly_has_17_contacts_and_4_on_the_driven_walls(network):
    assert network.count == 17
    assert network.walls_of(0).size == 4
    assert effective_conductivity(medium_of(network), axes=(0,)).unknowns == 17


def test_contact_half_angles_lie_in_the_published_range(network):
    assert np.degrees(network.angles.min()) > 5.15
    assert np.degrees(network.angles.max()) < 6.25


@pytest.mark.parametrize(
    ("method", "row", "digits"),
    [
        ("standard", "dtem_standard", 5e-5),
        ("enhanced", "dtem_enhanced", 1.5e-4),
    ],  # 0.2757 needs an unrounded lambda
)
def test_effective_conductivity_of_table_3(network, method, row, digits):
    table = dict(np.loadtxt(DATA / "feng2008_table3_effective_conductivity.csv", delimiter=",", skiprows=1, dtype=str))
    assert effective_conductivity(medium_of(network), method=method, axes=(0,)).tensor[0, 0] == pytest.approx(
        float(table[row]), abs=digits
    )


@pytest.mark.parametrize(
    ("method", "value"), [("standard", 0.267840), ("enhanced", 0.275623), ("chord", 0.278754), ("arc", 0.2763014)]
)
def test_effective_conductivity_of_every_method(network, method, value):
    """Values of an independent prototype with quadrature instead of the closed form."""
    assert effective_conductivity(medium_of(network), method=method, axes=(0,)).tensor[0, 0] == pytest.approx(
        value, abs=6e-7 if method != "arc" else 5e-8
    )


def test_chord_is_within_a_hundredth_of_a_percent_of_the_converged_truth(network):
    value = effective_conductivity(medium_of(network), method="chord", axes=(0,)).tensor[0, 0]
    assert abs(value / CONVERGED_TRUTH - 1.0) < 1e-4


@pytest.mark.parametrize(
    ("method", "column", "digits"),
    [
        ("standard", "paper_dtem_standard", 5.1e-5),
        ("enhanced", "paper_dtem_enhanced", 1.01e-4),
        ("chord", "converged_truth", 7e-5),
    ],
)
def test_contact_temperatures_of_table_4(network, table4, method, column, digits):
    solution = effective_conductivity(medium_of(network), method=method, axes=(0,)).solutions[0]
    pairs = np.stack([table4["particle_a"], table4["particle_b"]], axis=1).astype(int) - 1
    np.testing.assert_array_equal(network.pairs, pairs)
    np.testing.assert_allclose(recover_field(solution).contact_temperatures, table4[column], atol=digits, rtol=0)


def test_heat_in_equals_heat_out_equals_energy(network):
    result = effective_conductivity(medium_of(network), axes=(0,))
    heat_in, heat_out = result.solutions[0].wall_heat()
    assert heat_in == pytest.approx(result.tensor[0, 0], rel=1e-12)
    assert heat_out == pytest.approx(result.tensor[0, 0], rel=1e-12)


def test_exact_reaches_the_converged_truth_with_three_modes(network):
    value = effective_conductivity(medium_of(network), method="exact", axes=(0,), tolerance=1e-12).tensor[0, 0]
    assert value == pytest.approx(CONVERGED_TRUTH, abs=1e-7)


def test_disks_cut_by_the_driven_walls_alone(network):
    """0.2787795, of an independent prototype."""
    uncut = replace(network, rule="bonded")
    assert effective_conductivity(medium_of(uncut), method="exact", axes=(0,)).tensor[0, 0] == pytest.approx(
        0.2787795, abs=2e-7
    )
