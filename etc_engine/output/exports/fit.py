"""Polynomial in temperature through a curve, of the lowest order that its intervals allow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.errors import InputError
from etc_engine.output.exports.curves import Curve

MAX_ORDER = 7
"""OpenFOAM's polynomials have eight coefficients."""

WITHOUT_INTERVAL = 1e-3
"""Relative residual asked of a fit where a curve has no interval (a single realization)."""


@dataclass(frozen=True)
class Fit:
    """Polynomial k(T) = c0 + c1 T + c2 T^2 + ..., T in kelvin.

    Parameters
    ----------
    coefficients : ndarray, shape (order + 1,) [W/(m K^(n+1))]
    residual : float [W/(m K)]
        Largest distance from the points.
    relative : float [-]
        Largest distance over the half-width of the interval (over the allowed residual where there is none).
    low, high : float [K]
        Temperatures of the first and the last point.
    """

    coefficients: Floats
    residual: float
    relative: float
    low: float
    high: float

    @property
    def order(self) -> int:
        """Order of the polynomial."""
        return int(self.coefficients.size) - 1

    @property
    def within(self) -> bool:
        """True if the polynomial passes through every interval."""
        return self.relative <= 1.0

    def at(self, temperature: Floats) -> Floats:
        """Value of the polynomial [W/(m K)]."""
        return np.asarray(np.polynomial.polynomial.polyval(temperature, self.coefficients), dtype=np.float64)

    @property
    def lines(self) -> list[str]:
        """Sentences for the comments of a file."""
        verdict = "within every interval" if self.within else "BEYOND an interval: use the points"
        return [
            f"Fit of order {self.order} from {self.low:g} to {self.high:g} K: largest residual {self.residual:.3g} "
            f"W/(m K), {self.relative:.2g} of the half-width, {verdict}.",
        ]


def fit_curve(curve: Curve) -> Fit:
    """Polynomial of the lowest order that passes through every interval of a curve.

    Weighted least squares, weights one over the half-width. The order stays two below the number of points, so
    that the fit cannot follow the noise, and at most `MAX_ORDER`; if none passes, the best one is returned.

    Raises
    ------
    InputError
        If the curve has no temperature.

    Examples
    --------
    >>> t = np.linspace(300.0, 900.0, 7)
    >>> curve = Curve(t, 1.0 + 1e-3 * t, np.full(7, 1e-6), np.full(7, 9), {})
    >>> fit = fit_curve(curve)
    >>> fit.order, fit.coefficients.round(9).tolist(), fit.within
    (1, [1.0, 0.001], True)
    """
    if curve.temperature.size == 0:
        raise InputError("a fit over temperature needs a result with a temperature")
    allowed = np.where(
        np.isfinite(curve.half_width) & (curve.half_width > 0.0),
        curve.half_width,
        WITHOUT_INTERVAL * np.abs(curve.conductivity),
    )
    allowed = np.maximum(allowed, 1e-12 * np.abs(curve.conductivity).max())
    n = curve.temperature.size
    best: Fit | None = None
    for order in range(max(1, min(MAX_ORDER, n - 2) + 1)):
        candidate = _of_order(curve, order, allowed)
        dense = candidate.at(np.linspace(candidate.low, candidate.high, 101))
        if (dense <= 0.0).any() and (curve.conductivity > 0.0).all():
            continue
        if best is None or candidate.relative < best.relative:
            best = candidate
        if candidate.within:
            return candidate
    assert best is not None  # order 0 of positive points is positive
    return best


def _of_order(curve: Curve, order: int, allowed: Floats) -> Fit:
    t = curve.temperature
    series = np.polynomial.Polynomial.fit(t, curve.conductivity, order, w=1.0 / allowed)
    coefficients = np.zeros(order + 1)
    converted = series.convert().coef
    coefficients[: converted.size] = converted
    distance = np.abs(np.polynomial.polynomial.polyval(t, coefficients) - curve.conductivity)
    return Fit(coefficients, float(distance.max()), float((distance / allowed).max()), float(t[0]), float(t[-1]))
