"""Run of a transient study of kind "network": particles, contacts, system, march, states on disk."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from etc_engine.batch.stop import Stopped, StopRequest
from etc_engine.box import Box, parse_periodic
from etc_engine.contacts import ContactNetwork, bonded_contacts, coordination_contacts, overlap_contacts
from etc_engine.errors import StudyError
from etc_engine.packing import PackingSpec, ParticlePacking, pack, parse_radii
from etc_engine.packing.formats import format_to_read, read_particles
from etc_engine.solvers.marching import MarchState, march
from etc_engine.transient.states import claimed_states, write_state
from etc_engine.transient.study import Gradient, NetworkStudy, plain
from etc_engine.transient.systems import SYSTEMS, ParticleSystem, Physics
from etc_engine.walls import value_at


@dataclass(frozen=True, eq=False)
class Transient:
    """What a transient study came to.

    Parameters
    ----------
    study : NetworkStudy
    network : ContactNetwork
    system : ParticleSystem
    states : list of MarchState
        One an output time; fewer if the run was stopped.
    resumed : int
        How many of them a former run had written.
    stopped : str
        The signal that ended the run, empty if it reached the end.
    """

    study: NetworkStudy
    network: ContactNetwork
    system: ParticleSystem
    states: list[MarchState]
    resumed: int = 0
    stopped: str = ""


def prepare(study: NetworkStudy, folder: Path) -> tuple[ContactNetwork, ParticleSystem, NDArray[np.float64]]:
    """Contact network, system and initial unknowns of a study.

    Parameters
    ----------
    study : NetworkStudy
    folder : Path
        Where the study file lies: its particle file is relative to it.

    Raises
    ------
    InputError, GeometryError, PackingError
    """
    packing, column = _particles(study, folder)
    network = _contacts(study, packing)
    given = study.conduction.conductivity
    if given is not None and column is not None:
        raise StudyError(f"conduction.conductivity: {study.particles} has a column of that name, take one of them out")
    physics = Physics(
        conductivity=column if column is not None else 1.0 if given is None else given,
        heat_capacity=np.asarray(study.material.heat_capacity, dtype=np.float64),
        contact_resistance=study.conduction.contact_resistance,
        walls=study.walls.conditions(),
        source=_source(study, packing.count),
        pipe_resistance=study.conduction.pipe_resistance or "chord",
        dipoles=study.conduction.dipoles,
    )
    system = SYSTEMS[study.conduction.method](network, physics)
    initial = study.material.initial
    if isinstance(initial, Gradient):
        return network, system, system.initial(initial.value + packing.centers @ np.array(initial.gradient))
    return network, system, system.initial(initial)


def run_transient(
    study: NetworkStudy,
    folder: Path,
    output: Path | None = None,
    *,
    resume: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Transient:
    """Solve a transient study.

    Parameters
    ----------
    study : NetworkStudy
    folder : Path
        Where the study file lies.
    output : Path, optional
        The file that is to be written; its states are kept beside it, for `resume`.
    resume : bool
        Whether to go on from the last state that a former run has written: it gives the same bits.
    progress : callable, optional
        Told the fraction of the time span that is done.

    Returns
    -------
    Transient

    Raises
    ------
    InputError, GeometryError, PackingError, ConvergenceError, OutputError
    """
    network, system, initial = prepare(study, folder)
    if output is None:
        return Transient(study, network, system, list(_march(study, system, initial, None, progress)))
    with (
        claimed_states(output, _digest(study, network, system), resume=resume) as (place, states),
        StopRequest() as stop,
    ):
        resumed, total = len(states), len(study.time.times)
        if resumed < total:
            marching = _march(study, system, initial, states[-1] if states else None, progress)
            try:
                while len(states) < total:
                    states.append(stop.run(lambda: next(marching)))
                    write_state(place, len(states) - 1, states[-1])
            except Stopped:
                return Transient(study, network, system, states, resumed, stop.reason)
        return Transient(study, network, system, states, resumed)


def _march(
    study: NetworkStudy,
    system: ParticleSystem,
    initial: NDArray[np.float64],
    restart: MarchState | None,
    progress: Callable[[float], None] | None,
) -> Iterator[MarchState]:
    time = study.time
    begin, end = time.times[0], time.times[-1]

    def told(t: float) -> None:
        if progress is not None:
            progress((t - begin) / (end - begin))

    return march(
        system.heat,
        initial,
        time.times,
        scheme=time.scheme,
        step=time.step,
        steps=time.steps,
        tolerance=time.tolerance,
        restart=restart,
        progress=told,
    )


def _particles(study: NetworkStudy, folder: Path) -> tuple[ParticlePacking, NDArray[np.float64] | None]:
    """The packing, and the conductivity of each particle where its file gives it."""
    if study.particles is not None:
        path = folder / study.particles
        if not path.exists():
            raise StudyError(f"particles: there is no file {path}")
        box = None if study.box is None else Box(study.box, parse_periodic(study.periodic or "", 2))
        if box is None and not format_to_read(path).brings_box:
            raise StudyError(f"box: {study.particles} has none, give its edge lengths")
        table = read_particles(path, box, study.frame)
        return table.packing, table.conductivity
    words = study.packing
    assert words is not None
    spec = PackingSpec(
        method=words.method,
        radii=parse_radii(words.radii),
        box=Box(words.box, parse_periodic(words.periodic, 2)),
        count=words.count,
        density=None if words.density is None else words.density[0],
        growth_rate=words.growth_rate,
        radius_growth=study.contacts.rule == "overlap",
    )
    return pack(spec, np.random.default_rng(study.seed)), None


def _contacts(study: NetworkStudy, packing: ParticlePacking) -> ContactNetwork:
    words = study.contacts
    if words.contact_angle is None:
        return overlap_contacts(packing)
    half_angle = float(np.radians(words.contact_angle[0]))
    if words.rule == "coordination":
        return coordination_contacts(packing, half_angle, words.coordination or np.nan)
    return bonded_contacts(packing, half_angle, words.bond_gap)


def _source(study: NetworkStudy, count: int) -> Callable[[float], NDArray[np.float64]]:
    """Heat set free in each particle at a time; sources on one particle add up."""
    parts = []
    for k, source in enumerate(study.source):
        rows = np.arange(count) if source.particles is None else np.array(source.particles, dtype=np.int64)
        if rows.size and rows.max() >= count:
            raise StudyError(f"source.{k}: there is no particle {rows.max()}, the last one is {count - 1}")
        parts.append((np.bincount(rows, minlength=count).astype(np.float64), plain(source.heat)))

    def heat(t: float) -> NDArray[np.float64]:
        return sum((share * value_at(value, t) for share, value in parts), np.zeros(count))

    return heat


def _digest(study: NetworkStudy, network: ContactNetwork, system: ParticleSystem) -> str:
    """Of the study, of the particles it found and of what conducts between them."""
    whole = hashlib.sha256(study.digest().encode())
    packing = network.packing
    for values in (
        packing.centers,
        packing.radii,
        packing.box.lengths,
        packing.box.periodic,
        system.heat.conductance.data,
    ):
        whole.update(np.asarray(values, dtype=np.float64).tobytes())
    return whole.hexdigest()
