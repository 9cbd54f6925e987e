"""Meshless against finite elements (scikit-fem) at equal accuracy, and the cost of a 2000-node solution.

Run ``python tests/benchmarks/bench_meshless.py``. Both solve a square that cools from 30 to 0 at its sides with the
same SDIRK2 scheme and number of steps; the mesh is refined until its error is not above the meshless one.
scikit-fem is not a dependency: without it the comparison is left out.
"""

from __future__ import annotations

import importlib.util
import time

import numpy as np
from scipy.sparse.linalg import splu

from etc_engine.meshless import Dirichlet, Discretization, HeatProblem, solve_transient
from etc_engine.meshless.discretization import lay_out
from etc_engine.meshless.stepping import GAMMA, StepLibrary, spectral_radius

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
    # the L2 projection of the constant 30, then zero walls: u holds the inner unknowns
    u = np.full(len(inner), INITIAL)
    for _ in range(steps):
        stage = factors.solve(m @ u)
        u = factors.solve(m @ (u + (1.0 - GAMMA) / GAMMA * (stage - u)))
    full = np.zeros(basis.N)
    full[inner] = u
    return basis.probes(POINTS.T) @ full, basis.N


def compare(steps: int) -> None:
    seconds, result = best_of(3, lambda: solve_transient(square(), [END], POINTS, steps=steps))
    ours = relative_error(result.temperature.values[0])
    print(f"meshless   {result.attrs['nodes']:6d} nodes     {steps} steps  error {ours:.2e}  {seconds:.3f} s")
    seconds, inverted = best_of(3, lambda: solve_transient(square(), [END], POINTS, scheme="laplace"))
    error = relative_error(inverted.temperature.values[0])
    print(f"meshless   {inverted.attrs['nodes']:6d} nodes     Laplace    error {error:.2e}  {seconds:.3f} s")
    if importlib.util.find_spec("skfem") is None:
        print("scikit-fem is not installed: no comparison")
        return
    for degree, start in ((1, 20), (2, 8), (3, 4)):
        cells = start
        while True:
            seconds, (found, unknowns) = best_of(1, lambda c=cells, d=degree: finite_elements(c, d, steps))
            error = relative_error(found)
            if error <= 1.05 * ours or seconds > 30.0:
                break
            cells = int(np.ceil(1.25 * cells))
        seconds = min(seconds, best_of(2, lambda c=cells, d=degree: finite_elements(c, d, steps))[0])
        print(f"skfem P{degree}   {unknowns:6d} unknowns  {steps} steps  error {error:.2e}  {seconds:.3f} s")


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
    print(
        f"{len(layout.nodes)} nodes: placing nodes {placed - start:.2f} s, factorising {built - placed:.2f} s, "
        f"spectral radius ({radius:.4f}) {judged - built:.2f} s, one SDIRK2 step {1e3 * seconds:.1f} ms"
    )


if __name__ == "__main__":
    for count in (96, 192):
        compare(count)
    large_system()
