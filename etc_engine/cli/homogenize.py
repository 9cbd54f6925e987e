"""``etc-engine homogenize``: the effective conductivity of inclusions in a matrix."""

from __future__ import annotations

import os
import sys
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from etc_engine.cli.clock import Clock
from etc_engine.cli.image_options import ImageTask, ImageWords, image_options, write_image_result
from etc_engine.cli.particle_options import SampleWords, parse_faces, particle_options, read_sample

if TYPE_CHECKING:
    from etc_engine.medium.conductivity import EffectiveConductivity
    from etc_engine.medium.medium import Medium
    from etc_engine.particle_files.table import ParticleTable
    from etc_engine.realization import Engine

LATTICE_PARTICLES = 20_000
"""Of a lattice for one medium, about; a sweep takes fewer."""


@click.command("homogenize")
@click.argument("inclusions", type=click.Path(path_type=Path))
@particle_options
@image_options
@click.option(
    "--engine",
    default="voxel",
    show_default=True,
    metavar="voxel|lattice",
    help="voxel: FFT on voxels. lattice: a network of many small particles.",
)
@click.option("--method", metavar="WORD", help="voxel: laminate or binary voxels. lattice: laguerre or contact.")
@click.option("--matrix", type=float, help="Conductivity of the matrix [W/(m K)].")
@click.option(
    "--inclusion", type=float, help="Conductivity of the inclusions [W/(m K)]. By default the column of the file."
)
@click.option(
    "--boundary",
    type=click.Choice(("periodic", "walls")),
    help="walls: two isothermal faces, the others adiabatic. By default that of the box, and periodic for a CSV file.",
)
@click.option("--resolution", type=int, help="voxel: voxels along the shortest edge. By default 64.")
@click.option("--solver", help="voxel: iteration, cg or eyre-milton. By default cg.")
@click.option("--green", help="voxel: Green operator. By default rotated.")
@click.option("--voxels", hidden=True)
@click.option("--particles", type=int, help="lattice: approximate number of particles. By default 20000.")
@click.option("--seed", type=int, help="lattice: seed of its particles. By default 1.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="netCDF with inclusions and result.")
@click.option(
    "--plot",
    type=click.Path(path_type=Path),
    help="voxel: picture of voxels and heat flux. For spheres: the section with the largest area of inclusions.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def homogenize_command(
    inclusions: Path,
    words: SampleWords,
    image: ImageWords,
    output: Path | None,
    plot: Path | None,
    as_json: bool,
    **given: Any,
) -> None:
    """Effective conductivity tensor of disks or spheres in a matrix.

    INCLUSIONS is a file of particles as etc-engine solve reads it, or a voxel image of labelled phases (.npy, TIFF,
    raw). --phases gives the conductivities of an image.

    Overlapping inclusions count as their union. Where their conductivities differ, the radical plane divides them. A
    conductivity of 0 is an insulator, inf a perfect conductor.
    """
    clock = Clock()
    import numpy as np

    from etc_engine.cli.options import check_netcdf, check_picture, check_place, print_json
    from etc_engine.errors import InputError
    from etc_engine.realization import effective_conductivity, find_engine

    if plot is not None:
        check_picture(plot)
    for path in (output, plot):
        if path is not None:
            check_place(path, inclusions)
    if output is not None:
        check_netcdf(output)
    if image.asked(inclusions):
        record = _of_image(inclusions, words, image, plot, given)
        if output is not None:
            write_image_result(output, record)
        record |= clock.record()
        (print_json if as_json else _print_table)(record)
        return
    if given["matrix"] is None:
        raise InputError("--matrix is missing: give the conductivity of the matrix [W/(m K)]")
    boundary, engine = given["boundary"], find_engine(given.pop("engine"))
    if engine.needs_contacts:
        raise InputError(f"engine {engine.name} works on contacts: use the command solve")
    table = read_sample(inclusions, words, unknown_periodic=boundary != "walls")
    if table.wrapped:
        moved = (
            "1 centre lay outside the box and was"
            if table.wrapped == 1
            else (f"{table.wrapped} centres lay outside the box and were")
        )
        click.echo(f"etc-engine: note: {moved} wrapped into it", err=True)
    medium = _medium(table, inclusions, given.pop("matrix"), given.pop("inclusion"))
    _warn_of_overlaps(medium)
    _warn_of_cuts(medium)
    boundary = boundary or ("periodic" if all(medium.box.periodic) else "walls")
    method, seed, options = _choices(engine, medium, given | {"boundary": boundary})
    if plot is not None and engine.section is None:
        raise InputError(f"--plot is not valid with --engine {engine.name}: it has no picture")
    if plot is not None and not np.isfinite(medium.conductivity).all():
        raise InputError("--plot needs finite conductivities: leave it out, or give the inclusions a large one")
    result = effective_conductivity(medium, engine=engine.name, method=method, tolerance=1e-8, seed=seed, **options)
    record = _record(medium, engine.name, method, boundary, result)
    with ExitStack() as files:
        _write(files, output, table, medium, record)
        if plot is not None:
            _draw(files, plot, engine.section, (medium, method, options), record)
    record |= clock.record()
    if as_json:
        print_json(record)
    else:
        _print_table(record)


def _of_image(
    path: Path, words: SampleWords, image: ImageWords, plot: Path | None, given: dict[str, Any]
) -> dict[str, Any]:
    """The record of a voxel image; options that mean nothing to it are refused."""
    from etc_engine.errors import InputError

    unused = {"--plot": plot, "--crop": words.crop, "--periodic": words.periodic, "--frame": words.frame}
    unused |= {f"--{name}": given[name] for name in ("method", "resolution", "green", "particles", "seed")}
    for name, value in unused.items():
        if value is not None:
            raise InputError(f"{name} is not valid with a voxel image")
    if given["engine"] != "voxel":
        raise InputError(f"a voxel image is solved by --engine voxel, found {given['engine']}")
    lengths = None if words.box is None else tuple(high - max(low, 0.0) for low, high in parse_faces(words.box))
    task = ImageTask(lengths, given["boundary"] or "periodic", given["solver"] or "cg", _threads())
    return image.solve(path, given["matrix"], given["inclusion"], task)


def _medium(table: ParticleTable, path: Path, matrix: float, inclusion: float | None) -> Medium:
    """The particles of a file, and the matrix as their pores."""
    import numpy as np

    from etc_engine.errors import InputError
    from etc_engine.medium.medium import Medium, Pores
    from etc_engine.medium.phases import check_phases

    given = inclusion if table.conductivity is None else table.conductivity
    if inclusion is not None and table.conductivity is not None:
        click.echo(f"etc-engine: note: --inclusion is not used: {path} has a column 'conductivity'", err=True)
    if given is None:
        raise InputError("the conductivity of the inclusions is missing: give --inclusion, or a column 'conductivity'")
    medium = Medium(table.packing, np.asarray(given), pores=Pores(matrix))
    check_phases(medium)
    return medium


def _choices(engine: Engine, medium: Medium, given: dict[str, Any]) -> tuple[str, int, dict[str, Any]]:
    """Method, seed and options of the engine out of the options that are given."""
    from etc_engine.errors import InputError

    voxels, method, seed = given.pop("voxels"), given.pop("method"), given.pop("seed")
    if voxels is not None:
        raise InputError(f"--voxels {voxels} is now --method {voxels}")
    method = method or engine.default_method(medium.dimension, medium.pores.conduct)
    heeded = engine.find_method(method).options
    for name, value in given.items():
        if value is not None and name not in heeded:
            raise InputError(f"--{name} is not valid with --engine {engine.name}")
    options = {name: value for name, value in given.items() if value is not None}
    if "particles" in heeded:
        options.setdefault("particles", LATTICE_PARTICLES)
    elif seed is not None:
        raise InputError(f"--seed is not valid with --engine {engine.name}")
    if "threads" in heeded:
        options["threads"] = _threads()
    if seed is not None and seed < 0:
        raise InputError(f"a seed is a whole number of at least 0, found {seed}")
    return method, 1 if seed is None else seed, options


def _warn_of_overlaps(medium: Medium) -> None:
    from etc_engine.medium.phases import count_overlaps

    count = count_overlaps(medium.packing)
    if count == 0:
        return
    who = "1 pair of inclusions overlaps: its" if count == 1 else f"{count} pairs of inclusions overlap: their"
    divided = ", divided by the radical plane where their conductivities differ"
    differ = bool((medium.conductivity != medium.conductivity[0]).any())
    click.echo(f"etc-engine: warning: {who} union counts once{divided if differ else ''}", err=True)


def _warn_of_cuts(medium: Medium) -> None:
    from etc_engine.structure.filling import find_losses

    losses = find_losses(medium.packing)
    if losses.cut_particles == 0:
        return
    who = "1 inclusion: it loses" if losses.cut_particles == 1 else f"{losses.cut_particles} inclusions: they lose"
    full, left = medium.packing.density, medium.packing.density - losses.cut
    click.echo(
        f"etc-engine: warning: walls cut {who} {losses.cut:.4g} of the box, so that the full fraction of {full:.4g} "
        f"becomes {left:.4g}",
        err=True,
    )


def _threads() -> int:
    """Threads of this process, as the environment gives them to BLAS and OpenMP too."""
    word = os.environ.get("OMP_NUM_THREADS", "1")
    return int(word) if word.isdigit() and int(word) > 0 else 1


def _record(
    medium: Medium, engine: str, method: str, boundary: str, result: EffectiveConductivity[Any]
) -> dict[str, Any]:
    from etc_engine.cli.options import per_axis_and_tensor
    from etc_engine.medium.phases import count_overlaps
    from etc_engine.models.bounds import parallel, series
    from etc_engine.structure.filling import find_losses

    losses = find_losses(medium.packing)
    kappa, pores = medium.conductivity, medium.pores.conductivity
    record: dict[str, Any] = {
        "engine": engine,
        "method": method,
        "boundary": boundary,
        "dimension": medium.dimension,
        "inclusions": medium.packing.count,
        "overlaps": count_overlaps(medium.packing),
        **per_axis_and_tensor(result.tensor, tuple(range(medium.dimension))),
        "volume_fraction": result.solid_fraction,
        "full_volume_fraction": medium.packing.density,
        "overlap_volume_fraction": losses.overlap,
        "cut_volume_fraction": losses.cut,
        "cut_inclusions": losses.cut_particles,
    }
    if float(kappa.min()) == float(kappa.max()):
        phases = pores, float(kappa[0]), medium.solid_fraction
        record["conductivity_bounds"] = [float(series(*phases)), float(parallel(*phases))]
    return record | {
        "unknowns": result.unknowns,
        "iterations": result.iterations,
        "relative_error_estimate": result.model_error,
    }


def _write(files: ExitStack, path: Path | None, table: ParticleTable, medium: Medium, record: dict[str, Any]) -> None:
    """The inclusions with their conductivities, and the tensor, as netCDF."""
    if path is None:
        return
    from etc_engine.box import AXES
    from etc_engine.cli.options import tensor_of
    from etc_engine.durable.files import replacing
    from etc_engine.durable.provenance import engine_version
    from etc_engine.particle_files.netcdf import packing_dataset

    attributes = {key: value for key, value in record.items() if not key.startswith("conductivity_")}
    if "conductivity_bounds" in record:
        attributes["conductivity_bounds"] = record["conductivity_bounds"]
    attributes |= {
        "title": f"effective conductivity of {medium.packing.count} inclusions in a matrix",
        "matrix_conductivity": medium.pores.conductivity,
        "source": f"etc_engine {engine_version()}",
        "command": " ".join(["etc-engine", *sys.argv[1:]]),
    }
    dataset = packing_dataset(replace(table, conductivity=medium.conductivity), attributes)
    axes = list(AXES[: medium.dimension])
    dataset["effective_conductivity"] = (
        ("direction_i", "direction_j"),
        tensor_of(record),
        {"long_name": "effective conductivity", "units": "W m-1 K-1"},
    )
    dataset = dataset.assign_coords(direction_i=axes, direction_j=axes)
    dataset.to_netcdf(files.enter_context(replacing(path)), engine="netcdf4")


def _draw(
    files: ExitStack, path: Path, section: Any, task: tuple[Medium, str, dict[str, Any]], record: dict[str, Any]
) -> None:
    """A section, from one more solve that keeps the field."""
    from etc_engine.durable.files import replacing
    from etc_engine.output.figures.voxel import save_section

    caption = f"k$_{{xx}}$ = {record['conductivity_per_axis']['x']:.6g} W/(m K), f = {record['volume_fraction']:.4f}"
    save_section(section(*task), files.enter_context(replacing(path)), caption)


def _print_table(record: dict[str, Any]) -> None:
    for name, value in record.items():
        if name == "conductivity_tensor":
            text = "; ".join(" ".join(f"{k:.8g}" for k in row) for row in value)
        elif name == "conductivity_per_axis":
            text = ", ".join(f"{axis} {k:.8g}" for axis, k in value.items())
        elif name == "conductivity_bounds":
            text = f"{value[0]:.8g} (series) to {value[1]:.8g} (parallel)"
        else:
            text = f"{value:.8g}" if isinstance(value, float) else str(value)
        unit = " W/(m K)" if name.startswith("conductivity") else ""
        click.echo(f"{name.replace('_', ' '):24s}{text}{unit}")
