"""Run of a transient study of kind "network": particles, contacts, system, march, states on disk."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from etc_engine.box import parse_periodic
from etc_engine.durable.stop import Stopped, StopRequest
from etc_engine.errors import ConvergenceError, StudyError
from etc_engine.materials import find_solid
from etc_engine.medium.conditions import pores_at
from etc_engine.medium.local import LocalProperties, solid_law
from etc_engine.medium.medium import Medium
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.rules import find_rule
from etc_engine.medium.transient import HeatSource, ParticleSystem
from etc_engine.medium.walls import knots_of, value_at
from etc_engine.packing import ParticlePacking, pack
from etc_engine.particle_files.dumps import read_trajectory
from etc_engine.particle_files.formats import format_to_read, read_table
from etc_engine.particle_files.table import ParticleTable
from etc_engine.particle_files.trajectory import Trajectory
from etc_engine.realization import transient_system
from etc_engine.realization.media import contact_network
from etc_engine.solvers.marching import MarchState, march
from etc_engine.solvers.overflow import representable_numbers
from etc_engine.study.transient import FileTable, NetworkStudy, refuse_endless
from etc_engine.study.walls import plain
from etc_engine.transient.moving import MovingState, Stepping, ThermalExpansion, march_trajectory, named_frame
from etc_engine.transient.selection import conductivity_of, initial_of, part_of, rows_of
from etc_engine.transient.states import State, claimed_states, write_state

Progress = Callable[[float], None]
PLANAR_LEVEL = 300_000
"""Up to so many unknowns the steps of a network of disks are factorised: it pays from the third step on."""


@dataclass(frozen=True, eq=False)
class Transient:
    """What a transient study came to.

    Parameters
    ----------
    study : NetworkStudy
    network : ContactNetwork
        At the start.
    system : ParticleSystem
        At the start.
    states : list of MarchState, or of MovingState with [motion]
        One per output time; fewer if the run was stopped.
    times : ndarray [s]
        All output times.
    trajectory : Trajectory, optional
        With [motion].
    resumed : int
        How many of the states a former run had written.
    stopped : str
        The signal that ended the run, empty if it reached the end.
    tables : tuple of ParticleTable
        What was read of the particles: one, or with [motion] one per frame.
    """

    study: NetworkStudy
    network: ContactNetwork
    system: ParticleSystem
    states: Sequence[State]
    times: NDArray[np.float64]
    trajectory: Trajectory | None = None
    resumed: int = 0
    stopped: str = ""
    tables: tuple[ParticleTable, ...] = ()


@dataclass(frozen=True, eq=False)
class _Course:
    """A study made ready: its states, and the march from the start or from one of them."""

    network: ContactNetwork
    system: ParticleSystem
    times: NDArray[np.float64]
    march: Callable[[State | None], Iterator[State]]
    kind: type[MarchState] | type[MovingState]
    trajectory: Trajectory | None = None
    tables: tuple[ParticleTable, ...] = ()


@representable_numbers()
def run_transient(
    study: NetworkStudy,
    folder: Path,
    output: Path | None = None,
    *,
    resume: bool = False,
    progress: Progress | None = None,
) -> Transient:
    """Solve a transient study.

    Parameters
    ----------
    study : NetworkStudy
    folder : Path
        Of the study file: its particle file is relative to it.
    output : Path, optional
        The file that is to be written; its states are kept beside it, for `resume`.
    resume : bool
        Whether to continue from the last state that a former run has written; the bits are the same.
    progress : callable, optional
        Called with the fraction of the time span that is done.

    Returns
    -------
    Transient

    Raises
    ------
    InputError, GeometryError, PackingError, ConvergenceError, OutputError
    """
    course = (_still if study.motion is None else _moving)(study, folder, progress)
    made = Transient(study, course.network, course.system, [], course.times, course.trajectory, tables=course.tables)
    if output is None:
        return replace(made, states=[_finite(state) for state in course.march(None)])
    with (
        claimed_states(output, _digest(study, course), course.kind, resume=resume) as (place, found),
        StopRequest() as stop,
    ):
        states, resumed = found, len(found)
        if resumed < course.times.size:
            marching = course.march(states[-1] if states else None)
            try:
                while len(states) < course.times.size:
                    states.append(_finite(stop.run(lambda: next(marching))))
                    write_state(place, len(states) - 1, states[-1])
            except Stopped:
                return replace(made, states=states, resumed=resumed, stopped=stop.reason)
        return replace(made, states=states, resumed=resumed)


def _finite(state: State) -> State:
    """The state, refused if a heat of it is beyond all numbers."""
    if not np.isfinite(state.imbalance):
        raise ConvergenceError(f"the heat is no longer finite at t = {state.time:g} s: check the values of the study")
    return state


def _still(study: NetworkStudy, folder: Path, progress: Progress | None) -> _Course:
    """One packing, marched over the output times."""
    table = _particles(study, folder)
    network = _contacts(study, table.packing)
    system = _physics(study, table).system(network)
    initial = system.initial(initial_of(study, table))
    time = study.time

    def marched(restart: State | None) -> Iterator[State]:
        assert not isinstance(restart, MovingState)
        return march(
            system.heat,
            initial,
            time.times,
            scheme=time.scheme,
            step=time.step,
            steps=time.steps,
            tolerance=time.tolerance,
            exact_level=PLANAR_LEVEL,
            restart=restart,
            progress=_fraction(progress, time.times[0], time.times[-1]),
        )

    return _Course(network, system, np.array(time.times), marched, MarchState, tables=(table,))


def _moving(study: NetworkStudy, folder: Path, progress: Progress | None) -> _Course:
    """All frames of a dump, each with separate contacts."""
    motion, time, file = study.motion, study.time, study.packing
    assert motion is not None
    assert isinstance(file, FileTable)
    path = folder / file.files
    if not path.exists():
        raise StudyError(f"packing.files: there is no file {path}")
    trajectory = read_trajectory(path, motion.timestep, part_of(file))
    first = trajectory.packings[0]
    if trajectory.times.size < 2:
        raise StudyError(f"motion: {path} holds one frame, so there is nothing to march: remove [motion]")
    if first.box.periodic != parse_periodic(file.periodic or first.box.periodic_axes, first.dimension):
        raise StudyError(f"packing.files: expected a box periodic along {file.periodic!r}, found {first.box}")
    physics = _physics(study, trajectory.tables[0])

    told = _fraction(progress, trajectory.times[0], trajectory.times[-1])

    def contacts(packing: ParticlePacking) -> ContactNetwork:
        return _contacts(study, packing)

    def marched(restart: State | None) -> Iterator[State]:
        assert not isinstance(restart, MarchState)
        return march_trajectory(
            trajectory,
            contacts,
            physics.system,
            initial_of(study, trajectory.tables[0]),
            heat_capacity=np.asarray(study.particles.heat_capacity, dtype=np.float64),
            expansion=ThermalExpansion(motion.expansion, motion.reference) if motion.expansion else None,
            stepping=Stepping(time.scheme, time.steps or 1, time.tolerance, progress=told),
            restart=restart,
        )

    refuse_endless(time, trajectory.times)
    with named_frame(trajectory, 0):
        network = contacts(first)
        system = physics.system(network)
    return _Course(network, system, trajectory.times, marched, MovingState, trajectory, trajectory.tables)


@dataclass(frozen=True, eq=False)
class _Physics:
    """What a study says about the particles, besides their contacts, and the system that follows."""

    study: NetworkStudy
    conductivity: ArrayLike
    source: Callable[[float], NDArray[np.float64]]
    temperature: float | None = None

    def system(self, network: ContactNetwork, capacities: NDArray[np.float64] | None = None) -> ParticleSystem:
        """The system of a contact network, with given heat capacities of the particles or the study's."""
        conduction = self.study.conduction
        heat_capacity = np.asarray(self.study.particles.heat_capacity, dtype=np.float64)
        conditions = self.study.conditions(self.temperature)
        pores = replace(
            pores_at(conditions, network.packing, self.study.pores.conductivity),
            heat_capacity=self.study.pores.heat_capacity,
        )
        medium = Medium(network.packing, np.asarray(self.conductivity), network, pores, heat_capacity)
        if conduction.nonlinear:
            every = np.ones(network.packing.count, dtype=np.bool_)
            named = find_solid(self.study.particles.material).conductivity if self.study.particles.material else None
            law = solid_law(medium.conductivity, () if named is None else ((every, named),))
            local = LocalProperties(network.packing, conditions, law, self.study.pores.conductivity)
            medium = replace(medium, local=local)
        return transient_system(
            medium,
            self.study.walls.conditions(),
            engine=conduction.engine,
            method=conduction.method_for(medium.dimension, pores.conduct),
            source=self.source,
            capacities=capacities,
            **({"dipoles": True} if conduction.dipoles else {}),
        )


