"""Engines on the contact network of a packing: the discrete thermal element method, and the pipe network."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from etc_engine.contacts import ContactNetwork, bonded_contacts, coordination_contacts, overlap_contacts
from etc_engine.dtem.model_error import chord_error_estimate
from etc_engine.effective import (
    CurvePoint,
    EffectiveConductivity,
    conductivity_bounds,
    conductivity_curve,
    effective_conductivity,
    mean_field_conductivity,
)
from etc_engine.errors import ConvergenceError, EtcError, InputError
from etc_engine.packing import ParticlePacking
from etc_engine.percolation import Backbone, find_backbones
from etc_engine.pipe.steady import PipeConductivity, pipe_conductivity
from etc_engine.realization.outcome import Cell, Cells, Status, uniform_cells
from etc_engine.realization.specification import (
    ConductionSpec,
    ContactSpec,
    RealizationSpec,
    particle_conductivities,
)

CURVE_ANGLES = 4
"""From this many half-angles on, solving them together saves time."""


Column = Callable[
    [Sequence[ContactNetwork], RealizationSpec, Mapping[tuple[int, ...], Backbone], NDArray[np.float64], str],
    list[Cell],
]
"""(networks, spec, backbones, conductivities, method) -> the cells of a method, one a network."""


def conduct_dtem(packing: ParticlePacking, spec: RealizationSpec, rng: np.random.Generator) -> Cells:
    """Discrete thermal element method on one packing."""
    return _conduct(packing, spec, rng, lambda method: _dtem_curve if _is_curve(spec, method) else _dtem_each)


def conduct_pipe(packing: ParticlePacking, spec: RealizationSpec, rng: np.random.Generator) -> Cells:
    """Pipe network of one packing; a method is the resistance of a pipe."""
    return _conduct(packing, spec, rng, lambda _: _pipe_each)


def _conduct(
    packing: ParticlePacking, spec: RealizationSpec, rng: np.random.Generator, column_of: Callable[[str], Column]
) -> Cells:
    """Contacts and backbone serve all angles and methods."""
    angles: tuple[float | None, ...] = spec.contacts.contact_angles or (None,)
    try:
        network = contact_network(packing, spec.contacts)
        backbones = find_backbones(network)
    except EtcError as error:
        return uniform_cells(spec, Cell(Status.ERROR, str(error)))
    kappa = particle_conductivities(packing.count, spec.conduction, rng)
    networks = [network if angle is None else network.with_half_angle(angle) for angle in angles]
    columns = [column_of(method)(networks, spec, backbones, kappa, method) for method in spec.conduction.methods]
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


def _pipe_each(
    networks: Sequence[ContactNetwork],
    spec: RealizationSpec,
    backbones: Mapping[tuple[int, ...], Backbone],
    kappa: NDArray[np.float64],
    resistance: str,
) -> list[Cell]:
    return [_pipe_cell(network, backbones, spec.conduction, kappa, resistance) for network in networks]


def _pipe_cell(
    network: ContactNetwork,
    backbones: Mapping[tuple[int, ...], Backbone],
    conduction: ConductionSpec,
    kappa: NDArray[np.float64],
    resistance: str,
) -> Cell:
    start = time.perf_counter()
    contact = conduction.contact_resistance
    try:
        result = pipe_conductivity(
            network,
            resistance=resistance,
            conductivity=kappa,
            contact_resistance=contact,
            tolerance=conduction.tolerance,
            backbones=backbones,
        )
    except ConvergenceError as error:
        return Cell(Status.NOT_CONVERGED, str(error))
    except EtcError as error:
        return Cell(Status.ERROR, str(error))
    return _solved_cell(network, result, kappa, contact, time.perf_counter() - start)


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
    if method == "chord":
        cell = replace(cell, model_error_estimate=_chord_error(result))
    if method == "exact":
        bounds = conductivity_bounds(result)
        widths = [upper / lower - 1.0 for lower, upper in bounds if lower > 0.0]
        cell = replace(
            cell,
            conductivity_bounds=tuple((float(lower), float(upper)) for lower, upper in bounds),
            model_error_estimate=float(max(widths, default=0.0)),
        )
    return replace(cell, solve_seconds=time.perf_counter() - start)


def _chord_error(result: EffectiveConductivity) -> float:
    """Largest estimated model error of a load."""
    return max(
        chord_error_estimate(solution, load) for solution in result.solutions for load in range(len(solution.axes))
    )


def _solved_cell(
    network: ContactNetwork,
    result: EffectiveConductivity | CurvePoint | PipeConductivity,
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
