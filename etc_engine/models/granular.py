"""Packed beds of particles in a stagnant fluid: k1 is the fluid, k2 the solid, fraction the solid's."""

from __future__ import annotations

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.models.broadcasting import elementwise
from etc_engine.models.phases import with_pure_phases

LOOSE, DENSE = 0.476, 0.26
"""Porosities of the simple cubic and the close packing, between which Kunii and Smith interpolate."""


def log_remainder(h: Floats) -> Floats:
    """(-log(1 - h) - h - h^2/2) / h^3 = sum of h^n/(n + 3), finite at h = 0."""
    series = np.zeros_like(h)
    for n in range(39, -1, -1):  # 0.35^40 is below the rounding error
        series = series * h + 1.0 / (n + 3.0)
    closed = (-np.log1p(-h) - h - 0.5 * h * h) / h**3
    return np.where(np.abs(h) < 0.35, series, closed)


def _unit_cell(k1: Floats, k2: Floats, fraction: Floats, shape_factor: Floats | float) -> Floats:
    """Zehner and Schluender's core conductivity k_c, over k1."""
    b = shape_factor * (fraction / (1.0 - fraction)) ** (10.0 / 9.0)
    h = 1.0 - b * k1 / k2
    # The printed form has poles at k2 = b k1 (h = 0) that cancel; this one has none.
    return 2.0 * (b * (1.0 - k1 / k2) * log_remainder(h) + 0.5)


@elementwise
def zehner_schluender(k1: Floats, k2: Floats, fraction: Floats, shape_factor: Floats | float = 1.25) -> Floats:
    r"""Bed of particles in point contact: a unit cell of fluid beside a core of shaped particles.

    .. math:: \frac{k}{k_1} = 1 - \sqrt{f} + \frac{2 \sqrt{f}}{h} \left[
              \frac{(1 - 1/\lambda) B}{h^2} \ln\frac{\lambda}{B} - \frac{B + 1}{2} - \frac{B - 1}{h} \right],
              \quad h = 1 - \frac{B}{\lambda}, \quad B = C \left(\frac{f}{1 - f}\right)^{10/9}, \quad
              \lambda = k_2/k_1

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of fluid and solid, positive.
    fraction : array_like [-]
        Solid fraction f.
    shape_factor : array_like [-], optional
        C: 1.25 for spheres, 1.4 for broken particles, 2.5 for cylinders.

    Returns
    -------
    array_like [W/(m K)]

    Notes
    -----
    No contact area and no radiation; used for contrasts up to about 2000.

    References
    ----------
    P. Zehner and E. U. Schluender, Chem. Ing. Tech. 42, 933 (1970), 10.1002/cite.330421408.

    Examples
    --------
    >>> round(float(zehner_schluender(1.0, 100.0, 0.6)), 6)
    8.886956
    """
    root = np.sqrt(fraction)
    k = k1 * (1.0 - root + root * _unit_cell(k1, k2, fraction, shape_factor))
    return with_pure_phases(k, k1, k2, fraction)


@elementwise
def zbs_contact(
    k1: Floats,
    k2: Floats,
    fraction: Floats,
    contact_fraction: Floats | float = 0.0077,
    shape_factor: Floats | float = 1.25,
) -> Floats:
    r"""Zehner, Bauer and Schluender's bed with particles that touch over an area.

    .. math:: k = (1 - \sqrt{f}) k_1 + \sqrt{f} \left[\varphi k_2 + (1 - \varphi) k_c\right]

    with the core conductivity k_c of `zehner_schluender`.

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of fluid and solid, positive.
    fraction : array_like [-]
        Solid fraction f.
    contact_fraction : array_like [-], optional
        Flattening coefficient phi: share of the core's section in solid contact; 0.0077 was found for
        ceramic spheres.
    shape_factor : array_like [-], optional
        C, as in `zehner_schluender`.

    Returns
    -------
    array_like [W/(m K)]

    Notes
    -----
    The stagnant, radiation-free, continuum-gas part of the full model.

    References
    ----------
    R. Bauer and E. U. Schluender, Int. Chem. Eng. 18, 189 (1978).

    Examples
    --------
    >>> round(float(zbs_contact(1.0, 100.0, 0.6)), 6)
    9.416701
    """
    root = np.sqrt(fraction)
    core = k1 * _unit_cell(k1, k2, fraction, shape_factor)
    k = k1 * (1.0 - root) + root * (contact_fraction * k2 + (1.0 - contact_fraction) * core)
    return with_pure_phases(k, k1, k2, fraction)


