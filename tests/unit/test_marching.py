from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.sparse import csr_matrix, diags_array

from etc_engine.errors import ConvergenceError, InputError
from etc_engine.solvers import step_matrix as step_matrix_module
from etc_engine.solvers.marching import SCHEMES, HeatSystem, critical_step, gershgorin_step, march
from etc_engine.solvers.step_matrix import step_matrix

ORDERS = {"explicit-euler": 1, "backward-euler": 1, "crank-nicolson": 2, "bdf2": 2}


def chain(capacity, links, ambient=lambda _: 0.0, source=lambda _: 0.0) -> HeatSystem:
    """A chain of unit conductances; every node linked to an ambient temperature, the first one heated."""
    n = len(capacity)
    links = np.asarray(links, dtype=float)
    diagonal = np.r_[1.0, np.full(n - 2, 2.0), 1.0] + links
    K = csr_matrix(diags_array([diagonal, -np.ones(n - 1), -np.ones(n - 1)], offsets=[0, 1, -1]))
    first = np.eye(n)[0]

    def load(t):
        return links * ambient(t) + source(t) * first

    def heat_rates(t, T):
        return np.array([links @ (ambient(t) - T), source(t)])

    return HeatSystem(np.asarray(capacity, dtype=float), K, load, heat_rates)


def varied(seed=7):
    rng = np.random.default_rng(seed)
    links = np.zeros(8)
    links[[0, 5]] = [0.7, 1.3]
    return chain(rng.uniform(0.5, 2.0, 8), links), rng.uniform(-1.0, 1.0, 8)


def with_algebraic(seed=7):
    """Nodes 2, 3 and 7 store nothing."""
    system, initial = varied(seed)
    capacity = system.capacity.copy()
    capacity[[2, 3, 7]] = 0.0
    return HeatSystem(capacity, system.conductance, system.load, system.heat_rates), initial


def exact(system: HeatSystem, initial, t):
    """Temperatures of a system without load, by the matrix exponential of what stores heat."""
    K = system.conductance.toarray()
    d, a = np.flatnonzero(system.capacity > 0), np.flatnonzero(system.capacity == 0)
    back = -np.linalg.solve(K[np.ix_(a, a)], K[np.ix_(a, d)]) if a.size else np.zeros((0, d.size))
    S = K[np.ix_(d, d)] + K[np.ix_(d, a)] @ back
    out = np.empty_like(initial)
    out[d] = expm(-S / system.capacity[d, None] * t) @ initial[d]
    out[a] = back @ out[d]
    return out


