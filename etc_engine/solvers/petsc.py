"""Conjugate gradients on many ranks: PETSc, with BoomerAMG of hypre as the preconditioner, through petsc4py.

The error of the conductivity is |u - u_k|_K^2 = r . K^-1 r, at most r . M^-1 r / lambda_min(M^-1 K); lambda_min is
taken as half the smallest Ritz value of the iteration, as in `etc_engine.solvers.amg_cg`.
"""

from __future__ import annotations

import time
from types import ModuleType
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from etc_engine.arrays import Floats
from etc_engine.errors import ConvergenceError, InputError
from etc_engine.ranks import Ranks, together
from etc_engine.solvers.amg_cg import BALANCED, DEFAULT_LIMITS, NO_SOLVE, ROUND_OFF, Limits, SolveReport

PREFIX = "etc_"
"""Of the options that PETSc reads from its environment, as in PETSC_OPTIONS='-etc_ksp_monitor'."""
OPTIONS = {
    "pc_hypre_boomeramg_strong_threshold": "0.5",
    "pc_hypre_boomeramg_coarsen_type": "HMIS",
    "pc_hypre_boomeramg_interp_type": "ext+i",
    "pc_hypre_boomeramg_P_max": "4",
    "pc_hypre_boomeramg_relax_type_all": "symmetric-SOR/Jacobi",
}
"""Of BoomerAMG: chosen for the least memory and time on contact networks; those of the environment come first."""
PASSES = 8
"""Times that the iteration is started again with a smaller residual to reach."""
FIRST = 1e-12
"""First reduction of r . M^-1 r."""


def load_petsc(ranks: Ranks) -> ModuleType:
    """``petsc4py.PETSc``, on the ranks of the run.

    Raises
    ------
    InputError
        On every rank, if it is missing, does not fit NumPy, lacks hypre or joins other ranks than ours.
    """

    def load() -> ModuleType:
        try:
            from petsc4py import PETSc
        except Exception as error:  # a build for another NumPy raises ValueError, one without MPI RuntimeError
            reason = " ".join(str(error).split())[:120]
            raise InputError(
                f"one packing on many ranks needs petsc4py with hypre, which does not load ({reason}): "
                "install it (Debian: python3-petsc4py, with numpy<2; clusters: the site's module)"
            ) from None
        size = PETSc.COMM_WORLD.getSize()
        if size != ranks.size:
            raise InputError(
                f"PETSc sees {size} ranks and this run has {ranks.size}: petsc4py belongs to another MPI than the "
                "launcher; start with the mpiexec of its MPI (Debian: mpiexec.openmpi)"
            )
        return PETSc

    return together(ranks, load)


def solve_on_ranks(
    matrix: csr_matrix,
    rhs: Floats,
    lift_energies: Floats,
    ranks: Ranks,
    *,
    tolerance: float = 1e-10,
    limits: Limits = DEFAULT_LIMITS,
) -> tuple[Floats, tuple[SolveReport, ...]]:
    """Solve K u_a = b_a for all loads a of one matrix, whose rows are spread over the ranks.

    Parameters
    ----------
    matrix : csr_matrix, shape (own, n)
        Rows of this rank; those of all ranks, in their order, are symmetric positive definite.
    rhs : ndarray, shape (own, k)
    lift_energies : ndarray, shape (k,)
        Energy of the prescribed part of each solution, of all ranks.
    ranks : Ranks
        Every rank makes this call.
    tolerance, limits
        As of `etc_engine.solvers.amg_cg.solve_energy`; a uniform temperature is 1 at all unknowns.

    Returns
    -------
    u : ndarray, shape (own, k)
    reports : tuple of SolveReport
        The same on every rank.

    Raises
    ------
    InputError, ConvergenceError
        On every rank.
    """
    petsc = load_petsc(ranks)
    own, total = matrix.shape
    if total == 0:
        return np.zeros(rhs.shape), (NO_SOLVE,) * rhs.shape[1]
    if total > np.iinfo(petsc.IntType).max:
        raise InputError(
            f"{total} unknowns are too many for this PETSc, whose numbers have {8 * np.dtype(petsc.IntType).itemsize} "
            "bits: use one that was configured with --with-64-bit-indices"
        )
    start = time.perf_counter()
    kind = petsc.IntType
    rows = matrix.indptr.astype(kind), matrix.indices.astype(kind), matrix.data
    k = petsc.Mat().createAIJ(size=((own, total), (own, total)), csr=rows)
    k.assemble()
    solver = _solver(petsc, k, limits.max_iterations)
    seconds = time.perf_counter() - start
    u, reports = np.zeros(rhs.shape), []
    for load, lift_energy in enumerate(lift_energies.tolist()):
        x, b = k.createVecs()
        b.setArray(rhs[:, load])
        x.set(0.0)
        reports.append(_solve_load(solver, (x, b), lift_energy, tolerance, limits, seconds))
        u[:, load] = x.getArray()
        x.destroy()
        b.destroy()
    solver.destroy()
    k.destroy()
    return u, tuple(reports)


