"""Trefftz functions of the modified Helmholtz equation: its regular solutions about one centre."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln, ive

from etc_engine.arrays import Floats
from etc_engine.errors import ConvergenceError

Field = NDArray

#: ln |I_n(lambda)| below which the ratio I_n(lambda r)/I_n(lambda) is taken from its power series.
UNDERFLOW = -300.0
SERIES_TERMS = 60
#: Largest |lambda|: the body is that many diffusion lengths of a step wide, far beyond what nodes resolve.
STEEPEST = 1e6


def trefftz_functions(points: Floats, lam: complex, count: int) -> tuple[Field, Field, Field]:
    """Scaled Trefftz functions R_n(r) cos(n phi), R_n(r) sin(n phi) and their gradients.

    R_n(r) = I_n(lambda r) / I_n(lambda): each function is at most about one on the unit disk, whatever
    the order and lambda, where I_n itself would run over hundreds of decades.

    Parameters
    ----------
    points : ndarray, shape (k, 2)
        Positions relative to the centre, in units of the domain radius (so that |x| <= 1 inside).
    lam : float or complex
        lambda of (laplacian - lambda^2) u = 0 in the same units, Re lambda > 0.
    count : int
        Number m of functions, in the order cos 0, cos 1, sin 1, cos 2, sin 2, ...; for even m the last
        sine is left out.

    Returns
    -------
    tuple of ndarray, shape (k, m)
        Values, derivatives along x and along y.

    References
    ----------
    Cao, Qin and Zhao (2010), Recent Patents on Space Technology 2, 41, Eq. 29.

    Examples
    --------
    >>> value, along_x, _ = trefftz_functions(np.array([[1.0, 0.0]]), 2.0, 3)
    >>> value.round(12), along_x.round(6)
    (array([[1., 1., 0.]]), array([[1.395549, 1.866255, 0.      ]]))
    """
    highest = count // 2
    r, phi = np.hypot(*points.T), np.arctan2(points[:, 1], points[:, 0])
    radial = scaled_bessel(highest + 1, lam, r)
    step = _order_ratios(highest + 1, lam)  # I_{n+1}(lambda) / I_n(lambda)
    n = np.arange(highest + 2)
    cosine, sine = np.cos(np.outer(phi, n)), np.sin(np.outer(phi, n))
    c, s = radial * cosine, radial * sine
    # with E_n = I_n e^{i n phi}, 2 dE_n/dx = lambda (E_{n-1} + E_{n+1}) and
    # 2 i dE_n/dy = lambda (E_{n+1} - E_{n-1})
    up = 0.5 * lam * step[: highest + 1]
    down = np.concatenate([up[:1], 0.5 * lam / step[:highest]])
    below_c = np.column_stack([c[:, 1], c[:, :highest]])  # I_{-1} e^{-i phi}
    below_s = np.column_stack([-s[:, 1], s[:, :highest]])
    above_c, above_s = c[:, 1:], s[:, 1:]
    tables = (
        (c[:, :-1], s[:, :-1]),
        (down * below_c + up * above_c, down * below_s + up * above_s),
        (up * above_s - down * below_s, down * below_c - up * above_c),
    )
    value, along_x, along_y = (_interleave(cos_part, sin_part, count) for cos_part, sin_part in tables)
    return value, along_x, along_y


def scaled_bessel(highest: int, lam: complex, r: Floats) -> Field:
    """I_n(lambda r)/I_n(lambda) for n = 0 .. highest, shape (k, highest + 1), free of over- and underflow."""
    n = np.arange(highest + 1)
    direct = n * np.log(abs(lam) / 2.0) - gammaln(n + 1.0) - abs(np.real(lam)) > UNDERFLOW
    result = np.empty((len(r), highest + 1), dtype=complex if isinstance(lam, complex) else float)
    decay = np.exp(np.real(lam) * (r - 1.0))
    result[:, direct] = ive(n[direct], lam * r[:, None]) / ive(n[direct], lam) * decay[:, None]
    for order in n[~direct]:
        result[:, order] = r**order * _hypergeometric(order, lam**2 * r**2 / 4.0)
        result[:, order] /= _hypergeometric(order, np.array([lam**2 / 4.0]))
    return result


def _hypergeometric(order: int, z: Field) -> Field:
    """0F1(; order + 1; z), so that I_n(w) = (w/2)^n / n! 0F1(; n + 1; w^2/4); for order >> |z|^(1/2)."""
    total = term = np.ones_like(z)
    for k in range(1, SERIES_TERMS):
        term = term * z / (k * (order + k))
        total = total + term
    return total


def _order_ratios(highest: int, lam: complex) -> Field:
    """I_{n+1}(lambda)/I_n(lambda) for n = 0 .. highest - 1, by the stable backward recurrence."""
    if not abs(lam) <= STEEPEST:
        raise ConvergenceError(
            f"heat moves {1.0 / abs(lam):.1e} of the body's radius in a step, too short to resolve (least "
            f"{1.0 / STEEPEST:.0e}): check conductivity, heat capacity and times"
        )
    extra = highest + 20 + int(2.0 * abs(lam))
    ratio: complex = 0.0
    ratios = np.empty(extra, dtype=complex if isinstance(lam, complex) else float)
    for n in range(extra - 1, -1, -1):
        ratio = lam / (2.0 * (n + 1) + lam * ratio)
        ratios[n] = ratio
    return ratios[:highest]


def _interleave(cosine: Field, sine: Field, count: int) -> Field:
    columns = np.empty((len(cosine), 2 * cosine.shape[1]), dtype=cosine.dtype)
    columns[:, 0::2], columns[:, 1::2] = cosine, sine
    return np.delete(columns, 1, axis=1)[:, :count]
