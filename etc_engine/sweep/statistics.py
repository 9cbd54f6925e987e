"""Mean, spread and confidence of a conductivity over realizations.

A realization that does not percolate has the conductivity 0 and counts. A Student interval over a few zeros says
little, so that the mean is taken apart into the fraction that percolates and the mean of those that do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from etc_engine.arrays import Floats
from etc_engine.errors import InputError


@dataclass(frozen=True)
class Summary:
    """Statistics over realizations; every array has the shape of one sample.

    ``std`` has n - 1 in its denominator, ``sem`` is std / sqrt(n), ``ci_low`` and ``ci_high`` bound the mean.
    """

    count: int
    mean: Floats
    std: Floats
    sem: Floats
    ci_low: Floats
    ci_high: Floats


def student_t(confidence: float, count: int) -> float:
    """Two-sided quantile of Student's t with count - 1 degrees of freedom.

    Examples
    --------
    >>> round(student_t(0.95, 5), 4)
    2.7764
    """
    from scipy.special import stdtrit  # scipy.stats takes half a second to import

    return float(stdtrit(count - 1, 0.5 * (1.0 + confidence)))


def half_width(samples: Floats, confidence: float) -> float:
    """Half-width of the confidence interval of the mean of at least two samples, shape (n,)."""
    return student_t(confidence, samples.size) * float(np.std(samples, ddof=1)) / float(np.sqrt(samples.size))


def summarize(samples: Floats, confidence: float) -> Summary:
    r"""Mean, spread and Student-t interval over the first axis.

    .. math:: \bar k \pm t_{n-1,(1+c)/2}\, s/\sqrt{n}

    Parameters
    ----------
    samples : ndarray, shape (n, ...)
        Valid realizations, in their order (the order decides the last bit of a sum).
    confidence : float
        Level c of the interval.

    Returns
    -------
    Summary
        NaN where there is nothing to say: the mean of none, the spread of one. A component that one
        realization leaves undefined (NaN) is undefined here.

    Notes
    -----
    The interval assumes independent, normally distributed samples: the first holds by construction (each
    realization has its own random stream), the second approximately for large packings.

    References
    ----------
    Student (1908), The probable error of a mean, Biometrika 6, 1-25, doi:10.1093/biomet/6.1.1.

    Examples
    --------
    >>> summary = summarize(np.array([1.0, 2.0, 3.0]), 0.95)
    >>> float(summary.mean), float(summary.std), round(float(summary.ci_high), 3)
    (2.0, 1.0, 4.484)
    """
    samples = np.asarray(samples, dtype=np.float64)
    n = samples.shape[0]
    undefined = np.full(samples.shape[1:], np.nan)
    if n == 0:
        return Summary(0, *(undefined.copy() for _ in range(5)))
    mean = samples.mean(axis=0)
    if n == 1:
        return Summary(1, mean, *(undefined.copy() for _ in range(4)))
    std = samples.std(axis=0, ddof=1)
    sem = std / np.sqrt(n)
    width = student_t(confidence, n) * sem
    return Summary(n, mean, std, sem, mean - width, mean + width)


@dataclass(frozen=True, repr=False)
class Interval:
    """Mean over realizations with its confidence interval, and the two parts it is made of.

    NaN marks what the samples do not determine: every mean of none, and bounds of a mean of one.

    Parameters
    ----------
    mean, low, high : float
        Mean of all samples, zeros included, and its interval.
    percolating_fraction, fraction_low, fraction_high : float
        Fraction of the samples that is not zero, and its interval.
    percolating_mean, percolating_low, percolating_high : float
        Mean of the samples that are not zero, and its interval.
    """

    mean: float
    low: float
    high: float
    percolating_fraction: float
    fraction_low: float
    fraction_high: float
    percolating_mean: float
    percolating_low: float
    percolating_high: float

    def __repr__(self) -> str:
        """The mean with its bounds, and the fraction that percolates where it is not 1."""
        part = "" if self.percolating_fraction == 1.0 else f", percolating {self.percolating_fraction:.4g}"
        return f"Interval({self.mean:.6g} [{self.low:.6g}, {self.high:.6g}]{part})"

    @property
    def half_width(self) -> float:
        """Half of the distance between the bounds of the mean."""
        return 0.5 * (self.high - self.low)


def interval(samples: ArrayLike, confidence: float = 0.95) -> Interval:
    r"""Confidence interval of the mean conductivity when some realizations may not percolate.

    With f the percolating fraction and m the mean of the percolating samples, the mean is f m. Its bounds combine the
    distances from f and m to their own bounds,

    .. math:: L = f m - \sqrt{m^2 (f - f_L)^2 + f^2 (m - m_L)^2}, \qquad
              U = f m + \sqrt{m^2 (f_U - f)^2 + f^2 (m_U - m)^2}.

    Parameters
    ----------
    samples : array_like, shape (n,) [W/(m K)]
        Conductivities along an axis; 0 means that nothing percolates.
    confidence : float
        Level of all three intervals, between 0 and 1.

    Returns
    -------
    Interval
        Without a zero among the samples the interval of the mean is Student's and holds only if all realizations
        percolate: ``fraction_low`` says how far that is known.

    Raises
    ------
    InputError
        If a sample is negative or not finite, or the level is out of range.

    Notes
    -----
    The fraction has a Wilson interval with continuity correction (without it the coverage falls to 92 % at n = 20 and
    f = 0.95), the percolating mean a Student interval. The bounds of the product keep the skewness of the fraction's.
    In simulations (normal samples with a spread of 10 %, f from 0.5 to 0.95, n >= 20, level 95 %) the mean is covered
    in at least 95 % of the runs that saw a zero.

    References
    ----------
    Newcombe 1998, Two-sided confidence intervals for the single proportion, method 4,
    doi:10.1002/(SICI)1097-0258(19980430)17:8<857::AID-SIM777>3.0.CO;2-E.
    Zou, Donner 2008, Construction of confidence limits about effect measures: a general approach,
    doi:10.1002/sim.3095.

    Examples
    --------
    >>> found = interval([0.0, 1.1, 0.9, 1.0, 1.05], 0.95)
    >>> round(found.mean, 3), found.percolating_fraction, round(found.percolating_mean, 4)
    (0.81, 0.8, 1.0125)
    >>> round(found.low, 3), round(found.high, 3)
    (0.291, 1.03)
    """
    values = np.asarray(samples, dtype=np.float64)
    if values.ndim != 1 or not (np.isfinite(values) & (values >= 0.0)).all():
        raise InputError(
            f"samples of a conductivity must be finite numbers >= 0 in one row, found shape {values.shape}"
            + ("" if values.ndim != 1 else f" with {values[~(values >= 0.0) | ~np.isfinite(values)][0]:g}")
        )
    if not 0.0 < confidence < 1.0:
        raise InputError(f"the confidence level must lie between 0 and 1, found {confidence:g}")
    n = values.size
    percolating = values[values > 0.0]
    inner = _student(percolating, confidence)
    if n == 0:
        return Interval(*(np.nan,) * 9)
    fraction = percolating.size / n
    f_low, f_high = wilson(percolating.size, n, confidence)
    if percolating.size == 0:
        return Interval(0.0, 0.0, np.nan, fraction, f_low, f_high, *inner)
    if percolating.size == n:
        return Interval(*inner, fraction, f_low, f_high, *inner)
    m, m_low, m_high = inner
    mean = float(np.mean(values))
    low = mean - float(np.hypot(m * (fraction - f_low), fraction * (m - m_low)))
    high = mean + float(np.hypot(m * (f_high - fraction), fraction * (m_high - m)))
    return Interval(mean, max(low, 0.0) if np.isfinite(low) else 0.0, high, fraction, f_low, f_high, *inner)


def wilson(successes: int, trials: int, confidence: float) -> tuple[float, float]:
    """Wilson interval of a proportion with continuity correction.

    Parameters
    ----------
    successes, trials : int
    confidence : float

    Returns
    -------
    low, high : float

    References
    ----------
    Newcombe 1998, method 4, as in `interval`; its Table I has 81 of 263, 95 %: 0.2535 to 0.3682.

    Examples
    --------
    >>> tuple(round(bound, 4) for bound in wilson(81, 263, 0.95))
    (0.2535, 0.3682)
    """
    from scipy.special import ndtri  # scipy.stats takes half a second to import

    z, n, p = float(ndtri(0.5 * (1.0 + confidence))), trials, successes / trials
    middle, scale = 2.0 * n * p + z * z, 2.0 * (n + z * z)
    below = z * z - 2.0 - 1.0 / n + 4.0 * p * (n * (1.0 - p) + 1.0)
    above = z * z + 2.0 - 1.0 / n + 4.0 * p * (n * (1.0 - p) - 1.0)
    low = 0.0 if successes == 0 else (middle - 1.0 - z * np.sqrt(max(below, 0.0))) / scale
    high = 1.0 if successes == trials else (middle + 1.0 + z * np.sqrt(max(above, 0.0))) / scale
    return float(max(low, 0.0)), float(min(high, 1.0))


def _student(values: Floats, confidence: float) -> tuple[float, float, float]:
    """Mean and Student-t bounds; NaN where there are too few values."""
    if values.size == 0:
        return np.nan, np.nan, np.nan
    mean = float(np.mean(values))
    if values.size == 1:
        return mean, np.nan, np.nan
    width = half_width(values, confidence)
    return mean, mean - width, mean + width
