r"""Single steps in time of C dT/dt = f(t) - K T, each with the quadrature of the heat flows that it conserves.

Rows without capacity are algebraic, 0 = f - K T, and hold at the end of every stage. Summed over the nodes, a step
stores what its own quadrature of 1 . (f - K T) gives; so does any set of heat flows that add up to it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.errors import ConvergenceError, InputError
from etc_engine.solvers.amg_cg import EXACT_LEVEL
from etc_engine.solvers.step_matrix import StepMatrix, step_matrix

# schemes of one implicit stage, which take a conductance that follows the temperature
NONLINEAR = ("backward-euler", "bdf2")
# largest change of a temperature in the last iteration of such a step [K]
PICARD = 1e-6
MOST_PICARD = 60
# stages of the two L-stable one-step schemes of order 2
SDIRK_GAMMA = 1.0 - np.sqrt(0.5)
TR_BDF2_GAMMA = 2.0 - np.sqrt(2.0)
TR_BDF2_D = 1.0 - np.sqrt(0.5)
TR_BDF2_W = 0.25 * np.sqrt(2.0)
# b - b_hat, the weights less those of the embedded scheme of order 3
TR_BDF2_ERROR = np.array(
    [TR_BDF2_W - (1.0 - TR_BDF2_W) / 3.0, TR_BDF2_W - (3.0 * TR_BDF2_W + 1.0) / 3.0, 2.0 * TR_BDF2_D / 3.0]
)


@dataclass(frozen=True, eq=False)
class HeatSystem:
    """Nodes that store heat and conductances between them, C dT/dt = f(t) - K T.

    Parameters
    ----------
    capacity : ndarray, shape (n,) [J/K]
        Zero where a node stores nothing: its row is algebraic.
    conductance : csr_matrix, shape (n, n) [W/K]
        Symmetric positive semi-definite; links to prescribed temperatures are included on the diagonal.
    load : callable
        t -> f(t), shape (n,) [W]: sources, and links times their prescribed temperatures.
    heat_rates : callable, optional
        (t, T) -> heat flows into the system, shape (k,) [W], say at each wall and from the sources. They should add
        up to 1 . (f - K T), which is the one flow taken by default.
    source : callable, optional
        t -> part of f(t) that is set free at nodes with a capacity, shape (n,) [W]. The last heat rate is its sum.
        Schemes of order 1 take it in the middle of a step, so that they too integrate exactly what is linear in time.
    knots : tuple of float [s]
        Times at which f has a kink or jumps: no step reaches across one.
    at : callable, optional
        (t, T) -> the system with K, f and the heat rates of these temperatures, of the same capacity and nodes. K and f
        above then belong to one temperature, and only schemes of `NONLINEAR` march the system.

    Raises
    ------
    InputError
        If the shapes do not fit, or a capacity is negative or not finite.
    """

    capacity: Floats
    conductance: csr_matrix
    load: Callable[[float], Floats]
    heat_rates: Callable[[float, Floats], Floats] | None = None
    source: Callable[[float], Floats] | None = None
    knots: tuple[float, ...] = ()
    at: Callable[[float, Floats], HeatSystem] | None = None

    def __post_init__(self) -> None:
        n = self.capacity.size
        if self.capacity.shape != (n,) or self.conductance.shape != (n, n):
            raise InputError(
                f"a heat system of n nodes needs a capacity of shape (n,) and a conductance of shape (n, n), found "
                f"{self.capacity.shape} and {self.conductance.shape}"
            )
        if not (np.isfinite(self.capacity).all() and (self.capacity >= 0.0).all()):
            bad = int(np.flatnonzero(~(np.isfinite(self.capacity) & (self.capacity >= 0.0)))[0])
            raise InputError(f"heat capacities must be >= 0 and finite, found {self.capacity[bad]:g} at node {bad}")

    @property
    def stores(self) -> Flags:
        """Nodes with a heat capacity."""
        return np.asarray(self.capacity > 0.0)

    def slope(self, t: float, temperatures: Floats) -> Floats:
        """C dT/dt [W]; zero at the nodes without capacity, whose temperatures must fit."""
        return np.where(self.stores, self.load(t) - self.conductance @ temperatures, 0.0)

    def rates(self, t: float, temperatures: Floats) -> Floats:
        """Heat flows into the system [W], at its local properties where they follow the temperature."""
        if self.at is not None:
            return self.at(t, temperatures).rates(t, temperatures)
        if self.heat_rates is None:
            return np.array([(self.load(t) - self.conductance @ temperatures).sum()])
        return np.asarray(self.heat_rates(t, temperatures), dtype=np.float64)


def _centred(system: HeatSystem, at: float, middle: float, rates: Floats) -> tuple[Floats | float, Floats]:
    """What the source in the middle of a step adds to the load at a time of it, and the heat rates with it."""
    if system.source is None:
        return 0.0, rates
    change = system.source(middle) - system.source(at)
    centred = rates.copy()
    centred[-1] += change.sum()
    return change, centred


@dataclass(frozen=True, eq=False)
class Step:
    """What one step in time gives.

    Parameters
    ----------
    temperatures : ndarray, shape (n,) [K]
        At the end of the step.
    heat : ndarray, shape (k,) [J]
        Heat flows integrated over it.
    iterations : int
    error : float [K]
        Largest estimated error of the temperatures; NaN where the scheme has no estimate.
    """

    temperatures: Floats
    heat: Floats
    iterations: int
    error: float = np.nan


@dataclass(frozen=True, eq=False)
class AlgebraicRows:
    """The block 0 = f_a - K_ad T_d - K_aa T_a of the nodes without capacity, ready to be solved.

    Parameters
    ----------
    rows : ndarray of int, shape (a,)
    inner : StepMatrix
        K_aa.
    """

    rows: Ints
    inner: StepMatrix

    def fit(self, system: HeatSystem, t: float, temperatures: Floats) -> Floats:
        """The temperatures with those of the nodes without capacity replaced by what the others make of them."""
        fitted = temperatures.copy()
        if self.rows.size:
            fitted[self.rows] = 0.0
            rhs = (system.load(t) - system.conductance @ fitted)[self.rows]
            fitted[self.rows], _ = self.inner.solve(rhs, temperatures[self.rows])
        return fitted


def algebraic_rows(system: HeatSystem, tolerance: float) -> AlgebraicRows:
    """The nodes of a system that store nothing.

    Raises
    ------
    InputError
        If their temperatures are not determined by the other nodes.
    """
    rows = np.flatnonzero(~system.stores)
    # where every node stores heat, a stand-in that is never solved
    block = csr_matrix(system.conductance[rows][:, rows]) if rows.size else csr_matrix([[1.0]])
    return AlgebraicRows(rows, step_matrix(block, np.zeros(block.shape[0]), 0.0, tolerance))


def explicit_euler(system: HeatSystem, algebraic: AlgebraicRows, t: float, h: float, old: Floats) -> Step:
    """C (T' - T) = h (f - K T), the algebraic rows solved at the end; flows by the rectangle at the start.

    The source is taken in the middle.
    """
    stores = system.stores
    change, rates = _centred(system, t, t + 0.5 * h, system.rates(t, old))
    new = old.copy()
    new[stores] += h * (system.slope(t, old) + change)[stores] / system.capacity[stores]
    return Step(algebraic.fit(system, t + h, new), h * rates, int(algebraic.rows.size > 0))


def backward_euler(system: HeatSystem, matrix: StepMatrix, t: float, h: float, old: Floats) -> Step:
    """(C/h + K) T' = C/h T + f(t + h); flows by the rectangle at the end. The matrix has the rate 1/h.

    The source is taken in the middle.
    """
    change, _ = _centred(system, t + h, t + 0.5 * h, np.zeros(1))
    new, iterations = matrix.solve(system.capacity * old * matrix.rate + system.load(t + h) + change, old)
    _, rates = _centred(system, t + h, t + 0.5 * h, system.rates(t + h, new))
    return Step(new, h * rates, iterations)


def crank_nicolson(system: HeatSystem, matrix: StepMatrix, t: float, h: float, old: Floats) -> Step:
    """(2 C/h + K) T' = (2 C/h - K) T + f(t) + f(t + h); flows by the trapezium. The matrix has the rate 2/h.

    Algebraic rows hold at the end of the step instead of on average, so that nothing of them alternates.
    """
    rhs = system.capacity * old * matrix.rate + system.slope(t, old) + system.load(t + h)
    new, iterations = matrix.solve(rhs, old)
    return Step(new, 0.5 * h * (system.rates(t, old) + system.rates(t + h, new)), iterations)


def bdf2(
    system: HeatSystem, matrix: StepMatrix, t: float, h: float, old: Floats, older: Floats, last_heat: Floats
) -> Step:
    """(3 C/2h + K) T' = C (4 T - T_older)/2h + f(t + h). The matrix has the rate 3/2h.

    The flows follow the same recursion, dI' = (dI + 2 h q')/3 with dI the integral over the step before.
    """
    rhs = system.capacity * (old + (old - older) / 3.0) * matrix.rate + system.load(t + h)
    new, iterations = matrix.solve(rhs, 2.0 * old - older)
    return Step(new, (last_heat + 2.0 * h * system.rates(t + h, new)) / 3.0, iterations)


def sdirk2(system: HeatSystem, matrix: StepMatrix, t: float, h: float, old: Floats) -> Step:
    """Alexander's L-stable, stiffly accurate scheme of order 2, the starter of `bdf2`.

    With g = 1 - 1/sqrt(2): C (Y - T) = h g F(t + g h, Y), C (T' - T) = h [(1 - g) F(Y) + g F(t + h, T')]. The matrix
    has the rate 1/(g h).

    References
    ----------
    Alexander 1977, Diagonally implicit Runge-Kutta methods for stiff O.D.E.'s, doi:10.1137/0714068.
    """
    gamma = SDIRK_GAMMA
    inner, first = matrix.solve(system.capacity * old * matrix.rate + system.load(t + gamma * h), old)
    begun = old + (1.0 - gamma) / gamma * (inner - old)
    new, second = matrix.solve(system.capacity * begun * matrix.rate + system.load(t + h), inner)
    heat = (1.0 - gamma) * h * system.rates(t + gamma * h, inner) + gamma * h * system.rates(t + h, new)
    return Step(new, heat, first + second)


def tr_bdf2(system: HeatSystem, matrix: StepMatrix, t: float, h: float, old: Floats) -> Step:
    """Trapezium to t + (2 - sqrt 2) h, then BDF2: L-stable, of order 2, with an estimate of its error.

    The estimate is the difference from an embedded scheme of order 3, smoothed by (1 + d h K)^-1 so that stiff
    components do not enter it. The matrix has the rate 1/(d h), d = 1 - 1/sqrt(2), for both stages and the smoothing.

    References
    ----------
    Hosea, Shampine 1996, Analysis and implementation of TR-BDF2, doi:10.1016/0168-9274(95)00115-8.
    """
    w, d, c, rate = TR_BDF2_W, TR_BDF2_D, system.capacity, matrix.rate
    middle = t + TR_BDF2_GAMMA * h
    slope = system.slope(t, old)
    inner, first = matrix.solve(c * old * rate + slope + system.load(middle), old)
    inner_slope = system.slope(middle, inner)
    rhs = c * old * rate + w / d * (slope + inner_slope) + system.load(t + h)
    new, second = matrix.solve(rhs, inner)
    e = TR_BDF2_ERROR / d
    difference = e[0] * slope + e[1] * inner_slope + e[2] * system.slope(t + h, new)
    error, third = matrix.solve(difference, np.zeros_like(old))
    heat = h * (w * (system.rates(t, old) + system.rates(middle, inner)) + d * system.rates(t + h, new))
    return Step(new, heat, first + second + third, float(np.abs(error).max(initial=0.0)))


def nonlinear_step(
    system: HeatSystem,
    span: tuple[float, float],
    before: tuple[Floats, Floats | None, Floats],
    guess: Floats,
    *,
    solver_tolerance: float,
    exact_level: int = EXACT_LEVEL,
) -> Step:
    """One step of C dT/dt = f(t, T) - K(T) T with K and f of its end, by Picard iteration to `PICARD` K.

    `bdf2` where the temperatures one step before are known, otherwise `backward_euler`; the heat flows are those of the
    same K and f, so that the heat balances whatever is left of the iteration.

    Parameters
    ----------
    system : HeatSystem
        With ``at``.
    span : (float, float) [s]
        Start and length of the step.
    before : (ndarray, ndarray or None, ndarray)
        Temperatures at the start and one step before it, and the heat flows integrated over that step.
    guess : ndarray, shape (n,) [K]
        Temperatures at the end, about.
    solver_tolerance, exact_level
        As in `etc_engine.solvers.marching.march`.

    Raises
    ------
    ConvergenceError
        If a temperature still changes after `MOST_PICARD` iterations.
    """
    assert system.at is not None
    (t, h), (old, older, last_heat) = span, before
    rate = (1.0 if older is None else 1.5) / h
    found, spent, change = guess, 0, np.inf
    for _ in range(MOST_PICARD):
        local = system.at(t + h, found)
        matrix = step_matrix(local.conductance, local.capacity, rate, solver_tolerance, exact_level=exact_level)
        if older is None:
            taken = backward_euler(local, matrix, t, h, old)
        else:
            taken = bdf2(local, matrix, t, h, old, older, last_heat)
        change = float(np.abs(taken.temperatures - found).max())
        found, spent = taken.temperatures, spent + taken.iterations
        if change < PICARD:
            return replace(taken, iterations=spent)
    raise ConvergenceError(
        f"after {MOST_PICARD} iterations of the step to t = {t + h:g} s a temperature still changes by {change:.3g} K: "
        "take smaller steps"
    )
