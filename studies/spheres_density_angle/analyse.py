"""Beds of spheres in vacuum over density and contact half-angle: ``python analyse.py out.nc [result.png]``.

Reads the result of study.toml with xarray.
"""

from __future__ import annotations

import sys

import numpy as np
import xarray as xr

from etc_engine.output.figures.canvas import COLOURS, INK, MARKERS, legend, new_panels, save


def main(result: str = "out.nc", picture: str = "result.png") -> None:
    data = xr.open_dataset(result)
    tensor = data["conductivity"]
    third = sum(tensor.sel(direction_i=axis, direction_j=axis) for axis in "xyz") / 3.0
    mean, sem = third.mean("realization"), third.std("realization", ddof=1) / np.sqrt(data["count"])
    field = data["mean_field_conductivity"].mean("realization")
    coordination = data["coordination"].mean("realization").isel(contact_angle=0)
    radius = np.sin(np.radians(data["contact_angle"]))

    print("density  coordination  " + "  ".join(f"k/(c/R) at {a:g}" for a in data["contact_angle"].values))
    for density in data["density"].values:
        scaled = (mean / radius).sel(density=density)
        row = "  ".join(f"{float(v):14.4f}" for v in scaled)
        print(f"{density:7.2f}  {float(coordination.sel(density=density)):12.2f}  {row}")
    print("over the contact mean field")
    for density in data["density"].values:
        print(f"{density:7.2f}  " + "  ".join(f"{float(v):6.3f}" for v in (mean / field).sel(density=density)))

    figure, (left, right) = new_panels(1, 2)
    angles = data["contact_angle"]
    for density, colour, marker in zip(data["density"].values, COLOURS, MARKERS, strict=False):
        own = {"color": colour, "marker": marker, "markersize": 4}
        left.errorbar(
            angles,
            mean.sel(density=density),
            sem.sel(density=density),
            capsize=2,
            label=f"density {density:.2f}",
            **own,
        )
        right.plot(angles, (mean / radius).sel(density=density), **own)
        right.plot(angles, (field / radius).sel(density=density), ":", color=colour)
    left.set_ylabel("conductivity over that of the spheres [-]")
    right.set_ylabel("the same over contact radius/radius [-]")
    right.plot([], [], ":", color=INK, label="contact mean field")
    for axes in (left, right):
        axes.set_xlabel("contact half-angle [degrees]")
    legend(figure, loc="outside upper center", ncols=3)
    save(figure, picture)


if __name__ == "__main__":
    main(*sys.argv[1:])