def _solver(petsc: ModuleType, k: Any, most: int) -> Any:
    options = petsc.Options(PREFIX)
    for name, value in OPTIONS.items():
        if not options.hasName(name):
            options.setValue(name, value)
    solver = petsc.KSP().create(comm=k.getComm())
    solver.setOptionsPrefix(PREFIX)
    solver.setOperators(k)
    solver.setType("cg")
    solver.setNormType(petsc.KSP.NormType.NATURAL)
    solver.setComputeEigenvalues(True)
    solver.setInitialGuessNonzero(True)
    solver.setTolerances(rtol=1e-50, atol=1e-300, divtol=1e50, max_it=most)
    preconditioner = solver.getPC()
    preconditioner.setType("hypre")
    preconditioner.setHYPREType("boomeramg")
    solver.setFromOptions()
    solver.setUp()
    return solver


def _solve_load(
    solver: Any, vectors: tuple[Any, Any], lift_energy: float, tolerance: float, limits: Limits, setup_seconds: float
) -> SolveReport:
    """Solve one load in place, in passes of which each has a smaller residual to reach."""
    start = time.perf_counter()
    x, b = vectors
    k, preconditioner = solver.getOperators()[0], solver.getPC()
    r, z = b.duplicate(), b.duplicate()
    size, scale = b.getSize(), b.norm() or 1.0
    preconditioner.apply(b, z)
    rho, iterations, ritz = b.dot(z), 0, np.inf
    if rho == 0.0:
        return SolveReport(size, 1, 0, 0.0, 0.0, 0.0, setup_seconds, time.perf_counter() - start)
    target, error, imbalance = FIRST * rho, np.inf, np.inf
    for _ in range(PASSES):
        solver.setTolerances(atol=float(np.sqrt(target)), max_it=limits.max_iterations - iterations)
        solver.solve(b, x)
        iterations += solver.getIterationNumber()
        ritz = min([ritz, *np.real(solver.computeEigenvalues()).tolist()])
        k.mult(x, r)
        r.aypx(-1.0, b)
        preconditioner.apply(r, z)
        rho = max(r.dot(z), 0.0)
        energy = max(lift_energy - x.dot(b) - x.dot(r), ROUND_OFF * lift_energy)
        if not (ritz > 0.0 and solver.getConvergedReason() > 0):
            break
        error, imbalance = rho / (0.5 * ritz * energy), abs(r.sum()) / energy
        if error <= tolerance and imbalance <= limits.balance_tolerance:
            if imbalance > BALANCED:
                imbalance = _balance(k, b, x) / energy
            seconds = time.perf_counter() - start
            return SolveReport(size, 1, iterations, error, r.norm() / scale, imbalance, setup_seconds, seconds, ritz)
        if iterations >= limits.max_iterations:
            break
        target = min(0.05 * tolerance * ritz * energy, 1e-2 * rho)
    raise ConvergenceError(
        f"conjugate gradients with BoomerAMG stopped after {iterations} iterations with relative energy error "
        f"{error:.2e} (wanted {tolerance:.2e}) and flux imbalance {imbalance:.2e} (wanted "
        f"{limits.balance_tolerance:.2e}), reason {solver.getConvergedReason()} of PETSc"
    )


def _balance(k: Any, b: Any, x: Any) -> float:
    """Shift x, in place, by the uniform temperature that balances the heat flows; returns what is left."""
    uniform, load, r = b.duplicate(), b.duplicate(), b.duplicate()
    uniform.set(1.0)
    k.mult(uniform, load)
    k.mult(x, r)
    r.aypx(-1.0, b)
    shift = r.sum() / load.sum()
    x.axpy(shift, uniform)
    r.axpy(-shift, load)
    return abs(float(r.sum()))