def fluid_film(k1: Floats, k2: Floats, contacts: float) -> Floats:
    """Kunii and Smith's film thickness per diameter, for sin^2 theta = 1/contacts."""
    s2 = 1.0 / contacts
    s = s2 / (1.0 + np.sqrt(1.0 - s2))  # 1 - cos theta
    u = k2 / k1 - 1.0
    closed = (np.log1p(u * s) - u * s / (1.0 + u)) / u**2
    series = np.zeros_like(u)
    for n in range(19, 1, -1):  # (s - s^n/n)(-u)^n / u^2, cancelling for nearly equal phases
        series = -series * u + (s - s**n / n)
    remainder = np.where(np.abs(u) < 0.1, series, closed)
    return 0.5 * s2 * (k1 / k2) ** 2 / remainder - 2.0 / 3.0 * k1 / k2


@elementwise
def kunii_smith(k1: Floats, k2: Floats, fraction: Floats, spacing: Floats | float = 1.0) -> Floats:
    r"""Packed bed or porous rock: fluid in the voids beside particles in series with fluid films.

    .. math:: \frac{k}{k_1} = \varepsilon + \frac{\beta (1 - \varepsilon)}{\varphi + 2/(3\lambda)}, \qquad
              \varphi = \varphi_2 + (\varphi_1 - \varphi_2) \frac{\varepsilon - 0.26}{0.216}

    .. math:: \varphi_i = \frac{1}{2} \frac{((\lambda - 1)/\lambda)^2 \sin^2\theta_i}
              {\ln[\lambda - (\lambda - 1)\cos\theta_i] - (1 - 1/\lambda)(1 - \cos\theta_i)}
              - \frac{2}{3 \lambda}

    with porosity :math:`\varepsilon = 1 - f`, :math:`\sin^2\theta_1 = 1/1.5` (loose) and
    :math:`\sin^2\theta_2 = 1/(4\sqrt{3})` (dense packing).

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of fluid and solid, positive and finite.
    fraction : array_like [-]
        Solid fraction f.
    spacing : array_like [-], optional
        beta: centre distance over diameter, 0.9 to 1.

    Returns
    -------
    array_like [W/(m K)]

    Notes
    -----
    Radiation is left out. Outside porosities 0.26 to 0.476, phi stays at its end value.

    References
    ----------
    D. Kunii and J. M. Smith, AIChE J. 6, 71 (1960), 10.1002/aic.690060115.

    Examples
    --------
    >>> round(float(kunii_smith(1.0, 100.0, 0.6)), 6)
    8.345371
    """
    porosity = 1.0 - fraction
    loose, dense = fluid_film(k1, k2, 1.5), fluid_film(k1, k2, 4.0 * np.sqrt(3.0))
    share = np.clip((porosity - DENSE) / (LOOSE - DENSE), 0.0, 1.0)
    film = dense + (loose - dense) * share
    return k1 * (porosity + spacing * fraction / (film + 2.0 / 3.0 * k1 / k2))


@elementwise
def yagi_kunii(
    k1: Floats,
    k2: Floats,
    fraction: Floats,
    film_thickness: Floats,
    *,
    spacing: Floats | float = 1.0,
    solid_length: Floats | float = 1.0,
) -> Floats:
    r"""Packed bed of particles in series with fluid films, without radiation.

    .. math:: \frac{k}{k_1} = \frac{\beta f}{\gamma k_1/k_2 + \varphi}

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of fluid and solid, positive.
    fraction : array_like [-]
        Solid fraction f.
    film_thickness : array_like [-]
        phi: effective film thickness over particle diameter (0.034 for spheres at a solid fraction of 0.6).
    spacing : array_like [-], optional
        beta: centre distance over diameter, 0.82 to 1.
    solid_length : array_like [-], optional
        gamma: conduction length in the solid over diameter; 1 for ordinary packings, 2/3 for spheres.

    Returns
    -------
    array_like [W/(m K)]

    Notes
    -----
    Plain conduction through the open voids is not in it (`kunii_smith` adds that), so it may fall below k1.

    References
    ----------
    S. Yagi and D. Kunii, AIChE J. 3, 373 (1957), equation 15, 10.1002/aic.690030317.

    Examples
    --------
    >>> round(float(yagi_kunii(1.0, 100.0, 0.6, 0.05)), 12)
    10.0
    """
    return k1 * spacing * fraction / (solid_length * k1 / k2 + film_thickness)


@elementwise
def krupiczka(k1: Floats, k2: Floats, fraction: Floats) -> Floats:
    r"""Granular bed: power law fitted to a two-dimensional model and to measurements.

    .. math:: \frac{k}{k_1} = \lambda^{\,0.280 - 0.757 \log_{10}(1 - f) - 0.057 \log_{10}\lambda}, \qquad
              \lambda = k_2/k_1

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of fluid and solid, positive and finite.
    fraction : array_like [-]
        Solid fraction f, below 1.

    Returns
    -------
    array_like [W/(m K)]

    References
    ----------
    R. Krupiczka, Int. Chem. Eng. 7, 122 (1967).

    Examples
    --------
    >>> round(float(krupiczka(1.0, 100.0, 0.6)), 6)
    8.599658
    """
    decades = np.log10(k2 / k1)
    return k1 * 10.0 ** (decades * (0.280 - 0.757 * np.log10(1.0 - fraction) - 0.057 * decades))


