"""Transmission coefficient C_t of the contact lattice over the number of particles (Haddad et al. 2021, Fig. 3).

``python studies/haddad2021/calibration.py [--largest 10000] [--realizations 4] [--output DIRECTORY]`` packs spheres
between walls and in a periodic box, calibrates C_t at a coordination number of 7.5 for the two ways of tying the
faces, and writes calibration.csv and calibration.png. ``--largest 1e5`` takes some minutes, 1e6 most of an hour.
"""

from __future__ import annotations

import argparse
import resource
import time
from pathlib import Path

import numpy as np

from etc_engine.box import Box
from etc_engine.engines.lattice.calibration import calibrate, pack_lattice
from etc_engine.engines.lattice.homogenize import dense_packing
from etc_engine.output.figures import save
from etc_engine.output.figures.lattice import draw_calibration

HERE = Path(__file__).parent
SIZES = (1000, 3000, 10_000, 30_000, 100_000, 300_000, 1_000_000)
SEED = 20211
CUBE = (1.0, 1.0, 1.0)


def measure(count: int, realizations: int) -> dict[str, np.ndarray]:
    """Coefficients of every realization: walls tied by mirrors and by whole particles, periodic, mean field."""
    rows = []
    for number in range(realizations):
        rng = np.random.default_rng([SEED, count, number])
        start = time.perf_counter()
        walled = dense_packing(count, Box(CUBE), rng)
        periodic = pack_lattice(count, CUBE, rng)
        packed = time.perf_counter() - start
        mirror, particle = (calibrate(walled, attachment=word) for word in ("mirror", "particle"))
        bulk = calibrate(periodic)
        rows.append((mirror.coefficient, particle.coefficient, bulk.coefficient, bulk.mean_field, walled.density))
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
        print(
            f"{count:8d} mirror {rows[-1][0]:.4f} particle {rows[-1][1]:.4f} periodic {rows[-1][2]:.4f} mean field "
            f"{rows[-1][3]:.4f} walled density {walled.density:.3f}; packed in {packed:.0f} s, calibrated in "
            f"{time.perf_counter() - start - packed:.1f} s, {memory:.0f} MB",
            flush=True,
        )
    names = ("mirror", "particle", "periodic", "mean_field", "density")
    return dict(zip(names, np.array(rows).T, strict=True))


def main() -> None:
    """Print and save the table, draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--largest", type=float, default=1e4)
    parser.add_argument("--realizations", type=int, default=4, help="at sizes up to 1e4; one beyond")
    parser.add_argument("--output", type=Path, default=HERE)
    arguments = parser.parse_args()
    table = []
    for count in (n for n in SIZES if n <= arguments.largest):
        found = measure(count, arguments.realizations if count <= 10_000 else 1)
        spread = {name: values.std(ddof=1) if values.size > 1 else np.nan for name, values in found.items()}
        means = [(found[name].mean(), spread[name]) for name in ("mirror", "particle", "periodic")]
        table.append([count, *np.ravel(means), found["mean_field"].mean(), found["density"].mean()])
    rows = np.array(table)
    arguments.output.mkdir(parents=True, exist_ok=True)
    header = "particles,mirror,mirror_sd,particle,particle_sd,periodic,periodic_sd,mean_field,walled_density"
    np.savetxt(arguments.output / "calibration.csv", rows, fmt="%.6g", delimiter=",", header=header, comments="")
    for row in rows:
        print(
            f"{row[0]:9.0f}  mirror {row[1]:.4f} (CoV {100 * row[2] / row[1]:.2f} %)  particle {row[3]:.4f}  periodic "
            f"{row[5]:.4f} (CoV {100 * row[6] / row[5]:.2f} %)  mean field {row[7]:.4f}"
        )
    published = np.array([[1e5, 0.806, 0.0], [1e6, 0.834, 0.0]])
    series = {
        "walls, mirrored particles": rows[:, [0, 1, 2]],
        "walls, whole particles held": rows[:, [0, 3, 4]],
        "periodic": rows[:, [0, 5, 6]],
        "published": published,
    }
    save(draw_calibration(series, rows[:, [0, 7]]), arguments.output / "calibration.png")


if __name__ == "__main__":
    main()
