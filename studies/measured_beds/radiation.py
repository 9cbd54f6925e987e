"""Radiation beyond the nearest neighbours: rays through a bed against facing surfaces: ``python radiation.py beds``.

Isothermal spheres, grey and diffuse, in vacuum. Rays leave every sphere and are reflected until they are absorbed.
The exchange factor F_ij is the share of the emission of sphere i that sphere j absorbs, and 4 sigma T^3 e A_i F_ij is
the conductance of the pair, neighbour or not. The network of all pairs is solved for a mean gradient. Facet links on
the same bed include facing surfaces only. Both conductivities are printed over 4 sigma T^3 d.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from numba import njit
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.linalg import cg

from etc_engine.engines.dtem.facet_steady import facet_conductivity, uniform_material
from etc_engine.medium.facets import facet_links
from etc_engine.medium.rules import overlap_contacts
from etc_engine.particle_files.formats import read_table

RAYS = 2000
SEED = 20261
EMISSIVITIES = (0.3, 0.6, 0.8, 0.95, 1.0)


@njit(cache=True)
def trace(geometry, emissivity, rays, rng):  # type: ignore[no-untyped-def]
    """Sphere that absorbs each ray, and how far its centre is from that of the emitter; -1 for rays that are lost."""
    centers, radius = geometry[0], geometry[1]
    total = centers.shape[0] * rays
    absorber, reach = np.full(total, -1), np.empty((total, 3))
    at, direction, normal = np.empty(3), np.empty(3), np.empty(3)
    for ray in range(total):
        own = ray // rays
        centre = centers[own].copy()
        _unit(normal, rng)
        while True:
            _unit(direction, rng)  # normal + a unit vector: a cosine distribution about the normal
            direction += normal
            direction /= np.sqrt((direction**2).sum())
            at[:] = centre + radius * normal
            hit, distance, shift = first_hit(geometry, at, direction)
            if hit < 0:
                break
            centre = centers[hit] + shift
            normal[:] = (at + distance * direction - centre) / radius
            if rng.random() < emissivity:
                absorber[ray], reach[ray] = hit, centre - centers[own]
                break
    return absorber, reach


@njit(cache=True)
def first_hit(geometry, at, direction):  # type: ignore[no-untyped-def]
    """(sphere, distance, shift of its image) that a ray meets first, from cell to cell; (-1, inf, 0) if none does."""
    side, cells = geometry[2], geometry[5]
    width = side / cells
    cell = np.floor(at / width).astype(np.int64)
    for _ in range(1000):
        hit, distance, shift = hit_around(geometry, cell, at, direction)
        leave, axis = np.inf, 0
        for x in range(3):
            if direction[x] != 0.0:
                t = ((cell[x] + (direction[x] > 0.0)) * width - at[x]) / direction[x]
                if t < leave:
                    leave, axis = t, x
        if hit >= 0 and distance <= leave:
            return hit, distance, shift
        cell[axis] += 1 if direction[axis] > 0.0 else -1
    return -1, np.inf, np.zeros(3)


@njit(cache=True)
def hit_around(geometry, cell, at, direction):  # type: ignore[no-untyped-def]
    """The nearest sphere ahead of a ray among those of a cell and its 26 neighbours: all that reach into the cell."""
    centers, radius, side, near, starts, cells = geometry
    nearest, hit, shift = np.inf, -1, np.zeros(3)
    for step in range(27):
        place = cell + np.array([step // 9 - 1, step // 3 % 3 - 1, step % 3 - 1])
        image = np.floor_divide(place, cells)
        place -= image * cells
        box = (place[0] * cells + place[1]) * cells + place[2]
        for q in range(starts[box], starts[box + 1]):
            gap = at - centers[near[q]] - image * side
            b = (gap * direction).sum()
            root = b * b - (gap * gap).sum() + radius * radius
            t = -b - np.sqrt(root) if root > 0.0 else np.inf
            if 1e-7 * radius < t < nearest:
                nearest, hit = t, near[q]
                shift[:] = image * side
    return hit, nearest, shift


@njit(cache=True)
def _unit(out, rng):  # type: ignore[no-untyped-def]
    """A unit vector of any direction, in place."""
    while True:
        for k in range(3):
            out[k] = 2.0 * rng.random() - 1.0
        square = (out**2).sum()
        if 1e-6 < square <= 1.0:
            out /= np.sqrt(square)
            return


def by_rays(path: Path, emissivity: float) -> float:
    """k_r/(4 sigma T^3 d), mean over the axes."""
    packing = read_table(path).packing
    side, radius, n = float(packing.box.lengths[0]), float(packing.radii[0]), packing.count
    centers = np.mod(packing.centers, side)
    cells = int(side // (2.0 * radius))
    rank = np.floor(centers / side * cells).astype(np.int64)
    index = (rank[:, 0] * cells + rank[:, 1]) * cells + rank[:, 2]
    starts = np.concatenate([[0], np.cumsum(np.bincount(index, minlength=cells**3))])
    geometry = (centers, radius, side, np.argsort(index, kind="stable"), starts, cells)
    absorber, reach = trace(geometry, emissivity, RAYS, np.random.default_rng(SEED))
    emitter = np.repeat(np.arange(n), RAYS)
    kept = absorber >= 0
    i, j, reach = emitter[kept], absorber[kept], reach[kept]
    share = emissivity * np.pi * (2.0 * radius) ** 2 / RAYS / 2.0  # e A F_ij of one ray, halved: rays of j count too
    links = coo_matrix((np.full(i.size, share), (i, j)), shape=(n, n)).tocsr()
    links = links + links.T
    laplacian = csr_matrix(np.diag(np.asarray(links.sum(axis=1)).ravel()) - links.toarray())
    total = 0.0
    for axis in range(3):
        # least energy of a mean gradient of 1: sum over rays of share (x_j - x_i + u_j - u_i)^2
        pull = share * (np.bincount(i, reach[:, axis], n) - np.bincount(j, reach[:, axis], n))
        fluctuation, _ = cg(laplacian, pull, rtol=1e-8)
        drop = reach[:, axis] + fluctuation[j] - fluctuation[i]
        total += share * float((drop**2).sum()) / side**3
    return total / 3.0 / (2.0 * radius)


def by_facets(path: Path, emissivity: float) -> float:
    """The same of facing surfaces alone."""
    packing = read_table(path).packing
    links = facet_links(overlap_contacts(packing))
    links = replace(links, contacts=np.zeros_like(links.contacts))
    material = uniform_material(links, 1e6, 0.0, radiation=1.0 / (2.0 / emissivity - 1.0))
    tensor = facet_conductivity(links, material, tolerance=1e-8).tensor
    return float(np.trace(tensor)) / 3.0 / (2.0 * float(packing.radii[0]))


def main(folder: str) -> None:
    for path in sorted(Path(folder).glob("*.dump")):
        print(path.stem)
        for emissivity in EMISSIVITIES:
            rays, facets = by_rays(path, emissivity), by_facets(path, emissivity)
            print(f"  e = {emissivity:g}: rays {rays:.3f}, facets {facets:.3f}, ratio {rays / facets:.2f}", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
