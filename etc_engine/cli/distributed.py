"""``etc-engine solve --distributed``: one packing on all ranks that a launcher started."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from etc_engine.cli.clock import Clock
from etc_engine.errors import EtcError, InputError

if TYPE_CHECKING:
    from etc_engine.cli.contact_options import ContactWords
    from etc_engine.cli.particle_options import SampleWords
    from etc_engine.cli.solve_request import SolveRequest
    from etc_engine.medium.conduction import Conduction
    from etc_engine.medium.network import ContactNetwork
    from etc_engine.packing.particles import ParticlePacking
    from etc_engine.realization.distributed import ScatteredFile
    from etc_engine.sweep.scheduler import Communicator

PATIENCE = 30.0
"""Seconds that a rank with an error waits for the others to have it too."""
HELP = (
    "All ranks of mpirun solve one packing together, each a part of it. Needs petsc4py. Takes a dump, CSV or netCDF, "
    "method chord, and the rules overlap, bonded and radius. Writes no files."
)


def distributed_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give ``solve`` the option ``--distributed``, with which all ranks do its work."""

    @wraps(command)
    def chosen(distributed: bool, **given: Any) -> Any:
        return _on_ranks(**given) if distributed else command(**given)

    return click.option("--distributed", is_flag=True, help=HELP)(chosen)


def _on_ranks(**given: Any) -> int:
    """Run on all ranks; an error is reported once, and one that not all ranks know of ends them all."""
    from etc_engine.sweep.scheduler import connect

    communicator = connect()
    try:
        status = _solve(communicator, **given)
    except EtcError as error:
        _meet(communicator, error)
        communicator.close()
        if communicator.rank == 0:
            raise
        return 2  # every rank has the same error, one reports it
    except BaseException as error:
        if communicator.size == 1:
            raise
        click.echo(f"etc-engine: unexpected {type(error).__name__} on rank {communicator.rank}: {error}", err=True)
        communicator.abort(1)
    communicator.close()
    return status


def _meet(communicator: Communicator, error: EtcError) -> None:
    """Wait for the ranks that have the same error; one that others do not know of ends them all."""
    began = time.monotonic()

    def impatient() -> None:
        if time.monotonic() - began > PATIENCE:
            click.echo(f"etc-engine: {error} (rank {communicator.rank} alone)", err=True)
            communicator.abort(2)

    communicator.wait_for_all(impatient)


def _solve(
    ranks: Communicator,
    particles: Path,
    words: SampleWords,
    dumped: ContactWords,
    as_json: bool,
    full: bool,
    output: Path | None,
    vtk: Path | None,
    plot: Path | None,
    **given: Any,
) -> int:
    from etc_engine.cli.options import print_json
    from etc_engine.cli.solve_outputs import print_table
    from etc_engine.cli.solve_request import SolveRequest
    from etc_engine.medium.conduction import Conduction
    from etc_engine.realization.distributed import check_distributed, read_scattered

    clock = Clock()
    asked = SolveRequest(**given)
    asked.refuse_words()
    unheeded = {"-o": output, "--vtk": vtk, "--plot": plot, "--full": full, "--contacts": dumped.contacts}
    _refuse_unheeded({**unheeded, "--types": words.types, "--crop": words.crop}, asked)
    conduction = Conduction(asked.engine, asked.method or "chord", {"distributed": True})
    check_distributed(conduction, asked.rule, ranks)
    file = read_scattered(particles, words.sample(), ranks)
    if asked.conductivity is not None and file.conductivity is not None:
        raise InputError(f"{particles} has a conductivity column: leave --conductivity out, or take the column out")
    solid = asked.physics.solid() if asked.conductivity is None else asked.conductivity
    if solid is None and file.conductivity is None:
        solid = 1.0
    if ranks.rank == 0:
        for note in file.notes:
            click.echo(f"etc-engine: note: {note}", err=True)
    record = _record(ranks, asked, conduction, file, None if file.conductivity is not None else solid)
    record |= clock.record()
    if ranks.rank == 0:
        (print_json if as_json else print_table)(record)
    return 0


def _refuse_unheeded(given: dict[str, Any], asked: SolveRequest) -> None:
    """Refuse options that mean nothing here."""
    physics = asked.physics
    for name in ("gas", "emissivity", "roughness", "area_resistance", "wall_temperatures"):
        given[f"--{name.replace('_', '-')}"] = getattr(physics, name)
    given |= {"--pore-conductivity": asked.pore_conductivity, "--modes": asked.modes, "--degree": asked.degree}
    found = [name for name, value in {**given, "--bounds": asked.bounds}.items() if value]
    if found:
        raise InputError(f"{found[0]} is not taken with --distributed: leave it out, or solve on one rank")


def _record(
    ranks: Communicator, asked: SolveRequest, conduction: Conduction, file: ScatteredFile, conductivity: float | None
) -> dict[str, Any]:
    """What the ranks found, with the keys of ``solve`` on one rank."""
    from math import radians

    from etc_engine.cli.options import per_axis_and_tensor
    from etc_engine.cli.particle_options import warn
    from etc_engine.cli.solve_request import load_axes
    from etc_engine.durable.provenance import peak_bytes
    from etc_engine.medium.sample_warnings import excess_warnings, filling_warnings
    from etc_engine.realization import Status
    from etc_engine.realization.distributed import solve_scattered

    half_angle = None if asked.contact_angle is None else radians(asked.contact_angle)

    def contacts(packing: ParticlePacking) -> ContactNetwork:
        network = asked.physics.network(packing, half_angle, asked.bond_gap)
        return network.with_resistance(asked.contact_resistance)

    axes = load_axes(asked.axis, file.box)
    gap = asked.bond_gap if asked.takes_gap else 0.0
    result, census = solve_scattered(file, conductivity, contacts, replace(conduction, axes=axes), ranks, gap=gap)
    peaks = ranks.share(peak_bytes())
    axis = axes[0]
    if ranks.rank == 0:
        driven = [axis for axis in axes if not file.box.periodic[axis]]
        warn(filling_warnings(census.filling, file.box, file.origin, driven, gap))
        warn(excess_warnings(result.tensor, census.most_conductive, error=result.model_error))
        if census.doubt is not None:
            warn([census.doubt.sentence(gap, bonded=asked.takes_gap)])
    percolates = bool(result.spans[axis])
    status = Status.OK if percolates else Status.NOT_PERCOLATING
    record: dict[str, Any] = {
        "engine": asked.engine,
        "method": conduction.method,
        "conductivity": float(result.tensor[axis, axis]),
        **per_axis_and_tensor(result.tensor, axes),
    }
    record["model_error_estimate"] = result.model_error
    return record | {
        "particles": census.particles,
        "density": census.density,
        **({} if census.filling.fill_height is None else {"fill_height": census.filling.fill_height}),
        **({} if conductivity is None else {"particle_conductivity": float(conductivity)}),
        "pore_conductivity": 0.0,
        "contact_rule": asked.rule,
        **asked.physics.record,
        "contacts": census.contacts,
        "links": census.contacts,
        "wall_contacts": int(census.wall_contacts[axis]),
        "unknowns": result.unknowns,
        "percolates": percolates,
        "status": int(status),
        "status_name": status.name.lower(),
        "iterations": result.iterations,
        "relative_energy_error": result.relative_energy_error,
        "ranks": ranks.size,
        "largest_rank_megabytes": max(peaks) / 1e6,
    }
