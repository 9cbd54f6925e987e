r"""Many materials on the same facet links: temperatures, pressures or contrasts from a few full solutions.

The element matrices follow the material smoothly, and so nearly lie in the span of a few of them,

.. math:: K(\mu) \approx \sum_s c_s(\mu) K(\mu_s), \qquad T(\mu) \approx \bar T + \sum_s y_s(\mu)\, u_s,

with the same coefficients for every sphere. A sample of spheres, whose matrices are made for every material, chooses
the anchors mu_s (pivoted QR of the samples) and gives the coefficients (least squares); what the fit leaves is the
estimate of its error. The first of them are solved in full. All other materials minimize the energy in the span of the
temperatures of the first few anchors, for which only inner products u_r . K(mu_s) u_t are needed.

References: Everson, Sirovich 1995, doi:10.1364/JOSAA.12.001657 (fit on a sample); Hesthaven, Rozza, Stamm 2016,
Certified Reduced Basis Methods, doi:10.1007/978-3-319-22470-1 (affine expansion).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from etc_engine.arrays import Floats
from etc_engine.engines.dtem.element import Elements
from etc_engine.engines.dtem.facet_elements import (
    FacetMaterial,
    FacetSides,
    facet_elements,
    facet_resistances,
    facet_sides,
    sample_sides,
)
from etc_engine.engines.dtem.facet_steady import FacetSolution, lift_and_prescribed, solve_sides
from etc_engine.medium.facets import FacetLinks
from etc_engine.medium.loads import driven_walls

SAMPLE = 48
"""Spheres of the sample."""
FEW_MATERIALS = 6
"""Fewer materials are solved one by one."""
SNAPSHOTS = 6
"""Anchors that are solved in full; temperatures follow the material more smoothly than the matrices do."""
WORTHWHILE = 0.6
"""With more anchors than this part of the materials every one is solved in full."""


@dataclass(frozen=True, eq=False)
class FamilyMember:
    """Conduction with one of the materials.

    Parameters
    ----------
    energies : ndarray, shape (k, k)
        As in `FacetSolution`.
    relative_error : float
        Estimated relative error of the energies by the fit and the reduced basis; 0 for a full solution.
    solution : FacetSolution or None
        Where it was solved in full.
    anchors : int
        Full sets of matrices behind it.
    """

    energies: Floats
    relative_error: float
    solution: FacetSolution | None
    anchors: int


def solve_family(
    links: FacetLinks,
    materials: Sequence[FacetMaterial],
    axes: tuple[int, ...],
    *,
    tolerance: float = 1e-10,
    accuracy: float = 2e-4,
) -> list[FamilyMember]:
    """Energies of all materials, in order.

    Parameters
    ----------
    links : FacetLinks
    materials : sequence of FacetMaterial
    axes : tuple of int
        As in `etc_engine.engines.dtem.facet_steady.solve_facets`.
    tolerance : float
        Relative error of the energy left by the solver of the anchors.
    accuracy : float
        Relative error that the fit may leave in the matrices of the sample; the energies are 5 to 50 times closer.

    Returns
    -------
    list of FamilyMember

    Raises
    ------
    InputError, GeometryError, ConvergenceError

    Notes
    -----
    Few materials, and packings below 192 spheres, are solved one by one. Results depend on what else is in the list by
    no more than ``relative_error``.
    """
    members: dict[int, FamilyMember] = {}
    for columns in (True, False):  # without a fluid there are no columns, and fewer nodes
        rows = [row for row, m in enumerate(materials) if bool((m.open_fluid > 0.0).all()) is columns]
        if rows:
            sides = facet_sides(links, driven_walls(links, axes), columns)
            found = _solve_alike(links, [materials[row] for row in rows], axes, sides, (tolerance, accuracy))
            members.update(zip(rows, found, strict=True))
    return [members[row] for row in range(len(materials))]


def _solve_alike(
    links: FacetLinks,
    materials: Sequence[FacetMaterial],
    axes: tuple[int, ...],
    sides: FacetSides,
    limits: tuple[float, float],
) -> list[FamilyMember]:
    """A family whose materials have the same nodes; ``limits``: tolerance of the solver and accuracy of the fit."""
    anchors, coefficients, misfit = _choose_anchors(links, materials, sides, limits[1])
    solutions: dict[int, FacetSolution] = {}
    elements: list[Elements] = []
    last: FacetSolution | None = None
    snapshots = anchors if len(anchors) == len(materials) else anchors[:SNAPSHOTS]
    for row in anchors:
        if row in snapshots:
            last, own = solve_sides(links, materials[row], axes, sides, tolerance=limits[0], nearby=last)
            solutions[row] = last
        else:
            own = facet_elements(sides, facet_resistances(links, materials[row], sides))
        elements.append(own)
    found = {row: FamilyMember(s.energies, 0.0, s, len(anchors)) for row, s in solutions.items()}
    if len(found) < len(materials):
        lift = lift_and_prescribed(links, sides, axes)[0]
        products = _reduced_products(lift, list(solutions.values()), elements)
        floor = 0.05 * float(misfit.max())  # a fit to the sample does not fit all the others as closely
        for row in range(len(materials)):
            if row not in found:
                mixed = np.tensordot(coefficients[:, row], products, axes=1)
                energies = _least_energy(mixed, len(axes), mixed.shape[0])
                fewer = _least_energy(mixed, len(axes), mixed.shape[0] - len(axes))
                apart = float(np.abs(fewer - energies).max() / np.abs(energies).max())
                found[row] = FamilyMember(energies, max(float(misfit[row]), floor, apart), None, len(anchors))
    return [found[row] for row in range(len(materials))]


def _choose_anchors(
    links: FacetLinks, materials: Sequence[FacetMaterial], sides: FacetSides, accuracy: float
) -> tuple[list[int], Floats, Floats]:
    """Rows of the anchors, coefficients c_s of every material, shape (anchors, materials), and what the fit leaves.

    All materials are anchors where a sample would not pay.
    """
    count, spheres = len(materials), sides.spheres.size
    everyone = list(range(count)), np.eye(count), np.zeros(count)
    if count < FEW_MATERIALS or spheres < 4 * SAMPLE:
        return everyone
    sample = sample_sides(sides, np.linspace(0, spheres - 1, SAMPLE).astype(np.int64))
    samples = np.array(
        [facet_elements(sample, facet_resistances(links, material, sample)).values for material in materials]
    ).T
    norms = np.linalg.norm(samples, axis=0)
    matrix = samples / norms
    small, order = qr(matrix, mode="r", pivoting=True)
    small = small[:count, np.argsort(order)]  # the same inner products in few rows
    for size in range(1, int(WORTHWHILE * count) + 1):
        anchors = order[:size]
        scaled = np.linalg.lstsq(small[:, anchors], small, rcond=None)[0]
        misfit = np.linalg.norm(small - small[:, anchors] @ scaled, axis=0)
        if misfit.max() <= accuracy:
            return [int(row) for row in anchors], scaled * norms / norms[anchors, None], misfit
    return everyone


def _reduced_products(lift: Floats, solutions: Sequence[FacetSolution], elements: Sequence[Elements]) -> Floats:
    """B^T K_s B of every anchor s, shape (anchors, r, r): B is the lift, and an orthonormal basis of the rest."""
    beyond = np.concatenate([solution.temperatures - lift for solution in solutions], axis=1)
    basis = np.concatenate([lift, np.linalg.qr(beyond)[0]], axis=1)
    return np.array([basis.T @ own.apply(basis) for own in elements])


def _least_energy(products: Floats, loads: int, size: int) -> Floats:
    """Energies of the loads, least over the first ``size`` vectors of the basis."""
    inner, cross = products[loads:size, loads:size], products[loads:size, :loads]
    y = np.linalg.lstsq(inner, -cross, rcond=1e-14)[0]
    energies = products[:loads, :loads] + cross.T @ y
    return np.asarray(0.5 * (energies + energies.T))
