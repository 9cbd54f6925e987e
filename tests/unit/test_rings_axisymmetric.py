"""Gas with temperature jumps, and radiation, between spheres: against axisymmetric finite elements of our own.

The elements solve conduction in the solid and in the gas, with the jump of temperature at the surface, on half a
period of a chain of spheres in an insulated cylinder. Radiation is exchanged between facing points, as in the law.
"""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.laws.rings import FacingSpheres, condense_pairs, legendre_means

skfem = pytest.importorskip("skfem")


def structured(x, y):
    """Quadrilaterals of a mapped rectangle of points."""
    index = np.arange(x.size).reshape(x.shape)
    cells = np.array([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]]).reshape(4, -1)
    return skfem.MeshQuad(np.array([x.ravel(), y.ravel()]), cells)


def surface_of(basis):
    """Nodes on the unit sphere by polar angle, and the boundary facets there."""
    mesh = basis.mesh
    radius = np.hypot(*mesh.p)
    facets = mesh.boundary_facets()
    facets = facets[(np.abs(radius[mesh.facets[:, facets]] - 1.0) < 1e-10).all(axis=0)]
    nodes = np.unique(basis.get_dofs(facets).all())
    return nodes[np.argsort(np.arctan2(basis.doflocs[0, nodes], basis.doflocs[1, nodes]))], facets


def chain(contrast, gap, jump, radiation, refinement):
    """k/k_f of unit spheres, ``gap`` apart, in an insulated cylinder of their radius (k_f = 1).

    Half a period, z = 0 .. 1 + gap/2, whose end planes are isothermal by symmetry; one surface, one jump length.
    """
    from scipy.sparse import bmat, coo_matrix
    from scipy.sparse.linalg import spsolve
    from skfem.helpers import dot, grad

    half, n = 1.0 + 0.5 * gap, refinement
    theta = 0.5 * np.pi * np.linspace(0.0, 1.0, 6 * n + 1) ** 2
    rho = np.concatenate([np.geomspace(2e-3, 0.2, n + 3)[:-1], 1.0 - np.geomspace(0.8, 2e-3, 2 * n), [1.0]])
    t, r = np.meshgrid(theta, rho, indexing="ij")
    solid = structured(r * np.sin(t), r * np.cos(t))
    t, z = np.meshgrid(theta, np.linspace(0.0, 1.0, n + 1), indexing="ij")
    gas = structured(np.sin(t), np.cos(t) + (half - np.cos(t)) * z)
    bases = [skfem.Basis(mesh, skfem.ElementQuad2(), intorder=6) for mesh in (solid, gas)]

    @skfem.BilinearForm
    def conduction(u, v, w):
        return 2.0 * np.pi * w.x[0] * dot(grad(u), grad(v))

    @skfem.BilinearForm
    def area(u, v, w):
        return 2.0 * np.pi * w.x[0] * u * v

    @skfem.BilinearForm
    def facing(u, v, w):
        return 2.0 * np.pi * w.x[0] * np.abs(w.n[1]) * u * v

    (on_solid, _), (on_gas, facets) = (surface_of(basis) for basis in bases)
    np.testing.assert_allclose(bases[0].doflocs[:, on_solid], bases[1].doflocs[:, on_gas], atol=1e-12)
    trace = skfem.FacetBasis(gas, skfem.ElementQuad2(), facets=facets, intorder=6)
    film = area.assemble(trace)[on_gas][:, on_gas] / max(jump, 1e-9)
    glow = 2.0 * radiation * facing.assemble(trace)[on_gas][:, on_gas]  # to the mid-plane, half-way
    sizes = [basis.N for basis in bases]

    def placed(block, rows, columns, shape):
        block = block.tocoo()
        return coo_matrix((block.data, (rows[block.row], columns[block.col])), shape=shape)

    s, g = sizes
    matrix = bmat(
        [
            [
                contrast * conduction.assemble(bases[0]) + placed(film + glow, on_solid, on_solid, (s, s)),
                -placed(film, on_solid, on_gas, (s, g)),
            ],
            [
                -placed(film, on_gas, on_solid, (g, s)),
                conduction.assemble(bases[1]) + placed(film, on_gas, on_gas, (g, g)),
            ],
        ]
    ).tocsr()
    load = np.zeros(s + g)
    load[on_solid] = glow @ np.ones(on_solid.size)
    below = [np.flatnonzero(np.abs(basis.doflocs[1]) < 1e-12) for basis in bases]
    cold = np.concatenate([below[0], s + below[1]])
    hot = s + np.flatnonzero(np.abs(bases[1].doflocs[1] - half) < 1e-12)
    temperature = np.zeros(s + g)
    temperature[hot] = 1.0
    free = np.setdiff1d(np.arange(s + g), np.concatenate([cold, hot]))
    known = (load - matrix @ temperature)[free]
    temperature[free] = spsolve(matrix[free][:, free].tocsc(), known)
    return -(matrix @ temperature - load)[cold].sum() * half / np.pi


