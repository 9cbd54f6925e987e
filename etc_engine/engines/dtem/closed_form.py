"""Resistances of disks with one flux mode per contact: the methods ``standard``, ``enhanced`` and ``chord``."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etc_engine.engines.dtem.element import DiskContacts, Resistances, disk_contacts, packed_starts
from etc_engine.laws.disk import mutual_resistance_scalar, self_resistance
from etc_engine.medium.sides import ContactSides


def closed_form_resistances(
    sides: ContactSides, conductivity: NDArray[np.float64], modes: int = 1, *, method: str
) -> Resistances:
    """Resistance matrices H of all disks in closed form.

    H = (kappa h_ij)/kappa, plus each side's share of the contact resistance on the diagonal.

    Parameters
    ----------
    sides : ContactSides
    conductivity : ndarray, shape (n,) [W/(m K)]
    modes : int
        Always 1.
    method : str
        ``standard``, ``enhanced`` or ``chord``: what h_ii is.

    Returns
    -------
    Resistances

    References
    ----------
    Feng, Han, Li, Owen 2008, Eqs. 20 to 30, doi:10.1016/j.jcp.2008.01.031.
    """
    disks = disk_contacts(sides, conductivity)
    own = self_resistance(sides.alpha, method) / conductivity[sides.particles] + sides.resistances
    starts = packed_starts(sides.offsets)
    values = np.zeros(int(starts[-1]))
    _fill(disks, own, starts, values)
    directions = np.stack([np.cos(disks.theta), np.sin(disks.theta)], axis=1)
    return Resistances(modes, starts, values, np.sinc(sides.alpha / np.pi)[:, None] * directions)


@njit(cache=True)
def _fill(
    disks: DiskContacts, own: NDArray[np.float64], starts: NDArray[np.int64], values: NDArray[np.float64]
) -> None:
    """h_ij = (kappa h_ij)(theta_i - theta_j, alpha_i, alpha_j)/kappa, symmetric; ``own`` is the diagonal."""
    for p in range(disks.offsets.size - 1):
        first, n = disks.offsets[p], disks.offsets[p + 1] - disks.offsets[p]
        h = values[starts[p] : starts[p + 1]].reshape((n, n))
        for i in range(n):
            a = first + i
            h[i, i] = own[a]
            for j in range(i):
                b = first + j
                separation = disks.theta[a] - disks.theta[b]
                h[i, j] = mutual_resistance_scalar(separation, disks.alpha[a], disks.alpha[b]) / disks.conductivity[p]
                h[j, i] = h[i, j]
