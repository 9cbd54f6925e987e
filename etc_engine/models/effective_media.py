"""Estimates from one inclusion in a matrix: Maxwell, self-consistent, differential, interface resistance."""

from __future__ import annotations

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.models.broadcasting import elementwise
from etc_engine.models.phases import conductivity_from_y, with_pure_phases


@elementwise
def maxwell(k1: Floats, k2: Floats, fraction: Floats, *, dimension: int) -> Floats:
    r"""Disks or spheres (phase 2) in a matrix (phase 1), each in the mean field of the others.

    .. math:: \frac{k}{k_1} = \frac{1 + (d - 1) f \beta}{1 - f \beta}, \qquad
              \beta = \frac{k_2 - k_1}{k_2 + (d - 1) k_1}

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of matrix and inclusions; 0 and inf allowed.
    fraction : array_like [-]
        Volume fraction f of the inclusions.
    dimension : int
        2 for disks, 3 for spheres.

    Returns
    -------
    array_like [W/(m K)]

    Notes
    -----
    Exact to first order in f, and equal to a Hashin-Shtrikman bound at every f. An insulating matrix
    (k1 = 0) gives 0: `maxwell_inverse` is the form for a conducting solid with insulating pores.

    References
    ----------
    J. C. Maxwell, *A Treatise on Electricity and Magnetism* (1873), article 314.
    Lord Rayleigh, Phil. Mag. 34, 481 (1892), 10.1080/14786449208620364 (the form for disks).

    Examples
    --------
    >>> round(float(maxwell(1.0, 10.0, 0.3, dimension=2)), 6)
    1.650602
    """
    return conductivity_from_y(k1, k2, fraction, (dimension - 1) * k1)


@elementwise
def maxwell_inverse(k1: Floats, k2: Floats, fraction: Floats, *, dimension: int) -> Floats:
    r"""Pores as disks or spheres (phase 1) in a conducting solid (phase 2): Maxwell the other way round.

    `maxwell` with the phases exchanged: :math:`k(k_1, k_2, f) = k_\mathrm{Maxwell}(k_2, k_1, 1 - f)`.

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of pores and solid; 0 and inf allowed.
    fraction : array_like [-]
        Volume fraction f of the solid.
    dimension : int
        2 for disks, 3 for spheres.

    Returns
    -------
    array_like [W/(m K)]

    References
    ----------
    A. Eucken, Forsch. Gebiete Ingenieurwes. B3, Forschungsheft 353 (1932).

    Examples
    --------
    >>> round(float(maxwell_inverse(0.0, 1.0, 0.8, dimension=2)), 6)
    0.666667
    """
    return conductivity_from_y(k1, k2, fraction, (dimension - 1) * k2)


@elementwise
def effective_medium(k1: Floats, k2: Floats, fraction: Floats, *, dimension: int) -> Floats:
    r"""Symmetric effective medium: both phases as disks or spheres in the medium they make.

    .. math:: (1 - f) \frac{k_1 - k}{k_1 + (d - 1) k} + f \frac{k_2 - k}{k_2 + (d - 1) k} = 0

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of the two phases; 0 and inf allowed.
    fraction : array_like [-]
        Volume fraction f of phase 2.
    dimension : int
        2 or 3.

    Returns
    -------
    array_like [W/(m K)]

    Notes
    -----
    Treats the phases alike, so it percolates at f = 1/d: with k1 = 0 it is 0 below. In two dimensions it
    is exact for media that are statistically the same with the phases exchanged (k = sqrt(k1 k2), f = 1/2).

    References
    ----------
    D. A. G. Bruggeman, Ann. Phys. 416, 636 (1935), 10.1002/andp.19354160705.
    R. Landauer, J. Appl. Phys. 23, 779 (1952), 10.1063/1.1702301.

    Examples
    --------
    >>> round(float(effective_medium(1.0, 4.0, 0.5, dimension=2)), 12)
    2.0
    """
    return self_consistent(k1, k2, fraction, np.full_like(fraction, dimension))


def self_consistent(k1: Floats, k2: Floats, fraction: Floats, d: Floats) -> Floats:
    """Positive root of the self-consistent equation for any real d >= 1 (d = z/2 for bonds of a network)."""
    low, high = np.minimum(k1, k2), np.maximum(k1, k2)
    high_fraction = np.where(k2 >= k1, fraction, 1.0 - fraction)
    # (d - 1) k^2 - b k - low high = 0
    b = low * (d * (1.0 - high_fraction) - 1.0) + high * (d * high_fraction - 1.0)
    root = np.sqrt(b * b + 4.0 * (d - 1.0) * low * high)
    k = np.where(b >= 0.0, 0.5 * (b + root) / (d - 1.0), 2.0 * low * high / (root - b))
    percolating = d * high_fraction >= 1.0
    k = np.where(np.isinf(high), np.where(percolating, np.inf, low / (1.0 - d * high_fraction)), k)
    return with_pure_phases(k, k1, k2, fraction)


