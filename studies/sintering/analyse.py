"""Conductivity of disks that grow into each other: ``python analyse.py out.nc [figure.png]``

Against the upper Hashin-Shtrikman bound of a solid with insulating pores, k f/(2 - f). The bound is rigorous here,
because the body is the union of the disks and f its exact area.
"""

from __future__ import annotations

import sys

import numpy as np
import xarray as xr

from etc_engine.models import CATALOGUE
from etc_engine.output.figures.canvas import COLOURS, GREY, INK, MARKERS, legend, new_panels, save


def main(result: str = "out.nc", picture: str = "figure.png") -> None:
    data = xr.open_dataset(result)
    k = data["conductivity"]
    k = 0.5 * (k.sel(direction_i="x", direction_j="x") + k.sel(direction_i="y", direction_j="y"))
    mean, error = k.mean("realization"), k.std("realization", ddof=1) / np.sqrt(data["count"])
    solid = data["solid_fraction"].mean("realization")
    coordination = data["coordination"].isel({"method": 0}).mean("realization")
    bound = solid / (2.0 - solid)
    mean_field = data["mean_field_conductivity"].isel({"method": 0}).mean("realization")

    methods = [str(name) for name in data["method"].values]
    print(
        f"{'density':>8s}{'porosity':>10s}{'contacts':>10s}" + "".join(f"{m:>20s}" for m in methods) + f"{'bound':>9s}"
    )
    for density in data["density"].values:
        cell = mean.sel(density=density), error.sel(density=density)
        values = [
            f"{float(cell[0].sel({'method': m})):.4f} +- {float(cell[1].sel({'method': m})):.4f}" for m in methods
        ]
        place = {"density": density}
        head = f"{density:8.2f}{1 - float(solid.sel(place)):10.4f}{float(coordination.sel(place)):10.3f}"
        print(head + "".join(f"{value:>20s}" for value in values) + f"{float(bound.sel(place)):9.4f}")
    inside = bool((mean <= bound).all())
    print(f"every mean keeps the bound: {inside}")
    if {"standard", "chord"} <= set(methods):
        gain = mean.sel({"method": "chord"}) / mean.sel({"method": "standard"}) - 1.0
        print(f"chord over standard: {100 * float(gain.min()):+.1f} % to {100 * float(gain.max()):+.1f} %")

    figure, (axes,) = new_panels(height=4.4)
    for method, colour, marker in zip(methods, COLOURS, MARKERS, strict=False):
        values, bars = mean.sel({"method": method}), error.sel({"method": method})
        look = {"color": colour, "marker": marker, "markersize": 4, "capsize": 2}
        axes.errorbar(1.0 - solid, values, bars, label=f"simulation, {method}", **look)
    axes.plot(1.0 - solid, mean_field, "--", color=GREY, label=CATALOGUE["contact_mean_field"].label)
    models = {
        "hashin_shtrikman_upper": (bound, "-"),
        "differential_inverse": (solid**2, "-."),
        "effective_medium": (2.0 * solid - 1.0, ":"),
    }
    for name, (values, line) in models.items():
        axes.plot(1.0 - solid, values, line, color=INK, linewidth=0.9, label=CATALOGUE[name].label)
    axes.invert_xaxis()
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("porosity (exact area outside the disks) [-]")
    axes.set_ylabel("conductivity over that of the solid [-]")
    legend(figure, loc="outside upper center", ncols=2)
    save(figure, picture)


if __name__ == "__main__":
    main(*sys.argv[1:])
