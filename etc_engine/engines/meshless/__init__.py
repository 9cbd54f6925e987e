"""Meshless transient heat conduction: dual reciprocity with Trefftz functions or fundamental solutions."""

from etc_engine.engines.meshless.contact_heating import ContactArc, heat_disk_through_arcs
from etc_engine.engines.meshless.contact_series import flow_histories, heat_disk_by_flows
from etc_engine.engines.meshless.diagnostics import DiscretizationWarning
from etc_engine.engines.meshless.discretization import Discretization
from etc_engine.engines.meshless.domain import Disk, Polygon
from etc_engine.engines.meshless.problem import Convective, Dirichlet, HeatProblem, Neumann
from etc_engine.engines.meshless.radial_basis import PolyharmonicSpline, ReverseBasis
from etc_engine.engines.meshless.solve import solve_transient

__all__ = [
    "ContactArc",
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
    "flow_histories",
    "heat_disk_by_flows",
    "heat_disk_through_arcs",
    "solve_transient",
]
