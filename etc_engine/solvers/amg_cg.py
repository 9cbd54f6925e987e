r"""Conjugate gradients with an algebraic multigrid preconditioner, stopped on the error of the energy.

The conductivity is an energy, E = E_lift - b . u, so the iterate u_k overestimates it by exactly
|u - u_k|_K^2: the error that matters is quadratic in the error of the temperatures. CG knows it. With
step lengths gamma_k, rho_k = r_k . M^-1 r_k, delta_k = rho_k / rho_{k-1} and 0 < mu <= lambda_min(M^-1 K),
the Gauss-Radau rule bounds it from above (Meurant and Tichy 2013):

    |u - u_k|_K^2 <= g_k rho_k,   g_0 = 1/mu,   g_{k+1} = (g_k - gamma_k) / (mu (g_k - gamma_k) + delta_{k+1}).

mu is taken as half the smallest Ritz value of the iteration, which makes the bound an estimate: a Ritz
value can only overestimate lambda_min.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigvalsh_tridiagonal
from scipy.sparse import csc_matrix, csr_matrix
from scipy.sparse.linalg import splu

from etc_engine.arrays import Floats
from etc_engine.errors import ConvergenceError
from etc_engine.solvers.aggregation import aggregation_hierarchy
from etc_engine.solvers.summation import dot

# Below this many unknowns one sparse factorisation is faster than a multigrid hierarchy.
EXACT_LEVEL = 20_000

# A matrix of at most so many unknowns is factorised where multigrid stalls: some GB for spheres.
LAST_RESORT = 200_000

# An energy below this part of the lift's is round-off of zero; errors are then relative to this.
ROUND_OFF = 1e-13

# An imbalance of the heat flows below this part of the flux is round-off.
BALANCED = 1e-13


@dataclass(frozen=True, eq=False)
class Preconditioner:
    """A symmetric positive definite approximation of K^-1 that can serve several right-hand sides.

    Parameters
    ----------
    apply : callable
        Residual in, correction out.
    levels : int
        Levels of the hierarchy; 1 is a sparse factorisation.
    seconds : float
        Time of the set-up.
    """

    apply: Callable[[Floats], Floats]
    levels: int
    seconds: float


@dataclass(frozen=True)
class SolveReport:
    """Cost and accuracy of one solve.

    Parameters
    ----------
    unknowns, levels, iterations : int
    relative_energy_error : float
        Gauss-Radau estimate of |u - u_k|_K^2 / E, the relative error of the conductivity.
    relative_residual : float
        |r| / |b|.
    imbalance : float
        Heat that enters and does not leave, relative to the flux.
    setup_seconds, solve_seconds : float
    smallest_ritz : float
        Smallest Ritz value of M^-1 K, never below its smallest eigenvalue; NaN without iterations.
    """

    unknowns: int
    levels: int
    iterations: int
    relative_energy_error: float
    relative_residual: float
    imbalance: float
    setup_seconds: float
    solve_seconds: float
    smallest_ritz: float = np.nan


@dataclass(frozen=True)
class Limits:
    """What ends a solve, besides its tolerance.

    Parameters
    ----------
    balance_tolerance : float
        Largest imbalance |w . r| relative to the energy.
    max_iterations : int
    spectral_floor : float, optional
        A mu <= lambda_min(M^-1 K) that is known; the smaller of it and of half the smallest Ritz value counts.
    """

    balance_tolerance: float = 1e-6
    max_iterations: int = 300
    spectral_floor: float | None = None


DEFAULT_LIMITS = Limits()
NO_SOLVE = SolveReport(0, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""The report of a system without unknowns."""


def build_preconditioner(matrix: csr_matrix, exact_level: int = EXACT_LEVEL) -> Preconditioner:
    """Hierarchy for `solve_energy`: smoothed aggregation, or one factorised level if the matrix is small.

    Parameters
    ----------
    matrix : csr_matrix, shape (n, n)
        Symmetric positive definite.
    exact_level : int
        Largest matrix (and coarsest level) that is factorised.

    Returns
    -------
    Preconditioner

    Notes
    -----
    Nothing draws on a random state, so two builds agree bit for bit; see `aggregation_hierarchy`.
    """
    start = time.perf_counter()
    if matrix.shape[0] <= exact_level:
        apply, levels = _factorise(matrix), 1
    else:
        hierarchy = aggregation_hierarchy(matrix)
        apply, levels = hierarchy.apply, len(hierarchy)
    return Preconditioner(apply, levels, time.perf_counter() - start)