@pytest.mark.parametrize("make", [varied, with_algebraic])
@pytest.mark.parametrize("scheme", ORDERS)
def test_observed_order_against_the_matrix_exponential(scheme, make):
    system, initial = make()
    truth = exact(system, initial, 2.0)
    errors = []
    for steps in (40, 80, 160):
        *_, last = march(system, initial, [0.0, 2.0], scheme=scheme, steps=steps)
        errors.append(np.abs(last.temperatures - truth).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(ORDERS[scheme], abs=0.15)


@pytest.mark.parametrize("make", [varied, with_algebraic])
def test_adaptive_error_follows_the_tolerance(make):
    system, initial = make()
    truth = exact(system, initial, 2.0)
    steps = []
    for tolerance in (1e-3, 1e-5, 1e-7):
        *_, last = march(system, initial, [0.0, 0.5, 2.0], scheme="adaptive", tolerance=tolerance)
        assert np.abs(last.temperatures - truth).max() < 10.0 * tolerance
        steps.append(last.steps)
    # order 2 with an error of order 3 a step: a hundredth of the tolerance takes 100^(1/3) = 4.6 times the steps
    assert all(2.0 < after / before < 9.0 for before, after in pairwise(steps))


@pytest.mark.parametrize("scheme", SCHEMES)
def test_time_dependent_load_against_a_reference_integrator(scheme):
    capacity = np.array([1.0, 0.0, 2.0, 0.5])
    links = np.array([0.0, 0.5, 0.0, 2.0])
    system = chain(capacity, links, ambient=np.sin, source=lambda t: np.cos(3.0 * t))
    K = system.conductance.toarray()
    d = [0, 2, 3]

    def rate(t, T):
        full = np.empty(4)
        full[d] = T
        full[1] = (system.load(t)[1] - K[1, d] @ T) / K[1, 1]
        return ((system.load(t) - K @ full) / np.where(capacity > 0, capacity, 1.0))[d]

    reference = solve_ivp(rate, (0.0, 3.0), [1.0, 0.0, -1.0], rtol=1e-10, atol=1e-12).y[:, -1]
    control = {"tolerance": 1e-6} if scheme == "adaptive" else {"steps": 3000}
    *_, last = march(system, np.array([1.0, 9.9, 0.0, -1.0]), [0.0, 3.0], scheme=scheme, **control)
    assert last.temperatures[d] == pytest.approx(reference, abs=1e-3 if ORDERS.get(scheme) == 1 else 1e-5)
    assert abs(last.imbalance) < 1e-12


@pytest.mark.parametrize("scheme", SCHEMES)
def test_heat_stored_is_the_heat_that_came_in(scheme):
    system = chain(
        [1.0, 0.0, 2.0, 0.5], [0.0, 0.5, 0.0, 2.0], ambient=lambda t: 1.0 + np.sin(5 * t), source=lambda t: t
    )
    control = {"tolerance": 1e-3} if scheme == "adaptive" else {"step": 0.03}
    for state in march(system, np.zeros(4), [0.0, 0.1, 1.0, 1.5], scheme=scheme, **control):
        assert abs(state.imbalance) <= 1e-13 * max(np.abs(state.heat).sum(), 1.0)
        assert state.stored == pytest.approx(system.capacity @ state.temperatures, abs=1e-13)
    assert state.stored > 0.1


@pytest.mark.parametrize("scheme", SCHEMES)
def test_insulated_system_keeps_its_heat_and_evens_out(scheme):
    system = chain([1.0, 2.0, 3.0, 4.0], np.zeros(4))  # semi-definite
    control = {"tolerance": 1e-4} if scheme == "adaptive" else {"step": 0.2}
    *_, last = march(system, np.array([10.0, 0.0, 0.0, 0.0]), [0.0, 100.0], scheme=scheme, **control)
    assert abs(last.stored) < 1e-12
    assert last.temperatures == pytest.approx(1.0, abs=1e-3 if scheme == "adaptive" else 1e-9)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_restart_gives_the_same_bits(scheme):
    system, initial = with_algebraic()
    control = {"tolerance": 1e-5} if scheme == "adaptive" else {"step": 0.07}
    times = [0.0, 0.3, 0.6, 0.9, 2.0]  # 0.9 - 0.6 and 0.3 differ by round-off
    whole = list(march(system, initial, times, scheme=scheme, **control))
    again = list(march(system, initial, times, scheme=scheme, restart=whole[2], **control))
    assert len(again) == 2
    for a, b in zip(whole[3:], again, strict=True):
        assert a.temperatures.tobytes() == b.temperatures.tobytes()
        assert a.heat.tobytes() == b.heat.tobytes()
        assert (a.time, a.stored, a.steps, a.iterations, a.step) == (b.time, b.stored, b.steps, b.iterations, b.step)


@pytest.mark.parametrize("scheme", ["backward-euler", "crank-nicolson", "bdf2", "adaptive"])
def test_inconsistent_initial_values_do_not_alternate(scheme):
    """One stiff node and one without capacity, both far from what their neighbours make of them."""
    system = chain([1.0, 1e-6, 1.0, 0.0, 1.0], [0.0] * 4 + [1.0])
    initial = np.array([1.0, 500.0, 1.0, -500.0, 1.0])
    control = {"tolerance": 1e-3} if scheme == "adaptive" else {"steps": 1}
    states = list(march(system, initial, np.arange(0.0, 4.0, 0.1), scheme=scheme, **control))
    assert states[0].temperatures[3] == 1.0  # fitted to its neighbours
    for state in states[4:]:  # an L-stable step damps 500 K by its stiffness, 1e5, and two follow in bdf2
        T = state.temperatures
        assert T[1] == pytest.approx(0.5 * (T[0] + T[2]), abs=1e-3)
        assert T[3] == pytest.approx(0.5 * (T[2] + T[4]), abs=1e-12)


@pytest.mark.parametrize("make", [varied, with_algebraic])
def test_critical_step_is_where_explicit_marching_turns_unstable(make):
    system, initial = make()
    critical = critical_step(system)
    assert gershgorin_step(system) <= critical * (1.0 + 1e-12)
    K, d = system.conductance.toarray(), np.flatnonzero(system.capacity > 0)
    a = np.flatnonzero(system.capacity == 0)
    S = K[np.ix_(d, d)] - K[np.ix_(d, a)] @ np.linalg.solve(K[np.ix_(a, a)], K[np.ix_(a, d)])
    assert critical == pytest.approx(2.0 / np.linalg.eigvals(S / system.capacity[d, None]).real.max(), rel=1e-10)
    amplitude = []
    for factor in (0.999, 1.001):  # by hand, as `march` refuses the second
        T, h = initial[d].copy(), factor * critical
        for _ in range(20_000):
            T -= h * (S @ T) / system.capacity[d]
        amplitude.append(np.abs(T).max())
    assert amplitude[0] < 1.0
    assert amplitude[1] > 1e3
    list(march(system, initial, [0.0, 0.999 * critical], scheme="explicit-euler", steps=1))
    with pytest.raises(InputError, match=f"{1.001 * critical:.6g} s exceeds the critical one of {critical:.6g} s"):
        list(march(system, initial, [0.0, 1.001 * critical], scheme="explicit-euler", steps=1))


def test_critical_step_of_a_long_chain_by_lanczos():
    n = 2000
    capacity = np.full(n, 3.0)
    # eigenvalues of the free chain: 2 - 2 cos(pi k / n)
    assert critical_step(chain(capacity, np.zeros(n))) == pytest.approx(
        2.0 * 3.0 / (2.0 + 2.0 * np.cos(np.pi / n)), rel=1e-7
    )


@given(
    seed=st.integers(2, 10_000),
    scheme=st.sampled_from(["explicit-euler", "backward-euler"]),
)
@settings(max_examples=25)
def test_maximum_principle(seed, scheme):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 12))
    links = rng.uniform(0.0, 1.0, n) * (rng.uniform(size=n) < 0.4)
    capacity = rng.uniform(0.1, 1.0, n) * (rng.uniform(size=n) < 0.7)
    capacity[0] = 1.0
    initial = rng.uniform(-1.0, 1.0, n)
    system = chain(capacity, links, ambient=lambda _: 0.3)
    # half the critical step keeps 1 - h K_ii / C_i positive for what Gershgorin bounds
    h = 0.5 * gershgorin_step(system) if scheme == "explicit-euler" else float(rng.uniform(0.01, 10.0))
    previous = None
    stores = capacity > 0
    for state in march(system, initial, h * np.arange(6), scheme=scheme, steps=1):
        T = state.temperatures
        if previous is not None:
            low, high = min(previous[stores].min(), 0.3), max(previous[stores].max(), 0.3)
            assert low - 1e-12 <= T.min() <= T.max() <= high + 1e-12
        previous = T


