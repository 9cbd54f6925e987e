"""Silica spheres in epoxy (Haddad et al. 2021, Fig. 17 and section 5.2).

``python studies/haddad2021/composite.py [--particles 20000] [--full] [--output DIRECTORY]`` packs equal spheres six
to the edge of a periodic cube at volume fractions of 0.1 to 0.5, homogenizes each packing on the fitted lattice and
writes composite.csv and composite.png with models beside it. ``--full`` uses 100 000 lattice particles.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from etc_engine.box import Box
from etc_engine.engines.lattice.homogenize import homogenize_lattice
from etc_engine.medium.medium import Medium, Pores
from etc_engine.models.bounds import hashin_shtrikman_lower, hashin_shtrikman_upper
from etc_engine.models.statistical import third_order
from etc_engine.output.figures import save
from etc_engine.output.figures.lattice import draw_fractions
from etc_engine.packing.lubachevsky_stillinger import compress

HERE = Path(__file__).parent
SEED = 20217
EPOXY, SILICA = 0.195, 1.5
SCALE = 6  # edge of the cube in diameters


def main() -> None:
    """Print and save the table, draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--particles", type=int, default=20_000)
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--fractions", default="0.1,0.2,0.3,0.4,0.5")
    parser.add_argument("--output", type=Path, default=HERE)
    arguments = parser.parse_args()
    particles = 100_000 if arguments.full else arguments.particles
    arguments.output.mkdir(parents=True, exist_ok=True)
    rows = []
    for fraction in map(float, arguments.fractions.split(",")):
        rng = np.random.default_rng([SEED, round(100 * fraction)])
        count = round(fraction * SCALE**3 * 6.0 / np.pi)
        box = Box((1.0, 1.0, 1.0), (True, True, True))
        inclusions = compress(np.ones(count), box, rng, density=fraction).packing
        made = homogenize_lattice(Medium(inclusions, SILICA, pores=Pores(EPOXY)), rng=rng, particles=particles)
        along = np.diag(made.tensor)
        model = float(third_order(EPOXY, SILICA, fraction, dimension=3))
        rows.append([fraction, along.mean(), np.ptp(along) / 2.0, made.model_error, model, made.seconds])
        print(
            f"f = {fraction:.1f}: {count} spheres, {made.unknowns} nodes, k = {along.mean():.5f} W/(m K), axes within "
            f"{100 * np.ptp(along) / along.mean():.2f} %, error estimate {100 * made.model_error:.2f} %, "
            f"third order {model:.5f} ({100 * (along.mean() / model - 1.0):+.2f} %); {made.seconds:.1f} s",
            flush=True,
        )
    table = np.array(rows)
    header = "fraction,conductivity,half_range_of_axes,error_estimate,third_order,seconds"
    np.savetxt(arguments.output / "composite.csv", table, fmt="%.6g", delimiter=",", header=header, comments="")
    fine = np.linspace(0.0, 0.5, 51)
    lines = {
        "Hashin-Shtrikman bounds": (
            np.concatenate((fine, [np.nan], fine)),
            np.concatenate(
                (
                    [float(hashin_shtrikman_lower(EPOXY, SILICA, f, dimension=3)) for f in fine],
                    [np.nan],
                    [float(hashin_shtrikman_upper(EPOXY, SILICA, f, dimension=3)) for f in fine],
                )
            ),
        ),
        "third order": (fine, np.array([float(third_order(EPOXY, SILICA, f, dimension=3)) for f in fine])),
    }
    points = [("fitted lattice", table[:, :3])]
    save(draw_fractions(lines, points), arguments.output / "composite.png")


if __name__ == "__main__":
    main()
