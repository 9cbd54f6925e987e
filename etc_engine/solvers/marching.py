r"""Marching in time: C dT/dt = f(t) - K T with K sparse, symmetric and positive semi-definite.

Nodes without capacity make it a differential-algebraic system of index 1. Implicit schemes solve r C + K at every
step, with one preconditioner (a factorisation or a multigrid hierarchy) for each length of the step. Every scheme
integrates the heat flows with its own quadrature, so that the heat stored is the heat that came in, to round-off
of the balance and whatever the tolerance of the solver.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.linalg import eigvalsh
from scipy.sparse.linalg import LinearOperator, eigsh

from etc_engine.arrays import Floats
from etc_engine.errors import ConvergenceError, InputError
from etc_engine.solvers import time_steps
from etc_engine.solvers.amg_cg import EXACT_LEVEL
from etc_engine.solvers.step_matrix import StepMatrix, step_matrix
from etc_engine.solvers.time_steps import NONLINEAR, AlgebraicRows, HeatSystem, Step, algebraic_rows

__all__ = ["NONLINEAR", "SCHEMES", "HeatSystem", "MarchState", "critical_step", "gershgorin_step", "march"]

SCHEMES = ("explicit-euler", "backward-euler", "crank-nicolson", "bdf2", "adaptive")

# r h of the matrix r C + K of a step h
RATES = {
    "backward-euler": 1.0,
    "crank-nicolson": 2.0,
    "bdf2": 1.5,
    "adaptive": 1.0 / time_steps.TR_BDF2_D,
}
# preconditioners kept at a time, one for each length of the step
KEPT = 4
# an adaptive step is an output interval halved so many times at most
MOST_HALVINGS = 40
# below this many nodes the critical step is taken from the dense matrix
DENSE = 300


@dataclass(frozen=True, eq=False)
class MarchState:
    """Temperatures at an output time, and what a restart from there needs to give the same bits.

    Parameters
    ----------
    time : float [s]
    temperatures : ndarray, shape (n,) [K]
    heat : ndarray, shape (k,) [J]
        Heat flows of `HeatSystem.heat_rates` integrated since the start.
    stored : float [J]
        1 . C (T - T_initial); equal to the sum of ``heat``.
    steps, iterations : int
        Taken since the start; iterations of the linear solver include those of steps that were not accepted.
    step : float [s]
        Length of the last step, or of the next one where the step adapts; 0 at the start.
    older : ndarray, shape (n,) [K]
        Temperatures one step before, which ``bdf2`` needs.
    last_heat : ndarray, shape (k,) [J]
        Heat flows integrated over the last step.
    """

    time: float
    temperatures: Floats
    heat: Floats
    stored: float
    steps: int
    iterations: int
    step: float
    older: Floats
    last_heat: Floats

    @property
    def imbalance(self) -> float:
        """Heat stored less heat that came in [J]."""
        return self.stored - float(self.heat.sum())


def march(
    system: HeatSystem,
    initial: Floats,
    times: Sequence[float] | Floats,
    *,
    scheme: str = "bdf2",
    step: float | None = None,
    steps: int | None = None,
    tolerance: float = 1e-3,
    solver_tolerance: float = 1e-10,
    exact_level: int = EXACT_LEVEL,
    restart: MarchState | None = None,
    progress: Callable[[float], None] | None = None,
) -> Iterator[MarchState]:
    """Temperatures at the output times, one after the other.

    C dT/dt = f(t) - K T,   T(times[0]) = initial

    Parameters
    ----------
    system : HeatSystem
    initial : ndarray, shape (n,) [K]
        Values at nodes without capacity are replaced by those that fit the others.
    times : sequence of float [s]
        Increasing; the first one is the time of the initial values and comes out first.
    scheme : str
        A name of `SCHEMES`.
    step : float, optional [s]
        Largest step; each output interval is divided into equal ones, between the knots of the system. For
        ``adaptive``, the first step to try.
    steps : int, optional
        Steps of each output interval, instead of ``step``; a knot inside may add some.
    tolerance : float [K]
        Largest estimated error of an ``adaptive`` step at any node.
    solver_tolerance : float
        Largest error of the temperatures left by the linear solver, relative to their magnitude.
    exact_level : int
        Most nodes of a step matrix that is factorised instead of being given a multigrid hierarchy. A factorisation
        takes longer and solves faster: many steps of a planar network pay for it far beyond the default.
    restart : MarchState, optional
        A state at one of the times, to go on from; all other arguments are those of the start.
    progress : callable, optional
        Called with the time after every step.

    Yields
    ------
    MarchState

    Raises
    ------
    InputError
        If the arguments are not understood, the temperature of a node without capacity is undetermined, or an
        explicit step exceeds the critical one.
    ConvergenceError

    Notes
    -----
    ``explicit-euler``
        Order 1, stable up to `critical_step`.
    ``backward-euler``
        Order 1, L-stable; keeps the maximum principle where K is an M-matrix.
    ``crank-nicolson``
        Order 2. Its first step is two backward-Euler half steps (of the same matrix), which damp what initial values
        excite and the scheme would let alternate.
    ``bdf2``
        Order 2, L-stable, of constant step; begun by `time_steps.sdirk2` wherever the step changes.
    A system whose conductance follows the temperature (`HeatSystem.at`)
        ``backward-euler`` and ``bdf2``, each step by Picard iteration until no temperature changes by 1e-6 K; ``bdf2``
        is begun by backward Euler then.
    ``adaptive``
        `time_steps.tr_bdf2`, order 2, L-stable; the step is the output interval halved k times, so that few matrices
        are needed.

    Examples
    --------
    >>> from scipy.sparse import csr_matrix
    >>> cooling = HeatSystem(np.ones(1), csr_matrix([[1.0]]), lambda t: np.zeros(1))
    >>> *_, last = march(cooling, np.ones(1), [0.0, 1.0], steps=100)
    >>> bool(abs(last.temperatures[0] - np.exp(-1.0)) < 2e-5), round(last.stored, 3), round(float(last.heat[0]), 3)
    (True, -0.632, -0.632)
    """
    times = _checked(system, initial, times, scheme, step, steps, tolerance, restart)
    start = np.asarray(initial, dtype=np.float64)
    first = system if system.at is None else system.at(times[0], start)
    algebraic = algebraic_rows(first, solver_tolerance)
    fitted = algebraic.fit(first, times[0], start)
    run = _Run(system, scheme, fitted, algebraic, solver_tolerance, tolerance, exact_level, progress, OrderedDict())
    if restart is None:
        none = np.zeros_like(first.rates(times[0], fitted))
        state = MarchState(times[0], fitted, none, 0.0, 0, 0, 0.0, fitted, none)
        yield state
    else:
        state = restart
    for low, high in pairwise(times):
        if low < state.time:
            continue
        longest = (high - low) / steps if steps is not None else float(step or 1.0)
        for begin, end in pairwise(_split_at_knots(system.knots, low, high)):
            if scheme == "adaptive":
                state = _adapt(run, state, begin, end, step)
                continue
            if begin in system.knots:  # what came before does not continue: begin anew
                state = replace(state, step=0.0)
            count = int(np.ceil((end - begin) / longest * (1.0 - 1e-12)))
            state = _divide(run, state, begin, end, max(count, 1))
        yield state


def _split_at_knots(knots: Sequence[float], low: float, high: float) -> list[float]:
    """Ends of an output interval with the knots inside, those closer than round-off to one before left out."""
    least = 1e-12 * (high - low)
    ends = [low]
    for knot in sorted(knots):
        if ends[-1] + least < knot < high - least:
            ends.append(float(knot))
    return [*ends, high]


@dataclass(frozen=True, eq=False)
class _Run:
    """What stays the same over a march; ``matrices`` holds the last few step matrices by their rate."""

    system: HeatSystem
    scheme: str
    initial: Floats
    algebraic: AlgebraicRows
    solver_tolerance: float
    tolerance: float
    exact_level: int
    progress: Callable[[float], None] | None
    matrices: OrderedDict[float, StepMatrix]

    def matrix(self, h: float) -> StepMatrix:
        rate = RATES[self.scheme] / h
        if rate not in self.matrices:
            if len(self.matrices) == KEPT:
                self.matrices.popitem(last=False)
            self.matrices[rate] = step_matrix(
                self.system.conductance,
                self.system.capacity,
                rate,
                self.solver_tolerance,
                exact_level=self.exact_level,
            )
        self.matrices.move_to_end(rate)
        return self.matrices[rate]

    def advance(self, state: MarchState, t: float, h: float, taken: Step) -> MarchState:
        if not np.isfinite(taken.temperatures).all():
            raise ConvergenceError(f"the temperatures are no longer finite at t = {t:g} s: check the sources and walls")
        if self.progress is not None:
            self.progress(t)
        return MarchState(
            t,
            taken.temperatures,
            state.heat + taken.heat,
            float(self.system.capacity @ (taken.temperatures - self.initial)),
            state.steps + 1,
            state.iterations + taken.iterations,
            h,
            state.temperatures,
            taken.heat,
        )


def _divide(run: _Run, state: MarchState, low: float, high: float, count: int) -> MarchState:
    """March over an output interval in equal steps."""
    h = _rounded((high - low) / count)
    if run.scheme == "explicit-euler":
        _refuse_beyond_critical(run.system, h)
    step = _step if run.system.at is None else _follow
    for k in range(count):
        t = low + k * (high - low) / count
        end = high if k == count - 1 else low + (k + 1) * (high - low) / count
        state = run.advance(state, end, h, step(run, state, t, h))
    return state


def _step(run: _Run, state: MarchState, t: float, h: float) -> Step:
    """One step of a scheme of constant step."""
    system, old = run.system, state.temperatures
    if run.scheme == "explicit-euler":
        return time_steps.explicit_euler(system, run.algebraic, t, h, old)
    matrix = run.matrix(h)
    if run.scheme == "backward-euler":
        return time_steps.backward_euler(system, matrix, t, h, old)
    if run.scheme == "crank-nicolson" and state.steps > 0:
        return time_steps.crank_nicolson(system, matrix, t, h, old)
    if run.scheme == "crank-nicolson":
        first = time_steps.backward_euler(system, matrix, t, 0.5 * h, old)
        second = time_steps.backward_euler(system, matrix, t + 0.5 * h, 0.5 * h, first.temperatures)
        return Step(second.temperatures, first.heat + second.heat, first.iterations + second.iterations)
    if state.step == h:
        return time_steps.bdf2(system, matrix, t, h, old, state.older, state.last_heat)
    starter = step_matrix(
        system.conductance, system.capacity, 1.0 / (time_steps.SDIRK_GAMMA * h), run.solver_tolerance, matrix
    )
    return time_steps.sdirk2(system, starter, t, h, old)


def _follow(run: _Run, state: MarchState, t: float, h: float) -> Step:
    """One step of a system whose conductance follows the temperature; the first of a length is backward Euler."""
    again = state.step == h
    older = state.older if again and run.scheme == "bdf2" else None
    guess = 2.0 * state.temperatures - state.older if again else state.temperatures
    return time_steps.nonlinear_step(
        run.system,
        (t, h),
        (state.temperatures, older, state.last_heat),
        guess,
        solver_tolerance=run.solver_tolerance,
        exact_level=run.exact_level,
    )


def _adapt(run: _Run, state: MarchState, low: float, high: float, first: float | None) -> MarchState:
    """March over an output interval in steps that are the interval halved ``level`` times, position by position."""
    whole = high - low
    wanted = state.step or first or _first_step(run, low, state)
    level = 0 if wanted >= whole else min(int(np.ceil(np.log2(whole / wanted) - 1e-9)), MOST_HALVINGS)
    position = 0
    while position < 2**level:
        h = _rounded(whole / 2**level)
        t = low + whole * (position / 2**level)
        taken = time_steps.tr_bdf2(run.system, run.matrix(h), t, h, state.temperatures)
        if not taken.error <= run.tolerance:
            if not np.isfinite(taken.error) or level == MOST_HALVINGS:
                raise ConvergenceError(
                    f"the step fell to {h:.3g} s at t = {t:g} s and still errs by {taken.error:.2e} K (wanted "
                    f"{run.tolerance:.2e}): check the sources and walls, or ask for a larger tolerance"
                )
            halvings = int(np.ceil(np.log2(2.0 * taken.error / run.tolerance) / 3.0))
            halvings = min(max(halvings, 1), MOST_HALVINGS - level)
            level, position = level + halvings, position * 2**halvings
            state = replace(state, iterations=state.iterations + taken.iterations)
            continue
        position += 1
        ended = position == 2**level
        state = run.advance(state, high if ended else low + whole * (position / 2**level), h, taken)
        if level > 0 and position % 2 == 0 and 16.0 * taken.error <= run.tolerance:  # order 3: 8 times the error
            level, position = level - 1, position // 2
        if ended:  # the next interval may be longer: what this error would allow, at most twice as much
            growth = 2.0 if 16.0 * taken.error <= run.tolerance else 1.0
            state = replace(state, step=growth * h)
            break
    return state


def _first_step(run: _Run, t: float, state: MarchState) -> float:
    """Time in which the initial slope changes no temperature by more than the tolerance."""
    stores = run.system.stores
    slope = run.system.slope(t, state.temperatures)[stores] / run.system.capacity[stores]
    fastest = float(np.abs(slope).max(initial=0.0))
    return run.tolerance / fastest if fastest > 0.0 else np.inf


def _rounded(h: float) -> float:
    """A step to 12 digits: intervals that differ by round-off share one matrix, on a restart too."""
    return float(f"{h:.12g}")


def _refuse_beyond_critical(system: HeatSystem, h: float) -> None:
    if h <= gershgorin_step(system):
        return
    critical = critical_step(system)
    if h > critical * (1.0 + 1e-9):
        raise InputError(
            f"the explicit step of {h:.6g} s exceeds the critical one of {critical:.6g} s: take a smaller step or an "
            f"implicit scheme"
        )


def gershgorin_step(system: HeatSystem) -> float:
    """A lower bound of `critical_step` from the row sums of C^-1 |K| [s]."""
    stores = system.stores
    rows = np.asarray(abs(system.conductance).sum(axis=1)).ravel()[stores]
    fastest = float((rows / system.capacity[stores]).max(initial=0.0))
    return 2.0 / fastest if fastest > 0.0 else np.inf


def critical_step(system: HeatSystem) -> float:
    """Largest stable step of explicit Euler, 2 / lambda_max(C^-1 S), in seconds.

    Parameters
    ----------
    system : HeatSystem

    Returns
    -------
    float [s]
        Infinite if nothing conducts.

    Notes
    -----
    S = K_dd - K_da K_aa^-1 K_ad is what is left of K when the nodes without capacity are eliminated. Its largest
    eigenvalue comes from a dense matrix or from a Lanczos iteration to 1e-8.

    Examples
    --------
    >>> from scipy.sparse import csr_matrix
    >>> pair = HeatSystem(np.ones(2), csr_matrix([[1.0, -1.0], [-1.0, 1.0]]), lambda t: np.zeros(2))
    >>> critical_step(pair), gershgorin_step(pair)
    (1.0, 1.0)
    """
    stores = np.flatnonzero(system.stores)
    if stores.size == 0:
        return np.inf
    scale = 1.0 / np.sqrt(system.capacity[stores])
    inner = HeatSystem(system.capacity, system.conductance, lambda _: np.zeros(system.capacity.size))
    algebraic = algebraic_rows(inner, 1e-12)

    def apply(x: Floats) -> Floats:
        full = np.zeros(system.capacity.size)
        full[stores] = scale * x.ravel()
        return np.asarray(scale * (system.conductance @ algebraic.fit(inner, 0.0, full))[stores])

    if stores.size <= DENSE:
        dense = np.stack([apply(column) for column in np.eye(stores.size)])
        largest = float(eigvalsh(0.5 * (dense + dense.T))[-1])
    else:
        operator = LinearOperator((stores.size, stores.size), matvec=apply, dtype=np.float64)
        rough = np.cos(2.5 * np.arange(stores.size))  # no random state; nothing like a smooth temperature
        largest = float(eigsh(operator, k=1, which="LA", tol=1e-8, v0=rough, return_eigenvectors=False)[0])
    return 2.0 / largest if largest > 0.0 else np.inf


def _checked(
    system: HeatSystem,
    initial: Floats,
    times: Sequence[float] | Floats,
    scheme: str,
    step: float | None,
    steps: int | None,
    tolerance: float,
    restart: MarchState | None,
) -> list[float]:
    """The output times as floats, all arguments refused that `march` cannot work with."""
    if scheme not in SCHEMES:
        raise InputError(f"unknown scheme {scheme!r}: expected one of {', '.join(SCHEMES)}")
    if system.at is not None and scheme not in NONLINEAR:
        raise InputError(
            f"conductances that follow the temperature take the scheme {' or '.join(NONLINEAR)}, found {scheme!r}"
        )
    instants = [float(t) for t in times]
    if len(instants) < 2 or not np.isfinite(instants).all() or not (np.diff(instants) > 0.0).all():
        raise InputError(f"at least two finite, increasing output times are needed, found {instants[:8]}")
    values = np.asarray(initial, dtype=np.float64)
    if values.shape != system.capacity.shape or not np.isfinite(values).all():
        raise InputError(
            f"the initial temperatures must be finite and of shape {system.capacity.shape}, found {values.shape}"
        )
    if scheme == "adaptive":
        if steps is not None:
            raise InputError("an adaptive march chooses its steps: give a tolerance instead of their number")
    elif (step is None) == (steps is None):
        raise InputError(f"the scheme {scheme} needs either a step [s] or a number of steps of each output interval")
    for name, value in (("step", step), ("number of steps", steps), ("tolerance", tolerance)):
        if value is not None and not (np.isfinite(value) and value > 0.0):
            raise InputError(f"the {name} must be positive and finite, found {value:g}")
    if restart is not None and restart.time not in instants:
        raise InputError(f"a restart at t = {restart.time:g} s does not meet any of the output times")
    return instants
