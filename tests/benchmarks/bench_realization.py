"""Processor time of one realization of about a thousand disks with ten contact angles and both directions.

Run by hand: ``OMP_NUM_THREADS=1 python tests/benchmarks/bench_realization.py``. Packing, contacts, elements and solves
of two directions are all in it; kernels are warmed up first.
"""

from __future__ import annotations

import time

import numpy as np

from etc_engine import Box, PackingSpec, parse_radii
from etc_engine.realization import Conduction, RealizationSpec, realize


def main() -> None:
    """Print the median over ten realizations, with the reduced basis and with every angle solved."""
    packing = PackingSpec(
        "advancing-front", parse_radii("uniform:0.01:0.02"), Box((0.97, 0.97)), density=0.75, radius_growth=False
    )
    angles = {"contact_angle": tuple(np.radians(np.linspace(1.0, 15.0, 10)))}
    for curve in ("reduced", "full"):
        conduction = (Conduction("dtem", "chord", {"angle_curve": curve}),)
        spec = RealizationSpec(packing, "bonded", conduction, {"particle_conductivity": 1.0, "bond_gap": 1e-6}, angles)
        realize(spec, np.random.default_rng(5))
        seconds = []
        for seed in range(6, 16):
            begin = time.process_time()
            result = realize(spec, np.random.default_rng(seed))
            seconds.append(time.process_time() - begin)
        median, packed = 1e3 * np.median(seconds), 1e3 * result.pack_seconds
        print(f"{curve:8s} {result.particles} disks: {median:.1f} ms, of which packing {packed:.1f} ms")


if __name__ == "__main__":
    main()
