"""Epoxy filled with silica spheres: ``python studies/epoxy_silica/analyse.py [--output DIRECTORY] [--resolution N] ..``

Haddad et al. 2021 (10.1016/j.ijthermalsci.2020.106799), section 5: equal spheres, six diameters to the edge of the
cell, 10 to 50 % of them. FFT and particle lattice on the same cells, closed-form models and bounds; temperatures and
heat fluxes at four points of one cell between walls by both. Eight minutes on one core.
"""

from __future__ import annotations

import argparse
import csv
import time
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from etc_engine import Box, PackingSpec, ParticlePacking, pack, parse_radii
from etc_engine.engines.lattice.flux import probe
from etc_engine.engines.lattice.homogenize import homogenize_lattice, medium_lattice, node_conductivities
from etc_engine.engines.lattice.network import link_conductances
from etc_engine.engines.lattice.steady import solve_between_walls
from etc_engine.engines.voxel import homogenize_voxel, solve_cell, voxelize
from etc_engine.engines.voxel.section import sample, temperature_between_walls
from etc_engine.medium.medium import Medium, Pores
from etc_engine.medium.phases import find_owners
from etc_engine.models import CATALOGUE
from etc_engine.models.catalogue import find_model
from etc_engine.output.figures.canvas import COLOURS, GREY, INK, label_ends, legend, new_panels, save

HERE = Path(__file__).parent
SEED = 6203
EPOXY, SILICA = 0.195, 1.5
FRACTIONS = (0.1, 0.2, 0.3, 0.4, 0.5)
EDGE, DIAMETERS = 0.1, 6.0
MODELS = {
    "hashin_shtrikman_lower": (INK, "-"),
    "three_point_lower": (GREY, ":"),
    "third_order": (COLOURS[2], "-"),
    "three_point_upper": (GREY, "-."),
    "hashin_shtrikman_upper": (INK, "--"),
}
POINTS = {"A": (0.5, 0.6, 0.6), "B": (0.5, 0.02, 0.5), "C": (0.5, 0.3, 0.55), "D": (0.5, 0.82, 0.87)}
"""In edges of the cell, as in the paper's Table 3; the cell is our own, so its numbers are too."""
COLD, HOT = 25.0, 35.0


def cell(fraction: float, realization: int) -> Medium:
    """Spheres of a sixth of the edge, their number that of the fraction, in a periodic cube."""
    count = round(fraction * DIAMETERS**3 * 6.0 / np.pi)
    box = Box((EDGE,) * 3, (True,) * 3)
    spec = PackingSpec("lubachevsky-stillinger", parse_radii("equal"), box, count, fraction)
    rng = np.random.default_rng([SEED, round(1000 * fraction), realization])
    return Medium(pack(spec, rng), np.array(SILICA), pores=Pores(EPOXY))


def model(name: str, fraction) -> np.ndarray:
    return np.asarray(find_model(name).function(EPOXY, SILICA, fraction, dimension=3))


