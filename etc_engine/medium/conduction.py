"""Conduction: which engine solves a medium, and how; and attempts that may fail."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from etc_engine.errors import EtcError
from etc_engine.medium.conductivity import EffectiveConductivity

Result = EffectiveConductivity[Any] | EtcError
"""What solving one medium came to."""


@dataclass(frozen=True)
class Conduction:
    """How the heat conduction through a medium is solved.

    Parameters
    ----------
    engine, method : str
        A word of the engine table, and one of its methods.
    options : mapping
        Further choices that the engine heeds, by name; its defaults for the others.
    tolerance : float
        Relative error of the conductivity left by the iterative solver.
    axes : tuple of int, optional
        Load axes; all by default.
    """

    engine: str = "dtem"
    method: str = "chord"
    options: Mapping[str, Any] = field(default_factory=dict)
    tolerance: float = 1e-10
    axes: tuple[int, ...] | None = None


def attempt(solve: Callable[[], EffectiveConductivity[Any]]) -> Result:
    """A conductivity with the time it took, or the error of the engine that it ended in."""
    start = time.perf_counter()
    try:
        result = solve()
    except EtcError as error:
        return error
    return replace(result, seconds=time.perf_counter() - start)
