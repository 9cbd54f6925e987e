"""Heat flux density in a lattice: at every node, averaged over a halo of neighbours, and of the whole body."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from etc_engine.arrays import Flags, Floats
from etc_engine.engines.lattice.network import Lattice
from etc_engine.engines.lattice.steady import SteadyField
from etc_engine.errors import InputError
from etc_engine.structure.clipping import sort_into_grid


def flux_moments(field: SteadyField) -> Floats:
    r"""First moment of the heat flows of every node: volume times heat flux density.

    .. math:: M_p = \sum_q W_{p \to q} (c_{pq} - x_p) + \sum_{walls} W_{p \to w} (c_{pw} - x_p)

    with c the point where the heat crosses the transmission surface (the wall). The branch vector of a link is thus
    split at its surface: the moments of all nodes add up to V times the mean heat flux density, exactly.

    Parameters
    ----------
    field : SteadyField

    Returns
    -------
    ndarray, shape (n, 3) [W m]

    Notes
    -----
    On a Laguerre lattice c is the centroid of the facet; the moments of a uniform field are then -k V_p grad T to
    rounding. On a contact lattice the branch vector is split in proportion to the radii.

    References
    ----------
    Haddad et al. 2021, eq. 20 (printed without the distance of the particles), doi:10.1016/j.ijthermalsci.2020.106799.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.engines.lattice.network import laguerre_lattice, link_conductances
    >>> from etc_engine.engines.lattice.steady import solve_between_walls
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> two = ParticlePacking([[0.25, 0.5, 0.5], [0.8, 0.5, 0.5]], [0.2, 0.1], Box((1.0, 1.0, 1.0)))
    >>> lattice = laguerre_lattice(two)
    >>> field = solve_between_walls(lattice, link_conductances(lattice, 2.0), 0)
    >>> (flux_moments(field) / lattice.volumes[:, None]).round(12)[:, 0]
    array([2., 2.])
    """
    lattice = field.lattice
    flows, walls = field.link_flows, field.wall_flows
    i, j = lattice.pairs.T
    moments = np.zeros((lattice.count, 3))
    for axis in range(3):
        crossing = lattice.crossings[:, axis]
        moments[:, axis] = (
            np.bincount(i, flows * crossing, minlength=lattice.count)
            + np.bincount(j, flows * (lattice.branches[:, axis] - crossing), minlength=lattice.count)
            + np.bincount(lattice.wall_particles, walls * lattice.wall_crossings[:, axis], minlength=lattice.count)
        )
    return moments


def mean_flux(field: SteadyField) -> Floats:
    """Volume average of the heat flux density of the box, shape (3,) [W/m2]."""
    return flux_moments(field).sum(axis=0) / field.lattice.packing.box.volume


def halo_flux(field: SteadyField, radius: float, points: ArrayLike | None = None) -> Floats:
    r"""Heat flux density averaged over all nodes within a radius.

    .. math:: q_p = \sum_{|x_r - x_p| \le R} M_r \Big/ \sum_{|x_r - x_p| \le R} V_r

    Parameters
    ----------
    field : SteadyField
    radius : float [m]
        Radius of the halo; below the distance of the nearest neighbour a node stands alone.
    points : array_like, shape (m, 3) [m], optional
        Centres of the halos, inside the box; the nodes by default.

    Returns
    -------
    ndarray, shape (m, 3) [W/m2]
        NaN where a halo holds no node.

    Raises
    ------
    InputError
        If the radius is negative or not finite, or the points have another shape.

    Notes
    -----
    Time is linear in the number of nodes, times the nodes of a halo (cell lists). Halos repeat across periodic axes and
    are cut off by walls: see `near_wall`.

    References
    ----------
    Haddad et al. 2021, eqs. 22, 23 (corrected), doi:10.1016/j.ijthermalsci.2020.106799.
    """
    if not (np.isfinite(radius) and radius >= 0.0):
        raise InputError(f"the radius of a halo must be finite and not negative, found {radius:g}")
    lattice = field.lattice
    packing = lattice.packing
    box = packing.box
    centers = packing.centers if points is None else np.ascontiguousarray(points, dtype=np.float64)
    if centers.ndim != 2 or centers.shape[1] != 3:
        raise InputError(f"points of shape (m, 3) are needed, found {centers.shape}")
    lengths = np.asarray(box.lengths)
    spacing = (box.volume / packing.count) ** (1.0 / 3.0)
    cells = np.maximum(np.floor(lengths / max(1.5 * spacing, 0.25 * radius)), 1.0).astype(np.int64)
    order, starts = sort_into_grid(packing.centers, lengths, cells)
    weighted = np.column_stack((flux_moments(field), lattice.volumes))
    frame = (lengths, np.asarray(box.periodic))
    sums = _sum_halos(centers, float(radius), packing.centers, weighted, frame, (order, starts, cells))
    with np.errstate(invalid="ignore"):
        return np.asarray(sums[:, :3] / sums[:, 3:])


def near_wall(lattice: Lattice, radius: float) -> Flags:
    """Whether a halo of a radius about a node reaches over a wall, shape (n,): the wall region, not the core."""
    box, centers = lattice.packing.box, lattice.packing.centers
    over = (centers < radius) | (centers > np.asarray(box.lengths) - radius)
    return np.asarray((over & ~np.asarray(box.periodic)).any(axis=1))


def probe(
    field: SteadyField, points: ArrayLike, conductivity: ArrayLike = 1.0, *, nodes: int = 30
) -> tuple[Floats, Floats]:
    """Temperature and heat flux density at points.

    The temperature is that of the nearest node, carried to the point by the node's own gradient -q/k. The heat flux is
    the value there of a linear function fitted to the nearest nodes of the same conductivity.

    Parameters
    ----------
    field : SteadyField
        Of a Laguerre lattice between walls.
    points : array_like, shape (m, 3) [m]
    conductivity : float or array_like, shape (n,) [W/(m K)]
        Of each node.
    nodes : int
        Nodes that a fit takes into account before those of another conductivity are left out.

    Returns
    -------
    temperatures : ndarray, shape (m,) [K]
    fluxes : ndarray, shape (m, 3) [W/m2]

    Raises
    ------
    InputError
        If the box is periodic: there the temperature is no function of the place.

    Examples
    --------
    >>> from etc_engine.engines.lattice.calibration import pack_lattice
    >>> from etc_engine.engines.lattice.network import laguerre_lattice, link_conductances
    >>> from etc_engine.engines.lattice.steady import solve_between_walls
    >>> packing = pack_lattice(200, (1, 1, 1), np.random.default_rng(5), periodic=(False,) * 3, density=0.3)
    >>> lattice = laguerre_lattice(packing)
    >>> field = solve_between_walls(lattice, link_conductances(lattice, 2.0), 0)
    >>> temperatures, fluxes = probe(field, [[0.25, 0.5, 0.5]], 2.0)
    >>> temperatures.round(6), np.abs(fluxes).round(6)
    (array([0.75]), array([[2., 0., 0.]]))
    """
    lattice = field.lattice
    if any(lattice.packing.box.periodic):
        raise InputError("a temperature can be read at a point between walls only: this box is periodic")
    k = np.broadcast_to(np.asarray(conductivity, dtype=np.float64), (lattice.count,))
    centers, points = lattice.packing.centers, np.asarray(points, dtype=np.float64)
    local = flux_moments(field) / lattice.volumes[:, None]
    near = np.reshape(cKDTree(centers).query(points, min(nodes, lattice.count))[1], (len(points), -1))
    temperatures, fluxes = np.empty(len(points)), np.empty((len(points), 3))
    for row, (point, found) in enumerate(zip(points, near, strict=True)):
        nearest = found[0]
        temperatures[row] = field.temperatures[nearest] - (point - centers[nearest]) @ local[nearest] / k[nearest]
        same = found[k[found] == k[nearest]]
        linear = np.column_stack((np.ones(same.size), centers[same] - point))
        fluxes[row] = np.linalg.lstsq(linear, local[same], rcond=None)[0][0]
    return temperatures, fluxes


@njit(cache=True)
def _sum_halos(centers, radius, nodes, weighted, frame, grid):  # type: ignore[no-untyped-def]
    """Sums of the rows of `weighted` over all nodes within the radius of each centre."""
    lengths, periodic = frame
    order, starts, cells = grid
    sums = np.zeros((centers.shape[0], 4))
    low, high = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
    for p in range(centers.shape[0]):
        for axis in range(3):
            low[axis] = int(np.floor((centers[p, axis] - radius) / lengths[axis] * cells[axis]))
            high[axis] = int(np.floor((centers[p, axis] + radius) / lengths[axis] * cells[axis]))
            if not periodic[axis]:
                low[axis] = min(max(low[axis], 0), cells[axis] - 1)
                high[axis] = min(max(high[axis], 0), cells[axis] - 1)
        for cx in range(low[0], high[0] + 1):
            sx = cx // cells[0]
            for cy in range(low[1], high[1] + 1):
                sy = cy // cells[1]
                for cz in range(low[2], high[2] + 1):
                    sz = cz // cells[2]
                    c = ((cx - sx * cells[0]) * cells[1] + cy - sy * cells[1]) * cells[2] + cz - sz * cells[2]
                    for place in range(starts[c], starts[c + 1]):
                        r = order[place]
                        dx = nodes[r, 0] + sx * lengths[0] - centers[p, 0]
                        dy = nodes[r, 1] + sy * lengths[1] - centers[p, 1]
                        dz = nodes[r, 2] + sz * lengths[2] - centers[p, 2]
                        if dx * dx + dy * dy + dz * dz <= radius * radius:
                            for column in range(4):
                                sums[p, column] += weighted[r, column]
    return sums
