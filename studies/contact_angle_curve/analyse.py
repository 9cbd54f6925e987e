"""Conductivity over the contact half-angle: ``python analyse.py out.nc [figure.png]``

Against the contact mean field and the law of small angles. A narrow arc alpha adds the resistance
(1/pi kappa)(ln 1/alpha + c) to each side of a contact, so that 1/k is linear in ln 1/alpha. c follows from the flux
through the arc: 3/2 if it is uniform (standard), ln 4 if the arc is isothermal (chord, arc). The interaction of the
contacts of a particle shifts both by the same amount.
"""

from __future__ import annotations

import sys

import numpy as np
import xarray as xr

from etc_engine.output.figures.canvas import COLOURS, INK, MARKERS, legend, new_panels, save

SMALL = 0.2  # [degree] up to here the law is fitted
C = {"standard": 1.5, "chord": np.log(4.0), "arc": np.log(4.0)}


def main(result: str = "out.nc", picture: str = "figure.png") -> None:
    data = xr.open_dataset(result).squeeze("density")
    k = data["conductivity"]
    k = 0.5 * (k.sel(direction_i="x", direction_j="x") + k.sel(direction_i="y", direction_j="y"))
    mean = k.mean("realization")
    mean_field = data["mean_field_conductivity"].sel({"method": "chord"}).mean("realization")

    log = np.log(1.0 / np.deg2rad(data["contact_angle"])).rename("log")
    small = data["contact_angle"] <= SMALL
    # The packings are the same for all angles: their scatter drops out of the law, fitted to the mean.
    intercepts = {}
    print(f"{'method':>10s}{'slope':>10s}{'c':>9s}{'largest departure up to ' + f'{SMALL:g}°':>32s}")
    for method in data["method"].values:
        inverse = 1.0 / mean.sel({"method": method})
        slope, intercept = np.polyfit(log[small], inverse[small], 1)
        departure = np.abs(1.0 - (slope * log + intercept) / inverse)[small].max()
        intercepts[str(method)] = intercept / slope
        print(f"{method:>10s}{slope:10.4f}{intercept / slope:9.4f}{100 * float(departure):30.3f} %")
    reference = "standard"
    for method, c in C.items():
        if method in intercepts and reference in intercepts and method != reference:
            found = intercepts[method] - intercepts[reference]
            print(f"c({method}) - c({reference}): {found:+.4f} found, {c - C[reference]:+.4f} expected")
    ratio = mean.sel({"method": "chord"}) / mean_field
    print(f"chord over contact mean field: {float(ratio.min()):.4f} to {float(ratio.max()):.4f}")

    figure, (left, right) = new_panels(1, 2)
    for method, colour, marker in zip(data["method"].values, COLOURS, MARKERS, strict=False):
        cell, look = mean.sel({"method": method}), {"color": colour, "marker": marker, "markersize": 4}
        left.plot(data["contact_angle"], cell, label=str(method), **look)
        right.plot(log, 1.0 / cell, linestyle="none", **look)
    left.plot(data["contact_angle"], mean_field, "--", color=INK, linewidth=0.9, label="contact mean field")
    slope, intercept = np.polyfit(log[small], (1.0 / mean.sel({"method": "chord"}))[small], 1)
    right.plot(
        log, slope * log + intercept, "-", color=INK, linewidth=0.8, label=f"line through chord, up to {SMALL:g}°"
    )
    left.set_xscale("log")
    left.set_ylim(bottom=0.0)
    left.set_xlabel("contact half-angle [degree]")
    left.set_ylabel("conductivity [W m$^{-1}$ K$^{-1}$]")
    right.set_xlabel("ln 1/α [-]")
    right.set_ylabel("1/k [m K W$^{-1}$]")
    legend(left)
    legend(right)
    save(figure, picture)


if __name__ == "__main__":
    main(*sys.argv[1:])
