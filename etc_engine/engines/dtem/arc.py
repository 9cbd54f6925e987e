r"""Method ``arc``: the flux over every contact arc resolved in Chebyshev modes with an edge singularity.

Both sides of a contact share s = phi/alpha in [-1, 1], mirrored. The heat flow per unit s is

    q(s) = sum_k c_k T_k(s) / (pi sqrt(1 - s^2)),

equal and opposite on the two sides; the temperatures are matched by Galerkin with the same weight. The arcs of
the two disks are taken for one line, as in the basic method; what remains of its error is that geometry, no
longer the assumption of a uniform flux.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etc_engine.engines.dtem.element import Elements, Material, Resistances, condense, packed_starts, refuse_indefinite
from etc_engine.medium.sides import ContactSides

MODES = 5
"""Flux modes of a contact; on narrow arcs four already converge to 1e-9."""
POINTS = 32
"""Gauss-Chebyshev points of an arc."""


def arc_elements(sides: ContactSides, material: Material, modes: int = MODES) -> Elements:
    """Conductivity matrices of all disks over (contact, mode).

    H_(ik)(jl) = -1/(pi kappa) int int w_k(s) w_l(t) ln |sin((theta_i + alpha_i s - theta_j - alpha_j t)/2)| ds dt,
    w_k = T_k / (pi sqrt(1 - s^2)), by Gauss-Chebyshev quadrature; for i = j the singular part is exact,
    -ln|s - t| = ln 2 + sum_k (2/k) T_k(s) T_k(t).

    Parameters
    ----------
    sides : ContactSides
    material : Material
        A contact resistance acts on mode 0 alone: its temperature jump is taken as uniform over the contact.
    modes : int

    Returns
    -------
    Elements

    Raises
    ------
    GeometryError
        If a resistance matrix is not positive definite.
    """
    offsets = modes * sides.offsets
    starts = packed_starts(offsets)
    values = np.zeros(int(starts[-1]))
    bad = _fill(
        sides.offsets,
        sides.theta,
        sides.alpha,
        sides.mode_signs,
        material.side_resistances(sides),
        material.conductivity,
        modes,
        starts,
        values,
        int(np.diff(offsets).max(initial=1)),
        *_quadrature(modes),
    )
    refuse_indefinite(bad, sides)
    nodes = (modes * sides.nodes[:, None] + np.arange(modes)).ravel()
    return Elements(modes, offsets, nodes, starts, values)


def arc_resistances(sides: ContactSides, material: Material, modes: int = MODES) -> Resistances:
    """Resistance matrices H of all disks over (contact, mode); arguments as in `arc_elements`."""
    points, weights = _quadrature(modes)
    offsets = modes * sides.offsets
    starts = packed_starts(offsets)
    values = np.zeros(int(starts[-1]))
    _fill_resistances(
        sides.offsets,
        sides.theta,
        sides.alpha,
        sides.mode_signs,
        material.side_resistances(sides),
        material.conductivity,
        modes,
        starts,
        values,
        int(np.diff(offsets).max(initial=1)),
        points,
        weights,
    )
    around = sides.theta[:, None] + sides.alpha[:, None] * points
    signs = np.where(np.arange(modes) % 2 == 1, sides.mode_signs[:, None], 1.0)
    moments = np.stack([signs * (np.cos(around) @ weights.T), signs * (np.sin(around) @ weights.T)], axis=-1)
    return Resistances(modes, starts, values, moments.reshape(-1, 2))


def arc_potentials(sides: ContactSides, material: Material, flows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weighted mean temperature of every arc above its particle's mean, shape (s,), of flows of shape (s, modes)."""
    modes = flows.shape[1]
    return _potentials(
        sides.offsets,
        sides.theta,
        sides.alpha,
        sides.mode_signs,
        material.side_resistances(sides),
        material.conductivity,
        np.ascontiguousarray(flows),
        *_quadrature(modes),
    )


