"""Numbers beyond double precision: one refusal instead of a row of warnings and errors of libraries."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from etc_engine.errors import ConvergenceError


@contextmanager
def representable_numbers() -> Iterator[None]:
    """In the block numbers may overflow silently; what cannot be solved because of them is a `ConvergenceError`.

    Whoever opens the block looks at the result, whether it is finite.

    Examples
    --------
    >>> with representable_numbers():
    ...     raise RuntimeError("Factor is exactly singular")
    Traceback (most recent call last):
    etc_engine.errors.ConvergenceError: the numbers exceed double precision (Factor is exactly ...
    """
    with np.errstate(all="ignore"):
        try:
            yield
        except (RuntimeError, ArithmeticError, np.linalg.LinAlgError) as error:
            if isinstance(error, NotImplementedError | RecursionError):
                raise
            raise ConvergenceError(
                f"the numbers exceed double precision ({error}): check the values of the study"
            ) from error
