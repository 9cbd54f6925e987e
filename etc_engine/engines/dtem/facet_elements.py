r"""Spheres in a fluid as thermal elements: the facets of a sphere's Laguerre cell are its nodes.

Every facet carries one flux shape, condensed from rings by `etc_engine.laws.rings`. With its Legendre means a_l,

.. math:: H_{ij} = \frac{1}{4\pi\kappa R}\Bigl[\sum_{l=1}^{L}\frac{2l+1}{l}\,a^i_l a^j_l\,P_l(n_i\cdot n_j)\,
   \mathrm{sinc}\frac{l}{L+1} + 3 f\,a^i_1 a^j_1\,n_i\cdot(S^{-1}-I)\,n_j\Bigr], \qquad
   S = \sum_j n_j n_j^T\,\tfrac12(1-\cos^3\psi_j), \qquad f = \Bigl(\frac{2k_f}{k_f+\kappa}\Bigr)^{5/4},

and H_ii = h_i, from the rings, plus the same second term. The sinc damps the ripple of the cut series. The second term
mends l = 1: the caps of equal area overlap a little, or leave gaps, where the facets tile the sphere (then S = I).
Without it k is 20 % too low at kappa = k_f; with f = 1 it is 10 % too high at kappa = 10 k_f. The exponent was chosen
on body- and face-centred cubic arrays and one random packing, contrast 2 to 30.

The fluid's R_gap is shared by the two sides like the resistance of a contact. A *column* is the part of a facet beyond
the sphere, or a facet too small for rings: a tube of fluid from centre to centre. Its node sees the mean temperature of
the sphere: a zero row of H, its resistance aside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etc_engine.engines.dtem.element import Elements, Resistances, condense, packed_starts
from etc_engine.errors import GeometryError, InputError
from etc_engine.laws.rings import WIDEST_CONTACT, FacingSpheres, condense_pairs, legendre_means
from etc_engine.medium.facets import FacetLinks

TERMS = 64
"""Legendre terms between two facets, L."""
SMALL_FACET = 0.02
"""Facets below this part of the squared radius of the smaller sphere are columns alone."""
REPAIR_POWER = 1.25
WIDE_CONTACT = np.sin(np.radians(30.0))
"""Contacts wider than this, in radii, may overlap other facets of their sphere."""
HALVINGS = 30
_NEGLIGIBLE_COLUMN = 1e-9  # in squared radii


@dataclass(frozen=True, eq=False)
class FacetMaterial:
    """What spheres and pores are made of.

    Parameters
    ----------
    conductivity : ndarray, shape (n,) [W/(m K)]
        Of each sphere.
    fluid : ndarray, shape (m + w,) [W/(m K)]
        Conductivity of the continuum fluid in each link, between spheres first, at walls after them.
    open_fluid : ndarray, shape (m + w,) [W/(m K)]
        Of the fluid in the open pore beyond the spheres, the columns; below `fluid` where the gas is rarefied.
    jumps : ndarray, shape (m + w,) [m]
        Temperature jump lengths of a link, both surfaces together.
    radiation : ndarray, shape (m + w,) [W/(m2 K)]
        Radiative conductance per facing area of each link.
    """

    conductivity: NDArray[np.float64]
    fluid: NDArray[np.float64]
    open_fluid: NDArray[np.float64]
    jumps: NDArray[np.float64]
    radiation: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FacetSides:
    """Nodes of a packing as each sphere sees them, sorted by sphere.

    Parameters
    ----------
    offsets : ndarray of int, shape (n + 1,)
        The sides of sphere p are rows ``offsets[p]`` to ``offsets[p + 1]``.
    nodes : ndarray of int, shape (s,)
        Node of each side: facets and columns between spheres first, those at driven walls after them.
    ends : ndarray of int, shape (s,)
        0 or 1: which sphere of its link this is.
    normals : ndarray, shape (s, 3)
        Unit vectors from the centre through the facet.
    arms : ndarray, shape (s, 3) [m]
        Vectors towards the facet; at the two sides of a link they differ by the branch vector.
    links : ndarray of int, shape (nodes,)
        Link of each node.
    columns : ndarray, shape (nodes,) [m2]
        Area of a column; 0 for a node with rings.
    spheres : ndarray of int, shape (n,)
        The sphere of each element.
    """

    offsets: NDArray[np.int64]
    nodes: NDArray[np.int64]
    ends: NDArray[np.int64]
    normals: NDArray[np.float64]
    arms: NDArray[np.float64]
    links: NDArray[np.int64]
    columns: NDArray[np.float64]
    spheres: NDArray[np.int64]


def facet_sides(links: FacetLinks, driven: NDArray[np.bool_], fluid: bool = True) -> FacetSides:
    """Nodes and sides of all links between spheres and of those with a driven wall.

    Parameters
    ----------
    links : FacetLinks
    driven : ndarray of bool, shape (w,)
        Wall facets whose wall has a temperature.
    fluid : bool
        Whether there are columns of fluid; without it heat crosses the pores by radiation alone.
    """
    radii, m, small = links.packing.radii, links.count, links.smaller_radii
    area = np.concatenate([links.areas, links.wall_areas])
    wide = (area >= SMALL_FACET * small**2) | (links.contacts > 0.0)
    column = np.where(wide, area - np.pi * small**2, area)
    piped = (column > _NEGLIGIBLE_COLUMN * small**2) & fluid
    live = np.concatenate([np.ones(m, dtype=np.bool_), driven])
    groups = [np.flatnonzero(flags & live) for flags in (wide, piped)]
    of_links = np.concatenate([g[g < m] for g in groups] + [g[g >= m] for g in groups])
    is_column = np.concatenate([np.full(int(np.sum(side)), kind) for side, kind in _kinds(groups, m)])
    between = int((of_links < m).sum())
    pairs, walls = links.pairs[of_links[:between]], of_links[between:] - m
    share = radii[pairs[:, :1]] / radii[pairs].sum(axis=1, keepdims=True)
    branches = links.branches[of_links[:between]]
    toward = links.wall_normals[walls] * links.wall_distances[walls, None]
    owner = np.concatenate([pairs[:, 0], pairs[:, 1], links.wall_particles[walls]])
    arms = np.concatenate([branches * share, -branches * (1.0 - share), toward])
    order = np.argsort(owner, kind="stable")
    count = np.arange(of_links.size)
    arms = arms[order]
    return FacetSides(
        np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=radii.size))]),
        np.concatenate([count[:between], count])[order],
        np.concatenate([np.zeros(between, np.int64), np.ones(between, np.int64), np.zeros(walls.size, np.int64)])[
            order
        ],
        arms / np.linalg.norm(arms, axis=1, keepdims=True),
        arms,
        of_links,
        np.where(is_column, column[of_links], 0.0),
        np.arange(radii.size),
    )


def sample_sides(sides: FacetSides, elements: NDArray[np.int64]) -> FacetSides:
    """The sides of some spheres alone; links to other spheres stay, with one side."""
    sizes = np.diff(sides.offsets)[elements]
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    rows = np.repeat(sides.offsets[elements] - offsets[:-1], sizes) + np.arange(offsets[-1])
    kept, nodes = np.unique(sides.nodes[rows], return_inverse=True)
    return FacetSides(
        offsets,
        nodes.reshape(-1),
        sides.ends[rows],
        sides.normals[rows],
        sides.arms[rows],
        sides.links[kept],
        sides.columns[kept],
        sides.spheres[elements],
    )


def _kinds(groups: list[NDArray[np.int64]], m: int) -> list[tuple[NDArray[np.bool_], bool]]:
    """The four runs of nodes, rings and columns between spheres and at walls, and which are columns."""
    rings, pipes = groups
    return [(rings < m, False), (pipes < m, True), (rings >= m, False), (pipes >= m, True)]


def facing_spheres(links: FacetLinks, material: FacetMaterial, rows: NDArray[np.int64]) -> FacingSpheres:
    """The links ``rows`` as pairs of facing spheres; a wall link is half of the sphere and its mirror image."""
    m, radii = links.count, links.packing.radii
    wall = rows >= m
    ends = np.empty((rows.size, 2), dtype=np.int64)
    ends[~wall] = links.pairs[rows[~wall]]
    ends[wall] = links.wall_particles[rows[wall] - m, None]
    area = np.concatenate([links.areas, links.wall_areas])[rows]
    twice = np.where(wall, 2.0, 1.0)
    contacts = np.minimum(links.contacts[rows], WIDEST_CONTACT * links.smaller_radii[rows])
    return FacingSpheres(
        twice * links.lengths[rows],
        np.minimum(np.maximum(np.sqrt(area / np.pi), contacts), links.smaller_radii[rows]),
        contacts,
        radii[ends],
        material.conductivity[ends],
        material.fluid[rows],
        twice * material.jumps[rows],
        material.radiation[rows] / twice,
        twice * links.bonds[rows],
    )


def facet_resistances(links: FacetLinks, material: FacetMaterial, sides: FacetSides) -> Resistances:
    """Resistance matrices H of all spheres [K/W], half of the fluid's R_gap included; moments are a_1 n.

    Raises
    ------
    InputError
        If a link has neither fluid nor radiation, or a value is out of range.
    """
    if not (material.fluid + material.radiation > 0.0).all():
        raise InputError("facet links need pores that conduct: a fluid of conductivity > 0, or radiation")
    ringed = np.flatnonzero(sides.columns == 0.0)
    facing = facing_spheres(links, material, sides.links[ringed])
    condensed = condense_pairs(facing)
    pair = np.full(sides.links.size, -1, dtype=np.int64)
    pair[ringed] = np.arange(ringed.size)
    added = np.zeros(sides.links.size)
    added[ringed] = 0.5 * condensed.gaps  # half on either side; at a wall half of the mirrored pair
    tubes = np.flatnonzero(sides.columns > 0.0)
    of_tubes = sides.links[tubes]
    share = np.where(of_tubes < links.count, 0.5, 1.0)
    added[tubes] = share * links.lengths[of_tubes] / (material.open_fluid[of_tubes] * sides.columns[tubes])
    starts = packed_starts(sides.offsets)
    values, moments = np.zeros(int(starts[-1])), np.empty((sides.nodes.size, 3))
    l = np.arange(1, TERMS + 1)
    kappa, radii = material.conductivity[sides.spheres], links.packing.radii[sides.spheres]
    pores = material.open_fluid[sides.links[sides.nodes]]
    pores = np.add.reduceat(pores, sides.offsets[:-1]) / np.diff(sides.offsets)
    factor = (2.0 * pores / (pores + kappa)) ** REPAIR_POWER
    uneven = np.linalg.inv(links.overlap_of_caps[sides.spheres]) - np.eye(3)
    _fill(
        (sides.offsets, pair[sides.nodes], sides.ends, sides.normals, added[sides.nodes]),
        np.ascontiguousarray(facing.rows),
        (condensed.shapes, condensed.constrictions),
        1.0 / (4.0 * np.pi * kappa * radii),
        factor[:, None, None] * uneven,
        (2 * l + 1) / l * np.sinc(l / (TERMS + 1)),
        starts,
        (values, moments),
    )
    return Resistances(1, starts, values, moments)


@njit(cache=True)
def _fill(sides, rows, condensed, scales, repair, weights, starts, out):  # type: ignore[no-untyped-def]
    """H_ij = scale [sum_l weight_l a_l^i a_l^j P_l(n_i.n_j) + 3 a_1^i a_1^j n_i.repair n_j], H_ii from the rings."""
    offsets, pairs, ends, normals, added = sides
    shapes, constrictions = condensed
    values, moments = out
    terms = weights.size
    widest = 1
    for p in range(offsets.size - 1):
        widest = max(widest, offsets[p + 1] - offsets[p])
    means, by_term = np.empty(terms), np.zeros((terms, widest))
    room = widest * (widest - 1) // 2 + 1
    cosine, lower, upper, total = np.empty(room), np.empty(room), np.empty(room), np.empty(room)
    for p in range(offsets.size - 1):
        first, n = offsets[p], offsets[p + 1] - offsets[p]
        q = 0
        for i in range(n):
            a = first + i
            if pairs[a] >= 0:
                legendre_means(rows[pairs[a]], ends[a], shapes[pairs[a]], means)
            for l in range(terms):
                by_term[l, i] = means[l] if pairs[a] >= 0 else 0.0
            for j in range(i):
                b = first + j
                cosine[q] = (
                    normals[a, 0] * normals[b, 0] + normals[a, 1] * normals[b, 1] + normals[a, 2] * normals[b, 2]
                )
                lower[q], upper[q], total[q] = 1.0, cosine[q], 0.0
                q += 1
        for l in range(1, terms + 1):
            one, two = (2 * l + 1) / (l + 1), l / (l + 1)
            q = 0
            for i in range(n):
                factor = weights[l - 1] * by_term[l - 1, i]
                for j in range(i):
                    total[q + j] += factor * by_term[l - 1, j] * upper[q + j]
                    above = one * cosine[q + j] * upper[q + j] - two * lower[q + j]
                    lower[q + j] = upper[q + j]
                    upper[q + j] = above
                q += i
        q = 0
        for i in range(n):
            a = first + i
            for x in range(3):
                moments[a, x] = by_term[0, i] * normals[a, x]
            for j in range(i + 1):
                b = first + j
                mend = 0.0
                for x in range(3):
                    for y in range(3):
                        mend += normals[a, x] * repair[p, x, y] * normals[b, y]
                mend *= 3.0 * by_term[0, i] * by_term[0, j] * scales[p]
                if i == j:
                    mend += added[a]
                    if pairs[a] >= 0:
                        mend += constrictions[pairs[a], ends[a]]
                else:
                    mend += scales[p] * total[q]
                    q += 1
                values[starts[p] + i * n + j] = mend
                values[starts[p] + j * n + i] = mend


def facet_elements(sides: FacetSides, h: Resistances) -> Elements:
    """Conductivity matrices K_e = P (P^T H P)^-1 P^T of all spheres.

    Where H is not positive definite (walls or contacts cut a sphere so deep that its facets overlap), the coupling
    between the facets of that sphere is halved, in ``h`` too, until it is; `weakened_spheres` counts such spheres.

    Raises
    ------
    GeometryError
        If that does not help.
    """
    values = np.zeros_like(h.values)
    bad = _invert(sides.offsets, h.starts, h.values, values)
    if bad >= 0:
        raise GeometryError(
            f"the resistance matrix of sphere {sides.spheres[bad]} with {sides.offsets[bad + 1] - sides.offsets[bad]} "
            f"facets is not positive definite: walls or contacts cut too much of it off; use smaller contacts"
        )
    return Elements(1, sides.offsets, sides.nodes, h.starts, values)


@njit(cache=True)
def _invert(
    offsets: NDArray[np.int64], starts: NDArray[np.int64], resistances: NDArray[np.float64], values: NDArray[np.float64]
) -> int:
    """K_e of every element; halves H_ij, i != j, of those that are not positive definite. Returns a failure, or -1."""
    for p in range(offsets.size - 1):
        n = offsets[p + 1] - offsets[p]
        if n < 2:
            continue
        h = resistances[starts[p] : starts[p + 1]].reshape((n, n))
        for attempt in range(HALVINGS + 1):
            if condense(h, n, 1, np.empty((n, n)), values[starts[p] : starts[p + 1]]):
                break
            if attempt == HALVINGS:
                return p
            weaken(h)
    return -1


@njit(cache=True)
def weaken(h: NDArray[np.float64]) -> None:
    """Halve the coupling between the facets of one sphere, in place; raise what resists less than nothing.

    The disk of a sphere cut near its middle has h < 0 in the gauge of the law; it takes the smallest h > 0 there is.
    """
    least = np.inf
    for i in range(h.shape[0]):
        if h[i, i] > 0.0:
            least = min(least, h[i, i])
    for i in range(h.shape[0]):
        h[i, i] = max(h[i, i], least)
        for j in range(i):
            h[i, j] *= 0.5
            h[j, i] = h[i, j]


def weakened_spheres(links: FacetLinks, material: FacetMaterial, sides: FacetSides, h: Resistances) -> int:
    """Number of spheres whose coupling was halved: their matrices are not those of the law any more."""
    widest = np.zeros(sides.spheres.size)
    np.maximum.at(widest, np.repeat(sides.spheres, np.diff(sides.offsets)), links.contacts[sides.links[sides.nodes]])
    doubtful = np.flatnonzero(widest > WIDE_CONTACT * links.packing.radii[sides.spheres])
    if not doubtful.size:
        return 0
    sample = sample_sides(sides, doubtful)
    fresh = facet_resistances(links, material, sample)
    used = np.concatenate([h.values[h.starts[p] : h.starts[p + 1]] for p in doubtful])
    changed = np.add.reduceat((fresh.values != used).astype(np.int64), fresh.starts[:-1])
    return int(np.count_nonzero(changed))
