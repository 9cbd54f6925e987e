"""Size of a contact from load: Hertz, contact force, contact area, mean-field load.

Spheres touch in a disk of radius c, disks (cylinders of unit length) in a strip of half-width c. Functions are of
arrays, one value per contact; a wall has an infinite radius.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from etc_engine.arrays import Floats
from etc_engine.errors import InputError


@dataclass(frozen=True)
class Elastic:
    """Elastic constants of a solid.

    Parameters
    ----------
    youngs_modulus : float [Pa]
    poisson_ratio : float [-]
        Between -1 and 0.5.

    Raises
    ------
    InputError
        If a constant is not physical.
    """

    youngs_modulus: float
    poisson_ratio: float

    def __post_init__(self) -> None:
        if not (self.youngs_modulus > 0.0 and np.isfinite(self.youngs_modulus)):
            raise InputError(f"Young's modulus must be positive and finite [Pa], found {self.youngs_modulus:g}")
        if not -1.0 < self.poisson_ratio <= 0.5:
            raise InputError(f"Poisson's ratio must lie in (-1, 0.5], found {self.poisson_ratio:g}")


def effective_radius(radius_1: ArrayLike, radius_2: ArrayLike) -> Floats:
    """Effective radius R* of a pair, 1/R* = 1/R_1 + 1/R_2 [m]; a wall has radius infinity.

    Examples
    --------
    >>> effective_radius([1.0, 1.0], [1.0, np.inf])
    array([0.5, 1. ])
    """
    r1, r2 = np.asarray(radius_1, dtype=np.float64), np.asarray(radius_2, dtype=np.float64)
    return 1.0 / (1.0 / r1 + 1.0 / r2)


def effective_modulus(side_1: Elastic, side_2: Elastic) -> float:
    """Effective modulus E* of a pair, 1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2 [Pa].

    Examples
    --------
    >>> effective_modulus(Elastic(2.0, 0.0), Elastic(2.0, 0.0))
    1.0
    """
    compliance = sum((1.0 - side.poisson_ratio**2) / side.youngs_modulus for side in (side_1, side_2))
    return 1.0 / compliance


def pair_modulus(youngs: ArrayLike, poisson: ArrayLike, other_youngs: ArrayLike, other_poisson: ArrayLike) -> Floats:
    """Effective modulus E* of many pairs [Pa]; as `effective_modulus`.

    Examples
    --------
    >>> pair_modulus([2.0, 2.0], 0.0, [2.0, np.inf], 0.0)
    array([1., 2.])
    """
    e1, n1, e2, n2 = (np.asarray(v, dtype=np.float64) for v in (youngs, poisson, other_youngs, other_poisson))
    return 1.0 / ((1.0 - n1**2) / e1 + (1.0 - n2**2) / e2)


def hertz_radius(overlap: ArrayLike, radius: ArrayLike) -> Floats:
    r"""Contact radius (3D) or half-width (2D) from the overlap, :math:`c = \sqrt{R^* \delta}` [m].

    Parameters
    ----------
    overlap : array_like [m]
        Approach delta of the centres; a negative overlap touches nowhere (0).
    radius : array_like [m]
        Effective radius R*.

    Returns
    -------
    ndarray [m]

    Notes
    -----
    Only valid with positions computed with the true stiffness. The lens of two overlapping spheres is sqrt(2) wider,
    to leading order. In 2D this is the convention of a cylinder pressed into a half-space: the approach of two
    cylinders depends on where it is measured.

    References
    ----------
    K. L. Johnson, Contact Mechanics (1985), section 4.2. V. L. Popov, Contact Mechanics and Friction (2010),
    equation 5.33.

    Examples
    --------
    >>> float(hertz_radius(0.004, effective_radius(0.05, 0.05)))
    0.01
    """
    delta = np.asarray(overlap, dtype=np.float64)
    return np.sqrt(np.asarray(radius, dtype=np.float64) * np.maximum(delta, 0.0))


def radius_from_force(force: ArrayLike, radius: ArrayLike, modulus: ArrayLike) -> Floats:
    r"""Radius of the contact disk of two spheres from their normal force, :math:`c = (3 F R^*/(4 E^*))^{1/3}` [m].

    Parameters
    ----------
    force : array_like [N]
        Compressive normal force F; a tensile force touches nowhere (0).
    radius : array_like [m]
        Effective radius R*.
    modulus : float [Pa]
        Effective modulus E*.

    Returns
    -------
    ndarray [m]

    References
    ----------
    K. L. Johnson, Contact Mechanics (1985), equation 4.22.

    Examples
    --------
    A sphere of 8 mm (E = 1 GPa, nu = 0.3) on a rigid plane under 60 pi N: 1.010 mm.

    >>> round(1e3 * float(radius_from_force(60 * np.pi, 8e-3, 1e9 / (1 - 0.3**2))), 3)
    1.01
    """
    load = np.maximum(np.asarray(force, dtype=np.float64), 0.0)
    return np.cbrt(0.75 * load * np.asarray(radius, dtype=np.float64) / np.asarray(modulus, dtype=np.float64))


def half_width_from_force(force: ArrayLike, radius: ArrayLike, modulus: ArrayLike) -> Floats:
    r"""Half-width of the contact strip of two parallel cylinders, :math:`c = \sqrt{4 F R^*/(\pi E^*)}` [m].

    Parameters
    ----------
    force : array_like [N/m]
        Compressive normal force F per length; a tensile force touches nowhere (0).
    radius : array_like [m]
        Effective radius R*.
    modulus : float [Pa]
        Effective modulus E*.

    References
    ----------
    K. L. Johnson, Contact Mechanics (1985), equation 4.43.

    Examples
    --------
    >>> float(half_width_from_force(np.pi, 1.0, 4.0))
    1.0
    """
    load = np.maximum(np.asarray(force, dtype=np.float64), 0.0)
    return np.sqrt(4.0 / np.pi * load * np.asarray(radius, dtype=np.float64) / np.asarray(modulus, dtype=np.float64))


def hertz_force(overlap: ArrayLike, radius: ArrayLike, modulus: float) -> Floats:
    r"""Normal force of two spheres from their overlap, :math:`F = \frac43 E^* \sqrt{R^*} \delta^{3/2}` [N].

    With the modulus a DEM run used (often softened), this is the force it computed; `radius_from_force` with the
    true modulus then gives the contact radius under that force.

    Examples
    --------
    >>> float(hertz_force(1.0, 1.0, 0.75))
    1.0
    """
    delta = np.maximum(np.asarray(overlap, dtype=np.float64), 0.0)
    return 4.0 / 3.0 * modulus * np.sqrt(np.asarray(radius, dtype=np.float64)) * delta**1.5


def line_force(overlap: ArrayLike, modulus: float) -> Floats:
    r"""Normal force per length of two parallel cylinders, :math:`F = \frac{\pi}{4} E^* \delta` [N/m].

    References
    ----------
    V. L. Popov, Contact Mechanics and Friction (2010), equation 5.33.
    """
    return 0.25 * np.pi * modulus * np.maximum(np.asarray(overlap, dtype=np.float64), 0.0)


def radius_from_area(area: ArrayLike) -> Floats:
    """Radius of a contact disk of that area, c = sqrt(A/pi) [m]; of a strip of width A, use A/2.

    Examples
    --------
    >>> float(radius_from_area(np.pi))
    1.0
    """
    return np.sqrt(np.maximum(np.asarray(area, dtype=np.float64), 0.0) / np.pi)


def softening_factor(modulus_used: float, modulus: float) -> float:
    r"""Factor on the radius of contacts that a DEM run computed with a softened modulus.

    .. math:: c = c_{DEM} \left(E^*_{DEM}/E^*\right)^{1/3}

    At equal force, by `radius_from_force`; the area scales by the square.

    Parameters
    ----------
    modulus_used, modulus : float [Pa]
        Effective modulus of the DEM run, and of the material.

    Examples
    --------
    >>> softening_factor(1e6, 1e9)
    0.1
    """
    return float(np.cbrt(modulus_used / modulus))


def mean_field_force(pressure: float, radius: float, density: float, coordination: float) -> float:
    r"""Estimate of the normal force per contact of a bed of equal spheres under pressure.

    .. math:: F = \frac{4 \pi p R^2}{\phi Z}

    Parameters
    ----------
    pressure : float [Pa]
        Mean stress p carried by the contacts.
    radius : float [m]
    density, coordination : float [-]
        Solid fraction phi and mean coordination number Z.

    Returns
    -------
    float [N]

    Notes
    -----
    The virial of a bed in which every contact carries the same force. Real beds have a broad distribution of forces.
    The contact radius grows as F^(1/3): for exponentially distributed forces its mean is Gamma(4/3) = 0.893 of the
    estimate.

    Raises
    ------
    InputError
        If the pressure is negative, or there are no contacts.

    Examples
    --------
    >>> round(mean_field_force(1.0, 1.0, 0.5, 8.0), 6)
    3.141593
    """
    _check_load(pressure, radius, density, coordination)
    return 4.0 * np.pi * pressure * radius**2 / (density * coordination)


def mean_field_line_force(pressure: float, radius: float, density: float, coordination: float) -> float:
    r"""Estimate of the normal force per length of a bed of equal cylinders under pressure, :math:`2 \pi p R/(\phi Z)`.

    Notes
    -----
    See `mean_field_force`.

    Examples
    --------
    >>> round(mean_field_line_force(1.0, 1.0, 0.5, 4.0), 6)
    3.141593
    """
    _check_load(pressure, radius, density, coordination)
    return 2.0 * np.pi * pressure * radius / (density * coordination)


def _check_load(pressure: float, radius: float, density: float, coordination: float) -> None:
    if not (pressure >= 0.0 and radius > 0.0 and density > 0.0 and coordination > 0.0):
        raise InputError(
            "a mean-field load needs a pressure >= 0 and a radius, density and coordination > 0, found "
            f"pressure {pressure:g} Pa, radius {radius:g} m, density {density:g}, coordination {coordination:g}"
        )


def reach_from_overlap(overlap: ArrayLike, radius: ArrayLike, dimension: int, softening: ArrayLike = 1.0) -> Floats:
    r"""Half-width of a contact from the overlap of a run with a softened modulus [m].

    .. math:: c = \sqrt{R^* \delta} \, s^{1/3} \text{ (spheres)}, \qquad c = \sqrt{R^* \delta \, s} \text{ (disks)},
              \qquad s = E^*_{DEM}/E^*

    The force of the run is kept; the width is that of the true material under it.

    Parameters
    ----------
    overlap, radius : array_like [m]
        As in `hertz_radius`.
    dimension : int
        2 or 3.
    softening : array_like, optional [-]
        Modulus of the run over that of the material; 1 where the run had the true stiffness.

    Examples
    --------
    >>> reach_from_overlap(1.0, 1.0, 3, 1e-3).round(12), reach_from_overlap(1.0, 1.0, 2, 1e-2).round(12)
    (np.float64(0.1), np.float64(0.1))
    """
    return hertz_radius(overlap, radius) * np.asarray(softening, dtype=np.float64) ** (
        1.0 / 3.0 if dimension == 3 else 0.5
    )


def reach_from_force(force: ArrayLike, radius: ArrayLike, modulus: ArrayLike, dimension: int) -> Floats:
    """Half-width of a contact from its force [m]: `radius_from_force` or `half_width_from_force`."""
    law = radius_from_force if dimension == 3 else half_width_from_force
    return law(force, radius, modulus)


def mean_pressure(reach: ArrayLike, radius: ArrayLike, modulus: ArrayLike, dimension: int) -> Floats:
    r"""Mean pressure in a Hertzian contact of half-width c [Pa].

    .. math:: P = \frac{F}{\pi c^2} = \frac{4 E^* c}{3 \pi R^*} \text{ (spheres)}, \qquad
              P = \frac{F}{2 c} = \frac{\pi E^* c}{8 R^*} \text{ (disks)}

    Examples
    --------
    >>> round(float(mean_pressure(radius_from_force(1.0, 1.0, 1e6), 1.0, 1e6, 3)), 3)
    3856.05
    """
    c, r, e = (np.asarray(v, dtype=np.float64) for v in (reach, radius, modulus))
    return (4.0 / (3.0 * np.pi) if dimension == 3 else np.pi / 8.0) * e * c / r
