"""What every two-phase formula shares: pure-phase limits, polarizability, and the Y form."""

from __future__ import annotations

import numpy as np

from etc_engine.arrays import Floats


def with_pure_phases(k: Floats, k1: Floats, k2: Floats, fraction: Floats) -> Floats:
    """Give ``k`` its exact values where only one phase is there, or where both conduct alike.

    These are the removable 0/0 and inf - inf of the closed forms when a phase insulates or
    superconducts.
    """
    k = np.where(fraction == 1.0, k2, k)
    return np.where((fraction == 0.0) | (k1 == k2), k1, k)


def polarizability(k1: Floats, k2: Floats, dimension: int, order: int | Floats = 1) -> Floats:
    r"""Multipole polarizability of a disk or sphere (phase 2) in the matrix (phase 1), per radius power.

    .. math:: \beta_l = \frac{l (k_2 - k_1)}{l k_2 + (l + d - 2) k_1}

    with the limits :math:`1` for :math:`k_2 = \infty` and :math:`-l/(l+d-2)` for :math:`k_1 = \infty`.

    Parameters
    ----------
    k1, k2 : ndarray [W/(m K)]
        Conductivity of matrix and inclusion; 0 and inf allowed.
    dimension : int
        2 for disks, 3 for spheres.
    order : int or ndarray, optional
        Multipole order l; 1 is the dipole.

    Returns
    -------
    ndarray [-]

    Examples
    --------
    >>> float(polarizability(np.float64(1.0), np.float64(10.0), 3))
    0.75
    """
    outer = order + dimension - 2
    beta = order * (k2 - k1) / (order * k2 + outer * k1)
    beta = np.where(np.isinf(k2), 1.0, np.where(np.isinf(k1), -order / outer, beta))
    return np.where(k1 == k2, 0.0, beta)


def conductivity_from_y(k1: Floats, k2: Floats, fraction: Floats, y: Floats) -> Floats:
    r"""Conductivity of a two-phase medium from its Y parameter.

    .. math:: k = \langle k \rangle - \frac{f_1 f_2 (k_2 - k_1)^2}{f_2 k_1 + f_1 k_2 + Y}
                = \frac{k_1 k_2 + Y \langle k \rangle}{f_2 k_1 + f_1 k_2 + Y}

    The second form has no cancellation. Y = (d - 1) k1 is Maxwell's formula; bounds of higher order
    differ from it by their Y alone.

    Parameters
    ----------
    k1, k2 : ndarray [W/(m K)]
        Conductivity of the phases; 0 and inf allowed.
    fraction : ndarray [-]
        Volume fraction f2 of phase 2.
    y : ndarray [W/(m K)]
        The Y parameter; 0 gives the series, inf the parallel arrangement.

    Returns
    -------
    ndarray [W/(m K)]

    References
    ----------
    G. W. Milton, *The Theory of Composites* (2002), chapter 19, 10.1017/CBO9780511613357.

    Examples
    --------
    >>> k1, k2, half = np.float64(1.0), np.float64(3.0), np.float64(0.5)
    >>> float(conductivity_from_y(k1, k2, half, np.float64(0.0)))
    1.5
    """
    rest = 1.0 - fraction
    mean = rest * k1 + fraction * k2
    k = (k1 * k2 + y * mean) / (fraction * k1 + rest * k2 + y)
    # Largest terms of numerator and denominator when one quantity dominates.
    k = np.where(np.isinf(y), mean, k)
    k = np.where(np.isinf(k2) & np.isfinite(y), (k1 + y * fraction) / rest, k)
    k = np.where(np.isinf(k1) & np.isfinite(y), (k2 + y * rest) / fraction, k)
    return with_pure_phases(k, k1, k2, fraction)
