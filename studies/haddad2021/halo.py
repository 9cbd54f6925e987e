"""Heat flux in a homogeneous body, averaged over halos (Haddad et al. 2021, Figs. 10 to 12).

``python studies/haddad2021/halo.py [--particles 30000] [--output DIRECTORY]`` writes halo.csv and halo.png: coefficient
of variation of the heat flux over the radius of the halo, on the contact lattice of a periodic box and, between walls,
in the core (halos that reach no wall) and in the wall region; the Laguerre lattice needs no halo.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from etc_engine.box import Box
from etc_engine.engines.lattice.calibration import calibrate, pack_lattice
from etc_engine.engines.lattice.flux import halo_flux, mean_flux, near_wall
from etc_engine.engines.lattice.homogenize import dense_packing
from etc_engine.engines.lattice.network import contact_lattice, laguerre_lattice, link_conductances
from etc_engine.engines.lattice.steady import solve_between_walls, solve_with_gradient
from etc_engine.output.figures import save
from etc_engine.output.figures.lattice import draw_halo

HERE = Path(__file__).parent
RATIOS = (0.0, 2.0, 3.0, 4.0, 6.0, 8.0, 11.0)
SEED = 20219
K, LENGTH, DROP = 33.0, 0.1, 10.0


def variation(values: np.ndarray) -> float:
    """Standard deviation over the mean [%]; NaN of nothing."""
    return float(100.0 * values.std() / abs(values.mean())) if values.size > 1 else np.nan


def main() -> None:
    """Print and save the table, draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--particles", type=int, default=30_000)
    parser.add_argument("--output", type=Path, default=HERE)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(SEED)
    bulk = pack_lattice(arguments.particles, (LENGTH,) * 3, rng)
    walled = dense_packing(arguments.particles, Box((LENGTH,) * 3), rng)
    fields = {}
    for name, packing in (("periodic", bulk), ("walls", walled)):
        lattice = contact_lattice(packing, transmission=calibrate(packing).coefficient)
        conductances = link_conductances(lattice, K)
        if name == "periodic":
            fields[name] = solve_with_gradient(lattice, conductances, 1, tolerance=1e-14)
        else:
            fields[name] = solve_between_walls(lattice, conductances, 1, temperatures=(25.0, 35.0), tolerance=1e-14)
        print(f"{name}: volume average {mean_flux(fields[name]).round(4)} W/m2")
    print(f"(expected {-K} along y for a unit gradient, {-K * DROP / LENGTH} for {DROP} K between walls)")
    rows, shown = [], {}
    for ratio in RATIOS:
        start = time.perf_counter()
        radius = ratio * bulk.radii.mean()
        periodic = halo_flux(fields["periodic"], radius)[:, 1]
        seconds = time.perf_counter() - start
        reach = ratio * walled.radii.mean()
        between = halo_flux(fields["walls"], reach)[:, 1]
        wall = near_wall(fields["walls"].lattice, max(reach, walled.radii.mean()))
        rows.append([ratio, variation(periodic), variation(between[~wall]), variation(between[wall]), seconds])
        if ratio in (0.0, 2.0, 4.0, 11.0):
            shown[f"ratio {ratio:g}"] = periodic / periodic.mean()
        print(
            f"ratio {ratio:4.0f}: CoV periodic {rows[-1][1]:6.2f} %, core {rows[-1][2]:6.2f} %, wall region "
            f"{rows[-1][3]:6.2f} %; {seconds:.3f} s",
            flush=True,
        )
    exact = laguerre_lattice(bulk)
    alone = halo_flux(solve_with_gradient(exact, link_conductances(exact, K), 1, tolerance=1e-20), 0.0)
    print(f"Laguerre lattice, no halo: largest deviation {np.abs(alone / K + [0, 1, 0]).max():.1e} of the mean flux")
    table = np.array(rows)
    header = "ratio,periodic_percent,core_percent,wall_region_percent,seconds"
    np.savetxt(arguments.output / "halo.csv", table, fmt="%.5g", delimiter=",", header=header, comments="")
    spread = {
        "periodic": (table[:, 0], table[:, 1]),
        "walls, core": (table[:, 0], table[:, 2]),
        "walls, wall region": (table[:, 0], table[:, 3]),
        "published": (np.array([0.0, 4.0, 11.0]), np.array([27.0, 5.0, 2.0])),
    }
    save(draw_halo(spread, shown), arguments.output / "halo.png")


if __name__ == "__main__":
    main()
