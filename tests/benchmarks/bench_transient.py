"""Time of an implicit step on the pipe network of a bed, and the same network by OpenPNM.

Run by hand: ``python tests/benchmarks/bench_transient.py [--largest 1e6] [--openpnm 1e4]``. The bed is heated from
its left wall in steps of a hundredth of its diffusion time. With OpenPNM installed (``pip install openpnm``) the
steady network and a transient to a given accuracy are solved by both, in one run and on one core, and the answers are
compared; OpenPNM marches explicitly, by SciPy's RK45.
"""

from __future__ import annotations

import argparse
import os
import time
import warnings
from importlib.util import find_spec

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402 - after the thread counts are set

from etc_engine.box import Box  # noqa: E402
from etc_engine.engines.pipe.steady import pipe_conductivity  # noqa: E402
from etc_engine.medium.conductances import contact_conductances  # noqa: E402
from etc_engine.medium.medium import medium_of  # noqa: E402
from etc_engine.medium.network import ContactNetwork, bonded_contacts  # noqa: E402
from etc_engine.medium.walls import FixedTemperature  # noqa: E402
from etc_engine.packing import PackingSpec, pack, parse_radii  # noqa: E402
from etc_engine.realization import transient_system  # noqa: E402
from etc_engine.solvers.marching import march  # noqa: E402

RADII = "uniform:0.01:0.02"
DISKS_PER_AREA = 1098.0  # of this size distribution, measured
STEPS = 10


def bed(count: int) -> ContactNetwork:
    """About so many disks between walls, bonded at 5 degrees."""
    edge = float(np.sqrt(count / DISKS_PER_AREA))
    spec = PackingSpec("advancing-front", parse_radii(RADII), Box((edge, edge)))
    return bonded_contacts(pack(spec, np.random.default_rng(20265)), np.radians(5.0), 1e-3)


def timed(work):
    """Seconds and result."""
    begin = time.perf_counter()
    result = work()
    return time.perf_counter() - begin, result


def implicit_steps(count: int) -> None:
    """Seconds of the set-up and of a step of every implicit scheme, by multigrid and by a factorisation."""
    network = bed(count)
    build, system = timed(
        lambda: transient_system(medium_of(network, heat_capacity=1.0), {"left": FixedTemperature(1.0)}, engine="pipe")
    )
    disks = network.packing.count
    scale = network.packing.box.lengths[0] ** 2 * 0.8 / 0.19  # about its diffusion time, rho c = kappa = 1
    cases = [(scheme, 500) for scheme in ("backward-euler", "crank-nicolson", "bdf2")] + [("bdf2", 2_000_000)]
    for scheme, level in cases:
        told: list[float] = []
        times = [0.0, 0.01 * scale * STEPS]
        begin = time.perf_counter()
        march_it = march(
            system.heat,
            system.initial(0.0),
            times,
            scheme=scheme,
            steps=STEPS,
            exact_level=level,
            progress=lambda _, told=told: told.append(time.perf_counter()),
        )
        *_, last = march_it
        step = float(np.median(np.diff(told)))
        kind = "multigrid" if level < disks else "factors  "
        first = told[0] - begin
        print(
            f"{disks:8d} disks  {scheme:15s} {kind}  system {build:7.2f} s, set-up and first step {first:7.2f} s, "
            f"a step {step:8.4f} s, {last.iterations / last.steps:5.1f} iterations, "
            f"imbalance {abs(last.imbalance) / last.stored:.1e} of the heat stored"
        )


def against_openpnm(count: int) -> None:
    """The steady network and a transient, by both."""
    network = bed(count)
    disks = network.packing.count
    ours_steady, result = timed(lambda: pipe_conductivity(medium_of(network), axes=(0,)))
    theirs_steady, (project, theirs_k, kept) = timed(lambda: openpnm_steady(network, result))
    print(
        f"{disks:8d} disks  steady     ours {ours_steady:8.3f} s, OpenPNM {theirs_steady:8.3f} s, ratio "
        f"{theirs_steady / ours_steady:6.1f}, k {result.tensor[0, 0]:.10f} and {theirs_k:.10f}"
    )
    walls = {"left": FixedTemperature(1.0), "right": FixedTemperature(0.0)}
    system = transient_system(medium_of(network, heat_capacity=1.0), walls, engine="pipe")
    span = 0.02 * network.packing.box.lengths[0] ** 2
    tolerance = 1e-4
    times = [0.0, span]
    ours, (_, last) = timed(
        lambda: list(march(system.heat, system.initial(0.0), times, scheme="adaptive", tolerance=tolerance))
    )
    theirs, temperatures = timed(lambda: openpnm_transient(project, network, system, kept, span, tolerance))
    *_, exact = march(system.heat, system.initial(0.0), times, scheme="adaptive", tolerance=1e-8)
    reached = [np.abs(found - exact.temperatures[kept]).max() for found in (last.temperatures[kept], temperatures)]
    print(
        f"{disks:8d} disks  transient  ours {ours:8.3f} s, OpenPNM {theirs:8.3f} s, ratio {theirs / ours:6.1f}, "
        f"largest errors {reached[0]:.1e} and {reached[1]:.1e} K after {span:.3g} s"
    )