def _quadrature(modes: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gauss-Chebyshev points, and T_k at them over their number, shape (modes, points)."""
    angle = (np.arange(POINTS) + 0.5) * np.pi / POINTS
    return np.cos(angle), np.cos(np.arange(modes)[:, None] * angle) / POINTS


@njit(cache=True)
def _project(kernel: NDArray[np.float64], weights: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    """Moments of a kernel at the Gauss points over the modes of both arcs."""
    modes, number = weights.shape
    for k in range(modes):
        for l in range(modes):
            value = 0.0
            for u in range(number):
                for v in range(number):
                    value += weights[k, u] * weights[l, v] * kernel[u, v]
            out[k, l] = value


@njit(cache=True)
def _block(
    separation: float,
    a: float,
    b: float,
    points: NDArray[np.float64],
    weights: NDArray[np.float64],
    kernel: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:
    """Kappa H over the modes of two different arcs."""
    number = points.size
    for u in range(number):
        for v in range(number):
            kernel[u, v] = -np.log(abs(np.sin(0.5 * (separation + a * points[u] - b * points[v])))) / np.pi
    _project(kernel, weights, out)


@njit(cache=True)
def _own_block(
    a: float,
    points: NDArray[np.float64],
    weights: NDArray[np.float64],
    kernel: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:
    """Kappa H over the modes of one arc."""
    number = points.size
    for u in range(number):
        for v in range(number):
            x = 0.5 * a * (points[u] - points[v])
            ratio = 1.0 if u == v else np.sin(x) / x
            kernel[u, v] = -np.log(0.5 * a * ratio) / np.pi
    _project(kernel, weights, out)
    for k in range(weights.shape[0]):
        out[k, k] += (np.log(2.0) if k == 0 else 0.5 / k) / np.pi


@njit(cache=True)
def _disk_resistances(
    first: int,
    n: int,
    theta: NDArray[np.float64],
    alpha: NDArray[np.float64],
    signs: NDArray[np.float64],
    resistance: NDArray[np.float64],
    conductivity: float,
    modes: int,
    points: NDArray[np.float64],
    weights: NDArray[np.float64],
    kernel: NDArray[np.float64],
    block: NDArray[np.float64],
    h: NDArray[np.float64],
) -> None:
    """H of the disk with sides ``first`` to ``first + n`` into ``h``; ``kernel`` and ``block`` are work space."""
    for i in range(n):
        for j in range(i + 1):
            a, b = first + i, first + j
            if i == j:
                _own_block(alpha[a], points, weights, kernel, block)
            else:
                _block(theta[a] - theta[b], alpha[a], alpha[b], points, weights, kernel, block)
            for k in range(modes):
                for l in range(modes):
                    sign = (signs[a] if k % 2 else 1.0) * (signs[b] if l % 2 else 1.0)
                    h[i * modes + k, j * modes + l] = sign * block[k, l] / conductivity
                    h[j * modes + l, i * modes + k] = h[i * modes + k, j * modes + l]
        h[i * modes, i * modes] += resistance[first + i]


@njit(cache=True)
def _fill_resistances(
    offsets: NDArray[np.int64],
    theta: NDArray[np.float64],
    alpha: NDArray[np.float64],
    signs: NDArray[np.float64],
    resistance: NDArray[np.float64],
    conductivity: NDArray[np.float64],
    modes: int,
    starts: NDArray[np.int64],
    values: NDArray[np.float64],
    widest: int,
    points: NDArray[np.float64],
    weights: NDArray[np.float64],
) -> None:
    """Fill the packed matrices H."""
    h = np.empty((widest, widest))
    kernel = np.empty((points.size, points.size))
    block = np.empty((modes, modes))
    for p in range(offsets.size - 1):
        first, n = offsets[p], offsets[p + 1] - offsets[p]
        _disk_resistances(
            first, n, theta, alpha, signs, resistance, conductivity[p], modes, points, weights, kernel, block, h
        )
        for i in range(n * modes):
            for j in range(n * modes):
                values[starts[p] + i * n * modes + j] = h[i, j]


@njit(cache=True)
def _fill(
    offsets: NDArray[np.int64],
    theta: NDArray[np.float64],
    alpha: NDArray[np.float64],
    signs: NDArray[np.float64],
    resistance: NDArray[np.float64],
    conductivity: NDArray[np.float64],
    modes: int,
    starts: NDArray[np.int64],
    values: NDArray[np.float64],
    widest: int,
    points: NDArray[np.float64],
    weights: NDArray[np.float64],
) -> int:
    """Fill the packed matrices; answers the first particle whose H is not positive definite, or -1."""
    h, work = np.empty((widest, widest)), np.empty((widest, widest))
    kernel = np.empty((points.size, points.size))
    block = np.empty((modes, modes))
    for p in range(offsets.size - 1):
        first, n = offsets[p], offsets[p + 1] - offsets[p]
        if n < 2:
            continue
        _disk_resistances(
            first, n, theta, alpha, signs, resistance, conductivity[p], modes, points, weights, kernel, block, h
        )
        if not condense(h, n * modes, modes, work, values[starts[p] : starts[p + 1]]):
            return p
    return -1


@njit(cache=True)
def _potentials(
    offsets: NDArray[np.int64],
    theta: NDArray[np.float64],
    alpha: NDArray[np.float64],
    signs: NDArray[np.float64],
    resistance: NDArray[np.float64],
    conductivity: NDArray[np.float64],
    flows: NDArray[np.float64],
    points: NDArray[np.float64],
    weights: NDArray[np.float64],
) -> NDArray[np.float64]:
    potentials = np.zeros(theta.size)
    modes = flows.shape[1]
    kernel = np.empty((points.size, points.size))
    block = np.empty((modes, modes))
    for p in range(offsets.size - 1):
        for a in range(offsets[p], offsets[p + 1]):
            for b in range(offsets[p], offsets[p + 1]):
                if not np.any(flows[b]):
                    continue
                if a == b:
                    _own_block(alpha[a], points, weights, kernel, block)
                    potentials[a] += resistance[a] * flows[a, 0]
                else:
                    _block(theta[a] - theta[b], alpha[a], alpha[b], points, weights, kernel, block)
                for l in range(modes):
                    sign = signs[b] if l % 2 else 1.0
                    potentials[a] += sign * block[0, l] * flows[b, l] / conductivity[p]
    return potentials
