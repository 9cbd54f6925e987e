"""Packed beds at temperature and pressure: contact, rarefied gas and radiation; k1 is the fluid, k2 the solid."""

from __future__ import annotations

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.models.broadcasting import elementwise
from etc_engine.models.granular import DENSE, LOOSE, fluid_film, log_remainder

STEFAN_BOLTZMANN = 5.670374419e-8
"""W/(m2 K4) (CODATA 2018)."""


def radiation_coefficient(temperature: Floats | float) -> Floats:
    r"""Linearized exchange of black surfaces, :math:`4 \sigma T^3` [W/(m2 K)].

    Examples
    --------
    >>> round(float(radiation_coefficient(1000.0)), 3)
    226.815
    """
    return 4.0 * STEFAN_BOLTZMANN * np.asarray(temperature) ** 3


@elementwise
def zehner_bauer_schluender(
    k1: Floats,
    k2: Floats,
    fraction: Floats,
    *,
    diameter: Floats,
    temperature: Floats,
    emissivity: Floats,
    jump_length: Floats | float = 0.0,
    contact_fraction: Floats | float = 0.0077,
    shape_factor: Floats | float = 1.25,
) -> Floats:
    r"""Zehner, Bauer and Schluender's bed with contact area, rarefied gas and radiation.

    .. math:: \frac{k}{k_1} = (1 - \sqrt{f})\,\varepsilon \left[\frac{1}{\varepsilon - 1 + 1/k_G} + k_R\right]
              + \sqrt{f} \left[\varphi \lambda + (1 - \varphi) k_c\right]

    .. math:: k_c = \frac{2}{N} \left\{\frac{B (\lambda + k_R - 1)}{N^2 k_G \lambda}
              \ln\frac{\lambda + k_R}{B [k_G + (1 - k_G)(\lambda + k_R)]}
              + \frac{B + 1}{2 B} \left[\frac{k_R}{k_G} - B \left(1 + \frac{1 - k_G}{k_G} k_R\right)\right]
              - \frac{B - 1}{N k_G}\right\}

    .. math:: N = \frac{1}{k_G}\left(1 + \frac{k_R - B k_G}{\lambda}\right)
              - B \left(\frac{1}{k_G} - 1\right)\left(1 + \frac{k_R}{\lambda}\right), \quad
              k_R = \frac{4 \sigma T^3 d}{(2/e - 1) k_1}, \quad k_G = \frac{1}{1 + 2 j/d}

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of the continuum gas and of the solid, positive.
    fraction : array_like [-]
        Solid fraction f.
    diameter : array_like [m]
        Particle diameter d.
    temperature : array_like [K]
    emissivity : array_like [-]
        e of the particles; 0 leaves radiation out.
    jump_length : array_like, optional [m]
        Temperature jump length j of one surface; infinite in vacuum.
    contact_fraction, shape_factor : array_like, optional [-]
        As in `zbs_contact`.

    Returns
    -------
    array_like [W/(m K)]

    Notes
    -----
    The printed k_c is 0/0 where N = 0 and loses all digits near it and at low pressure. With a = lambda + k_R and
    h = 1 - B [k_G + (1 - k_G) a]/a it is, exactly,

    .. math:: k_c = \frac{2 k_G \lambda}{a} \left[\frac{\lambda}{2 a} + \frac{(B + 1) k_R}{2 B k_G}
              + \frac{B (a - 1) k_G \lambda}{a^2} S(h)\right], \qquad S = \sum_{n \ge 0} \frac{h^n}{n + 3}

    which is what is computed. Limits: no radiation and continuum: `zbs_contact`; vacuum with e = 1 and no
    contact: `breitbach_barthels`.

    References
    ----------
    R. Bauer and E. U. Schluender, Int. Chem. Eng. 18, 189 (1978). VDI Heat Atlas, 2nd ed. (2010), section D6.3.

    Examples
    --------
    >>> k = zehner_bauer_schluender(1.0, 100.0, 0.6, diameter=1e-3, temperature=300.0, emissivity=0.0)
    >>> round(float(k), 6)
    9.416701
    """
    porosity, contrast = 1.0 - fraction, k2 / k1
    b = shape_factor * (fraction / porosity) ** (10.0 / 9.0)
    exchange = np.where(emissivity > 0.0, radiation_coefficient(temperature) * emissivity / (2.0 - emissivity), 0.0)
    k_r = exchange * diameter / k1
    k_g = 1.0 / (1.0 + 2.0 * jump_length / diameter)
    a = contrast + k_r
    h = 1.0 - b * (k_g + (1.0 - k_g) * a) / a
    middle = b * (a - 1.0) * k_g * contrast / a**2 * log_remainder(h)
    core = contrast / a * (k_g * contrast / a + (b + 1.0) * k_r / b + 2.0 * k_g * middle)
    open_gas = k_g / (1.0 - fraction * k_g)  # 1/(porosity - 1 + 1/k_g)
    root = np.sqrt(fraction)
    k = (1.0 - root) * porosity * (open_gas + k_r)
    k = k1 * (k + root * (contact_fraction * contrast + (1.0 - contact_fraction) * core))
    return np.where(fraction == 1.0, k2, k)