def _physics(study: NetworkStudy, table: ParticleTable) -> _Physics:
    temperature = study.conduction.temperature
    if study.conduction.nonlinear:
        initial = np.asarray(initial_of(study, table), dtype=np.float64)
        if not initial.min() > 0.0:
            raise StudyError(
                f"particles.initial: found {initial.min():g} K, nonlinear = true takes absolute temperatures"
            )
        temperature = float(initial.mean())
    return _Physics(study, conductivity_of(study, table, temperature), _source(study, table), temperature)


def _fraction(progress: Progress | None, begin: float, end: float) -> Progress | None:
    """A progress function of the time instead of the fraction that is done."""
    if progress is None:
        return None
    tell = progress
    return lambda t: tell((t - begin) / (end - begin))


def _particles(study: NetworkStudy, folder: Path) -> ParticleTable:
    """The packing, and the columns of its file."""
    words = study.packing
    if isinstance(words, FileTable):
        path = folder / words.files
        if not path.exists():
            raise StudyError(f"packing.files: there is no file {path}")
        if words.box is None and not format_to_read(path).brings_box:
            raise StudyError(f"packing.box: {words.files} has none, give its edge lengths")
        return read_table(path, frame=None if words.frames == "last" else words.frames, sample=part_of(words))
    spec = words.spec(words.density, radius_growth=find_rule(study.contacts.rule).radii_may_grow)
    return ParticleTable(pack(spec, np.random.default_rng(study.seed)))


