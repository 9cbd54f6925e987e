"""Engines on the contact network of a packing: the discrete thermal element method, and the pipe network."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from etc_engine.engines.dtem.effective import (
    CurvePoint,
    conductivity_bounds,
    conductivity_curve,
    effective_conductivity,
    mean_field_conductivity,
)
from etc_engine.engines.dtem.model_error import chord_error_estimate
from etc_engine.engines.dtem.steady import SteadySolution
from etc_engine.engines.pipe.steady import PipeSolution, pipe_conductivity
from etc_engine.errors import EtcError
from etc_engine.medium.backbone import Backbone, find_backbones
from etc_engine.medium.conductivity import EffectiveConductivity
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.rules import bonded_contacts, coordination_contacts, overlap_contacts
from etc_engine.packing import ParticlePacking
from etc_engine.realization.outcome import Cell, Cells, Status, attempted
from etc_engine.realization.specification import RealizationSpec, particle_conductivities

CURVE_ANGLES = 4
"""From this many half-angles on, solving them together saves time."""


@dataclass(frozen=True, eq=False)
class _Medium:
    """What all cells of a packing share: its contacts at every half-angle, its backbone, its particles."""

    spec: RealizationSpec
    networks: list[ContactNetwork]
    backbones: Mapping[tuple[int, ...], Backbone]
    kappa: NDArray[np.float64]
    contact_resistance: float
    angles: Any

    @property
    def arguments(self) -> dict[str, Any]:
        """What every solver is told besides network and method."""
        conduction = self.spec.conduction
        return {
            "conductivity": self.kappa,
            "contact_resistance": self.contact_resistance,
            "tolerance": conduction.tolerance,
            "backbones": self.backbones,
        }


Column = Callable[[_Medium, str], list[Cell]]
"""(medium, method) -> the cells of a method, one a half-angle."""


def conduct_dtem(packing: ParticlePacking, spec: RealizationSpec, rng: np.random.Generator) -> Cells:
    """Discrete thermal element method on one packing."""
    return _conduct(packing, spec, rng, _dtem_column)


def conduct_pipe(packing: ParticlePacking, spec: RealizationSpec, rng: np.random.Generator) -> Cells:
    """Pipe network of one packing; a method is the resistance of a pipe."""
    return _conduct(packing, spec, rng, _pipe_column)


def _conduct(packing: ParticlePacking, spec: RealizationSpec, rng: np.random.Generator, column: Column) -> Cells:
    order = rng.permutation(packing.count) if "mixture_fraction" in {*spec.axes, *spec.values} else None
    cells = np.empty(spec.shape, dtype=object)
    names = list(spec.axes)
    for place, values in zip(np.ndindex(spec.shape[:-1]), spec.combinations(), strict=True):
        if "contact_angle" in names and place[names.index("contact_angle")] > 0:
            continue
        angles = spec.axes.get("contact_angle", (values.get("contact_angle"),))
        at = tuple(slice(None) if name == "contact_angle" else place[i] for i, name in enumerate(names))
        try:
            network = contact_network(packing, spec.rule, values)
            backbones = find_backbones(network)
        except EtcError as error:
            cells[at] = Cell(Status.ERROR, str(error))
            continue
        kappa = particle_conductivities(packing.count, values, order)
        networks = [network if angle is None else network.with_half_angle(angle) for angle in angles]
        medium = _Medium(spec, networks, backbones, kappa, values["contact_resistance"], angles)
        for m, method in enumerate(spec.conduction.methods):
            found = column(medium, method)
            for k, cell in enumerate(found):
                cells[(*(k if isinstance(x, slice) else x for x in at), m)] = cell
    return tuple(cells.ravel())


def contact_network(packing: ParticlePacking, rule: str, values: Mapping[str, float]) -> ContactNetwork:
    """Contacts of a packing by the rule of a study; bonded ones with the first of the half-angles."""
    if rule == "overlap":
        return overlap_contacts(packing)
    if rule == "bonded":
        return bonded_contacts(packing, values["contact_angle"], values["bond_gap"])
    return coordination_contacts(packing, values["contact_angle"], values["coordination"])


def _dtem_column(medium: _Medium, method: str) -> list[Cell]:
    """Cells of all half-angles; many by a reduced basis, and what that cannot solve one by one, which says why.

    ``exact`` wants every solution, for its bounds.
    """
    conduction = medium.spec.conduction
    points: Sequence[CurvePoint | None] = [None] * len(medium.networks)
    if len(medium.angles) >= CURVE_ANGLES and conduction.angle_curve == "reduced" and method != "exact":
        points = conductivity_curve(medium.networks[0], medium.angles, method=method, **medium.arguments)
    return [
        attempted(partial(_dtem_cell, medium, network, method))
        if point is None
        else replace(_solved_cell(medium, network, point, point.snapshots), solve_seconds=point.seconds)
        for network, point in zip(medium.networks, points, strict=True)
    ]


def _pipe_column(medium: _Medium, resistance: str) -> list[Cell]:
    return [attempted(partial(_pipe_cell, medium, network, resistance)) for network in medium.networks]


def _pipe_cell(medium: _Medium, network: ContactNetwork, resistance: str) -> Cell:
    return _solved_cell(medium, network, pipe_conductivity(network, resistance=resistance, **medium.arguments))


def _dtem_cell(medium: _Medium, network: ContactNetwork, method: str) -> Cell:
    result = effective_conductivity(network, method=method, **medium.arguments)
    cell = _solved_cell(medium, network, result)
    if method == "chord":
        return replace(cell, model_error_estimate=_chord_error(result))
    if method != "exact":
        return cell
    bounds = conductivity_bounds(result)
    widths = [upper / lower - 1.0 for lower, upper in bounds if lower > 0.0]
    return replace(
        cell,
        conductivity_bounds=tuple((float(lower), float(upper)) for lower, upper in bounds),
        model_error_estimate=float(max(widths, default=0.0)),
    )


def _chord_error(result: EffectiveConductivity[SteadySolution]) -> float:
    """Largest estimated model error of a load."""
    return max(
        chord_error_estimate(solution, load) for solution in result.solutions for load in range(len(solution.axes))
    )


def _solved_cell(
    medium: _Medium,
    network: ContactNetwork,
    result: EffectiveConductivity[SteadySolution] | EffectiveConductivity[PipeSolution] | CurvePoint,
    snapshots: int = 0,
) -> Cell:
    missing = result.missing_axes
    mean_field = mean_field_conductivity(
        network, conductivity=medium.kappa, contact_resistance=medium.contact_resistance
    )
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
        mean_field_conductivity=mean_field,
        solved_by="reduced" if snapshots else "full",
        snapshots=snapshots,
    )
