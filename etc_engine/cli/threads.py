"""One thread per process: ranks share a machine by processes, not by threads.

Without this, two ranks on two cores ran an order of magnitude slower than one: every rank starts as
many BLAS threads as there are cores. Whoever wants threads sets the variables before the start.
"""

from __future__ import annotations

import os
import sys

THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMBA_NUM_THREADS",
)


def hold_one_thread() -> None:
    """Hold BLAS, OpenMP and numba at one thread, except where the environment asks for another number.

    The libraries read the variables when they load; if numpy came first, its pools are limited instead.
    """
    asked = any(name in os.environ for name in THREAD_VARIABLES)
    for name in THREAD_VARIABLES:
        os.environ.setdefault(name, "1")
    if "numpy" in sys.modules and not asked:
        import threadpoolctl  # type: ignore[import-untyped]

        threadpoolctl.threadpool_limits(1)
