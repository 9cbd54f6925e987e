"""Cells of touching disks: time and memory. ``python tests/benchmarks/bench_cell.py [DISKS] [CONTRAST]``"""

from __future__ import annotations

import resource
import sys
import time

import numpy as np

from etc_engine import Box, PackingSpec, pack, parse_radii
from etc_engine.engines.dtem.cell.geometry import cell_geometry
from etc_engine.engines.dtem.cell.steady import build_model, solve_model


def main(disks: float = 1e4, contrast: float = 100.0) -> None:
    mean = np.sqrt(0.8 / np.pi / disks)
    radii = parse_radii(f"uniform:{0.67 * mean}:{1.33 * mean}")
    packing = pack(PackingSpec("advancing-front", radii, Box((1.0, 1.0))), np.random.default_rng(3))
    for run in ("first (compiles)", "second"):
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        times = [time.process_time()]
        geometry = cell_geometry(packing.centers, packing.radii, packing.box)
        times.append(time.process_time())
        model = build_model(geometry, np.full(packing.count, contrast), 1.0)
        times.append(time.process_time())
        report = solve_model(model, (0,), tolerance=1e-8).reports[0]
        times.append(time.process_time())
        cells, matrix, solve = np.diff(times)
        peak = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / packing.count
        print(
            f"{run}: {packing.count} disks, cells {cells:.2f} s, matrix {matrix:.2f} s, solve {solve:.2f} s "
            f"({report.unknowns} unknowns, {report.iterations} iterations), memory {peak:.1f} kB a disk on top"
        )


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
