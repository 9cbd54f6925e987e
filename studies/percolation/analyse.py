"""Percolation threshold and exponent of a packing with vacancies: ``python analyse.py out.nc [figure.png]``

Fits k = a (phi - phi_c)^t to the means, each weighted by its standard error, over windows of the density. t is
universal in two dimensions, 1.30 (D. Stauffer and A. Aharony, Introduction to Percolation Theory, 2nd ed., 1992).
"""

from __future__ import annotations

import sys

import numpy as np
import xarray as xr
from scipy.optimize import curve_fit
from scipy.stats import t as student

from etc_engine.output.figures.canvas import COLOURS, GREY, INK, legend, new_panels, save

UNIVERSAL = 1.30


def law(phi, threshold, exponent, log_prefactor):
    return log_prefactor + exponent * np.log(np.maximum(phi - threshold, 1e-12))


def fit(phi, k, error, confidence=0.95):
    """Constants, half-widths of their intervals, and chi squared per degree of freedom."""
    lowest = phi.min()
    bounds = ([0.0, 0.1, -20.0], [lowest - 1e-9, 10.0, 20.0])
    start = (lowest - 0.1 * np.ptp(phi), UNIVERSAL, 0.0)
    values, covariance = curve_fit(law, phi, np.log(k), p0=start, sigma=error / k, bounds=bounds)
    spare = phi.size - 3
    chi2 = np.sum(((law(phi, *values) - np.log(k)) * k / error) ** 2) / spare
    return values, student.ppf(0.5 + 0.5 * confidence, spare) * np.sqrt(np.diag(covariance)), chi2


def main(result: str = "out.nc", picture: str = "figure.png") -> None:
    data = xr.open_dataset(result)
    k = data["conductivity"]
    k = 0.5 * (k.sel(direction_i="x", direction_j="x") + k.sel(direction_i="y", direction_j="y"))
    mean = k.mean("realization")
    error = k.std("realization", ddof=1) / np.sqrt(data["count"])
    spanning = (data["status"] == 0).mean("realization")
    phi, mean, error = data["density"].values, mean.values, error.values

    print(f"{'density':>8s}{'conductivity':>26s}{'part that spans both ways':>27s}")
    for row in zip(phi, mean, error, spanning.values, strict=True):
        print("{:8.3f}{:14.5f} +- {:.5f}{:27.2f}".format(*row))
    windows = [phi.max(), 0.5 * (phi.min() + phi.max())]
    for top in windows:
        used = (phi <= top) & (mean > 0.0) & (error > 0.0)
        if used.sum() < 5:
            continue
        values, widths, chi2 = fit(phi[used], mean[used], error[used])
        print(
            f"densities to {top:.3g} ({used.sum()}): threshold {values[0]:.4f} +- {widths[0]:.4f}, "
            f"exponent {values[1]:.3f} +- {widths[1]:.3f} (95 %), chi2 {chi2:.2f}; universal {UNIVERSAL:.2f}"
        )
        if top == phi.max():
            threshold, exponent, log_prefactor = values

    figure, (left, right) = new_panels(1, 2)
    fine = np.linspace(threshold + 1e-4, phi.max(), 200)
    curve = np.exp(law(fine, threshold, exponent, log_prefactor))
    left.errorbar(phi, mean, error, fmt="o", markersize=4, capsize=2, label="simulation")
    left.plot(fine, curve, "-", color=INK, linewidth=0.8, label="fitted power law")
    left.axvline(threshold, color=GREY, linestyle=":", label=f"threshold {threshold:.4f}")
    left.set_xlabel("density [-]")
    above = phi > threshold
    right.errorbar(phi[above] - threshold, mean[above], error[above], fmt="o", markersize=4, capsize=2)
    right.plot(fine - threshold, curve, "-", color=INK, linewidth=0.8, label=f"exponent {exponent:.3f}")
    right.plot(
        fine - threshold,
        curve[-1] * ((fine - threshold) / (fine[-1] - threshold)) ** UNIVERSAL,
        "--",
        color=COLOURS[1],
        linewidth=0.9,
        label=f"universal exponent {UNIVERSAL:.2f}",
    )
    right.set_xscale("log")
    right.set_yscale("log")
    right.set_xlim(0.5 * (phi[above] - threshold).min(), 2.0 * (phi - threshold).max())
    right.set_ylim(0.3 * mean[above].min(), 2.0 * mean.max())
    right.set_xlabel("density above the threshold [-]")
    for axes in (left, right):
        axes.set_ylabel("conductivity [W m$^{-1}$ K$^{-1}$]")
        legend(axes)
    save(figure, picture)


if __name__ == "__main__":
    main(*sys.argv[1:])
