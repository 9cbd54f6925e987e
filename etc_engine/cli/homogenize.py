"""``etc-engine homogenize``: the effective conductivity of inclusions in a matrix."""

from __future__ import annotations

import os
import sys
import time
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from etc_engine.cli.particle_options import SampleWords, particle_options, read_sample

if TYPE_CHECKING:
    from etc_engine.medium.composite import Composite, Homogenized
    from etc_engine.particle_files.table import ParticleTable

ENGINES = ("voxel", "lattice")


@click.command("homogenize")
@click.argument("inclusions", type=click.Path(path_type=Path))
@particle_options
@click.option("--engine", type=click.Choice(ENGINES), default="voxel", show_default=True, help="FFT, or particles.")
@click.option("--matrix", type=float, required=True, help="Conductivity of the matrix [W/(m K)].")
@click.option(
    "--inclusion", type=float, help="Conductivity of the inclusions [W/(m K)]; the file's column goes before."
)
@click.option(
    "--boundary",
    type=click.Choice(("periodic", "walls")),
    help="periodic (default of CSV), or walls: two isothermal faces, the others adiabatic. Default else: as the box.",
)
@click.option("--resolution", type=int, help="voxel: voxels along the shortest edge; 64 by default.")
@click.option("--solver", type=click.Choice(("cg", "eyre-milton")), help="voxel: iteration; cg by default.")
@click.option("--green", type=click.Choice(("rotated", "continuous")), help="voxel: Green operator; default rotated.")
@click.option("--voxels", type=click.Choice(("laminate", "binary")), help="voxel: at interfaces; default laminate.")
@click.option("--particles", type=int, help="lattice: number of particles, about; 20000 by default.")
@click.option("--seed", type=int, help="lattice: seed of its particles; 1 by default.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="netCDF with inclusions and result.")
@click.option(
    "--plot",
    type=click.Path(path_type=Path),
    help="voxel: picture of voxels and heat flux; of spheres a section through the largest area of inclusions.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def homogenize_command(
    inclusions: Path,
    words: SampleWords,
    engine: str,
    matrix: float,
    inclusion: float | None,
    boundary: str | None,
    resolution: int | None,
    solver: str | None,
    green: str | None,
    voxels: str | None,
    particles: int | None,
    seed: int | None,
    output: Path | None,
    plot: Path | None,
    as_json: bool,
) -> None:
    """Effective conductivity tensor of disks or spheres in a matrix.

    INCLUSIONS is a CSV file with the columns x,y,radius or x,y,z,radius (optionally conductivity), a LAMMPS/LIGGGHTS
    text dump, or a netCDF or VTK file as ``pack`` writes it. Overlapping inclusions count as their union; where
    their conductivities differ the radical plane divides them. 0 insulates, inf conducts perfectly.
    """
    start = time.perf_counter()
    import numpy as np

    from etc_engine.cli.options import check_picture, check_place, print_json
    from etc_engine.errors import InputError
    from etc_engine.medium.composite import Composite

    fft = {"resolution": resolution, "solver": solver, "green": green, "voxels": voxels, "plot": plot}
    lattice = {"particles": particles, "seed": seed}
    for name, value in (lattice if engine == "voxel" else fft).items():
        if value is not None:
            raise InputError(f"--{name} does not go with --engine {engine}")
    if plot is not None:
        check_picture(plot)
    for path in (output, plot):
        if path is not None:
            check_place(path, inclusions)
    table = read_sample(inclusions, words, unknown_periodic=boundary != "walls")
    if table.wrapped:
        moved = (
            "1 centre lay outside the box and was"
            if table.wrapped == 1
            else (f"{table.wrapped} centres lay outside the box and were")
        )
        click.echo(f"etc-engine: note: {moved} wrapped into it", err=True)
    given = inclusion if table.conductivity is None else table.conductivity
    if inclusion is not None and table.conductivity is not None:
        click.echo(f"etc-engine: note: --inclusion is not used: {inclusions} has a column 'conductivity'", err=True)
    if given is None:
        raise InputError("the conductivity of the inclusions is missing: give --inclusion, or a column 'conductivity'")
    composite = Composite(table.packing, matrix, np.asarray(given))
    if plot is not None and np.isinf(composite.inclusion).any():
        raise InputError("--plot needs finite conductivities: leave it out, or give the inclusions a large one")
    _warn_of_overlaps(composite)
    boundary = boundary or ("periodic" if all(table.packing.box.periodic) else "walls")
    if engine == "voxel":
        options = {name: value for name, value in fft.items() if value is not None and name != "plot"}
        result = _by_voxels(composite, boundary, options)
    else:
        result = _by_lattice(
            composite, boundary, 20_000 if particles is None else particles, 1 if seed is None else seed
        )
    record = _record(composite, engine, boundary, result)
    with ExitStack() as files:
        _write(files, output, table, composite, record)
        if plot is not None:
            _draw(files, plot, composite, boundary, record, options)
    record["seconds"] = time.perf_counter() - start
    if as_json:
        print_json(record)
    else:
        _print_table(record)


def _warn_of_overlaps(composite: Composite) -> None:
    count = composite.overlapping
    if count == 0:
        return
    who = "1 pair of inclusions overlaps: its" if count == 1 else f"{count} pairs of inclusions overlap: their"
    divided = ", divided by the radical plane where their conductivities differ"
    differ = bool((composite.inclusion != composite.inclusion[0]).any())
    click.echo(f"etc-engine: warning: {who} union counts once{divided if differ else ''}", err=True)


def _by_voxels(composite: Composite, boundary: str, options: dict[str, Any]) -> Homogenized:
    from etc_engine.engines.voxel import homogenize_voxel

    return homogenize_voxel(composite, boundary=boundary, threads=_threads(), **options)


def _threads() -> int:
    """Threads of this process, as the environment gives them to BLAS and OpenMP too."""
    word = os.environ.get("OMP_NUM_THREADS", "1")
    return int(word) if word.isdigit() and int(word) > 0 else 1


def _by_lattice(composite: Composite, boundary: str, particles: int, seed: int) -> Homogenized:
    import numpy as np

    from etc_engine.engines.lattice.homogenize import homogenize_lattice
    from etc_engine.errors import InputError

    if composite.dimension == 2:
        raise InputError("the lattice is made of spheres, the inclusions are disks: use --engine voxel")
    if seed < 0:
        raise InputError(f"a seed is a whole number of at least 0, found {seed}")
    return homogenize_lattice(composite, particles=particles, boundary=boundary, rng=np.random.default_rng(seed))


def _record(composite: Composite, engine: str, boundary: str, result: Homogenized) -> dict[str, Any]:
    from etc_engine.models.bounds import parallel, series

    record: dict[str, Any] = {
        "engine": engine,
        "boundary": boundary,
        "dimension": composite.dimension,
        "inclusions": composite.inclusions.count,
        "overlaps": composite.overlapping,
        "conductivity_tensor": result.tensor,
        "volume_fraction": result.volume_fraction,
    }
    if float(composite.inclusion.min()) == float(composite.inclusion.max()):
        phases = composite.matrix, float(composite.inclusion[0]), composite.volume_fraction
        record["conductivity_bounds"] = [float(series(*phases)), float(parallel(*phases))]
    return record | {
        "unknowns": result.unknowns,
        "iterations": result.iterations,
        "relative_error_estimate": result.relative_error_estimate,
    }


def _write(
    files: ExitStack, path: Path | None, table: ParticleTable, composite: Composite, record: dict[str, Any]
) -> None:
    """The inclusions with their conductivities, and the tensor, as netCDF."""
    if path is None:
        return
    from etc_engine.box import AXES
    from etc_engine.durable.files import replacing
    from etc_engine.durable.provenance import engine_version
    from etc_engine.particle_files.netcdf import packing_dataset

    attributes = {key: value for key, value in record.items() if key != "conductivity_tensor"}
    attributes |= {
        "title": f"effective conductivity of {composite.inclusions.count} inclusions in a matrix",
        "matrix_conductivity": composite.matrix,
        "source": f"etc_engine {engine_version()}",
        "command": " ".join(["etc-engine", *sys.argv[1:]]),
    }
    dataset = packing_dataset(replace(table, conductivity=composite.inclusion), attributes)
    axes = list(AXES[: composite.dimension])
    dataset["effective_conductivity"] = (
        ("direction_i", "direction_j"),
        record["conductivity_tensor"],
        {"long_name": "effective conductivity", "units": "W m-1 K-1"},
    )
    dataset = dataset.assign_coords(direction_i=axes, direction_j=axes)
    dataset.to_netcdf(files.enter_context(replacing(path)), engine="netcdf4")


def _draw(
    files: ExitStack, path: Path, composite: Composite, boundary: str, record: dict[str, Any], options: dict[str, Any]
) -> None:
    """A section, from one more solve that keeps the field."""
    from etc_engine.durable.files import replacing
    from etc_engine.engines.voxel.section import solve_section
    from etc_engine.output.figures.voxel import save_section

    section = solve_section(composite, boundary=boundary, threads=_threads(), **options)
    caption = f"k$_{{xx}}$ = {record['conductivity_tensor'][0, 0]:.6g} W/(m K), f = {record['volume_fraction']:.4f}"
    save_section(section, files.enter_context(replacing(path)), caption)


def _print_table(record: dict[str, Any]) -> None:
    for name, value in record.items():
        if name == "conductivity_tensor":
            text = "; ".join(" ".join(f"{k:.8g}" for k in row) for row in value)
        elif name == "conductivity_bounds":
            text = f"{value[0]:.8g} (series) to {value[1]:.8g} (parallel)"
        else:
            text = f"{value:.8g}" if isinstance(value, float) else str(value)
        unit = " W/(m K)" if name.startswith("conductivity") else ""
        click.echo(f"{name.replace('_', ' '):24s}{text}{unit}")
