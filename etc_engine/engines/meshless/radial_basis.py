"""Radial basis functions phi and their particular solutions (laplacian - lambda^2) psi = phi."""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial

import numpy as np
from numpy.typing import NDArray
from scipy.special import digamma, k0, k1, kv

from etc_engine.arrays import Floats
from etc_engine.errors import InputError

Field = NDArray  # float64 for a real lambda, complex128 on the Laplace contour

#: Below this |lambda| x reach the growing (regular) particular solution is the better-scaled one.
SMALL_REACH = 2.0
#: Below this |lambda| r the power series is summed; beyond it logarithms and K_0 are combined.
SERIES_LIMIT = 1.0
SERIES_TERMS = 14
#: K_0(z) < 1e-17 for Re z beyond this.
NEGLIGIBLE = 38.0


@dataclass(frozen=True)
class PolyharmonicSpline:
    """Polyharmonic spline with its particular solution of the modified Helmholtz operator.

    phi = r^{2n} ln r, completed by the polynomials of total degree ``degree``, and

        psi = - sum_{k=0..n} lambda^{-2(k+1)} lap^k phi - 4^n (n!)^2 lambda^{-2(n+1)} K_0(lambda r),

    which is smooth up to r^{2n+2} ln r: the factor of K_0 cancels the logarithm of lap^n phi.

    Parameters
    ----------
    order : int
        n, from 1 (thin-plate spline) to 5; orders beyond 3 lose their accuracy to rounding on fine nodes.
    degree : int, optional
        Degree of the polynomials; n by default (as conditional positive definiteness asks), -1 for none.

    Raises
    ------
    InputError
        If the order is not 1 to 5 or the degree is not -1 to 6.

    Notes
    -----
    For small lambda x reach, multiples of I_0(lambda r) - solutions of the homogeneous equation - are left
    out of psi, because they would drown the part that matters; the choice depends on ``reach`` only, so
    that one psi serves all distances of a problem.

    References
    ----------
    Chen and Rashed (1998), Mech. Res. Commun. 25, 195, for n = 1 (Cao, Qin and Zhao 2010, Eq. 23);
    Muleshkov, Golberg and Chen (1999), Comput. Mech. 23, 411, for higher orders.

    Examples
    --------
    >>> r = np.array([0.0, 0.5])
    >>> PolyharmonicSpline(1).particular(r, 3.0, reach=1.0).round(6)
    array([-0.000855, -0.006457])
    """

    order: int = 2
    degree: int | None = None

    def __post_init__(self) -> None:
        if self.order not in (1, 2, 3, 4, 5):
            raise InputError(f"a polyharmonic spline of order 1 to 5 is expected, found {self.order}")
        degree = self.order if self.degree is None else self.degree
        if not -1 <= degree <= 6:
            raise InputError(f"the polynomial degree must lie between -1 (none) and 6, found {degree}")
        object.__setattr__(self, "degree", degree)

    @property
    def polynomial_degree(self) -> int:
        """Degree of the polynomials added to the spline, -1 for none."""
        return self.order if self.degree is None else self.degree

    @property
    def depends_on_lambda(self) -> bool:
        """False: one factorisation of the interpolation matrix serves every time step."""
        return False

    def value(self, r: Floats, lam: complex = 0.0) -> Field:  # noqa: ARG002
        """Values phi = r^{2n} ln r."""
        return _logarithmic(r, self.order, 1.0, 0.0)

    def slope_over_r(self, r: Floats, lam: complex = 0.0) -> Field:  # noqa: ARG002
        """phi'(r)/r, so that grad phi = (x - x_i) phi'/r; regular at r = 0 for n >= 2, 0 there for n = 1."""
        return _logarithmic_slope(r, self.order, 1.0, 0.0)

    def particular(self, r: Floats, lam: complex, reach: float) -> Field:
        """Values psi at distances r, for |x - x_i| up to ``reach``."""
        return _combine(self, r, lam, reach, slope=False)

    def particular_slope_over_r(self, r: Floats, lam: complex, reach: float) -> Field:
        """psi'(r)/r, so that grad psi = (x - x_i) psi'/r."""
        return _combine(self, r, lam, reach, slope=True)


@dataclass(frozen=True)
class ReverseBasis:
    """The reverse choice psi = r^2/4 + r^3/9, hence phi = 1 + r - lambda^2 psi; for reproduction only.

    Simple, but its accuracy stalls near 1e-3 and phi depends on the time step.

    References
    ----------
    Cao, Qin and Zhao (2010), Recent Patents on Space Technology 2, 41, Eqs. 24-25.

    Examples
    --------
    >>> ReverseBasis().value(np.array([1.0]), 2.0).round(6)
    array([0.555556])
    """

    @property
    def polynomial_degree(self) -> int:
        """No polynomials are added."""
        return -1

    @property
    def depends_on_lambda(self) -> bool:
        """True: phi holds lambda."""
        return True

    def value(self, r: Floats, lam: complex = 0.0) -> Field:
        """Values phi = 1 + r - lambda^2 (r^2/4 + r^3/9)."""
        return 1.0 + r - lam**2 * self.particular(r, lam, 0.0)

    def slope_over_r(self, r: Floats, lam: complex = 0.0) -> Field:
        """phi'(r)/r; the cusp 1/r at r = 0 is answered by 0."""
        cusp = np.divide(1.0, r, out=np.zeros_like(r), where=r > 0.0)
        return cusp - lam**2 * self.particular_slope_over_r(r, lam, 0.0)

    def particular(self, r: Floats, lam: complex, reach: float) -> Field:  # noqa: ARG002
        """Values psi = r^2/4 + r^3/9."""
        return r * r * (0.25 + r / 9.0)

    def particular_slope_over_r(self, r: Floats, lam: complex, reach: float) -> Field:  # noqa: ARG002
        """psi'/r = 1/2 + r/3."""
        return 0.5 + r / 3.0


