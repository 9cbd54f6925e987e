"""Meshless against finite elements (scikit-fem) at equal accuracy, and the cost of a 2000-node solution.

Run ``python tests/benchmarks/bench_meshless.py``. Both solve a square that cools from 30 to 0 at its sides
with the same SDIRK2 scheme and number of steps; the mesh is refined until its error is at most twice the
meshless one (their common time steps alone leave finite elements 1.4 to 1.6 times the meshless error).
scikit-fem is not a dependency: without it the comparison is left out.
"""

from __future__ import annotations

import importlib.util
import time
from functools import partial

import numpy as np
from scipy.sparse.linalg import splu

from etc_engine.engines.meshless import Dirichlet, Discretization, HeatProblem, solve_transient
from etc_engine.engines.meshless.discretization import lay_out
from etc_engine.engines.meshless.stepping import GAMMA, StepLibrary, spectral_radius

SIDE, K, INITIAL, END = 3.0, 1.25, 30.0, 1.2
POINTS = np.array([(2.4, 1.5), (2.4, 2.4), (1.8, 1.5), (1.8, 1.8), (1.5, 1.5)])


def exact(t: float) -> np.ndarray:
    n = np.arange(1, 80, 2)
    weight = 4.0 / (n * np.pi) * np.exp(-K * (n * np.pi / SIDE) ** 2 * t)
    x, y = (np.sin(np.outer(POINTS[:, i], n) * np.pi / SIDE) @ weight for i in (0, 1))
    return INITIAL * x * y


def relative_error(found: np.ndarray) -> float:
    return float(np.linalg.norm(found - exact(END)) / np.linalg.norm(exact(END)))


def square() -> HeatProblem:
    return HeatProblem(
        vertices=[(0, 0), (SIDE, 0), (SIDE, SIDE), (0, SIDE)],
        conductivity=K,
        heat_capacity=1.0,
        initial=INITIAL,
        boundary=[Dirichlet(0.0)] * 4,
    )


def best_of(runs: int, work) -> tuple[float, object]:
    """Shortest wall time of several runs, and the answer."""
    seconds, answer = np.inf, None
    for _ in range(runs):
        start = time.perf_counter()
        answer = work()
        seconds = min(seconds, time.perf_counter() - start)
    return seconds, answer


def finite_elements(cells: int, degree: int, steps: int) -> tuple[np.ndarray, int]:
    """Temperatures at the points, and the number of unknowns."""
    import skfem
    from skfem.models.poisson import laplace, mass

    mesh = skfem.MeshTri.init_tensor(*(np.linspace(0.0, SIDE, cells + 1),) * 2)
    element = {1: skfem.ElementTriP1, 2: skfem.ElementTriP2, 3: skfem.ElementTriP3}[degree]()
    basis = skfem.Basis(mesh, element)
    stiffness, capacity = K * skfem.asm(laplace, basis), skfem.asm(mass, basis)
    inner = basis.complement_dofs(basis.get_dofs())
    tau = END / steps
    m, a = capacity[inner][:, inner].tocsc(), stiffness[inner][:, inner].tocsc()
    factors = splu((m + GAMMA * tau * a).tocsc())
    # L2 projection onto functions that vanish at the walls: nodal values of 30 would lose heat
    u = splu(m).solve(capacity[inner] @ np.full(basis.N, INITIAL))
    for _ in range(steps):
        stage = factors.solve(m @ u)
        u = factors.solve(m @ (u + (1.0 - GAMMA) / GAMMA * (stage - u)))
    full = np.zeros(basis.N)
    full[inner] = u
    return basis.probes(POINTS.T) @ full, basis.N


def compare(steps: int) -> None:
    seconds, result = best_of(3, lambda: solve_transient(square(), [END], POINTS, steps=steps))
    ours = relative_error(result.temperature.values[0])
    nodes = result.attrs["nodes"]
    print(f"meshless   {nodes:6d} nodes     {steps} steps  error {ours:.2e}  {seconds:.3f} s", flush=True)
    if importlib.util.find_spec("skfem") is None:
        print("scikit-fem is not installed: no comparison")
        return
    for degree, start in ((1, 16), (2, 5), (3, 3)):
        cells, error, seconds = start, np.inf, 0.0
        while error > 2.0 * ours and seconds < 5.0:
            cells = int(np.ceil(1.25 * cells))
            seconds, (found, unknowns) = best_of(1, partial(finite_elements, cells, degree, steps))
            error = relative_error(found)
        seconds = min(seconds, best_of(2, partial(finite_elements, cells, degree, steps))[0])
        size = f"{unknowns:6d} unknowns  {steps} steps"
        print(f"skfem P{degree}   {size}  error {error:.2e}  {seconds:.3f} s", flush=True)


def compare_high_accuracy() -> None:
    """Laplace inversion against cubic elements with as many steps as 1e-6 takes."""
    for method in ("trefftz", "mfs"):
        work = partial(solve_transient, square(), [END], POINTS, method=method, scheme="laplace")
        seconds, result = best_of(3, work)
        error = relative_error(result.temperature.values[0])
        print(f"meshless   {method:8s} Laplace inversion  error {error:.2e}  {seconds:.3f} s", flush=True)
    if importlib.util.find_spec("skfem") is not None:
        for cells, steps in ((10, 1536), (14, 1536), (20, 1536)):
            seconds, (found, unknowns) = best_of(1, partial(finite_elements, cells, 3, steps))
            error = relative_error(found)
            print(f"skfem P3   {unknowns:6d} unknowns  {steps} steps  error {error:.2e}  {seconds:.3f} s")


def large_system() -> None:
    start = time.perf_counter()
    layout = lay_out(square(), Discretization(boundary=296, interior=1700), "trefftz")
    placed = time.perf_counter()
    step = StepLibrary(layout).get(1.0 / GAMMA, END / 96)
    built = time.perf_counter()
    radius = spectral_radius(step, "sdirk2")
    judged = time.perf_counter()
    source, data = np.ones(len(layout.nodes)), np.ones(layout.collocation.count)
    seconds, _ = best_of(20, lambda: (step.nodal(source, data), step.nodal(source, data)))
    print(f"{len(layout.nodes)} nodes: placed {placed - start:.2f} s, factorised {built - placed:.2f} s")
    print(f"spectral radius {radius:.4f} in {judged - built:.2f} s, one SDIRK2 step {1e3 * seconds:.1f} ms")


if __name__ == "__main__":
    large_system()
    for count in (96, 192):
        compare(count)
    compare_high_accuracy()
