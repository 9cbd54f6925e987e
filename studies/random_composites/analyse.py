"""Random disks and spheres against models: ``python analyse.py disks.nc spheres.nc [figure.png]``

Mean over realizations and directions with its 95 % interval, beside the third-order model and the three-point bounds
for hard disks and spheres in equilibrium, all relative to the third-order model.
"""

from __future__ import annotations

import sys

import numpy as np
import xarray as xr
from scipy.stats import t as student

from etc_engine.models.catalogue import find_model
from etc_engine.output.figures.canvas import COLOURS, GREY, INK, MARKERS, TEXT, legend, mark_outside, new_panels, save


def samples(data: xr.Dataset) -> xr.DataArray:
    """Mean of the diagonal of every realization."""
    k = data["conductivity"]
    if "method" in k.dims:
        k = k.isel({"method": 0})
    axes = data["direction_i"].values
    return sum(k.sel(direction_i=axis, direction_j=axis) for axis in axes) / len(axes)


def model(name: str, contrast: float, fraction, dimension: int) -> np.ndarray:
    return np.asarray(find_model(name).function(1.0, contrast, fraction, dimension=dimension))


def draw(axes, data: xr.Dataset, title: str) -> tuple[int, int]:
    """One panel and its rows of the table; how many means the three-point bounds hold, and of how many."""
    k = samples(data)
    d = data.sizes["direction_i"]
    axes.set_xlim(0.0, 0.64 if d == 2 else 0.54)
    axes.set_ylim((-12, 25) if d == 2 else (-12, 15))
    fine = np.linspace(0.02, 0.62 if d == 2 else 0.52, 60)
    inside = total = 0
    for i, contrast in enumerate(data["particle_conductivity"].values):
        at = k.sel(particle_conductivity=contrast)
        x, n = data["density"].values, int(at.sizes["realization"])
        mean = at.mean("realization").values
        half = at.std("realization", ddof=1).values / np.sqrt(n) * student.ppf(0.975, n - 1)
        third, low, high = (model(f, contrast, x, d) for f in ("third_order", "three_point_lower", "three_point_upper"))
        base = model("third_order", contrast, fine, d)
        for name, line in (("three_point_lower", ":"), ("three_point_upper", ":"), ("hashin_shtrikman_lower", "--")):
            curve = 100.0 * (model(name, contrast, fine, d) / base - 1.0)
            axes.plot(fine, curve, line, color=COLOURS[i], linewidth=1.0)
            cut = np.flatnonzero((curve < axes.get_ylim()[0]) | (curve > axes.get_ylim()[1]))[:1]
            mark_outside(axes, fine[cut], curve[cut], COLOURS[i])
        axes.errorbar(
            x + 0.004 * (i - 1),
            100.0 * (mean / third - 1.0),
            100.0 * half / third,
            fmt=MARKERS[i],
            color=COLOURS[i],
            markersize=4,
            capsize=2,
            label=f"contrast {contrast:g}",
        )
        for f, value, width, t, lo, hi in zip(x, mean, half, third, low, high, strict=True):
            total += 1
            inside += lo <= value <= hi
            error = float(data["model_error_estimate"].sel(particle_conductivity=contrast, density=f).mean())
            print(
                f"{d}D {contrast:6g} {f:5.2f} {value:9.5f} +- {width:.5f}  third order {t:9.5f} "
                f"({100.0 * (value / t - 1.0):+6.2f} %)  bounds {lo:.5f} {hi:.5f}  "
                f"grid error estimate {100 * error:.2f} %"
            )
    axes.axhline(0.0, color=INK, linewidth=0.8)
    axes.plot([], [], ":", color=GREY, label="three-point bounds")
    axes.plot([], [], "--", color=GREY, label="Hashin-Shtrikman lower")
    axes.set_title(title, fontsize=TEXT)
    axes.set_xlabel("volume fraction [-]" if d == 3 else "area fraction [-]")
    axes.set_ylabel("difference from the third-order model [%]")
    return int(inside), total


def main(disks: str = "disks.nc", spheres: str = "spheres.nc", picture: str = "figure.png") -> None:
    figure, panels = new_panels(1, 2, 4.2)
    counts = []
    for axes, path, title in zip(panels, (disks, spheres), ("hard disks", "hard spheres"), strict=True):
        with xr.open_dataset(path) as data:
            counts.append(draw(axes, data, title))
    legend(figure, *panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=5)
    save(figure, picture)
    for (inside, total), name in zip(counts, ("disks", "spheres"), strict=True):
        print(f"{name}: {inside} of {total} means between the three-point bounds")


if __name__ == "__main__":
    main(*sys.argv[1:])
