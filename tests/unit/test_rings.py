"""Coaxial caps against Legendre sums, condensed pairs against an axisymmetric computation of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from etc_engine.errors import InputError
from etc_engine.laws.coaxial import Y_TERMS, coaxial_column, coaxial_tables
from etc_engine.laws.rings import (
    MODES,
    RINGS,
    CondensedPairs,
    FacingSpheres,
    condense_pairs,
    legendre_means,
    ring_edges,
)

TERMS = 6000


def legendre_caps(angles, terms=TERMS):
    """Means of P_1 .. P_terms over caps, by recurrence; shape (caps, terms)."""
    x = np.cos(angles)
    lower, upper = np.ones_like(x), x
    means = np.empty((x.size, terms))
    for l in range(1, terms + 1):
        above = ((2 * l + 1) * x * upper - l * lower) / (l + 1)
        means[:, l - 1] = (lower - above) / ((2 * l + 1) * 2.0 * np.sin(0.5 * angles) ** 2)
        lower, upper = upper, above
    return means


def disk_means(angle, terms=TERMS):
    l = np.arange(1, terms + 1)
    return np.sin((l + 0.5) * angle) / ((2 * l + 1) * np.sin(0.5 * angle))


def weights(terms=TERMS):
    l = np.arange(1, terms + 1)
    return (2 * l + 1) / l


def pair(**changes):
    one = np.ones(1)
    values = {
        "distances": 2.01 * one, "reaches": 0.8 * one, "contacts": 0.0 * one, "radii": np.ones((1, 2)),
        "conductivities": np.full((1, 2), 100.0), "fluid": one, "jumps": 0.0 * one, "radiation": 0.0 * one,
        "bonds": 0.0 * one,
    }  # fmt: skip
    return FacingSpheres(**{**values, **{name: np.atleast_1d(np.asarray(v, float)) for name, v in changes.items()}})


def total(found: CondensedPairs) -> float:
    return float(found.constrictions[0].sum() + found.gaps[0])


def axisymmetric(facing: FacingSpheres, rings: int = 60, grading: float = 1.5) -> tuple[float, float]:
    """R_12 and h_1 - h_2 of one pair without a contact: fine rings, Legendre sums, midpoint tubes.

    Its rings end at radii graded by a power, not in geometric progression; the sums know no coaxial table.
    """
    reach, (r1, r2) = float(facing.reaches[0]), facing.radii[0]
    d, fluid, jump = float(facing.distances[0]), float(facing.fluid[0]), float(facing.jumps[0])
    edges = reach * (np.arange(1, rings + 1) / rings) ** grading
    inner = np.concatenate([[0.0], edges[:-1]])
    square = inner[:, None] ** 2 + (edges**2 - inner**2)[:, None] * (np.arange(400) + 0.5) / 400
    gap = d - np.sqrt(r1 * r1 - square) - np.sqrt(r2 * r2 - square)
    conductances = np.pi * (edges**2 - inner**2) * (fluid / (gap + jump) + facing.radiation[0]).mean(axis=1)
    h = []
    for radius, kappa in zip(facing.radii[0], facing.conductivities[0], strict=True):
        angles = np.arcsin(edges / radius)
        caps, b = legendre_caps(angles), np.sin(0.5 * angles) ** 2
        flux = b[:, None] * caps
        flux[1:] -= flux[:-1].copy()
        flux /= np.diff(b, prepend=0.0)[:, None]
        h.append((flux * weights()) @ flux.T / (4.0 * np.pi * kappa * radius))
    q = np.linalg.solve(h[0] + h[1] + np.diag(1.0 / conductances), np.ones(rings))
    w = q / q.sum()
    return 1.0 / float(q.sum()), float(w @ h[0] @ w - w @ h[1] @ w)


def coaxial(table, a, b):
    """F or D of cap or disk a in cap b."""
    out = np.empty(1)
    both = np.sin(0.5 * np.array([a, b])) ** 2
    coaxial_column(table, both, 1, 1, out, np.empty((6, Y_TERMS)))
    return out[0]


@pytest.mark.parametrize(("a", "b"), [(0.5, 0.5), (0.3, 0.9), (0.89, 0.9), (0.1, 1.5), (0.3, 1.57)])
def test_coaxial_tables_meet_the_legendre_sums(a, b):
    cap_a, cap_b = legendre_caps(np.array([a, b]))
    for table, first in zip(coaxial_tables(), (cap_a, disk_means(a)), strict=True):
        expected = float((weights() * first * cap_b).sum())
        assert coaxial(table, a, b) == pytest.approx(expected, abs=2e-5)  # the sums are cut


@pytest.mark.parametrize("ratio", [0.01, 0.5, 1.0])
def test_small_caps_are_flat_disks(ratio):
    """Mean of 2/gamma - ln(gamma/2) - 2 over two flat disks, exact for angles to zero."""
    from scipy.special import hyp2f1

    b = 1e-4
    flat = 4.0 / b * hyp2f1(0.5, -0.5, 2.0, ratio**2) - (np.log(0.5 * b) - 0.5 + 0.25 * ratio**2) - 2.0
    assert coaxial(coaxial_tables()[0], ratio * b, b) == pytest.approx(flat, rel=2e-6)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"distances": 2.3, "reaches": 0.999},
        {"radii": [[1.0, 2.5]], "distances": 3.52, "conductivities": [[20.0, 500.0]]},
        {"radii": [[3.0, 1.0]], "distances": 4.1, "reaches": 0.95, "conductivities": [[2.0, 50.0]]},
        {"jumps": 0.1, "radiation": 0.7, "radii": [[1.0, 1.5]], "distances": 2.5},
    ],
)
def test_condensed_pair_against_an_axisymmetric_computation(changes):
    facing = pair(**changes)
    found = condense_pairs(facing)
    resistance, difference = axisymmetric(facing)
    assert total(found) == pytest.approx(resistance, rel=4e-4)
    assert found.constrictions[0, 0] - found.constrictions[0, 1] == pytest.approx(difference, abs=5e-4 * resistance)


def test_swapping_the_spheres_swaps_their_constrictions():
    facing = pair(radii=[[1.0, 2.0]], distances=3.01, conductivities=[[20.0, 500.0]])
    swapped = replace(facing, radii=facing.radii[:, ::-1], conductivities=facing.conductivities[:, ::-1])
    here, there = condense_pairs(facing), condense_pairs(swapped)
    np.testing.assert_allclose(here.constrictions, there.constrictions[:, ::-1], rtol=1e-12)
    np.testing.assert_allclose(here.gaps, there.gaps, rtol=1e-12)


def test_units_scale_out():
    """Lengths by s, conductivities by c: resistances by 1/(s c)."""
    facing = pair(contacts=0.1, distances=1.99, jumps=0.01, radiation=2.0, bonds=0.05)
    s, c = 1e-3, 40.0
    scaled = FacingSpheres(
        facing.distances * s, facing.reaches * s, facing.contacts * s, facing.radii * s, facing.conductivities * c,
        facing.fluid * c, facing.jumps * s, facing.radiation * c / s, facing.bonds / (s * c),
    )  # fmt: skip
    assert total(condense_pairs(scaled)) == pytest.approx(total(condense_pairs(facing)) / (s * c), rel=1e-9)


def test_perfect_conductors_have_the_gap_of_two_spheres_alone():
    """kappa to infinity: 1/R = int 2 pi k_f rho drho/g, in closed form for equal spheres."""
    facing = pair(conductivities=[[1e9, 1e9]])
    z = np.sqrt(1.0 - 0.8**2)
    exact = 2.0 * np.pi * (-(1.0 - z) / 2.0 + 2.01 / 4.0 * np.log((2.01 - 2.0 * z) / 0.01))
    assert 1.0 / total(condense_pairs(facing)) == pytest.approx(exact, rel=1e-5)


def test_vacuum_leaves_the_law_of_the_contact_disk():
    from etc_engine.laws.sphere import chord_resistance

    facing = pair(contacts=0.2, distances=2.0 * np.sqrt(1 - 0.04), fluid=0.0)
    law = float(chord_resistance(np.arcsin(0.2))) / 100.0
    assert condense_pairs(facing).constrictions[0].tolist() == pytest.approx([law, law], rel=1e-12)
    thin = condense_pairs(replace(facing, fluid=np.full(1, 1e-5)))
    assert total(thin) == pytest.approx(2.0 * law, rel=1e-5)


def test_bond_resistance_is_in_series_with_the_disk_alone():
    facing = pair(contacts=0.2, distances=2.0 * np.sqrt(1 - 0.04), fluid=0.0, bonds=3.0)
    assert condense_pairs(facing).gaps[0] == pytest.approx(3.0, rel=1e-9)
    blocked = total(condense_pairs(replace(facing, fluid=np.ones(1), bonds=np.full(1, 1e9))))
    free = total(condense_pairs(replace(facing, fluid=np.ones(1))))
    assert free < blocked < 3.0


def test_rarefied_gas_ends_in_vacuum_and_in_the_continuum():
    touching = pair(distances=2.0)
    dense, thin = (total(condense_pairs(replace(touching, jumps=np.full(1, j)))) for j in (1e-9, 1e6))
    assert dense == pytest.approx(total(condense_pairs(touching)), rel=2e-3)  # an open point instead of a closed cap
    assert 1.0 / thin == pytest.approx(np.pi * 0.8**2 / 1e6, rel=1e-4)


def test_radiation_alone_crosses_a_vacuum():
    lone = pair(fluid=0.0, radiation=0.01)
    assert 1.0 / total(condense_pairs(lone)) == pytest.approx(np.pi * 0.8**2 * 0.01, rel=2e-3)


def test_legendre_means_begin_at_the_mean_cosine():
    facing = pair(conductivities=[[1e9, 1e9]], contacts=0.05, distances=1.9975)
    found = condense_pairs(facing)
    means, edges = np.empty(40), np.empty(RINGS + 1)
    legendre_means(facing.rows[0], 0, found.shapes[0], means)
    assert ring_edges(facing.rows[0], edges) == RINGS
    caps, b = legendre_caps(np.arcsin(edges), 40), np.sin(0.5 * np.arcsin(edges)) ** 2
    flux = b[:, None] * caps
    flux[1:] -= flux[:-1].copy()
    flux /= np.diff(b, prepend=0.0)[:, None]
    expected = found.shapes[0] @ np.concatenate([[disk_means(np.arcsin(0.05), 40)], flux])
    assert found.shapes.shape == (1, MODES)
    np.testing.assert_allclose(means, expected, atol=1e-9)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"fluid": -1.0}, "negative"),
        ({"fluid": 0.0}, "no contact, fluid or radiation"),
        ({"reaches": 1.1}, "wider than the smaller sphere"),
        ({"distances": np.nan}, "not finite"),
        ({"conductivities": [[0.0, 1.0]]}, "<= 0"),
        ({"contacts": 0.999, "reaches": 1.0}, "85 degrees"),
    ],
)
def test_bad_pairs_are_refused(changes, words):
    with pytest.raises(InputError, match=words):
        condense_pairs(pair(**changes))
