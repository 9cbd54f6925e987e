"""One realization: pack, find contacts, conduct. Serial, no I/O, no MPI."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray


class Status(IntEnum):
    """How a cell of a sweep ended. 0 and 1 carry a conductivity; the others are NaN."""

    OK = 0
    NOT_PERCOLATING = 1
    PACKING_FAILED = 2
    NOT_CONVERGED = 3
    ERROR = 4
    NOT_RUN = 5


@dataclass(frozen=True)
class ContactSpec:
    """Which pairs conduct, and through how wide an arc.

    Parameters
    ----------
    rule : str
        ``overlap``, ``bonded`` or ``coordination``.
    contact_angles : tuple of float [rad]
        Half-angles of bonded contacts, one cell each; empty with ``overlap``, where geometry sets them.
    bond_gap : float
        Largest bonded gap, in mean radii of the pair.
    coordination : float, optional
        Mean coordination number wanted by the ``coordination`` rule.
    """

    rule: str = "overlap"
    contact_angles: tuple[float, ...] = ()
    bond_gap: float = 1e-6
    coordination: float | None = None


@dataclass(frozen=True)
class ConductionSpec:
    """How the heat conduction through a contact network is solved.

    Parameters
    ----------
    engine : str
        A word of the engine table (``dtem``).
    methods : tuple of str
        Variants of the engine, one cell each.
    conductivity : float [W/(m K)]
        Conductivity of the particles.
    contact_resistance : float [m K/W]
        Total resistance of a contact per unit thickness.
    tolerance : float
        Relative error of the conductivity left by the iterative solver.
    """

    engine: str = "dtem"
    methods: tuple[str, ...] = ("chord",)
    conductivity: float = 1.0
    contact_resistance: float = 0.0
    tolerance: float = 1e-10


@dataclass(frozen=True)
class RealizationSpec:
    """Everything that defines one realization but its random stream."""

    packing: object  # etc_engine.packing.PackingSpec, its density included
    contacts: ContactSpec
    conduction: ConductionSpec


@dataclass(frozen=True)
class Cell:
    """The outcome for one contact angle and one method.

    ``conductivity`` has shape (d, d) [W/(m K)]; components a walled box does not define are NaN.
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


@dataclass(frozen=True)
class Realization:
    """What one realization gave; ``cells[angle][method]`` in the order of the specification."""

    particles: int
    density: float
    solid_fraction: float
    pack_seconds: float
    cells: tuple[tuple[Cell, ...], ...]


def realize(spec: RealizationSpec, rng: np.random.Generator) -> Realization:
    """Pack once, then solve every contact angle and method on that packing.

    Failures of the packer or the solver are recorded in the cells, not raised.
    """
    raise NotImplementedError


ENGINES: Mapping[str, Callable[..., Cell]] = {}
