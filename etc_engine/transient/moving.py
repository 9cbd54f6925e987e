r"""Heat in particles that move: a trajectory drives a changing contact network, temperatures are carried along.

From the time of each frame to that of the next, the contacts are those of the frame. The heat capacity of a particle
stays what it is, whatever its contacts cut off at a time: C_i = rho c V_i with the full disk of the first frame. So a
contact that opens or closes changes no heat, and

    sum_i C_i (T_i - T_i(0)) = heat through the walls + heat from the sources

holds to round-off over any number of frames.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from etc_engine.errors import EtcError, InputError
from etc_engine.medium.medium import per_particle
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.transient import ParticleSystem
from etc_engine.packing.particles import ParticlePacking, particle_values
from etc_engine.particle_files.trajectory import Trajectory
from etc_engine.solvers.marching import MarchState, march

Build = Callable[[ContactNetwork, NDArray[np.float64]], ParticleSystem]
"""(network, heat capacity of each particle [J/(m K)]) -> system; walls, materials and sources are the builder's.
"""


@dataclass(frozen=True)
class ThermalExpansion:
    """Radii that follow the temperatures, R = R_frame (1 + a (T - T_ref)).

    Parameters
    ----------
    coefficient : float [1/K]
        Linear expansion a.
    reference : float [K]
        Temperature at which the radii are those of the trajectory.
    """

    coefficient: float
    reference: float = 0.0

    def apply(self, packing: ParticlePacking, temperatures: NDArray[np.float64]) -> ParticlePacking:
        """The packing at these temperatures.

        Raises
        ------
        InputError
            If a radius would not be positive.
        """
        factors = 1.0 + self.coefficient * (temperatures - self.reference)
        if not (factors > 0.0).all():
            first = int(np.argmin(factors))
            raise InputError(
                f"an expansion of {self.coefficient:g} per kelvin leaves particle {first} no radius at "
                f"{temperatures[first]:g} K: take a smaller coefficient"
            )
        return packing.with_radii(packing.radii * factors)


@dataclass(frozen=True, eq=False)
class MovingState:
    """The particles at the time of a frame.

    Parameters
    ----------
    frame : int
    time : float [s]
    temperatures : ndarray, shape (n,) [K]
        Mean temperature of each particle.
    radii : ndarray, shape (n,) [m]
        Of the contacts from here on, thermal expansion included.
    rates : ndarray, shape (k,) [W/m]
        Heat flows of the system (walls, sources), with the contacts up to here.
    heat : ndarray, shape (k,) [J/m]
        The same integrated since the first frame.
    stored : float [J/m]
        sum_i C_i (T_i - T_i(0)); equal to the sum of ``heat``.
    contacts, opened, closed : int
        Contacts between particles from here on; how many of the frame before are gone, and how many are new.
    steps, iterations : int
        Since the first frame.
    """

    frame: int
    time: float
    temperatures: NDArray[np.float64]
    radii: NDArray[np.float64]
    rates: NDArray[np.float64]
    heat: NDArray[np.float64]
    stored: float
    contacts: int
    opened: int
    closed: int
    steps: int
    iterations: int

    @property
    def imbalance(self) -> float:
        """Heat stored less heat that came in [J/m]."""
        return self.stored - float(self.heat.sum())


@contextmanager
def named_frame(trajectory: Trajectory, frame: int) -> Iterator[None]:
    """Errors of the engine in the block begin with the frame and its time.

    Examples
    --------
    >>> from etc_engine import Box
    >>> still = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0)))
    >>> with named_frame(Trajectory([0.0, 2.0], [still, still]), 1):
    ...     raise InputError("the wall is bare")
    Traceback (most recent call last):
    etc_engine.errors.InputError: frame 1 (t = 2 s): the wall is bare
    """
    try:
        yield
    except EtcError as error:  # the same error, with whatever else it holds
        error.args = (f"frame {frame} (t = {trajectory.times[frame]:g} s): {error}", *error.args[1:])
        raise


@dataclass(frozen=True)
class Stepping:
    """How the time between two frames is stepped.

    Parameters
    ----------
    scheme : str
        A name of `etc_engine.solvers.marching.SCHEMES`.
    steps : int
        Steps from frame to frame; ``adaptive`` chooses them.
    tolerance, solver_tolerance : float
        As in `etc_engine.solvers.marching.march`.
    progress : callable, optional
        Called with the time after every step.
    """

    scheme: str = "bdf2"
    steps: int = 4
    tolerance: float = 1e-3
    solver_tolerance: float = 1e-10
    progress: Callable[[float], None] | None = None

    def march(self, system: ParticleSystem, temperatures: NDArray[np.float64], low: float, high: float) -> MarchState:
        """The state of a system at the end of an interval."""
        *_, ended = march(
            system.heat,
            system.initial(temperatures),
            [low, high],
            scheme=self.scheme,
            steps=None if self.scheme == "adaptive" else self.steps,
            tolerance=self.tolerance,
            solver_tolerance=self.solver_tolerance,
            progress=self.progress,
        )
        return ended


DEFAULT_STEPPING = Stepping()


def march_trajectory(
    trajectory: Trajectory,
    contacts: Callable[[ParticlePacking], ContactNetwork],
    build: Build,
    initial: ArrayLike,
    *,
    heat_capacity: ArrayLike = 1.0,
    expansion: ThermalExpansion | None = None,
    stepping: Stepping = DEFAULT_STEPPING,
    restart: MovingState | None = None,
) -> Iterator[MovingState]:
    """Temperatures of moving particles at the time of every frame.

    Parameters
    ----------
    trajectory : Trajectory
        Of disks or spheres.
    contacts : callable
        packing -> contact network, such as `etc_engine.medium.network.overlap_contacts`.
    build : callable
        (network, capacities) -> system of that network.
    initial : float or array_like, shape (n,) [K]
        Temperatures at the first frame.
    heat_capacity : float or array_like, shape (n,) [J/(m3 K)]
        rho c of all particles, or of each.
    expansion : ThermalExpansion, optional
    stepping : Stepping
    restart : MovingState, optional
        A state of the same run, to continue from; the other arguments are still those of the start.

    Yields
    ------
    MovingState
        At every frame, the first included.

    Raises
    ------
    InputError, GeometryError, ConvergenceError
        The message begins with the frame.

    Notes
    -----
    Only mean temperatures are carried from frame to frame: dipole states start from zero at each, for how a disk turns
    is not known.

    Examples
    --------
    Two disks of different temperature that part after the first interval:

    >>> from etc_engine import Box
    >>> from etc_engine.medium.rules import overlap_contacts
    >>> from etc_engine.engines.pipe.transient import pipe_system
    >>> from etc_engine.medium.medium import Medium
    >>> box = Box((4.0, 1.0))
    >>> disks = [ParticlePacking([[1.0, 0.5], [x, 0.5]], [0.3, 0.3], box) for x in (1.55, 2.5, 2.5)]
    >>> def pipes(network, capacities):
    ...     return pipe_system(Medium(network.packing, 1.0, network), {}, capacities=capacities)
    >>> states = list(march_trajectory(Trajectory([0.0, 0.1, 9.0], disks), overlap_contacts, pipes, [1.0, 0.0]))
    >>> [state.contacts for state in states], bool(states[1].temperatures[1] > 0.1)
    ([1, 0, 0], True)
    >>> bool((states[2].temperatures == states[1].temperatures).all())
    True
    """
    first = trajectory.packings[0]
    capacities = first.measures * per_particle(heat_capacity, first.count, "heat capacity")
    start = particle_values(initial, first.count, "initial temperature")

    def made(frame: int, temperatures: NDArray[np.float64]) -> tuple[ContactNetwork, ParticleSystem]:
        with named_frame(trajectory, frame):
            packing = trajectory.packings[frame]
            network = contacts(packing if expansion is None else expansion.apply(packing, temperatures))
            return network, build(network, capacities)

    network, system = made(0, start)
    rates = system.heat.rates(trajectory.times[0], system.initial(start))
    none = np.zeros_like(rates)
    state = MovingState(
        0, float(trajectory.times[0]), start, network.packing.radii, rates, none, 0.0, network.count, 0, 0, 0, 0
    )
    if restart is None:
        yield state
    else:
        state = restart
        network, system = made(state.frame, state.temperatures)
    for frame, (low, high) in enumerate(pairwise(trajectory.times)):
        if frame < state.frame:
            continue
        with named_frame(trajectory, frame):
            ended = stepping.march(system, state.temperatures, low, high)
        temperatures = system.particle_temperatures(ended.temperatures)
        rates = system.heat.rates(high, ended.temperatures)
        before = network
        network, system = made(frame + 1, temperatures)
        opened, closed = _changes(before, network)
        state = MovingState(
            frame + 1,
            float(high),
            temperatures,
            network.packing.radii,
            rates,
            state.heat + ended.heat,
            float(capacities @ (temperatures - start)),
            network.count,
            opened,
            closed,
            state.steps + ended.steps,
            state.iterations + ended.iterations,
        )
        yield state


def _changes(before: ContactNetwork, after: ContactNetwork) -> tuple[int, int]:
    """Pairs that are gone, and pairs that are new."""
    n = before.packing.count
    old, new = (np.unique(network.pairs[:, 0] * n + network.pairs[:, 1]) for network in (before, after))
    return int(np.setdiff1d(old, new).size), int(np.setdiff1d(new, old).size)
