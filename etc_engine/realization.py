"""One realization: pack, find contacts, conduct. Serial, no I/O, no MPI."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from etc_engine.contacts import ContactNetwork, bonded_contacts, coordination_contacts, overlap_contacts
from etc_engine.dtem.methods import METHODS as DTEM_METHODS
from etc_engine.effective import (
    CurvePoint,
    EffectiveConductivity,
    conductivity_bounds,
    conductivity_curve,
    effective_conductivity,
    mean_field_conductivity,
)
from etc_engine.errors import ConvergenceError, EtcError, InputError, PackingError
from etc_engine.packing import PackingSpec, ParticlePacking, pack
from etc_engine.packing.structure import solid_fraction
from etc_engine.percolation import Backbone, find_backbones

CURVE_ANGLES = 4
"""From this many half-angles on, solving them together saves time."""


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
        Half-angles of prescribed contacts, one cell each; empty with ``overlap``, where geometry sets them.
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
class Mixture:
    """A second material, given to randomly chosen particles.

    Parameters
    ----------
    conductivity : float [W/(m K)]
        Its conductivity.
    fraction : float
        Its number fraction, met to the nearest particle.
    """

    conductivity: float
    fraction: float


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
    mixture : Mixture, optional
        A second material for part of the particles.
    tolerance : float
        Relative error of the conductivity left by the iterative solver.
    angle_curve : str
        ``reduced`` solves many prescribed half-angles of one packing together, by a reduced basis, to an estimated
        relative error of ``min(1e-8, 100 tolerance)`` at most; ``full`` solves each alone.
    """

    engine: str = "dtem"
    methods: tuple[str, ...] = ("chord",)
    conductivity: float = 1.0
    contact_resistance: float = 0.0
    mixture: Mixture | None = None
    tolerance: float = 1e-10
    angle_curve: str = "reduced"


@dataclass(frozen=True)
class RealizationSpec:
    """Everything that defines one realization but its random stream."""

    packing: PackingSpec
    contacts: ContactSpec
    conduction: ConductionSpec


@dataclass(frozen=True)
class Cell:
    """The outcome for one contact angle and one method.

    ``conductivity`` has shape (d, d) [W/(m K)]; components a walled box does not define are NaN.
    ``mean_field_conductivity`` [W/(m K)] is the contact mean field of the same network. ``solved_by`` is ``full``, or
    ``reduced`` where the conductivity comes from the solutions at other contact angles, ``snapshots`` of them.
    ``conductivity_bounds`` [W/(m K)] are the lower and upper bound along each axis, of method ``exact`` only.
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
    solved_by: str = ""
    snapshots: int = 0
    conductivity_bounds: tuple[tuple[float, float], ...] = ()


Cells = tuple[tuple[Cell, ...], ...]


@dataclass(frozen=True)
class Realization:
    """What one realization gave; ``cells[angle][method]`` in the order of the specification."""

    particles: int
    density: float
    solid_fraction: float
    pack_seconds: float
    cells: Cells


def realize(spec: RealizationSpec, rng: np.random.Generator) -> Realization:
    """Pack once, then solve every contact angle and method on that packing.

    Failures of the packer or the solver are recorded in the cells, not raised.

    Parameters
    ----------
    spec : RealizationSpec
    rng : numpy.random.Generator
        The random stream of this realization; nothing else is random.

    Returns
    -------
    Realization
    """
    start = time.perf_counter()
    try:
        packing = pack(spec.packing, rng)
    except PackingError as error:
        failed = Cell(Status.PACKING_FAILED, str(error))
        return Realization(0, np.nan, np.nan, time.perf_counter() - start, _uniform(spec, failed))
    seconds = time.perf_counter() - start
    return Realization(
        packing.count,
        packing.density,
        solid_fraction(packing),
        seconds,
        ENGINES[spec.conduction.engine].conduct(packing, spec, rng),
    )


def _uniform(spec: RealizationSpec, cell: Cell) -> Cells:
    return ((cell,) * len(spec.conduction.methods),) * max(len(spec.contacts.contact_angles), 1)


def particle_conductivities(count: int, conduction: ConductionSpec, rng: np.random.Generator) -> NDArray[np.float64]:
    """Conductivity of each particle, shape (count,) [W/(m K)]; a mixture's second material at random places."""
    conductivities = np.full(count, conduction.conductivity)
    if conduction.mixture is not None:
        chosen = rng.permutation(count)[: round(conduction.mixture.fraction * count)]
        conductivities[chosen] = conduction.mixture.conductivity
    return conductivities


def conduct_dtem(packing: ParticlePacking, spec: RealizationSpec, rng: np.random.Generator) -> Cells:
    """Discrete thermal element method on one packing; contacts and backbone serve all angles and methods."""
    angles: tuple[float | None, ...] = spec.contacts.contact_angles or (None,)
    try:
        network = contact_network(packing, spec.contacts)
        backbones = find_backbones(network)
    except EtcError as error:
        return _uniform(spec, Cell(Status.ERROR, str(error)))
    kappa = particle_conductivities(packing.count, spec.conduction, rng)
    networks = [network if angle is None else network.with_half_angle(angle) for angle in angles]
    columns = [
        (_dtem_curve if _is_curve(spec, method) else _dtem_each)(networks, spec, backbones, kappa, method)
        for method in spec.conduction.methods
    ]
    return tuple(zip(*columns, strict=True))


