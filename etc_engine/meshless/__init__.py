"""Meshless transient heat conduction: dual reciprocity with Trefftz functions or fundamental solutions."""

from etc_engine.meshless.discretization import Discretization
from etc_engine.meshless.domain import Disk, Polygon
from etc_engine.meshless.problem import Convective, Dirichlet, HeatProblem, Neumann
from etc_engine.meshless.radial_basis import PolyharmonicSpline, ReverseBasis
from etc_engine.meshless.solve import DiscretizationWarning, solve_transient

__all__ = [
    "Convective",
    "Dirichlet",
    "Discretization",
    "DiscretizationWarning",
    "Disk",
    "HeatProblem",
    "Neumann",
    "Polygon",
    "PolyharmonicSpline",
    "ReverseBasis",
    "solve_transient",
]
