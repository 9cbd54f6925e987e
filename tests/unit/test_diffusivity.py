from __future__ import annotations

import numpy as np
import pytest
from scipy.special import erfc

from etc_engine.box import Box
from etc_engine.errors import InputError
from etc_engine.laws.disk import chord_resistance
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import bonded_contacts
from etc_engine.packing import ParticlePacking
from etc_engine.transient.diffusivity import SHORT, effective_diffusivity, fit_diffusivity, slab_mean


def row(n: int, alpha: float = 0.1):
    """n touching disks of unit diameter in a row between two walls."""
    centers = np.stack([np.arange(n) + 0.5, np.full(n, 0.5)], axis=1)
    return bonded_contacts(ParticlePacking(centers, np.full(n, 0.5), Box((float(n), 1.0), (False, True))), alpha)


def images(fourier):
    """The same mean by reflected fronts: M = 2 sqrt(Fo) [1/sqrt(pi) + 2 sum (-1)^n ierfc(n/sqrt(Fo))]."""
    n = np.arange(1, 60)
    x = n / np.sqrt(fourier)
    ierfc = np.exp(-(x**2)) / np.sqrt(np.pi) - x * erfc(x)
    return 2.0 * np.sqrt(fourier) * (1.0 / np.sqrt(np.pi) + 2.0 * ((-1.0) ** n * ierfc).sum())


def test_mean_of_the_slab_by_images():
    numbers = [1e-6, 0.5 * SHORT, 2.0 * SHORT, 1e-3, 0.03, 0.3, 1.0, 3.0]
    assert slab_mean(numbers) == pytest.approx([images(fo) for fo in numbers], abs=1e-12)


def test_fit_finds_the_diffusivity_and_its_misfit():
    t = np.geomspace(1e-3, 1.0, 40)
    noise = 1e-3 * np.random.default_rng(4).standard_normal(40)
    a, misfit = fit_diffusivity(t, slab_mean(3.0 * t / 0.25) + noise, 0.5)
    assert a == pytest.approx(3.0, rel=3e-3)
    assert misfit == pytest.approx(1e-3, rel=0.4)
    with pytest.raises(InputError, match="at least three mean temperatures"):
        fit_diffusivity([1.0, 2.0], [0.5, 0.6], 1.0)


def test_a_row_of_disks_becomes_a_slab():
    """Half-cells at walls and cells in between: a finite-volume slab, off by the square of the cell."""
    # the wide arcs of a periodic image above and below do not touch: the row conducts along x alone
    errors = [
        found.transient / found.steady - 1.0
        for n in (10, 20, 40)
        for found in [effective_diffusivity(medium_of(row(n), heat_capacity=1.0))]
    ]
    assert abs(errors[-1]) < 1e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)


def test_steady_diffusivity_by_hand():
    found = effective_diffusivity(medium_of(row(20).with_resistance(0.1), 3.0, heat_capacity=2.0))
    pipe = 2.0 * chord_resistance(0.1) / 3.0 + 0.1
    k = 20.0 / (19 * pipe + 2 * (chord_resistance(0.1) / 3.0 + 0.1))
    assert found.conductivity == pytest.approx(k, rel=1e-10)
    # two contacts along x and two across the periodic sides cut every disk
    area = 0.25 * (np.pi - 4.0 * (0.1 - np.sin(0.1) * np.cos(0.1)))
    assert found.heat_capacity == pytest.approx(2.0 * area, rel=1e-10)
    assert found.steady == pytest.approx(k / (2.0 * area), rel=1e-10)


def test_what_has_no_diffusivity():
    with pytest.raises(InputError, match="periodic along x"):
        packing = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0), (True, False)))
        effective_diffusivity(medium_of(bonded_contacts(packing, 0.1), heat_capacity=1.0))
    apart = ParticlePacking([[0.25, 0.5], [0.8, 0.5]], [0.25, 0.1], Box((1.0, 1.0)))
    with pytest.raises(InputError, match="no path of contacts"):
        effective_diffusivity(medium_of(bonded_contacts(apart, 0.1), heat_capacity=1.0))