RadialBasis = PolyharmonicSpline | ReverseBasis


def _logarithmic(r: Floats, power: int, a: float, b: float) -> Floats:
    """r^{2 power} (a ln r + b); at r = 0 its limit, or b where the logarithm diverges."""
    logarithm = np.log(r, out=np.zeros_like(r), where=r > 0.0)
    return np.asarray((r * r) ** power * (a * logarithm + b))


def _logarithmic_slope(r: Floats, power: int, a: float, b: float) -> Floats:
    """(1/r) d/dr of r^{2 power} (a ln r + b), for r > 0 (0 at r = 0 where it diverges)."""
    logarithm = np.log(r, out=np.zeros_like(r), where=r > 0.0)
    inner = 2.0 * power * (a * logarithm + b) + a
    if power == 0:
        return np.divide(inner, r * r, out=np.zeros_like(r), where=r > 0.0)
    return np.asarray(np.where(r > 0.0, (r * r) ** (power - 1) * inner, 0.0))


def _iterated_laplacians(order: int) -> list[tuple[float, float]]:
    """(a_k, b_k) of lap^k phi = r^{2(n-k)} (a_k ln r + b_k) for k = 0 .. n."""
    a, b, pairs = 1.0, 0.0, [(1.0, 0.0)]
    for m in range(order, 0, -1):
        a, b = 4.0 * m * m * a, 4.0 * m * a + 4.0 * m * m * b
        pairs.append((a, b))
    return pairs


def _combine(spline: PolyharmonicSpline, r: Floats, lam: complex, reach: float, slope: bool) -> Field:
    """Values psi, or psi'/r: the power series where lambda r is small, the closed form elsewhere."""
    series = _series_slope if slope else _series
    n = spline.order
    if abs(lam) * reach <= SMALL_REACH:
        return series(r, lam, n, 0.0)
    # value at r = 0 of the decaying psi: -b_n/lambda^{2n+2} + c [-ln(lambda/2) - gamma]
    a_n, b_n = _iterated_laplacians(n)[-1]
    at_zero = (a_n * (np.log(lam / 2.0) - digamma(1.0)) - b_n) / lam ** (2 * n + 2)
    result = np.empty(r.shape, dtype=complex if isinstance(lam, complex) else float)
    near = np.abs(lam) * r < SERIES_LIMIT
    result[near] = series(r[near], lam, n, at_zero)
    result[~near] = (_closed_form_slope if slope else _closed_form)(r[~near], lam, n)
    return result


def _bessel(order: int, z: Field) -> Field:
    """K_0 or K_1, set to 0 where it is below 1e-17 (the complex routine is slow)."""
    if not np.iscomplexobj(z):
        return np.asarray(k0(z) if order == 0 else k1(z))
    result = np.zeros_like(z)
    counts = z.real < NEGLIGIBLE
    result[counts] = kv(order, z[counts])
    return np.asarray(result)


def _closed_form(r: Floats, lam: complex, n: int) -> Field:
    bessel = _bessel(0, lam * r)
    psi = -(4.0**n) * factorial(n) ** 2 / lam ** (2 * n + 2) * bessel
    log_r, square = np.log(r), r * r
    for k, (a, b) in enumerate(_iterated_laplacians(n)):
        psi -= square ** (n - k) * (a * log_r + b) / lam ** (2 * k + 2)
    return psi


def _closed_form_slope(r: Floats, lam: complex, n: int) -> Field:
    bessel = _bessel(1, lam * r)
    psi = 4.0**n * factorial(n) ** 2 / lam ** (2 * n + 1) * bessel / r
    for k, (a, b) in enumerate(_iterated_laplacians(n)):
        psi -= _logarithmic_slope(r, n - k, a, b) / lam ** (2 * k + 2)
    return psi


def _series_coefficients(lam: complex, n: int, at_zero: complex) -> list[tuple[int, complex, complex]]:
    """(m, A_m, B_m) of psi = sum_m r^{2m} (A_m ln r + B_m), from (lap - lambda^2) psi = r^{2n} ln r."""
    a: complex = 0.0
    b = at_zero
    terms: list[tuple[int, complex, complex]] = [(0, a, b)]
    for m in range(1, n + SERIES_TERMS):
        a = (lam**2 * a + (1.0 if m == n + 1 else 0.0)) / (4.0 * m * m)
        b = lam**2 * b / (4.0 * m * m) - a / m
        terms.append((m, a, b))
    return terms


def _series(r: Floats, lam: complex, n: int, at_zero: complex) -> Field:
    logarithm = np.log(r, out=np.zeros_like(r), where=r > 0.0)
    square = r * r
    psi = np.zeros(r.shape, dtype=complex if isinstance(lam, complex) else float)
    for m, a, b in _series_coefficients(lam, n, at_zero)[::-1]:  # Horner: psi is a polynomial in r^2
        psi = psi * square + (a * logarithm + b) if m else psi * square + b
    return psi


def _series_slope(r: Floats, lam: complex, n: int, at_zero: complex) -> Field:
    logarithm = np.log(r, out=np.zeros_like(r), where=r > 0.0)
    square = r * r
    slope = np.zeros(r.shape, dtype=complex if isinstance(lam, complex) else float)
    for m, a, b in _series_coefficients(lam, n, at_zero)[:0:-1]:
        slope = slope * square + (2.0 * m * (a * logarithm + b) + a)
    return slope
