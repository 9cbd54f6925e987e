"""How large a packing represents the medium: conductivity over system size, periodic against walled.

``python studies/rve_size/analyse.py [--largest 2048] [--output DIRECTORY]`` runs the study at growing sizes with
both boundaries, writes rve_size.nc, table.csv and figure.png, and fits

    k_walls(N) = k_inf (1 - c N^(-1/2)),      Var[k](N) / k_inf^2 = a / N

The effect of a boundary layer falls with the edge length, the variance with the area; a is the integral range in disks.
With 4 a / (N 0.01^2) realizations the error of the mean is 1 % at two sigma.
"""

from __future__ import annotations

import argparse
import tomllib
from pathlib import Path

import numpy as np
import xarray

from etc_engine.output.figures.canvas import COLOURS, INK, legend, new_panels, save
from etc_engine.realization import realize
from etc_engine.study.sweep import Study
from etc_engine.sweep.plan import Unit, unit_rng

HERE = Path(__file__).parent
SIZES = (64, 128, 256, 512, 1024, 2048, 4096)
DISKS_IN_ALL = 20_000  # a size: enough realizations to see its spread


def conductivities(text: str, count: int, periodic: str) -> np.ndarray:
    """Conductivity of each realization at one size, shape (realizations,): half the trace."""
    values = tomllib.loads(text)
    values["packing"] |= {"count": count, "periodic": periodic}
    values["statistics"] |= {"realizations": int(np.clip(DISKS_IN_ALL // count, 10, 200))}
    study = Study.model_validate(values)
    density = study.densities[0]
    spec = study.realization_spec(density)
    traces = [
        np.trace(realize(spec, unit_rng(study.seed, Unit(density, number))).cells[0].conductivity) / 2.0
        for number in range(study.statistics.realizations)
    ]
    return np.array(traces)


def run(largest: int) -> xarray.Dataset:
    """Mean, standard deviation and number of realizations over (boundary, particles)."""
    text = (HERE / "study.toml").read_text()
    sizes = [n for n in SIZES if n <= largest]
    mean, std, number = (np.full((2, len(sizes)), np.nan) for _ in range(3))
    for b, periodic in enumerate(("xy", "")):
        for s, count in enumerate(sizes):
            k = conductivities(text, count, periodic)
            mean[b, s], std[b, s], number[b, s] = k.mean(), k.std(ddof=1), k.size
            print(f"{'periodic' if periodic else 'walls':9s}{count:6d} disks: {k.mean():.5f} +- {k.std(ddof=1):.5f}")
    names = ("boundary", "particles")
    units = {"units": "W m-1 K-1"}
    return xarray.Dataset(
        {
            "conductivity_mean": (names, mean, units),
            "conductivity_std": (names, std, units),
            "realizations": (names, number),
        },
        {"boundary": ["periodic", "walls"], "particles": sizes},
        {"study": text},
    )


def fit(data: xarray.Dataset) -> dict[str, float]:
    """Limit, wall coefficient and integral range by weighted least squares."""
    size = data.particles.values.astype(float)
    error = data.conductivity_std / np.sqrt(data.realizations)
    periodic, walls = data.sel(boundary="periodic"), data.sel(boundary="walls")
    weight = 1.0 / error.sel(boundary="periodic").values[-4:] ** 2
    limit = float(np.average(periodic.conductivity_mean.values[-4:], weights=weight))
    x, y = size**-0.5, 1.0 - walls.conductivity_mean.values / limit
    w = (limit / error.sel(boundary="walls").values) ** 2
    big = size >= 128
    wall = float((w * x * y)[big].sum() / (w * x * x)[big].sum())
    ranges = {
        name: float(np.mean((size * (data.conductivity_std.sel(boundary=name).values / limit) ** 2)[big]))
        for name in ("periodic", "walls")
    }
    return {"limit": limit, "wall": wall} | {f"range_{name}": value for name, value in ranges.items()}


def draw(data: xarray.Dataset, fitted: dict[str, float], path: Path) -> None:
    """Mean and spread over size."""
    figure, (left, right) = new_panels(1, 2)
    size = data.particles.values
    fine = np.geomspace(size[0], size[-1])
    for name, marker, colour in (("periodic", "o", COLOURS[0]), ("walls", "s", COLOURS[1])):
        one = data.sel(boundary=name)
        half = 2.0 * one.conductivity_std / np.sqrt(one.realizations)
        left.errorbar(size, one.conductivity_mean, half, fmt=marker, color=colour, markersize=4, label=name)
        right.loglog(size, one.conductivity_std / fitted["limit"], marker, color=colour, markersize=4, label=name)
        right.loglog(fine, np.sqrt(fitted[f"range_{name}"] / fine), color=colour, linewidth=0.8)
    left.axhline(fitted["limit"], color=COLOURS[0], linewidth=0.8)
    left.plot(fine, fitted["limit"] * (1 - fitted["wall"] * fine**-0.5), color=COLOURS[1], linewidth=0.8)
    left.set(xscale="log", xlabel="disks", ylabel="effective conductivity [W/(m K)]")
    right.set(xlabel="disks", ylabel="standard deviation over the limit [-]")
    right.plot([], [], color=INK, linewidth=0.8, label="fit")
    legend(left)
    legend(right)
    save(figure, path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--largest", type=int, default=2048)
    parser.add_argument("--output", type=Path, default=HERE)
    arguments = parser.parse_args()
    data = run(arguments.largest)
    fitted = fit(data)
    data = data.assign_attrs(fitted)
    data.to_netcdf(arguments.output / "rve_size.nc")
    frame = data.to_dataframe().reset_index()
    spread = frame.conductivity_std / fitted["limit"]
    frame["realizations_for_1_percent"] = np.maximum(np.ceil((2.0 * spread / 0.01) ** 2), 1).astype(int)
    frame.to_csv(arguments.output / "table.csv", index=False, float_format="%.6g")
    draw(data, fitted, arguments.output / "figure.png")
    print(", ".join(f"{name} {value:.5g}" for name, value in fitted.items()))


if __name__ == "__main__":
    main()
