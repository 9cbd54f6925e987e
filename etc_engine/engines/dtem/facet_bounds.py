r"""Rigorous bounds of two phases: they keep facet links right where spheres and fluid are nearly alike.

.. math:: \mu = \frac{1}{f/\kappa + (1 - f)/k_f} \le k_i \le m = f \kappa + (1 - f) k_f, \qquad
          \sum_{i=1}^{3} \frac{1}{k_i - k_f} \le \frac{1}{\mu - k_f} + \frac{2}{m - k_f}

for the principal values k_i of the conductivity of any two phases with kappa > k_f, isotropic or not (Wiener; Lurie and
Cherkaev, Murat and Tartar; of an isotropic body the last is the lower bound of Hashin and Shtrikman). With
:math:`\kappa - k_f \to 0` all of them become :math:`k_f + f (\kappa - k_f)`, the exact limit, and the last is exact to
the second order of the difference where the body is isotropic.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

from etc_engine.arrays import Floats
from etc_engine.medium.conductivity import EffectiveConductivity
from etc_engine.medium.medium import Medium
from etc_engine.models.bounds import parallel, series


def held_between_bounds(result: EffectiveConductivity[Any], medium: Medium) -> EffectiveConductivity[Any]:
    """A conductivity moved onto the bounds that it passes.

    Parameters
    ----------
    result : EffectiveConductivity
        Of spheres in a fluid that conducts less.
    medium : Medium

    Returns
    -------
    EffectiveConductivity
        Where a component along an axis is not known, the first two bounds alone are used.

    Notes
    -----
    No bound holds with temperature jumps, radiation or contact resistances. Necks of prescribed contacts are solid
    that the solid fraction does not count: with them the lower bound holds alone.

    References
    ----------
    O. Wiener, Abh. Sächs. Ges. Wiss. 32, 507 (1912). K. A. Lurie and A. V. Cherkaev, Proc. R. Soc. Edinburgh A 99, 71
    (1984). F. Murat and L. Tartar, in Les méthodes de l'homogénéisation (1985), 319.
    """
    network, pores = medium.network, medium.pores.conductivity
    if not medium.pores.plain:
        return result
    if network is not None and (network.resistances.any() or network.wall_resistances.any()):
        return result
    spheres, fraction = medium.conductivity, medium.solid_fraction
    low, mean = (float(bound(pores, float(spheres.min()), fraction)) for bound in (series, parallel))
    high = float(parallel(pores, float(spheres.max()), fraction))
    if network is not None and not network.geometric and network.count + network.walls.size:
        high = np.inf
    tensor = result.tensor
    if not np.isfinite(np.diag(tensor)).all():
        held = tensor.copy()
        np.fill_diagonal(held, np.clip(np.diag(tensor), low, high))
        return replace(result, tensor=held)
    # between walls: of the cell and its mirror images, the components off the diagonal vanish
    principal, axes = np.linalg.eigh(np.nan_to_num(tensor))
    clipped = np.clip(principal, low, high)
    if mean > pores:
        clipped += _lift(clipped - pores, low - pores, mean - pores)
    if (clipped == principal).all():
        return result
    return replace(result, tensor=np.where(np.isnan(tensor), np.nan, (axes * clipped) @ axes.T))


def _lift(excess: Floats, low: float, mean: float) -> float:
    """What all principal values need more to meet the bound on the sum of their inverses, all less the fluid's."""
    most = 1.0 / low + (excess.size - 1) / mean

    def over(lift: float) -> float:
        return float((1.0 / (excess + lift)).sum()) - most

    if over(0.0) <= 0.0:
        return 0.0
    return float(brentq(over, 0.0, mean, xtol=1e-15 * mean, rtol=1e-14))
