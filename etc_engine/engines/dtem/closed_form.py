"""Elements with one flux mode a contact: the methods ``standard``, ``enhanced`` and ``chord``."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etc_engine.engines.dtem.element import Elements, Material, Resistances, condense, packed_starts, refuse_indefinite
from etc_engine.laws.by_dimension import law_of, length_scales
from etc_engine.medium.sides import ContactSides


def closed_form_elements(sides: ContactSides, material: Material, modes: int = 1, *, method: str) -> Elements:
    """Conductivity matrices of all disks or spheres, H in closed form.

    H = (kappa R^(d-2) h_ij)/(kappa R^(d-2)), plus each side's share of the contact resistance on the diagonal.

    Parameters
    ----------
    sides : ContactSides
    material : Material
    modes : int
        Always 1.
    method : str
        ``standard`` or ``chord``, for disks also ``enhanced``.

    Returns
    -------
    Elements

    Raises
    ------
    GeometryError
        If the contacts of a particle are so wide that its resistance matrix is not positive definite.

    References
    ----------
    Feng, Han, Li, Owen 2008, Eqs. 20 to 30, doi:10.1016/j.jcp.2008.01.031.
    """
    h = closed_form_resistances(sides, material, modes, method=method)
    values = np.zeros_like(h.values)
    refuse_indefinite(_condense_all(sides.offsets, h.starts, h.values, values), sides)
    return Elements(modes, sides.offsets, sides.nodes, h.starts, values)


def closed_form_resistances(
    sides: ContactSides,
    material: Material,
    modes: int = 1,
    *,
    method: str,
    cutting: NDArray[np.bool_] | None = None,
) -> Resistances:
    """Resistance matrices H of all particles; arguments as in `closed_form_elements`, ``cutting`` as in the law."""
    law, starts = law_of(sides.dimension), packed_starts(sides.offsets)
    values = law.matrices(sides.offsets, sides.arms, sides.alpha, method, cutting)
    scales = material.conductivity * length_scales(sides.radii, sides.dimension)
    _scale(sides.offsets, starts, scales, material.side_resistances(sides), values)
    return Resistances(modes, starts, values, law.moments(sides.arms, sides.alpha))


def closed_form_potentials(
    sides: ContactSides, material: Material, flows: NDArray[np.float64], method: str
) -> NDArray[np.float64]:
    """Temperature of every contact above its particle's mean, sum_j h_ij Q_j, shape (s,).

    Parameters
    ----------
    sides : ContactSides
        All sides, those without flux included.
    material : Material
    flows : ndarray, shape (s, 1) [W/m or W]
        Heat flow into the particle at each side.
    method : str
    """
    h = closed_form_resistances(sides, material, method=method, cutting=flows[:, 0] != 0.0)
    return _potentials(sides.offsets, h.starts, h.values, np.ascontiguousarray(flows[:, 0]))


@njit(cache=True)
def _scale(
    offsets: NDArray[np.int64],
    starts: NDArray[np.int64],
    scales: NDArray[np.float64],
    resistance: NDArray[np.float64],
    values: NDArray[np.float64],
) -> None:
    """H_ij = values_ij/scale + delta_ij R_i, in place."""
    for p in range(offsets.size - 1):
        n = offsets[p + 1] - offsets[p]
        for k in range(starts[p], starts[p + 1]):
            values[k] /= scales[p]
        for i in range(n):
            values[starts[p] + i * n + i] += resistance[offsets[p] + i]


@njit(cache=True)
def _condense_all(
    offsets: NDArray[np.int64], starts: NDArray[np.int64], h: NDArray[np.float64], out: NDArray[np.float64]
) -> int:
    """K_e of all particles into ``out``; returns the first whose H is not positive definite, or -1."""
    widest = 1
    for p in range(offsets.size - 1):
        widest = max(widest, offsets[p + 1] - offsets[p])
    work = np.empty((widest, widest))
    for p in range(offsets.size - 1):
        n = offsets[p + 1] - offsets[p]
        if n < 2:
            continue
        matrix = h[starts[p] : starts[p + 1]].reshape((n, n))
        if not condense(matrix, n, 1, work, out[starts[p] : starts[p + 1]]):
            return p
    return -1


@njit(cache=True)
def _potentials(
    offsets: NDArray[np.int64], starts: NDArray[np.int64], h: NDArray[np.float64], flows: NDArray[np.float64]
) -> NDArray[np.float64]:
    potentials = np.zeros(flows.size)
    for p in range(offsets.size - 1):
        n = offsets[p + 1] - offsets[p]
        for i in range(n):
            for j in range(n):
                if flows[offsets[p] + j] != 0.0:
                    potentials[offsets[p] + i] += h[starts[p] + i * n + j] * flows[offsets[p] + j]
    return potentials
