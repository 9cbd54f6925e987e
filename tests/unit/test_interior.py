from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss

from etc_engine.engines.dtem.field import recover_field
from etc_engine.laws.disk import position_angles
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import overlap_contacts
from etc_engine.realization import effective_conductivity


@pytest.fixture(scope="module", params=["standard", "enhanced", "chord", "arc"])
def solved(request, feng_particles):
    result = effective_conductivity(medium_of(overlap_contacts(feng_particles)), method=request.param, axes=(0,))
    return request.param, result.solutions[0], recover_field(result.solutions[0])


def arc_means(solution, field, uniform: bool):
    """Mean temperature over every contact arc (first sides), weighted like the flux of the method."""
    points = 400
    if uniform:
        s, w = leggauss(points)
        w = 0.5 * w
    else:
        s, w = np.cos((np.arange(points) + 0.5) * np.pi / points), np.full(points, 1.0 / points)
    sides = field.sides.of_contacts[:, 0]
    owner = field.sides.particles[sides]
    angle = position_angles(field.sides.arms[sides])[..., None] + field.sides.alpha[sides, None] * s
    radius = solution.network.packing.radii[owner, None]
    xy = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1).reshape(-1, 2)
    values = field.inside(np.repeat(owner, points), xy).reshape(-1, points)
    return values @ w


def test_mean_over_a_contact_arc_is_the_contact_temperature(solved):
    method, solution, field = solved
    means = arc_means(solution, field, method in ("standard", "enhanced"))
    # enhanced and chord correct h_ii, not the flux density: the gap is (correction of h) x (heat flow)
    tolerance = {"standard": 2e-8, "arc": 1e-9, "enhanced": 4e-3, "chord": 4e-3}[method]
    np.testing.assert_allclose(means, field.contact_temperatures, atol=tolerance)


def test_temperature_is_harmonic_inside(solved):
    """Mean over a small circle equals the value at its centre."""
    _, solution, field = solved
    turn = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    for p, radius, angle in [(1, 0.5, 1.0), (4, 0.7, 2.5), (8, 0.2, -2.0)]:
        at = solution.network.packing.radii[p] * radius * np.array([np.cos(angle), np.sin(angle)])
        ring = at + 0.03 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        values = field.inside(np.full(64, p), ring)
        centre = field.inside(np.array([p]), at[None])
        assert values.mean() == pytest.approx(centre[0], abs=1e-9)


def test_mean_over_the_disk_and_value_at_the_centre_are_the_particle_temperature(solved):
    _, solution, field = solved
    r, w = leggauss(40)
    r, w = 0.5 * (r + 1), 0.5 * w
    turn = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    R = solution.network.packing.radii[4]
    xy = R * np.stack([np.outer(r, np.cos(turn)), np.outer(r, np.sin(turn))], axis=-1).reshape(-1, 2)
    values = field.inside(np.full(len(xy), 4), xy).reshape(40, 400).mean(axis=1)
    assert (values * 2 * r) @ w == pytest.approx(field.particle_temperatures[4], abs=1e-6)
    centre = field.inside(np.array([4]), np.zeros((1, 2)))
    assert centre[0] == field.particle_temperatures[4]


def test_free_boundary_is_insulated(solved):
    _, solution, field = solved
    sides = field.sides
    R = solution.network.packing.radii[4]
    rows = slice(sides.offsets[4], sides.offsets[5])
    angles = np.linspace(-np.pi, np.pi, 60)
    gaps = (
        np.abs((angles[:, None] - position_angles(sides.arms[rows]) + np.pi) % (2 * np.pi) - np.pi)
        - 2.0 * sides.alpha[rows]
    )
    free = angles[(gaps > 0).all(axis=1)]
    step = 1e-4
    ring = [
        field.inside(np.full(free.size, 4), R * (1 - n * step) * np.stack([np.cos(free), np.sin(free)], axis=1))
        for n in range(3)
    ]
    slope = (3 * ring[0] - 4 * ring[1] + ring[2]) / (2 * step)  # second-order one-sided derivative
    np.testing.assert_allclose(slope, 0.0, atol=2e-4)
