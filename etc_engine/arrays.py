"""Arrays by the type of their elements, for annotations and for kernels."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]


def read_only(values: ArrayLike) -> Floats:
    """Contiguous float64 array that cannot be written to: a view of the values where they are such an array.

    numba compiles a kernel once for writable, once for read-only and once for strided arguments. An argument that comes
    in several of these kinds is passed through here, so that the kernel is compiled once.

    Examples
    --------
    >>> read_only([1, 2]).flags.writeable
    False
    """
    view = np.ascontiguousarray(values, dtype=np.float64).view()
    view.setflags(write=False)
    return view
