"""Time marching: theta schemes, BDF2 and SDIRK2, each step one or two modified Helmholtz problems."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigvals
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs

from etc_engine.arrays import Floats, Ints
from etc_engine.engines.meshless.discretization import Layout
from etc_engine.engines.meshless.helmholtz import HelmholtzOperator, prepare_operator
from etc_engine.engines.meshless.particular import SourceInterpolation, interpolate_source
from etc_engine.errors import InputError

MarchingScheme = Literal["sdirk2", "bdf2", "crank-nicolson", "backward-euler"]

#: gamma of the two-stage, stiffly accurate, L-stable SDIRK method of order 2.
GAMMA = 1.0 - 1.0 / np.sqrt(2.0)
#: lambda^2 = factor * rho c/(tau k).
FACTORS: dict[str, float] = {"sdirk2": 1.0 / GAMMA, "bdf2": 1.5, "crank-nicolson": 2.0, "backward-euler": 1.0}
#: Up to this many nodes all eigenvalues of the step are computed, beyond it only the largest.
DENSE_LIMIT = 500


@dataclass(frozen=True, eq=False)
class StepOperator:
    """One lambda's solution at the nodes as two matrices: u = response f + boundary_response g."""

    operator: HelmholtzOperator
    response: Floats
    boundary_response: Floats

    @property
    def lam(self) -> float:
        """The real lambda, in scaled coordinates."""
        return float(np.real(self.operator.lam))

    def nodal(self, source: Floats, data: Floats) -> Floats:
        """Nodal values of the solution for nodal f and boundary data."""
        return np.asarray(self.response @ source + self.boundary_response @ data)


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The field at one time: nodal values, and the (f, B3) whose Helmholtz solution it is."""

    time: float
    values: Floats
    step: StepOperator
    source: Floats
    data: Floats

    def coefficients(self) -> Floats:
        """Coefficients of the field in the functions of ``step.operator``."""
        return self.step.operator.solve(self.source, self.data)


@dataclass
class StepLibrary:
    """Step operators by lambda: built once, reused as long as the time step lasts."""

    layout: Layout
    interpolation: SourceInterpolation | None = None
    built: dict[float, StepOperator] = field(default_factory=dict)
    capacity: int = 3

    def get(self, factor: float, tau: float) -> StepOperator:
        """The operator for lambda^2 = factor rho c/(tau k)."""
        lam = float(self.layout.scale * np.sqrt(factor / (self.layout.problem.diffusivity * tau)))
        key = float(f"{lam:.12e}")
        if key not in self.built:
            while len(self.built) >= self.capacity:
                del self.built[next(iter(self.built))]
            self.built[key] = self._build(lam)
        return self.built[key]

    def _build(self, lam: float) -> StepOperator:
        basis = self.layout.discretization.basis
        nodes = self.layout.scaled(self.layout.nodes)
        interpolation = self.interpolation
        if interpolation is None or basis.depends_on_lambda:
            interpolation = interpolate_source(basis, nodes, lam, self.layout.wedges)
        self.interpolation = interpolation
        operator = prepare_operator(self.layout, lam, interpolation)
        values = operator.value_rows(nodes)
        particular, homogeneous = values[:, : interpolation.size], values[:, interpolation.size :]
        rows = interpolation.from_nodal_values(np.vstack([particular, operator.particular_boundary]))
        lift = homogeneous @ operator.fit.solve(np.eye(self.layout.collocation.count))
        count = len(nodes)
        return StepOperator(operator, rows[:count] - lift @ rows[count:], lift)


def step_counts(times: Floats, steps: int) -> Ints:
    """Steps for each interval between output times: ``steps`` over the whole, none longer than T/steps.

    Examples
    --------
    >>> step_counts(np.array([0.5, 1.0]), 50), step_counts(np.array([0.01, 1.0]), 50)
    (array([25, 25]), array([ 1, 50]))
    """
    lengths = np.diff(times, prepend=0.0)
    return np.asarray(np.maximum(1, np.ceil(steps * lengths / times[-1] - 1e-9)), dtype=np.int64)


def march(library: StepLibrary, scheme: str, times: Floats, steps: int) -> Iterator[Snapshot]:
    """Fields at increasing positive times.

    Crank-Nicolson starts (and restarts after a change of the time step) with two backward Euler half
    steps, which share its lambda and keep it from ringing after a thermal shock; BDF2 starts with SDIRK2.

    Raises
    ------
    InputError
        If the scheme is unknown or there is no step.
    """
    if scheme not in FACTORS:
        raise InputError(f"the scheme {scheme!r} is unknown: expected laplace or one of {', '.join(FACTORS)}")
    if steps < 1:
        raise InputError(f"at least one time step is needed, found {steps}")
    layout = library.layout
    state: Snapshot | None = None
    values, start = layout.problem.initial_values(layout.nodes), 0.0
    previous: Floats | None = None  # BDF2: the values one step before, if at the same step length
    last_tau = 0.0
    for end, count in zip(times, step_counts(times, steps), strict=True):
        tau = (end - start) / count
        if abs(tau - last_tau) > 1e-9 * tau:
            previous, state = None, None
        for k in range(count):
            t = start + k * tau
            if scheme == "sdirk2":
                new = _sdirk2(library, values, t, tau)
            elif scheme == "backward-euler":
                new = _implicit(library.get(1.0, tau), layout, values, t + tau)
            elif scheme == "bdf2":
                new = _bdf2(library, values, previous, t, tau)
                previous = values
            else:
                new = _crank_nicolson(library, values, state, t, tau)
            state, values = new, new.values
        assert state is not None
        start, last_tau = float(end), tau
        yield Snapshot(float(end), state.values, state.step, state.source, state.data)


def _implicit(step: StepOperator, layout: Layout, base: Floats, t: float, data: Floats | None = None) -> Snapshot:
    """Solve (lap - lambda^2) u = -lambda^2 base - Q(t)/k with the boundary data of time t, or those given."""
    heating = layout.problem.source_values(layout.nodes, t) / layout.problem.conductivity
    source = -(step.lam**2) * base - layout.scale**2 * heating
    if data is None:
        data = layout.boundary_data(layout.collocation, t)
    return Snapshot(t, step.nodal(source, data), step, source, data)


def _sdirk2(library: StepLibrary, values: Floats, t: float, tau: float) -> Snapshot:
    step, layout = library.get(1.0 / GAMMA, tau), library.layout
    stage = _implicit(step, layout, values, t + GAMMA * tau, _stage_data(layout, t, tau)).values
    base = values + (1.0 - GAMMA) / GAMMA * (stage - values)
    return _implicit(step, layout, base, t + tau)


def _stage_data(layout: Layout, t: float, tau: float) -> Floats:
    """Boundary data of the first SDIRK stage by the method itself: g(t) + gamma tau g'(t + gamma tau).

    The slope is that of the parabola through g at t, t + gamma tau and t + tau. Data of the stage's own
    time would not fit the first-order stage inside and cost a factor of three in accuracy.
    """
    start, stage, end = (layout.boundary_data(layout.collocation, t + c * tau) for c in (0.0, GAMMA, 1.0))
    slope = (GAMMA - 1.0) / GAMMA * start + (2.0 * GAMMA - 1.0) / (GAMMA * (GAMMA - 1.0)) * stage
    return np.asarray(start + GAMMA * (slope + GAMMA / (1.0 - GAMMA) * end))


def _bdf2(library: StepLibrary, values: Floats, previous: Floats | None, t: float, tau: float) -> Snapshot:
    if previous is None:
        return _sdirk2(library, values, t, tau)
    return _implicit(library.get(1.5, tau), library.layout, (4.0 * values - previous) / 3.0, t + tau)


def _crank_nicolson(library: StepLibrary, values: Floats, state: Snapshot | None, t: float, tau: float) -> Snapshot:
    """u_new = 2 w - u, where w solves with the mean of old and new boundary data and sources."""
    layout, step = library.layout, library.get(2.0, tau)
    if state is None:
        half = _implicit(step, layout, values, t + 0.5 * tau)
        return _implicit(step, layout, half.values, t + tau)
    heating = 0.5 * (
        layout.problem.source_values(layout.nodes, t) + layout.problem.source_values(layout.nodes, t + tau)
    )
    source = -(step.lam**2) * values - layout.scale**2 * heating / layout.problem.conductivity
    data = 0.5 * (layout.boundary_data(layout.collocation, t) + layout.boundary_data(layout.collocation, t + tau))
    middle = step.nodal(source, data)
    return Snapshot(t + tau, 2.0 * middle - values, step, 2.0 * source - state.source, 2.0 * data - state.data)


def spectral_radius(step: StepOperator, scheme: str) -> float:
    """Largest amplification factor of one time step without sources and boundary data.

    With s the eigenvalues of -lambda^2 response (one implicit solve), the factor is s for backward
    Euler, 2 s - 1 for Crank-Nicolson, s (1 + (s - 1)(1 - gamma)/gamma) for SDIRK2, and the larger root of
    z^2 = s (4 z - 1)/3 for BDF2.
    """
    n = len(step.response)
    if n <= DENSE_LIMIT:
        s = np.asarray(eigvals(-(step.lam**2) * step.response, check_finite=False), dtype=complex)
        return float(np.abs(amplification(s, scheme)).max())
    size = 2 * n if scheme == "bdf2" else n
    once = LinearOperator((size, size), matvec=lambda u: _free_step(step, scheme, u.ravel()), dtype=float)
    try:  # a fixed starting vector keeps the figure reproducible
        largest: NDArray = eigs(once, k=2, v0=np.cos(np.arange(size)), tol=1e-6, return_eigenvectors=False)
    except ArpackNoConvergence as stopped:
        largest = stopped.eigenvalues
    return float(np.abs(largest).max()) if len(largest) else float("nan")


def _free_step(step: StepOperator, scheme: str, values: Floats) -> Floats:
    """One step without sources and boundary data; BDF2 acts on (new, old) pairs."""

    def solve(base: Floats) -> Floats:
        return np.asarray(-(step.lam**2) * (step.response @ base))

    if scheme == "crank-nicolson":
        return 2.0 * solve(values) - values
    if scheme == "sdirk2":
        return solve(values + (1.0 - GAMMA) / GAMMA * (solve(values) - values))
    if scheme == "bdf2":
        new, old = np.split(values, 2)
        return np.concatenate([solve((4.0 * new - old) / 3.0), new])
    return solve(values)


def amplification(s: NDArray[np.complex128], scheme: str) -> NDArray[np.complex128]:
    """Amplification factors of a scheme for the eigenvalues s of one implicit solve.

    Examples
    --------
    >>> amplification(np.array([1.0, 0.0]), "crank-nicolson")
    array([ 1., -1.])
    """
    if scheme == "crank-nicolson":
        return np.asarray(2.0 * s - 1.0)
    if scheme == "sdirk2":
        return np.asarray(s * (1.0 + (1.0 - GAMMA) / GAMMA * (s - 1.0)))
    if scheme == "bdf2":
        root = np.sqrt(4.0 * s * s / 9.0 - s / 3.0 + 0j)
        first, second = 2.0 * s / 3.0 + root, 2.0 * s / 3.0 - root
        return np.asarray(np.where(np.abs(first) > np.abs(second), first, second))
    return s
