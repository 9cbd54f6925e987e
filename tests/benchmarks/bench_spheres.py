"""Spheres in contact: cost of an element, and of a whole solve from file to tensor.

Run by hand: ``OMP_NUM_THREADS=1 python tests/benchmarks/bench_spheres.py [--spheres 1e3 1e4 1e5]``. Prints microseconds
per element of six and of twelve contacts by each method, then a table over the number of spheres: seconds of
``etc-engine solve FILE --periodic xyz --axis all --json`` (start of the interpreter included), its peak memory less
that of a run with 27 spheres, unknowns and iterations. The bed is a cubic array with vacancies and random radii.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from etc_engine.box import Box
from etc_engine.engines.dtem.methods import find_method, flux_modes
from etc_engine.medium.rules import overlap_contacts
from etc_engine.medium.sides import contact_sides
from etc_engine.packing.particles import ParticlePacking

MEASURE = """
import sys
from etc_engine.cli import run
status = run(sys.argv[1:])
with open("/proc/self/status") as lines:
    print(next(line.split()[1] for line in lines if line.startswith("VmHWM")), file=sys.stderr)
raise SystemExit(status)
"""


def lattice(name: str, degrees: float, cells: int) -> ParticlePacking:
    """Unit spheres of a simple cubic (6 contacts) or face-centred (12) lattice."""
    basis = {"sc": [[0, 0, 0]], "fcc": [[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]]}[name]
    edge = 2.0 * np.cos(np.radians(degrees)) * {"sc": 1.0, "fcc": np.sqrt(2.0)}[name]
    corners = np.stack(np.meshgrid(*[np.arange(cells)] * 3, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    centers = (corners + np.array(basis)).reshape(-1, 3) * edge + 0.1
    return ParticlePacking(centers, np.ones(len(centers)), Box((cells * edge,) * 3, (True,) * 3))


def bed(count: int, seed: int = 91) -> ParticlePacking:
    """About that many overlapping spheres in a periodic box."""
    rng = np.random.default_rng(seed)
    edge = round((count / 0.95) ** (1.0 / 3.0))
    centers = np.stack(np.meshgrid(*[np.arange(edge)] * 3, indexing="ij"), axis=-1).reshape(-1, 3) + 0.5
    kept = rng.random(len(centers)) < 0.95
    centers = centers[kept] + rng.uniform(-0.004, 0.004, (kept.sum(), 3))
    return ParticlePacking(centers, rng.uniform(0.503, 0.512, len(centers)), Box((float(edge),) * 3, (True,) * 3))


def element_costs() -> None:
    """Microseconds per element, compiled and warm."""
    print("microseconds of the processor per element")
    for name, contacts, cells in (("sc", 6, 12), ("fcc", 12, 8)):
        for degrees in (2.0, 5.0, 10.0, 20.0):
            packing = lattice(name, degrees, cells)
            sides = contact_sides(overlap_contacts(packing))
            line = [f"{contacts:2d} contacts of {degrees:4.1f} degrees:"]
            for method in ("chord", "standard", "exact"):
                make, modes = find_method(method, 3).elements, flux_modes(method, None, 3)
                make(sides, np.ones(packing.count), modes)
                start = time.process_time()
                make(sides, np.ones(packing.count), modes)
                line.append(f"{method} {(time.process_time() - start) / packing.count * 1e6:.1f}")
            print("  ".join(line))


def processor_seconds() -> float:
    """Of all programs started so far and ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def solve(packing: ParticlePacking, folder: Path) -> tuple[tuple[float, float], float, dict[str, object]]:
    """Seconds by the clock and of the processor, peak memory [MB] and result of the command."""
    path = folder / "bed.csv"
    np.savetxt(
        path, np.c_[packing.centers, packing.radii], delimiter=",", header="x,y,z,radius", comments="", fmt="%.17g"
    )
    box = ",".join(f"{length:g}" for length in packing.box.lengths)
    words = ["solve", str(path), "--box", box, "--periodic", "xyz", "--axis", "all", "--json"]
    start, used = time.perf_counter(), processor_seconds()
    done = subprocess.run([sys.executable, "-c", MEASURE, *words], capture_output=True, text=True, check=True)
    seconds = time.perf_counter() - start, processor_seconds() - used
    return seconds, float(done.stderr.split()[-1]) / 1024.0, json.loads(done.stdout)


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--spheres", type=float, nargs="+", default=[1e3, 1e4, 1e5])
    counts = [int(n) for n in parser.parse_args().spheres]
    element_costs()
    with tempfile.TemporaryDirectory() as folder:
        solve(bed(27), Path(folder))
        _, least, _ = solve(bed(27), Path(folder))
        print("spheres  contacts  seconds  processor  kB/sphere  k_xx  iterations")
        for count in counts:
            packing = bed(count)
            seconds, memory, result = solve(packing, Path(folder))
            own = (memory - least) * 1024.0 / packing.count
            print(
                f"{packing.count:7d}  {result['contacts']:8d}  {seconds[0]:7.2f}  {seconds[1]:9.2f}  {own:9.2f}  "
                f"{result['conductivity']:.5f}  {result['iterations']}"
            )


if __name__ == "__main__":
    main()
