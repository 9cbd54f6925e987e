"""Do density and contact angle act apart? ``python analyse.py out.nc [collapse.png]``

Reads the result of study.toml (or full.toml) with xarray alone; copy it for your own sweeps.
"""

from __future__ import annotations

import sys

import numpy as np
import xarray as xr
from matplotlib.figure import Figure


def main(result: str = "out.nc", picture: str = "collapse.png") -> None:
    data = xr.open_dataset(result)
    k = data["conductivity"]
    k = 0.5 * (k.sel(direction_i="x", direction_j="x") + k.sel(direction_i="y", direction_j="y"))
    mean, sem = k.mean("realization"), k.std("realization", ddof=1) / np.sqrt(data["count"])

    # The same packing serves all angles: the ratio to the contact mean field has little noise in the angle.
    ratio = mean / data["mean_field_conductivity"].where(k.notnull()).mean("realization")
    spread = (ratio.max("contact_angle") - ratio.min("contact_angle")) / ratio.mean("contact_angle")

    print(f"{'density':>8s}{'n':>5s}{'ratio to the mean field':>26s}{'spread over the angles':>25s}")
    for density in data["density"].values:
        cell = ratio.sel(density=density)
        n = int(data["count"].sel(density=density).min())
        print(f"{density:8.3f}{n:5d}{float(cell.mean()):26.4f}{100 * float(spread.sel(density=density)):23.2f} %")

    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    for i, angle in enumerate(data["contact_angle"].values):
        cell, error = mean.sel(contact_angle=angle), sem.sel(contact_angle=angle)
        left.errorbar(data["density"], cell, error, marker="osD^v<>P"[i % 8], capsize=2, label=f"{angle:g}°")
        right.plot(data["density"], ratio.sel(contact_angle=angle), marker="osD^v<>P"[i % 8], label=f"{angle:g}°")
    left.set_ylabel("conductivity [W m$^{-1}$ K$^{-1}$]")
    right.set_ylabel("conductivity over contact mean field [-]")
    for axes in (left, right):
        axes.set_xlabel("density [-]")
        axes.set_ylim(bottom=0.0)
        axes.grid(alpha=0.3)
    left.legend(title="contact half-angle", frameon=False)
    figure.savefig(picture, dpi=130)


if __name__ == "__main__":
    main(*sys.argv[1:])
