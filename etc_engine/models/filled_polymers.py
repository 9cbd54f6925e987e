"""Semi-empirical formulas for filled polymers and porous ceramics: Lewis-Nielsen, Agari-Uno, Russell."""

from __future__ import annotations

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.models.broadcasting import elementwise
from etc_engine.models.phases import with_pure_phases

SHAPE_FACTOR = {2: 0.5, 3: 1.5}
"""Lewis-Nielsen A: parallel fibres across the flow, and spheres."""

MAXIMUM_FRACTION = {2: 0.82, 3: 0.637}
"""Random close packing of parallel fibres and of spheres."""


@elementwise
def lewis_nielsen(
    k1: Floats,
    k2: Floats,
    fraction: Floats,
    shape_factor: Floats | None = None,
    maximum_fraction: Floats | None = None,
    *,
    dimension: int,
) -> Floats:
    r"""Filled polymer with a shape factor and a maximum packing fraction.

    .. math:: \frac{k}{k_1} = \frac{1 + A B f}{1 - B \psi f}, \qquad
              B = \frac{k_2/k_1 - 1}{k_2/k_1 + A}, \qquad
              \psi = 1 + \frac{1 - \phi_m}{\phi_m^2} f

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of polymer and filler; k1 > 0, k2 may be 0 or inf.
    fraction : array_like [-]
        Volume fraction f of the filler, up to the maximum; NaN above.
    shape_factor : array_like [-], optional
        A; by default 0.5 (fibres across the flow) in 2D and 1.5 (spheres) in 3D.
    maximum_fraction : array_like [-], optional
        phi_m; by default random close packing, 0.82 in 2D and 0.637 in 3D.
    dimension : int
        2 or 3; chooses the defaults.

    Returns
    -------
    array_like [W/(m K)]

    Notes
    -----
    An estimate that is not realizable everywhere: with A = 1.5 it lies *below* the Hashin-Shtrikman lower
    bound at small f (Maxwell needs A = d - 1).

    References
    ----------
    T. B. Lewis and L. E. Nielsen, J. Appl. Polym. Sci. 14, 1449 (1970), 10.1002/app.1970.070140604.
    L. E. Nielsen, Ind. Eng. Chem. Fundam. 13, 17 (1974), 10.1021/i160049a004.

    Examples
    --------
    >>> round(float(lewis_nielsen(0.195, 1.5, 0.3, dimension=3)), 6)
    0.358084
    """
    a = np.float64(SHAPE_FACTOR[dimension]) if shape_factor is None else shape_factor
    limit = np.float64(MAXIMUM_FRACTION[dimension]) if maximum_fraction is None else maximum_fraction
    b = np.where(np.isinf(k2), 1.0, (k2 - k1) / (k2 + a * k1))
    psi = 1.0 + (1.0 - limit) / limit**2 * fraction
    k = k1 * (1.0 + a * b * fraction) / (1.0 - b * psi * fraction)
    return np.where(fraction <= limit, k, np.nan)


@elementwise
def agari_uno(
    k1: Floats,
    k2: Floats,
    fraction: Floats,
    matrix_factor: Floats | float = 1.0,
    chain_factor: Floats | float = 1.0,
) -> Floats:
    r"""Filled polymer whose filler forms conductive chains: a weighted geometric mean.

    .. math:: \log k = f C_2 \log k_2 + (1 - f) \log(C_1 k_1)

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of polymer and filler, both positive and finite.
    fraction : array_like [-]
        Volume fraction f of the filler.
    matrix_factor : array_like [-], optional
        C1, the effect of the filler on the polymer's crystallinity; near 1.
    chain_factor : array_like [-], optional
        C2, the ease of forming chains; usually in [0, 1].

    Returns
    -------
    array_like [W/(m K)]

    Notes
    -----
    With C2 different from 1 the formula depends on the unit of conductivity: it is meant in W/(m K). With
    C1 = C2 = 1 it is the geometric mean (Lichtenecker).

    References
    ----------
    Y. Agari and T. Uno, J. Appl. Polym. Sci. 32, 5705 (1986), 10.1002/app.1986.070320702.

    Examples
    --------
    >>> round(float(agari_uno(0.195, 1.5, 0.3)), 6)
    0.359626
    """
    return np.exp(fraction * chain_factor * np.log(k2) + (1.0 - fraction) * np.log(matrix_factor * k1))


@elementwise
def russell(k1: Floats, k2: Floats, fraction: Floats) -> Floats:
    r"""Cubes (phase 2) in a simple cubic arrangement, isothermal planes across the flow.

    .. math:: \frac{k}{k_1} = \frac{k_2 f^{2/3} + k_1 (1 - f^{2/3})}
                                   {k_2 (f^{2/3} - f) + k_1 (1 - f^{2/3} + f)}

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of matrix and cubes; k1 > 0, k2 may be 0 or inf.
    fraction : array_like [-]
        Volume fraction f of the cubes.

    Returns
    -------
    array_like [W/(m K)]

    Notes
    -----
    Written for pores (k2) in ceramics (k1). Isothermal planes make it an upper estimate of the array.

    References
    ----------
    H. W. Russell, J. Am. Ceram. Soc. 18, 1 (1935), 10.1111/j.1151-2916.1935.tb19340.x.

    Examples
    --------
    >>> round(float(russell(1.0, 0.0, 0.125)), 12)  # 1 - f**(2/3), over 1 - f**(2/3) + f
    0.857142857143
    """
    face = np.cbrt(fraction) ** 2
    k = k1 * (k2 * face + k1 * (1.0 - face)) / (k2 * (face - fraction) + k1 * (1.0 - face + fraction))
    k = np.where(np.isinf(k2), k1 * face / (face - fraction), k)
    return with_pure_phases(k, k1, k2, fraction)
