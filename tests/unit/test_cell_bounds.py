"""Two-sided bounds by the conforming mesh, and the cell element between them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.engines.dtem.cell.bounds import MOST_DISKS, conductivity_bounds
from etc_engine.engines.dtem.cell.conductivity import cell_conductivity
from etc_engine.engines.dtem.cell.edges import EdgeContacts
from etc_engine.engines.dtem.cell.geometry import Resolution, cell_geometry
from etc_engine.errors import InputError
from etc_engine.models.arrays import hexagonal_array, square_array
from etc_engine.structure.laguerre_2d import laguerre_cells

DATA = Path(__file__).parents[1] / "data" / "pores"
TABLE = np.genfromtxt(DATA / "reference.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")


@pytest.mark.parametrize(("contrast", "share"), [(3.0, 0.4), (30.0, 0.9), (1000.0, 0.99)])
def test_arrays_lie_within_their_bounds(contrast, share):
    square = cell_geometry(np.array([[0.5, 0.5]]), np.array([0.5 * np.sqrt(share)]), Box((1.0, 1.0), (True, True)))
    exact = float(square_array(1.0, contrast, share * np.pi / 4.0))
    for degree, width in ((2, 3e-3), (3, 3e-4)):
        bounds = conductivity_bounds(square, np.array([contrast]), 1.0, degree=degree)
        assert bounds.lower[0, 0] <= exact * (1 + 1e-9)
        assert bounds.upper[0, 0] >= exact * (1 - 1e-9)
        assert bounds.upper[0, 0] / bounds.lower[0, 0] - 1.0 < width
    box = Box((1.0, np.sqrt(3.0)), (True, True))
    centers = np.array([[0.25, 0.25 * np.sqrt(3.0)], [0.75, 0.75 * np.sqrt(3.0)]])
    hexagonal = cell_geometry(centers, np.full(2, 0.5 * np.sqrt(share)), box)
    bounds = conductivity_bounds(hexagonal, np.full(2, contrast), 1.0)
    exact = float(hexagonal_array(1.0, contrast, share * np.pi / np.sqrt(12.0)))
    assert bounds.lower[0, 0] < exact < bounds.upper[0, 0]


@pytest.mark.slow
@pytest.mark.parametrize("case", ["ls75_poly", "front_poly", "ls_over"])
def test_bounds_of_random_packings_hold_the_reference(case):
    rows = np.loadtxt(DATA / f"{case}.csv", delimiter=",", skiprows=1)
    geometry = cell_geometry(rows[:, :2], rows[:, 2], Box((1.0, 1.0), (True, True)))
    for row in TABLE[TABLE["case"] == case][[0, 2]]:
        bounds = conductivity_bounds(geometry, np.full(len(rows), row["contrast_ks_over_kf"]), 1.0)
        slack = 2.0 * row["relative_half_width"]
        assert np.trace(bounds.lower) < 2.0 * row["k_mean"] * (1.0 + slack)
        assert np.trace(bounds.upper) > 2.0 * row["k_mean"] * (1.0 - slack)
        assert np.trace(bounds.upper) / np.trace(bounds.lower) - 1.0 < 3e-3


@pytest.mark.parametrize("growth", [1.0, 1.25])
def test_walls_and_unlike_disks_that_overlap(growth):
    rng = np.random.default_rng(50)
    centers = (np.mgrid[:3, :2].reshape(2, -1).T + 0.5 + rng.uniform(-0.1, 0.1, (6, 2))) / (3.0, 2.0)
    radii, solid = growth * rng.uniform(0.13, 0.17, 6), rng.uniform(20.0, 60.0, 6)
    geometry = cell_geometry(centers, radii, Box((1.0, 1.0)))
    bounds = conductivity_bounds(geometry, solid, 1.0)
    found = cell_conductivity(geometry, solid, 1.0, resolution=Resolution(5)).tensor
    for axis in range(2):
        assert bounds.lower[axis, axis] < bounds.upper[axis, axis] < 1.004 * bounds.lower[axis, axis]
        assert bounds.lower[axis, axis] * 0.999 < found[axis, axis] < bounds.upper[axis, axis] * 1.004


def test_bounds_refuse_what_they_do_not_hold_for():
    box = Box((1.0, 1.0), (True, True))
    one = cell_geometry(np.array([[0.5, 0.5]]), np.array([0.5]), box)
    with pytest.raises(InputError, match=r"degree .* between 2 and 5"):
        conductivity_bounds(one, np.ones(1), 0.1, degree=1)
    cells = laguerre_cells(np.array([[0.5, 0.5]]), np.array([0.5]), box)
    bonded = EdgeContacts(np.full((2, 2), 0.1), np.zeros(2), np.zeros(2))
    with pytest.raises(InputError, match="no plane geometry"):
        conductivity_bounds(cell_geometry(np.array([[0.5, 0.5]]), np.array([0.5]), box, bonded, cells), np.ones(1), 0.1)
    side = 21
    many = (np.mgrid[:side, :side].reshape(2, -1).T + 0.5) / side
    with pytest.raises(InputError, match=f"at most {MOST_DISKS} disks"):
        conductivity_bounds(cell_geometry(many, np.full(side * side, 0.01), box), np.ones(side * side), 0.1)