def test_multigrid_steps_agree_with_factorised_ones(monkeypatch):
    n = 3000
    rng = np.random.default_rng(12)
    links = np.zeros(n)
    links[0] = 1.0
    system = chain(rng.uniform(0.5, 2.0, n), links, ambient=lambda _: 1.0)
    factorised = list(march(system, np.zeros(n), [0.0, 50.0, 100.0], scheme="bdf2", steps=5))
    build = step_matrix_module.build_preconditioner
    built = []

    def counted(matrix, exact_level):
        built.append(matrix.shape)
        return build(matrix, exact_level)

    monkeypatch.setattr(step_matrix_module, "build_preconditioner", counted)
    multigrid = list(march(system, np.zeros(n), [0.0, 50.0, 100.0], scheme="bdf2", steps=5, exact_level=600))
    assert built == [(1, 1), (n, n)]  # one hierarchy for all steps, the starter's other rate included
    assert multigrid[-1].iterations > factorised[-1].iterations
    assert multigrid[-1].temperatures == pytest.approx(factorised[-1].temperatures, abs=1e-8)
    assert abs(multigrid[-1].imbalance) < 1e-11 * multigrid[-1].stored


def test_separate_components_each_keep_their_balance():
    K = csr_matrix(np.kron(np.eye(2), [[1.0, -1.0], [-1.0, 1.0]]))
    matrix = step_matrix(K, np.ones(4), 0.5, 1e-10)
    b = np.array([1.0, 0.0, 5.0, -2.0])
    x, _ = matrix.solve(b, np.zeros(4))
    residual = b - (K @ x + 0.5 * x)
    assert residual.reshape(2, 2).sum(axis=1) == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"scheme": "heun"}, "unknown scheme 'heun'"),
        ({"step": None}, "needs either a step"),
        ({"steps": 3}, "needs either a step"),
        ({"step": -1.0}, "the step must be positive"),
        ({"scheme": "adaptive", "tolerance": 0.0}, "the tolerance must be positive"),
        ({"scheme": "adaptive", "steps": 5}, "chooses its steps"),
        ({"times": [0.0, 0.0]}, "increasing output times"),
        ({"initial": np.ones(3)}, "of shape"),
    ],
)
def test_arguments_that_are_refused(change, message):
    system, initial = varied()
    arguments = {"initial": initial, "times": [0.0, 1.0], "step": 0.1} | change
    with pytest.raises(InputError, match=message):
        list(march(system, **arguments))


