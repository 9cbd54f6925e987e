"""Models that know the microstructure through one three-point parameter, zeta_2."""

from __future__ import annotations

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.models.broadcasting import elementwise
from etc_engine.models.phases import conductivity_from_y, polarizability, with_pure_phases


def zeta2_hard_particles(fraction: Floats, *, dimension: int) -> Floats:
    r"""Three-point parameter of random, non-overlapping, equal disks or spheres in equilibrium.

    .. math:: \zeta_2 = \begin{cases} f/3 - 0.05707 f^2 & d = 2 \\
              0.21068 f - 0.04693 f^2 + 0.00247 f^3 & d = 3 \end{cases}

    Parameters
    ----------
    fraction : ndarray [-]
        Area or volume fraction f of the particles.
    dimension : int
        2 for disks, 3 for spheres.

    Returns
    -------
    ndarray [-]

    References
    ----------
    S. Torquato and F. Lado, Proc. R. Soc. Lond. A 417, 59 (1988): disks.
    C. A. Miller and S. Torquato, J. Appl. Phys. 68, 5486 (1990), 10.1063/1.347007: spheres.

    Examples
    --------
    >>> round(float(zeta2_hard_particles(0.5, dimension=2)), 6)
    0.152399
    """
    if dimension == 2:
        return fraction / 3.0 - 0.05707 * fraction**2
    return 0.21068 * fraction - 0.04693 * fraction**2 + 0.00247 * fraction**3


def _zeta2(zeta2: Floats | None, fraction: Floats, dimension: int) -> Floats:
    return zeta2_hard_particles(fraction, dimension=dimension) if zeta2 is None else zeta2


@elementwise
def third_order(k1: Floats, k2: Floats, fraction: Floats, zeta2: Floats | None = None, *, dimension: int) -> Floats:
    r"""Third-order expansion about Maxwell's structure, for dispersions of disks or spheres.

    .. math:: \frac{k}{k_1} = \frac{1 + (d - 1) f \beta - (d - 1)(1 - f) \zeta_2 \beta^2}
                                   {1 - f \beta - (d - 1)(1 - f) \zeta_2 \beta^2}, \qquad
              \beta = \frac{k_2 - k_1}{k_2 + (d - 1) k_1}

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of matrix and particles; 0 and inf allowed.
    fraction : array_like [-]
        Volume fraction f of the particles.
    zeta2 : array_like [-], optional
        Three-point parameter of the particle phase, in [0, 1]; by default that of random hard disks or
        spheres (`zeta2_hard_particles`).
    dimension : int
        2 for disks, 3 for spheres.

    Returns
    -------
    array_like [W/(m K)]

    Notes
    -----
    Good for particles that do not form large clusters, whatever the contrast.

    References
    ----------
    S. Torquato, J. Appl. Phys. 58, 3790 (1985), 10.1063/1.335593.

    Examples
    --------
    >>> round(float(third_order(0.195, 1.5, 0.3, dimension=3)), 6)
    0.355833
    """
    beta = polarizability(k1, k2, dimension)
    shift = (dimension - 1) * (1.0 - fraction) * _zeta2(zeta2, fraction, dimension) * beta**2
    k = k1 * (1.0 + (dimension - 1) * fraction * beta - shift) / (1.0 - fraction * beta - shift)
    return with_pure_phases(k, k1, k2, fraction)


@elementwise
def three_point_lower(
    k1: Floats, k2: Floats, fraction: Floats, zeta2: Floats | None = None, *, dimension: int
) -> Floats:
    r"""Lower three-point bound for an isotropic two-phase medium of known :math:`\zeta_2`.

    .. math:: k = \langle k \rangle - \frac{f_1 f_2 (k_2 - k_1)^2}{f_2 k_1 + f_1 k_2 + (d - 1) X}, \qquad
              1/X = (1 - \zeta_2)/k_1 + \zeta_2/k_2

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of the phases; 0 and inf allowed.
    fraction : array_like [-]
        Volume fraction f2 of phase 2.
    zeta2 : array_like [-], optional
        Three-point parameter of phase 2, in [0, 1]; by default that of random hard disks or spheres.
    dimension : int
        2 or 3.

    Returns
    -------
    array_like [W/(m K)]

    References
    ----------
    M. J. Beran, Nuovo Cimento 38, 771 (1965).
    G. W. Milton, Phys. Rev. Lett. 46, 542 (1981), 10.1103/PhysRevLett.46.542.
    S. Torquato, *Random Heterogeneous Materials* (2002), 10.1007/978-1-4757-6355-3.

    Examples
    --------
    >>> round(float(three_point_lower(1.0, 10.0, 0.3, 0.0, dimension=2)), 6)  # zeta2 = 0: Maxwell
    1.650602
    """
    zeta = _zeta2(zeta2, fraction, dimension)
    x = conductivity_from_y(k1, k2, zeta, np.zeros_like(zeta))
    return conductivity_from_y(k1, k2, fraction, (dimension - 1) * x)


@elementwise
def three_point_upper(
    k1: Floats, k2: Floats, fraction: Floats, zeta2: Floats | None = None, *, dimension: int
) -> Floats:
    r"""Upper three-point bound for an isotropic two-phase medium of known :math:`\zeta_2`.

    .. math:: k = \langle k \rangle - \frac{f_1 f_2 (k_2 - k_1)^2}{f_2 k_1 + f_1 k_2 + (d - 1) X}, \qquad
              X = (1 - \zeta_2) k_1 + \zeta_2 k_2

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of the phases; 0 and inf allowed.
    fraction : array_like [-]
        Volume fraction f2 of phase 2.
    zeta2 : array_like [-], optional
        Three-point parameter of phase 2, in [0, 1]; by default that of random hard disks or spheres.
    dimension : int
        2 or 3.

    Returns
    -------
    array_like [W/(m K)]

    References
    ----------
    As `three_point_lower`.

    Examples
    --------
    >>> three_point_upper(1.0, 10.0, 0.3, dimension=2) > three_point_lower(1.0, 10.0, 0.3, dimension=2)
    np.True_
    """
    zeta = _zeta2(zeta2, fraction, dimension)
    x = with_pure_phases((1.0 - zeta) * k1 + zeta * k2, k1, k2, zeta)
    return conductivity_from_y(k1, k2, fraction, (dimension - 1) * x)
