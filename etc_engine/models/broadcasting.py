"""How a formula meets arrays: scalars, NumPy arrays and labelled arrays in, the same kind out."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from etc_engine.arrays import Floats

Values: TypeAlias = Any
"""A number, an ndarray or an ``xarray.DataArray`` of numbers."""

"""What the body of an `elementwise` function sees."""


def elementwise(function: Callable[..., Floats]) -> Callable[..., Values]:
    """Let a formula written for equally shaped float arrays take numbers, ndarrays or DataArrays.

    Every argument is an array of numbers except ``dimension``, and except those left at None. They
    are broadcast against each other, by position for ndarrays and by name for DataArrays; the
    result is a number, an ndarray or a DataArray accordingly. Floating-point warnings are silent
    inside, because a formula evaluates both sides of its ``np.where``; a value that does not exist
    is NaN.

    Parameters
    ----------
    function : callable
        Formula of float arrays of one common shape.

    Returns
    -------
    callable
        The same formula for numbers, ndarrays and DataArrays.

    Notes
    -----
    DataArrays are recognised by their ``dims``, so xarray need not be imported (or installed). They are
    aligned as xarray's own arithmetic aligns them.

    Examples
    --------
    >>> @elementwise
    ... def mean(a, b):
    ...     return 0.5 * (a + b)
    >>> mean(1, 2), mean([1.0, 3.0], 2.0)
    (np.float64(1.5), array([1.5, 2.5]))
    """
    signature = inspect.signature(function)

    @functools.wraps(function)
    def formula(*args: Values, **kwargs: Values) -> Values:
        bound = signature.bind(*args, **kwargs)
        bound.apply_defaults()
        numbers = {name: value for name, value in bound.arguments.items() if name != "dimension" and value is not None}
        blank = _common_labels(list(numbers.values()))
        if blank is not None:
            numbers = {name: blank + value for name, value in numbers.items()}
        arrays = np.broadcast_arrays(*(np.asarray(value, dtype=np.float64) for value in numbers.values()))
        bound.arguments.update(zip(numbers, arrays, strict=True))
        with np.errstate(all="ignore"):
            result = function(*bound.args, **bound.kwargs)
        return result[()] if blank is None else blank.copy(data=result)

    return formula


def _common_labels(values: list[Values]) -> Values | None:
    """Zeros with every dimension of the labelled arrays among ``values``; None if there are none."""
    blank: Values | None = None
    for value in values:
        if hasattr(value, "dims"):
            zeros = 0.0 * np.isfinite(value)
            blank = zeros if blank is None else blank + zeros
    return blank
