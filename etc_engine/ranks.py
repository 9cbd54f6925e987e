"""What work on many ranks needs of them, and how an error on one of them reaches all. No MPI is imported here."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol, TypeVar

import numpy as np

from etc_engine.arrays import Floats, Ints
from etc_engine.errors import EtcError

T = TypeVar("T")


class Ranks(Protocol):
    """Ranks that work on one problem together. Every rank makes every call."""

    rank: int
    size: int

    def share(self, value: Any) -> list[Any]:
        """The values of all ranks, on every rank."""

    def exchange(self, values: Sequence[Any]) -> list[Any]:
        """One value from each rank, for one value to each rank."""

    def add_up(self, values: Floats | Ints) -> Any:
        """Sum of an array over the ranks, on every rank."""


class Alone:
    """A single rank."""

    rank = 0
    size = 1

    def share(self, value: Any) -> list[Any]:
        """The value, as a list of one."""
        return [value]

    def exchange(self, values: Sequence[Any]) -> list[Any]:
        """The value for itself."""
        return list(values)

    def add_up(self, values: Floats | Ints) -> Any:
        """The array itself."""
        return np.asarray(values)


def together(ranks: Ranks, action: Callable[[], T]) -> T:
    """What a local action returns on this rank; an error of the engine on any rank is raised on every rank.

    Parameters
    ----------
    ranks : Ranks
    action : callable
        It must not talk to other ranks: one that fails would leave them waiting.

    Raises
    ------
    EtcError
        That of the lowest rank that failed.

    Examples
    --------
    >>> together(Alone(), lambda: 3)
    3
    """
    result: T | None = None
    failure: EtcError | None = None
    try:
        result = action()
    except EtcError as error:
        failure = error
    first = next((found for found in ranks.share(failure) if found is not None), None)
    if first is not None:
        raise first
    return result  # type: ignore[return-value]
