"""Finite elements of our own for disks in contact, with a resistance on every contact chord and driven wall.

Quadratic triangles on the union of the cut disks, curved at the rims and graded into the ends of the chords. The two
sides of a chord have their own nodes. The energy of the solution is an upper bound of the conductivity, up to the rims,
which are parabolas.
"""

from __future__ import annotations

import numpy as np
import skfem
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve
from scipy.spatial import cKDTree
from skfem.helpers import dot, grad

FACET_MASS = np.array([[4.0, -1.0, 2.0], [-1.0, 4.0, 2.0], [2.0, 2.0, 16.0]]) / 30.0
WALL_ANGLES = (np.pi, 0.0, -0.5 * np.pi, 0.5 * np.pi)


def conductivity_along_x(network, films, kappa, grading, smallest):
    """Conductivity between walls at 1 and 0; ``films`` [m2 K/W] of each contact and then each wall contact."""
    packing = network.packing
    mesh, corners = _fans(network)
    tree = cKDTree(mesh.p[:, corners].T)
    while True:
        ends = mesh.p[:, mesh.t]
        size = np.max([np.hypot(*(ends[:, i] - ends[:, j])) for i, j in ((0, 1), (1, 2), (2, 0))], axis=0)
        away = np.min([tree.query(ends[:, i].T)[0] for i in range(3)], axis=0) + 0.3 * size
        coarse = np.flatnonzero((size > grading * away) & (size > smallest))
        if coarse.size == 0:
            break
        mesh = _on_rims(mesh.refined(coarse), packing)
    owner = _owners(mesh, packing.count)
    used, triangles = np.unique(mesh.t + owner * mesh.nvertices, return_inverse=True)
    split = skfem.MeshTri(
        np.ascontiguousarray(mesh.p[:, used % mesh.nvertices]), np.ascontiguousarray(triangles.reshape(mesh.t.shape))
    )
    return _solve(network, np.asarray(films), np.broadcast_to(kappa, (packing.count,)), split, used // mesh.nvertices)


def _fans(network):
    """Every cut disk as triangles from its centre, and the ends of all chords."""
    packing, points, triangles, owner, known, corners = network.packing, [], [], [], {}, set()

    def vertex(z):
        key = tuple(np.round(z, 9))
        if key not in known:
            known[key] = len(points)
            points.append(z)
        return known[key]

    for p in range(packing.count):
        centre, radius = packing.centers[p], packing.radii[p]

        def at(angle, share=1.0, centre=centre, radius=radius):
            return vertex(centre + share * radius * np.array([np.cos(angle), np.sin(angle)]))

        cuts, ring = _cuts(network, p), []
        for k, (theta, alpha) in enumerate(cuts):
            ends = at(theta - alpha), at(theta + alpha)
            corners |= set(ends)
            low, following = theta + alpha, cuts[(k + 1) % len(cuts)]
            high = following[0] - following[1] + (2.0 * np.pi if k == len(cuts) - 1 else 0.0)
            steps = max(2, int(np.ceil((high - low) / 0.5)))
            rim = [at(low + (high - low) * n / steps) for n in range(1, steps)]
            ring += [ends[0], at(theta, np.cos(alpha)), ends[1], *rim]
        middle = vertex(centre)
        triangles += [(middle, a, b) for a, b in zip(ring, ring[1:] + ring[:1], strict=True)]
        owner += [p] * len(ring)
    mesh = skfem.MeshTri(np.array(points).T.copy(), np.array(triangles).T.copy())
    parts = {str(p): np.flatnonzero(np.array(owner) == p) for p in range(packing.count)}
    return mesh.with_subdomains(parts), np.array(sorted(corners))


def _cuts(network, p):
    cuts = []
    for (i, j), (a, b), (x, y) in zip(network.pairs, network.angles, network.branches, strict=True):
        cuts += [(np.arctan2(y, x), a)] * int(i == p) + [(np.arctan2(-y, -x), b)] * int(j == p)
    walls = zip(network.wall_particles, network.walls, network.wall_angles, strict=True)
    cuts += [(WALL_ANGLES[wall], alpha) for q, wall, alpha in walls if q == p]
    return sorted((theta % (2.0 * np.pi), alpha) for theta, alpha in cuts)


def _owners(mesh, count):
    owner = np.empty(mesh.nelements, dtype=int)
    for p in range(count):
        owner[mesh.subdomains[str(p)]] = p
    return owner


def _on_wall(ends, lengths):
    return any(
        np.allclose(ends[a], value, rtol=0.0, atol=1e-12) for a, length in enumerate(lengths) for value in (0.0, length)
    )


def _on_rims(mesh, packing):
    """The mesh with the vertices of its rims on their circles."""
    owner, moved = _owners(mesh, packing.count), mesh.p.copy()
    for facet in mesh.boundary_facets():
        if not _on_wall(mesh.p[:, mesh.facets[:, facet]], packing.box.lengths):
            p = owner[mesh.f2t[0, facet]]
            away = mesh.p[:, mesh.facets[:, facet]] - packing.centers[p][:, None]
            moved[:, mesh.facets[:, facet]] = packing.centers[p][:, None] + packing.radii[p] * away / np.hypot(*away)
    return skfem.MeshTri(moved, np.ascontiguousarray(mesh.t)).with_subdomains(mesh.subdomains)


def _solve(network, films, kappa, mesh, owner):
    packing, m = network.packing, network.count
    width, height = packing.box.lengths
    curved = skfem.MeshTri2.from_mesh(mesh)
    places, facing, at_walls = curved.doflocs.copy(), {}, []
    for facet in mesh.boundary_facets():
        ends = mesh.p[:, mesh.facets[:, facet]]
        if _on_wall(ends, packing.box.lengths):
            at_walls.append(facet)
        else:
            facing.setdefault(tuple(np.round(ends.mean(axis=1), 11)), []).append(facet)
    for facet in (own[0] for own in facing.values() if len(own) == 1):
        p = owner[mesh.facets[0, facet]]
        away = mesh.p[:, mesh.facets[:, facet]].mean(axis=1) - packing.centers[p]
        places[:, mesh.nvertices + facet] = packing.centers[p] + packing.radii[p] * away / np.hypot(*away)
    mesh2 = skfem.MeshTri2(places, curved.t)
    basis = skfem.Basis(mesh2, skfem.ElementTriP2(), intorder=6)

    @skfem.BilinearForm
    def conduction(u, v, w):
        return w["kappa"] * dot(grad(u), grad(v))

    constant = skfem.Basis(mesh2, skfem.ElementTriP0(), intorder=6)
    stiffness = conduction.assemble(basis, kappa=constant.interpolate(kappa[owner[mesh.t[0]]].astype(float)))

    def nodes(facet, turned=False):
        ends = mesh.facets[::-1, facet] if turned else mesh.facets[:, facet]
        return [*basis.nodal_dofs[0][ends], basis.facet_dofs[0][facet]]

    def length(facet):
        return np.hypot(*(mesh.p[:, mesh.facets[0, facet]] - mesh.p[:, mesh.facets[1, facet]]))

    between = {tuple(pair): films[c] for c, pair in enumerate(network.pairs.tolist())}
    walls = zip(network.wall_particles.tolist(), network.walls.tolist(), strict=True)
    to_wall = {key: films[m + c] for c, key in enumerate(walls)}
    blocks, rhs, energy = [], np.zeros(basis.N), 0.0
    for a, b in (own for own in facing.values() if len(own) == 2):
        first, second = sorted((a, b), key=lambda f: owner[mesh.facets[0, f]])
        film = between[(owner[mesh.facets[0, first]], owner[mesh.facets[0, second]])]
        apart = mesh.p[:, mesh.facets[0, first]] - mesh.p[:, mesh.facets[0, second]]
        mass = FACET_MASS * length(first) / film
        turned = np.hypot(*apart) > 0.5 * length(first)
        blocks.append((nodes(first) + nodes(second, turned), np.block([[mass, -mass], [-mass, mass]])))
    for facet in at_walls:
        for wall, at in enumerate((0.0, width)):
            if np.allclose(mesh.p[0, mesh.facets[:, facet]], at, rtol=0.0, atol=1e-12):
                mass = FACET_MASS * length(facet) / to_wall[(owner[mesh.facets[0, facet]], wall)]
                blocks.append((nodes(facet), mass))
                rhs[nodes(facet)] += mass.sum(axis=1) * (1.0 - wall)
                energy += mass.sum() * (1.0 - wall)
    rows = np.concatenate([np.repeat(own, len(own)) for own, _ in blocks])
    columns = np.concatenate([np.tile(own, len(own)) for own, _ in blocks])
    values = np.concatenate([block.ravel() for _, block in blocks])
    matrix = (stiffness + coo_matrix((values, (rows, columns)), stiffness.shape)).tocsc()
    energy -= float(rhs @ spsolve(matrix, rhs))
    return energy * width / height
