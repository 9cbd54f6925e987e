"""Resistances of particles with one flux mode per contact: the methods ``standard``, ``enhanced`` and ``chord``."""

from __future__ import annotations

import numpy as np
from numba import njit

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.engines.dtem.element import Resistances, contact_potentials, packed_starts
from etc_engine.engines.dtem.uneven_film import uneven_film
from etc_engine.laws.by_dimension import law_of, length_scales
from etc_engine.medium.sides import ContactSides


def closed_form_resistances(
    sides: ContactSides,
    conductivity: Floats,
    modes: int = 1,
    *,
    method: str,
    cutting: Flags | None = None,
) -> Resistances:
    """Resistance matrices H of all disks or spheres in closed form.

    H = (kappa R^(d-2) h_ij)/(kappa R^(d-2)), plus each side's share of the contact resistance on the diagonal. Where a
    contact resists over its area, ``chord`` adds the excess of `etc_engine.engines.dtem.uneven_film.uneven_film`; the
    flux of the other methods is uniform.

    Parameters
    ----------
    sides : ContactSides
    conductivity : ndarray, shape (n,) [W/(m K)]
    modes : int
        Always 1.
    method : str
        ``standard`` or ``chord``, for disks also ``enhanced``: what h_ii is.
    cutting : ndarray of bool, shape (s,), optional
        Contacts behind which the particle ends, as in `etc_engine.laws.by_dimension.ResistanceLaw`.

    Returns
    -------
    Resistances

    References
    ----------
    Feng, Han, Li, Owen 2008, Eqs. 20 to 30, doi:10.1016/j.jcp.2008.01.031.
    """
    law, starts = law_of(sides.dimension), packed_starts(sides.offsets)
    values = law.matrices(sides.offsets, sides.arms, sides.alpha, method, cutting)
    scales = np.ascontiguousarray(conductivity * length_scales(sides.radii, sides.dimension))
    resistances = sides.resistances
    if method == "chord":
        resistances = resistances + uneven_film(sides, conductivity)
    _scale(sides.offsets, starts, scales, resistances, values)
    return Resistances(modes, starts, values, law.moments(sides.arms, sides.alpha))


def closed_form_potentials(sides: ContactSides, conductivity: Floats, flows: Floats, *, method: str) -> Floats:
    """Temperature of every contact above its particle's mean; only contacts with a flux of (s, 1) cut the particle."""
    h = closed_form_resistances(sides, conductivity, method=method, cutting=flows[:, 0] != 0.0)
    return contact_potentials(h, sides, flows)


@njit(cache=True)
def _scale(
    offsets: Ints,
    starts: Ints,
    scales: Floats,
    resistance: Floats,
    values: Floats,
) -> None:
    """H_ij = values_ij/scale + delta_ij R_i, in place."""
    for p in range(offsets.size - 1):
        n = offsets[p + 1] - offsets[p]
        for k in range(starts[p], starts[p + 1]):
            values[k] /= scales[p]
        for i in range(n):
            values[starts[p] + i * n + i] += resistance[offsets[p] + i]
