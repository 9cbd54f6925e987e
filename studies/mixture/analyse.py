"""Disks of two materials over their number fraction: ``python analyse.py out.nc figure.png``

A contact of materials i and j conducts in series, g_ij = 2 k_i k_j/(k_i + k_j) in units of a contact of material 1 with
itself. Effective medium for networks of coordination number z (S. Kirkpatrick, Rev. Mod. Phys. 45, 574, 1973), with
independent contacts: sum_b p_b (g_b - g)/(g_b + (z/2 - 1) g) = 0.
"""

from __future__ import annotations

import sys

import numpy as np
import xarray as xr
from scipy.optimize import brentq

from etc_engine.output.figures.canvas import GREY, INK, MARKERS, legend, new_panels, save


def effective_medium(x: float, k1: float, k2: float, z: float) -> float:
    """Conductivity of the mixture over that of material 1 alone."""
    parts = np.array([(1.0 - x) ** 2, 2.0 * x * (1.0 - x), x**2])
    bonds = np.array([k1, 2.0 * k1 * k2 / (k1 + k2), k2])
    low, high = 0.5 * bonds.min(), 2.0 * bonds.max()
    return brentq(lambda g: float(np.sum(parts * (bonds - g) / (bonds + (0.5 * z - 1.0) * g))), low, high) / k1


def main(result: str, picture: str) -> None:
    whole = xr.open_dataset(result).isel(density=0, drop=True).rename(mixture_fraction="fraction")
    k1, k2 = float(whole["particle_conductivity"]), float(whole["mixture_conductivity"])
    k = whole["conductivity"]
    k = 0.5 * (k.sel(direction_i="x", direction_j="x") + k.sel(direction_i="y", direction_j="y"))
    if not (whole["fraction"] == 0.0).any():
        raise SystemExit("one fraction has to be 0.0, the packings of material 1 alone")
    # The packings are the same for all fractions: relative to the pure one, their scatter drops out.
    relative = k / k.sel(fraction=0.0)
    mean = relative.mean("realization")
    error = relative.std("realization", ddof=1) / np.sqrt(relative.sizes["realization"])
    z = float(whole["coordination"].mean())
    x = whole["fraction"].values
    medium = np.array([effective_medium(value, k1, k2, z) for value in x])

    angles = whole["contact_angle"].values
    print(f"z = {z:.3f}; conductivity over that of material 1 alone")
    print(f"{'fraction':>9s}" + "".join(f"{f'{a:g} degrees':>22s}" for a in angles) + f"{'effective medium':>18s}")
    for i, value in enumerate(x):
        cells = [
            (float(mean.isel(fraction=i).sel(contact_angle=a)), float(error.isel(fraction=i).sel(contact_angle=a)))
            for a in angles
        ]
        print(f"{value:9.2f}" + "".join(f"{m:12.4f} +- {e:.4f}" for m, e in cells) + f"{medium[i]:18.4f}")
    for angle in angles:
        off = 100.0 * (mean.sel(contact_angle=angle) / medium - 1.0)
        print(f"{angle:g} degrees: {float(off.min()):+.1f} % to {float(off.max()):+.1f} % off the effective medium")

    figure, (axes,) = new_panels(height=4.2)
    fine = np.linspace(0.0, 1.0, 101)
    for angle, marker, fill in zip(angles, MARKERS, ("full", *["none"] * len(MARKERS)), strict=False):
        axes.errorbar(
            x,
            mean.sel(contact_angle=angle),
            error.sel(contact_angle=angle),
            fmt=marker,
            fillstyle=fill,
            markersize=5,
            capsize=2,
            label=f"simulation, {angle:g}°",
        )
    axes.plot(
        fine,
        [effective_medium(value, k1, k2, z) for value in fine],
        "-",
        color=INK,
        linewidth=0.9,
        label=f"effective medium of a network, z = {z:.2f}",
    )
    axes.plot(fine, (k2 / k1) ** fine, ":", color=GREY, linewidth=1.2, label="geometric mean")
    axes.set_yscale("log")
    axes.set_xlabel("number fraction of the better conductor [-]")
    axes.set_ylabel("conductivity over that of material 1 alone [-]")
    legend(axes)
    save(figure, picture)


if __name__ == "__main__":
    main(*sys.argv[1:])
