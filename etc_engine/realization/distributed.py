"""One packing on many ranks, from its file to its conductivity: every rank reads its part and solves it with others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.box import Box
from etc_engine.engines.dtem.distributed.conductivity import Census, Scattered
from etc_engine.errors import InputError
from etc_engine.medium.conduction import Conduction
from etc_engine.medium.conductivity import EffectiveConductivity
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.rules import RULES, find_rule
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.parts import extremes, read_part
from etc_engine.particle_files.sample import Sample, sample_box
from etc_engine.ranks import Ranks, together
from etc_engine.realization.engines import find_engine
from etc_engine.solvers.petsc import load_petsc

Contacts = Callable[[ParticlePacking], ContactNetwork]


@dataclass(frozen=True, eq=False)
class ScatteredFile:
    """A packing in a file, of which each rank holds what it has read.

    Parameters
    ----------
    box : Box
    centers : ndarray, shape (n, d) [m]
        From the low corner of the box.
    radii : ndarray, shape (n,) [m]
    conductivity : ndarray, shape (n,) [W/(m K)], optional
        Of the file's column.
    notes : tuple of str
        What the reader decided, a sentence each; the same on every rank.
    """

    box: Box
    centers: Floats
    radii: Floats
    conductivity: Floats | None
    notes: tuple[str, ...]


def read_scattered(path: Path, sample: Sample, ranks: Ranks) -> ScatteredFile:
    """Read a particle file on all ranks, each its part; the box is found as `read_particles` finds it.

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
    return ScatteredFile(box, centers, rows.radii, rows.conductivity, (*rows.notes, *notes))


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
    particles = Scattered(file.box, file.centers, file.radii, given)
    return engine.distribute(particles, contacts, conduction, ranks, gap=gap)