def _is_curve(spec: RealizationSpec, method: str) -> bool:
    """Whether the half-angles are solved together; ``exact`` wants every solution, for its bounds."""
    enough = len(spec.contacts.contact_angles) >= CURVE_ANGLES
    return enough and spec.conduction.angle_curve == "reduced" and method != "exact"


def _dtem_each(
    networks: Sequence[ContactNetwork],
    spec: RealizationSpec,
    backbones: Mapping[tuple[int, ...], Backbone],
    kappa: NDArray[np.float64],
    method: str,
) -> list[Cell]:
    return [_dtem_cell(network, backbones, spec.conduction, kappa, method) for network in networks]


def _dtem_curve(
    networks: Sequence[ContactNetwork],
    spec: RealizationSpec,
    backbones: Mapping[tuple[int, ...], Backbone],
    kappa: NDArray[np.float64],
    method: str,
) -> list[Cell]:
    """Cells of all half-angles by a reduced basis; what that cannot solve goes the usual way, which says why."""
    resistance = spec.conduction.contact_resistance
    points = conductivity_curve(
        networks[0],
        spec.contacts.contact_angles,
        method=method,
        conductivity=kappa,
        contact_resistance=resistance,
        tolerance=spec.conduction.tolerance,
        backbones=backbones,
    )
    return [
        _dtem_cell(network, backbones, spec.conduction, kappa, method)
        if point is None
        else _solved_cell(network, point, kappa, resistance, point.seconds, point.snapshots)
        for network, point in zip(networks, points, strict=True)
    ]


def contact_network(packing: ParticlePacking, contacts: ContactSpec) -> ContactNetwork:
    """Contacts of a packing by the rule of a study; bonded ones with the first of the half-angles."""
    if contacts.rule == "overlap":
        return overlap_contacts(packing)
    if contacts.rule == "bonded":
        return bonded_contacts(packing, contacts.contact_angles[0], contacts.bond_gap)
    if contacts.rule == "coordination":
        return coordination_contacts(packing, contacts.contact_angles[0], contacts.coordination or np.nan)
    raise InputError(f"unknown contact rule {contacts.rule!r}: expected overlap, bonded or coordination")


def _dtem_cell(
    network: ContactNetwork,
    backbones: Mapping[tuple[int, ...], Backbone],
    conduction: ConductionSpec,
    kappa: NDArray[np.float64],
    method: str,
) -> Cell:
    start = time.perf_counter()
    resistance = conduction.contact_resistance
    try:
        result = effective_conductivity(
            network,
            method=method,
            conductivity=kappa,
            contact_resistance=resistance,
            tolerance=conduction.tolerance,
            backbones=backbones,
        )
    except ConvergenceError as error:
        return Cell(Status.NOT_CONVERGED, str(error))
    except EtcError as error:
        return Cell(Status.ERROR, str(error))
    cell = _solved_cell(network, result, kappa, resistance, time.perf_counter() - start)
    if method != "exact":
        return cell
    bounds = conductivity_bounds(result)
    return replace(
        cell,
        conductivity_bounds=tuple((float(lower), float(upper)) for lower, upper in bounds),
        solve_seconds=time.perf_counter() - start,
    )


def _solved_cell(
    network: ContactNetwork,
    result: EffectiveConductivity | CurvePoint,
    kappa: NDArray[np.float64],
    resistance: float,
    seconds: float,
    snapshots: int = 0,
) -> Cell:
    missing = result.missing_axes
    return Cell(
        status=Status.NOT_PERCOLATING if missing else Status.OK,
        message=f"no path of contacts along {missing}" if missing else "",
        conductivity=result.tensor,
        contacts=network.count,
        wall_contacts=network.walls.size,
        coordination=network.coordination,
        unknowns=result.unknowns,
        iterations=result.iterations,
        relative_energy_error=result.relative_energy_error,
        mean_field_conductivity=mean_field_conductivity(network, conductivity=kappa, contact_resistance=resistance),
        solve_seconds=seconds,
        solved_by="reduced" if snapshots else "full",
        snapshots=snapshots,
    )


@dataclass(frozen=True)
class Engine:
    """One way to conduct heat through a packing.

    Parameters
    ----------
    conduct : callable
        (packing, spec, rng) -> cells, by contact angle and method.
    methods : tuple of str
        The variants it knows.
    """

    conduct: Callable[[ParticlePacking, RealizationSpec, np.random.Generator], Cells]
    methods: tuple[str, ...]


ENGINES: Mapping[str, Engine] = {"dtem": Engine(conduct_dtem, tuple(DTEM_METHODS))}
