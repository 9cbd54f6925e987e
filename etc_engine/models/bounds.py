"""Rigorous bounds on the conductivity of any, or any isotropic, two-phase medium."""

from __future__ import annotations

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.models.broadcasting import elementwise
from etc_engine.models.phases import conductivity_from_y, with_pure_phases


@elementwise
def series(k1: Floats, k2: Floats, fraction: Floats) -> Floats:
    r"""Layers across the flow: Wiener's lower bound for any two-phase medium.

    .. math:: 1/k = (1 - f)/k_1 + f/k_2

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of the two phases; 0 and inf allowed.
    fraction : array_like [-]
        Volume fraction f of phase 2.

    Returns
    -------
    array_like [W/(m K)]

    References
    ----------
    O. Wiener, Abh. Math.-Phys. Kl. Königl. Sächs. Ges. Wiss. 32, 507 (1912).

    Examples
    --------
    >>> float(series(1.0, 3.0, 0.5))
    1.5
    """
    return conductivity_from_y(k1, k2, fraction, np.zeros_like(fraction))


@elementwise
def parallel(k1: Floats, k2: Floats, fraction: Floats) -> Floats:
    r"""Layers along the flow: Wiener's upper bound for any two-phase medium.

    .. math:: k = (1 - f) k_1 + f k_2

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of the two phases; 0 and inf allowed.
    fraction : array_like [-]
        Volume fraction f of phase 2.

    Returns
    -------
    array_like [W/(m K)]

    References
    ----------
    O. Wiener, Abh. Math.-Phys. Kl. Königl. Sächs. Ges. Wiss. 32, 507 (1912).

    Examples
    --------
    >>> float(parallel(1.0, 3.0, 0.5))
    2.0
    """
    return with_pure_phases((1.0 - fraction) * k1 + fraction * k2, k1, k2, fraction)


@elementwise
def hashin_shtrikman_lower(k1: Floats, k2: Floats, fraction: Floats, *, dimension: int) -> Floats:
    r"""Best lower bound for an isotropic two-phase medium of given volume fractions.

    .. math:: k = \langle k \rangle - \frac{f_1 f_2 (k_2 - k_1)^2}
                  {f_2 k_1 + f_1 k_2 + (d - 1) \min(k_1, k_2)}

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of the two phases, in any order; 0 and inf allowed.
    fraction : array_like [-]
        Volume fraction f2 of phase 2.
    dimension : int
        2 or 3.

    Returns
    -------
    array_like [W/(m K)]

    Notes
    -----
    The better conductor sits as disks or spheres in the worse: Maxwell's formula when k2 > k1. It is 0 as
    soon as one phase insulates. It holds for media that fill the plane or space with the two phases; a network
    of bonded contacts is not such a medium.

    References
    ----------
    Z. Hashin and S. Shtrikman, J. Appl. Phys. 33, 3125 (1962), 10.1063/1.1728579.

    Examples
    --------
    >>> round(float(hashin_shtrikman_lower(0.195, 1.5, 0.3, dimension=3)), 6)
    0.347838
    """
    return conductivity_from_y(k1, k2, fraction, (dimension - 1) * np.minimum(k1, k2))


@elementwise
def hashin_shtrikman_upper(k1: Floats, k2: Floats, fraction: Floats, *, dimension: int) -> Floats:
    r"""Best upper bound for an isotropic two-phase medium of given volume fractions.

    .. math:: k = \langle k \rangle - \frac{f_1 f_2 (k_2 - k_1)^2}
                  {f_2 k_1 + f_1 k_2 + (d - 1) \max(k_1, k_2)}

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of the two phases, in any order; 0 and inf allowed.
    fraction : array_like [-]
        Volume fraction f2 of phase 2.
    dimension : int
        2 or 3.

    Returns
    -------
    array_like [W/(m K)]

    Notes
    -----
    With insulating pores (k1 = 0) it is k2 f / (2 - f) in two dimensions and 2 k2 f / (3 - f) in three.

    References
    ----------
    Z. Hashin and S. Shtrikman, J. Appl. Phys. 33, 3125 (1962), 10.1063/1.1728579.

    Examples
    --------
    >>> round(float(hashin_shtrikman_upper(0.0, 1.0, 0.8, dimension=2)), 6)
    0.666667
    """
    return conductivity_from_y(k1, k2, fraction, (dimension - 1) * np.maximum(k1, k2))
