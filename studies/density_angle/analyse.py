"""Joint effect of density, contact angle and pore conductivity: ``python analyse.py out.nc [collapse.png]``

Reads the result of study.toml (or full.toml) with xarray. Copy the script for your own sweeps.
"""

from __future__ import annotations

import sys

import numpy as np
import xarray as xr

from etc_engine.output.figures.canvas import COLOURS, INK, MARKERS, legend, new_panels, save


def maxwell(solid: xr.DataArray, pores: float, fraction: xr.DataArray) -> xr.DataArray:
    """Maxwell's formula for disks in a fluid."""
    beta = (solid - pores) / (solid + pores)
    return pores * (1.0 + fraction * beta) / (1.0 - fraction * beta)


def main(result: str = "out.nc", picture: str = "collapse.png") -> None:
    data = xr.open_dataset(result)
    if "pore_conductivity" not in data["conductivity"].dims:
        data = data.expand_dims(pore_conductivity=[0.0])
    k = data["conductivity"]
    k = 0.5 * (k.sel(direction_i="x", direction_j="x") + k.sel(direction_i="y", direction_j="y"))
    mean = k.mean("realization")
    network = mean.sel(pore_conductivity=0.0)
    count = k.sel(pore_conductivity=0.0).notnull().sum("realization")

    # The same packing serves all angles: the ratio to the contact mean field has little noise in the angle.
    field = data["mean_field_conductivity"]
    field = field.sel(pore_conductivity=0.0) if "pore_conductivity" in field.dims else field
    ratio = network / field.where(k.sel(pore_conductivity=0.0).notnull()).mean("realization")
    spread = (ratio.max("contact_angle") - ratio.min("contact_angle")) / ratio.mean("contact_angle")

    print("pores that insulate:")
    print(f"{'density':>8s}{'n':>5s}{'ratio to the mean field':>26s}{'spread over the angles':>25s}")
    for density in data["density"].values:
        cell = ratio.sel(density=density)
        n = int(count.sel(density=density).min())
        print(f"{density:8.3f}{n:5d}{float(cell.mean()):26.4f}{100 * float(spread.sel(density=density)):23.2f} %")

    fraction = data["solid_fraction"].mean("realization")
    for pores in data["pore_conductivity"].values[1:]:
        together = network + maxwell(xr.ones_like(network), float(pores), fraction)
        error = 100.0 * (together / mean.sel(pore_conductivity=pores) - 1.0)
        print(f"pores of {pores:g}: contact network alone + Maxwell's pores, against the simulation [%]")
        for density in data["density"].values:
            row = "".join(f"{float(v):10.1f}" for v in error.sel(density=density).transpose("contact_angle").values)
            print(f"{density:8.3f}{row}")

    sem = k.std("realization", ddof=1) / np.sqrt(k.notnull().sum("realization"))
    figure, (left, right) = new_panels(1, 2)
    lines = ("-", "--", ":", "-.")
    for angle, colour, marker in zip(data["contact_angle"].values, COLOURS, MARKERS, strict=False):
        look = {"color": colour, "marker": marker, "markersize": 4}
        for pores, line in zip(data["pore_conductivity"].values, lines, strict=False):
            cell = mean.sel(contact_angle=angle, pore_conductivity=pores)
            error = sem.sel(contact_angle=angle, pore_conductivity=pores)
            left.errorbar(data["density"], cell, error, capsize=2, linestyle=line, **look)
        right.plot(data["density"], ratio.sel(contact_angle=angle), label=f"half-angle {angle:g}°", **look)
    for pores, line in zip(data["pore_conductivity"].values, lines, strict=False):
        left.plot([], [], line, color=INK, label=f"pores {pores:g} W/(m K)" if pores else "insulating pores")
    left.set_ylabel("conductivity [W m$^{-1}$ K$^{-1}$]")
    right.set_ylabel("conductivity over contact mean field [-]")
    for axes in (left, right):
        axes.set_xlabel("density [-]")
        axes.set_ylim(bottom=0.0)
    legend(figure, loc="outside upper center", ncols=3)
    save(figure, picture)


if __name__ == "__main__":
    main(*sys.argv[1:])