def sweep(realizations: int, shared: int, resolution: int, particles: int) -> xr.Dataset:
    """Mean of the diagonal for every cell, by FFT; by the lattice for the first ones."""
    shape = (len(FRACTIONS), realizations)
    k = {name: np.full(shape, np.nan) for name in ("voxel", "lattice", "voxel_error", "lattice_error", "spheres")}
    for i, fraction in enumerate(FRACTIONS):
        for r in range(realizations):
            composite = cell(fraction, r)
            k["spheres"][i, r] = composite.packing.count
            fft = homogenize_voxel(composite, resolution=resolution)
            k["voxel"][i, r], k["voxel_error"][i, r] = np.trace(fft.tensor) / 3.0, fft.model_error
            words = f"f = {fraction:.1f} cell {r}: FFT {k['voxel'][i, r]:.6f} ({fft.seconds:.1f} s)"
            if r < shared:
                rng = np.random.default_rng([SEED, i, r])
                lattice = homogenize_lattice(composite, particles=particles, rng=rng)
                k["lattice"][i, r] = np.trace(lattice.tensor) / 3.0
                k["lattice_error"][i, r] = lattice.model_error
                difference = 100.0 * (k["lattice"][i, r] / k["voxel"][i, r] - 1.0)
                words += f", lattice {k['lattice'][i, r]:.6f} ({lattice.seconds:.1f} s), {difference:+.3f} %"
            print(words, flush=True)
    meaning = {
        "voxel": ("effective conductivity by FFT, mean of the diagonal", "W m-1 K-1"),
        "lattice": ("effective conductivity by a particle lattice, mean of the diagonal", "W m-1 K-1"),
        "voxel_error": ("relative error of it, estimated", "1"),
        "lattice_error": ("relative error of it, estimated", "1"),
        "spheres": ("number of spheres", "1"),
    }
    data = xr.Dataset(
        {
            name: (
                ("volume_fraction", "realization"),
                values,
                {"long_name": meaning[name][0], "units": meaning[name][1]},
            )
            for name, values in k.items()
        },
        coords={"volume_fraction": list(FRACTIONS), "realization": np.arange(realizations)},
        attrs={
            "title": "epoxy filled with silica spheres, six diameters to the edge of a periodic cell",
            "matrix_conductivity": EPOXY,
            "inclusion_conductivity": SILICA,
            "resolution": resolution,
            "lattice_particles": particles,
            "seed": SEED,
        },
    )
    names = list(MODELS)
    values = np.array([model(name, np.array(FRACTIONS)) for name in names])
    data["model_conductivity"] = (("model", "volume_fraction"), values, {"units": "W m-1 K-1"})
    return data.assign_coords(model=names)


