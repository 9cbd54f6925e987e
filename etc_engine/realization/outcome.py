"""What a realization leaves behind: one outcome per medium and method."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.errors import ConvergenceError, EtcError
from etc_engine.medium.conductances import mean_field_conductivity
from etc_engine.medium.conduction import Result
from etc_engine.medium.medium import Medium
from etc_engine.packing.neighbors import neighbor_pairs


class Status(IntEnum):
    """How a cell of a sweep ended. 0 and 1 carry a conductivity; the others are NaN."""

    OK = 0
    NOT_PERCOLATING = 1
    PACKING_FAILED = 2
    NOT_CONVERGED = 3
    ERROR = 4
    NOT_RUN = 5


@dataclass(frozen=True)
class Outcome:
    """Result of one medium solved by one method.

    ``conductivity`` has shape (d, d) [W/(m K)], None after a failure; components a walled box does not define are NaN.
    ``mean_field_conductivity`` [W/(m K)] is the contact mean field of the same network. ``model_error_estimate`` is
    the estimated error of the method, where it has one: ``chord`` solved in full, ``exact`` by its bounds.
    ``solved_by`` is ``full``, or ``reduced`` where the conductivity comes from the solutions at other
    contact angles, ``snapshots`` of them. ``conductivity_bounds`` [W/(m K)] are the lower and upper bound along each
    axis, of method ``exact`` only. ``heat_imbalance`` is the difference of the heat in at one wall and out at the other
    over the heat flow, where properties follow the local temperature.
    """

    status: Status
    message: str = ""
    conductivity: Floats | None = None
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
    heat_imbalance: float = np.nan


@dataclass(frozen=True)
class Realization:
    """Result of one realization; ``cells`` in the order of the specification, methods running fastest."""

    particles: int
    density: float
    solid_fraction: float
    pack_seconds: float
    cells: tuple[Outcome, ...]


TOUCHING = 1e-6
"""Surfaces closer than this, in mean radii of the pair, count as a contact where there is no contact network."""


def outcome_of(medium: Medium, result: Result) -> Outcome:
    """The outcome of a medium: its conductivity and its contacts, or the error as status and message."""
    if isinstance(result, ConvergenceError):
        return Outcome(Status.NOT_CONVERGED, str(result))
    if isinstance(result, EtcError):
        return Outcome(Status.ERROR, str(result))
    missing, network = result.missing_axes, medium.network
    contacts = neighbor_pairs(medium.packing, relative_gap=TOUCHING).count if network is None else network.count
    return Outcome(
        status=Status.NOT_PERCOLATING if missing else Status.OK,
        message=f"no path of contacts along {missing}" if missing else "",
        conductivity=result.tensor,
        contacts=contacts,
        wall_contacts=0 if network is None else network.walls.size,
        coordination=2.0 * contacts / medium.packing.count if network is None else network.coordination,
        unknowns=result.unknowns,
        iterations=result.iterations,
        relative_energy_error=result.relative_energy_error,
        solve_seconds=result.seconds,
        mean_field_conductivity=np.nan if network is None else mean_field_conductivity(medium),
        model_error_estimate=result.model_error,
        solved_by="reduced" if result.snapshots else "full",
        snapshots=result.snapshots,
        heat_imbalance=result.heat_imbalance,
        conductivity_bounds=() if result.bounds is None else tuple((float(k), float(m)) for k, m in result.bounds),
    )
