"""Time and peak memory of every stage of one big solve, next to a direct solver on the same matrix.

Run by hand: ``python tests/benchmarks/bench_pipeline.py [--largest 1e6] [--direct 1e5] [--stock]``. Every size runs
in a process of its own, so that the peak memory after each stage is that of this size; kernels are warmed up first.
``--stock`` adds PyAMG's stock Ruge-Stueben CG to a residual of 1e-10, and MKL PARDISO where
pypardiso and the MKL library are installed; the table says what is missing.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time

from etc_engine.solvers import Limits

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402 - after the thread counts are set

STAGES = ("pack", "contacts", "backbone", "sides", "elements", "assemble", "set-up", "solve")
RADII = "uniform:0.01:0.02"
DISKS_PER_AREA = 1098.0  # of this size distribution, measured
ANGLE = np.radians(5.0)


def peak() -> float:
    """Peak resident memory so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def measure(count: int, direct: bool, stock: bool) -> dict:
    """Seconds and peak memory after each stage for about ``count`` disks between walls."""
    from etc_engine.box import Box
    from etc_engine.engines.dtem.assembly import assemble
    from etc_engine.engines.dtem.methods import METHODS
    from etc_engine.medium.backbone import find_backbone
    from etc_engine.medium.loads import contact_lift
    from etc_engine.medium.rules import bonded_contacts
    from etc_engine.medium.sides import contact_sides
    from etc_engine.packing import PackingSpec, pack, parse_radii
    from etc_engine.solvers import build_preconditioner, solve_energy

    seconds, memory = {}, {"start": peak()}

    def timed(stage, work):
        begin = time.perf_counter()
        result = work()
        seconds[stage] = time.perf_counter() - begin
        memory[stage] = peak()
        return result

    edge = float(np.sqrt(count / DISKS_PER_AREA))
    spec = PackingSpec("advancing-front", parse_radii(RADII), Box((edge, edge)))
    packing = timed("pack", lambda: pack(spec, np.random.default_rng(20261)))
    network = timed("contacts", lambda: bonded_contacts(packing, ANGLE))
    backbone = timed("backbone", lambda: find_backbone(network, (0,)))
    reduced = network.select(backbone.contacts, backbone.wall_contacts)
    sides = timed("sides", lambda: contact_sides(reduced))
    elements = timed("elements", lambda: METHODS["chord"].elements(sides, np.ones(packing.count), 1))
    loads = contact_lift(reduced, (0,), backbone.clusters, sides, elements.modes)
    system = timed("assemble", lambda: assemble(elements, *loads))
    preconditioner = timed("set-up", lambda: build_preconditioner(system.matrix))
    rhs, lift = np.ascontiguousarray(system.rhs[:, 0]), float(system.lift_energies[0])
    u, report = timed("solve", lambda: solve_energy(system.matrix, rhs, lift, preconditioner=preconditioner))
    energy = lift - float(u @ (2.0 * rhs - system.matrix @ u))
    out = {
        "disks": packing.count,
        "unknowns": system.matrix.shape[0],
        "iterations": report.iterations,
        "seconds": seconds,
        "memory": memory,
    }
    loose_time, loose = time_of(
        lambda: solve_energy(
            system.matrix,
            rhs,
            lift,
            preconditioner=preconditioner,
            tolerance=1e-8,
            limits=Limits(balance_tolerance=1.0),
        )
    )
    out["to_1e-8"] = loose_time
    out["iterations_1e-8"] = loose[1].iterations
    if direct:
        from scipy.sparse.linalg import splu

        matrix = system.matrix.tocsc()
        out["splu"], exact = time_of(lambda: splu(matrix).solve(rhs))
        out["difference"] = abs(lift - float(exact @ rhs) - energy) / energy
    if stock:
        import pyamg

        out["stock_setup"], solver = time_of(lambda: pyamg.ruge_stuben_solver(system.matrix))
        out["stock_solve"], _ = time_of(lambda: solver.solve(rhs, tol=1e-10, accel="cg"))
        pardiso, out["no_pardiso"] = find_pardiso()
        if pardiso:
            out["pardiso"], _ = time_of(lambda: pardiso(system.matrix, rhs))
    return out


def find_pardiso():
    """The direct solver of MKL, or None and the reason why it cannot run here."""
    try:
        from pypardiso import spsolve
    except ImportError as error:  # pypardiso itself, or the MKL library that it loads
        return None, str(error)
    return spsolve, ""


def time_of(work):
    """Seconds of a call, and its result."""
    begin = time.perf_counter()
    result = work()
    return time.perf_counter() - begin, result


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--largest", type=float, default=1e6)
    parser.add_argument("--direct", type=float, default=1e5, help="largest size for splu")
    parser.add_argument("--stock", action="store_true")
    parser.add_argument("--child", type=int, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.child:
        measure(600, True, False)  # warm-up: compiled kernels, imports
        measure(25_000, False, False)
        print(json.dumps(measure(arguments.child, arguments.child <= arguments.direct, arguments.stock)))
        return
    sizes = [n for n in (10**3, 10**4, 10**5, 10**6) if n <= arguments.largest]
    print(
        "seconds"
        + "".join(f"{stage:>10s}" for stage in ("disks", *STAGES, "iter", "splu", "to 1e-8", "stock RS", "PARDISO"))
    )
    rows = []
    for size in sizes:
        command = [sys.executable, __file__, "--child", str(size), "--direct", str(arguments.direct)]
        done = subprocess.run(
            command + ["--stock"] * arguments.stock, capture_output=True, text=True, check=True, env=os.environ
        )
        row = json.loads(done.stdout)
        rows.append(row)
        stock = row.get("stock_setup", np.nan) + row.get("stock_solve", np.nan)
        numbers = [row["seconds"][stage] for stage in STAGES]
        tail = [row.get("splu", np.nan), row["seconds"]["set-up"] + row["to_1e-8"], stock, row.get("pardiso", np.nan)]
        print(
            f"       {row['disks']:>10d}"
            + "".join(f"{value:10.4f}" for value in numbers)
            + f"{row['iterations']:>10d}"
            + "".join(f"{value:10.3f}" for value in tail),
            flush=True,
        )
    print("\npeak memory [MB] after each stage")
    for row in rows:
        print(f"       {row['disks']:>10d}" + "".join(f"{row['memory'][stage]:10.0f}" for stage in STAGES))
    if len(rows) > 1:
        print("\nexponent of the time between the two largest sizes")
        scale = np.log(rows[-1]["disks"] / rows[-2]["disks"])
        growth = [np.log(rows[-1]["seconds"][s] / rows[-2]["seconds"][s]) / scale for s in STAGES]
        print(" " * 17 + "".join(f"{value:10.2f}" for value in growth))
    if missing := rows[-1].get("no_pardiso"):
        print(f"\nPARDISO not measured: {missing}")
    for row in rows:
        if "difference" in row:
            print(f"energy against splu at {row['disks']} disks: {row['difference']:.1e} relative")


if __name__ == "__main__":
    main()
