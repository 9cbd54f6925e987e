# %% [markdown]
# # A sintered powder
#
# Spheres in vacuum grow into each other, and their necks widen. How does the conductivity rise as the porosity
# falls? Install the extra `plot`.

# %%
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

from etc_engine import (
    Box,
    PackingSpec,
    ParticlePacking,
    effective_conductivity,
    evaluate_model,
    medium_of,
    overlap_contacts,
    pack,
    parse_radii,
    solid_fraction,
)
from etc_engine.sweep.statistics import interval

# %% [markdown]
# ## Packings
#
# Four random packings of 120 spheres in a periodic box, nearly jammed at a density of 0.62. Their radii then grow by
# a factor. The centres stay where they are, so the spheres overlap in necks.

# %%
BOX = Box((1.0, 1.0, 1.0), periodic=(True, True, True))
SPEC = PackingSpec("lubachevsky-stillinger", parse_radii("equal"), BOX, count=120, density=0.62)
packings = [pack(SPEC, np.random.default_rng([20336, number])) for number in range(4)]


def sintered(packing: ParticlePacking, growth: float) -> ParticlePacking:
    """Return the packing with radii that grew by a factor."""
    return replace(packing, radii=packing.radii * growth)


# %% [markdown]
# ## Conductivity
#
# The rule `overlap` takes every neck from the geometry. The solid conducts 1 W/(m K), so the result is relative to
# it. The mean of the diagonal of the tensor is one sample per packing; `interval` returns the 95 % interval of their
# mean.

# %%
porosities, results = [], []
for growth in (1.02, 1.04, 1.06, 1.08):
    grown = [sintered(packing, growth) for packing in packings]
    tensors = [effective_conductivity(medium_of(overlap_contacts(packing))).tensor for packing in grown]
    porosities.append(1.0 - np.mean([solid_fraction(packing) for packing in grown]))
    results.append(interval([np.trace(tensor) / 3.0 for tensor in tensors], confidence=0.95))
    print(f"porosity {porosities[-1]:.3f}: {results[-1].mean:.4f} [{results[-1].low:.4f}, {results[-1].high:.4f}]")

# %% [markdown]
# ## The picture
#
# The upper Hashin-Shtrikman bound holds for any isotropic body of that porosity. A sintered powder lies far below
# it: the necks decide, not the solid fraction.

# %%
mean = np.array([one.mean for one in results])
half = [mean - [one.low for one in results], [one.high for one in results] - mean]
solid = np.linspace(0.6, 0.9, 50)
plt.errorbar(porosities, mean, half, marker="o", capsize=3, label="sintered spheres, 4 packings")
plt.plot(
    1.0 - solid,
    evaluate_model("hashin_shtrikman_upper", k1=0.0, k2=1.0, fraction=solid, dimension=3),
    "k--",
    label="upper Hashin-Shtrikman bound",
)
plt.gca().invert_xaxis()
plt.xlabel("porosity")
plt.ylabel("conductivity over that of the solid")
plt.ylim(bottom=0.0)
plt.legend()
plt.savefig("sintered_powder.png", dpi=110, bbox_inches="tight")
