"""A single spherical inclusion between walls (Haddad et al. 2021, Figs. 14 to 16 and Table 2).

``python studies/haddad2021/inclusion.py [--particles 10000] [--contact 30000] [--output DIRECTORY]`` writes
inclusion.csv, fields.csv and inclusion.png. With temperatures on two faces and four adiabatic ones the sphere
of radius L/3 is one of a simple cubic array, whose conductivity is known exactly.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from etc_engine.box import Box
from etc_engine.engines.lattice.flux import probe
from etc_engine.engines.lattice.homogenize import medium_lattice, node_conductivities
from etc_engine.engines.lattice.network import link_conductances
from etc_engine.engines.lattice.steady import conductivity_tensor, solve_between_walls
from etc_engine.medium.medium import Medium, Pores
from etc_engine.models.arrays import simple_cubic
from etc_engine.output.figures import save
from etc_engine.output.figures.lattice import draw_inclusion
from etc_engine.packing.particles import ParticlePacking

HERE = Path(__file__).parent
SEED = 20214
CONTRASTS = np.array([0.01, 0.1, 0.5, 2.0, 5.0, 10.0, 100.0])
FRACTION = 4.0 * np.pi / 81.0
LENGTH, MATRIX, INCLUSION = 0.1, 33.0, 165.0
POINTS = np.array([[0.5, 0.5, 0.5], [0.08, 0.5, 0.5], [0.5, 0.92, 0.5]]) * LENGTH
EXACT = {"temperature": (30.0, 30.0, 33.5111), "flux": (7767.43, 2309.24, 6433.6)}
PUBLISHED = {"temperature": (30.0, 30.0, 33.5), "flux": (7796.0, 2370.0, 6183.0)}  # 150 000 particles


def composite(contrast: float, matrix: float = 1.0) -> Medium:
    """The inclusion in its box."""
    sphere = ParticlePacking([[0.5 * LENGTH] * 3], [LENGTH / 3.0], Box((LENGTH,) * 3))
    return Medium(sphere, contrast * matrix, pores=Pores(matrix))


def conduct(particles: int, transmission: str) -> tuple[int, np.ndarray]:
    """Nodes, and the mean conductivity along the axes at every contrast, on one lattice."""
    rng = np.random.default_rng([SEED, particles])
    made = medium_lattice(composite(2.0), particles, rng, boundary="walls", transmission=transmission)
    bare = conductivity_tensor(made.lattice, link_conductances(made.lattice)).tensor if transmission == "contact" else 1
    found = []
    for contrast in CONTRASTS:
        k = node_conductivities(composite(contrast), made.owner)
        tensor = conductivity_tensor(made.lattice, link_conductances(made.lattice, k)).tensor
        found.append(np.nanmean(np.diag(tensor / bare)))
    return made.lattice.count, np.array(found)


def fields(particles: int) -> tuple[np.ndarray, np.ndarray]:
    """Temperatures and sizes of the heat flux at the points of Table 2, on the fitted lattice."""
    body = composite(INCLUSION / MATRIX, MATRIX)
    made = medium_lattice(body, particles, np.random.default_rng([SEED, particles]), boundary="walls")
    k = node_conductivities(body, made.owner)
    field = solve_between_walls(made.lattice, link_conductances(made.lattice, k), 1, temperatures=(25.0, 35.0))
    temperatures, fluxes = probe(field, POINTS, k)
    return temperatures, np.linalg.norm(fluxes, axis=1)


def main() -> None:
    """Print and save the tables, draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--particles", type=int, default=10_000)
    parser.add_argument("--contact", type=int, default=30_000, help="particles of the contact lattice")
    parser.add_argument("--output", type=Path, default=HERE)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    exact = np.array([float(simple_cubic(1.0, contrast, FRACTION)) for contrast in CONTRASTS])
    results, errors = {}, {}
    for transmission, count in (("laguerre", arguments.particles), ("contact", arguments.contact)):
        start = time.perf_counter()
        nodes, found = conduct(count, transmission)
        label = f"{'fitted Laguerre' if transmission == 'laguerre' else 'contact'}, {nodes} nodes"
        results[label] = (CONTRASTS, found)
        errors[label] = (CONTRASTS, 100.0 * (found / exact - 1.0))
        print(f"{label}: {time.perf_counter() - start:.1f} s", flush=True)
    table = np.column_stack((CONTRASTS, exact, *[v for _, v in results.values()], *[e for _, e in errors.values()]))
    header = "contrast,exact,laguerre,contact,laguerre_error_percent,contact_error_percent"
    np.savetxt(arguments.output / "inclusion.csv", table, fmt="%.7g", delimiter=",", header=header, comments="")
    print("contrast      exact   laguerre    contact  laguerre %  contact %")
    for row in table:
        print(f"{row[0]:8g} {row[1]:10.6f} {row[2]:10.6f} {row[3]:10.6f} {row[4]:11.4f} {row[5]:10.3f}")
    fine = np.geomspace(0.01, 100.0, 81)
    curve = np.array([float(simple_cubic(1.0, contrast, FRACTION)) for contrast in fine])
    save(draw_inclusion(fine, curve, results, errors), arguments.output / "inclusion.png")
    temperatures, fluxes = fields(arguments.contact)
    rows = []
    for i, name in enumerate("ABC"):
        rows.append([temperatures[i], EXACT["temperature"][i], fluxes[i], EXACT["flux"][i], PUBLISHED["flux"][i]])
        print(
            f"{name}: T {temperatures[i]:.4f} (exact {EXACT['temperature'][i]:.4f}, published "
            f"{PUBLISHED['temperature'][i]:.1f}), q {fluxes[i]:.1f} (exact {EXACT['flux'][i]:.1f}, published "
            f"{PUBLISHED['flux'][i]:.0f})"
        )
    header = "temperature,temperature_exact,flux,flux_exact,flux_published"
    np.savetxt(arguments.output / "fields.csv", np.array(rows), fmt="%.7g", delimiter=",", header=header, comments="")


if __name__ == "__main__":
    main()