def _factorise(matrix: csr_matrix) -> Callable[[Floats], Floats]:
    factor = splu(
        csc_matrix(matrix),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    return lambda residual: np.asarray(factor.solve(residual))


def solve_energy(
    matrix: csr_matrix,
    rhs: Floats,
    lift_energy: float,
    *,
    preconditioner: Preconditioner | None = None,
    initial: Floats | None = None,
    tolerance: float = 1e-10,
    conserved: Floats | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> tuple[Floats, SolveReport]:
    """Solve K u = b until the energy E = lift_energy - b . u is known to a relative tolerance.

    Parameters
    ----------
    matrix : csr_matrix, shape (n, n)
        Symmetric positive definite.
    rhs : ndarray, shape (n,)
    lift_energy : float
        Energy of the prescribed part of the solution.
    preconditioner : Preconditioner, optional
        Built here when not given.
    initial : ndarray, shape (n,), optional
        Starting guess, zero by default.
    tolerance : float
        Stop when the estimate of |u - u_k|_K^2 is at most ``tolerance * E`` (E at least 1e-13 of the lift's) and the
        imbalance |w . r| at most ``limits.balance_tolerance * E``; what is left of it is then taken away by the
        Galerkin correction u + s w, which can only lower the energy error.
    conserved : ndarray, shape (n,), optional
        The vector w of a uniform temperature, all ones by default: w . r is heat that enters and does not leave.
    limits : Limits

    Returns
    -------
    u : ndarray, shape (n,)
    report : SolveReport

    Raises
    ------
    ConvergenceError
        If the tolerances are not met, or the matrix turns out not to be positive definite.

    References
    ----------
    Meurant, Tichy 2013, On computing quadrature-based bounds for the A-norm of the error in conjugate
    gradients, doi:10.1007/s11075-012-9591-9.

    Examples
    --------
    >>> from scipy.sparse import diags_array
    >>> K = csr_matrix(diags_array([2.0, -1.0, -1.0], offsets=[0, 1, -1], shape=(9, 9)))
    >>> b = np.zeros(9)
    >>> b[0] = 1.0  # a chain of ten unit conductors between temperatures 1 and 0
    >>> u, report = solve_energy(K, b, 1.0)
    >>> round(1.0 - float(b @ u), 12)
    0.1
    """
    preconditioner = preconditioner or build_preconditioner(matrix)
    start = time.perf_counter()
    u = np.zeros_like(rhs) if initial is None else initial.copy()
    r = rhs - matrix @ u if initial is not None else rhs.copy()
    z = preconditioner.apply(r)
    p = z.copy()
    rho = dot(r, z)
    rhs_norm = math.sqrt(dot(rhs, rhs)) or 1.0
    scaled = np.empty_like(rhs)
    uniform = np.ones_like(rhs) if conserved is None else conserved
    steps: list[float] = []
    ratios: list[float] = []
    history = [math.sqrt(dot(r, r)) / rhs_norm]
    ritz = np.nan

    def report(error: float, imbalance: float) -> SolveReport:
        seconds = time.perf_counter() - start
        return SolveReport(
            rhs.size,
            preconditioner.levels,
            len(steps),
            error,
            history[-1],
            imbalance,
            preconditioner.seconds,
            seconds,
            ritz,
        )

    if rho == 0.0:
        return u, report(0.0, 0.0)
    while len(steps) < limits.max_iterations:
        q = matrix @ p
        curvature = dot(p, q)
        if not (rho > 0.0 and curvature > 0.0):
            break
        steps.append(rho / curvature)
        u += np.multiply(p, steps[-1], out=scaled)
        r -= np.multiply(q, steps[-1], out=scaled)
        history.append(math.sqrt(dot(r, r)) / rhs_norm)
        z = preconditioner.apply(r)
        rho_next = dot(r, z)
        ratios.append(rho_next / rho)
        # E_lift - 2 b.u + u.K u, which holds for any iterate
        energy = max(lift_energy - dot(u, np.add(rhs, r, out=scaled)), ROUND_OFF * lift_energy)
        ritz = smallest_ritz_value(steps, ratios)
        mu = min(0.5 * ritz, np.inf if limits.spectral_floor is None else limits.spectral_floor)
        error = max(radau_factor(steps, ratios, mu) * rho_next, 0.0) / energy
        imbalance = abs(dot(uniform, r)) / energy
        if error <= tolerance and imbalance <= limits.balance_tolerance:
            if imbalance > BALANCED:
                imbalance = _balance(matrix, rhs, u, uniform) / energy
            return u, report(error, imbalance)
        rho = rho_next
        p *= ratios[-1]
        p += z
    if len(steps) < limits.max_iterations:
        raise ConvergenceError(
            f"conjugate gradients broke down after {len(steps)} iterations: the matrix or its preconditioner is not "
            f"positive definite (relative residual {history[-1]:.2e})",
            history,
        )
    raise ConvergenceError(
        f"conjugate gradients stopped after {limits.max_iterations} iterations with relative energy error {error:.2e} "
        f"(wanted {tolerance:.2e}) and flux imbalance {imbalance:.2e} (wanted {limits.balance_tolerance:.2e})",
        history,
    )


def solve_loads(
    matrix: csr_matrix,
    rhs: Floats,
    lift_energies: Floats,
    *,
    preconditioner: Preconditioner | None = None,
    initial: Floats | None = None,
    tolerance: float = 1e-10,
    conserved: Floats | None = None,
    limits: Limits = DEFAULT_LIMITS,
    last_resort: int = LAST_RESORT,
) -> tuple[Floats, tuple[SolveReport, ...]]:
    """Solve K u_a = b_a for all loads a of one matrix, with one preconditioner.

    Multigrid stalls where neighbours differ in conductivity by many orders of magnitude. Without a given
    preconditioner the matrix is factorised then.

    Parameters
    ----------
    matrix : csr_matrix, shape (n, n)
        Symmetric positive definite; without rows there is nothing to solve.
    rhs : ndarray, shape (n, k)
    lift_energies : ndarray, shape (k,)
        Energy of the prescribed part of each solution.
    initial : ndarray, shape (n, k), optional
        Starting guesses; a load without a right-hand side starts from zero.
    preconditioner, tolerance, conserved, limits
        As in `solve_energy`.
    last_resort : int
        Largest matrix that is factorised where multigrid stalls.

    Returns
    -------
    u : ndarray, shape (n, k)
    reports : tuple of SolveReport
        One per load.

    Raises
    ------
    ConvergenceError
    """
    if matrix.shape[0] == 0:
        return np.zeros(rhs.shape), (NO_SOLVE,) * rhs.shape[1]

    def solve_each(chosen: Preconditioner) -> tuple[Floats, tuple[SolveReport, ...]]:
        u = np.empty(rhs.shape)
        reports = []
        for load, lift_energy in enumerate(lift_energies):
            b = np.ascontiguousarray(rhs[:, load])
            start = None if initial is None or not b.any() else np.ascontiguousarray(initial[:, load])
            u[:, load], report = solve_energy(
                matrix,
                b,
                float(lift_energy),
                preconditioner=chosen,
                initial=start,
                tolerance=tolerance,
                conserved=conserved,
                limits=limits,
            )
            reports.append(report)
        return u, tuple(reports)

    if preconditioner is not None:
        return solve_each(preconditioner)
    built = build_preconditioner(matrix)
    try:
        return solve_each(built)
    except ConvergenceError:
        if built.levels == 1 or matrix.shape[0] > last_resort:
            raise
    del built
    return solve_each(build_preconditioner(matrix, matrix.shape[0]))


def _balance(matrix: csr_matrix, rhs: Floats, u: Floats, uniform: Floats) -> float:
    """Shift u, in place, by the uniform temperature that balances the heat flows; returns what is left of w . r."""
    load = matrix @ uniform
    residual = rhs - matrix @ u
    shift = dot(uniform, residual) / dot(uniform, load)
    u += shift * uniform
    residual -= shift * load
    return abs(dot(uniform, residual))


def smallest_ritz_value(steps: list[float], ratios: list[float]) -> float:
    """Smallest eigenvalue of the tridiagonal matrix of k CG steps, arguments as in `radau_factor`."""
    gamma, delta = np.asarray(steps), np.asarray(ratios[:-1])
    diagonal = 1.0 / gamma
    diagonal[1:] += delta / gamma[:-1]
    return float(eigvalsh_tridiagonal(diagonal, np.sqrt(delta) / gamma[:-1], select="i", select_range=(0, 0))[0])


def radau_factor(steps: list[float], ratios: list[float], mu: float | None = None) -> float:
    """Factor g_k of the Gauss-Radau estimate |u - u_k|_K^2 = g_k rho_k after k CG steps.

    Parameters
    ----------
    steps : list of float
        Step lengths gamma_0 .. gamma_{k-1}.
    ratios : list of float
        rho_1/rho_0 .. rho_k/rho_{k-1}.
    mu : float, optional
        Half the smallest Ritz value by default.
    """
    mu = 0.5 * smallest_ritz_value(steps, ratios) if mu is None else mu
    factor = 1.0 / mu
    for step, ratio in zip(steps, ratios, strict=True):
        beyond = factor - step
        factor = beyond / (mu * beyond + ratio) if beyond > 0.0 else 1.0 / mu
    return float(factor)
