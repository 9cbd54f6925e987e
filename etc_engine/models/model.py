"""The record of a model: formula, inputs, validity and source."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.models.broadcasting import Values

Kind = Literal["estimate", "lower bound", "upper bound", "exact"]


@dataclass(frozen=True)
class Interval:
    """The values an input may take.

    Parameters
    ----------
    low, high : float
        End points.
    closed : str, optional
        Which ends belong to it: ``"both"``, ``"low"``, ``"high"`` or ``"none"``.

    Examples
    --------
    >>> str(Interval(0.0, 1.0, "low")), Interval(0.0, 1.0, "low").contains(np.array([0.0, 1.0]))
    ('[0, 1)', array([ True, False]))
    """

    low: float
    high: float
    closed: Literal["both", "low", "high", "none"] = "both"

    def contains(self, values: Floats) -> np.ndarray:
        """True for each value inside; NaN is not."""
        above = values >= self.low if self.closed in ("both", "low") else values > self.low
        below = values <= self.high if self.closed in ("both", "high") else values < self.high
        return above & below

    def __str__(self) -> str:
        left = "[" if self.closed in ("both", "low") else "("
        right = "]" if self.closed in ("both", "high") else ")"
        return f"{left}{self.low:.6g}, {self.high:.6g}{right}"


@dataclass(frozen=True)
class Input:
    """One input of a model.

    Parameters
    ----------
    name : str
        The argument of the formula.
    meaning : str
        The quantity in words.
    unit : str
        SI unit, ``"-"`` for a pure number.
    interval : Interval
        The values it may take.
    """

    name: str
    meaning: str
    unit: str
    interval: Interval


UNIT = Interval(0.0, 1.0)
POSITIVE = Interval(0.0, math.inf, "none")
POSITIVE_OR_INFINITE = Interval(0.0, math.inf, "high")
FROM_ZERO = Interval(0.0, math.inf, "low")
ANY_CONDUCTIVITY = Interval(0.0, math.inf, "both")


@dataclass(frozen=True)
class Model:
    """A catalogued model of the effective conductivity of a two-phase medium.

    Parameters
    ----------
    name : str
        The key in the catalogue.
    title : str
        Name in print.
    label : str
        Its name in a picture: the title in at most 25 letters.
    function : callable
        The formula, of numbers, ndarrays or DataArrays.
    dimensions : tuple of int
        2 (disks), 3 (spheres) or both.
    kind : str
        ``"estimate"``, ``"lower bound"``, ``"upper bound"`` or ``"exact"`` (for its own geometry).
    inputs : tuple of Input
        Every input of the formula, with units and allowed values; ``dimension`` excepted.
    validity : str
        Where it can be trusted.
    limits : str
        The limits that the formula takes, at a contrast of 1 for example.
    reference : str
        Source, with DOI where there is one.
    """

    name: str
    title: str
    label: str
    function: Callable[..., Values]
    dimensions: tuple[int, ...]
    kind: Kind
    inputs: tuple[Input, ...]
    validity: str
    limits: str
    reference: str

    def __post_init__(self) -> None:
        declared = {item.name for item in self.inputs}
        taken = set(inspect.signature(self.function).parameters) - {"dimension"}
        if declared != taken:
            raise TypeError(f"model {self.name} declares {sorted(declared)}, its formula takes {sorted(taken)}")

    @property
    def rigorous(self) -> bool:
        """True for a bound that no medium of its class can break."""
        return self.kind in ("lower bound", "upper bound")

    @property
    def needs_dimension(self) -> bool:
        """True if the formula differs between two and three dimensions."""
        return "dimension" in inspect.signature(self.function).parameters

    @property
    def defaults(self) -> dict[str, float | None]:
        """Values of the inputs that may be left out; None stands for one the formula finds itself."""
        arguments = inspect.signature(self.function).parameters.values()
        return {
            argument.name: argument.default for argument in arguments if argument.default is not inspect.Parameter.empty
        }

    @property
    def required(self) -> tuple[str, ...]:
        """Names of the parameters that must be given beside k1, k2 and the fraction."""
        given = {"k1", "k2", "fraction", *self.defaults}
        return tuple(item.name for item in self.inputs if item.name not in given)