def openpnm_steady(network: ContactNetwork, ours):
    """OpenPNM's project of the spanning cluster, its conductivity, and the particles in it."""
    import openpnm

    n = network.packing.count
    between, at_wall = contact_conductances(medium_of(network))
    clusters = ours.solutions[0].backbone.clusters
    touching = [np.unique(clusters[network.wall_particles[network.walls == wall]]) for wall in (0, 1)]
    kept = np.flatnonzero(np.isin(clusters, np.intersect1d(*touching)))
    row = np.full(n, -1)
    row[kept] = np.arange(kept.size)
    inside = row[network.pairs[:, 0]] >= 0
    driven = (network.walls < 2) & (row[network.wall_particles] >= 0)
    wall_pores = kept.size + np.arange(int(driven.sum()))
    pairs = np.concatenate([row[network.pairs[inside]], np.stack([row[network.wall_particles[driven]], wall_pores], 1)])
    coords = np.concatenate([network.packing.centers[kept], network.packing.centers[network.wall_particles[driven]]])
    pores = openpnm.network.Network(conns=np.sort(pairs, axis=1), coords=np.c_[coords, np.zeros(len(coords))])
    phase = openpnm.phase.Phase(network=pores)
    phase["throat.thermal_conductance"] = np.concatenate([between[inside], at_wall[driven]])
    hot = wall_pores[network.walls[driven] == 0]
    cold = wall_pores[network.walls[driven] == 1]
    flow = openpnm.algorithms.FourierConduction(network=pores, phase=phase)
    flow.set_value_BC(pores=hot, values=1.0)
    flow.set_value_BC(pores=cold, values=0.0)
    flow.run(solver=openpnm.solvers.ScipySpsolve())
    lengths = network.packing.box.lengths
    return (pores, phase, hot, cold), float(np.sum(flow.rate(pores=hot))) * lengths[0] / lengths[1], kept


def openpnm_transient(project, network, system, kept, span, tolerance):
    """Temperatures of the kept particles at the end of a span, by OpenPNM's explicit integrator."""
    import openpnm

    pores, phase, hot, cold = project
    pores["pore.volume"] = np.concatenate([system.heat.capacity[kept], np.ones(pores.Np - kept.size)])
    flow = openpnm.algorithms.TransientFourierConduction(network=pores, phase=phase)
    flow.set_value_BC(pores=hot, values=1.0)
    flow.set_value_BC(pores=cold, values=0.0)
    integrator = openpnm.integrators.ScipyRK45(rtol=1e-12, atol=tolerance)
    flow.run(x0=0.0, tspan=(0.0, span), saveat=span, integrator=integrator)
    return np.asarray(flow.x)[: kept.size]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--largest", type=float, default=1e6)
    parser.add_argument("--openpnm", type=float, default=1e4, help="disks of the comparison; 0 leaves it out")
    arguments = parser.parse_args()
    list(
        march(
            transient_system(medium_of(bed(100), heat_capacity=1.0), {}, engine="pipe").heat,
            np.zeros(bed(100).packing.count),
            [0.0, 1.0],
            steps=1,
        )
    )  # warm up
    for count in (10_000, 100_000, 1_000_000):
        if count <= arguments.largest:
            implicit_steps(count)
    if not arguments.openpnm:
        return
    if find_spec("openpnm") is None:
        print("OpenPNM is not installed: pip install openpnm")
        return
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import openpnm  # its import takes no part in the times

        openpnm.Workspace().settings["loglevel"] = 50
        against_openpnm(500)  # warm up
        against_openpnm(int(arguments.openpnm))


if __name__ == "__main__":
    main()