def test_undetermined_temperatures_are_refused():
    system = HeatSystem(np.array([1.0, 0.0]), csr_matrix((2, 2)), lambda _: np.zeros(2))
    with pytest.raises(InputError, match="1 node"):
        list(march(system, np.ones(2), [0.0, 1.0], steps=1))
    with pytest.raises(InputError, match=r"found -1 at node 1"):
        HeatSystem(np.array([1.0, -1.0]), csr_matrix((2, 2)), lambda _: np.zeros(2))


def test_a_source_that_is_not_finite_is_named():
    system = chain([1.0, 1.0], [0.0, 1.0], source=lambda t: np.nan if t > 0.5 else 0.0)
    for scheme, control in (("bdf2", {"steps": 10}), ("adaptive", {})):
        with pytest.raises(ConvergenceError, match=r"check the sources and walls"):
            list(march(system, np.ones(2), [0.0, 1.0], scheme=scheme, **control))


def radiating(power=4):
    """C dT/dt = -T^p of one node: a conductance T^(p-1) to an ambient of 0."""

    def at(_, T):
        return HeatSystem(np.ones(1), csr_matrix([[float(T[0]) ** (power - 1)]]), lambda _: np.zeros(1))

    return HeatSystem(np.ones(1), csr_matrix([[1.0]]), lambda _: np.zeros(1), at=at)


@pytest.mark.parametrize(("scheme", "order"), [("backward-euler", 1), ("bdf2", 2)])
def test_a_conductance_that_follows_the_temperature(scheme, order):
    """dT/dt = -T^4: T = (T_0^-3 + 3 t)^(-1/3); the heat stored is the heat that came in."""
    errors = []
    for steps in (10, 20, 40, 80):
        *_, last = march(radiating(), np.full(1, 1.2), [0.0, 0.4, 1.0], scheme=scheme, steps=steps)
        errors.append(abs(last.temperatures[0] - (1.2**-3 + 3.0) ** (-1.0 / 3.0)))
        assert abs(last.imbalance) < 1e-14
        assert last.stored == pytest.approx(last.temperatures[0] - 1.2, rel=1e-12)
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders[-1] == pytest.approx(order, abs=0.15)


def test_a_restart_of_a_nonlinear_march_has_the_same_bits():
    whole = list(march(radiating(), np.full(1, 1.2), [0.0, 0.4, 0.8, 1.0], scheme="bdf2", step=0.02))
    for state in whole[:-1]:
        again = list(march(radiating(), np.full(1, 1.2), [0.0, 0.4, 0.8, 1.0], scheme="bdf2", step=0.02, restart=state))
        assert again[-1].temperatures.tobytes() == whole[-1].temperatures.tobytes()
        assert again[-1].heat.tobytes() == whole[-1].heat.tobytes()


def test_what_a_nonlinear_march_refuses():
    with pytest.raises(InputError, match=r"scheme backward-euler or bdf2, found 'crank-nicolson'"):
        next(march(radiating(), np.ones(1), [0.0, 1.0], scheme="crank-nicolson", steps=5))
    with pytest.raises(ConvergenceError, match="take smaller steps"):
        list(march(radiating(12), np.full(1, 3.0), [0.0, 1.0], scheme="backward-euler", steps=1))
