"""The pipe network of one bed of spheres between walls, solved here and by OpenPNM: processor time and agreement.

Run by hand: ``python tests/benchmarks/bench_networks.py [--particles 2.7e4]``, the wheel ``openpnm`` installed. Both
solve the same conductances to the steady state: particles are pores, contacts throats, and each contact with a driven
wall a throat to a pore at the temperature of the wall. Each time holds the making of the matrix, OpenPNM's that of its
network too. OpenPNM uses SciPy's direct solver and PyAMG's Ruge-Stueben.
"""

from __future__ import annotations

import argparse
import os
import time
from importlib.util import find_spec

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402 - after the thread counts are set
from bench_dimensions import bed  # noqa: E402

from etc_engine.box import Box  # noqa: E402
from etc_engine.medium.backbone import find_backbone  # noqa: E402
from etc_engine.medium.conductances import contact_conductances  # noqa: E402
from etc_engine.medium.links import solve_links  # noqa: E402
from etc_engine.medium.medium import Medium  # noqa: E402
from etc_engine.medium.network import ContactNetwork  # noqa: E402
from etc_engine.medium.rules import bonded_contacts  # noqa: E402
from etc_engine.packing.particles import ParticlePacking  # noqa: E402

ANGLE = np.radians(5.0)


def walled(count: int) -> ContactNetwork:
    """Contacts of about that many spheres between walls."""
    periodic = bed(3, count)
    return bonded_contacts(ParticlePacking(periodic.centers, periodic.radii, Box(periodic.box.lengths)), ANGLE)


def by_openpnm(network: ContactNetwork, C: np.ndarray, C_wall: np.ndarray, solver: str) -> tuple[float, float]:
    """Processor seconds, and heat flow from the low wall [W]."""
    import openpnm

    start = time.process_time()
    backbone = find_backbone(network, (0,))  # OpenPNM refuses particles that no contact leads to
    kept = np.flatnonzero(backbone.wall_contacts)
    n = network.packing.count
    ends = np.stack([network.wall_particles[kept], n + np.arange(kept.size)], axis=1)
    throats = np.concatenate([network.pairs[backbone.contacts], ends])
    used, throats = np.unique(throats, return_inverse=True)
    centers = np.concatenate([network.packing.centers, network.packing.centers[network.wall_particles[kept]]])[used]
    net = openpnm.network.Network(coords=centers, conns=throats.reshape(-1, 2))
    phase = openpnm.phase.Phase(network=net)
    phase["throat.thermal_conductance"] = np.concatenate([C[backbone.contacts], C_wall[kept]])
    low = np.flatnonzero(used >= n)[network.walls[kept] == 0]
    far = np.flatnonzero(used >= n)[network.walls[kept] == 1]
    fourier = openpnm.algorithms.FourierConduction(network=net, phase=phase)
    fourier.set_value_BC(pores=low, values=1.0)
    fourier.set_value_BC(pores=far, values=0.0)
    fourier.run(solver=getattr(openpnm.solvers, solver)(), verbose=False)
    return time.process_time() - start, float(np.abs(fourier.rate(pores=low)).item())


def main() -> None:
    """Print the table, or why there is none."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--particles", type=float, default=2.7e4)
    count = int(parser.parse_args().particles)
    if find_spec("openpnm") is None:
        print("skipped: OpenPNM is not installed (pip install openpnm)")
        return
    for size in (1000, count):  # the first loads kernels and libraries
        network = walled(size)
        C, C_wall = contact_conductances(Medium(network.packing, 1.0, network))
        start = time.process_time()
        heat = solve_links(network, (0,), C, C_wall).wall_heat()[0]
        own = time.process_time() - start
        solvers = ("ScipySpsolve", "PyamgRugeStubenSolver")
        theirs = {name: by_openpnm(network, C, C_wall, name) for name in solvers}
    print(f"{network.packing.count} spheres, {network.count} contacts; etc_engine {own:.2f} s of the processor")
    for name, (seconds, flow) in theirs.items():
        print(
            f"OpenPNM, {name}: {seconds:.2f} s, {seconds / own:.1f} times; heat flow {flow / heat - 1.0:+.1e} relative"
        )


if __name__ == "__main__":
    main()
