"""What a transient study says of particles by their row, their id or their type, and what their file says of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from etc_engine.errors import StudyError
from etc_engine.materials import find_solid
from etc_engine.particle_files.sample import Sample
from etc_engine.particle_files.table import ParticleTable
from etc_engine.study.file_packings import sample_of
from etc_engine.study.transient import FileTable, Gradient, NetworkStudy, Source


def part_of(words: FileTable) -> Sample:
    """The part of a particle file that a study asks for.

    Raises
    ------
    InputError
    """
    return sample_of({**words.model_dump(), "file_box": words.box, "file_periodic": words.periodic})


def rows_of(source: Source, table: ParticleTable, place: str) -> NDArray[np.int64]:
    """Rows of the particles of a source, given by rows, ids or types; all by default.

    Parameters
    ----------
    source : Source
    table : ParticleTable
    place : str
        Of the source in the study, for messages.

    Raises
    ------
    StudyError
        If a particle is not there, or the file has no ids or types.
    """
    count = table.packing.count
    if source.ids is not None:
        return _rows_of_ids(source.ids, table, place)
    if source.types is not None:
        return _rows_of_types([str(word) for word in source.types], table, place)
    rows = np.arange(count) if source.particles is None else np.array(source.particles, dtype=np.int64)
    if rows.size and rows.max() >= count:
        raise StudyError(f"{place}: there is no particle {rows.max()}, the last one is {count - 1}")
    return rows


def conductivity_of(study: NetworkStudy, table: ParticleTable, temperature: float | None = None) -> ArrayLike:
    """Conductivity of all particles, or of each by its type or the column of its file [W/(m K)].

    Parameters
    ----------
    study : NetworkStudy
    table : ParticleTable
    temperature : float, optional [K]
        Of a material by name.

    Raises
    ------
    StudyError
    """
    particles = study.particles
    given = "conductivity" in particles.model_fields_set
    if particles.material is not None:
        if particles.types is not None or table.conductivity is not None:
            what = "particles.types" if particles.types is not None else "a column 'conductivity' of the file"
            raise StudyError(f"particles.material: {what} sets the conductivity too; remove one of them")
        assert temperature is not None
        return find_solid(particles.material).conductivity.at(temperature)
    if particles.types is not None:
        if given or table.conductivity is not None:
            what = "particles.conductivity" if given else "a column 'conductivity' of the file"
            raise StudyError(f"particles.types: {what} sets the conductivity too; remove one of them")
        if table.types is None:
            raise StudyError("particles.types: the particles have no column of types")
        known = {str(word): value for word, value in particles.types.items()}
        missing = sorted(set(table.types.tolist()) - set(known))
        if missing:
            raise StudyError(f"particles.types: the particles have the type {missing[0]} too, give its conductivity")
        return np.array([known[word] for word in table.types.tolist()])
    if table.conductivity is None:
        return particles.conductivity
    if given:
        raise StudyError("particles.conductivity: the particle file has a column of that name; remove one of them")
    return table.conductivity


def initial_of(study: NetworkStudy, table: ParticleTable) -> ArrayLike:
    """Temperatures at the start: the study's, or those of the file [K].

    Raises
    ------
    StudyError
        If the file has none.
    """
    initial = study.particles.initial
    if initial == "file":
        if table.temperature is None:
            raise StudyError("particles.initial: the file has no column of temperatures (temperature, f_Temp[0])")
        return table.temperature
    if isinstance(initial, Gradient):
        d = table.packing.dimension
        if len(initial.gradient) != d:
            raise StudyError(f"particles.initial.gradient: expected {d} numbers, found {len(initial.gradient)}")
        return np.asarray(initial.value + table.packing.centers @ np.array(initial.gradient))
    return initial  # a number or a list


def _rows_of_ids(ids: list[int], table: ParticleTable, place: str) -> NDArray[np.int64]:
    if table.ids is None:
        raise StudyError(f"{place}.ids: the particles have no ids, give their rows in particles")
    order = np.argsort(table.ids, kind="stable")
    ranked = table.ids[order]
    found = np.minimum(np.searchsorted(ranked, ids), ranked.size - 1)
    for number, at in zip(ids, found.tolist(), strict=True):
        if ranked[at] != number:
            raise StudyError(f"{place}.ids: there is no particle with the id {number}")
        if at + 1 < ranked.size and ranked[at + 1] == number:
            raise StudyError(f"{place}.ids: the id {number} belongs to several particles")
    return np.asarray(order[found])


def _rows_of_types(types: list[str], table: ParticleTable, place: str) -> NDArray[np.int64]:
    if table.types is None:
        raise StudyError(f"{place}.types: the particles have no column of types")
    missing = sorted(set(types) - set(table.types.tolist()))
    if missing:
        raise StudyError(f"{place}.types: no particle is of the type {missing[0]}")
    return np.flatnonzero(np.isin(table.types, types))