def chain_certified(*case):
    """Extrapolated in the square of the element size (chords for arcs), with the change it made."""
    coarse, fine = (chain(*case, refinement=n) for n in (8, 16))
    value = fine + (fine - coarse) / 3.0
    return value, abs(value - fine) / value


def chain_by_law(contrast, gap, jump, radiation, terms=100):
    """k/k_f of the same chain: each sphere between two opposite facets, R = 2 (h_ii - h_ij) + R_gap."""
    one, radii = np.ones(1), np.ones((1, 2))
    pair = FacingSpheres(
        (2.0 + gap) * one, one, 0.0 * one, radii, contrast * radii, one, 2.0 * jump * one, radiation * one, 0.0 * one
    )
    found = condense_pairs(pair)
    means = np.empty(terms)
    legendre_means(pair.rows[0], 0, found.shapes[0], means)
    order = np.arange(1, terms + 1)
    series = (2 * order + 1) / order * means**2 * (-1.0) ** order * np.sinc(order / (terms + 1))
    opposite = series.sum() / (4.0 * np.pi * contrast)
    resistance = 2.0 * (found.constrictions[0, 0] - opposite) + found.gaps[0]
    return (2.0 + gap) / np.pi / resistance


@pytest.mark.parametrize(
    ("contrast", "gap", "jump", "low", "high"),
    [
        (10.0, 0.05, 0.0, -0.06, -0.04),
        (100.0, 0.02, 0.0, -0.08, -0.06),
        (100.0, 0.02, 0.001, -0.08, -0.06),
        (100.0, 0.02, 0.01, -0.09, -0.06),
        (1000.0, 0.005, 0.002, -0.08, -0.05),
    ],
)
def test_chain_with_a_temperature_jump(contrast, gap, jump, low, high):
    """Straight tubes stand 5 to 9 % below, as in the simple cubic array: jumps add no error of their own."""
    certified, uncertainty = chain_certified(contrast, gap, jump, 0.0)
    assert uncertainty < 5e-4
    assert low < chain_by_law(contrast, gap, jump, 0.0) / certified - 1.0 < high


@pytest.mark.parametrize(("radiation", "tolerance"), [(10.0, 2e-3), (1.0, 0.01)])
def test_chain_that_radiates(radiation, tolerance):
    """Gas cut off by an endless jump length: only radiation crosses (what the gas carries around is taken off)."""
    certified, _ = chain_certified(100.0, 0.02, 1e9, radiation)
    around, _ = chain_certified(100.0, 0.02, 1e9, 0.0)
    assert chain_by_law(100.0, 0.02, 1e9, radiation) == pytest.approx(certified - around, rel=tolerance)


def test_radiation_and_gas_together():
    certified, _ = chain_certified(100.0, 0.02, 0.01, 1.0)
    assert chain_by_law(100.0, 0.02, 0.01, 1.0) == pytest.approx(certified, rel=0.065)
    assert chain_by_law(100.0, 0.02, 0.01, 1.0) > chain_by_law(100.0, 0.02, 0.01, 0.0)


def test_perfect_conductors_are_the_integral_of_the_tubes():
    """k_s -> inf over a facet of half the radius: sum of k_f/(g + 2 j) + h_r over rings, by quadrature."""
    from scipy.integrate import quad

    reach, gap, jump, radiation = 0.5, 0.01, 0.003, 0.7
    one, radii = np.ones(1), np.ones((1, 2))
    pair = FacingSpheres(
        (2.0 + gap) * one, reach * one, 0.0 * one, radii, 1e9 * radii, one, 2.0 * jump * one, radiation * one, 0.0 * one
    )
    found = condense_pairs(pair)

    def tube(rho):
        return 2.0 * np.pi * rho * (1.0 / (gap + 2.0 - 2.0 * np.sqrt(1.0 - rho**2) + 2.0 * jump) + radiation)

    exact = quad(tube, 0.0, reach, epsabs=0.0, epsrel=1e-12)[0]
    resistance = float(found.gaps[0] + found.constrictions.sum())
    assert 1.0 / resistance == pytest.approx(exact, rel=1e-5)


def test_radiation_scales_with_the_cube_of_the_temperature():
    """In vacuum between good conductors k is h_r times a length: exactly T^3."""
    k = [chain_by_law(1e9, 0.02, 1e12, h) for h in (1e-3, 8e-3)]
    assert k[1] / k[0] == pytest.approx(8.0, rel=1e-6)
