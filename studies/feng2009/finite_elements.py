"""Fine finite-element reference of two transients: two disks, and the 12-particle assembly of Feng et al. 2008.

``python studies/feng2009/finite_elements.py`` writes reference_two.csv and reference_twelve.csv: mean temperatures
of the particles, each cut at its contact chords, and the heat flows through the driven walls. It needs scikit-fem and
gmsh (``pip install scikit-fem gmsh``), which nothing else here does.

The union of the disks inside the box is meshed with quadratic curved triangles, graded into the corners at the ends of
the contact chords and towards the driven walls, where the flux is singular. Time: SDIRK2 (L-stable, order 2) with
steps that grow in proportion to the time.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import gmsh
import numpy as np
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementTriP2, LinearForm, MeshTri, MeshTri2
from skfem.helpers import dot, grad

from etc_engine import ContactNetwork

sys.path.insert(0, str(Path(__file__).parent))
from cases import CASES, FOURIER, HERE, Case

GAMMA = 1.0 - np.sqrt(0.5)
COARSE, CORNER = 0.08, 2e-4  # element sizes in radii
CHORD = 0.12  # in half-widths of the chord, at its middle
STEPS = 6  # of each output interval


@BilinearForm
def stiffness(u, v, _):
    return dot(grad(u), grad(v))


@BilinearForm
def mass(u, v, _):
    return u * v


@LinearForm
def area(v, _):
    return v


def outlines(network: ContactNetwork) -> list[list[tuple[float, float, float, float]]]:
    """(theta, alpha, x, y of the chord's middle) of every cut of every disk, by angle."""
    packing = network.packing
    cuts: list[list[tuple[float, float, float, float]]] = [[] for _ in range(packing.count)]

    def add(p: int, theta: float, alpha: float) -> None:
        reach = packing.radii[p] * np.cos(alpha)
        middle = packing.centers[p] + reach * np.array([np.cos(theta), np.sin(theta)])
        cuts[p].append((theta % (2 * np.pi), alpha, *middle))

    for (i, j), (a, b), (dx, dy) in zip(network.pairs, network.angles, network.branches, strict=True):
        add(i, np.arctan2(dy, dx), a)
        add(j, np.arctan2(-dy, -dx), b)
    for p, wall, alpha in zip(network.wall_particles, network.walls, network.wall_angles, strict=True):
        add(p, (np.pi, 0.0, -0.5 * np.pi, 0.5 * np.pi)[wall], alpha)
    return [sorted(own) for own in cuts]


def make_mesh(network: ContactNetwork, refine: float) -> tuple[MeshTri2, np.ndarray]:
    """Curved triangles, and the particle of each."""
    corners, nodes, owners = straight_triangles(network, refine)
    straight = MeshTri(nodes, corners)
    curved = MeshTri2.from_mesh(straight)
    doflocs = curved.doflocs.copy()
    packing = network.packing
    for facet in straight.boundary_facets():
        ends = straight.p[:, straight.facets[:, facet]]
        p = owners[straight.f2t[0, facet]]
        away = ends - packing.centers[p][:, None]
        if np.allclose(np.hypot(*away), packing.radii[p], rtol=1e-8) and not on_wall(network, ends):
            middle = away.mean(axis=1)
            doflocs[:, straight.nvertices + facet] = packing.centers[p] + packing.radii[p] * middle / np.hypot(*middle)
    return MeshTri2(doflocs, curved.t), owners


def straight_triangles(network: ContactNetwork, refine: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners of the triangles (3, m), nodes (2, k), and the particle of each triangle (m,)."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    shared = Shared()
    surfaces = [outline_surface(network, p, cuts, shared, refine) for p, cuts in enumerate(outlines(network))]
    gmsh.model.geo.synchronize()
    gmsh.model.mesh.generate(2)
    tags, nodes, _ = gmsh.model.mesh.getNodes()
    triangles = [gmsh.model.mesh.getElements(2, surface)[2][0].reshape(-1, 3) for surface in surfaces]
    gmsh.finalize()
    owners = np.repeat(np.arange(len(triangles)), [len(own) for own in triangles])
    used, corners = np.unique(np.concatenate(triangles), return_inverse=True)
    order = np.argsort(tags)
    xy = nodes.reshape(-1, 3)[order[np.searchsorted(tags[order], used)], :2]
    return np.ascontiguousarray(corners.reshape(-1, 3).T), np.ascontiguousarray(xy.T), owners


@dataclass
class Shared:
    """Points and chords that neighbouring disks have in common."""

    points: list[tuple[float, float, int]] = field(default_factory=list)
    chords: dict[tuple[int, int], tuple[int, int]] = field(default_factory=dict)

    def point(self, x: float, y: float, size: float) -> int:
        """The point there, made if there is none."""
        for px, py, tag in self.points:
            if np.hypot(px - x, py - y) < 1e-9:
                return tag
        self.points.append((x, y, gmsh.model.geo.addPoint(x, y, 0.0, size)))
        return self.points[-1][2]


def outline_surface(
    network: ContactNetwork, p: int, cuts: list[tuple[float, float, float, float]], shared: Shared, refine: float
) -> int:
    """The surface of one disk between its chords."""
    geo = gmsh.model.geo
    (cx, cy), radius = network.packing.centers[p], network.packing.radii[p]
    center = geo.addPoint(cx, cy, 0.0, COARSE * radius * refine)

    def rim(angle: float, share: float) -> int:
        return shared.point(cx + radius * np.cos(angle), cy + radius * np.sin(angle), share * radius * refine)

    loop = []
    for k, (theta, alpha, mx, my) in enumerate(cuts):
        following = cuts[(k + 1) % len(cuts)]
        low, high = theta + alpha, following[0] - following[1]
        high += 2 * np.pi * (high < low)
        first, last = rim(theta - alpha, CORNER), rim(low, CORNER)
        key = (min(first, last), max(first, last))
        if key not in shared.chords:
            middle = shared.point(mx, my, CHORD * radius * np.sin(alpha) * refine)
            shared.chords[key] = (geo.addLine(key[0], middle), geo.addLine(middle, key[1]))
        one, other = shared.chords[key]
        loop += [one, other] if first == key[0] else [-other, -one]
        # three arcs, so that the mesh may be coarse between corners
        stops = [last, *(rim(low + share * (high - low), COARSE) for share in (1 / 3, 2 / 3)), rim(high, CORNER)]
        loop += [geo.addCircleArc(a, center, b) for a, b in pairwise(stops)]
    return int(geo.addPlaneSurface([geo.addCurveLoop(loop)]))


def on_wall(network: ContactNetwork, ends: np.ndarray) -> bool:
    """Whether both ends lie on the same wall of the box."""
    return any(
        np.allclose(ends[axis], value, atol=1e-10)
        for axis, length in enumerate(network.packing.box.lengths)
        for value in (0.0, length)
    )


def march(case: Case, refine: float = 1.0) -> np.ndarray:
    """Rows of Fourier number, heat into the body at the left and the right wall, mean temperatures."""
    network = case.network()
    mesh, owners = make_mesh(network, refine)
    basis = Basis(mesh, ElementTriP2(), intorder=5)
    K, M = stiffness.assemble(basis).tocsc(), mass.assemble(basis).tocsc()
    means = []
    for p in range(network.packing.count):
        weights = area.assemble(Basis(mesh, ElementTriP2(), intorder=5, elements=np.flatnonzero(owners == p)))
        means.append(weights / weights.sum())
    print(f"{case.name}: {K.shape[0]} unknowns, area {float(M.sum()):.9f}")
    x = basis.doflocs[0]
    T = np.zeros(x.size)
    walls = [np.flatnonzero(np.abs(x - at) < 1e-10) for at, _ in case.walls]
    for nodes, (_, value) in zip(walls, case.walls, strict=True):
        T[nodes] = value
    free = np.setdiff1d(np.arange(x.size), np.concatenate(walls))
    unit = case.radius**2
    times = np.concatenate([[0.0, 1e-3 * FOURIER[0]], FOURIER * unit])
    times[1] *= unit
    times = np.unique(np.concatenate([times[:1], np.geomspace(times[1], times[2], 12)[:-1], times[2:]]))
    rows = []
    for start, end in pairwise(times):
        h = (end - start) / STEPS
        factor = splu((M + GAMMA * h * K)[free][:, free].tocsc())
        for _ in range(STEPS):
            # rates of the two stages; the walls' nodes stay
            first = factor.solve(-(K @ T)[free])
            middle = T.copy()
            middle[free] += (1.0 - GAMMA) * h * first
            second = factor.solve(-(K @ middle)[free])
            T[free] += h * ((1.0 - GAMMA) * first + GAMMA * second)
            rate = np.zeros_like(T)
            rate[free] = second
        # heat in at the walls: the residual of their rows, with the rate at the end of the step
        residual = K @ T + M @ rate
        if np.any(np.isclose(end, FOURIER * unit, rtol=1e-9)):
            rows.append([end / unit, *(residual[nodes].sum() for nodes in walls), *(w @ T for w in means)])
    return np.array(rows)


def main() -> None:
    for case in CASES:
        fine = march(case)
        coarse = march(case, refine=2.0)
        change = np.abs(fine - coarse)
        last = 1 + len(case.walls)
        flows = (change[:, 1:last] / fine[:, 1:2]).max()
        print(
            f"{case.name}: elements twice as large change means by {change[:, last:].max():.1e} K, flows by {flows:.1e}"
        )
        names = ["fourier", *(f"heat_in_{side}" for side in ("left", "right")[: len(case.walls)])]
        names += [f"mean_{p + 1}" for p in range(fine.shape[1] - len(names))]
        np.savetxt(HERE / f"reference_{case.name}.csv", fine, "%.9g", ",", header=",".join(names), comments="")


if __name__ == "__main__":
    main()
