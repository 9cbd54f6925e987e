r"""Method ``exact`` for spheres: every sphere cut by all its contact disks, the flux through them resolved in modes.

The flux through a contact is a sum of modes m + 2k <= degree (see `etc_engine.laws.sphere_modes`), equal and
opposite on its two sides; the temperatures are matched by Galerkin with the same modes. H = (V^-1 - L)^-1 holds
the resistances between all modes of a sphere: V of the full ball, L what the caps behind the disks would conduct.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.engines.dtem.element import (
    Elements,
    cholesky_inverse,
    condense,
    packed_starts,
    refuse_indefinite,
)
from etc_engine.engines.dtem.uneven_film import uneven_film
from etc_engine.errors import GeometryError
from etc_engine.laws.sphere import FOUR_PI
from etc_engine.laws.sphere_modes import (
    WIDEST,
    ModeTables,
    OwnBlocks,
    combine,
    mode_tables,
    number_of_modes,
    own_blocks,
    pair_means,
)
from etc_engine.medium.sides import ContactSides, refuse_overlap


class ContactDisks(NamedTuple):
    """Contact disks and cuts of spheres as compiled code takes them, sorted by sphere.

    Parameters
    ----------
    offsets : ndarray of int, shape (n + 1,)
        Disks of sphere p: ``offsets[p]`` to ``offsets[p + 1]``.
    normals : ndarray, shape (c, 3)
        Unit directions.
    axes : ndarray of complex, shape (c, 3)
        E = e_1 + i e_2 across each.
    alpha : ndarray, shape (c,) [rad]
    cutting : ndarray of bool, shape (c,)
        Whether the sphere ends at the disk.
    """

    offsets: Ints
    normals: Floats
    axes: NDArray[np.complex128]
    alpha: Floats
    cutting: Flags


DEGREE = 2
"""Of the flux modes, unless another one is asked for."""
RAISE = 1.0
"""Added to V between whole heat flows, which keeps it positive definite and changes no difference of temperatures."""


def exact_sphere_elements(sides: ContactSides, conductivity: Floats, modes: int) -> Elements:
    """Conductivity matrices of all spheres over (contact, mode).

    Parameters
    ----------
    sides : ContactSides
        With ``cuts``, disks that nothing passes. A contact resistance acts on mode 0 alone: its temperature jump is
        taken as uniform over the contact. One over the contact area has the excess of
        `etc_engine.engines.dtem.uneven_film.uneven_film` added: the modes of spheres do not resolve it.
    conductivity : ndarray, shape (n,) [W/(m K)]
    modes : int
        (degree + 1)(degree + 2)/2 for the modes m + 2k <= degree.

    Returns
    -------
    Elements

    Raises
    ------
    GeometryError
        If contacts of a sphere meet, or are wider than 80 degrees.

    Notes
    -----
    Degree 2 comes within .03 % of finite elements on sc, bcc and fcc lattices of 20 and 30 degrees, degree 3 within
    their own uncertainty of .02 %. About a millisecond per sphere.
    """
    tables = mode_tables(_degree(modes))
    order = np.argsort(np.concatenate([sides.particles, sides.cuts.particles]), kind="stable")
    owner = np.concatenate([sides.particles, sides.cuts.particles])
    offsets = np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=sides.offsets.size - 1))])
    normals, axes = _frames(sides)
    cut_axes = _across(sides.cuts.arms.reshape(-1, 3))
    normals = np.concatenate([normals, sides.cuts.arms.reshape(-1, 3)])[order]
    axes = np.concatenate([axes, cut_axes])[order]
    alpha = np.concatenate([sides.alpha, sides.cuts.alpha])[order]
    _refuse_wide(offsets, normals, alpha)
    starts = packed_starts(modes * sides.offsets)
    values = np.zeros(int(starts[-1]))
    bad = _fill(
        sides.offsets,
        ContactDisks(offsets, normals, axes, alpha, np.ones(alpha.size, dtype=np.bool_)),
        tables,
        own_blocks(tables, alpha),
        np.ascontiguousarray(conductivity * sides.radii),
        sides.resistances + uneven_film(sides, conductivity),
        starts,
        values,
    )
    refuse_indefinite(bad, sides)
    nodes = (modes * sides.nodes[:, None] + np.arange(modes)).ravel()
    return Elements(modes, modes * sides.offsets, nodes, starts, values)


def exact_sphere_potentials(sides: ContactSides, conductivity: Floats, flows: Floats) -> Floats:
    """Weighted mean temperature of every contact above that of its sphere's centre, shape (s,), of flows (s, modes).

    Parameters
    ----------
    sides : ContactSides
        All sides of a network; ``cuts`` says which of its wall contacts are cut. Other contacts without flux are
        read in the uncut sphere.
    conductivity : ndarray, shape (n,) [W/(m K)]
    flows : ndarray, shape (s, modes) [W]
    """
    tables = mode_tables(_degree(flows.shape[1]))
    cutting = np.asarray((flows != 0.0).any(axis=1))
    cutting[sides.of_walls[sides.cuts.walls]] = True
    normals, axes = _frames(sides)
    _refuse_wide(sides.offsets, normals, sides.alpha)
    potentials = np.zeros(sides.nodes.size)
    _potentials(
        ContactDisks(sides.offsets, normals, axes, sides.alpha, cutting),
        tables,
        own_blocks(tables, sides.alpha),
        np.ascontiguousarray(conductivity * sides.radii),
        np.ascontiguousarray(flows),
        potentials,
    )
    return potentials + (sides.resistances + uneven_film(sides, conductivity)) * flows[:, 0]


def _degree(modes: int) -> int:
    """The degree that has so many modes."""
    degree = int(np.sqrt(2.0 * modes + 0.25) - 1.5 + 1e-9)
    assert number_of_modes(degree) == modes
    return degree


def _refuse_wide(offsets: Ints, normals: Floats, alpha: Floats) -> None:
    refuse_overlap(offsets, normals, alpha)
    wide = np.flatnonzero(alpha > WIDEST)
    if wide.size:
        particle = int(np.searchsorted(offsets, wide[0], side="right")) - 1
        raise GeometryError(
            f"particle {particle} is beyond method exact: the half-angle {np.degrees(alpha[wide[0]]):.4g} degrees of a "
            f"contact is above {np.degrees(WIDEST):g}; use method chord or less overlap"
        )


def _frames(sides: ContactSides) -> tuple[Floats, NDArray[np.complex128]]:
    """Unit directions (s, 3), exactly opposite on the two sides of a contact, and E of each, the same on both."""
    normals = sides.arms / np.linalg.norm(sides.arms, axis=1, keepdims=True)
    normals[sides.of_contacts[:, 1]] = -normals[sides.of_contacts[:, 0]]
    axes = _across(normals)
    axes[sides.of_contacts[:, 1]] = axes[sides.of_contacts[:, 0]]
    return normals, axes


def _across(normals: Floats) -> NDArray[np.complex128]:
    """E = e_1 + i e_2 with e_1, e_2 orthonormal and across each direction, shape (s, 3)."""
    least = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first = np.cross(normals, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.asarray(first + 1j * np.cross(normals, first))


@njit(cache=True)
def _resistances(
    p: int,
    disks: ContactDisks,
    tables: ModeTables,
    own: OwnBlocks,
    h: Floats,
) -> bool:
    """H = (V^-1 - L)^-1 of the disks of sphere p, times kappa R; False if it is not positive definite."""
    first, last = disks.offsets[p], disks.offsets[p + 1]
    families = tables.orders.size
    base = np.zeros(families + 1, dtype=np.int64)
    for f in range(families):
        base[f + 1] = base[f] + (1 if tables.orders[f] == 0 else 2)
    modes, n = base[families], last - first
    means = np.empty((families, families, tables.orders.max() + 1))
    h[: n * modes, : n * modes] = 0.0
    for i in range(n):
        _own_block(own.selves[first + i], tables, base, i * modes, 1.0, h)
        for j in range(i):
            _pair_block((first + i, first + j), disks, tables, base, means, (i * modes, j * modes), h)
            for f in range(families):
                h[i * modes + base[f], j * modes] -= own.gauges[first + i, f]
                h[i * modes, j * modes + base[f]] -= own.gauges[first + j, f]
    for i in range(0, n * modes, modes):
        for j in range(0, i + 1, modes):
            h[i, j] += RAISE
    if not cholesky_inverse(h, n * modes):
        return False
    for i in range(n):
        if disks.cutting[first + i]:
            _own_block(own.caps[first + i], tables, base, i * modes, -1.0, h)
    if not cholesky_inverse(h, n * modes):
        return False
    for i in range(0, n * modes, modes):
        for j in range(0, n * modes, modes):
            h[i, j] -= RAISE
    return True


@njit(cache=True)
def _own_block(
    block: Floats,
    tables: ModeTables,
    base: Ints,
    at: int,
    sign: float,
    h: Floats,
) -> None:
    """Add a block by family, the same for cosine and sine and nothing between different m."""
    for f in range(tables.orders.size):
        for g in range(tables.orders.size):
            if tables.orders[f] == tables.orders[g]:
                for k in range(base[f + 1] - base[f]):
                    h[at + base[f] + k, at + base[g] + k] += sign * block[f, g]


@njit(cache=True)
def _pair_block(
    pair: tuple[int, int],
    disks: ContactDisks,
    tables: ModeTables,
    base: Ints,
    means: Floats,
    at: tuple[int, int],
    h: Floats,
) -> None:
    """<s_a, V s_b> of all modes of two disks; cos and sin are (E + E*)/2 and (E - E*)/(2i)."""
    (a, b), (row, column) = pair, at
    normals, axes, alpha = disks.normals, disks.axes, disks.alpha
    cosine = 0.0
    along, back, straight, crossed = 0j, 0j, 0j, 0j
    for axis in range(3):
        cosine += normals[a, axis] * normals[b, axis]
        along += axes[a, axis] * normals[b, axis]
        back += axes[b, axis] * normals[a, axis]
        straight += axes[a, axis] * axes[b, axis]
        crossed += axes[a, axis] * axes[b, axis].conjugate()
    dots = (along, back, straight, crossed)
    pair_means(cosine, alpha[a], alpha[b], tables.orders, tables.lines, means)
    for f in range(tables.orders.size):
        for g in range(tables.orders.size):
            p, q = combine(means[f, g], tables.orders[f], tables.orders[g], dots)
            p, q = p / (2.0 * FOUR_PI), q / (2.0 * FOUR_PI)
            i, j = row + base[f], column + base[g]
            h[i, j] = (p + q).real
            if tables.orders[g] > 0:
                h[i, j + 1] = (p - q).imag
            if tables.orders[f] > 0:
                h[i + 1, j] = (p + q).imag
                if tables.orders[g] > 0:
                    h[i + 1, j + 1] = (q - p).real


@njit(cache=True)
def _fill(
    side_offsets: Ints,
    disks: ContactDisks,
    tables: ModeTables,
    own: OwnBlocks,
    scales: Floats,
    resistance: Floats,
    starts: Ints,
    values: Floats,
) -> int:
    """Fill the packed matrices; returns the first particle whose H is not positive definite, or -1."""
    modes = 0
    for m in tables.orders:
        modes += 1 if m == 0 else 2
    for p in range(side_offsets.size - 1):
        first, contacts = side_offsets[p], side_offsets[p + 1] - side_offsets[p]
        size, every = contacts * modes, (disks.offsets[p + 1] - disks.offsets[p]) * modes
        if contacts < 1:
            continue
        h = np.empty((every, every))  # the disks of contacts come before those of insulated walls
        if not _resistances(p, disks, tables, own, h):
            return p
        h /= scales[p]
        for a in range(contacts):
            h[a * modes, a * modes] += resistance[first + a]
        work = np.empty((size, size))
        if size > 1 and not condense(h, size, modes, work, values[starts[p] : starts[p + 1]]):
            return p
    return -1


@njit(cache=True)
def _potentials(
    disks: ContactDisks,
    tables: ModeTables,
    own: OwnBlocks,
    scales: Floats,
    flows: Floats,
    potentials: Floats,
) -> None:
    """H times the flux modes, of mode 0."""
    modes = flows.shape[1]
    for p in range(disks.offsets.size - 1):
        first, n = disks.offsets[p], disks.offsets[p + 1] - disks.offsets[p]
        if not np.any(flows[first : first + n]):
            continue
        h = np.empty((n * modes, n * modes))
        _resistances(p, disks, tables, own, h)
        for i in range(n):
            for j in range(n):
                for k in range(modes):
                    potentials[first + i] += h[i * modes, j * modes + k] * flows[first + j, k] / scales[p]