@elementwise
def breitbach_barthels(
    k2: Floats,
    fraction: Floats,
    *,
    diameter: Floats,
    temperature: Floats,
    emissivity: Floats,
) -> Floats:
    r"""Breitbach and Barthels' radiative conductivity of a pebble bed, without its gas and its contacts.

    .. math:: k = \left\{(1 - \sqrt{f})\,\varepsilon + \frac{\sqrt{f}}{2/e - 1} \frac{B + 1}{B}
              \frac{1}{1 + 1/[(2/e - 1) \Lambda]}\right\} 4 \sigma T^3 d, \qquad
              \Lambda = \frac{k_2}{4 \sigma T^3 d}, \quad B = 1.25 \left(\frac{f}{\varepsilon}\right)^{10/9}

    Parameters
    ----------
    k2 : array_like [W/(m K)]
        Conductivity of the solid, positive.
    fraction : array_like [-]
        Solid fraction f.
    diameter : array_like [m]
        Particle diameter d.
    temperature : array_like [K]
    emissivity : array_like [-]

    Returns
    -------
    array_like [W/(m K)]
        To be added to the conductivity by gas and contacts.

    Notes
    -----
    Black voids: for e < 1 its first term exceeds that of Zehner, Bauer and Schluender.

    References
    ----------
    G. Breitbach and H. Barthels, Nucl. Technol. 49, 392 (1980), 10.13182/NT80-A17687.

    Examples
    --------
    >>> k = breitbach_barthels(50.0, 0.61, diameter=0.06, temperature=1273.15, emissivity=0.8)
    >>> round(float(k), 4)
    18.2153
    """
    porosity = 1.0 - fraction
    b = 1.25 * (fraction / porosity) ** (10.0 / 9.0)
    black = radiation_coefficient(temperature) * diameter
    resistance = 2.0 / emissivity - 1.0
    share = np.sqrt(fraction) / resistance * (b + 1.0) / b / (1.0 + black / (resistance * k2))
    return ((1.0 - np.sqrt(fraction)) * porosity + share) * black


@elementwise
def kunii_smith_radiation(
    k1: Floats,
    k2: Floats,
    fraction: Floats,
    *,
    diameter: Floats,
    temperature: Floats,
    emissivity: Floats,
    spacing: Floats | float = 1.0,
) -> Floats:
    r"""Kunii and Smith's bed with radiation between surfaces and between voids.

    .. math:: \frac{k}{k_1} = \varepsilon \left(1 + \beta \frac{h_{rv} d}{k_1}\right)
              + \frac{\beta f}{1/(1/\varphi + h_{rs} d/k_1) + 2/(3 \lambda)}

    .. math:: h_{rv} = \frac{4 \sigma T^3}{1 + \frac{\varepsilon (1 - e)}{2 e (1 - \varepsilon)}}, \qquad
              h_{rs} = 4 \sigma T^3 \frac{e}{2 - e}

    with the film thickness phi of `kunii_smith`.

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of fluid and solid, positive and finite.
    fraction : array_like [-]
        Solid fraction f, positive.
    diameter : array_like [m]
    temperature : array_like [K]
    emissivity : array_like [-]
    spacing : array_like [-], optional
        beta: centre distance over diameter, 0.9 to 1.

    Returns
    -------
    array_like [W/(m K)]

    Notes
    -----
    The factor 0.1952 (T/100)^3 of the original is 4 sigma T^3 in kcal/(m2 h K).

    References
    ----------
    D. Kunii and J. M. Smith, AIChE J. 6, 71 (1960), 10.1002/aic.690060115. S. Yagi and D. Kunii, AIChE J. 3, 373
    (1957), 10.1002/aic.690030317, the coefficients of radiation.

    Examples
    --------
    >>> k = kunii_smith_radiation(1.0, 100.0, 0.6, diameter=1e-3, temperature=1e-3, emissivity=0.8)
    >>> round(float(k), 6)
    8.345371
    """
    porosity = 1.0 - fraction
    black = radiation_coefficient(temperature) * diameter / k1
    surfaces = black * emissivity / (2.0 - emissivity)
    voids = black / (1.0 + 0.5 * porosity * (1.0 - emissivity) / (emissivity * fraction))
    loose, dense = fluid_film(k1, k2, 1.5), fluid_film(k1, k2, 4.0 * np.sqrt(3.0))
    film = dense + (loose - dense) * np.clip((porosity - DENSE) / (LOOSE - DENSE), 0.0, 1.0)
    chain = 1.0 / (1.0 / film + surfaces) + 2.0 / 3.0 * k1 / k2
    return k1 * (porosity * (1.0 + spacing * voids) + spacing * fraction / chain)


