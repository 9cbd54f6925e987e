"""One packing on many ranks, from its file to its conductivity: every rank reads its part and solves it with others."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.box import Box
from etc_engine.engines.dtem.distributed.conductivity import Census, Scattered
from etc_engine.errors import ConvergenceError, EtcError, InputError
from etc_engine.medium.conduction import Conduction
from etc_engine.medium.conductivity import EffectiveConductivity
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.rules import RULES, find_rule
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.collection import PackingSource
from etc_engine.particle_files.digits import PrintedColumns
from etc_engine.particle_files.parts import extremes, read_part
from etc_engine.particle_files.sample import Sample, sample_box
from etc_engine.ranks import Ranks, together
from etc_engine.realization.engines import find_engine
from etc_engine.realization.media import contact_network
from etc_engine.realization.outcome import Outcome, Realization, Status
from etc_engine.realization.specification import RealizationSpec
from etc_engine.solvers.petsc import load_petsc

Contacts = Callable[[ParticlePacking], ContactNetwork]


@dataclass(frozen=True, eq=False)
class ScatteredFile:
    """A packing in a file, of which each rank holds a part.

    Parameters
    ----------
    box : Box
    centers : ndarray, shape (n, d) [m]
        From the low corner of the box.
    radii : ndarray, shape (n,) [m]
    conductivity : ndarray, shape (n,) [W/(m K)], optional
        Of the file's column.
    origin : tuple of float [m]
        Low corner of the box in the coordinates of the file.
    printed : PrintedColumns, optional
        How finely the numbers are printed in a text file.
    notes : tuple of str
        What the reader decided, a sentence each; the same on every rank.
    """

    box: Box
    centers: Floats
    radii: Floats
    conductivity: Floats | None
    origin: tuple[float, ...]
    printed: PrintedColumns | None
    notes: tuple[str, ...]


def read_scattered(path: Path, sample: Sample, ranks: Ranks) -> ScatteredFile:
    """Read a particle file on all ranks, each its part; the box is found as `read_table` finds it.

    Parameters
    ----------
    path : Path
    sample : Sample
        Without a crop.
    ranks : Ranks
        Every rank makes this call.

    Raises
    ------
    InputError
        On every rank.
    """
    if sample.crop:
        raise InputError("a packing on many ranks takes no crop: write the part that is wanted to a file of its own")
    rows = read_part(path, sample, ranks)
    ends = extremes(rows, ranks)
    bounds, periodic, notes = together(ranks, lambda: sample_box(ends, sample))
    box = Box(tuple((bounds[:, 1] - bounds[:, 0]).tolist()), periodic)
    centers = rows.positions[:, : len(bounds)] - bounds[:, 0]
    origin, printed = tuple(bounds[:, 0].tolist()), ranks.share(rows.printed)[0]
    return ScatteredFile(box, centers, rows.radii, rows.conductivity, origin, printed, (*rows.notes, *notes))


def check_distributed(conduction: Conduction, rule: str, ranks: Ranks) -> None:
    """Refuse, before anything is read, what many ranks do not solve together.

    Parameters
    ----------
    conduction : Conduction
        Its option ``distributed`` is true.
    rule : str
        Word of the contact rule; a contact may depend on its two particles alone.
    ranks : Ranks
        Every rank makes this call.

    Raises
    ------
    InputError
        On every rank, also where PETSc is missing.
    """
    find_engine(conduction.engine).resolve(conduction.method, conduction.options)
    if not find_rule(rule).local:
        able = ", ".join(name for name, row in RULES.items() if row.local)
        raise InputError(f"the contact rule {rule} needs the whole packing: on many ranks use {able}")
    load_petsc(ranks)


def solve_scattered(
    file: ScatteredFile,
    conductivity: float | None,
    contacts: Contacts,
    conduction: Conduction,
    ranks: Ranks,
    *,
    gap: float = 0.0,
) -> tuple[EffectiveConductivity[Any], Census]:
    """Effective conductivity of a packing that many ranks hold.

    Parameters
    ----------
    file : ScatteredFile
    conductivity : float or None [W/(m K)]
        Of all particles; None for the column of the file.
    contacts, gap
        A local contact rule and its largest gap, as of `distributed_conductivity`.
    conduction : Conduction
        Its option ``distributed`` is true.
    ranks : Ranks
        Every rank makes this call.

    Raises
    ------
    InputError, GeometryError, ConvergenceError
        On every rank.
    """
    engine = find_engine(conduction.engine)
    dimension = file.box.dimension
    if dimension not in engine.find_method(conduction.method).dimensions or engine.distribute is None:
        raise InputError(f"method {conduction.method} of engine {engine.name} does not work in {dimension}D on ranks")
    given = file.conductivity if conductivity is None else np.full(file.radii.size, conductivity)
    if given is None:
        raise InputError("the particles have no column of conductivities: give them one")
    particles = Scattered(file.box, file.centers, file.radii, given, file.origin, file.printed)
    return engine.distribute(particles, contacts, conduction, ranks, gap=gap)


def realize_together(spec: RealizationSpec, ranks: Ranks) -> Realization:
    """One realization of packings in files, every medium solved by all ranks together.

    Parameters
    ----------
    spec : RealizationSpec
        Of method ``chord`` with the option ``distributed``, and a local contact rule.
    ranks : Ranks
        Every rank makes this call.

    Returns
    -------
    Realization
        The same on every rank. Its solid fraction is NaN, which takes the whole packing; so is the mean field of its
        cells.

    Raises
    ------
    InputError
        On every rank, where PETSc is missing.
    """
    source, conduction = spec.packing, spec.conduction[0]
    if not isinstance(source, PackingSource):
        raise InputError("packings that ranks solve together are read from files")
    check_distributed(conduction, spec.rule, ranks)
    start, count = time.perf_counter(), math.prod(spec.shape)
    try:
        together(ranks, lambda: source.check() if ranks.rank == 0 else None)
        chosen = together(ranks, lambda: source.chosen() if ranks.rank == 0 else source.sample)
        file = read_scattered(source.path, ranks.share(chosen)[0], ranks)
    except InputError as error:
        failed = Outcome(Status.PACKING_FAILED, str(error))
        return Realization(0, np.nan, np.nan, time.perf_counter() - start, (failed,) * count)
    seconds = time.perf_counter() - start
    solved = [_cell(file, spec, values, ranks) for values in spec.combinations()]
    censuses = [census for _, census in solved if census is not None]
    particles, density = (censuses[0].particles, censuses[0].density) if censuses else (0, np.nan)
    return Realization(particles, density, np.nan, seconds, tuple(outcome for outcome, _ in solved))


def _cell(
    file: ScatteredFile, spec: RealizationSpec, values: dict[str, float], ranks: Ranks
) -> tuple[Outcome, Census | None]:
    """The outcome of one medium; an error is one that every rank has."""
    start = time.perf_counter()
    gap = values.get("bond_gap", 0.0) if "bond_gap" in find_rule(spec.rule).keys else 0.0
    try:
        result, census = solve_scattered(
            file,
            None if file.conductivity is not None else values["particle_conductivity"],
            lambda packing: contact_network(packing, spec.rule, values),
            spec.conduction[0],
            ranks,
            gap=gap,
        )
    except ConvergenceError as error:
        return Outcome(Status.NOT_CONVERGED, str(error)), None
    except EtcError as error:
        return Outcome(Status.ERROR, str(error)), None
    missing = result.missing_axes
    outcome = Outcome(
        status=Status.NOT_PERCOLATING if missing else Status.OK,
        message=f"no path of contacts along {missing}" if missing else "",
        conductivity=result.tensor,
        contacts=census.contacts,
        wall_contacts=int(census.wall_contacts.sum()),
        coordination=2.0 * census.contacts / census.particles,
        unknowns=result.unknowns,
        iterations=result.iterations,
        relative_energy_error=result.relative_energy_error,
        solve_seconds=time.perf_counter() - start,
        model_error_estimate=result.model_error,
        solved_by="full",
    )
    return outcome, census
