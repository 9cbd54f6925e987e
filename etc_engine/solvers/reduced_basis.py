r"""A family of energies that depends on one parameter, solved in the span of the solutions at a few of its values.

E(t) = t . K t over the rows t = lift + u, u from the free values. In the span of the columns of V the minimum is

    u = V y,    (V^T K V) y = -V^T K lift,

so its energy is never below the true minimum, and it exceeds it by |e|_K^2. With r the residual, M a
preconditioner of the matrix K_0 of a reference parameter, mu <= lambda_min(M^-1 K_0) and K >= c K_0,

    |e|_K^2 = r . K^-1 r <= r . M^-1 r / (mu c).

Here mu is half the smallest Ritz value of the reference's conjugate gradients. That is proven to be low enough if M
is a factorisation of K_0 (all its eigenvalues are 1); otherwise the right-hand side is an estimate.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse import csr_matrix

from etc_engine.arrays import Floats, Ints
from etc_engine.errors import ConvergenceError
from etc_engine.solvers.amg_cg import ROUND_OFF, Limits, Preconditioner, build_preconditioner, solve_loads
from etc_engine.solvers.summation import combine, inner

# A snapshot that keeps less than this part of its norm beside the basis has nothing to add but round-off.
DEPENDENT = 1e-11

# A snapshot is solved to this part of the tolerance of the others.
SNAPSHOT = 1e-2

# Preconditioned residuals may correct a reduced solution so many times, if its error is within so many tolerances.
MOST_CORRECTIONS = 2
WITHIN_REACH = 100.0

# Net heat of the residual, relative to the energy, up to which a reduced solution counts as balanced.
BALANCE = 1e-8


@dataclass(frozen=True, eq=False)
class TrialSpace:
    """What the members of the family have in common.

    Parameters
    ----------
    lift : ndarray, shape (rows, k)
        Prescribed part of the solution, one column a load.
    free : ndarray of int, shape (rows,)
        Free value that each row takes, -1 if it takes none.
    size : int
        Number of free values.
    conserved : ndarray, shape (size,)
        A vector that every basis holds: the residual is orthogonal to it.
    """

    lift: Floats
    free: Ints
    size: int
    conserved: Floats

    @property
    def loads(self) -> int:
        """Number of loads, k."""
        return int(self.lift.shape[1])

    def rows(self, u: Floats) -> Floats:
        """Rows of free values of shape (size, q), without the lift: shape (rows, q)."""
        return np.concatenate([u, np.zeros((1, u.shape[1]))])[self.free]

    def gather(self, flows: Floats) -> Floats:
        """Sum of the rows of every free value, shape (size, k)."""
        inside = self.free >= 0
        free = self.free[inside]
        columns = [np.bincount(free, column[inside], minlength=self.size) for column in flows.T]
        return np.column_stack(columns)


@dataclass(frozen=True, eq=False)
class Member:
    """The energy at one value of the parameter.

    Parameters
    ----------
    apply : callable
        Rows t in, K t out, shapes (rows, q).
    matrix : callable
        Returns K over the free values as a csr_matrix; called for snapshots only.
    floor : callable
        Another member in, a c > 0 with K >= c K_0 out, K_0 that member's.
    """

    apply: Callable[[Floats], Floats]
    matrix: Callable[[], csr_matrix]
    floor: Callable[[Member], float]


@dataclass(frozen=True, eq=False)
class FamilySolution:
    """The minimum of one member, or an upper bound of it.

    Parameters
    ----------
    u : ndarray, shape (size, k)
        Free values.
    energies : ndarray, shape (k, k)
        t_a . K t_b; each on the diagonal is at least the true one.
    relative_energy_error : float
        Largest estimated relative error of an energy.
    certified : bool
        Whether that is a proven upper bound, up to round-off, of the error of a reduced solution.
    snapshots : int
        Solutions in the basis it was reduced to, 0 if it is a full solution.
    iterations : int
        Of the conjugate gradients, 0 if reduced.
    seconds : float
    """

    u: Floats
    energies: Floats
    relative_energy_error: float
    certified: bool
    snapshots: int
    iterations: int
    seconds: float


@dataclass(frozen=True, eq=False)
class _Reference:
    """The first snapshot: its preconditioner serves the whole family."""

    member: Member
    preconditioner: Preconditioner
    mu: float

    @property
    def proven(self) -> bool:
        return self.preconditioner.levels == 1


@dataclass(frozen=True, eq=False)
class _Basis:
    """Orthonormal vectors, shape (size, q), their rows, and how many snapshots they come from."""

    vectors: Floats
    rows: Floats
    snapshots: int = 0

    def with_snapshot(self, space: TrialSpace, u: Floats) -> _Basis:
        """The basis that holds u too."""
        vectors = _orthonormal(self.vectors, u)
        return _Basis(vectors, space.rows(vectors), self.snapshots + 1)


def farthest_first(parameters: Sequence[float]) -> list[int]:
    """Order in which to visit a list of parameters: the middle, the ends, then always into the widest gap.

    Examples
    --------
    >>> farthest_first([1.0, 2.0, 3.0, 4.0, 5.0])
    [2, 0, 4, 1, 3]
    """
    x = np.asarray(parameters, dtype=np.float64)
    order = [int(np.argmin(np.abs(x - 0.5 * (x.min() + x.max()))))]
    distance = np.abs(x - x[order[0]])
    distance[order[0]] = -1.0
    while len(order) < x.size:
        order.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.abs(x - x[order[-1]]))
        distance[order] = -1.0
    return order


def solve_family(
    space: TrialSpace,
    parameters: Sequence[float],
    member_at: Callable[[int], Member | None],
    tolerance: float = 1e-8,
) -> Iterator[tuple[int, FamilySolution | None]]:
    """Minimise the energies of a family, in full at as few parameters as the tolerance asks for.

    Parameters
    ----------
    space : TrialSpace
    parameters : sequence of float
        On a scale on which the solutions change evenly, which decides where they are solved in full.
    member_at : callable
        Index of a parameter in, member out; None if there is none.
    tolerance : float
        Largest estimated relative error of an energy; where a reduced solution has more, a full one takes its
        place and joins the basis.

    Yields
    ------
    index : int
        Which parameter; in the order of `farthest_first`.
    solution : FamilySolution or None
        None if the parameter has no member, or its conjugate gradients did not converge.

    Notes
    -----
    Every member is made once and dropped. A solution depends on the parameters visited before it, within the
    tolerance; the same list gives the same bits.

    Examples
    --------
    >>> from scipy.sparse import diags_array
    >>> chain = csr_matrix(diags_array([2.0, -1.0, -1.0], offsets=[0, 1, -1], shape=(9, 9)))
    >>> whole = csr_matrix(diags_array([2.0, -1.0, -1.0], offsets=[0, 1, -1], shape=(10, 10)))
    >>> space = TrialSpace(np.eye(10, 1), np.arange(-1, 9), 9, np.ones(9))  # row 0 is held at 1
    >>> k = [1.0, 3.0, 5.0]
    >>> scaled = lambda i: Member(lambda t: k[i] * (whole @ t), lambda: k[i] * chain, lambda other: k[i] / 3.0)
    >>> [(i, s.snapshots, round(s.energies.item(), 9)) for i, s in solve_family(space, k, scaled)]
    [(1, 0, 3.3), (0, 1, 1.1), (2, 1, 5.5)]
    """
    reference: _Reference | None = None
    conserved = _orthonormal(np.empty((space.size, 0)), space.conserved[:, None])
    basis = _Basis(conserved, space.rows(conserved))
    for index in farthest_first(parameters):
        start = time.perf_counter()
        member = member_at(index)
        if member is None:
            yield index, None
            continue
        solution = None
        if reference is not None:
            solution = _reduced(space, basis, member, reference, tolerance, start)
            if solution is not None and solution.relative_energy_error <= tolerance:
                yield index, solution
                continue
        try:
            solution, reference = _full(space, member, reference, solution, SNAPSHOT * tolerance, start)
        except ConvergenceError:
            yield index, None
            continue
        basis = basis.with_snapshot(space, solution.u)
        yield index, solution


def _reduced(
    space: TrialSpace,
    basis: _Basis,
    member: Member,
    reference: _Reference,
    tolerance: float,
    start: float,
) -> FamilySolution | None:
    """Galerkin solution in the basis; None if it has no factorisation or does not balance.

    Where little is missing, the preconditioned residuals join the basis for this member alone.
    """
    mu = reference.mu * member.floor(reference.member)
    vectors, rows = basis.vectors, basis.rows
    flows = member.apply(np.hstack([space.lift, rows]))
    lift_flows, flows = flows[:, : space.loads], flows[:, space.loads :]
    for extra in range(MOST_CORRECTIONS + 1):
        try:
            y = _solve_small(inner(rows, flows), -inner(rows, lift_flows))
        except np.linalg.LinAlgError:
            return None
        q = lift_flows + combine(flows, y)
        energies = inner(space.lift + combine(rows, y), q)
        residual = -space.gather(q)
        lift_energies = np.einsum("ia,ia->a", space.lift, lift_flows)
        scale = np.maximum(np.diag(energies), max(ROUND_OFF * lift_energies.max(), np.finfo(np.float64).tiny))
        if np.any(np.abs(inner(space.conserved[:, None], residual)) > BALANCE * scale):
            return None
        z = np.column_stack([reference.preconditioner.apply(r) for r in np.ascontiguousarray(residual.T)])
        error = float((np.maximum(np.einsum("ia,ia->a", residual, z), 0.0) / (mu * scale)).max())
        if extra == MOST_CORRECTIONS or not tolerance < error <= WITHIN_REACH * tolerance:
            break
        vectors = _orthonormal(vectors, z)
        added = space.rows(vectors[:, rows.shape[1] :])
        rows, flows = np.hstack([rows, added]), np.hstack([flows, member.apply(added)])
    seconds = time.perf_counter() - start
    u = combine(vectors, y)
    return FamilySolution(u, energies, error, reference.proven, basis.snapshots, 0, seconds)


def _solve_small(gram: Floats, rhs: Floats) -> Floats:
    """Solution of the projected system."""
    return np.asarray(cho_solve(cho_factor(0.5 * (gram + gram.T)), rhs))


def _full(
    space: TrialSpace,
    member: Member,
    reference: _Reference | None,
    nearby: FamilySolution | None,
    tolerance: float,
    start: float,
) -> tuple[FamilySolution, _Reference]:
    """Solution by conjugate gradients, from a nearby one and with the reference's preconditioner if there is one."""
    matrix = member.matrix()
    preconditioner = build_preconditioner(matrix) if reference is None else reference.preconditioner
    flows = member.apply(space.lift)
    rhs = -space.gather(flows)
    u, reports = solve_loads(
        matrix,
        rhs,
        np.einsum("ia,ia->a", space.lift, flows),
        preconditioner=preconditioner,
        initial=None if nearby is None else nearby.u,
        tolerance=tolerance,
        conserved=space.conserved,
        limits=Limits(spectral_floor=None if reference is None else reference.mu * member.floor(reference.member)),
    )
    if reference is None:
        # without iterations there is no Ritz value; that of a factorisation is 1
        ritz = [report.smallest_ritz for report in reports if report.iterations]
        unknown = 1.0 if preconditioner.levels == 1 else np.nan
        reference = _Reference(member, preconditioner, 0.5 * min(ritz, default=unknown))
    t = space.lift + space.rows(u)
    solution = FamilySolution(
        u,
        inner(t, member.apply(t)),
        max(report.relative_energy_error for report in reports),
        False,
        0,
        max(report.iterations for report in reports),
        time.perf_counter() - start,
    )
    return solution, reference


def _orthonormal(basis: Floats, vectors: Floats) -> Floats:
    """The basis with what the vectors add to it, by Gram-Schmidt done twice."""
    for vector in vectors.T:
        rest = vector[:, None] / (_length(vector[:, None]) or 1.0)
        for _ in range(2):
            rest = rest - combine(basis, inner(basis, rest))
        length = _length(rest)
        if length > DEPENDENT:
            basis = np.hstack([basis, rest / length])
    return basis


def _length(vector: Floats) -> float:
    return float(np.sqrt(inner(vector, vector).item()))
