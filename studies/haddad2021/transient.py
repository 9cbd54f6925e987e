"""Transients of a slab and of a ball against the exact series (Haddad et al. 2021, Figs. 5, 7 and 8).

``python studies/haddad2021/transient.py [--largest 10000] [--output DIRECTORY]`` writes slab.csv, slab.png, ball.csv
and ball.png: temperatures on the Laguerre lattice and on the calibrated contact lattice.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from etc_engine.box import Box
from etc_engine.engines.lattice.body import SURFACE, ball_lattice
from etc_engine.engines.lattice.calibration import calibrate, pack_lattice
from etc_engine.engines.lattice.exact import ball_temperature, slab_temperature
from etc_engine.engines.lattice.homogenize import dense_packing
from etc_engine.engines.lattice.network import contact_lattice, laguerre_lattice, link_conductances
from etc_engine.engines.lattice.transient import heat_system
from etc_engine.medium.walls import FixedTemperature
from etc_engine.output.figures import save
from etc_engine.output.figures.lattice import draw_ball, draw_slab
from etc_engine.solvers.marching import march

HERE = Path(__file__).parent
SEED = 20215
LENGTH, TIMES = 0.1, (0.0, 0.05, 0.1, 0.2)
STEEL = {"conductivity": 33.0, "heat_capacity": 7800.0 * 0.9}
ALUMINIUM = {"conductivity": 185.0, "heat_capacity": 2700.0 * 900.0}
BALL_TIMES = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 7.0, 10.0, 14.0, 20.0])


def slab(count: int) -> tuple[dict, dict]:
    """Errors of both lattices over time, and the profiles of the Laguerre lattice."""
    rng = np.random.default_rng([SEED, count])
    packing = dense_packing(count, Box((LENGTH,) * 3), rng)
    errors, profiles = {}, {}
    lattices = {
        "Laguerre": laguerre_lattice(packing),
        "contact": contact_lattice(packing, transmission=calibrate(packing).coefficient),
    }
    for name, lattice in lattices.items():
        start = time.perf_counter()
        conductances = link_conductances(lattice, STEEL["conductivity"])
        walls = {2: FixedTemperature(25.0), 3: FixedTemperature(35.0)}
        system = heat_system(lattice, conductances, STEEL["heat_capacity"], walls)
        linked = system.conductance.diagonal() > 0.0
        y = packing.centers[:, 1]
        worst = []
        for state in march(system, np.full(count, 25.0), TIMES, scheme="bdf2", steps=60):
            if state.time == 0.0:
                continue
            exact = slab_temperature(
                y, state.time, diffusivity=STEEL["conductivity"] / STEEL["heat_capacity"], length=LENGTH,
                initial=25.0, low=25.0, high=35.0,
            )  # fmt: skip
            relative = 100.0 * np.abs(state.temperatures / exact - 1.0)[linked]
            worst.append((relative.max(), float(np.sqrt((relative**2).mean()))))
            if name == "Laguerre":
                profiles[state.time] = (y / LENGTH, state.temperatures, exact)
        errors[name] = np.array(worst)
        text = ", ".join(f"{largest:.3f} % (rms {rms:.3f} %)" for largest, rms in worst)
        print(
            f"slab, {count} particles, {name}: largest error {text} at 0.05, 0.1, 0.2 s; unlinked {(~linked).sum()}; "
            f"{time.perf_counter() - start:.1f} s",
            flush=True,
        )
    return errors, profiles


def ball(count: int, transmission: str) -> tuple[int, np.ndarray]:
    """Nodes, and the temperature at the centre of the aluminium ball at the times."""
    rng = np.random.default_rng([SEED, count, len(transmission)])
    coefficient = 1.0
    if transmission == "contact":
        coefficient = calibrate(pack_lattice(4000, (1.0,) * 3, rng)).coefficient
    lattice = ball_lattice(0.5 * LENGTH, count, rng, transmission=transmission, coefficient=coefficient)
    conductances = link_conductances(lattice, ALUMINIUM["conductivity"])
    system = heat_system(lattice, conductances, ALUMINIUM["heat_capacity"], {SURFACE: FixedTemperature(200.0)})
    away = lattice.packing.centers - 0.5 * np.asarray(lattice.packing.box.lengths)
    near = np.argsort(np.linalg.norm(away, axis=1))[:20]
    squares = np.column_stack((np.ones(near.size), (away[near] ** 2).sum(axis=1)))
    states = march(system, np.full(lattice.count, 20.0), BALL_TIMES, scheme="bdf2", steps=40)
    # near the centre T = T_c + b r^2: the value at the centre by least squares
    centre = [np.linalg.lstsq(squares, state.temperatures[near], rcond=None)[0][0] for state in states]
    return lattice.count, np.array(centre)


def main() -> None:
    """Print and save the tables, draw the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--largest", type=int, default=10_000)
    parser.add_argument("--output", type=Path, default=HERE)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    errors, profiles = slab(arguments.largest)
    times = np.array(TIMES[1:])
    series = {f"{name}, {arguments.largest} particles": (times, e[:, 0]) for name, e in errors.items()}
    series["published, 100 000 particles"] = (times, np.full(3, 0.7))
    save(draw_slab(profiles, series), arguments.output / "slab.png")
    table = np.column_stack((times, *errors.values()))
    header = "time,laguerre_largest_percent,laguerre_rms_percent,contact_largest_percent,contact_rms_percent"
    np.savetxt(arguments.output / "slab.csv", table, fmt="%.5g", delimiter=",", header=header, comments="")
    draw_balls(arguments.largest, arguments.output)


def draw_balls(largest: int, output: Path) -> None:
    """The ball at growing numbers of particles on both lattices."""
    diffusivity = ALUMINIUM["conductivity"] / ALUMINIUM["heat_capacity"]
    body = {"diffusivity": diffusivity, "radius": 0.5 * LENGTH, "initial": 20.0, "surface": 200.0}

    def exact(t: float) -> float:
        return float(ball_temperature(0.0, t, **body)) if t > 0.0 else 20.0

    reference = np.array([exact(t) for t in BALL_TIMES])
    sizes = [n for n in (500, 2000, 10_000, 40_000) if n <= largest]
    centre, worst, rows = {}, {"laguerre": [], "contact": []}, []
    for transmission, found in worst.items():
        for count in sizes:
            start = time.perf_counter()
            nodes, temperatures = ball(count, transmission)
            error = np.abs(temperatures - reference)[1:]
            found.append((nodes, error.max()))
            rows.append([transmission == "laguerre", nodes, *temperatures])
            print(
                f"ball, {transmission:8s} {nodes:6d} nodes: largest error at the centre {error.max():.3f} K, at 10 s "
                f"{error[BALL_TIMES[1:] == 10.0][0]:.3f} K; {time.perf_counter() - start:.1f} s",
                flush=True,
            )
            if count == sizes[-1]:
                centre[f"{transmission}, {nodes} nodes"] = (BALL_TIMES, temperatures)
    fine = np.linspace(0.0, 20.0, 201)
    errors = {name: tuple(np.array(found).T) for name, found in worst.items()}
    save(draw_ball(fine, np.array([exact(t) for t in fine]), centre, errors), output / "ball.png")
    header = "laguerre,nodes," + ",".join(f"T_at_{t:g}_s" for t in BALL_TIMES)
    rows.append([-1, 0, *reference])
    np.savetxt(output / "ball.csv", np.array(rows), fmt="%.7g", delimiter=",", header=header, comments="")


if __name__ == "__main__":
    main()
