"""What a realization leaves behind: one cell per medium and method."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from etc_engine.errors import ConvergenceError, EtcError
from etc_engine.realization.specification import RealizationSpec


class Status(IntEnum):
    """How a cell of a sweep ended. 0 and 1 carry a conductivity; the others are NaN."""

    OK = 0
    NOT_PERCOLATING = 1
    PACKING_FAILED = 2
    NOT_CONVERGED = 3
    ERROR = 4
    NOT_RUN = 5


@dataclass(frozen=True)
class Cell:
    """The outcome for one contact angle (or contrast) and one method.

    ``conductivity`` has shape (d, d) [W/(m K)]; components a walled box does not define are NaN.
    ``mean_field_conductivity`` [W/(m K)] is the contact mean field of the same network. ``model_error_estimate`` is
    what the method is estimated to miss, where it tells: ``chord`` solved in full, ``exact`` by its bounds.
    ``solved_by`` is ``full``, or ``reduced`` where the conductivity comes from the solutions at other
    contact angles, ``snapshots`` of them. ``conductivity_bounds`` [W/(m K)] are the lower and upper bound along each
    axis, of method ``exact`` only.
    """

    status: Status
    message: str = ""
    conductivity: NDArray[np.float64] = field(default_factory=lambda: np.full((2, 2), np.nan))
    contacts: int = 0
    wall_contacts: int = 0
    coordination: float = np.nan
    unknowns: int = 0
    iterations: int = 0
    relative_energy_error: float = np.nan
    solve_seconds: float = 0.0
    mean_field_conductivity: float = np.nan
    model_error_estimate: float = np.nan
    solved_by: str = ""
    snapshots: int = 0
    conductivity_bounds: tuple[tuple[float, float], ...] = ()


Cells = tuple[Cell, ...]


@dataclass(frozen=True)
class Realization:
    """What one realization gave; ``cells`` in the order of the specification, methods running fastest."""

    particles: int
    density: float
    solid_fraction: float
    pack_seconds: float
    cells: tuple[Cell, ...]


def attempted(solve: Callable[[], Cell], dimension: int = 2) -> Cell:
    """The cell that a solver makes, with the time it took; what it raises becomes the status and the message."""
    start = time.perf_counter()
    nowhere = np.full((dimension, dimension), np.nan)
    try:
        cell = solve()
    except ConvergenceError as error:
        return Cell(Status.NOT_CONVERGED, str(error), nowhere)
    except EtcError as error:
        return Cell(Status.ERROR, str(error), nowhere)
    return replace(cell, solve_seconds=time.perf_counter() - start)


def uniform_cells(spec: RealizationSpec, cell: Cell) -> Cells:
    """The same outcome in every cell of a realization."""
    return (cell,) * math.prod(spec.shape)
