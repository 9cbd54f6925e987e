"""A property of a solid over temperature: a table or a correlation, with its range and its source."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from etc_engine.arrays import Floats
from etc_engine.errors import InputError


@dataclass(frozen=True)
class Property:
    """One property over temperature.

    Parameters
    ----------
    name : str
        Name for error messages, such as ``"conductivity of alumina"``.
    unit : str
        SI unit, ``"-"`` for a pure number.
    low, high : float
        Temperatures between which the source gives values [K]. Equal for a single measurement.
    formula : callable
        The value as a function of an array of temperatures [K].
    source : str
        Where the values were read.
    """

    name: str
    unit: str
    low: float
    high: float
    formula: Callable[[Floats], Floats]
    source: str

    def at(self, temperature: ArrayLike) -> Floats:
        """Value at the temperatures given.

        Parameters
        ----------
        temperature : array_like [K]

        Returns
        -------
        ndarray
            Of the shape of ``temperature``, in `unit`.

        Raises
        ------
        InputError
            If a temperature lies outside the range of the source: nothing is extrapolated.

        Examples
        --------
        >>> table([300.0, 400.0], [2.0, 3.0], "conductivity of X", "W/(m K)", "own measurement").at(350.0)
        array(2.5)
        """
        values = np.asarray(temperature, dtype=np.float64)
        outside = ~((values >= self.low) & (values <= self.high))
        if outside.any():
            found = values[outside].flat[0]
            raise InputError(
                f"the {self.name} is known from {self.low:g} to {self.high:g} K, found {found:g} K; "
                "give your own table for temperatures outside that range"
            )
        return np.asarray(self.formula(values), dtype=np.float64)


def table(temperatures: Sequence[float], values: Sequence[float], name: str, unit: str, source: str) -> Property:
    """Property that is interpolated linearly between tabulated points.

    Parameters
    ----------
    temperatures : sequence of float [K]
        Strictly increasing.
    values : sequence of float
        As many.
    name, unit, source : str
        As in `Property`.

    Raises
    ------
    InputError
        If the lists differ in length, are empty, or are not finite numbers in increasing temperature.

    Examples
    --------
    >>> k = table([300.0, 500.0], [10.0, 8.0], "conductivity of X", "W/(m K)", "own measurement")
    >>> k.low, k.high, k.at([300.0, 400.0, 500.0])
    (300.0, 500.0, array([10.,  9.,  8.]))
    """
    if len(temperatures) != len(values) or not len(temperatures):
        raise InputError(
            f"the table of the {name} has {len(temperatures)} temperatures and {len(values)} values: "
            "give one value for each temperature"
        )
    x = np.asarray(temperatures, dtype=np.float64)
    y = np.asarray(values, dtype=np.float64)
    if not (np.isfinite(x).all() and np.isfinite(y).all()):
        raise InputError(f"the table of the {name} holds a number that is not finite")
    if not (np.diff(x) > 0.0).all():
        raise InputError(f"the temperatures of the table of the {name} must increase, found {list(temperatures)}")
    if x[0] <= 0.0:
        raise InputError(f"the temperatures of the table of the {name} are in kelvin, found {x[0]:g}")

    def interpolate(t: Floats) -> Floats:
        return np.interp(t, x, y)

    return Property(name, unit, float(x[0]), float(x[-1]), interpolate, source)


def polynomial(coefficients: Sequence[float], low: float, high: float, name: str, unit: str, source: str) -> Property:
    """Property given by a polynomial c0 + c1 T + c2 T^2 + ... in the temperature [K].

    Examples
    --------
    >>> float(polynomial([1.0, 0.01], 300.0, 400.0, "conductivity of X", "W/(m K)", "book").at(300.0))
    4.0
    """
    c = np.asarray(coefficients, dtype=np.float64)

    def evaluate(t: Floats) -> Floats:
        return np.asarray(np.polynomial.polynomial.polyval(t, c), dtype=np.float64)

    return Property(name, unit, low, high, evaluate, source)
