"""Resistance of a contact between rough surfaces: plastic or elastic asperities, and the gas between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from etc_engine.arrays import Floats
from etc_engine.errors import InputError


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
