"""Networks of conductances: mean field, effective medium, percolation."""

from __future__ import annotations

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.models.broadcasting import elementwise
from etc_engine.models.effective_media import self_consistent

PERCOLATION_EXPONENT = {2: 1.30, 3: 2.0}
"""Universal conductivity exponent t of lattices in two and three dimensions."""


@elementwise
def contact_mean_field(
    fraction: Floats,
    coordination: Floats,
    conductance_distance2: Floats,
    radius_moment: Floats,
    *,
    dimension: int,
) -> Floats:
    r"""Contact network under an affine temperature field (one temperature a particle, linear in space).

    .. math:: k = \frac{1}{d V} \sum_c C_c d_c^2 = \begin{cases}
              \dfrac{\phi Z \langle C d^2 \rangle}{4 \pi \langle R^2 \rangle} & \text{disks} \\[2ex]
              \dfrac{\phi Z \langle C d^2 \rangle}{8 \pi \langle R^3 \rangle} & \text{spheres}\end{cases}

    Parameters
    ----------
    fraction : array_like [-]
        Density phi: full areas (volumes) of the particles over that of the box.
    coordination : array_like [-]
        Mean coordination number Z = 2 (contacts)/(particles).
    conductance_distance2 : array_like
        <C d^2>, mean over contacts of conductance times squared centre distance: C in W/(m K) (per
        thickness) times m^2 for disks, in W/K times m^2 for spheres.
    radius_moment : array_like
        <R^2> [m2] for disks, <R^3> [m3] for spheres, mean over particles.
    dimension : int
        2 for disks, 3 for spheres.

    Returns
    -------
    array_like [W/(m K)]

    Notes
    -----
    Half (third) the trace of the conductivity tensor, and an upper bound of it for the periodic network of
    those conductances, because the true field has the least energy. Only contacts conduct. Equal touching
    particles have <C d^2> = 4 R^2 C: phi Z C/pi for disks, phi Z C/(2 pi R) for spheres.

    References
    ----------
    G. K. Batchelor and R. W. O'Brien, Proc. R. Soc. Lond. A 355, 313 (1977), 10.1098/rspa.1977.0100
    (equal spheres).

    Examples
    --------
    >>> k = contact_mean_field(0.8, 4.0, 4.0 * 0.3, 1.0, dimension=2)  # R = 1, C = 0.3
    >>> bool(np.isclose(k, 0.8 * 4.0 * 0.3 / np.pi))
    True
    """
    return fraction * coordination * conductance_distance2 / (4.0 * (dimension - 1) * np.pi * radius_moment)


@elementwise
def kirkpatrick(k1: Floats, k2: Floats, fraction: Floats, coordination: Floats) -> Floats:
    r"""Effective medium of a random mixture of two kinds of bonds on a network.

    .. math:: (1 - f) \frac{k_1 - k}{k_1 + (z/2 - 1) k} + f \frac{k_2 - k}{k_2 + (z/2 - 1) k} = 0

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of the same network with every bond of kind 1, and of kind 2; 0 and inf allowed.
    fraction : array_like [-]
        Number fraction f of bonds of kind 2.
    coordination : array_like [-]
        Coordination number z of the network, at least 2.

    Returns
    -------
    array_like [W/(m K)]

    Notes
    -----
    Percolates at f = 2/z. z = 2 is a chain (series), z = 2d a simple cubic lattice in d dimensions, where it
    equals `effective_medium`.

    References
    ----------
    S. Kirkpatrick, Rev. Mod. Phys. 45, 574 (1973), 10.1103/RevModPhys.45.574.

    Examples
    --------
    >>> round(float(kirkpatrick(0.0, 1.0, 0.75, 4.0)), 12)  # 2 f - 1 on the square lattice
    0.5
    """
    return self_consistent(k1, k2, fraction, 0.5 * coordination)


@elementwise
def percolation_power_law(
    k2: Floats, fraction: Floats, threshold: Floats, exponent: Floats | None = None, *, dimension: int
) -> Floats:
    r"""Conducting phase 2 in an insulating matrix, near its percolation threshold.

    .. math:: k = k_2 \left(\frac{f - f_c}{1 - f_c}\right)^t

    Parameters
    ----------
    k2 : array_like [W/(m K)]
        Conductivity of the conducting phase; the matrix insulates (k1 = 0).
    fraction : array_like [-]
        Fraction f of the conducting phase.
    threshold : array_like [-]
        Percolation threshold f_c, below 1; the result is 0 up to it.
    exponent : array_like [-], optional
        t; by default the universal 1.30 in two and 2.0 in three dimensions.
    dimension : int
        2 or 3; chooses the default exponent.

    Returns
    -------
    array_like [W/(m K)]

    Notes
    -----
    The power is universal near f_c only; the prefactor, here chosen to reach k2 at f = 1, is not.

    References
    ----------
    D. Stauffer and A. Aharony, *Introduction to Percolation Theory*, 2nd ed. (1992), chapter 5.

    Examples
    --------
    >>> float(percolation_power_law(1.0, 0.75, 0.5, 2.0, dimension=3))
    0.25
    """
    t = PERCOLATION_EXPONENT[dimension] if exponent is None else exponent
    return k2 * np.clip((fraction - threshold) / (1.0 - threshold), 0.0, None) ** t
