"""``etc-engine solve``: the effective conductivity of one packing."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from etc_engine.cli.clock import Clock
from etc_engine.cli.contact_options import ContactWords, contact_options
from etc_engine.cli.distributed import distributed_option
from etc_engine.cli.particle_options import (
    SampleWords,
    particle_options,
    read_sample,
    warn,
)
from etc_engine.cli.physics_options import physics_options
from etc_engine.cli.solve_notes import trim_cropped_walls, warn_of_gap, warn_of_missing_contacts
from etc_engine.cli.solve_outputs import SolveOutputs, print_table, write_outputs
from etc_engine.cli.solve_request import BOND_GAP, SolveRequest, load_axes

if TYPE_CHECKING:
    from etc_engine.medium.conductivity import EffectiveConductivity
    from etc_engine.medium.medium import Medium
    from etc_engine.particle_files.table import ParticleTable


@click.command("solve")
@click.argument("particles", type=click.Path(path_type=Path))
@particle_options
@click.option("--axis", help="Load axis: x, y, z or all. By default x, in a periodic box all.")
@click.option(
    "--engine",
    default="dtem",
    show_default=True,
    metavar="dtem|pipe",
    help="dtem: thermal elements. pipe: pipe network of DEM codes.",
)
@click.option(
    "--method",
    metavar="WORD",
    help="dtem: chord, standard, enhanced, arc or exact. Where the pores conduct: cell or, for spheres, facets. "
    "pipe: chord or uniform, for spheres also holm or root-area. By default the first that fits.",
)
@click.option("--pipe-resistance", hidden=True)
@click.option("--modes", type=int, help="Flux modes of a contact. With --method exact or arc.")
@click.option("--degree", type=int, help="Polynomial degree on the edges of cells, 1 to 5. With --method cell.")
@click.option("--bounds", is_flag=True, help="Compute rigorous bounds too. With --method cell, for few disks.")
@click.option(
    "--contact-angle", type=float, help="Half-angle of bonded contacts [degrees]. Without it contacts are overlaps."
)
@click.option(
    "--bond-gap", type=float, default=BOND_GAP, show_default=True, help="Largest gap of a contact, in mean radii."
)
@click.option(
    "--conductivity",
    type=float,
    help="Conductivity of the particles [W/(m K)]. By default the column of the file, or 1.",
)
@click.option(
    "--pore-conductivity",
    type=float,
    default=0.0,
    show_default=True,
    help="Conductivity of the fluid or matrix in the pores [W/(m K)].",
)
@physics_options
@click.option(
    "--contact-resistance",
    type=float,
    default=0.0,
    show_default=True,
    help="Resistance of every contact, walls included [K/W, in 2D m K/W].",
)
@contact_options
@click.option("-o", "--output", type=click.Path(path_type=Path), help="netCDF with particles, contacts and fields.")
@click.option("--vtk", type=click.Path(path_type=Path), help="VTK PolyData (.vtp) for ParaView.")
@click.option("--plot", type=click.Path(path_type=Path), help="Picture of the temperature field.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
@click.option("--full", is_flag=True, help="With --json: the temperature of every contact too.")
@distributed_option
def solve_command(
    particles: Path,
    words: SampleWords,
    dumped: ContactWords,
    output: Path | None,
    vtk: Path | None,
    plot: Path | None,
    as_json: bool,
    full: bool,
    **given: Any,
) -> None:
    """Effective conductivity of the particles in a file.

    PARTICLES is one of: CSV with the columns x,y[,z],radius[,conductivity]. A LAMMPS or LIGGGHTS text dump. A netCDF
    (.nc) or VTK (.vtp) file of etc-engine pack. VTK, extended XYZ, YADE or MercuryDPM of another DEM code. The name -
    is standard input.

    Along the load axis one wall is held at the temperature 1 and the other at 0, unless the box is periodic.
    """
    clock = Clock()

    from etc_engine.cli.options import print_json
    from etc_engine.medium.sample_warnings import (
        bare_wall_warnings,
        box_warnings,
        digit_warnings,
        excess_warnings,
        narrow_bond_warnings,
        rarefied_warnings,
    )
    from etc_engine.realization import field_along, find_engine
    from etc_engine.realization.engines import linked_medium

    asked = SolveRequest(**given)
    outputs = SolveOutputs(output, vtk, plot)
    asked.refuse_words(outputs.wanted)
    engine = find_engine(asked.engine)
    outputs.check(particles)
    table = read_sample(particles, words)
    elastic = asked.physics.youngs_modulus, asked.physics.poisson_ratio
    medium = asked.medium(table, particles, dumped.network(table, words.frame, *elastic))
    axes = load_axes(asked.axis, medium.box)
    medium = trim_cropped_walls(medium, table, axes)
    method = asked.method or engine.default_method(medium.dimension, medium.pores.conduct)
    result = asked.solve(medium, engine, method, axes)
    between = asked.between_walls(medium, method, axes)
    field = None
    if full or outputs.wanted:
        field = field_along(medium, result, engine=engine.name, method=method, axis=axes[0])
    if field is not None:
        linked = field.medium
    else:  # in pores that conduct, heat takes more links than the contacts
        linked = linked_medium(medium, result, engine=engine.name, method=method, axis=axes[0])
    record = {**_record(asked, method, result, linked, axes, uniform=table.conductivity is None), **between}
    if field is not None and full:
        each = zip(field.medium.links.pairs.tolist(), field.contact_temperatures.tolist(), strict=True)
        record["contact_temperatures"] = [{"particles": pair, "temperature": value} for pair, value in each]
    for remark in engine.remarks(method, result):
        click.echo(f"etc-engine: warning: {remark}", err=True)
    conduct, of_file = medium.pores.conduct, dumped.contacts is not None
    if not conduct or of_file or asked.asks_for_contacts:
        warn_of_missing_contacts(medium.links, asked, given=of_file, pores_conduct=conduct)
    gap = asked.gap(medium.links)
    if dumped.contacts is None and not asked.closest:  # of the closest pairs there are as many, whatever the digits
        warn(digit_warnings(table, gap, bonded=asked.takes_gap))
    driven = [] if medium.pores.conduct else [axis for axis in axes if not medium.box.periodic[axis]]
    narrow = narrow_bond_warnings(medium.links) if asked.bonded and not conduct else []
    warn(box_warnings(table, driven, gap) + bare_wall_warnings(medium.links, driven, table.origin) + narrow)
    warn(
        rarefied_warnings(medium)
        + excess_warnings(result.tensor, medium.conductivity, medium.pores, result.model_error)
    )
    if dumped.contacts is None:
        warn_of_gap(
            asked, medium, record["conductivity"], partial(_with_gap, asked, table, particles, method, axes[:1])
        )
    if field is not None:
        write_outputs(outputs, field, record, table)
    record |= clock.record()
    if as_json:
        print_json(record)
    else:
        print_table(record)


def _with_gap(
    asked: SolveRequest,
    table: ParticleTable,
    particles: Path,
    method: str,
    axes: tuple[int, ...],
    gap: float,
) -> float:
    """The conductivity along an axis with another bond gap [W/(m K)]."""
    from etc_engine.realization import find_engine

    medium = replace(asked, bond_gap=gap).medium(table, particles, None)
    return float(asked.solve(medium, find_engine(asked.engine), method, axes).tensor[axes[0], axes[0]])


def _record(
    asked: SolveRequest,
    method: str,
    result: EffectiveConductivity[Any],
    medium: Medium,
    axes: tuple[int, ...],
    *,
    uniform: bool,
) -> dict[str, Any]:
    import numpy as np

    from etc_engine.cli.options import per_axis_and_tensor
    from etc_engine.realization import Status
    from etc_engine.structure.filling import find_filling

    network, axis, height = medium.links, axes[0], find_filling(medium.packing).fill_height
    percolates = bool(result.spans[axis])
    status = Status.OK if percolates else Status.NOT_PERCOLATING
    record: dict[str, Any] = {
        "engine": asked.engine,
        "method": method,
        "conductivity": float(result.tensor[axis, axis]),
        **per_axis_and_tensor(result.tensor, axes),
    }
    if result.bounds is not None:
        record["conductivity_bounds"] = result.bounds[axis]
    if np.isfinite(result.model_error):
        record["model_error_estimate"] = result.model_error
    return record | {
        "particles": medium.packing.count,
        "density": medium.packing.density,
        **({} if height is None else {"fill_height": height}),
        **({"particle_conductivity": float(medium.conductivity[0])} if uniform else {}),
        "pore_conductivity": medium.pores.conductivity,
        "contact_rule": network.rule,
        **({"contact_resistance": asked.contact_resistance} if asked.contact_resistance else {}),
        **asked.physics.record,
        "contacts": int(np.count_nonzero(network.angles[:, 0])),
        "links": network.count,
        "wall_contacts": int(np.count_nonzero(network.wall_angles[network.walls_of(axis)])),
        "unknowns": result.unknowns,
        "percolates": percolates,
        "status": int(status),
        "status_name": status.name.lower(),
        "iterations": result.iterations,
        "relative_energy_error": result.relative_energy_error,
    }
