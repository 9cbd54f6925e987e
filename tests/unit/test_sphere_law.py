"""Resistances between contact disks of a sphere against sums, limits and an independent computation."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.special import erfc

from etc_engine.errors import InputError
from etc_engine.laws.sphere import (
    FOUR_PI,
    chord_resistance,
    disk_resistance,
    mutual_resistance,
    neumann,
    self_resistance,
    standard_resistance,
)
from etc_engine.laws.sphere_dents import resistance_matrices
from etc_engine.laws.sphere_field import sphere_temperatures

SPECIFICATION = importlib.util.spec_from_file_location("cut_sphere", Path(__file__).with_name("cut_sphere.py"))
CUT_SPHERE = importlib.util.module_from_spec(SPECIFICATION)
SPECIFICATION.loader.exec_module(CUT_SPHERE)
REFERENCE = json.loads((Path(__file__).parents[1] / "published" / "data" / "spheres_vacuum.json").read_text())
CUT = {1: 14.510917599, 5: 2.921999975, 10: 1.432475671, 20: 0.657516806, 30: 0.383051216, 45: 0.185041053}
CUT[60] = 0.067920355


def legendre(last: int, x: float) -> np.ndarray:
    """P_0 .. P_last at x."""
    values = [1.0, x]
    for n in range(1, last):
        values.append(((2 * n + 1) * x * values[-1] - n * values[-2]) / (n + 1))
    return np.array(values)


def cap_means(degree: np.ndarray, alpha: float) -> np.ndarray:
    """Mean of P_l over the cap, l = 1, 2, ..."""
    values = legendre(degree[-1] + 1, np.cos(alpha))
    return (values[:-2] - values[2:]) / ((2 * degree + 1) * (1.0 - np.cos(alpha)))


@pytest.mark.parametrize("degrees", CUT)
def test_chord_has_the_certified_values(degrees):
    assert chord_resistance(np.radians(degrees)) == pytest.approx(CUT[degrees], abs=1e-9)


@pytest.mark.parametrize("case", [c for c in REFERENCE if c["kind"] == "h_cut"], ids=lambda c: f"{c['angle_deg']}")
def test_chord_has_the_reference_values(case):
    assert chord_resistance(np.radians(case["angle_deg"])) == pytest.approx(case["value"], abs=case["error"])


@pytest.mark.parametrize("degrees", [4.0, 17.0, 42.0, 59.99, 60.01, 71.0, 84.0])
def test_chord_is_the_sphere_cut_at_an_isothermal_disk(degrees):
    alpha = np.radians(degrees)
    assert chord_resistance(alpha) == pytest.approx(CUT_SPHERE.cut_sphere_resistance(alpha), abs=2e-9)


def test_chord_has_its_limits():
    alpha = np.array([1e-4, 1e-3])
    leading = 1.0 / (4.0 * alpha) - (np.log(2.0 * alpha) + 1.0) / FOUR_PI
    assert chord_resistance(alpha) == pytest.approx(leading, abs=1e-3)
    # a sink close to an isothermal plane: half of it is its image, at twice the distance
    assert chord_resistance(np.radians(89.9)) * 8.0 * np.pi * np.cos(np.radians(89.9)) == pytest.approx(-1.0, abs=0.02)


@pytest.mark.parametrize("degrees", [2.0, 10.0, 33.0, 60.0, 90.0])
def test_uniform_flux_equals_its_legendre_sum(degrees):
    alpha, terms = np.radians(degrees), 40_000
    degree = np.arange(1, terms)
    means = cap_means(degree, alpha)
    rest = np.sin(alpha) / (np.pi * (1.0 - np.cos(alpha)) ** 2 * (terms - 0.5) ** 2)
    total = ((2 * degree + 1) / degree * means**2).sum() + rest
    assert standard_resistance(alpha) == pytest.approx(total / FOUR_PI, abs=2e-8 / degrees)


@pytest.mark.parametrize(
    ("gamma", "a", "b"), [(180, 5, 5), (90, 10, 10), (60, 10, 20), (60, 3, 2), (40, 1, 1), (100, 50, 10)]
)
def test_mutual_resistances_equal_their_legendre_sums(gamma, a, b):
    gamma, a, b = np.radians([gamma, a, b])
    degree = np.arange(1, 12_000)
    window = 0.5 * erfc((degree - 6000.0) / 1200.0)
    polynomials = window * legendre(degree[-1], np.cos(gamma))[1:] / FOUR_PI
    caps = (2 * degree + 1) / degree * cap_means(degree, a) * cap_means(degree, b)
    # interior sources: 1/|x - x'| does not see the surface, and its own sum converges like cos^l
    surface = np.sin((degree + 0.5) * a) * np.sin((degree + 0.5) * b) / (np.sin(a / 2) * np.sin(b / 2))
    disks = surface / (degree * (2 * degree + 1))
    assert mutual_resistance(np.cos(gamma), a, b, "standard") == pytest.approx((caps * polynomials).sum(), abs=1e-9)
    assert mutual_resistance(np.cos(gamma), a, b, "chord") == pytest.approx((disks * polynomials).sum(), abs=3e-6)


def test_a_far_small_contact_sees_the_neumann_function():
    gamma = np.array([0.4, 1.0, 2.0, np.pi])
    for method in ("chord", "standard"):
        assert mutual_resistance(np.cos(gamma), 1e-4, 1e-4, method) == pytest.approx(neumann(np.cos(gamma)), abs=1e-6)


def test_neumann_function_equals_its_sum():
    degree = np.arange(1, 4000)
    window = 0.5 * erfc((degree - 2000.0) / 400.0)
    for gamma in (0.5, 1.5, 3.0):
        total = (window * (2 * degree + 1) / degree * legendre(degree[-1], np.cos(gamma))[1:]).sum() / FOUR_PI
        assert neumann(np.cos(gamma)) == pytest.approx(total, abs=1e-10)


def random_contacts(seed: int, number: int = 8) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(number, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    angles = np.arccos(np.clip(normals @ normals.T, -1.0, 1.0)) + 9.0 * np.eye(number)
    return normals, np.minimum(0.5, 0.45 * angles.min(axis=1))


@pytest.mark.parametrize("method", ["chord", "standard"])
def test_matrices_are_positive_definite_and_turn_with_the_sphere(method):
    for seed in range(20, 60):
        normals, alpha = random_contacts(seed)
        offsets = np.array([0, len(alpha)])
        h = resistance_matrices(offsets, normals, alpha, method).reshape(len(alpha), -1)
        assert np.array_equal(h, h.T)
        basis = np.eye(len(alpha))[:, 1:] - np.eye(len(alpha))[:, :1]
        assert np.linalg.eigvalsh(basis.T @ h @ basis).min() > 0.0
        turn, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
        turned = resistance_matrices(offsets, normals @ turn, alpha, method).reshape(h.shape)
        assert turned == pytest.approx(h, rel=1e-9)


def test_dents_raise_the_resistance_of_what_passes_them():
    normals = np.array([[0, 0, 1.0], [0, 0, -1.0], [1.0, 0, 0]])
    with_side = resistance_matrices(np.array([0, 3]), normals, np.full(3, 0.3), "chord").reshape(3, 3)
    alone = resistance_matrices(np.array([0, 2]), normals[:2], np.full(2, 0.3), "chord").reshape(2, 2)
    through = np.array([1.0, -1.0])
    volume = np.pi / 3.0 * (1.0 - np.cos(0.3)) ** 2 * (2.0 + np.cos(0.3))
    half = np.sqrt(0.5)
    slope = 2.0 * (half**-3 + (1.0 + 2.0 * half) / (half**2 * (1.0 + half))) / (4.0 * FOUR_PI)
    added = through @ (with_side[:2, :2] - alone) @ through
    assert added == pytest.approx(volume * slope**2, rel=1e-12)


@pytest.mark.parametrize("method", ["chord", "standard"])
def test_field_has_its_mean_at_the_centre_and_the_resistances_at_the_contacts(method):
    normals = np.array([[0, 0, 1.0], [0, 0, -1.0], [1.0, 0, 0]])
    alpha = np.radians([20.0, 10.0, 15.0])
    flows = np.array([1.0, -0.7, -0.3])
    h = resistance_matrices(np.array([0, 3]), normals, alpha, method).reshape(3, 3).copy()
    if method == "chord":  # the field is that of the full ball: no dents, no cut
        h[:] = mutual_resistance(normals @ normals.T - 2.0 * np.eye(3), alpha[:, None], alpha[None, :])
        np.fill_diagonal(h, disk_resistance(alpha))
    x, w = np.polynomial.legendre.leggauss(160)
    if method == "chord":
        rho = np.sin(alpha[0]) * np.sin(0.25 * np.pi * (x + 1.0))
        weight, height = 0.25 * np.pi * w * np.sin(0.25 * np.pi * (x + 1.0)), np.full_like(x, np.cos(alpha[0]))
    else:
        height = 1.0 - 0.5 * (1.0 - np.cos(alpha[0])) * (x + 1.0)
        rho, weight = np.sqrt(1.0 - height**2), 0.5 * w
    turns = 2.0 * np.pi * (np.arange(16) + 0.5) / 16
    points = np.stack(
        [np.outer(rho, np.cos(turns)), np.outer(rho, np.sin(turns)), np.tile(height[:, None], (1, 16))], axis=-1
    )

    def field(at):
        at = np.reshape(at, (-1, 3))
        return sphere_temperatures(np.zeros(len(at), np.int64), at, np.array([0, 3]), normals, alpha, flows, method)

    assert field([0.0, 0.0, 0.0]) == pytest.approx(0.0, abs=1e-12)
    mean = weight @ field(points * (1.0 - 1e-12)).reshape(len(x), 16).mean(axis=1)
    assert mean == pytest.approx(h[0] @ flows, abs=2e-6)


@pytest.mark.parametrize("method", ["chord", "standard"])
def test_field_is_harmonic_and_insulated_between_the_contacts(method):
    rng = np.random.default_rng(8)
    normals, alpha = random_contacts(71, 5)
    flows = rng.normal(size=5)
    flows -= flows.mean()

    def field(at):
        return sphere_temperatures(np.zeros(len(at), np.int64), at, np.array([0, 5]), normals, alpha, flows, method)

    step = 1e-3
    for point in rng.uniform(-0.4, 0.4, (20, 3)):
        around = field(point + step * np.concatenate([np.eye(3), -np.eye(3)]))
        assert around.mean() == pytest.approx(field(point[None])[0], abs=1e-9)
    free = rng.normal(size=(200, 3))
    free /= np.linalg.norm(free, axis=1)[:, None]
    free = free[(np.arccos(free @ normals.T) > alpha + 0.15).all(axis=1)]
    assert len(free) > 20
    inside = field(np.concatenate([free, free * (1 - step), free * (1 - 2 * step)])).reshape(3, -1)
    slope = (3.0 * inside[0] - 4.0 * inside[1] + inside[2]) / (2.0 * step)
    assert slope == pytest.approx(np.zeros(len(free)), abs=1e-3)


def test_an_unknown_method_is_refused():
    with pytest.raises(InputError, match="spheres have no method 'enhanced': expected one of chord, standard"):
        self_resistance(0.1, "enhanced")
