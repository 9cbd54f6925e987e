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

from etc_engine.arrays import Floats, Ints
from etc_engine.engines.dtem.element import DiskContacts, Resistances, disk_contacts, packed_starts
from etc_engine.medium.sides import ContactSides

MODES = 5
"""Flux modes of a contact; on narrow arcs four already converge to 1e-9."""
POINTS = 32
"""Gauss-Chebyshev points of an arc."""


def arc_resistances(sides: ContactSides, conductivity: Floats, modes: int = MODES) -> Resistances:
    """Resistance matrices H of all disks over (contact, mode).

    H_(ik)(jl) = -1/(pi kappa) int int w_k(s) w_l(t) ln |sin((theta_i + alpha_i s - theta_j - alpha_j t)/2)| ds dt,
    w_k = T_k / (pi sqrt(1 - s^2)), by Gauss-Chebyshev quadrature; for i = j the singular part is exact,
    -ln|s - t| = ln 2 + sum_k (2/k) T_k(s) T_k(t).

    Parameters
    ----------
    sides : ContactSides
        A contact resistance acts on mode 0 alone: its temperature jump is taken as uniform over the contact.
    conductivity : ndarray, shape (n,) [W/(m K)]
    modes : int

    Returns
    -------
    Resistances
    """
    points, weights = _quadrature(modes)
    disks = disk_contacts(sides, conductivity)
    starts = packed_starts(modes * sides.offsets)
    values = np.zeros(int(starts[-1]))
    _fill(disks, starts, values, points, weights)
    around = disks.theta[:, None] + sides.alpha[:, None] * points
    signs = np.where(np.arange(modes) % 2 == 1, disks.signs[:, None], 1.0)
    moments = np.stack([signs * (np.cos(around) @ weights.T), signs * (np.sin(around) @ weights.T)], axis=-1)
    return Resistances(modes, starts, values, moments.reshape(-1, 2))


def _quadrature(modes: int) -> tuple[Floats, Floats]:
    """Gauss-Chebyshev points, and T_k at them over their number, shape (modes, points)."""
    angle = (np.arange(POINTS) + 0.5) * np.pi / POINTS
    return np.cos(angle), np.cos(np.arange(modes)[:, None] * angle) / POINTS


@njit(cache=True)
def _project(kernel: Floats, weights: Floats, out: Floats) -> None:
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
    points: Floats,
    weights: Floats,
    kernel: Floats,
    out: Floats,
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
    points: Floats,
    weights: Floats,
    kernel: Floats,
    out: Floats,
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
def _fill(
    disks: DiskContacts,
    starts: Ints,
    values: Floats,
    points: Floats,
    weights: Floats,
) -> None:
    """H_(ik)(jl) of every disk: the block of two arcs over kappa, odd modes mirrored, and R_c on the diagonal."""
    modes = weights.shape[0]
    kernel = np.empty((points.size, points.size))
    block = np.empty((modes, modes))
    for p in range(disks.offsets.size - 1):
        first, n = disks.offsets[p], disks.offsets[p + 1] - disks.offsets[p]
        h = values[starts[p] : starts[p + 1]].reshape((n * modes, n * modes))
        for i in range(n):
            for j in range(i + 1):
                a, b = first + i, first + j
                if i == j:
                    _own_block(disks.alpha[a], points, weights, kernel, block)
                else:
                    separation = disks.theta[a] - disks.theta[b]
                    _block(separation, disks.alpha[a], disks.alpha[b], points, weights, kernel, block)
                for k in range(modes):
                    for l in range(modes):
                        sign = (disks.signs[a] if k % 2 else 1.0) * (disks.signs[b] if l % 2 else 1.0)
                        h[i * modes + k, j * modes + l] = sign * block[k, l] / disks.conductivity[p]
                        h[j * modes + l, i * modes + k] = h[i * modes + k, j * modes + l]
            h[i * modes, i * modes] += disks.resistances[first + i]
