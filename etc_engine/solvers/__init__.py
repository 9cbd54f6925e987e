"""Linear solvers: arrays in, arrays out, and a report of what was reached."""

from etc_engine.solvers.amg_cg import (
    Limits,
    Preconditioner,
    SolveReport,
    build_preconditioner,
    solve_energy,
    solve_loads,
)
from etc_engine.solvers.reduced_basis import FamilySolution, Member, TrialSpace, solve_family

__all__ = [
    "FamilySolution",
    "Limits",
    "Member",
    "Preconditioner",
    "SolveReport",
    "TrialSpace",
    "build_preconditioner",
    "solve_energy",
    "solve_family",
    "solve_loads",
]