@elementwise
def differential(k1: Floats, k2: Floats, fraction: Floats, *, dimension: int) -> Floats:
    r"""Differential (asymmetric Bruggeman) medium: inclusions (phase 2) added bit by bit to the matrix.

    .. math:: \frac{k_2 - k}{k_2 - k_1} \left(\frac{k_1}{k}\right)^{1/d} = 1 - f

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of matrix and inclusions; 0 and inf allowed.
    fraction : array_like [-]
        Volume fraction f of the inclusions.
    dimension : int
        2 for disks, 3 for spheres.

    Returns
    -------
    array_like [W/(m K)]

    Notes
    -----
    Each addition sees inclusions much smaller than itself: wide size distributions. The matrix stays
    connected at every f, so k1 = 0 gives 0; `differential_inverse` has the solid as the matrix.

    References
    ----------
    D. A. G. Bruggeman, Ann. Phys. 416, 636 (1935), 10.1002/andp.19354160705.

    Examples
    --------
    >>> round(float(differential(0.195, 1.5, 0.3, dimension=3)), 6)
    0.369546
    """
    return _differential(k1, k2, fraction, dimension)


@elementwise
def differential_inverse(k1: Floats, k2: Floats, fraction: Floats, *, dimension: int) -> Floats:
    r"""Differential medium of pores (phase 1) added bit by bit to a solid (phase 2).

    `differential` with the phases exchanged; with k1 = 0 it is Archie's law
    :math:`k = k_2 f^{d/(d - 1)}`.

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of pores and solid; 0 and inf allowed.
    fraction : array_like [-]
        Volume fraction f of the solid.
    dimension : int
        2 for disks, 3 for spheres.

    Returns
    -------
    array_like [W/(m K)]

    References
    ----------
    D. A. G. Bruggeman, Ann. Phys. 416, 636 (1935), 10.1002/andp.19354160705.

    Examples
    --------
    >>> round(float(differential_inverse(0.0, 1.0, 0.8, dimension=2)), 12)
    0.64
    """
    return _differential(k2, k1, 1.0 - fraction, dimension)


def _differential(k1: Floats, k2: Floats, fraction: Floats, dimension: int) -> Floats:
    contrast = k2 / k1
    c = (1.0 - fraction) * (contrast - 1.0)
    x = _quadratic_root(c, contrast) if dimension == 2 else _cubic_root(c, contrast)
    k = k1 * x**dimension
    k = np.where(np.isinf(k2), k1 / (1.0 - fraction) ** dimension, k)
    k = np.where(k1 == 0.0, 0.0, np.where(np.isinf(k1), np.inf, k))
    return with_pure_phases(k, k1, k2, fraction)


def _quadratic_root(c: Floats, q: Floats) -> Floats:
    """Positive root of x^2 + c x - q = 0, without cancellation."""
    root = np.sqrt(c * c + 4.0 * q)
    return np.where(c > 0.0, 2.0 * q / (root + c), 0.5 * (root - c))


def _cubic_root(c: Floats, q: Floats) -> Floats:
    """Positive root of x^3 + c x - q = 0 with q >= 0, by the hyperbolic and trigonometric formulas."""
    scale = np.sqrt(np.abs(c) / 3.0)
    y = 0.5 * q / scale**3
    above = np.where(
        y >= 1.0,
        np.cosh(np.arccosh(np.maximum(y, 1.0)) / 3.0),
        np.cos(np.arccos(np.minimum(y, 1.0)) / 3.0),
    )
    x = 2.0 * scale * np.where(c > 0.0, np.sinh(np.arcsinh(y) / 3.0), above)
    x = np.where(np.isinf(y), np.cbrt(q), x)
    newton = (2.0 * x**3 + q) / (3.0 * x**2 + c)  # one step takes the last digits back
    return np.where(newton > 0.0, newton, x)


@elementwise
def hasselman_johnson(
    k1: Floats,
    k2: Floats,
    fraction: Floats,
    radius: Floats,
    interface_conductance: Floats,
    *,
    dimension: int,
) -> Floats:
    r"""Disks or spheres behind an interface resistance: Maxwell with a weakened inclusion.

    .. math:: k = k_\mathrm{Maxwell}\left(k_1, \frac{k_2}{1 + k_2/(a h)}, f\right)

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of matrix and inclusions; 0 and inf allowed.
    fraction : array_like [-]
        Volume fraction f of the inclusions.
    radius : array_like [m]
        Inclusion radius a.
    interface_conductance : array_like [W/(m2 K)]
        Conductance h of the interface per area; inf is perfect contact.
    dimension : int
        2 for disks, 3 for spheres.

    Returns
    -------
    array_like [W/(m K)]

    Notes
    -----
    Better conducting inclusions of radius a = k1 k2 / (h (k2 - k1)) leave the matrix as it was, and smaller
    ones worsen it. At f = 1 the result is the weakened k2, not k2.

    References
    ----------
    D. P. H. Hasselman and L. F. Johnson, J. Compos. Mater. 21, 508 (1987), 10.1177/002199838702100602.

    Examples
    --------
    >>> float(hasselman_johnson(1.0, 2.0, 0.3, 1.0, 2.0, dimension=3))
    1.0
    """
    weakened = 1.0 / (1.0 / k2 + 1.0 / (radius * interface_conductance))
    return conductivity_from_y(k1, weakened, fraction, (dimension - 1) * k1)