def _contacts(study: NetworkStudy, packing: ParticlePacking) -> ContactNetwork:
    return contact_network(packing, study.contacts.rule, study.contacts.values())


def _source(study: NetworkStudy, table: ParticleTable) -> HeatSource:
    """Heat released in each particle at a time; sources on one particle add up."""
    parts, count = [], table.packing.count
    for k, source in enumerate(study.source):
        rows = rows_of(source, table, f"source.{k}")
        parts.append((np.bincount(rows, minlength=count).astype(np.float64), plain(source.heat)))

    def heat(t: float) -> NDArray[np.float64]:
        return sum((share * value_at(value, t) for share, value in parts), np.zeros(count))

    return HeatSource(heat, tuple(sorted({knot for _, value in parts for knot in knots_of(value)})))


def _digest(study: NetworkStudy, course: _Course) -> str:
    """Of the study, of the particles it found and of what conducts between them."""
    whole = hashlib.sha256(study.digest().encode())
    packings = [course.network.packing] if course.trajectory is None else course.trajectory.packings
    box = packings[0].box
    arrays = [box.lengths, box.periodic, course.times, course.system.heat.conductance.data]
    arrays += [values for packing in packings for values in (packing.centers, packing.radii)]
    if study.particles.initial == "file":
        arrays += [table.temperature for table in course.tables[:1] if table.temperature is not None]
    for values in arrays:
        whole.update(np.asarray(values, dtype=np.float64).tobytes())
    return whole.hexdigest()