def _root_of_cube(fraction: Floats, contact: Floats) -> Floats:
    """Side g of Hsu's cubes per cell: (1 - 3 c^2) g^3 + 3 c^2 g^2 = f, by Newton from above."""
    g = np.ones_like(fraction)
    for _ in range(60):
        residual = (1.0 - 3.0 * contact**2) * g**3 + 3.0 * contact**2 * g**2 - fraction
        slope = 3.0 * (1.0 - 3.0 * contact**2) * g**2 + 6.0 * contact**2 * g
        step = np.where(slope > 0.0, residual / np.where(slope > 0.0, slope, 1.0), 0.0)
        g = np.clip(g - step, 0.0, 1.0)
    return g


@elementwise
def hsu_cubes(k1: Floats, k2: Floats, fraction: Floats, contact_width: Floats | float = 0.13) -> Floats:
    r"""Hsu, Cheng and Wong's array of cubes that touch through square connecting plates (3D).

    .. math:: \frac{k}{k_1} = 1 - g^2 - 2 c g + 2 c g^2 + c^2 g^2 \lambda
              + \frac{g^2 - c^2 g^2}{1 - g + g/\lambda} + \frac{2 (c g - c g^2)}{1 - c g + c g/\lambda}

    with :math:`\lambda = k_2/k_1` and :math:`f = (1 - 3 c^2) g^3 + 3 c^2 g^2`.

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of fluid and solid, positive.
    fraction : array_like [-]
        Solid fraction f.
    contact_width : array_like [-], optional
        c: width of the plates over that of the cubes; 0.13 fits measurements.

    Returns
    -------
    array_like [W/(m K)]

    References
    ----------
    C. T. Hsu, P. Cheng and K. W. Wong, J. Heat Transfer 117, 264 (1995), 10.1115/1.2822515.

    Examples
    --------
    >>> round(float(hsu_cubes(1.0, 1.0, 0.6)), 12)
    1.0
    """
    ratio, c = k1 / k2, np.broadcast_to(contact_width, np.shape(k1))
    g = _root_of_cube(np.asarray(fraction), c)
    k = 1.0 - g**2 - 2.0 * c * g + 2.0 * c * g**2 + c**2 * g**2 / ratio
    k = k + (g**2 - c**2 * g**2) / (1.0 - g + g * ratio) + 2.0 * (c * g - c * g**2) / (1.0 - c * g + c * g * ratio)
    return k1 * k


@elementwise
def hsu_square_cylinders(k1: Floats, k2: Floats, fraction: Floats, contact_width: Floats | float = 0.01) -> Floats:
    r"""Hsu, Cheng and Wong's array of square cylinders that touch through connecting plates (2D).

    .. math:: \frac{k}{k_1} = g c \lambda + \frac{g (1 - c)}{1 + (1/\lambda - 1) g}
              + \frac{1 - g}{1 + (1/\lambda - 1) g c}, \qquad f = g^2 + 2 c g (1 - g)

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of fluid and solid, positive.
    fraction : array_like [-]
        Solid fraction f.
    contact_width : array_like [-], optional
        c: width of the plates over that of the cylinders; 0.01 fits measurements.

    Returns
    -------
    array_like [W/(m K)]

    References
    ----------
    C. T. Hsu, P. Cheng and K. W. Wong, J. Heat Transfer 117, 264 (1995), 10.1115/1.2822515.

    Examples
    --------
    >>> round(float(hsu_square_cylinders(1.0, 1.0, 0.6)), 12)
    1.0
    """
    contrast, c = k2 / k1, contact_width
    g = fraction / (c + np.sqrt(c**2 + (1.0 - 2.0 * c) * fraction))  # positive root of f = (1 - 2 c) g^2 + 2 c g
    excess = 1.0 / contrast - 1.0
    return k1 * (g * c * contrast + g * (1.0 - c) / (1.0 + excess * g) + (1.0 - g) / (1.0 + excess * g * c))


@elementwise
def hamilton_crosser(k1: Floats, k2: Floats, fraction: Floats, sphericity: Floats | float = 1.0) -> Floats:
    r"""Hamilton and Crosser's dispersion of particles of any shape: Maxwell's formula with a shape factor.

    .. math:: \frac{k}{k_1} = \frac{k_2 + (n - 1) k_1 - (n - 1) f (k_1 - k_2)}{k_2 + (n - 1) k_1 + f (k_1 - k_2)},
              \qquad n = \frac{3}{\psi}

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of matrix and particles, positive.
    fraction : array_like [-]
        Volume fraction f of the particles.
    sphericity : array_like [-], optional
        psi: surface of the sphere of equal volume over that of the particle; 1 is Maxwell's formula.

    Returns
    -------
    array_like [W/(m K)]

    References
    ----------
    R. L. Hamilton and O. K. Crosser, Ind. Eng. Chem. Fundam. 1, 187 (1962), 10.1021/i160003a005.

    Examples
    --------
    >>> round(float(hamilton_crosser(0.195, 1.5, 0.3)), 6)
    0.347838
    """
    n = 3.0 / sphericity
    rest = 1.0 - fraction
    top = k2 * (1.0 + (n - 1.0) * fraction) + (n - 1.0) * k1 * rest  # sums of positive terms: no cancellation
    return k1 * top / (k2 * rest + k1 * (n - 1.0 + fraction))
