"""Size distributions of particles, written as words such as ``uniform:0.01:0.02``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.box import ball_measure
from etc_engine.errors import InputError

GAUSSIAN_CUT = 3.0
"""A Gaussian distribution is truncated at this many standard deviations on either side of its mean."""

SHORTEST, LONGEST = 1e-15, 1e15
"""Radii that are no mistake in a unit, and whose areas and volumes are exact doubles [m]."""
WIDEST_RANGE = 1e6
"""Largest ratio of two radii of one distribution."""


@dataclass(frozen=True)
class RadiusDistribution:
    r"""A distribution of particle radii.

    Parameters
    ----------
    kind : str
        ``equal``, ``uniform``, ``gaussian``, ``lognormal``, ``bidisperse`` or ``list``.
    parameters : tuple of float
        The numbers behind the word, radii in metres:

        ============  =======================  ==============================================================
        kind          parameters               meaning
        ============  =======================  ==============================================================
        equal         r (or none)              one radius; without a number a radius of 1, to be scaled
        uniform       a, b                     uniform on [a, b], 0 < a <= b
        gaussian      mean, sd                 normal, cut at mean - 3 sd and mean + 3 sd, which must be
                                               positive; the variance after the cut is 0.97334 sd^2
        lognormal     mean, sd                 mean and standard deviation of the radius itself
        bidisperse    a, b, fraction           radius b with probability `fraction` (by number), else a
        list          r1, r2, ...              drawn from the given radii, each as likely as the others
        ============  =======================  ==============================================================
    scalable : bool
        True where the parameters give only the shape (``equal`` without a radius).

    Notes
    -----
    Use :func:`parse_radii` to make one from text; it refuses invalid numbers.

    Examples
    --------
    >>> radii = parse_radii("uniform:0.01:0.02")
    >>> round(radii.mean, 6), round(radii.second_moment, 9), radii.largest
    (0.015, 0.000233333, 0.02)
    """

    kind: str
    parameters: tuple[float, ...]
    scalable: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", tuple(float(value) for value in self.parameters))
        _check(self)

    def sample(self, count: int, rng: np.random.Generator) -> Floats:
        """Independent radii [m], shape (count,)."""
        return _LAWS[self.kind].sample(self.parameters, count, rng)

    def moment(self, order: int) -> float:
        """Exact mean of R**order, order 1, 2 or 3 [m**order]."""
        return _LAWS[self.kind].moment(self.parameters, order)

    @property
    def mean(self) -> float:
        """Mean radius [m]."""
        return self.moment(1)

    @property
    def second_moment(self) -> float:
        """Mean squared radius [m2]."""
        return self.moment(2)

    @property
    def third_moment(self) -> float:
        """Mean cubed radius [m3]."""
        return self.moment(3)

    @property
    def smallest(self) -> float:
        """Smallest possible radius [m]; 0 for a lognormal distribution."""
        return _LAWS[self.kind].support(self.parameters)[0]

    @property
    def largest(self) -> float:
        """Largest possible radius [m]; infinite for a lognormal distribution."""
        return _LAWS[self.kind].support(self.parameters)[1]

    def mean_measure(self, dimension: int) -> float:
        """Mean area of a disk (dimension 2) [m2] or mean volume of a sphere (dimension 3) [m3]."""
        return float(ball_measure(1.0, dimension) * self.moment(dimension))


def parse_radii(text: str) -> RadiusDistribution:
    """Read a size distribution from its word.

    Parameters
    ----------
    text : str
        ``equal``, ``equal:r``, ``uniform:a:b``, ``gaussian:mean:sd``, ``lognormal:mean:sd``,
        ``bidisperse:a:b:fraction`` or ``list:r1:r2:...``.

    Returns
    -------
    RadiusDistribution

    Raises
    ------
    InputError
        If the word is unknown, a number is missing, superfluous or unreadable, or the numbers make no sense.

    Examples
    --------
    >>> parse_radii("bidisperse:1:1.4:0.5").mean
    1.2
    """
    kind, *words = text.strip().split(":")
    if kind not in _LAWS:
        raise InputError(f"unknown size distribution {text!r}: expected one of {', '.join(_FORMS.values())}")
    try:
        numbers = tuple(float(word) for word in words)
    except ValueError:
        raise InputError(f"size distribution {text!r} has an unreadable number: expected {_FORMS[kind]}") from None
    if kind == "equal" and not numbers:
        return RadiusDistribution("equal", (1.0,), scalable=True)
    return RadiusDistribution(kind, numbers)


_FORMS = {
    "equal": "equal[:r]",
    "uniform": "uniform:a:b",
    "gaussian": "gaussian:mean:sd",
    "lognormal": "lognormal:mean:sd",
    "bidisperse": "bidisperse:a:b:fraction",
    "list": "list:r1:r2:...",
}


def _check(radii: RadiusDistribution) -> None:
    """Refuse numbers that are no size distribution."""
    kind, numbers = radii.kind, radii.parameters
    if kind not in _FORMS:
        raise InputError(f"unknown size distribution {kind!r}: expected one of {', '.join(_FORMS)}")
    form, found = _FORMS[kind], ":".join([kind, *(f"{number:g}" for number in numbers)])
    wanted = {"equal": 1, "bidisperse": 3}.get(kind, 2)
    if len(numbers) != wanted if kind != "list" else not numbers:
        raise InputError(f"size distribution {found!r} has {len(numbers)} numbers: expected {form}")
    if not np.isfinite(numbers).all():
        raise InputError(f"size distribution {found!r} has a number that is not finite: expected {form}")
    lengths = numbers[:2] if kind == "bidisperse" else numbers
    spread = kind in ("gaussian", "lognormal")
    if min(lengths[:1] if spread else lengths) <= 0.0:
        raise InputError(f"size distribution {found!r} has a radius that is not positive: expected {form}")
    for length in lengths[:1] if spread else lengths:
        if not SHORTEST <= length <= LONGEST:
            raise InputError(
                f"size distribution {found!r} has the radius {length:g}: expected {SHORTEST:g} to {LONGEST:g} metres"
            )
    if not spread and max(lengths) > WIDEST_RANGE * min(lengths):
        raise InputError(
            f"size distribution {found!r} has radii of ratio {max(lengths) / min(lengths):.3g}: expected at most "
            f"{WIDEST_RANGE:g}"
        )
    if spread and numbers[1] <= 0.0:
        raise InputError(f"size distribution {found!r} has a standard deviation that is not positive: use equal:r")
    if kind == "uniform" and numbers[0] > numbers[1]:
        raise InputError(f"size distribution {found!r} has its lower end above its upper end: expected a <= b")
    if kind == "bidisperse" and not 0.0 <= numbers[2] <= 1.0:
        raise InputError(f"size distribution {found!r} has fraction {numbers[2]:g}: expected a number in [0, 1]")
    if kind == "gaussian" and numbers[0] <= GAUSSIAN_CUT * numbers[1]:
        raise InputError(
            f"size distribution {found!r} reaches radii of zero: its standard deviation must stay below "
            f"mean / {GAUSSIAN_CUT:g} = {numbers[0] / GAUSSIAN_CUT:g}, or use lognormal"
        )


class _Law(NamedTuple):
    """What a kind of distribution can do, as functions of its parameters."""

    sample: Callable[[tuple[float, ...], int, np.random.Generator], Floats]
    moment: Callable[[tuple[float, ...], int], float]
    support: Callable[[tuple[float, ...]], tuple[float, float]]


def _uniform_moment(p: tuple[float, ...], order: int) -> float:
    a, b = p
    return sum(a**k * b ** (order - k) for k in range(order + 1)) / (order + 1)


def _truncated_normal(p: tuple[float, ...]) -> Any:
    from scipy.stats import truncnorm  # a second of import that only this distribution needs

    return truncnorm(-GAUSSIAN_CUT, GAUSSIAN_CUT, loc=p[0], scale=p[1])


def _log_parameters(p: tuple[float, ...]) -> tuple[float, float]:
    """Mean and standard deviation of ln R from those of R."""
    variance = float(np.log1p((p[1] / p[0]) ** 2))
    return float(np.log(p[0]) - variance / 2.0), variance**0.5


def _lognormal_moment(p: tuple[float, ...], order: int) -> float:
    location, scale = _log_parameters(p)
    return float(np.exp(order * location + (order * scale) ** 2 / 2.0))


_LAWS = {
    "equal": _Law(
        lambda p, n, _: np.full(n, p[0]),
        lambda p, order: p[0] ** order,
        lambda p: (p[0], p[0]),
    ),
    "uniform": _Law(lambda p, n, rng: rng.uniform(p[0], p[1], n), _uniform_moment, lambda p: (p[0], p[1])),
    "gaussian": _Law(
        lambda p, n, rng: _truncated_normal(p).ppf(rng.random(n)),
        lambda p, order: float(_truncated_normal(p).moment(order)),
        lambda p: (p[0] - GAUSSIAN_CUT * p[1], p[0] + GAUSSIAN_CUT * p[1]),
    ),
    "lognormal": _Law(
        lambda p, n, rng: rng.lognormal(*_log_parameters(p), n),
        _lognormal_moment,
        lambda _: (0.0, np.inf),
    ),
    "bidisperse": _Law(
        lambda p, n, rng: np.where(rng.random(n) < p[2], p[1], p[0]),
        lambda p, order: (1.0 - p[2]) * p[0] ** order + p[2] * p[1] ** order,
        lambda p: (min(p[:2]), max(p[:2])),
    ),
    "list": _Law(
        lambda p, n, rng: np.asarray(p)[rng.integers(0, len(p), n)],
        lambda p, order: float(np.mean(np.asarray(p) ** order)),
        lambda p: (min(p), max(p)),
    ),
}
