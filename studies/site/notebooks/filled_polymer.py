# %% [markdown]
# # A filled polymer
#
# Silica spheres of 1.5 W/(m K) in an epoxy of 0.195 W/(m K). How much filler does a conductivity of 0.3 W/(m K)
# need, and which formula can be trusted? Install the extra `plot`.

# %%
import matplotlib.pyplot as plt
import numpy as np

from etc_engine import Box, Medium, PackingSpec, Pores, effective_conductivity, evaluate_model, pack, parse_radii
from etc_engine.models import CATALOGUE
from etc_engine.sweep.statistics import interval

EPOXY, SILICA = 0.195, 1.5  # W/(m K)

# %% [markdown]
# ## Random cells
#
# Three periodic cells of 40 equal spheres per fraction. The medium is the packing, its conductivity, and the matrix
# that fills the pores.


# %%
def cell(fraction: float, number: int) -> Medium:
    """Return spheres of a volume fraction in the matrix."""
    box = Box((1.0, 1.0, 1.0), periodic=(True, True, True))
    spec = PackingSpec("lubachevsky-stillinger", parse_radii("equal"), box, count=40, density=fraction)
    packing = pack(spec, np.random.default_rng([20337, round(100 * fraction), number]))
    return Medium(packing, SILICA, pores=Pores(EPOXY))


# %% [markdown]
# ## Conductivity
#
# The engine `voxel` solves the cell by FFT on 24³ voxels. `model_error` estimates the error of that grid. Here it is
# wider than the interval: take a finer `resolution` before you use the numbers.

# %%
FRACTIONS = (0.1, 0.25, 0.4)
results, grid_errors = [], []
for fraction in FRACTIONS:
    solved = [effective_conductivity(cell(fraction, number), engine="voxel", resolution=24) for number in range(3)]
    results.append(interval([np.trace(one.tensor) / 3.0 for one in solved], confidence=0.95))
    grid_errors.append(max(one.model_error for one in solved))
    k = results[-1]
    print(f"fraction {fraction}: {k.mean:.4f} [{k.low:.4f}, {k.high:.4f}] W/(m K), grid {grid_errors[-1]:.1%}")

# %% [markdown]
# ## The picture
#
# Maxwell's formula is the lower Hashin-Shtrikman bound. The third-order model also knows how hard spheres are
# arranged.

# %%
mean = np.array([one.mean for one in results])
half = [mean - [one.low for one in results], [one.high for one in results] - mean]
f = np.linspace(0.0, 0.45, 50)
plt.errorbar(FRACTIONS, mean, half, fmt="o", capsize=3, label="computed, 3 cells")
for name, style in (("maxwell", "--"), ("third_order", "-"), ("effective_medium", ":")):
    plt.plot(f, evaluate_model(name, k1=EPOXY, k2=SILICA, fraction=f, dimension=3), style, label=CATALOGUE[name].label)
plt.axhline(0.3, color="0.8", zorder=0)
plt.xlabel("volume fraction of silica")
plt.ylabel("conductivity [W/(m K)]")
plt.legend()
plt.savefig("filled_polymer.png", dpi=110, bbox_inches="tight")
