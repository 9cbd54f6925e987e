"""Linear solvers: arrays in, arrays out, and a report of what was reached."""

from etc_engine.solvers.amg_cg import Preconditioner, SolveReport, build_preconditioner, solve_energy

__all__ = ["Preconditioner", "SolveReport", "build_preconditioner", "solve_energy"]
