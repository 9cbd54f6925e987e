"""Size and resistance of a contact from load: Hertz, contact force, contact area, mean-field load, roughness.

Spheres touch in a disk of radius c, disks (cylinders of unit length) in a strip of half-width c. Functions are of
arrays, one value per contact; a wall has an infinite radius.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from etc_engine.errors import InputError

Floats = NDArray[np.float64]


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


def radius_from_force(force: ArrayLike, radius: ArrayLike, modulus: float) -> Floats:
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
    return np.cbrt(0.75 * load * np.asarray(radius, dtype=np.float64) / modulus)


def half_width_from_force(force: ArrayLike, radius: ArrayLike, modulus: float) -> Floats:
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
    return np.sqrt(4.0 / np.pi * load * np.asarray(radius, dtype=np.float64) / modulus)


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


@dataclass(frozen=True)
class Roughness:
    """Roughness of a pair of surfaces.

    Parameters
    ----------
    height : float [m]
        Root-mean-square height of both surfaces, sqrt(s_1^2 + s_2^2).
    slope : float [-]
        Root-mean-square slope of both surfaces, sqrt(m_1^2 + m_2^2).
    hardness : float, optional [Pa]
        Microhardness of the softer one, for plastic asperities.
    modulus : float, optional [Pa]
        Effective modulus E*, for elastic asperities. Give hardness or modulus, not both.
    """

    height: float
    slope: float
    hardness: float | None = None
    modulus: float | None = None

    def __post_init__(self) -> None:
        if not (self.height >= 0.0 and self.slope > 0.0):
            raise InputError(
                f"roughness needs a height >= 0 and a slope > 0, found height {self.height:g} m, slope {self.slope:g}"
            )
        given = [value for value in (self.hardness, self.modulus) if value is not None]
        if len(given) != 1 or not given[0] > 0.0:
            raise InputError("roughness needs either hardness (plastic) or modulus (elastic), positive [Pa]")


def solid_spot_conductance(pressure: ArrayLike, conductivity: ArrayLike, roughness: Roughness) -> Floats:
    r"""Conductance per area of the microcontacts of two rough surfaces [W/(m2 K)].

    .. math:: h_c = 1.25 k_h \frac{m}{s} \left(\frac{P}{H}\right)^{0.95} \text{(plastic)}, \qquad
              h_c = 1.55 k_h \frac{m}{s} \left(\frac{\sqrt2 P}{m E^*}\right)^{0.94} \text{(elastic)}

    Parameters
    ----------
    pressure : array_like [Pa]
        Mean pressure P in the contact.
    conductivity : array_like [W/(m K)]
        Harmonic mean k_h = 2 k_1 k_2/(k_1 + k_2) of both solids.
    roughness : Roughness

    Returns
    -------
    ndarray [W/(m2 K)]
        Infinite for smooth surfaces.

    References
    ----------
    M. G. Cooper, B. B. Mikic and M. M. Yovanovich, Int. J. Heat Mass Transfer 12, 279 (1969); M. M. Yovanovich (1982)
    for the constants of the plastic form. B. B. Mikic, Int. J. Heat Mass Transfer 17, 205 (1974), the elastic form.

    Examples
    --------
    >>> round(float(solid_spot_conductance(1e6, 10.0, Roughness(1e-6, 0.1, hardness=1e6))))
    1250000
    """
    if roughness.height == 0.0:
        return np.full(np.broadcast_shapes(np.shape(pressure), np.shape(conductivity)), np.inf)
    p, k = np.asarray(pressure, dtype=np.float64), np.asarray(conductivity, dtype=np.float64)
    ratio = roughness.slope / roughness.height
    if roughness.hardness is not None:
        return 1.25 * k * ratio * (p / roughness.hardness) ** 0.95
    assert roughness.modulus is not None
    return 1.55 * k * ratio * (np.sqrt(2.0) * p / (roughness.slope * roughness.modulus)) ** 0.94


def micro_gap_conductance(pressure: ArrayLike, gas_conductivity: float, jump: float, roughness: Roughness) -> Floats:
    r"""Conductance per area of the gas between the microcontacts of two rough surfaces [W/(m2 K)].

    .. math:: h_g = \frac{k_g}{Y + M}, \qquad Y = 1.53\, s \left(\frac{P}{H}\right)^{-0.097}, \qquad M = j_1 + j_2

    Parameters
    ----------
    pressure : array_like [Pa]
        Mean pressure P in the contact.
    gas_conductivity : float [W/(m K)]
    jump : float [m]
        Sum M of both jump lengths; infinite in vacuum.
    roughness : Roughness
        With a hardness: the plane separation Y is that of plastic asperities. With a modulus, P/H is replaced by
        sqrt2 P/(m E*), the relative pressure of the elastic conductance: an assumption of this code.

    References
    ----------
    M. M. Yovanovich (1982).

    Examples
    --------
    >>> float(micro_gap_conductance(1e6, 0.153, 0.0, Roughness(1e-6, 0.1, hardness=1e6)))
    100000.0
    """
    p = np.asarray(pressure, dtype=np.float64)
    if roughness.hardness is not None:
        relative = p / roughness.hardness
    else:
        assert roughness.modulus is not None
        relative = np.sqrt(2.0) * p / (roughness.slope * roughness.modulus)
    with np.errstate(divide="ignore"):
        gap = 1.53 * roughness.height * relative**-0.097
        return gas_conductivity / (gap + jump)


def area_resistance(
    pressure: ArrayLike,
    conductivity: ArrayLike,
    roughness: Roughness,
    gas_conductivity: float = 0.0,
    jump: float = 0.0,
) -> Floats:
    r"""Resistance of a rough contact times its area, :math:`1/(h_c + h_g)` [m2 K/W].

    Parameters
    ----------
    pressure : array_like [Pa]
        Mean pressure F/(pi c^2) in the contact disk (F/(2 c) in a strip).
    conductivity : array_like [W/(m K)]
        Harmonic mean of both solids.
    roughness : Roughness
    gas_conductivity : float, optional [W/(m K)]
        0 is vacuum.
    jump : float, optional [m]
        Sum of both jump lengths.

    Returns
    -------
    ndarray [m2 K/W]
        0 for smooth surfaces.

    Examples
    --------
    >>> float(area_resistance(1e6, 10.0, Roughness(0.0, 0.1, hardness=1e9)))
    0.0
    >>> round(1e7 * float(area_resistance(1e6, 10.0, Roughness(1e-6, 0.1, hardness=1e6))), 9)
    8.0
    """
    shape = np.broadcast_shapes(np.shape(pressure), np.shape(conductivity))
    if roughness.height == 0.0:
        return np.zeros(shape)
    solid = solid_spot_conductance(pressure, conductivity, roughness)
    if gas_conductivity > 0.0:
        solid = solid + micro_gap_conductance(pressure, gas_conductivity, jump, roughness)
    with np.errstate(divide="ignore"):
        return 1.0 / solid