@elementwise
def woodside_messmer(k1: Floats, k2: Floats, fraction: Floats, fluid_in_series: Floats | float = 0.03) -> Floats:
    r"""Unconsolidated sand: fluid in parallel with solid and fluid in series (three resistors).

    .. math:: k = (\varepsilon - \delta) k_1
              + \frac{(1 - \varepsilon + \delta)^2}{(1 - \varepsilon)/k_2 + \delta/k_1}, \qquad
              \varepsilon = 1 - f

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of fluid and solid, positive.
    fraction : array_like [-]
        Solid fraction f, up to 1 - delta; NaN above.
    fluid_in_series : array_like [-], optional
        delta: fluid in series with the solid, as a fraction of the volume.

    Returns
    -------
    array_like [W/(m K)]

    References
    ----------
    W. Woodside and J. H. Messmer, J. Appl. Phys. 32, 1688 (1961), 10.1063/1.1728419.

    Examples
    --------
    >>> round(float(woodside_messmer(1.0, 100.0, 0.6)), 6)
    11.395
    """
    chain = fraction + fluid_in_series
    k = (1.0 - chain) * k1 + chain**2 / (fraction / k2 + fluid_in_series / k1)
    return np.where(chain <= 1.0, k, np.nan)


@elementwise
def hadley(k1: Floats, k2: Floats, fraction: Floats) -> Floats:
    r"""Packed metal powders: a blend of suspended particles and a consolidated skeleton.

    .. math:: \frac{k}{k_1} = (1 - \alpha)
              \frac{\varepsilon f_0 + \lambda (1 - \varepsilon f_0)}
                   {1 - \varepsilon (1 - f_0) + \lambda \varepsilon (1 - f_0)}
              + \alpha \frac{2 \lambda^2 (1 - \varepsilon) + (1 + 2 \varepsilon) \lambda}
                            {(2 + \varepsilon) \lambda + 1 - \varepsilon}

    with :math:`\varepsilon = 1 - f`, :math:`f_0 = 0.8 + 0.1 \varepsilon` and the consolidation
    :math:`\log_{10}\alpha = -4.898 \varepsilon`, then slopes -3.154 from 0.0827 and -6.778 from 0.298.

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of fluid and solid, positive and finite.
    fraction : array_like [-]
        Solid fraction f, from 0.42; NaN below.

    Returns
    -------
    array_like [W/(m K)]

    References
    ----------
    G. R. Hadley, Int. J. Heat Mass Transfer 29, 909 (1986), 10.1016/0017-9310(86)90186-9.

    Examples
    --------
    >>> round(float(hadley(1.0, 100.0, 0.6)), 6)
    9.793631
    """
    porosity, contrast = 1.0 - fraction, k2 / k1
    f0 = 0.8 + 0.1 * porosity
    log_alpha = np.where(porosity <= 0.0827, -4.898 * porosity, -0.405 - 3.154 * (porosity - 0.0827))
    log_alpha = np.where(porosity > 0.298, -1.084 - 6.778 * (porosity - 0.298), log_alpha)
    alpha = 10.0**log_alpha
    held = porosity * (1.0 - f0)
    suspended = (porosity * f0 + contrast * (1.0 - porosity * f0)) / (1.0 - held + contrast * held)
    skeleton = contrast * (2.0 * contrast * fraction + 1.0 + 2.0 * porosity)
    skeleton = skeleton / ((2.0 + porosity) * contrast + fraction)
    return np.where(fraction >= 0.42, k1 * ((1.0 - alpha) * suspended + alpha * skeleton), np.nan)


@elementwise
def batchelor_obrien(k1: Floats, k2: Floats) -> Floats:
    r"""Random bed of touching spheres of very high conductivity: heat crosses the fluid near contacts.

    .. math:: k/k_1 = 4 \ln(k_2/k_1) - 11

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of fluid and solid, positive and finite; NaN below k2/k1 = e^3, where the formula
        would fall below the fluid.

    Returns
    -------
    array_like [W/(m K)]

    Notes
    -----
    The constant was fitted for a solid fraction near 0.63 with point contacts; good from k2/k1 of about 1000.

    References
    ----------
    G. K. Batchelor and R. W. O'Brien, Proc. R. Soc. Lond. A 355, 313 (1977), 10.1098/rspa.1977.0100.

    Examples
    --------
    >>> round(float(batchelor_obrien(1.0, 1000.0)), 5)
    16.63102
    """
    k = 4.0 * np.log(k2 / k1) - 11.0
    return np.where(k >= 1.0, k1 * k, np.nan)