def extrapolate(data: xr.Dataset, shared: int) -> xr.Dataset:
    """FFT at half the resolution on the shared cells, and the limit 2 k_h - k_2h of an error of first order."""
    coarse = xr.full_like(data["voxel"], np.nan)
    for fraction in FRACTIONS:
        for r in range(shared):
            half = homogenize_voxel(cell(fraction, r), resolution=data.attrs["resolution"] // 2, estimate_error=False)
            coarse.loc[{"volume_fraction": fraction, "realization": r}] = np.trace(half.tensor) / 3.0
    limit = 2.0 * data["voxel"] - coarse
    limit.attrs = {"long_name": "effective conductivity by FFT, extrapolated to fine voxels", "units": "W m-1 K-1"}
    return data.assign(voxel_extrapolated=limit)


def report(data: xr.Dataset) -> None:
    """Means over all cells, and on the shared ones the lattice against both values of the FFT."""
    for f in FRACTIONS:
        at = data.sel(volume_fraction=f)
        words = [f"{f:.1f} {int(at['spheres'][0]):4d} spheres: FFT {float(at['voxel'].mean()):.5f} +- "]
        words.append(f"{float(at['voxel'].std(ddof=1)):.5f}; shared: lattice against FFT")
        for name in ("voxel", "voxel_extrapolated"):
            words.append(f" {100 * float((at['lattice'] / at[name] - 1.0).mean()):+.3f} %")
        words.append(f" (extrapolated), third order {model('third_order', f):.5f}, Maxwell {model('maxwell', f):.5f}")
        print("".join(words))


def compare_points(resolution: int, particles: int) -> list[dict[str, float | str]]:
    """Temperature and heat flux at four points by both engines: one cell of 20 % between walls along y."""
    periodic = cell(0.2, 0)
    walled = ParticlePacking(periodic.packing.centers, periodic.packing.radii, Box((EDGE,) * 3))
    composite = Medium(walled, np.array(SILICA), pores=Pores(EPOXY))
    points = EDGE * np.array(list(POINTS.values()))
    gradient = (HOT - COLD) / EDGE
    start = time.perf_counter()
    image = voxelize(composite, resolution)
    solved = solve_cell(image.conductivity, (EDGE,) * 3, boundary="walls", axes=(1,), keep_gradients=True)
    unit = np.ascontiguousarray(solved.gradients[0])
    temperature = COLD + gradient * sample(temperature_between_walls(unit, 1, EDGE), points, (EDGE,) * 3)
    field = gradient * image.conductivity.apply(unit)
    flux = np.sqrt(sum(sample(part, points, (EDGE,) * 3) ** 2 for part in field))
    seconds = time.perf_counter() - start
    made = medium_lattice(composite, particles, np.random.default_rng([SEED, 77]), boundary="walls")
    k = node_conductivities(composite, made.owner)
    links = link_conductances(made.lattice, k)
    steady = solve_between_walls(made.lattice, links, 1, temperatures=(COLD, HOT))
    found, vectors = probe(steady, points, k)
    lattice_flux = np.linalg.norm(vectors, axis=1)
    effective = steady.energy / (HOT - COLD) ** 2 / EDGE
    print(f"walls: FFT k_yy = {solved.tensor[1, 1]:.6f} ({seconds:.0f} s), lattice {effective:.6f} W/(m K)")
    phases = find_owners(composite.packing, points)
    return [
        {
            "point": name,
            "phase": "epoxy" if phase < 0 else "silica",
            "temperature_fft": t,
            "temperature_lattice": u,
            "flux_fft": q,
            "flux_lattice": p,
        }
        for name, phase, t, u, q, p in zip(POINTS, phases, temperature, found, flux, lattice_flux, strict=True)
    ]


def draw(data: xr.Dataset) -> Figure:
    figure, (left, right) = new_panels(1, 2, 4.4)
    f = np.linspace(0.0, 0.55, 111)
    base = model("third_order", f)
    for name, (colour, line) in MODELS.items():
        left.plot(f, model(name, f), color=colour, linestyle=line, linewidth=1.2, label=CATALOGUE[name].label)
        right.plot(f, 100.0 * (model(name, f) / base - 1.0), color=colour, linestyle=line, linewidth=1.2)
    x = data["volume_fraction"].values
    third = model("third_order", x)
    for name, colour, marker, shift, label in (
        ("voxel", COLOURS[0], "o", -0.004, "FFT"),
        ("lattice", COLOURS[1], "^", 0.004, "particle lattice"),
    ):
        known = data[name].count("realization").values
        mean = data[name].mean("realization").values
        spread = data[name].std("realization", ddof=1).values if known.max() > 1 else np.zeros_like(mean)
        cells = f"{known.max()} cells" if known.max() > 1 else "one cell"
        left.plot(x + shift, mean, marker, color=colour, markersize=6, label=f"{label}, {cells}")
        right.errorbar(
            x + shift,
            100.0 * (mean / third - 1.0),
            100.0 * spread / third,
            fmt=marker,
            color=colour,
            capsize=2,
            markersize=5,
        )
    limit = data["voxel_extrapolated"].mean("realization").values
    right.plot(x + 0.012, 100.0 * (limit / third - 1.0), "o", color=COLOURS[0], fillstyle="none", markersize=5)
    left.plot([], [], "o", color=COLOURS[0], fillstyle="none", label="FFT extrapolated, one cell")
    left.set_xlabel("volume fraction of silica [-]")
    right.set_xlabel("volume fraction of silica [-]")
    left.set_ylabel("effective conductivity [W/(m K)]")
    right.set_ylabel("difference from third order [%]")
    right.set_ylim(-6, 12)
    beyond = 100.0 * (model("hashin_shtrikman_upper", f) / base - 1.0)
    label_ends(right, [("", f, beyond)])
    legend(figure, *left.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--realizations", type=int, default=4)
    parser.add_argument("--shared", type=int, default=1, help="cells that the lattice solves too")
    parser.add_argument("--resolution", type=int, default=96)
    parser.add_argument("--particles", type=int, default=60_000)
    parser.add_argument("--output", type=Path, default=HERE)
    options = parser.parse_args()
    data = sweep(options.realizations, options.shared, options.resolution, options.particles)
    data = extrapolate(data, options.shared)
    data.to_netcdf(options.output / "epoxy_silica.nc", engine="netcdf4")
    save(draw(data), options.output / "figure.png")
    report(data)
    rows = compare_points(options.resolution, 2 * options.particles)
    with (options.output / "points.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    for row in rows:
        print(
            f"{row['point']} {row['phase']:6s} T {row['temperature_fft']:.3f} {row['temperature_lattice']:.3f} C, "
            f"q {row['flux_fft']:.2f} {row['flux_lattice']:.2f} W/m2"
        )


if __name__ == "__main__":
    main()
