"""Mean, spread and confidence of a conductivity over realizations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Summary:
    """Statistics over realizations; every array has the shape of one sample.

    ``std`` has n - 1 in its denominator, ``sem`` is std / sqrt(n), ``ci_low`` and ``ci_high`` bound the mean.
    """

    count: int
    mean: NDArray[np.float64]
    std: NDArray[np.float64]
    sem: NDArray[np.float64]
    ci_low: NDArray[np.float64]
    ci_high: NDArray[np.float64]


def student_t(confidence: float, count: int) -> float:
    """Two-sided quantile of Student's t with count - 1 degrees of freedom.

    Examples
    --------
    >>> round(student_t(0.95, 5), 4)
    2.7764
    """
    from scipy.special import stdtrit  # scipy.stats takes half a second to import

    return float(stdtrit(count - 1, 0.5 * (1.0 + confidence)))


def half_width(samples: NDArray[np.float64], confidence: float) -> float:
    """Half-width of the confidence interval of the mean of at least two samples, shape (n,)."""
    return student_t(confidence, samples.size) * float(np.std(samples, ddof=1)) / float(np.sqrt(samples.size))


def summarize(samples: NDArray[np.float64], confidence: float) -> Summary:
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
