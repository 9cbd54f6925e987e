r"""Rigorous bounds of two phases: they keep facet links right where spheres and fluid are nearly alike.

.. math:: \mu = \frac{1}{f/\kappa + (1 - f)/k_f} \le k_i \le m = f \kappa + (1 - f) k_f, \qquad
          \sum_{i=1}^{3} \frac{1}{k_i - k_f} \le \frac{1}{\mu - k_f} + \frac{2}{m - k_f}

for the principal values k_i of the conductivity of any two phases with kappa > k_f, isotropic or not (Wiener; Lurie and
Cherkaev, Murat and Tartar; of an isotropic body the last is the lower bound of Hashin and Shtrikman). With
:math:`\kappa - k_f \to 0` all of them become :math:`k_f + f (\kappa - k_f)`, the exact limit, and the last is exact to
the second order of the difference where the body is isotropic.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

from etc_engine.arrays import Floats
from etc_engine.medium.conductivity import EffectiveConductivity
from etc_engine.medium.medium import Medium
from etc_engine.models.bounds import parallel, series

NEAR = 1.1
"""Below this many times the isotropic lower bound the components along all axes are needed to hold one of them."""


@dataclass(frozen=True)
class _Bounds:
    """Wiener bounds of the principal values, the arithmetic mean, and the fluid [W/(m K)]."""

    fluid: float
    low: float
    mean: float
    high: float

    @property
    def inverse_sum(self) -> float:
        """Upper bound of the sum of 1/(k_i - k_f) [m K/W]."""
        return 1.0 / (self.low - self.fluid) + 2.0 / (self.mean - self.fluid)


def needs_all_axes(result: EffectiveConductivity[Any], medium: Medium) -> bool:
    """Whether the components along the other axes are needed to hold those that were asked for between the bounds.

    Otherwise the conductivity along an axis would depend on which others are asked for.
    """
    bounds, along = _bounds(medium), np.diag(result.tensor)
    if bounds is None or np.isfinite(along).all() or bounds.mean <= bounds.fluid:
        return False
    return bool(np.nanmin(along) < NEAR * (bounds.fluid + 3.0 / bounds.inverse_sum))


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
    that the solid fraction does not count: with them the lower bounds hold alone.

    References
    ----------
    O. Wiener, Abh. Sächs. Ges. Wiss. 32, 507 (1912). K. A. Lurie and A. V. Cherkaev, Proc. R. Soc. Edinburgh A 99, 71
    (1984). F. Murat and L. Tartar, in Les méthodes de l'homogénéisation (1985), 319.
    """
    bounds, tensor = _bounds(medium), result.tensor
    if bounds is None:
        return result
    if not np.isfinite(np.diag(tensor)).all():
        held = tensor.copy()
        np.fill_diagonal(held, np.clip(np.diag(tensor), bounds.low, bounds.high))
        return replace(result, tensor=held)
    # between walls: of the cell and its mirror images, the components off the diagonal vanish
    principal, axes = np.linalg.eigh(np.nan_to_num(tensor))
    clipped = np.clip(principal, bounds.low, bounds.high)
    if bounds.mean > bounds.fluid:
        clipped += _lift(clipped, bounds)
    if (clipped == principal).all():
        return result
    return replace(result, tensor=np.where(np.isnan(tensor), np.nan, (axes * clipped) @ axes.T))


def _bounds(medium: Medium) -> _Bounds | None:
    """The bounds of a medium; None where none hold."""
    network, fluid = medium.network, medium.pores.conductivity
    resists = network is not None and (network.resistances.any() or network.wall_resistances.any())
    if not medium.pores.plain or resists:
        return None
    spheres, fraction = medium.conductivity, medium.solid_fraction
    low, mean = (float(bound(fluid, float(spheres.min()), fraction)) for bound in (series, parallel))
    necks = network is not None and not network.geometric and network.count + network.walls.size > 0
    return _Bounds(fluid, low, mean, np.inf if necks else float(parallel(fluid, float(spheres.max()), fraction)))


def _lift(principal: Floats, bounds: _Bounds) -> float:
    """What all principal values need more to meet the bound on the sum of their inverses [W/(m K)]."""

    def over(lift: float) -> float:
        return float((1.0 / (principal + lift - bounds.fluid)).sum()) - bounds.inverse_sum

    if over(0.0) <= 0.0:
        return 0.0
    most = bounds.mean - bounds.fluid
    return float(brentq(over, 0.0, most, xtol=1e-15 * most, rtol=1e-14))
