"""Spheres in contact in vacuum against three-dimensional finite elements, and against what other codes compute."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.engines.pipe.steady import pipe_conductivity
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import bonded_contacts, overlap_contacts
from etc_engine.packing.particles import ParticlePacking
from etc_engine.realization import effective_conductivity

REFERENCE = json.loads((Path(__file__).parent / "data" / "spheres_vacuum.json").read_text())
LATTICES = [case for case in REFERENCE if case["kind"] == "vacuum_lattice"]
WALLS = [case for case in REFERENCE if case["kind"] == "vacuum_random_walls"]
CELLS = {
    "sc": (1.0, [[0, 0, 0]]),
    "bcc": (2.0 / np.sqrt(3.0), [[0, 0, 0], [0.5, 0.5, 0.5]]),
    "fcc": (np.sqrt(2.0), [[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]]),
}
CONTACTS = {"sc": 3, "bcc": 8, "fcc": 24}


def lattice(name: str, distance: float, cells: int = 2) -> ParticlePacking:
    """Unit spheres, nearest neighbours at the given distance."""
    edge, basis = CELLS[name]
    corners = np.stack(np.meshgrid(*[np.arange(cells)] * 3, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    centers = (corners + np.array(basis)).reshape(-1, 3) * edge * distance
    return ParticlePacking(centers + 0.1, np.ones(len(centers)), Box((cells * edge * distance,) * 3, (True,) * 3))


def between_walls(case: dict) -> ParticlePacking:
    """The driven walls normal to x, the others out of reach."""
    centers = np.array(case["centres"])[:, [2, 0, 1]] + [0.0, 5.0, 5.0]
    return ParticlePacking(centers, np.array(case["radii"]), Box((1.0, 11.0, 11.0)))


def allowed(case: dict) -> float:
    """Relative error allowed: .03 % up to 10 degrees, .1 % at 20, by the closed form's own order beyond."""
    own = case["error"] / case["value"]
    angle = case["angle_deg"]
    return own + (3e-4 if angle <= 10 else 2.1e-3 if case["lattice"] == "fcc" else 1e-3 if angle <= 20 else 8e-3)


@pytest.mark.parametrize("case", LATTICES, ids=lambda c: f"{c['lattice']}-{c['angle_deg']}")
def test_chord_on_lattices(case):
    network = overlap_contacts(lattice(case["lattice"], 2.0 * np.cos(np.radians(case["angle_deg"]))))
    assert network.count == 8 * CONTACTS[case["lattice"]]
    tensor = effective_conductivity(medium_of(network)).tensor
    assert tensor == pytest.approx(tensor[0, 0] * np.eye(3), abs=1e-12)
    assert tensor[0, 0] == pytest.approx(case["value"], rel=allowed(case))


@pytest.mark.parametrize("case", WALLS, ids=lambda c: f"{c['case']}")
def test_chord_between_walls(case):
    network = overlap_contacts(between_walls(case))
    conductance = effective_conductivity(medium_of(network), axes=(0,)).tensor[0, 0] * 121.0
    assert conductance == pytest.approx(case["value"], rel=6e-4)


EXACT = [case for case in LATTICES if case["angle_deg"] >= 20]


@pytest.mark.parametrize("case", EXACT, ids=lambda c: f"{c['lattice']}-{c['angle_deg']}")
def test_exact_converges_to_finite_elements_on_lattices(case):
    """Degrees 0 .. 3 of the flux modes; the truth is known to its own error only."""
    network = overlap_contacts(lattice(case["lattice"], 2.0 * np.cos(np.radians(case["angle_deg"])), 1))
    found = [effective_conductivity(medium_of(network), method="exact", modes=n).tensor[0, 0] for n in (1, 2, 3, 4)]
    errors = np.abs(np.array(found) / case["value"] - 1.0)
    own = case["error"] / case["value"]
    assert errors[3] < own
    assert errors[2] < 1.5 * own
    assert errors[0] > errors[1] > errors[2]
    steps = np.abs(np.diff(found))
    assert steps[2] < steps[1] < steps[0]


@pytest.mark.parametrize("case", WALLS, ids=lambda c: f"{c['case']}")
def test_exact_between_walls_that_cut_the_spheres_on_all_sides(case):
    centers = np.array(case["centres"])[:, [2, 0, 1]]
    network = overlap_contacts(ParticlePacking(centers, np.array(case["radii"]), Box((1.0, 1.0, 1.0))))
    found = effective_conductivity(medium_of(network), method="exact", axes=(0,)).tensor[0, 0]
    assert found == pytest.approx(case["value"], rel=case["error"] / case["value"])


@pytest.mark.parametrize("name", CELLS)
def test_small_contacts_conduct_like_two_kappa_c(name):
    """A contact of radius c between half-spaces passes 2 kappa c (Holm)."""
    for alpha in (1e-3, 1e-4):
        packing = lattice(name, 2.0)
        found = pipe_conductivity(medium_of(bonded_contacts(packing, alpha, 1e-9))).tensor[0, 0]
        along = 8 * CONTACTS[name] * 4.0 / 3.0
        law = 2.0 * np.sin(alpha) * along / packing.box.volume
        assert found == pytest.approx(law, rel=10 * alpha)
        assert effective_conductivity(medium_of(bonded_contacts(packing, alpha, 1e-9))).tensor[0, 0] == pytest.approx(
            law, rel=20 * alpha
        )
